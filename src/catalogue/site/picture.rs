//! Levels over the angle of incidence, drawn for a page.

use super::levels::range_deg;
use crate::formats::figure::{Inline, Plot, Series, Style};
use crate::material::Material;

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
    /// What is drawn, the first lowest, each with its classes of the style: ink and kind.
    pub(super) series: Vec<(String, Series)>,
}

impl Picture<'_> {
    /// The drawing; none when there is nothing finite to draw.
    pub(super) fn svg(self, material: &Material) -> Option<String> {
        let (classes, series): (Vec<String>, Vec<Series>) = self.series.into_iter().unzip();
        let plot = Plot {
            title: &self.title,
            x_label: "angle of incidence, °",
            y_label: self.y_label,
            x_range: Some((0.0, 90.0)),
            y_range: Some(level_range_db(&series)?),
            series,
            ..Plot::default()
        };
        let [least_deg, most_deg] = range_deg(material);
        let page = Inline {
            id: &self.id,
            description: &self.description,
            claimed: (least_deg, most_deg),
            classes: &classes,
        };
        plot.inline_svg(&page).ok()
    }
}

/// Around everything but bands, which may reach far; with so much room that rounding is not shown as structure.
fn level_range_db(series: &[Series]) -> Option<(f64, f64)> {
    let drawn = series.iter().filter(|series| series.style != Style::Band);
    let levels = drawn.flat_map(|s| &s.points).map(|p| p.1).filter(|level| level.is_finite());
    let (low, high) = (levels.clone().reduce(f64::min)?, levels.reduce(f64::max)?);
    let room = (0.06 * (high - low)).max(1.0);
    Some((low - room, high + room))
}
