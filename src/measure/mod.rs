//! From a measured cloud to a curve of a material: pose, angles of incidence, σ⁰.
//!
//! [`Cloud`] holds the measured points and powers. [`Registration`] finds the pose of the mesh, [`Incidence`]
//! gives the point and the angle at which each ray hits it, and [`Reduction`] converts powers to σ⁰. [`Calibration`]
//! finds the radar's loss from the cloud of a target whose return is known.

pub mod calibrate;
pub mod cloud;
pub mod cloud_file;
mod coarse;
pub mod compare;
pub mod curve;
mod error;
pub mod freedom;
pub mod icp;
pub mod incidence;
mod locate;
pub mod nearest;
pub mod normals;
pub mod tracer;
mod exclusions;
pub mod reduce;
pub mod register;
mod settings;
mod point_rays;
mod ray_gap;
mod spots;
mod start;
pub mod statistics;
#[cfg(test)]
mod synthetic;
mod uncertainty;
mod view;
mod widening;

pub use calibrate::{Calibration, CalibrationResult, Estimate};
pub use cloud::{Cloud, CloudError, CloudPoint};
pub use cloud_file::{CloudReading, PowerUnit};
pub use curve::Curve;
pub use error::{CalibrationError, ReductionError, RegistrationError};
pub use exclusions::Exclusions;
pub use incidence::{Incidence, Sighting};
pub use locate::{LocateError, RadarPlace, radar_place};
pub use reduce::{Reduction, ReductionResult};
pub use register::{RegistrationResult, Stop};
pub use settings::{Metric, Registration, Start};
pub use statistics::AngleStatistics;
pub(crate) use view::median_point;
