//! What a model leaves unexplained, by all tests together.

use super::covariates::covariates;
use super::evidence::Candidate;
use super::field::Structure;
use super::problem::Problem;
use super::residual::{self, ResidualStructure, scatter_db};
use super::scatter::Tests;
use super::scorer::{SHARE_OF_FORM, Scorer};
use super::settings::Diagnosis;
use crate::effects::Prediction;

/// The final model as the tests see it.
pub(super) struct Remainder<'a> {
    pub prediction: &'a Prediction,
    /// Randomised quantile residuals.
    pub z: &'a [f64],
    /// Structure of the means; `None` where a field finds none.
    pub structure: Option<&'a Structure>,
    /// Size of the largest effect of the model, dB.
    pub largest_db: f64,
    /// Numbers of detections far off the target, and of those beside an edge that the spot does not reach.
    pub strays: [usize; 2],
    /// What the strongest effect may hide.
    pub hidden: &'a [Candidate],
}

/// Every structure that exceeds chance, strongest first.
pub(super) fn find_unexplained(scorer: &Scorer, remainder: &Remainder) -> Vec<ResidualStructure> {
    let Remainder { prediction, z, structure, largest_db, strays, hidden } = *remainder;
    let Problem { shots, observations, alarms, declared, shared, .. } = scorer.problem;
    let covariates = covariates(shots, prediction, observations);
    let tests = tests(scorer.settings, largest_db);
    let mut found = tests.run(z, shots, prediction, &covariates, scorer.folds);
    if let Some(structure) = structure {
        found.extend(residual::of_field(structure));
    }
    found.extend(hidden.iter().map(residual::may_be));
    let neighbours = scorer.shared(prediction, z);
    if scorer.is_shared(&neighbours, largest_db) {
        found.push(neighbours);
    }
    for [strength_db, gain] in
        alarms.iter().filter_map(|alarms| alarms.unlike(&prediction.receiver, declared))
    {
        let p_value = (-gain).exp();
        let covariate = "false alarms".to_owned();
        found.push(ResidualStructure { covariate, strength_db, p_value });
    }
    found.extend(residual::outliers(z, prediction, declared, observations, strays));
    let sd_db = scatter_db(prediction);
    let swing = scorer.swing(prediction, z);
    let waves = scorer.waves(prediction, z);
    let least_db = scorer.least_structure_db(largest_db);
    found.extend(swing.into_iter().chain(waves).filter(|one| one.strength_db >= least_db));
    found.extend(residual::steps(observations));
    found.extend(residual::skewness(z, shared, sd_db));
    found.sort_by(|a, b| b.strength_db.total_cmp(&a.strength_db));
    found
}

/// The tests of the scatter for a model whose largest effect has this size.
fn tests(settings: &Diagnosis, largest_db: f64) -> Tests {
    let Diagnosis { seed, draws, block_m, family_error, .. } = *settings;
    let least_size_db = settings.least_size_db.max(SHARE_OF_FORM * largest_db);
    Tests { seed, draws, block_m, family_error, least_size_db }
}
