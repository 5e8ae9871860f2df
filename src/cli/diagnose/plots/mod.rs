//! The pictures of a diagnosis.

mod covariates;
mod maps;
mod quantiles;
mod summary;

use crate::diagnose::Report;
use crate::error::Error;
use crate::formats::figure::drawing::Drawing;
use crate::formats::figure::{FigureError, Series, Style};
pub(super) use maps::{Peak, strongest};

/// The models that a picture shows: where nothing was added there is no after.
fn shown<T>(report: &Report, [before, after]: [T; 2]) -> Vec<T> {
    match report.effects.is_empty() {
        true => vec![before],
        false => vec![before, after],
    }
}

/// Names of the models in a legend.
fn names(report: &Report) -> [&'static str; 2] {
    match report.effects.is_empty() {
        true => ["base model", ""],
        false => ["before", "after"],
    }
}

/// One picture: a file for a paper, and panels that a page can put below each other.
pub(super) struct Picture {
    /// Name of its files without their ending.
    pub file: &'static str,
    /// What it is.
    pub title: &'static str,
    /// What it says, for who does not see it, and below it for who does.
    pub caption: String,
    /// Its parts.
    pub panels: Vec<Drawing>,
    /// Panels in a row of the file.
    pub columns: usize,
}

impl Picture {
    /// Its files: name and bytes.
    pub fn files(&self) -> Result<[(String, Vec<u8>); 2], Error> {
        let page = Drawing::grid(&self.panels, self.columns);
        let svg = page.svg().map_err(FigureError::from)?;
        let png = page.png().map_err(FigureError::from)?;
        Ok([(format!("{}.svg", self.file), svg.into_bytes()), (format!("{}.png", self.file), png)])
    }
}

/// All pictures, most telling first, and a sentence for each that cannot be drawn.
pub(super) fn pictures(report: &Report, spot_m: f64) -> (Vec<Picture>, Vec<String>) {
    let drawn = [
        maps::residuals(report, spot_m),
        maps::quantiles(report, spot_m),
        maps::unknown(report, spot_m),
        covariates::picture(report),
        quantiles::picture(report),
        summary::ranking(report),
        summary::error(report),
    ];
    let (mut pictures, mut notices) = (Vec::new(), Vec::new());
    for picture in drawn {
        match picture {
            Ok(picture) if picture.panels.is_empty() => {}
            Ok(picture) => pictures.push(picture),
            // The numbers are worth having without it.
            Err(error) => notices.push(format!("a picture is left out: {error}")),
        }
    }
    (pictures, notices)
}

/// y over x as a thin line, from so many points that the ends of the axes can cut it.
fn guide(name: &str, [from, to]: [f64; 2], y: impl Fn(f64) -> f64) -> Series {
    const STEPS: u32 = 400;
    let x = |step: u32| from + (to - from) * f64::from(step) / f64::from(STEPS);
    let points = (0..=STEPS).map(|step| (x(step), y(x(step)))).collect();
    Series { name: name.to_owned(), style: Style::Guide, points }
}
