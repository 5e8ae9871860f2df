//! Flags that say how a measured cloud is to be read, and where the target stood.

use std::path::{Path, PathBuf};

use glam::DVec3;

use crate::error::Error;
use crate::frames::{Global, Pose};
use crate::measure::{Cloud, CloudReading, PowerUnit, Start};
use crate::radar::Radar;
use crate::setup::{read_cloud, read_pose};

/// A cloud file and what it does not say of itself.
#[derive(Debug, clap::Args)]
pub(super) struct CloudArgs {
    /// Measured cloud: .ply, .csv (x_m,y_m,z_m,power_dbm, chirp and range_m if known) or .xyz
    pub cloud: PathBuf,
    /// Unit of x, y and z where the columns do not name it
    #[arg(long, value_name = "UNIT", default_value = "m")]
    unit: LengthUnit,
    /// Unit of the power where the column does not name it
    #[arg(long, value_name = "UNIT", default_value = "dbm")]
    power: PowerFlag,
    /// Frame of the positions
    #[arg(long, value_name = "FRAME", default_value = "global")]
    frame: Frame,
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
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Frame {
    Global,
    Target,
}

impl CloudArgs {
    /// Reads the cloud; `radar` says where its target frame lies.
    pub fn read(&self, radar: &Radar) -> Result<Cloud, Error> {
        self.read_another(&self.cloud, radar)
    }

    /// Reads another cloud by the same flags.
    pub fn read_another(&self, path: &Path, radar: &Radar) -> Result<Cloud, Error> {
        let reading = CloudReading {
            metres_per_unit: match self.unit {
                LengthUnit::M => 1.0,
                LengthUnit::Mm => 1e-3,
            },
            power: match self.power {
                PowerFlag::Dbm => PowerUnit::Dbm,
                PowerFlag::W => PowerUnit::Watt,
            },
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

fn pose_numbers(text: &str) -> Result<Pose<Global, Global>, Error> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let numbers = numbers.unwrap_or_default();
    if numbers.iter().all(|x: &f64| x.is_finite() && x.abs() <= 1e4) {
        let turn_and_shift = match numbers[..] {
            [x, y, z] => Some((DVec3::ZERO, DVec3::new(x, y, z))),
            [x, y, z, rx, ry, rz] => Some((DVec3::new(rx, ry, rz), DVec3::new(x, y, z))),
            _ => None,
        };
        if let Some((turn_deg, shift_m)) = turn_and_shift {
            let turn_rad = turn_deg * (std::f64::consts::PI / 180.0);
            return Ok(Pose::from_euler_xyz(turn_rad, shift_m));
        }
    }
    Err(Error::usage(
        format!("`{text}` is not a pose"),
        "write --pose X,Y,Z or X,Y,Z,RX,RY,RZ (m, degrees), `auto`, or a pose.json",
    ))
}
