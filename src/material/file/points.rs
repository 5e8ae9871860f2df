//! The table of a curve, as every command reads it: a point per line, in degrees and dB.
//!
//! An angle is `theta_deg`, `grazing_deg` (from the surface), or `theta_signed_deg`, whose sign is left alone: one side
//! of the normal is as good as the other. A level is `sigma0_db` or `sigma0`, a ratio. Both may instead be those of the
//! plane of incidence: `theta_i_deg`, `theta_s_deg` (positive on the side of the mirror direction) and `brdf_per_sr`.
//! A level that is not above its blank (`blank_db`, or `blank_per_sr`) counts as a limit at the blank. A `.bsdf` is read as
//! a table in the plane of incidence.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::in_plane::{self, InPlane, VALUES_PER_SR};
use crate::formats::csv::{Names, Table};
use crate::formats::{ColumnNames, FormatError};
use crate::material::curve::{Censor, Illumination, Observation};
use crate::radar::Footprint;
use crate::units::{db_from_ratio, ratio_from_db, watts_from_dbm};

/// Columns of the angle of backscatter, of which one is needed.
const ANGLES: [&str; 3] = ["theta_deg", "grazing_deg", "theta_signed_deg"];
/// Columns of the level of backscatter, of which one is needed.
const LEVELS: [&str; 2] = ["sigma0_db", "sigma0"];
/// Columns of a table in the plane of incidence, all needed.
const IN_PLANE: [&str; 3] = ["theta_i_deg", "theta_s_deg", "brdf_per_sr"];
/// Columns that only a table of backscatter or of rows with `theta_r_deg` and `delta_phi_deg` may have.
const NOT_IN_PLANE: [&str; 7] = [
    "censor",
    "threshold_db",
    "theta_r_deg",
    "delta_phi_deg",
    "censored",
    "only_detected",
    "blank_db",
];
/// Columns that only a table in the plane of incidence may have.
const ONLY_IN_PLANE: [&str; 2] = ["theta_i_deg", "blank_per_sr"];
/// Those of them that say what was not detected.
const LIMITS: [&str; 6] =
    ["censor", "threshold_db", "censored", "only_detected", "blank_db", "blank_per_sr"];
/// Columns of any table.
const OPTIONAL: [&str; 12] = [
    "theta_sd_deg",
    "power_dbm",
    "range_m",
    "chirp",
    "xt_m",
    "yt_m",
    "footprint",
    "beam_rad",
    "relative",
    "curve",
    "kind",
    "sd_db",
];

/// Angles that a surface can be seen under, degrees.
const QUARTER_TURN_DEG: (f64, f64) = (0.0, 90.0);
/// Azimuths between source and receiver, degrees.
const TURN_DEG: (f64, f64) = (-360.0, 360.0);
/// Deviations of levels that are no slip, dB.
const DEVIATIONS_DB: (f64, f64) = (1e-6, 100.0);
/// Levels that are no slip, dB.
const LEVELS_DB: (f64, f64) = (-300.0, 300.0);
/// The same as ratios.
const RATIOS: (f64, f64) = (1e-30, 1e30);
/// Powers that are no slip, dBm.
const POWERS_DBM: (f64, f64) = (-400.0, 400.0);
/// Difference of two limits that is rounding, dB.
const SAME_DB: f64 = 0.01;
/// Ranges that are no slip, m.
const RANGES_M: (f64, f64) = (0.0, 1e6);
/// Places on a target that are no slip, m.
const PLACES_M: (f64, f64) = (-1e6, 1e6);

/// Divergences of beams that are no slip, rad.
const BEAMS_RAD: (f64, f64) = (1e-6, std::f64::consts::FRAC_PI_2);

/// The CSV of a curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Points {
    /// Each point behind the number of its line, or of its value in a `.bsdf`.
    pub rows: Vec<(usize, Observation)>,
    /// Standard deviation of the level of each point, dB, where the file states it.
    pub sd_db: Vec<Option<f64>>,
    /// How the target was lit and seen, as far as columns state it.
    pub illumination: Illumination,
    /// A sentence on columns of which nothing is read.
    pub passed_over: Option<String>,
    /// What else a person should know of the file.
    pub notices: Vec<String>,
}

