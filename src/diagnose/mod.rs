//! Which physical effect does a model lack? From a measured cloud to that effect, or to the answer that
//! the model lacks none, or that the missing part is unknown.
//!
//! The observation model comes first (`likelihood.rs`): speckle, thermal noise, and chirps without the detection that
//! they should have. The scattering models are refitted, so that "before" is the best model
//! without an effect. A score test screens the library on a sample of the shots. The best few effects are
//! fitted together with the scattering models and must predict patches of the scan that took no part in their fit. When no
//! further effect does, effects that others made superfluous are removed. The remainder is tested: by a smooth field
//! over every covariate, by the correlation of neighbours, by the scatter, by the order of the chirps, for waves, and for outliers.
//!
//! | step | file |
//! |---|---|
//! | from a scene and its cloud to a report | `scan.rs`, `run.rs` |
//! | every chirp against the target, the cloud against the chirps | `shots.rs`, `unresolved.rs`, `matching.rs` |
//! | probability of the observations | `likelihood.rs`, `problem.rs`, `shared.rs` |
//! | several clouds of one target | `views.rs`, `in_scans.rs`, `clouds.rs`, `contradiction.rs` |
//! | scattering models and effects together | `space.rs`, `refit.rs`, `optima.rs`, `ranges.rs` |
//! | their standard deviations | `deviations.rs`, `told.rs` |
//! | the promise of an effect | `screen.rs` |
//! | the score of a model on held-out patches | `folds.rs`, `score.rs`, `scorer.rs` |
//! | the choice: trials, support, rivals, removal | `trial.rs`, `support.rs`, `choose.rs`, `exchange.rs`, `explanation.rs` |
//! | what remains | `covariates.rs`, `field.rs`, `residual.rs`, `scatter.rs`, `order.rs`, `waves.rs`, `spectrum.rs`, `remains.rs` |
//! | controls of the answer | `controls.rs`, `placebo.rs`, `recovery.rs` |
//! | the report | `report.rs`, `answer.rs` |
//! | the diagnosis of a measured curve | `curve/` |

mod alarms;
mod answer;
mod beside;
mod choose;
mod clouds;
mod contradiction;
mod controls;
mod covariates;
pub mod curve;
mod deviations;
mod error;
mod evidence;
mod exchange;
mod explanation;
mod field;
mod folds;
mod in_scans;
mod level;
mod likelihood;
mod matching;
mod observation;
mod optima;
mod order;
mod placebo;
mod problem;
mod ranges;
mod recovery;
mod refit;
mod remains;
mod report;
mod residual;
mod run;
mod scan;
mod scatter;
mod score;
mod scorer;
mod screen;
mod settings;
mod shared;
mod shots;
mod size;
mod space;
mod spectrum;
mod subject;
mod support;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod testing;
mod told;
mod trial;
mod unresolved;
mod views;
mod waves;

pub use alarms::{Alarms, FalseAlarms};
pub use error::DiagnoseError;
pub use evidence::{Candidate, CloudGain, Evidence};
pub use folds::Folds;
pub use matching::{CloudMatch, Reported, Stray, match_cloud};
pub use observation::{Observation, ReceiverLimits};
pub use report::{
    Base, BaseValue, BeforeAfter, CloudPart, Contradiction, Control, Controls, FoundEffect,
    MeshPose, Parameters, Power, Report, Row, SCHEMA, Triple, Value, Verdict,
};
pub use residual::{MAY_BE, ResidualStructure};
pub use scan::{MeasuredScene, Options, declared_receiver, diagnose_together};
pub use score::Errors;
pub use settings::Diagnosis;
pub use shots::trace_shots;
pub(crate) use space::LEAST_SHOTS;
pub use subject::Subject;
