//! The CSV of a curve, as every command reads it: a point per line, in degrees and dB.

use crate::formats::FormatError;
use crate::formats::csv::{Table, without_head};
use crate::material::curve::{Censor, Illumination, Observation};
use crate::radar::Footprint;
use crate::units::{ratio_from_db, watts_from_dbm};

const REQUIRED: [&str; 2] = ["theta_deg", "sigma0_db"];
const OPTIONAL: [&str; 15] = [
    "censor",
    "threshold_db",
    "theta_r_deg",
    "delta_phi_deg",
    "theta_sd_deg",
    "power_dbm",
    "range_m",
    "chirp",
    "censored",
    "xt_m",
    "yt_m",
    "footprint",
    "beam_rad",
    "curve",
    "kind",
];

/// Angles that a surface can be seen under, degrees.
const QUARTER_TURN_DEG: (f64, f64) = (0.0, 90.0);
/// Levels that are no slip, dB.
const LEVELS_DB: (f64, f64) = (-300.0, 300.0);
/// Powers that are no slip, dBm.
const POWERS_DBM: (f64, f64) = (-400.0, 400.0);
/// Ranges that are no slip, m.
const RANGES_M: (f64, f64) = (0.0, 1e6);
/// Places on a target that are no slip, m.
const PLACES_M: (f64, f64) = (-1e6, 1e6);

/// Divergences of beams that are no slip, rad.
const BEAMS_RAD: (f64, f64) = (1e-6, std::f64::consts::FRAC_PI_2);

/// The CSV of a curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Each point behind the number of its line.
    pub rows: Vec<(usize, Observation)>,
    /// How the target was lit, as far as the columns `footprint` and `beam_rad` state it.
    pub illumination: Illumination,
}

/// Reads a curve's CSV. Lines of `#` at the head are left alone.
///
/// Where nothing was detected, `censor` is `left` and `threshold_db` the σ⁰ that it stayed below; `censored`
/// = 1, as `matdb measure` writes, says the same of the level in `sigma0_db`.
///
/// # Errors
/// The first cell that cannot be used, with its line and column.
pub fn points(bytes: &[u8]) -> Result<Points, FormatError> {
    let table = Table::read(&without_head(bytes), &REQUIRED, &OPTIONAL)?;
    one_of(&table, "curve", "another curve begins here")?;
    one_of(&table, "footprint", "the rows above have another footprint")?;
    one_of(&table, "beam_rad", "the rows above have another beam")?;
    let mut rows = Vec::with_capacity(table.len());
    for row in 0..table.len() {
        rows.push((table.line(row), point(&table, row)?));
    }
    Ok(Points { rows, illumination: illumination(&table)? })
}

/// Refuses a table with two values of a column that belongs to the curve: that of a published page may have several
/// curves.
fn one_of(table: &Table, column: &str, problem: &str) -> Result<(), FormatError> {
    let text = |row| table.cell(row, column).map(|cell| cell.text);
    match (1..table.len()).find(|row| text(*row) != text(0)) {
        None => Ok(()),
        Some(row) => Err(FormatError::at(
            format!("line {}, column {column}", table.line(row)),
            problem,
            "keep the rows of one curve",
        )),
    }
}

/// What the columns of the whole curve say, by its first row.
fn illumination(table: &Table) -> Result<Illumination, FormatError> {
    let footprint = match table.cell(0, "footprint") {
        None => None,
        Some(cell) => Some(match cell.text {
            "paper" => Footprint::Paper,
            "projected" => Footprint::Projected,
            _ => return Err(cell.refuse("write paper or projected, or leave it empty")),
        }),
    };
    Ok(Illumination { footprint, beam_rad: table.number_within(0, "beam_rad", BEAMS_RAD)? })
}

