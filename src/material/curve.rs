//! Scattering curves and their points.

use serde::{Deserialize, Serialize};

use super::aspect::Aspect;
use super::error::{MaterialError, value};
use crate::brdf::Tabulated;
use crate::formats::words::significant;
use crate::radar::Footprint;

/// A scattering curve: observations in the order of the file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// Name, unique among the material's curves and fits.
    pub name: String,
    /// Key of its source.
    pub source: String,
    /// Key of the instrument; `None` for a curve that was not measured.
    pub instrument: Option<String>,
    /// Key of the session in which it was measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub session: Option<String>,
    /// How the target was lit, as far as it is stated.
    #[serde(flatten)]
    pub illumination: Illumination,
    /// The points.
    pub observations: Vec<Observation>,
}

/// How a target was lit and seen while a curve was measured, as far as that is stated: what its levels, its silence and
/// the widths of its lobes depend on besides the surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Illumination {
    /// The form of the footprint with which powers became σ⁰.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub footprint: Option<Footprint>,
    /// What the illumination adds to the width of a lobe, rad, above 0: a smooth mirror of the target's shape shows a
    /// lobe of this width, to 1/e. It is the divergence δ₀ = λ/(2π·w₀) of the beam on a flat target, and
    /// √(δ_w² + (w²/4)·(H + 1/R_c)²) on one of the curvature H, with δ_w = λ/(2π·w) of the spot's radius w.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beam_rad: Option<f64>,
    /// Whether the levels are known up to a common factor only.
    #[serde(default, skip_serializing_if = "is_off")]
    pub relative: bool,
    /// Whether only detections were recorded: which chirps were silent is not known. Each detection then has its threshold.
    #[serde(default, skip_serializing_if = "is_off")]
    pub only_detected: bool,
}

/// What serde leaves out.
fn is_off(on: &bool) -> bool {
    !*on
}

impl Illumination {
    /// Factor on a σ⁰ of this curve, at the cosine of an incidence, to what another form of the footprint makes of
    /// the same power; 1 where one of the two forms is not stated.
    pub fn factor_to(&self, other: Option<Footprint>, cos_theta: f64) -> f64 {
        match (self.footprint, other) {
            (Some(own), Some(other)) => own.factor_to(other, cos_theta),
            _ => 1.0,
        }
    }

    /// What this and another statement about one curve say together; none where they contradict each other.
    pub fn and(self, other: Illumination) -> Option<Illumination> {
        let both = Illumination {
            footprint: self.footprint.or(other.footprint),
            beam_rad: self.beam_rad.or(other.beam_rad),
            relative: self.relative || other.relative,
            only_detected: self.only_detected || other.only_detected,
        };
        let other_first = Illumination {
            footprint: other.footprint.or(self.footprint),
            beam_rad: other.beam_rad.or(self.beam_rad),
            ..both
        };
        (both == other_first).then_some(both)
    }

    /// The columns of a CSV in which it is stated: what to add to its header, and to every row.
    pub fn columns(&self) -> [String; 2] {
        let footprint = self.footprint.map(|footprint| footprint.as_str().to_owned());
        let beam = self.beam_rad.map(|beam_rad| beam_rad.to_string());
        let mut columns = [String::new(), String::new()];
        let [relative, only_detected] =
            [self.relative, self.only_detected].map(|on| on.then(|| "1".to_owned()));
        for (name, value) in [
            ("footprint", footprint),
            ("beam_rad", beam),
            ("relative", relative),
            ("only_detected", only_detected),
        ] {
            if let Some(value) = value {
                columns[0] += &format!(",{name}");
                columns[1] += &format!(",{value}");
            }
        }
        columns
    }

    /// The form of the footprint in words.
    pub fn footprint_words(&self) -> &'static str {
        match self.footprint {
            Some(Footprint::Paper) => "footprint paper (cos² of the incidence)",
            Some(Footprint::Projected) => "footprint projected (cos of the incidence once)",
            None => "footprint not stated",
        }
    }

    /// The beam in words.
    pub fn beam_words(&self) -> String {
        match self.beam_rad {
            Some(beam_rad) => format!("beam of {} mrad", significant(1e3 * beam_rad, 4)),
            None => "beam not stated".to_owned(),
        }
    }
}

/// One point of a curve. In backscatter θ_r = θ_i and Δφ = 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Observation {
    /// Angle of incidence, rad.
    pub theta_i_rad: f64,
    /// Angle of reflection, rad.
    pub theta_r_rad: f64,
    /// Azimuth between the two, rad.
    pub delta_phi_rad: f64,
    /// σ⁰ as a ratio; `None` exactly when censored.
    pub sigma0: Option<f64>,
    /// Whether, and on which side, the value is only a bound.
    pub censor: Censor,
    /// Detection limit that applied, σ⁰ as a ratio.
    pub threshold_sigma0: Option<f64>,
    /// Standard deviation of each of the two tilts of the normal against the ray, rad, 0 to π/2.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub theta_sd_rad: Option<f64>,
    /// Received power, W, above 0; of a left-censored point the least that would have been detected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub power_w: Option<f64>,
    /// Range R, m, 0 or more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range_m: Option<f64>,
    /// Number of the chirp.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chirp: Option<u32>,
    /// Place on the target, (x_t, y_t) of the frame `St`, m; of a silent chirp where its ray hits the mesh.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub target_m: Option<[f64; 2]>,
}

