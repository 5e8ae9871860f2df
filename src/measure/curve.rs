//! A curve: one observation per chirp that hit, or should have hit, a material, or per pair of directions of an
//! instrument that lights and sees a sample from two.
//!
//! As CSV: `theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored,xt_m,yt_m,footprint,beam_rad`.
//! σ⁰ is that of equation (10), 4π·f·cos²θ. It belongs to the material once it is known with which form of the
//! footprint powers became f (`footprint`) and how wide the beam was (`beam_rad`): these are the same in every row,
//! and left out where they are not stated. A chirp that should have been detected and was not is a row with
//! `censored` = 1: its power and its σ⁰ are those that it stayed below. Where not every row is backscatter,
//! `theta_r_deg` and `delta_phi_deg` say from where it was seen.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::formats::{ColumnNames, FormatError};
use crate::material;
use crate::material::file::{Points, points};
use crate::material::{Censor, Illumination, Observation};
use crate::units::{db_from_ratio, dbm_from_watts};

/// Columns of a curve file, in order; those of its [`Illumination`] follow where they are stated.
pub const COLUMNS: [&str; 9] = [
    "theta_deg",
    "theta_sd_deg",
    "power_dbm",
    "sigma0_db",
    "range_m",
    "chirp",
    "censored",
    "xt_m",
    "yt_m",
];

/// A curve: observations in any order, each with a σ⁰ or the limit that it stayed below.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Curve {
    /// One per chirp. Of those that [`Curve::read`] and [`Curve::of_material`] give, a detection has a threshold where
    /// only detections were recorded, and none otherwise.
    pub observations: Vec<Observation>,
    /// How the target was lit, as far as it is stated.
    pub illumination: Illumination,
}

/// Why an observation does not belong in a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ObservationError {
    /// The true value lies above a threshold.
    #[error(
        "point {point} (from 1) is above the instrument's range, which a fit does not use; leave it out"
    )]
    AboveRange {
        /// Its number from 1.
        point: usize,
    },
    /// A detection without its threshold, where only detections were recorded.
    #[error(
        "point {point} (from 1) has no threshold, and only detections were recorded; give it the least level that \
         would have been detected"
    )]
    NoThreshold {
        /// Its number from 1.
        point: usize,
    },
    /// A detection below its threshold, where only detections were recorded.
    #[error(
        "point {point} (from 1) is below its own threshold, and only detections were recorded; correct one of the two"
    )]
    BelowThreshold {
        /// Its number from 1.
        point: usize,
    },
    /// Neither a value nor a threshold.
    #[error("point {point} (from 1) has no value and no threshold; give it one")]
    Empty {
        /// Its number from 1.
        point: usize,
    },
}

impl Curve {
    /// A material's curve, without the details that earlier versions made up.
    ///
    /// # Errors
    /// The first observation that does not belong in a curve.
    pub fn of_material(curve: &material::Curve) -> Result<Curve, ObservationError> {
        let illumination = curve.illumination;
        let rows = curve.stated().enumerate();
        let rows = rows.map(|(index, o)| checked(index, &o, illumination.only_detected));
        Ok(Curve { observations: rows.collect::<Result<_, _>>()?, illumination })
    }

    /// How many observations have no power.
    pub fn without_power(&self) -> usize {
        self.observations.iter().filter(|o| o.power_w.is_none()).count()
    }

    /// Reads a curve file, see [`Curve::read_as`], whose columns have our names.
    ///
    /// # Errors
    /// As there.
    pub fn read(bytes: &[u8]) -> Result<Curve, FormatError> {
        Ok(Curve::read_as(bytes, &ColumnNames::default())?.0)
    }

    /// Reads a curve file ([`points`]), and what a person should know of it. What a row does not state stays open; a fit
    /// takes its angle for exact, its power for σ⁰ in watts and its chirp for its number from 0.
    ///
    /// # Errors
    /// The first cell that cannot be used, with its line and column.
    pub fn read_as(bytes: &[u8], names: &ColumnNames) -> Result<(Curve, Vec<String>), FormatError> {
        let table = points(bytes, names)?;
        let unused = table.unused_deviations();
        let (curve, mut notices) = Curve::of_points(table)?;
        notices.extend(unused);
        Ok((curve, notices))
    }

