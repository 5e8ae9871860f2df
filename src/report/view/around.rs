//! What stands around a cloud: the radar with its scan, and an image of the target plane.

use std::f64::consts::TAU;

use glam::DVec3;

use super::page::{Instrument, Numbers, PlaneImage};
use crate::error::Error;
use crate::formats::base64::base64;
use crate::formats::figure::{Figure, Scale};
use crate::frames::{Global, Point, Pose, Target};
use crate::geometry::Raster;
use crate::radar::{Chirps, Radar};

/// Corners of the outline of a spot.
const CORNERS: u32 = 48;

/// A radar, and where it looks.
pub(super) fn instrument(radar: &Radar, chirps: &Chirps) -> Instrument {
    let frames = radar.frames();
    let target = &frames.global_from_target;
    let aims = chirps.target_points_m(&frames);
    let radius_m = 0.5 * radar.spot_fwhm_m();
    let outline = (0..=CORNERS).map(|corner| {
        let (sin, cos) = (f64::from(corner) / f64::from(CORNERS) * TAU).sin_cos();
        in_plane(target, radius_m * cos, radius_m * sin)
    });
    Instrument {
        origin_m: frames.origin().xyz.to_array(),
        target_m: in_plane(target, 0.0, 0.0).to_array(),
        path_m: Numbers::places(aims.map(|aim| in_plane(target, aim.x, aim.y))),
        spot_m: Numbers::places(outline),
    }
}

/// A channel of a raster of the target plane as an image, in the colours of a figure. `label`: what the colours are.
///
/// # Errors
/// A raster without this channel.
pub(super) fn plane_image(
    raster: &Raster,
    channel: &str,
    (scale, range): (Scale, Option<(f64, f64)>),
    label: String,
) -> Result<PlaneImage, Error> {
    let figure = Figure {
        raster,
        channel,
        title: "",
        subtitle: "",
        colour_label: "",
        range,
        scale,
        gaps: "",
        x_label: "",
        y_label: "",
    };
    Ok(PlaneImage {
        label,
        png: base64(&figure.pixels()?),
        rows: raster.height,
        columns: raster.width,
        from_m: [raster.x_m(0), raster.y_m(0)],
        step_m: [raster.pixel_m, -raster.pixel_m],
    })
}

/// A place in the target plane.
pub(super) fn in_plane(global_from_target: &Pose<Global, Target>, x_m: f64, y_m: f64) -> DVec3 {
    (*global_from_target * Point::<Target>::new(x_m, y_m, 0.0)).xyz
}
