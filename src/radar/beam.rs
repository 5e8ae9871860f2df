//! The spot: how wide the beam is where it meets a surface (paper, Sec. II-B).
//!
//! The beam is Gaussian. At the focus its intensity falls to half on a circle of the spot's diameter;
//! away from it, along the beam, it widens as a Gaussian beam does, with the Rayleigh length
//! z_R = π·w₀²/λ, where the waist w₀ (1/e² of the intensity) is the diameter over √(2·ln 2). Off the
//! centre of the field of view the paper says that the spot grows, but not how; we let it grow with
//! the square of the distance.

use std::f64::consts::{LN_2, PI};

use super::scan::PATTERN_RANGE_M;
use super::settings::{BeamEntry, Radar};
use crate::frames::{Global, Point, Pose, Ray, Target};
use crate::units::SPEED_OF_LIGHT_M_PER_S;

/// The beam of a radar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Beam {
    entry: BeamEntry,
    /// Diameter at the centre of the field of view and the focus, m.
    focal_diameter_m: f64,
    rayleigh_m: f64,
    target_from_global: Pose<Target, Global>,
}

impl Beam {
    /// The beam of a radar.
    pub fn new(radar: &Radar) -> Beam {
        let wavelength_m = SPEED_OF_LIGHT_M_PER_S / (radar.centre_frequency_ghz * 1e9);
        let waist_m = radar.spot_diameter_m / (2.0 * LN_2).sqrt();
        Beam {
            entry: radar.beam,
            focal_diameter_m: radar.spot_diameter_m,
            rayleigh_m: PI * waist_m * waist_m / wavelength_m,
            target_from_global: radar.frames().global_from_target.inverse(),
        }
    }

    /// Distance from the focus at which the spot's area has doubled, m.
    pub fn rayleigh_m(&self) -> f64 {
        self.rayleigh_m
    }

    /// Diameter across the beam at half the intensity, m, for a beam that looks at (x_t, y_t) of the
    /// target plane, at range R.
    pub fn diameter_m(&self, xt_m: f64, yt_m: f64, range_m: f64) -> f64 {
        let BeamEntry { focus_m, edge_growth, edge_m } = self.entry;
        let off_centre = (xt_m * xt_m + yt_m * yt_m) / (edge_m * edge_m);
        let off_focus = ((range_m - focus_m) / self.rayleigh_m).powi(2);
        self.focal_diameter_m * (1.0 + (edge_growth - 1.0) * off_centre) * (1.0 + off_focus).sqrt()
    }

    /// The same for the beam along a ray, at range R.
    pub fn diameter_along_m(&self, axis: &Ray<Global>, range_m: f64) -> f64 {
        let looks_at = Point::from(axis.origin.xyz + PATTERN_RANGE_M * axis.direction.xyz());
        let aim = (self.target_from_global * looks_at).xyz;
        self.diameter_m(aim.x, aim.y, range_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spot_is_the_papers_at_the_centre_and_grows_from_there() {
        let beam = Beam::new(&Radar::default());
        assert!((beam.diameter_m(0.0, 0.0, 8.0) - 0.016).abs() < 1e-15);
        assert!((beam.diameter_m(0.3, 0.4, 8.0) - 0.024).abs() < 1e-15);
        assert!(beam.diameter_m(0.0, 0.0, 7.8) > 0.016);
    }

    #[test]
    fn out_of_focus_the_beam_spreads_as_a_gaussian_beam() {
        let beam = Beam::new(&Radar::default());
        // By hand: w₀ = 16 mm/1.17741 = 13.589 mm, z_R = π·w₀²/0.99931 mm = 0.58055 m.
        assert!((beam.rayleigh_m() - 0.58055).abs() < 1e-4, "{}", beam.rayleigh_m());
        let widened = beam.diameter_m(0.0, 0.0, 8.0 + beam.rayleigh_m()) / 0.016;
        assert!((widened - 2f64.sqrt()).abs() < 1e-12);
        // Far out of focus the half angle is λ/(π·w₀), and w is the diameter over √(2·ln 2).
        let far = beam.diameter_m(0.0, 0.0, 1008.0) / (2.0 * LN_2).sqrt() / 1000.0;
        let wavelength_m = 299_792_458.0 / 300e9;
        let waist_m = 0.016 / (2.0 * LN_2).sqrt();
        assert!((far / (wavelength_m / (PI * waist_m)) - 1.0).abs() < 1e-5);
    }
}