    /// The curve of a table, and what a person should know of it. Deviations of levels have no place in a curve.
    ///
    /// # Errors
    /// A row that does not belong in a curve, with its line.
    pub fn of_points(points: Points) -> Result<(Curve, Vec<String>), FormatError> {
        let Points { rows, illumination, passed_over, notices, .. } = points;
        let notices: Vec<String> = passed_over.into_iter().chain(notices).collect();
        let mut observations = Vec::new();
        for (index, (line, point)) in rows.iter().enumerate() {
            let row = checked(index, point, illumination.only_detected);
            observations.push(row.map_err(|error| {
                let problem = match error {
                    ObservationError::AboveRange { .. } => {
                        "the row is above the instrument's range"
                    }
                    ObservationError::Empty { .. } => "the row has no value and no threshold",
                    ObservationError::BelowThreshold { .. } => {
                        let problem = "the level is below its own threshold, and only detections were recorded";
                        let place = format!("line {line}, column threshold_db");
                        return FormatError::at(place, problem, "correct one of the two");
                    }
                    ObservationError::NoThreshold { .. } => {
                        let problem = "only detections were recorded, and the row has no threshold";
                        let way_out = "fill in the least σ⁰ that would have been detected";
                        let place = format!("line {line}, column threshold_db");
                        return FormatError::at(place, problem, way_out);
                    }
                };
                FormatError::at(format!("line {line}"), problem, "leave it out here")
            })?);
        }
        Ok((Curve { observations, illumination }, notices))
    }

    /// The curve as a file's bytes.
    pub fn write(&self) -> Vec<u8> {
        let [mut names, lit] = self.illumination.columns();
        let only_detected = self.illumination.only_detected;
        if only_detected {
            names = format!(",threshold_db{names}");
        }
        let has_aspects = self.observations.iter().any(|o| !o.is_retro());
        if has_aspects {
            names = format!(",theta_r_deg,delta_phi_deg{names}");
        }
        let mut text = format!("{}{names}\n", COLUMNS.join(","));
        for o in &self.observations {
            let [xt_m, yt_m] = o.target_m.map_or_else(Default::default, |place| {
                place.map(|metres| format!("{:.5}", metres + 0.0))
            });
            let limit = o.threshold_sigma0.filter(|_| only_detected);
            let limit =
                limit.map_or(String::new(), |limit| format!(",{:.3}", db_from_ratio(limit)));
            let aspect = if has_aspects {
                format!(",{:.4},{:.4}", o.theta_r_rad.to_degrees(), o.delta_phi_rad.to_degrees())
            } else {
                String::new()
            };
            text += &format!(
                "{:.4},{},{},{},{},{},{},{xt_m},{yt_m}{aspect}{limit}{lit}\n",
                o.theta_i_rad.to_degrees(),
                cell(o.theta_sd_rad.map(f64::to_degrees), 4),
                cell(o.power_w.map(dbm_from_watts), 3),
                cell(o.level_sigma0().map(db_from_ratio), 3),
                cell(o.range_m, 5),
                o.chirp.map_or(String::new(), |chirp| chirp.to_string()),
                u8::from(o.is_censored()),
            );
        }
        text.into_bytes()
    }

    /// Observations with a detection.
    pub fn detected(&self) -> impl Iterator<Item = &Observation> {
        self.observations.iter().filter(|o| !o.is_censored())
    }
}

/// A number in a cell; nothing where there is none.
fn cell(value: Option<f64>, decimals: usize) -> String {
    value.map_or(String::new(), |value| format!("{value:.decimals$}"))
}

/// σ⁰, or its limit, of an observation that belongs in a curve; `index` from 0.
///
/// # Errors
/// Why the observation does not belong in one.
pub(crate) fn level_sigma0(index: usize, o: &Observation) -> Result<f64, ObservationError> {
    let point = index + 1;
    if o.censor == Censor::Right {
        return Err(ObservationError::AboveRange { point });
    }
    o.level_sigma0().ok_or(ObservationError::Empty { point })
}

