//! A path from the radar to an antenna, and the sum over several.

use crate::radar::Detection;
use crate::trace::Hit;

/// A path from the radar to the antenna.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Half of the path's length, with what sheets on it seem to add, m.
    pub range_m: f64,
    /// Mean power that arrives, W, as the share of one ray of the spot.
    pub power_w: f64,
    /// Intersection with the first surface that scatters on the path.
    pub hit: Hit,
    /// Number of sheets that the radar's ray passes before the first surface.
    pub sheets: u8,
    /// Share of the power, 0 to 1, that all sheets on the path let through.
    pub passed_share: f64,
    /// Number of surfaces on the path, 1 or 2.
    pub surfaces: u8,
    /// Azimuth of the source about the normal of the first surface, from its grain, rad.
    pub azimuth_rad: f64,
    /// Share of the power that is specular at every surface of the path, 0 to 1.
    pub specular_share: f64,
    /// Share of the power, 0 to 1, that comes back in one phase from the whole spot and does not speckle.
    pub coherent_share: f64,
}

/// Total power, and the mean range weighted by power; without power, the plain mean of the ranges.
pub(super) fn sum(paths: &[Path]) -> Detection {
    let power_w: f64 = paths.iter().map(|path| path.power_w).sum();
    let range_m = if power_w > 0.0 {
        paths.iter().map(|path| path.range_m * path.power_w).sum::<f64>() / power_w
    } else {
        paths.iter().map(|path| path.range_m).sum::<f64>() / paths.len() as f64
    };
    Detection { range_m, power_w }
}
