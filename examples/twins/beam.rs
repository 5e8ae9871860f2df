//! The twins' own beam: a Gaussian one, written out from its waist.

use std::f64::consts::{LN_2, PI};

use glam::DVec2;
use matdb::radar::Radar;
use matdb::scene::Scene;

/// What a beam is made of, all in m.
pub struct Waist {
    wavelength_m: f64,
    central_m: f64,
    focus_m: f64,
    /// Growth of the waist per square metre off the centre.
    growth_per_m2: f64,
}

impl Waist {
    /// # Panics
    /// For a radar with an antenna of its own area, or a spot by another measure: no twin has one.
    pub fn new(scene: &Scene) -> Waist {
        let radar: &Radar = scene.radar();
        assert!(radar.aperture_m2.is_none() && radar.spot_fwhm_m() == radar.spot_diameter_m);
        Waist {
            wavelength_m: 0.299_792_458 / radar.centre_frequency_ghz,
            // Irradiance exp(−2r²/w²) is a half at the radius D/2.
            central_m: radar.spot_diameter_m / (2.0 * LN_2).sqrt(),
            focus_m: radar.beam.focus_m,
            growth_per_m2: (radar.beam.edge_growth - 1.0) / radar.beam.edge_m.powi(2),
        }
    }

    /// Squared waist of the beam towards a place of the target plane, m².
    fn waist_m2(&self, place_m: DVec2) -> f64 {
        (self.central_m * (1.0 + self.growth_per_m2 * place_m.length_squared())).powi(2)
    }

    /// λ²/(π·w²) at a range, sr.
    pub fn received_sr(&self, place_m: DVec2, range_m: f64) -> f64 {
        let waist_m2 = self.waist_m2(place_m);
        let spread_m2 = ((range_m - self.focus_m) * self.wavelength_m / PI).powi(2) / waist_m2;
        self.wavelength_m.powi(2) / (PI * (waist_m2 + spread_m2))
    }

    /// How much the wave's direction turns for each metre beside the axis, rad/m.
    pub fn turn_per_m(&self, place_m: DVec2, range_m: f64) -> f64 {
        let off_m = range_m - self.focus_m;
        let depth_m = PI * self.waist_m2(place_m) / self.wavelength_m;
        off_m / (off_m * off_m + depth_m * depth_m)
    }
}
