//! Whether the data speak for one more effect: the rule by which one is added, exchanged or kept.

use std::cell::OnceCell;

use super::Diagnosis;
use super::field::Structure;
use super::score::{Scored, errors};
use super::select::{Candidate, SHARE_OF_LARGEST, Selection, State};
use super::trial::Trial;

/// Share of the largest effect that one of the scatter must reach: a form that is off here and there
/// scatters more than it shifts.
const SHARE_OF_SPREAD: f64 = 0.4;
/// Share of its gain that an effect of the scatter must keep where a field has corrected the means.
const SHARE_BESIDE_FIELD: f64 = 0.5;
/// Share of the size of such an effect that neighbours may have in common: scatter is each look's own.
const MOST_SHARED: f64 = 0.6;
/// Share of its gain that an effect of one small place keeps where it is held out, and how many least
/// gains it is worth.
const SHARE_KEPT: f64 = 0.6;
const FAR_BEYOND: f64 = 4.0;

/// What an effect has to say for itself.
pub(super) struct Claim {
    /// Gain in ln likelihood, and the least that counts.
    pub gain: f64,
    pub least: f64,
    /// Gain in ln p of held-out patches and its standard error.
    pub held_out: [f64; 2],
    /// What it changes of the means and of the spread, dB, and the least that counts beside what others
    /// change.
    pub sizes_db: [f64; 2],
    pub least_db: f64,
}

impl Claim {
    /// The smaller gain: a fit without a patch may be far off where the patch was all that held it.
    fn counts(&self) -> f64 {
        self.held_out[0].min(self.gain)
    }
}

/// What a model leaves, once it is asked for: by a field, and what neighbours have in common, dB.
#[derive(Default)]
pub(super) struct Left {
    structure: OnceCell<Structure>,
    shared_db: OnceCell<f64>,
}

impl Selection<'_> {
    /// What held-out looks are under a trial and the gain that speaks for it; `None` where it is not
    /// supported.
    pub(super) fn support<'a>(
        &self,
        state: &State<'a>,
        trial: &mut Trial<'a>,
        largest_db: f64,
        left: &Left,
    ) -> Option<(Vec<Scored>, f64)> {
        let Candidate { gain, numbers, size_db, .. } = trial.candidate;
        let [mean_db, spread_db] = trial.sizes_db;
        let is_spread = spread_db > mean_db;
        let share = if is_spread { SHARE_OF_SPREAD } else { SHARE_OF_LARGEST };
        let mut claim = Claim {
            gain,
            least: self.settings.least_gain_of(numbers, trial.tried),
            held_out: [f64::INFINITY, 0.0],
            sizes_db: trial.sizes_db,
            least_db: share * largest_db,
        };
        // Held-out patches are dear: nobody asks them of what fails without.
        if !self.is_supported(&claim) {
            return None;
        }
        let held_out = self.held_out(&trial.space, &trial.fitted.at);
        claim.held_out = self.difference(&held_out, &state.held_out);
        trial.candidate.held_out = Some(claim.held_out);
        if !self.is_supported(&claim) || self.is_farther_off(&held_out, &state.held_out) {
            return None;
        }
        if is_spread {
            let structure = left.structure.get_or_init(|| self.structure(state));
            let shared_db = *left.shared_db.get_or_init(|| self.shared_db(state));
            let beside = self.gain_beside(state, trial, structure);
            if beside < SHARE_BESIDE_FIELD * gain || shared_db > MOST_SHARED * size_db {
                return None;
            }
        }
        Some((held_out, claim.counts()))
    }

    /// Whether fit, held-out patches and size speak for an effect.
    pub(super) fn is_supported(&self, claim: &Claim) -> bool {
        let Diagnosis { least_size_db, standard_errors, .. } = *self.settings;
        let Claim { gain, least, held_out: [held_out, se], sizes_db: [mean_db, spread_db], .. } =
            *claim;
        // What acts in one small place, as no scatter does, has no standard error over places; it
        // must be far beyond chance and be found again where it was not fitted.
        let is_local = spread_db <= mean_db
            && gain >= FAR_BEYOND * least
            && held_out >= SHARE_KEPT * gain
            && held_out > se;
        gain >= least
            && mean_db.max(spread_db) >= least_size_db.max(claim.least_db)
            && (claim.counts() > standard_errors * se || is_local)
    }

    /// Whether held-out errors grow by more than their standard error.
    fn is_farther_off(&self, now: &[Scored], before: &[Scored]) -> bool {
        let [now, before] = [now, before].map(|scored| errors(scored, self.folds));
        now.rmse_db > before.rmse_db + now.rmse_se_db
    }
}
