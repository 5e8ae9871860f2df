//! Settings of the diagnosis of a curve, and how much data it needs.

use serde::Serialize;

/// Levels that a diagnosis needs.
pub(super) const LEAST_POINTS: usize = 24;
/// Runs of angles that held-out scores need for a usable standard error.
pub(super) const LEAST_BLOCKS: usize = 8;

/// Settings of the diagnosis of a curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveDiagnosis {
    /// Seed of starts and folds.
    pub seed: u64,
    /// Number of folds, 2 or more.
    pub folds: usize,
    /// Most terms that are added.
    pub most_terms: usize,
    /// Gain in ln likelihood that a term needs to be considered.
    pub least_gain: f64,
    /// Standard errors by which a held-out gain must exceed zero.
    pub standard_errors: f64,
    /// Least change of the levels by a term, and least unexplained structure, dB.
    pub least_size_db: f64,
    /// Least change of the levels by a term that gets a name, dB: laws and instruments err by less without a name.
    pub least_named_db: f64,
    /// Probability by chance below which neighbouring residuals count as correlated.
    pub family_error: f64,
}

impl Default for CurveDiagnosis {
    fn default() -> Self {
        CurveDiagnosis {
            seed: 0,
            folds: 5,
            most_terms: 4,
            least_gain: 8.0,
            standard_errors: 2.0,
            least_size_db: 0.1,
            least_named_db: 0.3,
            family_error: 0.005,
        }
    }
}
