//! The power balance, equations (5) to (11).
//!
//! With a focused beam and σ⁰ constant over the spot, equation (8) is
//! P_r = P_t · A_eq/(4πR²) · σ⁰(θ), and with (10) it becomes equation (11):
//! P_r = P_t · (A_eq/R²) · f(θ) · cos²θ.

use super::settings::{Footprint, Radar};
use crate::units::{ratio_from_db, watts_from_dbm};

/// Everything in equation (11) that belongs to the instrument and not to the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Transmitted power P_t, W.
    pub transmit_power_w: f64,
    /// Equivalent area of the receiving antenna A_eq, m².
    pub aperture_m2: f64,
    /// Two-way losses and calibration as a power ratio, 1 for none, smaller for a loss.
    pub system_gain_ratio: f64,
    /// How a tilted surface spreads the spot.
    pub footprint: Footprint,
}

impl Link {
    /// The link of a radar.
    pub fn new(radar: &Radar) -> Link {
        Link {
            transmit_power_w: watts_from_dbm(radar.transmit_power_dbm),
            aperture_m2: radar.aperture_m2,
            system_gain_ratio: ratio_from_db(-radar.system_loss_db),
            footprint: radar.footprint,
        }
    }

    /// Equation (11): received power, W, from range (m), cosine of incidence and f (1/sr).
    pub fn power_w(&self, range_m: f64, cos_theta: f64, f_per_sr: f64) -> f64 {
        self.flux_w(cos_theta) * self.received_per_w(range_m, cos_theta, f_per_sr)
    }

    /// Power that a surface under the spot is taken to receive, W, losses included.
    pub fn flux_w(&self, cos_incidence: f64) -> f64 {
        let spread = match self.footprint {
            Footprint::Paper => cos_incidence,
            Footprint::Projected => 1.0,
        };
        self.transmit_power_w * self.system_gain_ratio * spread
    }

    /// Share of the power on a surface that it sends, with f (1/sr), into the antenna at a distance
    /// (m): f·cos θ_o·A_eq/R².
    pub fn received_per_w(&self, range_m: f64, cos_exit: f64, f_per_sr: f64) -> f64 {
        f_per_sr * cos_exit * self.aperture_m2 / (range_m * range_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::dbm_from_watts;

    const LINK: Link = Link {
        transmit_power_w: 0.01,
        aperture_m2: 0.2,
        system_gain_ratio: 0.1,
        footprint: Footprint::Paper,
    };

    #[test]
    fn power_matches_a_hand_calculation() {
        // 10 dBm − 10 dB + 10·lg(0.2/64) + 10·lg(0.5) + 20·lg(0.5) = −34.0824 dBm
        let power_dbm = dbm_from_watts(LINK.power_w(8.0, 0.5, 0.5));
        assert!((power_dbm + 34.0824).abs() < 1e-4, "{power_dbm}");
    }

    #[test]
    fn the_projected_footprint_has_one_cosine_less() {
        let projected = Link { footprint: Footprint::Projected, ..LINK };
        let ratio = projected.power_w(8.0, 0.25, 0.5) / LINK.power_w(8.0, 0.25, 0.5);
        assert!((ratio - 4.0).abs() < 1e-12);
    }
}
