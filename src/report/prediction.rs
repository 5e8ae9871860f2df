//! What a material is predicted to return at stated angles, with the 95 % band of its fit.

use serde::Serialize;

use super::level_table::{LevelRow, Sigma0Level, level_rows};
use crate::error::Error;
use crate::fit::{stored_band, undetermined};
use crate::material::{Fit, Material, Slug};
use crate::units::{db_from_ratio, rounded};

/// Most angles of one prediction.
const MOST_ANGLES: usize = 10_000;

/// A material's levels at some angles.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Prediction {
    /// Short name of the material.
    pub material: Slug,
    /// Its revision; none for a built-in one that is not in the database.
    pub revision: Option<u32>,
    /// The fit or curve that scenes render, and that the levels are of.
    pub law: String,
    /// Origin of the numbers: `measured`, `literature`, `modelled` or `synthetic`, or what they are of one.
    pub kind: String,
    /// Range of frequencies for which the numbers are claimed, GHz.
    pub frequency_ghz: [f64; 2],
    /// Why there is no band; none where there is one.
    pub no_band: Option<String>,
    /// One for each angle.
    pub levels: Vec<PredictedLevel>,
}

/// The level at one angle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PredictedLevel {
    /// Angle of incidence, °.
    pub theta_deg: f64,
    /// σ⁰ of the surface itself, before a beam smooths it, dB; none where only a limit is known, or nothing comes back.
    pub sigma0_db: Option<f64>,
    /// Limit below which σ⁰ lies, dB, where nothing was detected.
    pub below_db: Option<f64>,
    /// 95 % band of that level, dB. It holds the uncertainty of the fit, not that of the law's form.
    pub band_db: Option<[f64; 2]>,
    /// How far the angle lies outside those that the material is described for, °; 0 within.
    pub outside_deg: f64,
}

impl Prediction {
    /// The levels of a material at these angles, °, from 0 to below 90.
    ///
    /// # Errors
    /// A material whose rendered model is not there.
    pub fn new(
        material: &Material,
        revision: Option<u32>,
        angles_deg: &[f64],
    ) -> Result<Prediction, Error> {
        let fit = material.rendered_fit();
        let no_band = no_band(fit);
        let banded = fit.filter(|_| no_band.is_none());
        let rows = level_rows(material, angles_deg)?;
        let levels = rows.into_iter().map(|row| PredictedLevel::new(row, banded)).collect();
        let kind = material.render_kind().map_or("of unknown origin", |kind| kind.as_str());
        Ok(Prediction {
            material: material.slug.clone(),
            revision,
            law: material.render.clone(),
            kind: material.rendered_words().unwrap_or_else(|| kind.to_owned()),
            frequency_ghz: material.frequency_hz.map(|hz| rounded(hz / 1e9)),
            no_band,
            levels,
        })
    }
}

impl PredictedLevel {
    fn new(row: LevelRow, fit: Option<&Fit>) -> PredictedLevel {
        let LevelRow { theta_deg, level, outside_deg } = row;
        let (sigma0_db, below_db) = match level {
            Sigma0Level::Db(db) => (Some(db), None),
            Sigma0Level::BelowDb(db) => (None, Some(db)),
            Sigma0Level::Nothing => (None, None),
        };
        let band = fit.filter(|_| sigma0_db.is_some());
        let band = band.and_then(|fit| stored_band(fit, 0.0, theta_deg.to_radians()));
        let band_db = band.map(|band| [band.low, band.high].map(db_from_ratio));
        PredictedLevel { theta_deg, sigma0_db, below_db, band_db, outside_deg }
    }
}

/// Why the rendered law has no band, in a sentence; `None` where it has one.
fn no_band(fit: Option<&Fit>) -> Option<String> {
    let Some(fit) = fit else { return Some("a curve is rendered, not a fit".to_owned()) };
    let Some(report) = &fit.report else {
        return Some("the numbers of the law were stated, not fitted".to_owned());
    };
    let unknown: Vec<&str> = undetermined(report).collect();
    if unknown.is_empty() {
        return None;
    }
    Some(format!("the fit stopped at the end of the range of {}", unknown.join(", ")))
}

/// The angles that a text names, °: `0:80:5` (first, last, step) or `10,20,30`.
///
/// # Errors
/// A text that names none, angles outside 0° to below 90°, too many of them; in a sentence with the way out.
pub fn angles_deg(text: &str) -> Result<Vec<f64>, String> {
    let parts: Vec<&str> = text.split(':').collect();
    let angles = match parts.as_slice() {
        [list] => list.split(',').map(number).collect::<Result<Vec<f64>, String>>()?,
        [first, last, step] => {
            let (first, last, step) = (number(first)?, number(last)?, number(step)?);
            let count = (last - first) / step;
            if !(step > 0.0 && count >= 0.0 && count < MOST_ANGLES as f64) {
                return Err(format!(
                    "`{text}` names no angles; write FIRST:LAST:STEP, as in 0:80:5, with at most \
                     {MOST_ANGLES} angles"
                ));
            }
            // The last angle counts although steps round.
            (0..=(count + 1e-9) as usize).map(|k| rounded(first + k as f64 * step)).collect()
        }
        _ => return Err(format!("`{text}` names no angles; write 0:80:5 or 10,20,30")),
    };
    match angles.iter().find(|angle| !(0.0..90.0).contains(*angle)) {
        Some(angle) => Err(format!(
            "{angle}° is out of the range; give angles of incidence from 0 to below 90"
        )),
        None => Ok(angles),
    }
}

fn number(part: &str) -> Result<f64, String> {
    let value = part.trim().parse::<f64>();
    value.map_err(|_| format!("`{part}` is not a number; write 0:80:5 or 10,20,30"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_are_a_range_with_its_end_or_a_list() {
        assert_eq!(angles_deg("0:0.3:0.1").unwrap(), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(angles_deg("10, 5,89.9").unwrap(), [10.0, 5.0, 89.9]);
        for (text, says) in [
            ("", "is not a number"),
            ("0:80", "names no angles"),
            ("0:80:0", "names no angles"),
            ("0:80:-5", "names no angles"),
            ("80:0:5", "names no angles"),
            ("0:80:1e-9", "at most 10000 angles"),
            ("nan:80:5", "names no angles"),
            ("inf", "inf° is out of the range"),
            ("0:90:5", "90° is out of"),
            ("-5", "-5° is out of"),
        ] {
            assert!(angles_deg(text).unwrap_err().contains(says), "{text}");
        }
    }
}
