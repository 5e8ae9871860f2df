//! Fits the parameters of a scattering model to a curve, and reports which of them the curve does not determine.
//!
//! A detected power of chirp i follows Gamma(L, μ_i/L), L looks of speckle on the mean
//! μ_i = σ⁰(t_i) + noise; a chirp without a detection says that this power stayed below a threshold. The
//! default [`Method::Censored`] maximises the likelihood of both, averaged over the true angle
//! t_i. The paper's least squares in decibels are there for comparison: they ignore the missing
//! chirps, and the mean of speckle in decibels is not zero.
//!
//! ```
//! use matdb::brdf::{Brdf, Lambert};
//! use matdb::fit::Fit;
//! use matdb::measure::curve::Curve;
//! let curve = Curve::read(b"theta_deg,sigma0_db\n0,0.1\n20,-0.7\n40,-2.2\n60,-6.1\n")?;
//! let fit = Fit { looks: Some(100.0), ..Fit::default() };
//! let found = fit.run(&Brdf::Lambert(Lambert { albedo: 0.5 }), &curve)?;
//! assert!(found.converged && (found.estimates[0].value - 0.25).abs() < 0.03);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

pub mod again;
mod angle;
pub mod bistatic;
pub(crate) mod by_parts;
pub(crate) mod coordinates;
mod error;
pub(crate) mod gamma_law;
mod goodness;
pub(crate) mod held_out;
mod interval;
mod judge;
mod least_squares;
mod likelihood;
pub(crate) mod minimise;
mod models;
mod moments;
mod own_law;
mod parts;
mod projection;
mod result;
mod run;
mod search;
mod sensitivity;
mod settings;
pub(crate) mod shapes;
mod stored;
mod summary;
mod table;
#[cfg(test)]
pub(crate) mod twin;
pub(crate) mod uncertainty;
mod verdict;

pub use crate::material::{Estimate, Goodness};
pub use error::FitError;
pub(crate) use goodness::normal_share;
pub use minimise::Stop;
pub use models::{model, model_names};
pub use own_law::{OwnFunction, OwnLaw, OwnLawError, OwnParameter};
pub use result::{Band, FitResult};
pub use settings::{Fit, Method};
pub use stored::{stored_band, undetermined};
pub use verdict::Finding;
