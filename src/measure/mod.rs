//! A measured cloud → pose → angles of incidence → a curve that belongs to a material.
//!
//! [`Cloud`] is what the radar measured. [`Registration`] finds where the mesh stood, [`Incidence`]
//! tells where and how steeply each beam met it, and [`Reduction`] turns powers into σ⁰.

pub mod cloud;
pub mod cloud_file;
mod coarse;
pub mod compare;
pub mod curve;
mod error;
pub mod icp;
pub mod in_plane;
pub mod incidence;
pub mod nearest;
pub mod normals;
pub mod placed;
pub mod reduce;
pub mod register;
mod settings;
mod sights;
mod start;
pub mod statistics;
#[cfg(test)]
mod synthetic;
mod uncertainty;
mod view;

pub use cloud::{Cloud, CloudError, CloudPoint};
pub use cloud_file::{CloudFormat, CloudReading, PowerUnit};
pub use curve::Curve;
pub use error::{ReductionError, RegistrationError};
pub use incidence::{Incidence, Sighting};
pub use reduce::{LeftOut, Reduced, Reduction};
pub use register::{Registered, Stop};
pub use settings::{Metric, Registration, Start};
pub use statistics::AngleStatistics;
pub(crate) use view::median_point;
