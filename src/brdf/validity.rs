//! What the derivation of a scattering model asks of a surface.
//!
//! A model outside of it still gives numbers, but nobody has shown that a surface scatters so. Models that are
//! fitted or measured, such as the paper's, have no such conditions.

use serde::Serialize;

/// Thorsos compared Kirchhoff's approximation with exact solutions: away from grazing incidence it is the
/// correlation length over the wavelength that decides.
pub(super) const THORSOS: &str = "Thorsos, J. Acoust. Soc. Am. 83 (1988) 78";
/// The book that states the conditions of Kirchhoff's model and of its two approximations together.
pub(super) const ULABY: &str =
    "Ulaby, Moore & Fung, Microwave Remote Sensing, vol. 2 (1982), ch. 12";

/// A condition that a model sets, and how a surface stands to it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Condition {
    /// What sets it: a scattering model by its name in files, or a way to render.
    pub model: &'static str,
    /// The quantity that has a limit.
    pub quantity: &'static str,
    /// Its unit as UCUM code; `1` for a pure number.
    pub unit: &'static str,
    /// Its value.
    pub value: f64,
    /// On which side of the limit the value should lie.
    pub bound: Bound,
    /// The limit.
    pub limit: f64,
    /// Where the limit is stated.
    pub source: &'static str,
}

/// A side of a limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Bound {
    /// The limit is the smallest sound value.
    AtLeast,
    /// The limit is the largest sound value.
    AtMost,
}

impl Condition {
    /// Whether the surface meets it.
    pub fn is_met(&self) -> bool {
        match self.bound {
            Bound::AtLeast => self.value >= self.limit,
            Bound::AtMost => self.value <= self.limit,
        }
    }
}

/// The conditions k·l ≥ 6 and l² ≥ 2.76·s·λ of Kirchhoff's approximation: a surface of the rms height s and the
/// Gaussian correlation length l bends little over a wavelength.
pub(super) fn kirchhoff_conditions(
    model: &'static str,
    wavelength_m: f64,
    rms_height_m: f64,
    correlation_length_m: f64,
) -> [Condition; 2] {
    let curvature = correlation_length_m.powi(2) / (rms_height_m * wavelength_m);
    [
        length_condition(model, wavelength_m, correlation_length_m),
        Condition {
            model,
            quantity: "l²/(s·λ)",
            unit: "1",
            value: curvature,
            bound: Bound::AtLeast,
            limit: 2.76,
            source: ULABY,
        },
    ]
}

/// The condition k·l ≥ 6.
pub(super) fn length_condition(
    model: &'static str,
    wavelength_m: f64,
    correlation_length_m: f64,
) -> Condition {
    Condition {
        model,
        quantity: "k·l",
        unit: "1",
        value: std::f64::consts::TAU / wavelength_m * correlation_length_m,
        bound: Bound::AtLeast,
        limit: 6.0,
        source: THORSOS,
    }
}
