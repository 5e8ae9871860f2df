//! A material as a plain value: what is known of it, from whom, and how it scatters.
//!
//! Inside are SI units, linear σ⁰ and radians. [`mod@file`] reads and writes the form people edit;
//! [`builtin`] holds the catalogue that comes with the program.

mod aspect;
mod bidirectional;
pub mod builtin;
mod check;
mod composition;
mod curve;
mod error;
pub mod file;
mod finding;
mod fit;
pub mod form;
mod instrument;
mod number_check;
mod provenance;
mod reach;
mod report;
mod revision;
mod sampled;
mod slug;
mod status;
mod texts;

pub use aspect::Aspect;
pub use bidirectional::{is_turning, turns_the_line};
pub use composition::{Layer, Permittivity, Roughness};
pub use curve::{Censor, Curve, Illumination, Observation};
pub use error::MaterialError;
pub use finding::{Finding, FindingVerdict};
pub use fit::{BEAM, ChosenBy, Covariance, Fit, FitNumber, Lobes};
pub use instrument::{Geometry, Instrument, Scale};
pub use provenance::{
    Activity, Citation, Input, Making, Origin, Session, SessionPose, Source, SourceKind,
    USUAL_TITLE,
};
pub use reach::Reach;
pub use report::{CrossValidation, Estimate, FitReport, FixedNumber, Goodness};
pub use revision::Material;
pub use sampled::SampledMaterial;
pub(crate) use sampled::sampled_law;
pub use slug::Slug;
pub use status::Status;
pub use texts::LONGEST_TEXT_BYTES;
