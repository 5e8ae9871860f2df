//! Cloud files, of any of the [formats of points](crate::formats::points). Frame and units are stated, never guessed.
//!
//! | columns | |
//! |---|---|
//! | `x_m y_m z_m`, `x_mm y_mm z_mm`, or `x y z` in the unit of [`CloudReading::metres_per_unit`] | place |
//! | one of `power_dbm`, `power_w`, `power_db` (relative), `power_counts` (relative), or `power` in the unit of [`CloudReading::power`] | power |
//! | `chirp` | number of the chirp, if known |
//! | `range_m`, `range_mm` or `range` | range, if known |
//!
//! Upper and lower case are the same. [`CloudReading::columns`] gives other people's columns these names; further
//! columns are passed over with a notice.

use glam::DVec3;

use super::cloud::{Cloud, CloudError, CloudPoint, POSSIBLE_DBM};
use crate::formats::words::significant;
use crate::formats::{ColumnNames, PointFormat, PointTable};
use crate::frames::{Global, Point, Pose, Target};
use crate::material::Scale;
use crate::render::{BESIDE_THE_MEASURED, COLOURS};
use crate::units::watts_from_dbm;

/// The unit of a power without a unit in its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PowerUnit {
    /// Decibels over a milliwatt.
    #[default]
    Dbm,
    /// Watts.
    Watt,
    /// Decibels over a power that is not known.
    RelativeDb,
    /// Counts: powers over one that is not known.
    Counts,
}

impl PowerUnit {
    /// Whether the levels are known up to a common factor only.
    fn scale(self) -> Scale {
        match self {
            PowerUnit::Dbm | PowerUnit::Watt => Scale::Absolute,
            PowerUnit::RelativeDb | PowerUnit::Counts => Scale::Relative,
        }
    }

    /// The unit of a column whose name says `named`: that powers are relative may be said of any.
    fn of_column(self, named: PowerUnit) -> PowerUnit {
        match (named, self.scale()) {
            (PowerUnit::Dbm, Scale::Relative) => PowerUnit::RelativeDb,
            (PowerUnit::Watt, Scale::Relative) => PowerUnit::Counts,
            _ => named,
        }
    }
}

/// How a cloud file is to be read.
///
/// ```
/// use matdb::formats::PointFormat;
/// use matdb::measure::CloudReading;
/// let reading = CloudReading { columns: "Intensity=power_dbm".parse()?, ..Default::default() };
/// let cloud = reading.read(PointFormat::Xyz, b"X Y Z Intensity\n0.1 1.2 0.0 -62.5\n")?;
/// assert!((cloud.points()[0].power_w - 5.62e-10).abs() < 0.01e-10);
/// # Ok::<(), matdb::measure::CloudError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct CloudReading {
    /// Metres per unit of x, y, z and range without a unit in their names, above 0: 1 for metres, 0.001 for
    /// millimetres.
    pub metres_per_unit: f64,
    /// Unit of powers whose column does not name it. Also says that levels in dBm, or in W, are relative.
    pub power: PowerUnit,
    /// For positions in the target frame, equations (3) and (4); `None` for the global frame.
    pub global_from_target: Option<Pose<Global, Target>>,
    /// Our names for the file's columns.
    pub columns: ColumnNames,
}

impl Default for CloudReading {
    fn default() -> Self {
        CloudReading {
            metres_per_unit: 1.0,
            power: PowerUnit::default(),
            global_from_target: None,
            columns: ColumnNames::default(),
        }
    }
}

/// Names of the columns of places.
const PLACES: [&str; 9] = ["x_m", "y_m", "z_m", "x_mm", "y_mm", "z_mm", "x", "y", "z"];
/// Names of the other columns that are read.
const VALUES: [&str; 10] = [
    "power_dbm",
    "dbm",
    "power_w",
    "power_db",
    "power_counts",
    "power",
    "chirp",
    "range_m",
    "range_mm",
    "range",
];

impl CloudReading {
    /// Reads a whole file.
    ///
    /// # Errors
    /// When the bytes break the format, the powers betray a wrong unit, or the cloud cannot be used, see
    /// [`Cloud::new`].
    pub fn read(&self, format: PointFormat, bytes: &[u8]) -> Result<Cloud, CloudError> {
        self.read_table(PointTable::read(format, bytes)?)
    }