impl Points {
    /// That levels have deviations, for what has no use for them.
    pub fn unused_deviations(&self) -> Option<String> {
        let stated = self.sd_db.iter().any(Option::is_some);
        stated.then(|| "the deviations in `sd_db` are not used here, nor stored".to_owned())
    }
}

/// Reads a curve's table, whose columns have these names of ours; others are passed over with a notice. Lines of `#` at
/// the head are left alone.
///
/// Where nothing was detected, `censor` is `left` and `threshold_db` the σ⁰ that it stayed below; `censored`
/// = 1, as `matdb measure` writes, says the same of the level in `sigma0_db`.
///
/// # Errors
/// The first cell that cannot be used, with its line and column; a table in which every level is below its blank.
pub fn points(bytes: &[u8], names: &ColumnNames) -> Result<Points, FormatError> {
    if in_plane::is_bsdf(bytes) {
        let (values, notices) = in_plane::read_bsdf(bytes)?;
        let rows = values.iter().map(InPlane::observation).enumerate();
        return Ok(Points {
            rows: rows.map(|(n, row)| (n + 1, row)).collect(),
            sd_db: vec![None; values.len()],
            notices,
            ..Points::default()
        });
    }
    let mut table = Table::parse(bytes, Names::InFirstLine)?;
    table.rename(names)?;
    table.lower_case();
    let form = Form::of(&table)?;
    form.refuse_the_other(&table)?;
    let known: Vec<&str> =
        [&ANGLES[..], &LEVELS, &IN_PLANE, &NOT_IN_PLANE, &ONLY_IN_PLANE, &OPTIONAL].concat();
    let passed_over = table.passed_over(&known);
    let mut notices = Vec::new();
    one_of(&table, "curve", "another curve begins here")?;
    one_of(&table, "footprint", "the rows above have another footprint")?;
    one_of(&table, "beam_rad", "the rows above have another beam")?;
    one_of(&table, "relative", "the rows above say otherwise")?;
    one_of(&table, "only_detected", "the rows above say otherwise")?;
    let (mut rows, mut sd_db) = (Vec::with_capacity(table.len()), Vec::new());
    let mut below = 0;
    for row in 0..table.len() {
        let point = form.point(&table, row)?;
        let (point, is_below) = above_blank(point, form.blank(&table, row, &point)?);
        below += usize::from(is_below);
        rows.push((table.line(row), point));
        sd_db.push(table.number_within(row, "sd_db", DEVIATIONS_DB)?);
    }
    if below > 0 {
        let all = rows.len();
        if below == all {
            let problem = "no level is above its blank, so that nothing was measured";
            return Err(FormatError::at("the table", problem, "check which column is the blank"));
        }
        notices
            .push(format!("{below} of {all} levels are not above their blank and count as limits"));
    }
    notices.extend(copies(&rows, &sd_db));
    let illumination = illumination(&table)?;
    Ok(Points { rows, sd_db, illumination, passed_over, notices })
}

/// That the longest run of rows that repeats an earlier one exactly is no chance.
fn copies(rows: &[(usize, Observation)], sd_db: &[Option<f64>]) -> Option<String> {
    /// Rows of a copy where the rest is more than that: levels of few digits coincide at repeated angles.
    const FEWEST: usize = 10;
    const FEWEST_OF_HALF: usize = 3;
    let mut seen: HashMap<[Option<u64>; 12], usize> = HashMap::new();
    // Of the run so far: how far back the rows are that it repeats, its first row, and how many detections it has.
    let mut run = (0, 0, 0);
    let mut longest = run;
    for (place, (_, point)) in rows.iter().enumerate() {
        match seen.entry(bits(point, sd_db[place])) {
            Entry::Vacant(new) => {
                new.insert(place);
                run = (0, place + 1, 0);
            }
            Entry::Occupied(known) => {
                let back = place - known.get();
                if back != run.0 {
                    run = (back, place, 0);
                }
                // Limits at repeated angles are all alike.
                run.2 += usize::from(!point.is_censored());
                longest = if run.2 > longest.2 { run } else { longest };
            }
        }
    }
    let (back, first, count) = longest;
    let detected = rows.iter().filter(|(_, point)| !point.is_censored()).count();
    let is_half = 2 * count >= detected && count >= FEWEST_OF_HALF;
    (is_half || (count >= FEWEST && FEWEST * count >= detected)).then(|| {
        format!(
            "from line {} on {count} rows may be a copy of those from line {} on: each counts as a measurement of its own, so \
             leave copies out",
            rows[first].0,
            rows[first - back].0
        )
    })
}

