//! Levels over the angle of incidence, drawn for a page.

use super::levels::range_deg;
use crate::formats::figure::{Inline, Plot, Series};
use crate::material::Material;

/// Least room above and below the data, dB, so that rounding is not shown as structure.
const LEAST_ROOM_DB: f64 = 1.0;
/// Room right of the last angle, °.
const ROOM_DEG: f64 = 2.0;

/// A picture over the angle of incidence, °.
pub(super) struct Picture<'a> {
    /// Start of its element ids, one picture each.
    pub(super) id: String,
    /// What is drawn.
    pub(super) title: String,
    /// The same in a sentence or two, for those who do not see it.
    pub(super) description: String,
    /// Quantity and unit upwards.
    pub(super) y_label: &'a str,
    /// Least and greatest level; around the data if `None`.
    pub(super) y_range: Option<(f64, f64)>,
    /// What is drawn, the first lowest, each with its classes of the style: ink and kind.
    pub(super) series: Vec<(String, Series)>,
}

impl Picture<'_> {
    /// The drawing; none when there is nothing finite to draw.
    pub(super) fn svg(self, material: &Material) -> Option<String> {
        let (classes, series): (Vec<String>, Vec<Series>) = self.series.into_iter().unzip();
        let claimed = range_deg(material);
        let mut plot = Plot {
            title: &self.title,
            x_label: "angle of incidence, °",
            y_label: self.y_label,
            series,
            ..Plot::default()
        };
        let last_deg = plot.x_span()?.1.max(claimed[1]);
        plot.x_range = Some((0.0, (last_deg + ROOM_DEG).min(90.0)));
        let (low_db, high_db) = self.y_range.or_else(|| plot.y_span())?;
        plot.y_range = Some((low_db - LEAST_ROOM_DB, high_db + LEAST_ROOM_DB));
        let page = Inline {
            id: &self.id,
            description: &self.description,
            claimed: (claimed[0], claimed[1]),
            classes: &classes,
        };
        plot.inline_svg(&page).ok()
    }
}
