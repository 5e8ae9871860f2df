//! A measured cloud and the pose of its target, from files.

use std::path::Path;

use glam::{DMat3, DVec3};
use serde::Deserialize;

use crate::error::Error;
use crate::files::read_whole;
use crate::formats::PointFormat;
use crate::frames::{Global, Pose};
use crate::material::Scale;
use crate::measure::{Cloud, CloudError, CloudReading};

/// Reads a measured cloud; the ending of its name says the [format](PointFormat).
///
/// # Errors
/// Another ending; a file that cannot be read or is refused.
pub fn read_cloud(path: &Path, reading: &CloudReading) -> Result<Cloud, Error> {
    let extension = path.extension().unwrap_or_default().to_string_lossy();
    let Some(format) = PointFormat::from_extension(&extension) else {
        let problem = format!("`{}` has the ending of no format of clouds", path.display());
        let way_out = format!("convert or rename it: .{}", PointFormat::EXTENSIONS.join(", ."));
        return Err(Error::usage(problem, way_out));
    };
    let cloud = reading.read(format, &read_whole(path)?);
    cloud.map_err(|error| Error::Cloud { file: path.to_owned(), error })
}

/// A cloud whose powers are known.
///
/// # Errors
/// Powers of an unknown level.
pub fn absolute(cloud: Cloud, path: &Path) -> Result<Cloud, Error> {
    match cloud.scale {
        Scale::Absolute => Ok(cloud),
        Scale::Relative => Err(Error::Cloud { file: path.to_owned(), error: CloudError::Relative }),
    }
}

/// The pose of a shift x, y, z in m and, with three more numbers, turns about the fixed axes x, then y, then z in degrees;
/// `None` for any others, and beyond 10 km.
pub fn pose_of_numbers(numbers: &[f64]) -> Option<Pose<Global, Global>> {
    let (turn_deg, shift_m) = match *numbers {
        [x, y, z] => (DVec3::ZERO, DVec3::new(x, y, z)),
        [x, y, z, rx, ry, rz] => (DVec3::new(rx, ry, rz), DVec3::new(x, y, z)),
        _ => return None,
    };
    let are_usable = numbers.iter().all(|number| number.is_finite() && number.abs() <= 1e4);
    let turn_rad = turn_deg * (std::f64::consts::PI / 180.0);
    are_usable.then(|| Pose::from_euler_xyz(turn_rad, shift_m))
}

/// Reads the pose of a `pose.json`, as `matdb measure` writes it.
///
/// # Errors
/// A file that cannot be read, or has no pose.
pub fn read_pose(path: &Path) -> Result<Pose<Global, Global>, Error> {
    let file: PoseFile = serde_json::from_slice(&read_whole(path)?)
        .map_err(|error| no_pose(path, &error.to_string()))?;
    file.pose
        .pose()
        .ok_or_else(|| no_pose(path, "its pose is not a rotation with a shift within 10 km"))
}

/// Of a `pose.json`, the part that is read.
#[derive(Deserialize)]
struct PoseFile {
    pose: PoseRecord,
}

#[derive(Deserialize)]
struct PoseRecord {
    rotation_rows: [[f64; 3]; 3],
    translation_m: [f64; 3],
}

impl PoseRecord {
    /// The pose; `None` where it is not a rotation with a shift within 10 km.
    fn pose(&self) -> Option<Pose<Global, Global>> {
        /// Rounding of a file may turn a matrix by so much.
        const ROUNDING: f64 = 1e-6;
        let rotation = DMat3::from_cols_array_2d(&self.rotation_rows).transpose();
        let error = rotation * rotation.transpose() - DMat3::IDENTITY;
        let is_rigid = error.to_cols_array().iter().all(|x| x.abs() < ROUNDING)
            && (rotation.determinant() - 1.0).abs() < ROUNDING;
        let is_near = self.translation_m.iter().all(|x| x.abs() <= 1e4);
        let translation_m = DVec3::from_array(self.translation_m);
        (is_rigid && is_near).then(|| Pose::new(rotation, translation_m))
    }
}

fn no_pose(path: &Path, problem: &str) -> Error {
    Error::usage(
        format!("{}: {problem}", path.display()),
        "give a pose.json that `matdb measure` wrote",
    )
}