/// Every number of a point.
fn bits(point: &Observation, sd_db: Option<f64>) -> [Option<u64>; 12] {
    let Observation { theta_i_rad, theta_r_rad, delta_phi_rad, sigma0, .. } = *point;
    let Observation { threshold_sigma0, theta_sd_rad, power_w, range_m, chirp, target_m, .. } =
        *point;
    let place = target_m.map_or([None; 2], |place| place.map(Some));
    let angles = [theta_i_rad, theta_r_rad, delta_phi_rad].map(Some);
    let others = [sigma0, threshold_sigma0, theta_sd_rad, power_w, range_m, sd_db];
    let mut numbers = angles.into_iter().chain(others).chain(place);
    std::array::from_fn(|index| match index {
        11 => chirp.map(u64::from),
        _ => numbers.next().flatten().map(f64::to_bits),
    })
}

/// What the rows of a table hold.
#[derive(Clone, Copy, Debug)]
enum Form {
    /// Backscatter over the column of its angle, as the column of its level.
    Backscatter { angle: &'static str, level: &'static str },
    /// The plane of incidence.
    InPlane,
}

impl Form {
    fn of(table: &Table) -> Result<Form, FormatError> {
        if IN_PLANE[1..].iter().any(|column| table.has(column)) {
            table.check(&IN_PLANE)?;
            return Ok(Form::InPlane);
        }
        let (angle, level) = (the_one(table, &ANGLES)?, the_one(table, &LEVELS)?);
        table.check(&[])?;
        Ok(Form::Backscatter { angle, level })
    }

    /// Refuses columns that a table of the other form has.
    fn refuse_the_other(self, table: &Table) -> Result<(), FormatError> {
        let (others, own, limit) = match self {
            Form::Backscatter { .. } => {
                (&ONLY_IN_PLANE[..], "backscatter", "its blank in blank_db")
            }
            Form::InPlane => (
                &[&ANGLES[..], &LEVELS, &NOT_IN_PLANE].concat()[..],
                "the plane of incidence",
                "a limit in blank_per_sr",
            ),
        };
        let Some(column) = others.iter().find(|column| table.has(column)) else { return Ok(()) };
        let pass_over = format!("pass the column over by --columns {column}=-");
        let is_of_limits = LIMITS.contains(column);
        let way_out =
            if is_of_limits { format!("give {limit}, or {pass_over}") } else { pass_over };
        let problem = format!("a table of {own} has no `{column}`");
        Err(FormatError::at("the header", problem, way_out))
    }

    fn point(self, table: &Table, row: usize) -> Result<Observation, FormatError> {
        let point = match self {
            Form::Backscatter { angle, level } => point(table, row, angle, level)?,
            Form::InPlane => in_plane::read_row(table, row)?.observation(),
        };
        let number = |column: &'static str, range| table.number_within(row, column, range);
        let chirp =
            table.cell(row, "chirp").map(|_| table.whole_number(row, "chirp")).transpose()?;
        Ok(Observation {
            theta_sd_rad: number("theta_sd_deg", QUARTER_TURN_DEG)?.map(f64::to_radians),
            power_w: number("power_dbm", POWERS_DBM)?.map(watts_from_dbm),
            range_m: number("range_m", RANGES_M)?,
            chirp,
            target_m: place(table, row)?,
            ..point
        })
    }

    /// The blank of a row as σ⁰.
    fn blank(
        self,
        table: &Table,
        row: usize,
        point: &Observation,
    ) -> Result<Option<f64>, FormatError> {
        match self {
            Form::Backscatter { .. } => {
                Ok(table.number_within(row, "blank_db", LEVELS_DB)?.map(ratio_from_db))
            }
            Form::InPlane => {
                let blank = table.number_within(row, "blank_per_sr", VALUES_PER_SR)?;
                Ok(blank.map(|f_per_sr| f_per_sr * point.aspect().sigma0_per_f()))
            }
        }
    }
}

