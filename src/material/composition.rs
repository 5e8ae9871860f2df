//! What a material is made of and how its surface is: layers, permittivities, roughness.
//!
//! A permittivity is relative and written ε = ε′ − jε″ for fields that go as exp(+jωt): a passive
//! material has ε″ ≥ 0.

use serde::{Deserialize, Serialize};

use super::error::{MaterialError, value};
use super::number_check::NumberCheck;

/// One layer of a material; they are listed from the outermost inwards.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Layer {
    /// What it is.
    pub name: String,
    /// Thickness, m, above 0; none for a half space, which only the last layer can be.
    pub thickness_m: Option<f64>,
    /// Key of its permittivity; `None` where it is not known.
    pub permittivity: Option<String>,
    /// Key of the source of its thickness; none where the entry itself states it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
}

/// The permittivity of a substance at one frequency and temperature.
///
/// A key may stand at several frequencies and temperatures, once at each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Permittivity {
    /// The substance, by which layers name it.
    pub key: String,
    /// Frequency, Hz, above 0.
    pub frequency_hz: f64,
    /// Temperature, K, above 0; none where the source does not say.
    pub temperature_k: Option<f64>,
    /// ε′, relative; negative only in metals and plasmas.
    pub real: f64,
    /// ε″, relative, 0 or more.
    pub imaginary: f64,
    /// Standard deviation of ε′, 0 or more; none where the source gives none.
    pub real_sd: Option<f64>,
    /// Standard deviation of ε″, 0 or more; none where the source gives none.
    pub imaginary_sd: Option<f64>,
    /// Key of the source.
    pub source: String,
    /// Key of the source of the frequency, where it is another: a table may state none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frequency_source: Option<String>,
}

/// How rough the outer surface is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Roughness {
    /// Root mean square of heights, m, 0 or more.
    pub rms_height_m: f64,
    /// Length over which heights are correlated, m, above 0; `None` where it was not measured.
    pub correlation_length_m: Option<f64>,
    /// How it was found: profilometer, sampling length, filter, or the standard of a finish.
    pub method: Option<String>,
    /// Key of the source.
    pub source: String,
}

impl Layer {
    pub(super) fn validate(&self, place: &str, is_last: bool) -> Result<(), MaterialError> {
        if self.name.trim().is_empty() {
            return Err(value(place, "has no name", "say what the layer is"));
        }
        if self.thickness_m.is_none() && !is_last {
            let way_out = "give thickness_mm; only the last layer can be a half space";
            return Err(value(place, "has no thickness", way_out));
        }
        NumberCheck::new(place).positive("the thickness", self.thickness_m)
    }
}

/// Largest part of a permittivity. Metals come to 10⁷ at 100 GHz, and a perfect conductor may be written by a larger one.
const MOST_PERMITTIVITY: f64 = 1e30;

impl Permittivity {
    pub(super) fn validate(&self, place: &str) -> Result<(), MaterialError> {
        let check = NumberCheck::new(place);
        check.positive("the frequency", [self.frequency_hz])?;
        check.positive("the temperature above absolute zero", self.temperature_k)?;
        check.finite("the real part", [self.real])?;
        if self.real.abs().max(self.imaginary.abs()) > MOST_PERMITTIVITY {
            let problem = format!("it is beyond {MOST_PERMITTIVITY:e}");
            return Err(value(place, &problem, "write it relative to that of vacuum"));
        }
        if self.imaginary < 0.0 {
            let problem = "the imaginary part is negative, which would amplify";
            return Err(value(place, problem, "write eps' - j eps'' with eps'' of 0 or more"));
        }
        check.not_negative("the imaginary part", [self.imaginary])?;
        check.not_negative("a deviation", [self.real_sd, self.imaginary_sd].into_iter().flatten())
    }

    /// Whether two entries speak of the same thing.
    pub(super) fn is_same_place(&self, other: &Permittivity) -> bool {
        self.key == other.key
            && self.frequency_hz == other.frequency_hz
            && self.temperature_k == other.temperature_k
    }
}

impl Roughness {
    pub(super) fn validate(&self) -> Result<(), MaterialError> {
        let check = NumberCheck::new("roughness");
        check.not_negative("the rms height", [self.rms_height_m])?;
        check.positive("the correlation length", self.correlation_length_m)
    }
}
