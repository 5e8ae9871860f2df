//! The twins' own beam: a Gaussian one, written out from its waist.

use std::f64::consts::{LN_2, PI};

use glam::DVec2;
use matdb::radar::Radar;
use matdb::scene::Scene;

/// Speed of light over 1 GHz, m.
pub const METRES_AT_ONE_GHZ: f64 = 0.299_792_458;

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
            wavelength_m: METRES_AT_ONE_GHZ / radar.centre_frequency_ghz,
            central_m: radius_m(radar.spot_diameter_m),
            focus_m: radar.beam.focus_m,
            growth_per_m2: (radar.beam.edge_growth - 1.0) / radar.beam.edge_m.powi(2),
        }
    }

    /// Radius of the waist of the beam to the middle of the target plane, m.
    pub fn central_m(&self) -> f64 {
        self.central_m
    }

    /// Squared waist of the beam towards a place of the target plane, m².
    fn waist_m2(&self, place_m: DVec2) -> f64 {
        (self.central_m * (1.0 + self.growth_per_m2 * place_m.length_squared())).powi(2)
    }

    /// The beam towards a place of the target plane.
    pub fn towards(&self, place_m: DVec2) -> Beam {
        let waist_m2 = self.waist_m2(place_m);
        Beam {
            wave_per_m: 2.0 * PI / self.wavelength_m,
            waist_m2,
            depth_m: PI * waist_m2 / self.wavelength_m,
            focus_m: self.focus_m,
            least_m2: 0.0,
        }
    }

    /// λ²/(π·w²) at a range, sr.
    pub fn received_sr(&self, place_m: DVec2, range_m: f64) -> f64 {
        self.wavelength_m.powi(2) / (PI * self.towards(place_m).radius_m2(range_m))
    }

    /// Width δ₀ = λ/(2π·w₀) of the slopes in a beam that stands for one ray, as a tangent.
    pub fn slope(&self, place_m: DVec2) -> f64 {
        self.wavelength_m / (2.0 * PI * self.waist_m2(place_m).sqrt())
    }

    /// The same for each of many rays on the curved wavefront: δ = λ/(2π·w).
    pub fn slope_at(&self, place_m: DVec2, range_m: f64) -> f64 {
        self.wavelength_m / (2.0 * PI * self.towards(place_m).radius_m2(range_m).sqrt())
    }
}

/// Radius w of a beam of this diameter at half the intensity: exp(−2r²/w²) is a half at r = D/2.
pub fn radius_m(diameter_m: f64) -> f64 {
    diameter_m / (2.0 * LN_2).sqrt()
}

/// One beam, along its axis.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    wave_per_m: f64,
    waist_m2: f64,
    /// Rayleigh range z_R.
    depth_m: f64,
    focus_m: f64,
    /// Least squared radius, where the spot is wider than its antenna says.
    least_m2: f64,
}

impl Beam {
    /// The same with a spot at least as wide as this diameter at half the intensity, at every range.
    pub fn at_least(self, diameter_m: f64) -> Beam {
        Beam { least_m2: radius_m(diameter_m).powi(2), ..self }
    }

    /// w² at a range, m².
    pub fn radius_m2(&self, range_m: f64) -> f64 {
        let zeta = (range_m - self.focus_m) / self.depth_m;
        (self.waist_m2 * (1.0 + zeta * zeta)).max(self.least_m2)
    }

    /// How much the wave's direction turns for each metre beside the axis, 1/R_c in rad/m.
    pub fn turn_per_m(&self, range_m: f64) -> f64 {
        let off_m = range_m - self.focus_m;
        off_m / (off_m * off_m + self.depth_m * self.depth_m)
    }

    /// Length of the wave's way to a point at this range along the axis and this far from it, m.
    pub fn way_m(&self, along_m: f64, off_m2: f64) -> f64 {
        along_m + 0.5 * self.turn_per_m(along_m) * off_m2
    }

    /// Share of the amplitude on the axis that a point off it adds, there and back: u is exp(−2r²/w²).
    pub fn share(&self, along_m: f64, off_m2: f64) -> f64 {
        (-2.0 * off_m2 / self.radius_m2(along_m)).exp()
    }

    /// Phase of what returns after a way, rad: 2k·(z + r²/(2R_c)) − 2·arctan(z/z_R) from the focus.
    pub fn phase_rad(&self, along_m: f64, way_m: f64) -> f64 {
        let gouy = ((along_m - self.focus_m) / self.depth_m).atan();
        2.0 * (self.wave_per_m * (way_m - self.focus_m) - gouy)
    }
}