    /// Reads a table, as that of a file.
    ///
    /// # Errors
    /// As [`CloudReading::read`].
    pub fn read_table(&self, mut table: PointTable) -> Result<Cloud, CloudError> {
        table.rename(&self.columns)?;
        let theirs: Vec<String> = table.names().into_iter().map(str::to_owned).collect();
        table.lower_case();
        table.check_names()?;
        let all = table.len();
        let empty = table.pass_over_empty(&PLACES);
        if table.is_empty() {
            return Err(CloudError::Empty);
        }
        let power = self.power_column(&table)?;
        let lacking = lacking_places(&table);
        let Some((power_column, unit)) = power.filter(|_| lacking.is_empty()) else {
            return Err(missing(&lacking, power.is_none(), &theirs));
        };
        let places = self.places(&table)?;
        let ranges_m = self.ranges_m(&table)?;
        let chirps = table.column("chirp")?;
        let powers = table.full_column(power_column)?.unwrap_or_default();
        let strongest = powers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let mut points = Vec::with_capacity(places.len());
        for (row, place) in places.into_iter().enumerate() {
            let chirp = chirps.as_ref().map(|chirps| chirps[row]).filter(|chirp| !chirp.is_nan());
            points.push(CloudPoint {
                chirp: chirp.map(|chirp| chirp_number(row, chirp)).transpose()?,
                point: self.global(place),
                range_m: ranges_m.as_ref().map(|ranges_m| ranges_m[row]).filter(|r| !r.is_nan()),
                power_w: power_w(row, powers[row], unit, strongest)?,
            });
        }
        let mut cloud = Cloud::new(points)?;
        if unit == PowerUnit::Dbm {
            check_unit(&powers)?;
        }
        cloud.scale = unit.scale();
        cloud.notices.extend(too_strong(&powers, unit));
        if empty > 0 {
            cloud
                .notices
                .push(format!("{empty} of {all} points have no place and are passed over"));
        }
        let known = [&PLACES[..], &VALUES, &BESIDE_THE_MEASURED, &COLOURS].concat();
        cloud.notices.extend(table.passed_over(&known));
        Ok(cloud)
    }

    /// Places of the points, m.
    fn places(&self, table: &PointTable) -> Result<Vec<DVec3>, CloudError> {
        let units = [("_m", 1.0), ("_mm", 1e-3), ("", self.metres_per_unit)];
        let names = table.names();
        let mut found = units.into_iter();
        let found = found.find(|(unit, _)| names.contains(&format!("x{unit}").as_str()));
        let (unit, metres) = found.unwrap_or(units[2]);
        let column = |axis| Ok(table.full_column(&format!("{axis}{unit}"))?.unwrap_or_default());
        let [xs, ys, zs]: [Result<Vec<f64>, CloudError>; 3] = ["x", "y", "z"].map(column);
        let (xs, ys, zs) = (xs?, ys?, zs?);
        let places = std::iter::zip(xs, std::iter::zip(ys, zs));
        Ok(places.map(|(x, (y, z))| DVec3::new(x, y, z) * metres).collect())
    }

    fn ranges_m(&self, table: &PointTable) -> Result<Option<Vec<f64>>, CloudError> {
        for (name, metres) in
            [("range_m", 1.0), ("range_mm", 1e-3), ("range", self.metres_per_unit)]
        {
            if let Some(ranges) = table.column(name)? {
                return Ok(Some(ranges.into_iter().map(|range| range * metres).collect()));
            }
        }
        Ok(None)
    }

    /// The column of the powers and their unit; none where there is no such column.
    fn power_column(
        &self,
        table: &PointTable,
    ) -> Result<Option<(&'static str, PowerUnit)>, CloudError> {
        let named = [
            ("power_dbm", PowerUnit::Dbm),
            ("dbm", PowerUnit::Dbm),
            ("power_w", PowerUnit::Watt),
            ("power_db", PowerUnit::RelativeDb),
            ("power_counts", PowerUnit::Counts),
            ("power", self.power),
        ];
        let names = table.names();
        let mut there = named.into_iter().filter(|(name, _)| names.contains(name));
        let first = there.next();
        match (first, there.next()) {
            (Some((first, _)), Some((second, _))) => Err(CloudError::TwoPowers { first, second }),
            _ => Ok(first.map(|(name, unit)| (name, self.power.of_column(unit)))),
        }
    }

    fn global(&self, place: DVec3) -> Point<Global> {
        match self.global_from_target {
            Some(pose) => pose * Point::from(place),
            None => place.into(),
        }
    }
}

