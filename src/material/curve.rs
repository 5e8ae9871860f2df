//! Scattering curves and their points.

use serde::Serialize;

use super::error::{MaterialError, value};
use crate::brdf::Tabulated;

/// A scattering curve: observations in the order of the file.
#[derive(Clone, Debug, PartialEq, Serialize)]
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
    /// The points.
    pub observations: Vec<Observation>,
}

/// One point of a curve. In backscatter θ_r = θ_i and Δφ = 0.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, serde::Deserialize)]
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

    /// Whether source and receiver were in the same direction.
    pub fn is_retro(&self) -> bool {
        self.theta_i_rad == self.theta_r_rad && self.delta_phi_rad == 0.0
    }
}
