//! A backscatter curve: one row per chirp that met, or should have met, a material.
//!
//! As CSV: `theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored,xt_m,yt_m`. σ⁰ is that of
//! equation (10), 4π·f·cos²θ, so that a curve belongs to the material and not to the radar. A chirp
//! that should have been detected and was not is a row with `censored` = 1: its power and its σ⁰
//! are those that it stayed below.

use thiserror::Error;

use crate::formats::FormatError;
use crate::material::file::points;
use crate::material::{Censor, Observation};
use crate::units::{db_from_ratio, dbm_from_watts};

/// Columns of a curve file, in order.
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

/// One chirp's evidence of how a material scatters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Angle of incidence θ, rad, from 0 to π/2.
    pub theta_rad: f64,
    /// Standard deviation of each of the two tilts of the normal against the ray, rad. Not that of
    /// θ itself, which cannot be negative.
    pub theta_sd_rad: f64,
    /// Received power, W; for a censored row the least that would have been detected.
    pub power_w: f64,
    /// σ⁰ of that power, a pure number.
    pub sigma0: f64,
    /// Range R, m.
    pub range_m: f64,
    /// Chirp number.
    pub chirp: u32,
    /// Nothing was detected: power and σ⁰ are upper limits.
    pub censored: bool,
    /// Place on the target, (x_t, y_t) of the frame `St`, m, where it is known.
    pub target_m: Option<[f64; 2]>,
}

/// A backscatter curve, rows in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// One row per chirp.
    pub rows: Vec<Row>,
}

/// A point of a material's curve that is no row of a backscatter curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ObservationError {
    /// Source and receiver looked along different directions.
    #[error("point {point} (from 1) is bistatic; only backscatter is fitted, so leave it out")]
    Bistatic {
        /// Its number from 1.
        point: usize,
    },
    /// The true value lies above a threshold.
    #[error(
        "point {point} (from 1) is above the instrument's range, which no row says; leave it out"
    )]
    AboveRange {
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
    /// The curve of a material's observations. What an observation leaves out is as in [`Curve::read`].
    ///
    /// # Errors
    /// The first observation that a row cannot say.
    pub fn from_observations(observations: &[Observation]) -> Result<Curve, ObservationError> {
        let rows = observations.iter().enumerate().map(|(row, o)| from_observation(row, o));
        Ok(Curve { rows: rows.collect::<Result<_, _>>()? })
    }

    /// The curve as a material keeps it.
    pub fn observations(&self) -> Vec<Observation> {
        self.rows.iter().map(Row::observation).collect()
    }

    /// Whether no row has a power of its own, but σ⁰ in its place.
    pub fn lacks_power(&self) -> bool {
        self.rows.iter().all(|row| row.power_w == row.sigma0)
    }

    /// Reads a curve file ([`points`]). Without a column a row is uncensored, its angle exact, its range 0, its
    /// power σ⁰ in watts, its chirp its number from 0.
    ///
    /// # Errors
    /// The first cell that cannot be used, with its line and column, and rows that are no backscatter.
    pub fn read(bytes: &[u8]) -> Result<Curve, FormatError> {
        let row = |(index, (line, point)): (usize, (usize, Observation))| {
            from_observation(index, &point).map_err(|error| {
                let problem = match error {
                    ObservationError::Bistatic { .. } => "the row is bistatic",
                    ObservationError::AboveRange { .. } => {
                        "the row is above the instrument's range"
                    }
                    ObservationError::Empty { .. } => "the row has no value and no threshold",
                };
                FormatError::at(format!("line {line}"), problem, "leave it out here")
            })
        };
        let rows = points(bytes)?.into_iter().enumerate().map(row).collect::<Result<_, _>>()?;
        Ok(Curve { rows })
    }

    /// The curve as a file's bytes.
    pub fn write(&self) -> Vec<u8> {
        let mut text = COLUMNS.join(",") + "\n";
        for row in &self.rows {
            let [xt_m, yt_m] = row.target_m.map_or_else(Default::default, |place| {
                place.map(|metres| format!("{:.5}", metres + 0.0))
            });
            text += &format!(
                "{:.4},{:.4},{:.3},{:.3},{:.5},{},{},{xt_m},{yt_m}\n",
                row.theta_rad.to_degrees(),
                row.theta_sd_rad.to_degrees(),
                dbm_from_watts(row.power_w),
                db_from_ratio(row.sigma0),
                row.range_m,
                row.chirp,
                u8::from(row.censored),
            );
        }
        text.into_bytes()
    }

    /// Rows with a detection.
    pub fn detected(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter().filter(|row| !row.censored)
    }
}