/// The power of a point, W; the strongest of relative ones is as much as 0 dBm.
fn power_w(point: usize, value: f64, unit: PowerUnit, strongest: f64) -> Result<f64, CloudError> {
    let dbm = |power_dbm: f64| {
        let is_possible = POSSIBLE_DBM.contains(&power_dbm);
        let refused = CloudError::NoSuchPower { point, power_dbm };
        is_possible.then(|| watts_from_dbm(power_dbm)).ok_or(refused)
    };
    match unit {
        _ if !value.is_finite() => Err(CloudError::NotFinite { what: "the power", point }),
        PowerUnit::Dbm => dbm(value),
        PowerUnit::RelativeDb => dbm(value - strongest),
        PowerUnit::Watt if value <= 0.0 => Err(CloudError::NotPositive { point, power_w: value }),
        PowerUnit::Watt => Ok(value),
        PowerUnit::Counts if value <= 0.0 => Err(CloudError::NoCounts { point, counts: value }),
        PowerUnit::Counts => Ok(1e-3 * value / strongest),
    }
}

/// Refuses levels in dBm that can only be watts.
fn check_unit(levels_dbm: &[f64]) -> Result<(), CloudError> {
    /// 10 mW: every received power in watts is below, and hardly one of many levels in dBm lies between
    /// it and zero.
    const STRONGEST_W: f64 = 0.01;
    let largest = levels_dbm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if levels_dbm.iter().all(|level_dbm| *level_dbm == 0.0) {
        return Err(CloudError::NoPowers { points: levels_dbm.len() });
    }
    let are_dbm = largest > STRONGEST_W || levels_dbm.iter().any(|level_dbm| *level_dbm < 0.0);
    if are_dbm { Ok(()) } else { Err(CloudError::Watts { points: levels_dbm.len(), largest }) }
}

/// The columns of places that a table lacks. All three have the unit of the first.
fn lacking_places(table: &PointTable) -> Vec<String> {
    let names = table.names();
    let has = |name: &str| names.contains(&name);
    let unit = ["_m", "_mm", ""].into_iter().find(|unit| has(&format!("x{unit}")));
    let places = ["x", "y", "z"].map(|axis| format!("{axis}{}", unit.unwrap_or("_m")));
    places.into_iter().filter(|place| !has(place)).collect()
}

/// All that a file lacks.
fn missing(places: &[String], lacks_power: bool, theirs: &[String]) -> CloudError {
    const POWER: &str = "power_dbm (power_w for watts; power_db for decibels of an unknown level, power_counts for counts)";
    let mut example: Vec<String> = places.iter().map(|place| format!("THEIRS={place}")).collect();
    let mut words = vec![places.join(", ")];
    words.retain(|places| !places.is_empty());
    if lacks_power {
        words.push(POWER.to_owned());
        example.push("THEIRS=power_dbm".to_owned());
    }
    let columns = if example.len() > 1 { "columns" } else { "column" };
    let found: Vec<&str> =
        theirs.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
    CloudError::MissingColumns {
        missing: format!("{columns} {}", words.join(" and ")),
        found: found.join(", "),
        example: example.join(","),
    }
}

/// A sentence on powers that no radar receives: they are of an unknown level.
fn too_strong(powers: &[f64], unit: PowerUnit) -> Option<String> {
    let strongest = powers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    (unit == PowerUnit::Dbm && strongest > 0.0).then(|| {
        format!(
            "the strongest point has {} dBm, more than a radar receives; where these are decibels of an unknown level, name the \
             column power_db or say --power relative",
            significant(strongest, 3)
        )
    })
}

