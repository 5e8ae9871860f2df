//! Cloud files: PLY, CSV and plain text. Frame and units are stated, never guessed.
//!
//! | format | columns |
//! |---|---|
//! | PLY | `x y z`, one of `power_dbm`, `power_w`, `power`; `chirp` and `range_m` if there; others are passed over |
//! | CSV | `x_m,y_m,z_m`, one of `power_dbm`, `power_w`; `chirp` and `range_m` if there |
//! | XYZ | x, y, z and power, separated by blanks; lines with `#` are passed over |
//!
//! A column's name states its unit. What has no name, `power` of a PLY file and the fourth column of
//! plain text, is in [`CloudReading::power`].

use glam::DVec3;

use super::cloud::{Cloud, CloudError, CloudPoint, POSSIBLE_DBM};
use crate::formats::FormatError;
use crate::formats::csv;
use crate::formats::ply::{self, read_table};
use crate::frames::{Global, Point, Pose, Target};
use crate::units::watts_from_dbm;

/// The formats of cloud files.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CloudFormat {
    /// Stanford polygons.
    Ply,
    /// Comma-separated values under a header.
    Csv,
    /// Four numbers on a line.
    Xyz,
}

/// The unit of a power without a unit in its name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PowerUnit {
    /// Decibels over a milliwatt.
    #[default]
    Dbm,
    /// Watts.
    Watt,
}

/// How a cloud file is to be read.
///
/// ```
/// use matdb::measure::{CloudFormat, CloudReading};
/// let cloud = CloudReading::default().read(CloudFormat::Xyz, b"0.1 1.2 0.0 -62.5\n")?;
/// assert!((cloud.points()[0].power_w - 5.62e-10).abs() < 0.01e-10);
/// # Ok::<(), matdb::measure::CloudError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CloudReading {
    /// Metres per unit of x, y and z in PLY and plain text, above 0: 1 for metres, 0.001 for
    /// millimetres. Columns with `_m` in their name are in metres always.
    pub metres_per_unit: f64,
    /// Unit of powers whose column does not name it.
    pub power: PowerUnit,
    /// For positions in the target frame, equations (3) and (4); `None` for the global frame.
    pub global_from_target: Option<Pose<Global, Target>>,
}

impl Default for CloudReading {
    fn default() -> Self {
        let power = PowerUnit::default();
        CloudReading { metres_per_unit: 1.0, power, global_from_target: None }
    }
}

impl CloudFormat {
    /// The format that a file's extension stands for, in upper or lower case and without the dot.
    pub fn from_extension(extension: &str) -> Option<CloudFormat> {
        match extension.to_ascii_lowercase().as_str() {
            "ply" => Some(CloudFormat::Ply),
            "csv" => Some(CloudFormat::Csv),
            "xyz" | "txt" => Some(CloudFormat::Xyz),
            _ => None,
        }
    }
}

/// Points of a file, and the levels of those whose power it states in dBm.
#[derive(Default)]
struct Detections {
    points: Vec<CloudPoint>,
    levels_dbm: Vec<f64>,
}

impl CloudReading {
    /// Reads a whole file.
    ///
    /// # Errors
    /// When the bytes break the format, the powers betray a wrong unit, or the cloud cannot be used, see
    /// [`Cloud::new`].
    pub fn read(&self, format: CloudFormat, bytes: &[u8]) -> Result<Cloud, CloudError> {
        let detections = match format {
            CloudFormat::Ply => self.read_ply(bytes),
            CloudFormat::Csv => self.read_csv(bytes),
            CloudFormat::Xyz => self.read_xyz(bytes),
        }?;
        detections.cloud()
    }

    fn read_ply(&self, bytes: &[u8]) -> Result<Detections, CloudError> {
        let table = read_table(bytes)?;
        let [xs, ys, zs] = ["x", "y", "z"].map(|name| column(&table, name));
        let (xs, ys, zs) = (xs?, ys?, zs?);
        let (powers, unit) = self.power_column(&table)?;
        let chirps = table.column("chirp");
        let ranges_m = table.column("range_m");
        let mut detections = Detections::default();
        for row in 0..table.rows() {
            let place = DVec3::new(cell(xs, row), cell(ys, row), cell(zs, row));
            let chirp = chirps.map(|chirps| chirp_number(row, cell(chirps, row))).transpose()?;
            let power_w = detections.power_w(cell(powers, row), unit)?;
            detections.points.push(CloudPoint {
                chirp,
                point: self.global(place * self.metres_per_unit),
                range_m: ranges_m.map(|ranges_m| cell(ranges_m, row)),
                power_w,
            });
        }
        Ok(detections)
    }