fn point(table: &Table, row: usize) -> Result<Observation, FormatError> {
    let number = |column: &'static str, range| table.number_within(row, column, range);
    table.required_number(row, "theta_deg")?;
    let theta_i_deg = number("theta_deg", QUARTER_TURN_DEG)?.unwrap_or_default();
    let censor = censor(table, row)?;
    let level_db = number("sigma0_db", LEVELS_DB)?;
    let limit_db = number("threshold_db", LEVELS_DB)?;
    let is_flagged = censor == Censor::Left && table.cell(row, "censored").is_some();
    let (level_db, limit_db) = match (censor, level_db, limit_db) {
        (Censor::Left, level, limit) if is_flagged => (None, limit.or(level)),
        (_, level, limit) => (level, limit),
    };
    stated(table, row, censor, [level_db, limit_db])?;
    let chirp = table.cell(row, "chirp").map(|_| table.whole_number(row, "chirp")).transpose()?;
    Ok(Observation {
        theta_i_rad: theta_i_deg.to_radians(),
        theta_r_rad: number("theta_r_deg", QUARTER_TURN_DEG)?.unwrap_or(theta_i_deg).to_radians(),
        delta_phi_rad: table.number(row, "delta_phi_deg")?.unwrap_or(0.0).to_radians(),
        sigma0: level_db.map(ratio_from_db),
        censor,
        threshold_sigma0: limit_db.map(ratio_from_db),
        theta_sd_rad: number("theta_sd_deg", QUARTER_TURN_DEG)?.map(f64::to_radians),
        power_w: number("power_dbm", POWERS_DBM)?.map(watts_from_dbm),
        range_m: number("range_m", RANGES_M)?,
        chirp,
        target_m: place(table, row)?,
    })
}

/// Where on the target the point lies; both coordinates or none.
fn place(table: &Table, row: usize) -> Result<Option<[f64; 2]>, FormatError> {
    let [xt_m, yt_m] = ["xt_m", "yt_m"].map(|column| table.number_within(row, column, PLACES_M));
    match (xt_m?, yt_m?) {
        (None, None) => Ok(None),
        (Some(xt_m), Some(yt_m)) => Ok(Some([xt_m, yt_m])),
        (xt_m, _) => Err(FormatError::at(
            format!(
                "line {}, column {}",
                table.line(row),
                if xt_m.is_some() { "yt_m" } else { "xt_m" }
            ),
            "the cell is empty and the other coordinate is there",
            "give both or neither",
        )),
    }
}

fn censor(table: &Table, row: usize) -> Result<Censor, FormatError> {
    let stated = match table.cell(row, "censor") {
        None => None,
        Some(cell) => Some(match cell.text {
            "none" => Censor::None,
            "left" => Censor::Left,
            "right" => Censor::Right,
            _ => return Err(cell.refuse("write none, left or right")),
        }),
    };
    match (table.cell(row, "censored"), stated) {
        (None, stated) => Ok(stated.unwrap_or(Censor::None)),
        (Some(cell), Some(_)) => Err(cell.refuse("leave it empty, since `censor` says it")),
        (Some(cell), None) => match cell.text.parse::<f64>() {
            Ok(0.0) => Ok(Censor::None),
            Ok(1.0) => Ok(Censor::Left),
            _ => Err(cell.refuse("give 1 for a chirp without a detection, else 0")),
        },
    }
}

