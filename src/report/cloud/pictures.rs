//! The pictures of a diagnosis.

use super::raster::Plane;
use super::{bars, maps, quantiles, trends};
use crate::diagnose::Report;
use crate::report::picture::Picture;

/// All pictures, the most informative first, and a sentence for each that cannot be drawn.
pub(super) fn pictures(report: &Report, plane: Plane) -> (Vec<Picture>, Vec<String>) {
    let drawn = [
        maps::residuals(report, plane),
        maps::quantiles(report, plane),
        maps::unknown(report, plane),
        trends::picture(report),
        quantiles::picture(report),
        bars::ranking(report),
        bars::error(report),
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