    fn power_column<'t>(
        &self,
        table: &'t ply::Table,
    ) -> Result<(&'t [f64], PowerUnit), CloudError> {
        let named =
            [("power_dbm", PowerUnit::Dbm), ("power_w", PowerUnit::Watt), ("power", self.power)];
        named
            .into_iter()
            .find_map(|(name, unit)| Some((table.column(name)?, unit)))
            .ok_or_else(|| missing(table, "power_dbm, power_w or power"))
    }

    fn read_csv(&self, bytes: &[u8]) -> Result<Detections, CloudError> {
        let optional = ["chirp", "range_m", "power_dbm", "power_w"];
        let table = csv::Table::read(bytes, &["x_m", "y_m", "z_m"], &optional)?;
        let mut detections = Detections::default();
        for row in 0..table.len() {
            let [x, y, z] = ["x_m", "y_m", "z_m"].map(|name| table.required_number(row, name));
            let is_numbered = table.cell(row, "chirp").is_some();
            let chirp = is_numbered.then(|| table.whole_number(row, "chirp")).transpose()?;
            let power_w = match table.number(row, "power_w")? {
                Some(power_w) => detections.power_w(power_w, PowerUnit::Watt)?,
                None => {
                    let level_dbm = table.required_number(row, "power_dbm")?;
                    detections.power_w(level_dbm, PowerUnit::Dbm)?
                }
            };
            let point = self.global(DVec3::new(x?, y?, z?));
            let range_m = table.number(row, "range_m")?;
            detections.points.push(CloudPoint { chirp, point, range_m, power_w });
        }
        Ok(detections)
    }

    fn read_xyz(&self, bytes: &[u8]) -> Result<Detections, CloudError> {
        let text = std::str::from_utf8(bytes).map_err(|error| {
            let place = format!("byte {}", error.valid_up_to());
            FormatError::at(place, "the text is not UTF-8", "save the file as UTF-8")
        })?;
        let mut detections = Detections::default();
        for (line, text) in text.lines().map(str::trim_start).enumerate() {
            if text.is_empty() || text.starts_with('#') {
                continue;
            }
            let [x, y, z, power] = four_numbers(text).ok_or_else(|| {
                let place = format!("line {}", line + 1);
                FormatError::at(place, "these are not four finite numbers", "give x y z power")
            })?;
            let point = self.global(DVec3::new(x, y, z) * self.metres_per_unit);
            let power_w = detections.power_w(power, self.power)?;
            detections.points.push(CloudPoint { chirp: None, point, range_m: None, power_w });
        }
        Ok(detections)
    }

    fn global(&self, place: DVec3) -> Point<Global> {
        match self.global_from_target {
            Some(pose) => pose * Point::from(place),
            None => place.into(),
        }
    }
}

impl Detections {
    /// The power of the next point, W.
    fn power_w(&mut self, value: f64, unit: PowerUnit) -> Result<f64, CloudError> {
        let point = self.points.len();
        match unit {
            PowerUnit::Dbm if !value.is_finite() => {
                Err(CloudError::NotFinite { what: "the power", point })
            }
            PowerUnit::Dbm if !POSSIBLE_DBM.contains(&value) => {
                Err(CloudError::NoSuchPower { point, power_dbm: value })
            }
            PowerUnit::Dbm => {
                self.levels_dbm.push(value);
                Ok(watts_from_dbm(value))
            }
            PowerUnit::Watt if value <= 0.0 => {
                Err(CloudError::NotPositive { point, power_w: value })
            }
            PowerUnit::Watt => Ok(value),
        }
    }

    /// The cloud, unless its levels in dBm can only be watts.
    fn cloud(self) -> Result<Cloud, CloudError> {
        /// 10 mW: every received power in watts is below, and hardly one of many levels in dBm lies between
        /// it and zero.
        const STRONGEST_W: f64 = 0.01;
        let cloud = Cloud::new(self.points)?;
        let points = cloud.points().len();
        let largest = self.levels_dbm.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let are_dbm = self.levels_dbm.len() < points
            || largest > STRONGEST_W
            || self.levels_dbm.iter().any(|level_dbm| *level_dbm < 0.0);
        if are_dbm { Ok(cloud) } else { Err(CloudError::Watts { points, largest }) }
    }
}

/// A cell of a column; NaN behind its end.
fn cell(column: &[f64], row: usize) -> f64 {
    column.get(row).copied().unwrap_or(f64::NAN)
}

fn four_numbers(line: &str) -> Option<[f64; 4]> {
    let numbers: Vec<f64> =
        line.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let four: [f64; 4] = numbers.try_into().ok()?;
    four.iter().all(|number| number.is_finite()).then_some(four)
}

