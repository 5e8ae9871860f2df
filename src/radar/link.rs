//! The power balance, equations (5) to (11).
//!
//! With a focused beam and σ⁰ constant over the spot, equation (8) is
//! P_r = P_t · A_eq/(4πR²) · σ⁰(θ), and with (10) it becomes equation (11):
//! P_r = P_t · Ω · f(θ) · cos²θ with Ω = A_eq/R². The beam's own Ω is λ²/(π·w²), see
//! [`beam`](super::beam); a stated area A_eq takes its place.

use super::beam::{Beam, GaussianBeam};
use super::settings::{Footprint, Radar};
use crate::units::{ratio_from_db, watts_from_dbm};

/// Everything in equation (11) that belongs to the instrument and not to the surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Link {
    /// Transmitted power P_t, W.
    pub transmit_power_w: f64,
    /// Equivalent area of the receiving antenna A_eq, m², where it is stated; else it is the beam's.
    pub aperture_m2: Option<f64>,
    /// Two-way losses and calibration as a power ratio, 1 for none, smaller for a loss.
    pub system_gain_ratio: f64,
    /// Loss of the air, dB per metre of a path.
    pub air_loss_db_per_m: f64,
    /// How a tilted surface spreads the spot.
    pub footprint: Footprint,
    /// The antenna's beams.
    pub beam: Beam,
}

/// The antenna's solid angle along a beam: Ω(R) = level/(offset + ((R − middle)/depth)²).
///
/// The beam's own has the level λ²/(π·w₀²), the offset 1, the focus as its middle and z_R as its depth. That of a
/// stated area, A_eq/R², has no offset, and the radar as its middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SolidAngle {
    /// Its level, sr.
    pub level_sr: f64,
    /// The offset, a pure number.
    pub offset: f64,
    /// The middle, m from the radar.
    pub middle_m: f64,
    /// The depth, m.
    pub depth_m: f64,
}

impl SolidAngle {
    /// At a distance from the radar, m.
    pub fn at_sr(&self, range_m: f64) -> f64 {
        let depths = (range_m - self.middle_m) / self.depth_m;
        self.level_sr / (self.offset + depths * depths)
    }
}

impl Link {
    /// The link of a radar.
    pub fn new(radar: &Radar) -> Link {
        Link {
            transmit_power_w: watts_from_dbm(radar.transmit_power_dbm),
            aperture_m2: radar.aperture_m2,
            system_gain_ratio: ratio_from_db(-radar.system_loss_db),
            air_loss_db_per_m: radar.air_loss_db_per_m,
            footprint: radar.footprint,
            beam: Beam::new(radar),
        }
    }

    /// Ω, sr: the antenna's solid angle as a surface sees it that lies in the beam, at this distance
    /// along the beam, m.
    pub fn solid_angle_sr(&self, beam: &GaussianBeam, range_m: f64) -> f64 {
        self.solid_angle(beam).at_sr(range_m)
    }

    /// How the antenna's solid angle depends on the distance along a beam.
    pub fn solid_angle(&self, beam: &GaussianBeam) -> SolidAngle {
        match self.aperture_m2 {
            Some(aperture_m2) => {
                SolidAngle { level_sr: aperture_m2, offset: 0.0, middle_m: 0.0, depth_m: 1.0 }
            }
            None => SolidAngle {
                level_sr: beam.section(beam.focus_m).solid_angle_sr(),
                offset: 1.0,
                middle_m: beam.focus_m,
                depth_m: beam.rayleigh_m(),
            },
        }
    }

    /// Loss of the air on a path, dB, from its whole length, m, there and back.
    pub fn air_loss_db(&self, path_m: f64) -> f64 {
        self.air_loss_db_per_m * path_m
    }

    /// Share of the power that the air lets through on a path, from its whole length, m, there and back. 1 exactly where
    /// the air has no loss.
    pub fn air_share(&self, path_m: f64) -> f64 {
        if self.air_loss_db_per_m == 0.0 { 1.0 } else { ratio_from_db(-self.air_loss_db(path_m)) }
    }

    /// Equation (11): power, W, that the radar receives from a surface in a beam, from the range (m), the
    /// cosine of incidence and f (1/sr), with the loss of the air.
    pub fn power_w(&self, beam: &GaussianBeam, range_m: f64, cos_theta: f64, f_per_sr: f64) -> f64 {
        let bare_w = self.flux_w(cos_theta) * f_per_sr * cos_theta;
        bare_w * self.solid_angle_sr(beam, range_m) * self.air_share(2.0 * range_m)
    }

    /// Power that a surface under the spot is taken to receive, W, losses included except that of the air, which
    /// depends on the whole path.
    pub fn flux_w(&self, cos_incidence: f64) -> f64 {
        let spread = match self.footprint {
            Footprint::Paper => cos_incidence,
            Footprint::Projected => 1.0,
        };
        self.transmit_power_w * self.system_gain_ratio * spread
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{db_from_ratio, dbm_from_watts};

    /// A radar with an aperture of 0.2 m², or the beam's own, and its beam to the middle of the target plane.
    fn link(aperture_m2: Option<f64>) -> (Link, GaussianBeam) {
        let radar = Radar {
            transmit_power_dbm: 10.0,
            system_loss_db: 10.0,
            aperture_m2,
            ..Radar::default()
        };
        let link = Link::new(&radar);
        (link, link.beam.towards(0.0, 0.0))
    }

    #[test]
    fn power_matches_a_hand_calculation() {
        // 10 dBm − 10 dB + 10·lg(0.2/64) + 10·lg(0.5) + 20·lg(0.5) = −34.0824 dBm; by the beam's own area
        // 10 − 10 − 27.641 − 3.0103 − 6.0206 dBm.
        for (aperture_m2, expected_dbm) in [(Some(0.2), -34.0824), (None, -36.6723)] {
            let (link, beam) = link(aperture_m2);
            let power_dbm = dbm_from_watts(link.power_w(&beam, 8.0, 0.5, 0.5));
            assert!((power_dbm - expected_dbm).abs() < 1e-3, "{power_dbm}");
        }
    }

    #[test]
    fn the_projected_footprint_has_one_cosine_less() {
        let (link, beam) = link(None);
        let projected = Link { footprint: Footprint::Projected, ..link };
        let ratio = projected.power_w(&beam, 8.0, 0.25, 0.5) / link.power_w(&beam, 8.0, 0.25, 0.5);
        assert!((ratio - 4.0).abs() < 1e-12);
    }

    #[test]
    fn air_takes_its_loss_on_the_whole_path_and_nothing_without_one() {
        let (link, beam) = link(None);
        assert_eq!(link.air_share(1e4), 1.0);
        let through = Link { air_loss_db_per_m: 0.25, ..link };
        for range_m in [6.0, 8.0] {
            let ratio =
                through.power_w(&beam, range_m, 0.5, 1.0) / link.power_w(&beam, range_m, 0.5, 1.0);
            assert!((db_from_ratio(ratio) + 0.5 * range_m).abs() < 1e-12);
        }
    }

    #[test]
    fn the_range_acts_by_the_beam_s_radius_alone() {
        let (link, beam) = link(None);
        let at = |range_m| link.power_w(&beam, range_m, 1.0, 1.0);
        for z_m in [-1.0, -0.2, 0.2, 1.0] {
            let zeta = z_m / beam.rayleigh_m();
            let found_db = db_from_ratio(at(8.0 + z_m) / at(8.0));
            assert!((found_db + db_from_ratio(1.0 + zeta * zeta)).abs() < 1e-12, "{z_m}");
        }
    }
}