impl Row {
    fn observation(&self) -> Observation {
        let Row { theta_rad, theta_sd_rad, power_w, sigma0, range_m, chirp, censored, target_m } =
            *self;
        let (level, limit) = ((!censored).then_some(sigma0), censored.then_some(sigma0));
        Observation {
            theta_sd_rad: Some(theta_sd_rad),
            power_w: Some(power_w),
            range_m: Some(range_m),
            chirp: Some(chirp),
            target_m,
            ..Observation::backscatter(theta_rad, level, limit)
        }
    }
}

fn from_observation(index: usize, o: &Observation) -> Result<Row, ObservationError> {
    let point = index + 1;
    if !o.is_retro() {
        return Err(ObservationError::Bistatic { point });
    }
    let level = match o.censor {
        Censor::Right => return Err(ObservationError::AboveRange { point }),
        Censor::Left => o.threshold_sigma0,
        Censor::None => o.sigma0,
    };
    let Some(sigma0) = level else { return Err(ObservationError::Empty { point }) };
    Ok(Row {
        theta_rad: o.theta_i_rad,
        theta_sd_rad: o.theta_sd_rad.unwrap_or(0.0),
        power_w: o.power_w.unwrap_or(sigma0),
        sigma0,
        range_m: o.range_m.unwrap_or(0.0),
        chirp: o.chirp.unwrap_or(index as u32),
        censored: o.censor == Censor::Left,
        target_m: o.target_m,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_survives_its_file() {
        let text = "theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored,xt_m,yt_m\n\
                    12.5000,0.3000,-55.250,-9.125,8.01250,17,0,-0.01250,0.20000\n\
                    60.0000,0.3000,-77.000,-30.000,8.10000,18,1,,\n";
        let curve = Curve::read(text.as_bytes()).unwrap();
        assert_eq!(curve.detected().count(), 1);
        assert!((curve.rows[0].theta_rad - 12.5f64.to_radians()).abs() < 1e-15);
        assert_eq!(String::from_utf8(curve.write()).unwrap(), text);
    }

    #[test]
    fn the_columns_of_a_materials_curve_are_taken_too() {
        let text =
            b"# my-paint\ntheta_deg,sigma0_db,censor,threshold_db,theta_r_deg,delta_phi_deg\n\
                     10,-3,none,-30,10,0\n60,,left,-30,60,0\n";
        let curve = Curve::read(text).unwrap();
        assert_eq!(curve.rows.iter().map(|row| row.censored).collect::<Vec<_>>(), [false, true]);
        assert!((curve.rows[1].sigma0 - 1e-3).abs() < 1e-15);
        for (row, said) in
            [("10,-3,,,11,0", "bistatic"), ("10,,right,-3,,", "above the instrument")]
        {
            let text = format!(
                "theta_deg,sigma0_db,censor,threshold_db,theta_r_deg,delta_phi_deg\n{row}\n"
            );
            let error = Curve::read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(said) && error.contains("line 2"), "{error}");
        }
    }

    #[test]
    fn a_material_keeps_a_curve_and_gives_it_back() {
        let text = b"theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored\n\
                     12.5,0.3,-55.25,-9.1,8.0,17,0\n60,0.3,-77,-30,8.1,18,1\n";
        let curve = Curve::read(text).unwrap();
        let kept = curve.observations();
        assert_eq!((kept[1].sigma0, kept[1].threshold_sigma0), (None, Some(curve.rows[1].sigma0)));
        assert_eq!(Curve::from_observations(&kept), Ok(curve));
        let bistatic = Observation { delta_phi_rad: 1.0, ..kept[0] };
        let refused = Curve::from_observations(&[kept[0], bistatic]);
        assert_eq!(refused, Err(ObservationError::Bistatic { point: 2 }));
        let above = Observation { censor: Censor::Right, ..kept[1] };
        let refused = Curve::from_observations(&[above]);
        assert_eq!(refused, Err(ObservationError::AboveRange { point: 1 }));
    }

    #[test]
    fn two_columns_are_enough() {
        let curve = Curve::read(b"theta_deg,sigma0_db\n0,-3\n45,-20\n").unwrap();
        assert_eq!(curve.rows[1].chirp, 1);
        assert!(!curve.rows[1].censored && curve.rows[1].theta_sd_rad == 0.0);
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
