//! Settings of a diagnosis, and how much data it needs.

use serde::Serialize;

/// Detections that a diagnosis needs.
pub(super) const LEAST_DETECTIONS: usize = 300;
/// Patches that held-out scores need for a usable standard error.
pub(super) const LEAST_BLOCKS: usize = 15;

/// Settings of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Seed of folds, placebos and randomised residuals.
    pub seed: u64,
    /// Side of the patches that are held out together, m at 8 m; three correlation lengths or more. 0.05:
    /// three spots of 16 mm.
    pub block_m: f64,
    /// Number of folds, 2 or more.
    pub folds: usize,
    /// Most effects that are added.
    pub most_effects: usize,
    /// How often the search begins. If the base is then at a better place again that could change the answer, it has
    /// failed.
    pub most_starts: usize,
    /// Gain in ln likelihood that an effect with one parameter needs to be considered. 5 occurs by chance
    /// once in about 640.
    pub least_gain: f64,
    /// Standard errors by which a held-out gain must exceed zero.
    pub standard_errors: f64,
    /// Least change of the data by an effect, dB.
    pub least_size_db: f64,
    /// Least structure of the means that counts as unexplained, dB.
    pub least_structure_db: f64,
    /// Probability that any test of the scatter rejects a complete model.
    pub family_error: f64,
    /// Random signs drawn for each residual test.
    pub draws: usize,
    /// Whether controls are computed.
    pub controls: bool,
}

impl Diagnosis {
    /// For a spot of this diameter, m at 8 m. The patches of a large spot are three spots wide.
    pub fn for_spot(diameter_m: f64) -> Diagnosis {
        let usual = Diagnosis::default();
        Diagnosis { block_m: usual.block_m.max(3.0 * diameter_m), ..usual }
    }

    /// Least gain in ln likelihood of an effect with this number of parameters, searched from this number of
    /// starts. By chance it is about as rare as [`Diagnosis::least_gain`] is for one parameter.
    pub(super) fn least_gain_of(&self, numbers: usize, starts: usize) -> f64 {
        self.least_gain + 1.2 * (numbers as f64 - 1.0) + gain_of_starts(starts)
    }
}

/// What the best of so many starts gains by chance over that of a few, in ln likelihood.
pub(super) fn gain_of_starts(starts: usize) -> f64 {
    (0.25 * starts as f64).max(1.0).ln()
}

impl Default for Diagnosis {
    fn default() -> Self {
        Diagnosis {
            seed: 0,
            block_m: 0.05,
            folds: 5,
            most_effects: 4,
            most_starts: 4,
            least_gain: 5.0,
            standard_errors: 1.5,
            least_size_db: 0.1,
            least_structure_db: 0.15,
            family_error: 0.005,
            draws: 4999,
            controls: true,
        }
    }
}