/// The only one of some columns.
fn the_one(table: &Table, names: &[&'static str]) -> Result<&'static str, FormatError> {
    let there: Vec<&'static str> = names.iter().copied().filter(|name| table.has(name)).collect();
    match there[..] {
        [] if table.columns().next().is_none() => {
            Err(FormatError::at("the file", "it is empty", "give the curve's table"))
        }
        [] => Err(FormatError::at(
            "the header",
            format!("there is no column `{}`", names[0]),
            format!(
                "the columns are {}; give others their names by --columns THEIRS=OURS: a curve has theta_deg and \
                 sigma0_db, or theta_i_deg, theta_s_deg and brdf_per_sr",
                table.columns().collect::<Vec<_>>().join(", ")
            ),
        )),
        [only] => Ok(only),
        [first, second, ..] => Err(FormatError::at(
            "the header",
            format!("there are both `{first}` and `{second}`"),
            format!("pass one over, as by --columns {second}=-"),
        )),
    }
}

/// The point as a limit at its blank, where its level is not above that; and whether it is so.
fn above_blank(point: Observation, blank_sigma0: Option<f64>) -> (Observation, bool) {
    match (point.sigma0, blank_sigma0) {
        (Some(sigma0), Some(blank)) if sigma0 <= blank => {
            let threshold_sigma0 = Some(blank);
            (Observation { sigma0: None, censor: Censor::Left, threshold_sigma0, ..point }, true)
        }
        _ => (point, false),
    }
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
    Ok(Illumination {
        footprint,
        beam_rad: table.number_within(0, "beam_rad", BEAMS_RAD)?,
        relative: flag(table, "relative")?,
        only_detected: flag(table, "only_detected")?,
    })
}

/// A column that is 1 in every row, or 0, or not there.
fn flag(table: &Table, column: &str) -> Result<bool, FormatError> {
    match table.cell(0, column) {
        None => Ok(false),
        Some(cell) => match cell.text {
            "1" => Ok(true),
            "0" => Ok(false),
            _ => Err(cell.refuse("give 1 for yes, else 0")),
        },
    }
}

/// The angle of incidence of a row, degrees.
fn theta_i_deg(table: &Table, row: usize, angle: &str) -> Result<f64, FormatError> {
    let is_signed = angle == "theta_signed_deg";
    if !is_signed
        && let Some(cell) = table.cell(row, angle)
        && table.number(row, angle)?.is_some_and(|deg| deg < 0.0)
    {
        return Err(cell.refuse(
            "give a value from 0 to 90; angles to both sides of the normal are `theta_signed_deg`",
        ));
    }
    let range = if is_signed { (-90.0, 90.0) } else { QUARTER_TURN_DEG };
    let stated_deg = table.required_within(row, angle, range)?;
    Ok(if angle == "grazing_deg" { 90.0 - stated_deg } else { stated_deg.abs() })
}

/// The level of a row, dB; one that is not above zero is that of its blank.
fn level_db(table: &Table, row: usize, level: &str) -> Result<Option<f64>, FormatError> {
    if level == "sigma0_db" {
        return table.number_within(row, level, LEVELS_DB);
    }
    match (table.number(row, level)?, table.cell(row, level)) {
        (Some(ratio), Some(cell)) if ratio <= 0.0 => {
            let blank_db = table.number_within(row, "blank_db", LEVELS_DB)?;
            blank_db.map(Some).ok_or_else(|| {
                cell.refuse(
                    "a level that is not above zero is a limit: give its blank in `blank_db`, or write `left` in `censor`, \
                     and the level of the noise in `threshold_db`",
                )
            })
        }
        _ => Ok(table.number_within(row, level, RATIOS)?.map(db_from_ratio)),
    }
}

fn point(
    table: &Table,
    row: usize,
    angle: &str,
    level: &'static str,
) -> Result<Observation, FormatError> {
    let number = |column: &'static str, range| table.number_within(row, column, range);
    let theta_i_deg = theta_i_deg(table, row, angle)?;
    let censor = censor(table, row)?;
    let level_db = level_db(table, row, level)?;
    let limit_db = number("threshold_db", LEVELS_DB)?;
    let is_flagged = censor == Censor::Left && table.cell(row, "censored").is_some();
    if let (true, Some(level_db), Some(limit_db)) = (is_flagged, level_db, limit_db)
        && (level_db - limit_db).abs() > SAME_DB
    {
        let place = format!("line {}, column threshold_db", table.line(row));
        let problem = format!("`{level}` is another limit, since `censored` is 1");
        return Err(FormatError::at(place, problem, "give one of them"));
    }
    let (level_db, limit_db) = match (censor, level_db, limit_db) {
        (Censor::Left, level, limit) if is_flagged => (None, limit.or(level)),
        (_, level, limit) => (level, limit),
    };
    stated(table, row, censor, [level_db, limit_db], level)?;
    // A whole turn is none.
    let delta_phi_deg = number("delta_phi_deg", TURN_DEG)?.unwrap_or(0.0) % 360.0;
    Ok(Observation {
        theta_r_rad: number("theta_r_deg", QUARTER_TURN_DEG)?.unwrap_or(theta_i_deg).to_radians(),
        delta_phi_rad: delta_phi_deg.to_radians() + 0.0,
        sigma0: level_db.map(ratio_from_db),
        censor,
        threshold_sigma0: limit_db.map(ratio_from_db),
        ..Observation::backscatter(theta_i_deg.to_radians(), None, None)
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
    column: &str,
) -> Result<(), FormatError> {
    const LIMIT: &str = "the limit, in σ⁰ dB, in `threshold_db` (the radar's threshold is in dBm and \
                         stands elsewhere)";
    let refuse = |column, problem, way_out: String| {
        Err(FormatError::at(format!("line {}, column {column}", table.line(row)), problem, way_out))
    };
    match (censor, level, limit) {
        (Censor::None, None, _) => refuse(
            column,
            "the cell is empty",
            format!(
                "leave the line out, or where nothing was detected write `left` in `censor` and {LIMIT}"
            ),
        ),
        (Censor::Left | Censor::Right, Some(_), _) => {
            let way_out = format!("leave {column} empty there, or `censor`");
            refuse(column, "the row has a level and is censored", way_out)
        }
        (Censor::Left | Censor::Right, None, None) => {
            refuse("threshold_db", "the cell is empty", format!("give {LIMIT}"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn ours() -> ColumnNames {
        ColumnNames::default()
    }

    const HEADER: &str = "theta_deg,sigma0_db,censor,threshold_db,censored\n";

    fn read(row: &str) -> Result<Vec<(usize, Observation)>, String> {
        let read = points(format!("# head\n{HEADER}{row}\n").as_bytes(), &ours());
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
            ("60,,,,", "line 3, column sigma0_db: the cell is empty; leave the line out, or"),
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
    fn copied_rows_are_said() {
        let notices = |text: &str| points(text.as_bytes(), &ours()).unwrap().notices;
        let rows = "10,-3\n20,-4\n30,-5\n";
        let copied = notices(&format!("theta_deg,sigma0_db\n{rows}{rows}"));
        assert!(
            copied[0].starts_with("from line 5 on 3 rows may be a copy of those from line 2 on"),
            "{copied:?}"
        );
        // Two of seven levels coincide, and limits always do.
        assert!(
            notices(&format!("theta_deg,sigma0_db\n{rows}40,-6\n10,-3\n20,-4\n30,-5.1\n"))
                .is_empty()
        );
        let limits = "50,,left,-40\n60,,left,-40\n70,,left,-40\n80,,left,-40\n";
        let swept = |level| format!("10,{level},,\n20,-4,,\n{limits}");
        let two = format!("theta_deg,sigma0_db,censor,threshold_db\n{}{}", swept(-3), swept(-2));
        assert!(notices(&two).is_empty(), "{:?}", notices(&two));
    }

    #[test]
    fn a_place_has_two_coordinates_or_none() {
        let read = |row: &str| {
            points(format!("theta_deg,sigma0_db,xt_m,yt_m\n{row}\n").as_bytes(), &ours())
        };
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
            points(text.as_bytes(), &ours())
                .map(|points| points.illumination)
                .map_err(|e| e.to_string())
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
        let read = |rows: &str| {
            points(format!("curve,kind,theta_deg,sigma0_db\n{rows}").as_bytes(), &ours())
        };
        assert_eq!(read("scan,measured,10,-3\nscan,measured,20,-4\n").unwrap().rows.len(), 2);
        let said = read("scan,measured,10,-3\nother,measured,20,-4\n").unwrap_err().to_string();
        assert!(
            said.starts_with("line 3, column curve: another curve begins here; keep"),
            "{said}"
        );
    }

    #[test]
    fn angles_and_levels_have_several_names() {
        let read = |text: &str| points(text.as_bytes(), &ours()).unwrap().rows[0].1;
        let usual = read("theta_deg,sigma0_db\n30,-10\n");
        for text in [
            "grazing_deg,sigma0_db\n60,-10\n",
            "theta_signed_deg;sigma0_db\n-30;-10,0\n",
            "THETA_DEG\tSigma0\n30\t0.1\n",
        ] {
            let found = read(text);
            assert!((found.theta_i_rad - usual.theta_i_rad).abs() < 1e-15, "{text}");
            assert!((found.sigma0.unwrap() - 0.1).abs() < 1e-15, "{text}");
        }
        let said = |text: &str| points(text.as_bytes(), &ours()).unwrap_err().to_string();
        let negative = said("theta_deg,sigma0_db\n-30,-10\n");
        assert!(negative.contains("angles to both sides of the normal are `theta_signed_deg`"));
        let small = said("theta_deg,sigma0\n30,1e-310\n");
        assert!(small.contains("give a value from 1e-30 to 1e30"), "{small}");
        assert!(said("").starts_with("the file: it is empty"), "{}", said(""));
        let names: ColumnNames = "inc=theta_deg,NRCS=sigma0".parse().unwrap();
        let theirs = points(b"inc,NRCS,comment\n30,0.1,7\n", &names).unwrap();
        assert_eq!(theirs.passed_over.unwrap(), "these columns are passed over: comment");
        assert!((theirs.rows[0].1.sigma0.unwrap() - 0.1).abs() < 1e-15);
    }

    #[test]
    fn what_belongs_to_any_point_is_read_in_the_plane_of_incidence_too() {
        let columns = "theta_sd_deg,power_dbm,range_m,chirp,xt_m,yt_m,sd_db";
        let cells = "0.5,-30,2.5,7,0.1,-0.2,0.4";
        let plane = format!("theta_i_deg,theta_s_deg,brdf_per_sr,{columns}\n30,-30,0.1,{cells}\n");
        let retro = format!("theta_deg,sigma0_db,{columns}\n30,-3,{cells}\n");
        let [plane, retro] = [plane, retro].map(|text| points(text.as_bytes(), &ours()).unwrap());
        assert_eq!((&plane.sd_db, plane.passed_over), (&retro.sd_db, None));
        let of = |points: &[(usize, Observation)]| Observation { sigma0: None, ..points[0].1 };
        assert_eq!(of(&plane.rows), of(&retro.rows));
        assert_eq!(plane.rows[0].1.range_m, Some(2.5));
    }

    #[test]
    fn a_whole_turn_between_source_and_receiver_is_backscatter() {
        for turn_deg in [-360, 0, 360] {
            let text = format!("theta_deg,sigma0_db,delta_phi_deg\n30,-10,{turn_deg}\n");
            assert!(points(text.as_bytes(), &ours()).unwrap().rows[0].1.is_retro(), "{turn_deg}");
        }
    }

    #[test]
    fn a_table_in_the_plane_of_incidence_is_a_bistatic_curve() {
        let text = "theta_i_deg,theta_s_deg,brdf_per_sr\n30,-30,0.1\n30,60,0.2\n";
        let rows = points(text.as_bytes(), &ours()).unwrap().rows;
        let [(_, retro), (_, mirror)] = rows[..] else { panic!("two rows") };
        assert!(retro.is_retro() && !mirror.is_retro());
        assert!((retro.sigma0.unwrap() - 4.0 * PI * 0.1 * 0.75).abs() < 1e-14);
        assert!((mirror.delta_phi_rad - PI).abs() < 1e-15);
        let expected = 4.0 * PI * 0.2 * 0.75_f64.sqrt() * 0.5;
        assert!((mirror.sigma0.unwrap() / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn what_is_not_above_its_blank_is_a_limit() {
        let text = "theta_deg,sigma0_db,blank_db\n10,-20,-50\n60,-51,-50\n";
        let read = points(text.as_bytes(), &ours()).unwrap();
        assert_eq!(read.notices, ["1 of 2 levels are not above their blank and count as limits"]);
        let (_, last) = read.rows[1];
        assert_eq!((last.censor, last.sigma0), (Censor::Left, None));
        assert!((last.threshold_sigma0.unwrap() - 1e-5).abs() < 1e-15);
        let plane =
            "theta_i_deg,theta_s_deg,brdf_per_sr,blank_per_sr\n0,0,1,1e-6\n0,60,1e-6,1e-6\n";
        let limit = points(plane.as_bytes(), &ours()).unwrap().rows[1].1.threshold_sigma0.unwrap();
        assert!((limit / (4.0 * PI * 1e-6 * 0.5) - 1.0).abs() < 1e-12);
        // A reading below zero has no logarithm, and is below its blank all the same.
        let retro = "theta_deg,sigma0,blank_db\n0,1,-60\n60,-1e-7,-60\n";
        let plane =
            "theta_i_deg,theta_s_deg,brdf_per_sr,blank_per_sr\n0,0,1,1e-6\n0,60,-2e-7,1e-6\n";
        for text in [retro, plane] {
            let row = points(text.as_bytes(), &ours()).unwrap().rows[1].1;
            assert!(row.is_censored() && row.threshold_sigma0.unwrap() > 0.0, "{text}");
        }
        let plane = "theta_i_deg,theta_s_deg,brdf_per_sr\n0,0,1\n0,60,-2e-7\n";
        let said = points(plane.as_bytes(), &ours()).unwrap_err().to_string();
        assert!(said.starts_with("line 3, column brdf_per_sr: `-2e-7` is not accepted"), "{said}");
        assert!(said.contains("give its blank in `blank_per_sr`, or leave the line out"), "{said}");
        let all = points(b"theta_deg,sigma0_db,blank_db\n10,-20,-10\n", &ours()).unwrap_err();
        assert!(all.to_string().contains("no level is above its blank"), "{all}");
    }

    #[test]
    fn columns_that_say_too_much_or_too_little_are_named() {
        for (text, said) in [
            ("theta_deg,grazing_deg,sigma0_db\n10,80,-3\n", "both `theta_deg` and `grazing_deg`"),
            ("theta_deg,sigma0_db,sigma0\n10,-3,0.5\n", "both `sigma0_db` and `sigma0`"),
            ("theta,sigma0_db\n10,-3\n", "there is no column `theta_deg`; the columns are theta,"),
            ("theta_deg,level\n10,-3\n", "there is no column `sigma0_db`"),
            ("theta_deg,sigma0\n10,-0.5\n", "line 2, column sigma0: `-0.5` is not accepted here"),
            ("theta_deg,theta_s_deg,brdf_per_sr\n1,2,3\n", "there is no column `theta_i_deg`"),
            (
                "theta_i_deg,theta_s_deg,brdf_per_sr,censor,threshold_db\n1,2,3,none,\n",
                "a table of the plane of incidence has no `censor`; give a limit in blank_per_sr",
            ),
            (
                "theta_deg,sigma0_db,blank_per_sr\n1,2,3\n",
                "a table of backscatter has no `blank_per_sr`; give its blank in blank_db",
            ),
            (
                "theta_deg,sigma0_db,theta_i_deg\n1,2,3\n",
                "has no `theta_i_deg`; pass the column over by --columns theta_i_deg=-",
            ),
            ("theta_deg,sigma0_db,delta_phi_deg\n1,2,1e300\n", "give a value from -360 to 360"),
            ("theta_deg,sigma0_db,only_detected\n1,2,yes\n", "column only_detected: `yes`"),
        ] {
            let error = points(text.as_bytes(), &ours()).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
