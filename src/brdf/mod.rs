//! Scattering models: bidirectional reflectance f(i, o) in 1/sr, seen from the surface's own frame.
//!
//! `i` points to the source and `o` to the receiver, both away from the surface; z is the normal.
//! Radar data are the monostatic case i = o. [`Brdf`] has every model, each with its equation in a file of
//! its own, and returns zero below the horizon.
//!
//! ```
//! use matdb::brdf::{Lambert, Scattering};
//! let chalk = Lambert { albedo: 0.8 };
//! // Equation (10) at 60°: 4π · 0.8/π · cos² 60°.
//! assert!((chalk.sigma0(60f64.to_radians()) - 0.8).abs() < 1e-12);
//! ```

mod albedo;
mod backscatter;
mod beyond_beam;
mod bistatic;
mod kind;
mod lobe;
mod models;
mod outline;
mod parameter;
mod permittivity;
mod retro;
mod scattering;
mod slopes;
mod through_beam;
mod validity;

pub use albedo::{ALBEDO_SLACK, Excess, albedo, incidences_rad};
pub(crate) use backscatter::Look;
pub use backscatter::{Facets, Term};
pub use beyond_beam::BeyondBeam;
pub(crate) use bistatic::{Bistatic, Pair, of_each_law};
pub use kind::{Key, Kind};
pub use lobe::Lobe;
pub use models::*;
pub use outline::{DEGREES, Outline};
pub use parameter::{Parameter, ParameterError, Visitor};
pub use permittivity::Polarisation;
pub(crate) use permittivity::mirror_cosine;
pub(crate) use retro::Retro;
pub use scattering::{NARROW_M, NarrowLobe, Scattering, ScatteringModel, Seen};
pub use slopes::{Distribution, VIEWING_RAD};
pub use through_beam::ThroughBeam;
pub(crate) use through_beam::widening_rad;
pub use validity::{Bound, Condition};