fn column<'t>(table: &'t ply::Table, name: &'static str) -> Result<&'t [f64], CloudError> {
    table.column(name).ok_or_else(|| missing(table, name))
}

fn missing(table: &ply::Table, column: &'static str) -> CloudError {
    let found: Vec<&str> = table.columns.iter().map(|column| column.name.as_str()).collect();
    CloudError::MissingColumn { column, found: found.join(", ") }
}

fn chirp_number(point: usize, value: f64) -> Result<u32, CloudError> {
    let whole = value.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&value);
    if whole { Ok(value as u32) } else { Err(CloudError::BadChirp { point, value }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    const METRES: CloudReading =
        CloudReading { metres_per_unit: 1.0, power: PowerUnit::Dbm, global_from_target: None };

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
        let cloud = METRES.read(CloudFormat::Ply, &bytes).unwrap();
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
        let cloud = METRES.read(CloudFormat::Csv, csv).unwrap();
        let millimetres = CloudReading { metres_per_unit: 1e-3, ..METRES };
        let text = millimetres.read(CloudFormat::Xyz, xyz).unwrap();
        assert!(text.points()[0].point.distance_m(cloud.points()[0].point) < 1e-15);
        assert!(cloud.notices[0].contains("1 of 1 points have no chirp number"));
    }

    #[test]
    fn watts_are_converted_only_when_stated() {
        let bytes = ply("x y z power", "0 0 0 1e-9\n1 0 0 1e-6");
        let watts = CloudReading { power: PowerUnit::Watt, ..METRES };
        let cloud = watts.read(CloudFormat::Ply, &bytes).unwrap();
        assert_eq!(cloud.points()[1].power_w, 1e-6);
        let error = METRES.read(CloudFormat::Ply, &bytes).unwrap_err();
        assert!(matches!(error, CloudError::Watts { points: 2, .. }), "{error}");
        assert!(error.to_string().contains("these are watts, not dBm"), "{error}");
        assert_eq!(error, CloudError::Watts { points: 2, largest: 1e-6 });
        let with_zero = METRES.read(CloudFormat::Xyz, b"0 0 0 0\n1 0 0 1e-6").unwrap_err();
        assert!(matches!(with_zero, CloudError::Watts { .. }), "{with_zero}");
        assert!(METRES.read(CloudFormat::Xyz, b"0 0 0 -60\n1 0 0 1e-6").is_ok());
        let negative = watts.read(CloudFormat::Xyz, b"0 0 0 -60").unwrap_err();
        assert_eq!(negative, CloudError::NotPositive { point: 0, power_w: -60.0 });
    }

    #[test]
    fn the_target_frame_is_mapped() {
        let frames = crate::radar::Radar::default().frames();
        let reading =
            CloudReading { global_from_target: Some(frames.global_from_target), ..METRES };
        let cloud = reading.read(CloudFormat::Xyz, b"0 0 8 -60").unwrap();
        assert!(cloud.points()[0].point.distance_m(frames.origin()) < 1e-12);
    }

    #[test]
    fn hostile_files_are_refused_with_their_place() {
        let refused = |format, bytes: &[u8]| METRES.read(format, bytes).unwrap_err().to_string();
        assert!(refused(CloudFormat::Xyz, b"0 0 0\n").starts_with("line 1: these are not four"));
        assert!(refused(CloudFormat::Xyz, b"#\n0 0 0 nan\n").starts_with("line 2"));
        assert!(refused(CloudFormat::Xyz, b"0 0 \xff").contains("byte 4"));
        assert!(refused(CloudFormat::Xyz, b"").contains("no points"));
        let csv = b"x_m,y_m,z_m,power_dbm\n0,0,0,\n";
        assert!(refused(CloudFormat::Csv, csv).contains("line 2, column power_dbm"));
        let ply_nan = ply("x y z power_dbm", "0 0 0 nan");
        assert!(refused(CloudFormat::Ply, &ply_nan).contains("the power of point 0"));
        let no_power = ply("x y z", "0 0 0");
        assert!(refused(CloudFormat::Ply, &no_power).contains("no column power_dbm"));
        let chirp = ply("x y z power_dbm chirp", "0 0 0 -60 1.5");
        assert!(refused(CloudFormat::Ply, &chirp).contains("chirp number 1.5"));
        let twice = ply("x y z power_dbm chirp", "0 0 0 -60 1\n0 0 0 -61 1");
        assert!(refused(CloudFormat::Ply, &twice).contains("both of chirp 1"));
    }
}