/// An observation that belongs in a curve. A limit that says nothing of it is left out.
fn checked(
    index: usize,
    o: &Observation,
    only_detected: bool,
) -> Result<Observation, ObservationError> {
    /// A tenth of a decibel, to which a file may round.
    const ROUNDING: f64 = 0.977;
    let sigma0 = level_sigma0(index, o)?;
    let threshold_sigma0 = o.threshold_sigma0.filter(|_| only_detected || o.is_censored());
    if only_detected && threshold_sigma0.is_none() {
        return Err(ObservationError::NoThreshold { point: index + 1 });
    }
    let least = threshold_sigma0.filter(|_| only_detected);
    if least.is_some_and(|least| sigma0 < least * ROUNDING) {
        return Err(ObservationError::BelowThreshold { point: index + 1 });
    }
    Ok(Observation { threshold_sigma0, ..*o })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::Footprint;

    #[test]
    fn a_curve_survives_its_file() {
        let text = "theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored,xt_m,yt_m\n\
                    12.5000,0.3000,-55.250,-9.125,8.01250,17,0,-0.01250,0.20000\n\
                    60.0000,0.3000,-77.000,-30.000,8.10000,18,1,,\n";
        let curve = Curve::read(text.as_bytes()).unwrap();
        assert_eq!(curve.detected().count(), 1);
        assert!((curve.observations[0].theta_i_rad - 12.5f64.to_radians()).abs() < 1e-15);
        assert_eq!(String::from_utf8(curve.write()).unwrap(), text);
    }

    #[test]
    fn a_curve_keeps_how_its_target_was_lit() {
        let text = "theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored,xt_m,yt_m,footprint,beam_rad\n\
                    12.5000,0.3000,-55.250,-9.125,8.01250,17,0,-0.01250,0.20000,projected,0.011704\n";
        let curve = Curve::read(text.as_bytes()).unwrap();
        let Illumination { footprint, beam_rad, .. } = curve.illumination;
        assert_eq!((footprint, beam_rad), (Some(Footprint::Projected), Some(0.011704)));
        assert_eq!(String::from_utf8(curve.write()).unwrap(), text);
    }

    #[test]
    fn the_columns_of_a_materials_curve_are_taken_too() {
        let text =
            b"# my-paint\ntheta_deg,sigma0_db,censor,threshold_db,theta_r_deg,delta_phi_deg\n\
                     10,-3,none,-30,10,0\n60,,left,-30,60,0\n";
        let curve = Curve::read(text).unwrap();
        assert_eq!(
            curve.observations.iter().map(Observation::is_censored).collect::<Vec<_>>(),
            [false, true]
        );
        assert!((curve.observations[1].threshold_sigma0.unwrap() - 1e-3).abs() < 1e-15);
        let text = b"theta_deg,sigma0_db,censor,threshold_db\n10,,right,-3\n";
        let error = Curve::read(text).unwrap_err().to_string();
        assert!(error.contains("above the instrument") && error.contains("line 2"), "{error}");
    }

    #[test]
    fn a_table_of_two_directions_survives_its_file() {
        let table = b"theta_i_deg,theta_s_deg,brdf_per_sr\n30,-30,0.1\n30,40,0.3\n30,0,0.2\n";
        let curve = Curve::read(table).unwrap();
        let aspects: Vec<bool> = curve.observations.iter().map(Observation::is_retro).collect();
        assert_eq!(aspects, [true, false, false]);
        let again = Curve::read(&curve.write()).unwrap();
        for (a, b) in curve.observations.iter().zip(&again.observations) {
            assert!((a.aspect().half_angle_rad() - b.aspect().half_angle_rad()).abs() < 1e-5);
            assert!((a.sigma0.unwrap() / b.sigma0.unwrap()).ln().abs() < 2e-4);
        }
    }

    #[test]
    fn a_material_keeps_a_curve_and_gives_it_back() {
        let text = b"theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored\n\
                     12.5,0.3,-55.25,-9.1,8.0,17,0\n60,0.3,-77,-30,8.1,18,1\n";
        let curve = Curve::read(text).unwrap();
        let kept = curve.observations.clone();
        let of = |observations: Vec<Observation>| {
            Curve::of_material(&material::Curve {
                name: "scan".to_owned(),
                source: "bench".to_owned(),
                instrument: None,
                session: None,
                illumination: curve.illumination,
                observations,
            })
        };
        assert_eq!((kept[1].sigma0, kept[1].level_sigma0()), (None, Some(1e-3)));
        assert_eq!(of(kept.clone()), Ok(curve.clone()));
        let above = Observation { censor: Censor::Right, ..kept[1] };
        let refused = of(vec![above]);
        assert_eq!(refused, Err(ObservationError::AboveRange { point: 1 }));
    }

    #[test]
    fn two_columns_are_enough() {
        let curve = Curve::read(b"theta_deg,sigma0_db\n0,-3\n45,-20\n").unwrap();
        let stated = Observation::backscatter(45f64.to_radians(), Some(0.01), None);
        assert_eq!(curve.observations[1], stated, "nothing is made up");
        let written = String::from_utf8(curve.write()).unwrap();
        assert!(written.ends_with("45.0000,,,-20.000,,,0,,\n"), "{written}");
    }

    #[test]
    fn a_cell_without_meaning_is_named() {
        for (text, place) in [
            ("theta_deg,sigma0_db\n91,-3\n", "theta_deg"),
            ("theta_deg,sigma0_db\n1,nan\n", "sigma0_db"),
            ("theta_deg,sigma0_db,censored\n1,-3,0.5\n", "censored"),
        ] {
            let error = Curve::read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains("line 2") && error.contains(place), "{error}");
        }
    }
}
