//! The receiver: noise, speckle and saturation.

use super::ceiling::{Ceiling, SaturationCurve};
use crate::radar::Radar;

/// The distribution of received powers about their mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Looks L of the speckle.
    pub looks: f64,
    /// Mean thermal power, W.
    pub noise_w: f64,
    /// Standard deviation of each of the two random tilts of the normal under a chirp, rad.
    pub tilt_sd_rad: f64,
    /// The saturation.
    pub ceiling: Ceiling,
}

impl Receiver {
    /// A receiver without speckle, noise, tilts and saturation.
    pub const LINEAR: Receiver =
        Receiver { looks: f64::INFINITY, noise_w: 0.0, tilt_sd_rad: 0.0, ceiling: Ceiling::NONE };

    /// The saturation curve for its speckle.
    pub fn saturating(&self) -> SaturationCurve {
        self.ceiling.over(self.looks)
    }

    /// The receiver that a radar declares: its speckle (infinitely many looks if it has none), and the
    /// thermal noise of its `[radar.noise]`.
    pub fn declared(radar: &Radar) -> Receiver {
        Receiver {
            looks: radar.speckle.map_or(f64::INFINITY, |speckle| speckle.looks),
            noise_w: radar.noise_w(),
            ..Receiver::LINEAR
        }
    }
}
