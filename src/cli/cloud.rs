//! Flags that say how a measured cloud is to be read, and where the target stood.

use std::path::{Path, PathBuf};

use glam::{DMat3, DVec3};
use serde::Deserialize;

use crate::error::Error;
use crate::files::FilesError;
use crate::frames::{Global, Pose};
use crate::measure::{Cloud, CloudFormat, CloudReading, PowerUnit, Start};
use crate::radar::Radar;

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
        let path = &self.cloud;
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let Some(format) = CloudFormat::from_extension(&extension) else {
            let problem = format!("`{}` does not end in .ply, .csv or .xyz", path.display());
            return Err(Error::Usage {
                problem,
                way_out: "convert or rename the cloud".to_owned(),
            });
        };
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
        let at = |error| Error::Cloud { file: path.clone(), error };
        reading.read(format, &read(path)?).map_err(at)
    }
}

/// A pose as text: `auto`, a pose.json, or numbers.
#[derive(Deserialize)]
struct PoseFile {
    pose: PoseRecord,
}

#[derive(Deserialize)]
struct PoseRecord {
    rotation_rows: [[f64; 3]; 3],
    translation_m: [f64; 3],
}

/// Where a registration starts: `auto`, the `pose.json` of an earlier one, or X,Y,Z in m and, with
/// three more numbers, turns about the fixed axes x, then y, then z in degrees.
pub(super) fn start(text: Option<&str>) -> Result<Start, Error> {
    match text {
        None => Ok(Start::default()),
        Some("auto") => Ok(Start::Automatic),
        Some(file) if file.ends_with(".json") => Ok(Start::Given(pose_file(Path::new(file))?)),
        Some(numbers) => Ok(Start::Given(pose_numbers(numbers)?)),
    }
}

/// A pose that is taken as it is.
pub(super) fn pose(text: Option<&str>) -> Result<Pose<Global, Global>, Error> {
    match start(text)? {
        Start::Given(pose) => Ok(pose),
        Start::Automatic => Err(Error::Usage {
            problem: "--pose auto needs a registration".to_owned(),
            way_out: "run `matdb measure --pose auto` and give its pose.json here".to_owned(),
        }),
    }
}

fn pose_numbers(text: &str) -> Result<Pose<Global, Global>, Error> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse()).collect();
    let vector = |numbers: &[f64]| DVec3::new(numbers[0], numbers[1], numbers[2]);
    match numbers.as_deref() {
        Ok(all) if all.iter().any(|x| !x.is_finite() || x.abs() > 1e4) => {}
        Ok(all @ [_, _, _]) => return Ok(Pose::from_euler_xyz(DVec3::ZERO, vector(all))),
        Ok(all @ [_, _, _, _, _, _]) => {
            let turns_rad = vector(&all[3..]) * (std::f64::consts::PI / 180.0);
            return Ok(Pose::from_euler_xyz(turns_rad, vector(&all[..3])));
        }
        _ => {}
    }
    Err(Error::Usage {
        problem: format!("`{text}` is no pose"),
        way_out: "write --pose X,Y,Z or X,Y,Z,RX,RY,RZ (m, degrees), `auto`, or a pose.json"
            .to_owned(),
    })
}

fn pose_file(path: &Path) -> Result<Pose<Global, Global>, Error> {
    /// Rounding of a file may turn a matrix by so much.
    const ROUNDING: f64 = 1e-6;
    let no_pose = |problem: String| Error::Usage {
        problem: format!("{}: {problem}", path.display()),
        way_out: "give a pose.json that `matdb measure` wrote".to_owned(),
    };
    let file: PoseFile =
        serde_json::from_slice(&read(path)?).map_err(|error| no_pose(error.to_string()))?;
    let PoseRecord { rotation_rows, translation_m } = file.pose;
    let rotation = DMat3::from_cols_array_2d(&rotation_rows).transpose();
    let error = rotation * rotation.transpose() - DMat3::IDENTITY;
    let rigid = error.to_cols_array().iter().all(|x| x.abs() < ROUNDING)
        && (rotation.determinant() - 1.0).abs() < ROUNDING;
    match rigid && translation_m.iter().all(|x| x.abs() <= 1e4) {
        true => Ok(Pose::new(rotation, DVec3::from_array(translation_m))),
        false => Err(no_pose("it is no rotation with a shift within 10 km".to_owned())),
    }
}

fn read(path: &Path) -> Result<Vec<u8>, Error> {
    Ok(std::fs::read(path).map_err(|reason| FilesError::unreadable(path, reason))?)
}
