//! What a curve was measured with.

use serde::{Deserialize, Serialize};

use super::error::{MaterialError, value};
use super::number_check::NumberCheck;

/// What a curve was measured with. A number that is not known is `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Instrument {
    /// Key within the material.
    pub key: String,
    /// Name.
    pub name: String,
    /// Centre frequency, Hz, above 0.
    pub centre_frequency_hz: f64,
    /// Bandwidth, Hz, above 0.
    pub bandwidth_hz: Option<f64>,
    /// Polarisation in one word, such as `VV`.
    pub polarisation: Option<String>,
    /// Anything else that a reader must know.
    pub note: Option<String>,
    /// Polarisation of the wave that is sent, such as `V` or `linear, in the plane of incidence`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transmit_polarisation: Option<String>,
    /// Polarisation that is received.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub receive_polarisation: Option<String>,
    /// Where source and receiver stood to each other.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub geometry: Option<Geometry>,
    /// Distance from the radar to the sample, m, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stand_off_m: Option<f64>,
    /// Diameter of the spot on the sample between its half-power points, m, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub spot_diameter_m: Option<f64>,
    /// Diameter of the antenna, m, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub aperture_m: Option<f64>,
    /// What the level was calibrated with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_target: Option<String>,
    /// One standard deviation of the level as a factor, 1 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration_sd_factor: Option<f64>,
    /// Whether levels are absolute.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<Scale>,
    /// Power of the noise in a range bin, W, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise_floor_w: Option<f64>,
    /// Least power that counts as a detection, W, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub threshold_w: Option<f64>,
    /// Probability that noise alone passes for a detection in one chirp, above 0 and below 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub false_alarm_probability: Option<f64>,
    /// Number of range bins among which the echo was searched, 1 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_bins: Option<u32>,
    /// Independent looks that one value averages, above 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub looks: Option<f64>,
    /// How the looks were counted or estimated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub looks_method: Option<String>,
}

impl Instrument {
    /// Whether it is stated to receive the polarisation across the one that it sends: H and V, or VH in one word. Other
    /// words, such as those of circular polarisations, are not judged.
    pub fn is_cross_polar(&self) -> bool {
        let both = self.transmit_polarisation.as_deref().zip(self.receive_polarisation.as_deref());
        let [sent, received] = match (both, self.polarisation.as_deref()) {
            (Some((sent, received)), _) => [sent, received].map(str::to_uppercase),
            (None, Some(word)) if word.len() == 2 && word.is_ascii() => {
                let (sent, received) = word.split_at(1);
                [sent, received].map(str::to_uppercase)
            }
            _ => return false,
        };
        matches!((sent.as_str(), received.as_str()), ("H", "V") | ("V", "H"))
    }
}

/// Where source and receiver stand to each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Geometry {
    /// In the same place: θ_r = θ_i and Δφ = 0.
    Monostatic,
    /// Apart.
    Bistatic,
}

impl Geometry {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            Geometry::Monostatic => "monostatic",
            Geometry::Bistatic => "bistatic",
        }
    }
}

/// What the level of a curve means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scale {
    /// σ⁰ = 4π·f·cos²θ, against a known target.
    Absolute,
    /// σ⁰ up to a factor that is the same for the whole curve and not known.
    Relative,
}

impl Scale {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            Scale::Absolute => "absolute",
            Scale::Relative => "relative",
        }
    }
}

impl Instrument {
    pub(super) fn validate(&self) -> Result<(), MaterialError> {
        let place = format!("instrument `{}`", self.key);
        let check = NumberCheck::new(&place);
        check.positive("the centre frequency", [self.centre_frequency_hz])?;
        check.positive("the bandwidth", self.bandwidth_hz)?;
        check.positive("the stand-off", self.stand_off_m)?;
        check.positive("the diameter of the spot", self.spot_diameter_m)?;
        check.positive("the aperture", self.aperture_m)?;
        check.positive("the power of the noise floor", self.noise_floor_w)?;
        check.positive("the power of the threshold", self.threshold_w)?;
        check.positive("the number of looks", self.looks)?;
        check.at_least(
            "the calibration's deviation as a factor",
            1.0,
            self.calibration_sd_factor,
        )?;
        if self.false_alarm_probability.is_some_and(|p| !(p > 0.0 && p < 1.0)) {
            let problem = "the false-alarm probability is not between 0 and 1";
            return Err(value(&place, problem, "mend it or leave it out"));
        }
        if self.range_bins == Some(0) {
            return Err(value(&place, "searches no range bin", "mend range_bins or leave it out"));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_instrument_is_cross_polar_where_it_says_so() {
        let word = |word: &str| Instrument {
            polarisation: Some(word.to_owned()),
            ..Instrument::default()
        };
        assert!(["VH", "hv"].iter().all(|stated| word(stated).is_cross_polar()));
        assert!(["VV", "HH", "circular", "×H", ""].iter().all(|s| !word(s).is_cross_polar()));
        let sent = Some("V".to_owned());
        let received = |field: &str| Instrument {
            transmit_polarisation: sent.clone(),
            receive_polarisation: Some(field.to_owned()),
            ..word("VV")
        };
        assert!(received("H").is_cross_polar() && !received("v").is_cross_polar());
        assert!(!Instrument { transmit_polarisation: sent, ..word("VV") }.is_cross_polar());
    }
}