/// Refuses a row that has neither level nor limit, or the wrong one of them.
fn stated(
    table: &Table,
    row: usize,
    censor: Censor,
    [level, limit]: [Option<f64>; 2],
) -> Result<(), FormatError> {
    const LIMIT: &str = "the limit, in σ⁰ dB, in `threshold_db` (the radar's threshold is in dBm and \
                         stands elsewhere)";
    let refuse = |column, problem, way_out: String| {
        Err(FormatError::at(format!("line {}, column {column}", table.line(row)), problem, way_out))
    };
    match (censor, level, limit) {
        (Censor::None, None, _) => refuse(
            "sigma0_db",
            "the cell is empty",
            format!("where nothing was detected write `left` in `censor` and {LIMIT}"),
        ),
        (Censor::Left | Censor::Right, Some(_), _) => {
            let way_out = "leave sigma0_db empty there, or `censor`";
            refuse("sigma0_db", "the row has a level and is censored", way_out.to_owned())
        }
        (Censor::Left | Censor::Right, None, None) => {
            refuse("threshold_db", "the cell is empty", format!("give {LIMIT}"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "theta_deg,sigma0_db,censor,threshold_db,censored\n";

    fn read(row: &str) -> Result<Vec<(usize, Observation)>, String> {
        let read = points(format!("# head\n{HEADER}{row}\n").as_bytes());
        read.map(|points| points.rows).map_err(|error| error.to_string())
    }

    #[test]
    fn both_ways_of_saying_that_nothing_was_detected_say_the_same() {
        let codes = read("60,,left,-30,").unwrap();
        assert_eq!(codes, read("60,-30,,,1").unwrap());
        let (line, point) = codes[0];
        assert_eq!((line, point.censor, point.sigma0), (3, Censor::Left, None));
        assert!((point.threshold_sigma0.unwrap() - 1e-3).abs() < 1e-15);
        assert_eq!(read("60,-30,,,0").unwrap(), read("60,-30,none,,").unwrap());
    }

    #[test]
    fn a_row_that_says_too_little_or_too_much_is_named_by_its_line() {
        for (row, said) in [
            ("60,,,,", "line 3, column sigma0_db: the cell is empty; where nothing was detected"),
            ("60,,left,,", "line 3, column threshold_db: the cell is empty; give the limit, in σ⁰"),
            ("60,-3,left,-30,", "line 3, column sigma0_db: the row has a level and is censored"),
            ("60,-3,none,,1", "line 3, column censored: `1` is not accepted here"),
            (
                "95,-3,,,",
                "line 3, column theta_deg: `95` is not accepted here; give a value from 0",
            ),
            ("60,-3,low,,", "line 3, column censor: `low`"),
            (",-3,,,", "line 3, column theta_deg: the cell is empty"),
        ] {
            let error = read(row).unwrap_err();
            assert!(error.starts_with(said), "{error}");
        }
    }

    #[test]
    fn a_place_has_two_coordinates_or_none() {
        let read = |row: &str| points(format!("theta_deg,sigma0_db,xt_m,yt_m\n{row}\n").as_bytes());
        assert_eq!(read("10,-3,0.1,-0.2").unwrap().rows[0].1.target_m, Some([0.1, -0.2]));
        assert_eq!(read("10,-3,,").unwrap().rows[0].1.target_m, None);
        for (row, column) in [("10,-3,0.1,", "yt_m"), ("10,-3,,0.1", "xt_m")] {
            let said = read(row).unwrap_err().to_string();
            assert!(
                said.starts_with(&format!("line 2, column {column}: the cell is empty")),
                "{said}"
            );
        }
    }

    #[test]
    fn how_the_target_was_lit_is_one_statement_for_all_rows() {
        let read = |rows: &str| {
            let text = format!("theta_deg,sigma0_db,footprint,beam_rad\n{rows}");
            points(text.as_bytes()).map(|points| points.illumination).map_err(|e| e.to_string())
        };
        let lit = read("10,-3,projected,0.0117\n20,-4,projected,0.0117\n").unwrap();
        assert_eq!((lit.footprint, lit.beam_rad), (Some(Footprint::Projected), Some(0.0117)));
        assert_eq!(read("10,-3,,\n"), Ok(Illumination::default()));
        for (rows, said) in [
            ("10,-3,flat,\n", "line 2, column footprint: `flat` is not accepted here; write paper"),
            ("10,-3,,0\n", "line 2, column beam_rad: `0` is not accepted here; give a value from"),
            ("10,-3,,\n20,-4,paper,\n", "line 3, column footprint: the rows above have another"),
            ("10,-3,,0.01\n20,-4,,0.02\n", "line 3, column beam_rad: the rows above have another"),
        ] {
            let error = read(rows).unwrap_err();
            assert!(error.starts_with(said), "{error}");
        }
    }

    #[test]
    fn a_published_table_is_read_when_it_has_one_curve() {
        let read =
            |rows: &str| points(format!("curve,kind,theta_deg,sigma0_db\n{rows}").as_bytes());
        assert_eq!(read("scan,measured,10,-3\nscan,measured,20,-4\n").unwrap().rows.len(), 2);
        let said = read("scan,measured,10,-3\nother,measured,20,-4\n").unwrap_err().to_string();
        assert!(
            said.starts_with("line 3, column curve: another curve begins here; keep"),
            "{said}"
        );
    }
}
