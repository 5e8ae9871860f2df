//! Whether the data speak for one more effect: the rule by which one is added, exchanged or kept.

use std::cell::OnceCell;

use super::field::Structure;
use super::score::{Scored, errors};
use super::select::{Added, Candidate, SHARE_OF_LARGEST, Selection, State, larger};
use super::trial::Trial;
use super::{Diagnosis, Evidence};

/// Share of the largest effect that one of the scatter must reach: a form that is off here and there
/// scatters more than it shifts.
const SHARE_OF_SPREAD: f64 = 0.4;
/// Share of the largest gain below which an effect may make up for the error of another's form, and that of
/// one of the scatter, which gains little for its size.
const SHARE_OF_GAIN: f64 = 0.1;
const SHARE_OF_GAIN_OF_SPREAD: f64 = 0.05;
/// Gain of each shot beyond which it tells that something was out of place, and no more of how large a form is.
const MOST_OF_A_SHOT: f64 = 2.0;
/// Share of its gain that an effect of the scatter must keep where a field has corrected the means.
const SHARE_BESIDE_FIELD: f64 = 0.5;
/// Share of the size of such an effect that neighbours may have in common: scatter is each shot's own.
const MOST_SHARED: f64 = 0.6;
/// Share of its gain that an effect of one small place keeps where it is held out, and how many least
/// gains it is worth.
const SHARE_KEPT: f64 = 0.6;
const FAR_BEYOND: f64 = 4.0;

/// The largest of the effects that were added: size, dB, and gain in ln likelihood.
#[derive(Clone, Copy, Default)]
pub(super) struct Largest {
    pub size_db: f64,
    gain: f64,
}

impl Largest {
    pub fn of(added: &[Added]) -> Largest {
        let largest = |of: fn(&Evidence) -> f64| {
            added.iter().map(|one| of(&one.evidence)).fold(0.0, f64::max)
        };
        Largest { size_db: largest(|e| e.size_db), gain: largest(|e| e.gain) }
    }

    /// The gain of one more effect below which it may be the error of this one's form, by so many shots.
    pub fn least_gain(self, is_spread: bool, shots: usize) -> f64 {
        let share = if is_spread { SHARE_OF_GAIN_OF_SPREAD } else { SHARE_OF_GAIN };
        share * self.gain.min(MOST_OF_A_SHOT * shots as f64)
    }
}

/// What an effect has to say for itself.
pub(super) struct Claim {
    /// Gain in ln likelihood, and the least that counts by itself.
    pub gain: f64,
    pub least: f64,
    /// Gain in ln p of held-out patches and its standard error.
    pub held_out: [f64; 2],
    /// What it changes of the means and of the spread, dB.
    pub sizes_db: [f64; 2],
    /// Share of the largest size that it must reach.
    pub share_of_size: f64,
    /// What it has to stand beside.
    pub largest: Largest,
}

impl Claim {
    /// The smaller gain: a fit without a patch may be far off where the patch was all that held it.
    fn counts(&self) -> f64 {
        self.held_out[0].min(self.gain)
    }
}

/// Whether an effect of these sizes changes the scatter more than the means.
fn is_spread([mean_db, spread_db]: [f64; 2]) -> bool {
    spread_db > mean_db
}

/// What a model leaves, once it is asked for: by a field, and what neighbours have in common, dB.
#[derive(Default)]
pub(super) struct Left {
    structure: OnceCell<Structure>,
    shared_db: OnceCell<f64>,
}

impl Selection<'_> {
    /// What held-out shots are under a trial and the gain that speaks for it; `None` where it is not
    /// supported.
    pub(super) fn support<'a>(
        &self,
        state: &State<'a>,
        trial: &mut Trial<'a>,
        largest: Largest,
        left: &Left,
    ) -> Option<(Vec<Scored>, f64)> {
        let Candidate { gain, numbers, size_db, .. } = trial.candidate;
        let is_spread = is_spread(trial.sizes_db);
        let share_of_size = if is_spread { SHARE_OF_SPREAD } else { SHARE_OF_LARGEST };
        let mut claim = Claim {
            gain,
            least: self.settings.least_gain_of(numbers, trial.tried),
            held_out: [f64::INFINITY, 0.0],
            sizes_db: trial.sizes_db,
            share_of_size,
            largest,
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
        let Claim { gain, least, held_out: [held_out, se], largest, .. } = *claim;
        let is_spread = is_spread(claim.sizes_db);
        // What acts in one small place, as no scatter does, has no standard error over places; it
        // must be far beyond chance and be found again where it was not fitted.
        let is_local = !is_spread
            && gain >= FAR_BEYOND * least
            && held_out >= SHARE_KEPT * gain
            && held_out > se;
        let beside = largest.least_gain(is_spread, self.problem.shots.len());
        gain >= least.max(beside)
            && larger(claim.sizes_db) >= least_size_db.max(claim.share_of_size * largest.size_db)
            && (claim.counts() > standard_errors * se || is_local)
    }

    /// Whether held-out errors grow by more than their standard error.
    fn is_farther_off(&self, now: &[Scored], before: &[Scored]) -> bool {
        let [now, before] = [now, before].map(|scored| errors(scored, self.folds));
        now.rmse_db > before.rmse_db + now.rmse_se_db
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_stands_beside_a_large_effect_must_be_large_itself() {
        let is_near = |gain: f64, expected: f64| (gain - expected).abs() < 1e-9;
        let large = Largest { size_db: 2.0, gain: 7_580.0 };
        assert!(is_near(Largest::default().least_gain(false, 18_529), 0.0));
        assert!(is_near(large.least_gain(false, 18_529), 758.0));
        assert!(is_near(large.least_gain(true, 18_529), 379.0));
        // A pose far off gains without end at edges, and hides nothing else for that.
        let far = Largest { gain: 170_150.0, ..large };
        assert!(is_near(far.least_gain(false, 8_708), 1_741.6));
    }
}
