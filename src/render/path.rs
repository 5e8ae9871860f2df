//! One way from the radar to an antenna, and the sum over several.

use crate::radar::Detection;
use crate::trace::Hit;

/// One way from the radar to the antenna.
#[derive(Clone, Copy, Debug)]
pub(super) struct Path {
    /// Half of its length, m.
    pub range_m: f64,
    /// Mean power that arrives by it, W, per ray of the spot.
    pub power_w: f64,
    /// Where it met the first surface.
    pub hit: Hit,
    /// Surfaces met, 1 or 2.
    pub surfaces: u8,
    /// Azimuth of the source about the first surface's normal, from its grain, rad.
    pub azimuth_rad: f64,
    /// Share of the power that every surface on the way reflects like a mirror, rough or not.
    pub specular_share: f64,
}

/// All power, and the mean range weighted by it; where no power comes back, the plain mean.
pub(super) fn sum(paths: &[Path]) -> Detection {
    let power_w: f64 = paths.iter().map(|path| path.power_w).sum();
    let range_m = if power_w > 0.0 {
        paths.iter().map(|path| path.range_m * path.power_w).sum::<f64>() / power_w
    } else {
        paths.iter().map(|path| path.range_m).sum::<f64>() / paths.len() as f64
    };
    Detection { range_m, power_w }
}
