//! Which term does the scattering model of a measured curve lack? The answer is that term, or that the model lacks
//! none, or that the missing part is unknown.
//!
//! As for a scan, the scattering model is refitted first, so that "before" is the best model
//! without a term. Where it leaves no more than noise, nothing is missing. Else other scattering models
//! are tried, then levels that lie far off by themselves are looked for, and only then terms. Every term is fitted with the model and must
//! predict runs of angles that took no part in its fit (`folds.rs`). It gets a name only where no more than noise remains.
//!
//! | step | file |
//! |---|---|
//! | the curve as points, and their noise | `points.rs` |
//! | terms that a scattering model can lack | `terms.rs` |
//! | scattering model and terms together | `model.rs` |
//! | other scattering models | `laws.rs` |
//! | held-out runs of angles, choice of terms | `folds.rs`, `select.rs`, `trust.rs` |
//! | what remains | `goodness.rs`, `smooth.rs`, `remains.rs`, `isolated.rs` |
//! | the answer and its report | `answer.rs`, `evidence.rs`, `report.rs`, `run.rs` |

mod answer;
mod error;
mod evidence;
mod folds;
mod goodness;
mod isolated;
mod laws;
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
mod trust;

pub use error::CurveDiagnoseError;
pub use evidence::{CurveEvidence, RankedTerm};
pub use laws::base_law;
pub use points::{Kind, Noise, NoiseSource, Point, Points, is_grazing};
pub use report::{
    ComparedLaw, CurveBase, CurveBaseValue, CurveBeforeAfter, CurveErrors, CurveFacts, CurveReport,
    CurveRow, CurveUnknown, CurveVerdict, FoundTerm,
};
pub use settings::CurveDiagnosis;
pub use terms::{LawAt, Term, term, terms};
pub use trust::NameDoubt;
