//! Flags that say how a measured cloud is to be read, and where the target stood.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::formats::ColumnNames;
use crate::frames::{Global, Point, Pose};
use crate::measure::{Cloud, CloudReading, PowerUnit, Start};
use crate::radar::Radar;
use crate::report::shell_word;
use crate::setup::{absolute, pose_of_numbers, read_cloud, read_pose};

/// A cloud file and what it does not say of itself.
#[derive(Debug, clap::Args)]
pub(super) struct CloudArgs {
    /// Measured cloud: .ply, .csv, .xyz, .pcd, .las or .laz
    pub cloud: PathBuf,
    /// Unit of x, y and z where the columns do not name it
    #[arg(long, value_name = "UNIT", default_value = "m")]
    unit: LengthUnit,
    /// Unit of the power where the column does not name it; `relative` (dB) and `counts` are of an unknown level
    #[arg(long, value_name = "UNIT", default_value = "dbm")]
    power: PowerFlag,
    /// Frame of the positions
    #[arg(long, value_name = "FRAME", default_value = "global")]
    frame: Frame,
}

/// What the columns of a file are.
#[derive(Debug, clap::Args)]
pub(super) struct ColumnArgs {
    /// Our names for the columns of the file, as in X=x_m,Intensity=power_dbm; - passes one over
    #[arg(long, value_name = "THEIRS=OURS")]
    columns: Option<ColumnNames>,
}

impl ColumnArgs {
    /// Our names for the columns.
    pub fn names(&self) -> ColumnNames {
        self.columns.clone().unwrap_or_default()
    }
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum LengthUnit {
    M,
    Mm,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum PowerFlag {
    Dbm,
    W,
    Relative,
    Counts,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Frame {
    Global,
    Target,
}

impl CloudArgs {
    /// The flags as they were given, for another command on the same file; with a blank before each.
    pub fn again(&self, columns: &ColumnArgs) -> String {
        let unit = match self.unit {
            LengthUnit::M => "",
            LengthUnit::Mm => " --unit mm",
        };
        let power = match self.power {
            PowerFlag::Dbm => "",
            PowerFlag::W => " --power w",
            PowerFlag::Relative => " --power relative",
            PowerFlag::Counts => " --power counts",
        };
        let frame = match self.frame {
            Frame::Global => "",
            Frame::Target => " --frame target",
        };
        let columns = columns
            .columns
            .as_ref()
            .map(|names| format!(" --columns {}", shell_word(names.to_string().as_ref())));
        format!("{}{unit}{power}{frame}", columns.unwrap_or_default())
    }

    /// Reads the cloud; `radar` says where its target frame lies.
    pub fn read(&self, columns: &ColumnArgs, radar: &Radar) -> Result<Cloud, Error> {
        self.read_another(&self.cloud, columns, radar)
    }

    /// Reads a cloud by the same flags, whose powers must be known.
    pub fn read_absolute(
        &self,
        path: &Path,
        columns: &ColumnArgs,
        radar: &Radar,
    ) -> Result<Cloud, Error> {
        absolute(self.read_another(path, columns, radar)?, path)
    }

    /// Reads another cloud by the same flags.
    pub fn read_another(
        &self,
        path: &Path,
        columns: &ColumnArgs,
        radar: &Radar,
    ) -> Result<Cloud, Error> {
        let reading = CloudReading {
            metres_per_unit: match self.unit {
                LengthUnit::M => 1.0,
                LengthUnit::Mm => 1e-3,
            },
            power: match self.power {
                PowerFlag::Dbm => PowerUnit::Dbm,
                PowerFlag::W => PowerUnit::Watt,
                PowerFlag::Relative => PowerUnit::RelativeDb,
                PowerFlag::Counts => PowerUnit::Counts,
            },
            columns: columns.names(),
            global_from_target: match self.frame {
                Frame::Global => None,
                Frame::Target => Some(radar.frames().global_from_target),
            },
        };
        read_cloud(path, &reading)
    }
}

/// Where a registration starts: `auto`, the `pose.json` of an earlier one, or X,Y,Z in m and, with
/// three more numbers, turns about the fixed axes x, then y, then z in degrees.
pub(super) fn start(text: Option<&str>) -> Result<Start, Error> {
    match text {
        None => Ok(Start::default()),
        Some("auto") => Ok(Start::Automatic),
        Some(file) if file.ends_with(".json") => Ok(Start::Given(read_pose(Path::new(file))?)),
        Some(numbers) => Ok(Start::Given(pose_numbers(numbers)?)),
    }
}

/// A pose that is taken as it is.
pub(super) fn pose(text: Option<&str>) -> Result<Pose<Global, Global>, Error> {
    match start(text)? {
        Start::Given(pose) => Ok(pose),
        Start::Automatic => Err(Error::usage(
            "--pose auto needs a registration",
            "run `matdb measure --pose auto` and give its pose.json here",
        )),
    }
}

/// A place, X,Y,Z in m.
pub(super) fn place(text: &str) -> Result<Point<Global>, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    match numbers.unwrap_or_default()[..] {
        [x, y, z] if [x, y, z].iter().all(|m| m.is_finite() && m.abs() <= 1e4) => {
            Ok(Point::new(x, y, z))
        }
        _ => Err("give X,Y,Z in metres, as in 0,1.2,3".to_owned()),
    }
}

fn pose_numbers(text: &str) -> Result<Pose<Global, Global>, Error> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    pose_of_numbers(&numbers.unwrap_or_default()).ok_or_else(|| {
        Error::usage(
            format!("`{text}` is not a pose"),
            "write --pose X,Y,Z or X,Y,Z,RX,RY,RZ (m, degrees), `auto`, or a pose.json",
        )
    })
}
