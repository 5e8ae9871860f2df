//! What scenes render of a material at a few angles.

use crate::brdf::{Scattering, ScatteringModel, VIEWING_RAD};
use crate::error::Error;
use crate::material::Material;
use crate::units::{db_from_ratio, rounded};

/// What scenes render at an angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LevelRow {
    /// The incidence, °.
    pub theta_deg: f64,
    /// σ⁰ there.
    pub level: Sigma0Level,
    /// How far that lies outside the angles for which the material is described, °; 0 within.
    pub outside_deg: f64,
}

/// A level of σ⁰.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Sigma0Level {
    /// This many dB.
    Db(f64),
    /// Somewhere below this many dB, the threshold of the measurement.
    BelowDb(f64),
    /// No echo at all.
    Nothing,
}

/// How wide the smooth mirror of what a material renders is drawn; `None` without one.
///
/// # Errors
/// A material whose rendered model is not there.
pub fn drawn_words(material: &Material) -> Result<Option<String>, Error> {
    let has_mirror = material.scattering()?.has_smooth_mirror();
    Ok(has_mirror.then(|| {
        format!("smooth mirror drawn {VIEWING_RAD} rad wide, as the default radar's beam")
    }))
}

/// Angles of a table that shows a material at a glance, °.
pub const AT_A_GLANCE_DEG: [f64; 9] = [0.0, 2.0, 5.0, 10.0, 20.0, 30.0, 45.0, 60.0, 75.0];

/// The levels of a material at these angles, °, from 0 to below 90.
///
/// # Errors
/// A material whose rendered model is not there.
pub fn level_rows(material: &Material, angles_deg: &[f64]) -> Result<Vec<LevelRow>, Error> {
    let scattering = material.scattering()?;
    let reach = material.reach();
    let rows = angles_deg.iter().map(|&theta_deg| {
        let theta_rad = theta_deg.to_radians();
        let sigma0_db = db_from_ratio(scattering.sigma0(theta_rad));
        let level = match reach.below_sigma0(theta_rad) {
            Some(threshold) => Sigma0Level::BelowDb(db_from_ratio(threshold)),
            None if sigma0_db.is_finite() => Sigma0Level::Db(sigma0_db),
            None => Sigma0Level::Nothing,
        };
        let outside_deg = rounded(reach.outside_rad(theta_rad).to_degrees());
        LevelRow { theta_deg, level, outside_deg }
    });
    Ok(rows.collect())
}
