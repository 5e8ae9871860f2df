//! `physical_optics.json`, which `physical_optics.py` made.

use serde_json::Value;

/// The antenna's beam of the fixture, which is the preset's.
#[derive(Clone, Copy)]
pub struct Beam {
    /// λ, m.
    pub wavelength_m: f64,
    /// w₀, m.
    pub waist_m: f64,
    /// z_R, m.
    pub rayleigh_m: f64,
    /// δ₀ = λ/(2π·w₀), rad.
    pub delta0_rad: f64,
}

impl Beam {
    /// Read from the fixture.
    pub fn of_the_fixture() -> Beam {
        let beam = &all()["beam"];
        Beam {
            wavelength_m: number(beam, "wavelength_m"),
            waist_m: number(beam, "waist_m"),
            rayleigh_m: number(beam, "rayleigh_m"),
            delta0_rad: number(beam, "delta0_rad"),
        }
    }

    /// ζ² of a place, m from the focus.
    pub fn zeta2(&self, z_m: f64) -> f64 {
        (z_m / self.rayleigh_m).powi(2)
    }

    /// w, m.
    pub fn radius_m(&self, z_m: f64) -> f64 {
        self.waist_m * (1.0 + self.zeta2(z_m)).sqrt()
    }

    /// δ_w = λ/(2π·w), squared.
    pub fn divergence2(&self, z_m: f64) -> f64 {
        self.delta0_rad * self.delta0_rad / (1.0 + self.zeta2(z_m))
    }

    /// 1/R_c, 1/m.
    pub fn curvature_per_m(&self, z_m: f64) -> f64 {
        z_m / (z_m * z_m + self.rayleigh_m * self.rayleigh_m)
    }
}

fn all() -> Value {
    serde_json::from_str(include_str!("physical_optics.json")).unwrap()
}

/// The values of one kind of target.
pub fn rows(part: &str) -> Vec<Value> {
    all()[part].as_array().unwrap().clone()
}

/// A number of a row.
pub fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"))
}