/// What an observation says of the true value.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Censor {
    /// It was measured.
    None,
    /// It lies below the threshold.
    Left,
    /// It lies above the threshold.
    Right,
}

impl Censor {
    /// The word that files and the database use.
    pub fn as_str(self) -> &'static str {
        match self {
            Censor::None => "none",
            Censor::Left => "left",
            Censor::Right => "right",
        }
    }
}

/// Angles nearer than this, rad, differ by rounding only.
const SAME_ANGLE_RAD: f64 = 1e-12;

impl Curve {
    /// The points as they were stated.
    pub fn stated(&self) -> impl Iterator<Item = Observation> {
        let is_made_up = self.has_made_up_details();
        self.observations.iter().map(move |o| if is_made_up { o.bare() } else { *o })
    }

    /// Whether every point has the details that versions before 0.2.0 made up for a file that did not state them: an exact
    /// angle, σ⁰ in watts as its power, a range of 0, and its number as the chirp.
    fn has_made_up_details(&self) -> bool {
        self.observations.iter().enumerate().all(|(index, o)| {
            o.theta_sd_rad == Some(0.0)
                && o.power_w.is_some()
                && o.power_w == o.level_sigma0()
                && o.range_m == Some(0.0)
                && o.chirp.is_some_and(|chirp| chirp as usize == index)
        })
    }

    /// The curve as a scattering model: its detections in backscatter, sorted by angle, equal angles
    /// averaged in linear σ⁰. Where only left-censored points follow, nothing comes back.
    ///
    /// # Errors
    /// When detections at fewer than two angles are left, or a point is right-censored: its true
    /// value is not known and no bound would render it.
    pub fn tabulated(&self) -> Result<Tabulated, MaterialError> {
        let retro = self.observations.iter().filter(|o| o.is_retro());
        if retro.clone().any(|o| o.censor == Censor::Right) {
            let place = format!("curve `{}`", self.name);
            let way_out = "fit a model to it and render that";
            return Err(value(&place, "has points above the instrument's range", way_out));
        }
        let mut points: Vec<(f64, f64)> =
            retro.clone().filter_map(|o| Some((o.theta_i_rad, o.sigma0?))).collect();
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let merged: Vec<(f64, f64)> = points
            .chunk_by(|a, b| b.0 - a.0 < SAME_ANGLE_RAD)
            .map(|same| (same[0].0, same.iter().map(|p| p.1).sum::<f64>() / same.len() as f64))
            .collect();
        let last_rad = merged.last().map_or(0.0, |point| point.0);
        let silent_rad = retro
            .filter(|o| o.censor == Censor::Left && o.theta_i_rad > last_rad + SAME_ANGLE_RAD)
            .map(|o| o.theta_i_rad)
            .min_by(f64::total_cmp);
        Tabulated::new(&merged)
            .and_then(|curve| match silent_rad {
                Some(theta_rad) => curve.silent_from(theta_rad),
                None => Ok(curve),
            })
            .map_err(|error| MaterialError::Curve { curve: self.name.clone(), error })
    }
}

impl Observation {
    /// A point of backscatter of which no more is known than its σ⁰ or, without one, the limit that it
    /// stayed below.
    pub fn backscatter(theta_rad: f64, sigma0: Option<f64>, threshold_sigma0: Option<f64>) -> Self {
        Observation {
            theta_i_rad: theta_rad,
            theta_r_rad: theta_rad,
            delta_phi_rad: 0.0,
            sigma0,
            censor: if sigma0.is_some() { Censor::None } else { Censor::Left },
            threshold_sigma0,
            theta_sd_rad: None,
            power_w: None,
            range_m: None,
            chirp: None,
            target_m: None,
        }
    }

    /// A point of backscatter with the σ⁰ that was measured or, where it is censored, the limit that it stayed below.
    pub fn of_level(theta_rad: f64, sigma0: f64, is_censored: bool) -> Self {
        let (level, limit) = if is_censored { (None, Some(sigma0)) } else { (Some(sigma0), None) };
        Observation::backscatter(theta_rad, level, limit)
    }

    /// The point without the details of its measurement, but for its place.
    fn bare(&self) -> Observation {
        Observation { theta_sd_rad: None, power_w: None, range_m: None, chirp: None, ..*self }
    }

    /// The measured σ⁰, or the limit of a censored point; none where the point has neither.
    pub fn level_sigma0(&self) -> Option<f64> {
        if self.is_censored() { self.threshold_sigma0 } else { self.sigma0 }
    }

    /// Whether the true σ⁰ is known only to lie below or above the limit.
    pub fn is_censored(&self) -> bool {
        self.censor != Censor::None
    }

    /// Whether source and receiver were in the same direction.
    pub fn is_retro(&self) -> bool {
        self.aspect().is_retro()
    }

    /// From where it was lit and seen.
    pub fn aspect(&self) -> Aspect {
        Aspect {
            theta_i_rad: self.theta_i_rad,
            theta_r_rad: self.theta_r_rad,
            delta_phi_rad: self.delta_phi_rad,
        }
    }
}
