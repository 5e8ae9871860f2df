//! Which term does the scattering model of a measured curve lack? The answer is that term, or that the model lacks
//! none, or that the missing part is unknown.
//!
//! As for a scan, the scattering model is refitted first, so that "before" is the best model
//! without a term. Every term is fitted with it and must predict runs of angles that took no part in
//! its fit (`folds.rs`). A residual that then depends on an angle, smoothly and beyond chance, is unknown.
//!
//! | step | file |
//! |---|---|
//! | the curve as points, and their noise | `points.rs` |
//! | terms that a scattering model can lack | `terms.rs` |
//! | scattering model and terms together | `model.rs` |
//! | held-out runs of angles, choice of terms | `folds.rs`, `select.rs` |
//! | what remains | `smooth.rs`, `remains.rs` |
//! | the report | `evidence.rs`, `report.rs`, `run.rs` |

mod error;
mod evidence;
mod folds;
mod model;
mod points;
mod remains;
mod report;
mod run;
mod select;
mod settings;
mod smooth;
mod terms;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

pub use error::CurveDiagnoseError;
pub use evidence::{CurveEvidence, RankedTerm};
pub use points::{Kind, Noise, NoiseSource, Point, Points};
pub use report::{
    CurveBase, CurveBaseValue, CurveBeforeAfter, CurveErrors, CurveFacts, CurveReport, CurveRow,
    CurveUnknown, FoundTerm,
};
pub use run::base_law;
pub use settings::CurveDiagnosis;
pub use terms::{Term, term, terms};