fn chirp_number(point: usize, value: f64) -> Result<u32, CloudError> {
    let whole = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
    if whole { Ok(value as u32) } else { Err(CloudError::BadChirp { point, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn metres() -> CloudReading {
        CloudReading::default()
    }

    fn ply(columns: &str, rows: &str) -> Vec<u8> {
        let count = rows.lines().count();
        let properties: String =
            columns.split(' ').map(|name| format!("property double {name}\n")).collect();
        let head = format!("ply\nformat ascii 1.0\nelement vertex {count}\n{properties}");
        format!("{head}end_header\n{rows}\n").into_bytes()
    }

    #[test]
    fn our_own_cloud_is_read_without_its_truth() {
        let bytes = ply("x y z range_m power_dbm chirp facet", "0.1 1.2 0.3 8.5 -60 7 -1");
        let cloud = metres().read(PointFormat::Ply, &bytes).unwrap();
        let expected = CloudPoint {
            chirp: Some(7),
            point: Point::new(0.1, 1.2, 0.3),
            range_m: Some(8.5),
            power_w: watts_from_dbm(-60.0),
        };
        assert_eq!(cloud.points(), [expected]);
        assert!(cloud.notices.is_empty());
    }

    #[test]
    fn csv_and_text_need_no_chirp_and_say_so() {
        let csv = b"x_m,y_m,z_m,power_dbm\n0.1,1.2,0.3,-60\n";
        let xyz = b"# x y z dBm\n100 1200 300 -60\n\n";
        let cloud = metres().read(PointFormat::Csv, csv).unwrap();
        let millimetres = CloudReading { metres_per_unit: 1e-3, ..metres() };
        let text = millimetres.read(PointFormat::Xyz, xyz).unwrap();
        assert!(text.points()[0].point.distance_m(cloud.points()[0].point) < 1e-15);
        assert!(cloud.notices[0].contains("1 of 1 points have no chirp number"));
    }

    #[test]
    fn watts_are_converted_only_when_stated() {
        let bytes = ply("x y z power", "0 0 0 1e-9\n1 0 0 1e-6");
        let watts = CloudReading { power: PowerUnit::Watt, ..metres() };
        let cloud = watts.read(PointFormat::Ply, &bytes).unwrap();
        assert_eq!(cloud.points()[1].power_w, 1e-6);
        let error = metres().read(PointFormat::Ply, &bytes).unwrap_err();
        assert!(matches!(error, CloudError::Watts { points: 2, .. }), "{error}");
        assert!(error.to_string().contains("these are watts, not dBm"), "{error}");
        assert_eq!(error, CloudError::Watts { points: 2, largest: 1e-6 });
        let with_zero = metres().read(PointFormat::Xyz, b"0 0 0 0\n1 0 0 1e-6").unwrap_err();
        assert!(matches!(with_zero, CloudError::Watts { .. }), "{with_zero}");
        assert!(metres().read(PointFormat::Xyz, b"0 0 0 -60\n1 0 0 1e-6").is_ok());
        let none = metres().read(PointFormat::Xyz, b"0 0 0 0\n1 0 0 0").unwrap_err();
        assert_eq!(none, CloudError::NoPowers { points: 2 });
        let negative = watts.read(PointFormat::Xyz, b"0 0 0 -60").unwrap_err();
        assert_eq!(negative, CloudError::NotPositive { point: 0, power_w: -60.0 });
    }

    #[test]
    fn the_target_frame_is_mapped() {
        let frames = crate::radar::Radar::default().frames();
        let reading =
            CloudReading { global_from_target: Some(frames.global_from_target), ..metres() };
        let cloud = reading.read(PointFormat::Xyz, b"0 0 8 -60").unwrap();
        assert!(cloud.points()[0].point.distance_m(frames.origin()) < 1e-12);
    }

    #[test]
    fn hostile_files_are_refused_with_their_place() {
        let refused = |format, bytes: &[u8]| metres().read(format, bytes).unwrap_err().to_string();
        assert!(
            refused(PointFormat::Xyz, b"0 0 0\n").contains("column power_dbm (power_w for watts")
        );
        assert!(refused(PointFormat::Xyz, b"#\n0 0 0 nan\n").starts_with("line 2"));
        assert!(refused(PointFormat::Xyz, b"0 0 \xff").contains("line 1: the text is not UTF-8"));
        assert!(refused(PointFormat::Xyz, b"").contains("no points"));
        let csv = b"x_m,y_m,z_m,power_dbm\n0,0,0,\n";
        assert!(refused(PointFormat::Csv, csv).contains("line 2, column power_dbm"));
        let ply_nan = ply("x y z power_dbm", "0 0 0 nan");
        assert!(refused(PointFormat::Ply, &ply_nan).contains("the power of point 0"));
        let two = b"x_m,y_m,z_m,power_dbm,power_w\n0,0,0,-60,1e-9\n";
        assert!(refused(PointFormat::Csv, two).contains("both power_dbm and power_w"));
        let no_power = ply("x y z", "0 0 0");
        assert!(refused(PointFormat::Ply, &no_power).contains("no column power_dbm"));
        let chirp = ply("x y z power_dbm chirp", "0 0 0 -60 1.5");
        assert!(refused(PointFormat::Ply, &chirp).contains("chirp number 1.5"));
        let twice = ply("x y z power_dbm chirp", "0 0 0 -60 1\n0 0 0 -61 1");
        assert!(refused(PointFormat::Ply, &twice).contains("both of chirp 1"));
    }

    #[test]
    fn other_peoples_columns_get_names_and_units() {
        let columns = "X=x_mm,Y=y_mm,Z=z_mm,Intensity=power_dbm".parse().unwrap();
        let reading = CloudReading { columns, ..metres() };
        let text = b"X;Y;Z;Intensity;Time\n100;1200;300,5;-60,5;12:30\n";
        let cloud = reading.read(PointFormat::Csv, text).unwrap();
        assert!(cloud.points()[0].point.distance_m(Point::new(0.1, 1.2, 0.3005)) < 1e-12);
        assert!((cloud.points()[0].power_w / watts_from_dbm(-60.5) - 1.0).abs() < 1e-12);
        assert!(cloud.notices.contains(&"these columns are passed over: time".to_owned()));
        let none = metres().read(PointFormat::Csv, text).unwrap_err().to_string();
        assert!(none.contains("no column power_dbm (power_w"), "{none}");
        assert!(none.contains("it has: X, Y, Z, Intensity, Time; say which they are"), "{none}");
    }

    #[test]
    fn all_that_a_file_lacks_is_said_at_once() {
        let read = |text: &[u8]| metres().read(PointFormat::Csv, text);
        let error = read(b"east,north,up,refl\n1,2,3,-60\n").unwrap_err().to_string();
        assert!(
            error.starts_with("the file has no columns x_m, y_m, z_m and power_dbm ("),
            "{error}"
        );
        let example = "--columns THEIRS=x_m,THEIRS=y_m,THEIRS=z_m,THEIRS=power_dbm";
        assert!(
            error.contains("it has: east, north, up, refl;") && error.ends_with(example),
            "{error}"
        );
        let error = read(b"x_mm,y_m,z_mm,power_dbm\n1,2,3,-60\n").unwrap_err().to_string();
        assert!(error.starts_with("the file has no column y_mm; it has: x_mm, y_m,"), "{error}");
    }

    #[test]
    fn more_than_a_radar_receives_is_perhaps_of_another_unit() {
        let read = |text: &[u8]| metres().read(PointFormat::Csv, text).unwrap().notices.join("\n");
        let said = read(b"x,y,z,power_dbm\n0,0,1,49.5\n1,0,1,-3\n");
        assert!(
            said.contains("the strongest point has 49.5 dBm, more than a radar receives"),
            "{said}"
        );
        assert!(!read(b"x,y,z,power_dbm\n0,0,1,-49.5\n").contains("more than"));
        assert!(!read(b"x,y,z,power_db\n0,0,1,49.5\n").contains("more than"));
    }

    #[test]
    fn relative_powers_say_so() {
        let text = b"0 0 0 3\n1 0 0 30\n";
        let read = |power| CloudReading { power, ..metres() }.read(PointFormat::Xyz, text);
        assert_eq!(read(PowerUnit::Dbm).unwrap().scale, Scale::Absolute);
        let decibels = read(PowerUnit::RelativeDb).unwrap();
        let counts = read(PowerUnit::Counts).unwrap();
        assert_eq!([decibels.scale, counts.scale], [Scale::Relative; 2]);
        assert!((counts.points()[1].power_w / counts.points()[0].power_w - 10.0).abs() < 1e-12);
        let named = ply("x y z power_dbm", "0 0 0 -60");
        let told = CloudReading { power: PowerUnit::RelativeDb, ..metres() };
        assert_eq!(told.read(PointFormat::Ply, &named).unwrap().scale, Scale::Relative);
        let watts = ply("x y z power_w", "0 0 0 1e-9\n0 0 1 2e-9");
        assert_eq!(told.read(PointFormat::Ply, &watts).unwrap().scale, Scale::Relative);
        // Squares of 16 bits, and decibels over one count.
        for (power, text) in [
            (PowerUnit::Counts, "0 0 0 4294836225\n1 0 0 4294836.225\n"),
            (PowerUnit::RelativeDb, "0 0 0 96\n1 0 0 66\n"),
        ] {
            let reading = CloudReading { power, ..metres() };
            let cloud = reading.read(PointFormat::Xyz, text.as_bytes()).unwrap();
            let [first, second] = [0, 1].map(|row| cloud.points()[row].power_w);
            assert!((first / second - 1000.0).abs() < 1e-6, "{text}");
        }
        let none = CloudReading { power: PowerUnit::Counts, ..metres() };
        let none = none.read(PointFormat::Xyz, b"0 0 0 0\n").unwrap_err().to_string();
        assert!(none.contains("point 0 has 0 counts"), "{none}");
    }
}
