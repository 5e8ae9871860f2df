//! A backscatter curve: one row per chirp that met, or should have met, a material.
//!
//! As CSV: `theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored`. σ⁰ is that of
//! equation (10), 4π·f·cos²θ, so that a curve belongs to the material and not to the radar. A chirp
//! that should have been detected and was not is a row with `censored` = 1: its power and its σ⁰
//! are those that it stayed below.

use thiserror::Error;

use crate::formats::FormatError;
use crate::formats::csv::{Table, without_head};
use crate::material::{Censor, Observation};
use crate::units::{db_from_ratio, dbm_from_watts, ratio_from_db, watts_from_dbm};

/// Columns of a curve file, in order.
pub const COLUMNS: [&str; 7] =
    ["theta_deg", "theta_sd_deg", "power_dbm", "sigma0_db", "range_m", "chirp", "censored"];

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

    /// Reads a curve file. `theta_deg` and `sigma0_db` must be there. Without the others a row is
    /// uncensored, its angle exact, its range 0, its power σ⁰ in watts, its chirp its number from 0.
    ///
    /// The columns of a material's curve do as well: `censor` (`none`, `left`), `threshold_db`, and, for
    /// backscatter, `theta_r_deg` and `delta_phi_deg`. Lines of `#` at the head are left alone.
    ///
    /// # Errors
    /// The first cell that cannot be used, with its line and column.
    pub fn read(bytes: &[u8]) -> Result<Curve, FormatError> {
        let optional = ["theta_sd_deg", "power_dbm", "range_m", "chirp", "censored"];
        let of_materials = ["censor", "threshold_db", "theta_r_deg", "delta_phi_deg"];
        let optional = [optional.as_slice(), &of_materials].concat();
        let table = Table::read(&without_head(bytes), &["theta_deg", "sigma0_db"], &optional)?;
        let rows = (0..table.len()).map(|row| read_row(&table, row)).collect::<Result<_, _>>()?;
        Ok(Curve { rows })
    }

    /// The curve as a file's bytes.
    pub fn write(&self) -> Vec<u8> {
        let mut text = COLUMNS.join(",") + "\n";
        for row in &self.rows {
            text += &format!(
                "{:.4},{:.4},{:.3},{:.3},{:.5},{},{}\n",
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
        let Row { theta_rad, theta_sd_rad, power_w, sigma0, range_m, chirp, censored } = *self;
        Observation {
            theta_i_rad: theta_rad,
            theta_r_rad: theta_rad,
            delta_phi_rad: 0.0,
            sigma0: (!censored).then_some(sigma0),
            censor: if censored { Censor::Left } else { Censor::None },
            threshold_sigma0: censored.then_some(sigma0),
            theta_sd_rad: Some(theta_sd_rad),
            power_w: Some(power_w),
            range_m: Some(range_m),
            chirp: Some(chirp),
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
    })
}

fn read_row(table: &Table, row: usize) -> Result<Row, FormatError> {
    let bounded = |column: &'static str, (min, max): (f64, f64)| {
        let value = table.number(row, column)?;
        match (value.is_none_or(|value| (min..=max).contains(&value)), table.cell(row, column)) {
            (false, Some(cell)) => Err(cell.refuse(&format!("give a value from {min} to {max}"))),
            _ => Ok(value),
        }
    };
    let theta_deg = table.required_number(row, "theta_deg")?;
    bounded("theta_deg", (0.0, 90.0))?;
    retro(table, row, theta_deg)?;
    let is_left = is_left(table, row)?;
    let level = if is_left { "threshold_db" } else { "sigma0_db" };
    bounded(level, (-300.0, 300.0))?;
    let sigma0_db = table.required_number(row, level)?;
    let censored = bounded("censored", (0.0, 1.0))?.unwrap_or(0.0);
    if let (true, Some(cell)) = (censored.fract() != 0.0, table.cell(row, "censored")) {
        return Err(cell.refuse("give 1 for a chirp without a detection, else 0"));
    }
    let sigma0 = ratio_from_db(sigma0_db);
    let chirp = match table.cell(row, "chirp") {
        Some(_) => table.whole_number(row, "chirp")?,
        None => row as u32,
    };
    Ok(Row {
        theta_rad: theta_deg.to_radians(),
        theta_sd_rad: bounded("theta_sd_deg", (0.0, 90.0))?.unwrap_or(0.0).to_radians(),
        power_w: bounded("power_dbm", (-400.0, 400.0))?.map_or(sigma0, watts_from_dbm),
        sigma0,
        range_m: bounded("range_m", (0.0, 1e6))?.unwrap_or(0.0),
        chirp,
        censored: is_left || censored == 1.0,
    })
}

/// Whether a row says, as a material's curve does, that nothing was detected.
fn is_left(table: &Table, row: usize) -> Result<bool, FormatError> {
    match table.cell(row, "censor") {
        None => Ok(false),
        Some(cell) => match cell.text {
            "none" => Ok(false),
            "left" => Ok(true),
            "right" => Err(cell.refuse("leave points above the instrument's range out")),
            _ => Err(cell.refuse("write none or left")),
        },
    }
}

/// Refuses a row whose receiver was not where the source was.
fn retro(table: &Table, row: usize, theta_deg: f64) -> Result<(), FormatError> {
    for (column, wanted) in [("theta_r_deg", theta_deg), ("delta_phi_deg", 0.0)] {
        let is_same = |value: f64| (value - wanted).abs() < 1e-9;
        match (table.number(row, column)?, table.cell(row, column)) {
            (Some(value), Some(cell)) if !is_same(value) => {
                return Err(cell.refuse("only backscatter is taken here; leave other points out"));
            }
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_survives_its_file() {
        let text = "theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored\n\
                    12.5000,0.3000,-55.250,-9.125,8.01250,17,0\n\
                    60.0000,0.3000,-77.000,-30.000,8.10000,18,1\n";
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
        for (row, column) in [("10,-3,,,11,0", "theta_r_deg"), ("10,-3,right,,,", "censor")] {
            let text = format!(
                "theta_deg,sigma0_db,censor,threshold_db,theta_r_deg,delta_phi_deg\n{row}\n"
            );
            let error = Curve::read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(column) && error.contains("line 2"), "{error}");
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
