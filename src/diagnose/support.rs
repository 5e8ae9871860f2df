//! Whether the data support one more effect: the rule by which one is added, exchanged or kept.

use std::cell::OnceCell;

use super::clouds;
use super::evidence::{Candidate, Largest};
use super::field::Structure;
use super::scorer::{HeldOut, Scorer, State};
use super::screen::Screen;
use super::settings::Diagnosis;
use super::size::Size;
use super::trial::Trial;

/// Share of the largest effect's size below which another may only correct the form of the largest.
pub(super) const SHARE_OF_LARGEST: f64 = 0.2;
/// The same share for an effect on the scatter: a wrong form scatters more than it shifts.
const SHARE_OF_SPREAD: f64 = 0.4;
/// Share of its gain that an effect on the scatter must keep where a field has corrected the means.
const SHARE_BESIDE_FIELD: f64 = 0.5;
/// Largest residual that neighbours in place or in time may share, as a share of the size of such an effect: the scatter
/// of every shot is independent.
const MOST_SHARED: f64 = 0.35;
/// Share of its gain that an effect of one small place keeps where it is held out.
const SHARE_KEPT: f64 = 0.6;
/// Gain of such an effect, in least gains.
const FAR_BEYOND: f64 = 4.0;
/// Change of the means, dB, below which an effect may stand for an error of the form of a law, and the least gains that it
/// then needs.
const SMALL_DB: f64 = 0.25;
const LEAST_GAINS_OF_SMALL: f64 = 2.5;
/// Standard errors of a held-out gain that leaves no doubt.
pub(super) const NO_DOUBT: f64 = 4.0;

/// Difference in ln p of all held-out shots below which two effects predict equally well: odds of twenty to one.
const SAME: f64 = 3.0;

/// Whether an effect does as well as another, from how much less held-out shots gain by it, with the standard error, and how
/// much less its gain is that counts. Held-out shots may gain more than the fit itself, by chance.
pub(super) fn is_as_good(
    [held_out_behind, se]: [f64; 2],
    counted_behind: f64,
    standard_errors: f64,
) -> bool {
    held_out_behind.min(counted_behind) <= (standard_errors * se).max(SAME)
}

/// What speaks for an effect.
pub(super) struct Claim {
    /// Gain in ln likelihood.
    pub gain: f64,
    /// Least gain that counts.
    pub least: f64,
    /// Whether it may stand for an error of the form of a law.
    pub may_be_form: bool,
    /// Gain in ln p of held-out patches and its standard error.
    pub held_out: [f64; 2],
    pub size: Size,
    /// Share of the largest size that it must reach.
    pub share_of_size: f64,
    /// The largest of the other effects.
    pub largest: Largest,
}

impl Claim {
    /// The smaller gain. A fit without a patch may be far off where only that patch held it.
    fn counts(&self) -> f64 {
        self.held_out[0].min(self.gain)
    }

    /// Whether held-out patches gain so much that larger errors of the powers do not speak against the effect: it explains
    /// ranges or silence, and the powers by a form that is not quite its own.
    fn is_far_beyond_errors(&self) -> bool {
        self.counts() > NO_DOUBT * self.held_out[1]
    }

    /// Whether fit, held-out patches and size support the effect, on a scan of this many independent shots.
    pub fn is_supported(&self, settings: &Diagnosis, shots: f64) -> bool {
        let Diagnosis { least_size_db, standard_errors, .. } = *settings;
        let Claim { gain, least, held_out: [held_out, se], size, largest, .. } = *self;
        // An effect of one small place, which no scatter is, has no standard error over places. It
        // must be far beyond chance and be found again where it was not fitted.
        let is_local = !size.is_spread()
            && gain >= FAR_BEYOND * least
            && held_out >= SHARE_KEPT * gain
            && held_out > se;
        let is_small = self.may_be_form && !size.is_spread() && size.mean_db < SMALL_DB;
        let least_gains = if is_small { LEAST_GAINS_OF_SMALL } else { 1.0 };
        gain >= (least_gains * least).max(largest.least_gain(size.is_spread(), shots))
            && size.larger_db() >= least_size_db.max(self.share_of_size * largest.size_db)
            && (held_out > standard_errors * se || is_local)
    }
}

/// Judges trials of one more effect against a model.
pub(super) struct Judge<'j, 'p, 'a> {
    scorer: Scorer<'p>,
    state: &'j State<'a>,
    largest: Largest,
    /// Computed on first use, as few trials need them.
    structure: OnceCell<Structure>,
    shared_db: OnceCell<f64>,
    screen: OnceCell<Screen<'p>>,
}

impl<'j, 'p, 'a> Judge<'j, 'p, 'a> {
    /// A judge of trials against a model with these effects.
    pub fn new(scorer: Scorer<'p>, state: &'j State<'a>, largest: Largest) -> Judge<'j, 'p, 'a> {
        let (structure, shared_db, screen) = Default::default();
        Judge { scorer, state, largest, structure, shared_db, screen }
    }

    /// Held-out scores of a trial and the gain that counts; `None` where it is not supported.
    pub fn support(&self, trial: &mut Trial) -> Option<(HeldOut, f64)> {
        let Candidate { gain, numbers, .. } = trial.candidate;
        let (settings, shots) = (self.scorer.settings, self.scorer.problem.independent_shots());
        let is_spread = trial.size.is_spread();
        let least = settings.least_gain_of(numbers, trial.tried);
        let of_alarms = self.scorer.gain_of_alarms(self.state, &trial.space, &trial.fit.at);
        let mut claim = Claim {
            gain,
            least,
            may_be_form: !trial.effect.about().has_one_form,
            held_out: [f64::INFINITY, 0.0],
            size: trial.size,
            share_of_size: if is_spread { SHARE_OF_SPREAD } else { SHARE_OF_LARGEST },
            largest: self.largest.beside(of_alarms, least),
        };
        // Held-out patches take long and are computed only for trials that would pass without them.
        if !claim.is_supported(settings, shots) {
            return None;
        }
        let held_out = self.scorer.held_out(&trial.space, &trial.fit.at);
        claim.held_out = self.scorer.difference(&held_out, &self.state.held_out);
        trial.candidate.held_out = Some(claim.held_out);
        if !claim.is_supported(settings, shots)
            || (!claim.is_far_beyond_errors()
                && self.scorer.is_farther_off(&held_out, &self.state.held_out))
            || (is_spread && self.is_structure_of_means(trial))
        {
            return None;
        }
        trial.candidate.by_cloud = clouds::gains(&self.scorer, &held_out, &self.state.held_out);
        // It must hold in each of several clouds.
        if trial.candidate.is_excluded() {
            return None;
        }
        Some((held_out, claim.counts()))
    }

    /// Whether an effect on the scatter only stands for structure of the means.
    fn is_structure_of_means(&self, trial: &Trial) -> bool {
        let structure = self.structure.get_or_init(|| self.scorer.structure(self.state));
        let shared_db = *self.shared_db.get_or_init(|| self.scorer.fine_structure_db(self.state));
        let with = self.scorer.ln_likelihood_with(&trial.space, &trial.fit, structure);
        let without = self.scorer.ln_likelihood_with(&self.state.space, &self.state.fit, structure);
        let Candidate { gain, size_db, .. } = trial.candidate;
        with - without < SHARE_BESIDE_FIELD * gain || shared_db > MOST_SHARED * size_db
    }

    /// Gain that a placebo with this number of parameters promises.
    pub fn placebo_gain(&self, numbers: usize) -> f64 {
        let State { space, fit, .. } = self.state;
        let screen = self.screen.get_or_init(|| Screen::new(self.scorer.problem, space, &fit.at));
        screen.placebo_gain(space, &fit.at, numbers, self.scorer.settings.seed)
    }

    /// Whether a trial gains more than a placebo with as many parameters.
    pub fn beats_placebos(&self, trial: &mut Trial) -> bool {
        let placebo_gain = self.placebo_gain(trial.candidate.numbers);
        trial.candidate.placebo_gain = Some(placebo_gain);
        trial.candidate.gain > placebo_gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_effect_is_no_farther_ahead_than_what_it_gains_in_the_fit() {
        // Gains of two effects in held-out patches and in the fit: 30.1 and 26.1, 15.8 and 24.8. Of the 14.3, 10.3 count.
        assert!(is_as_good([14.3, 8.0], 10.3, 1.5));
        assert!(!is_as_good([14.3, 8.0], 14.3, 1.5));
        assert!(is_as_good([11.9, 8.0], 20.0, 1.5));
        assert!(is_as_good([2.9, 0.0], 9.0, 1.5), "a few in ln p are nothing");
    }

    #[test]
    fn a_change_as_small_as_an_error_of_a_laws_form_must_gain_far_more_than_chance() {
        let settings = Diagnosis::default();
        let claim = |gain, mean_db, may_be_form| Claim {
            gain,
            least: 10.0,
            may_be_form,
            held_out: [gain, 4.0],
            size: Size { mean_db, spread_db: 0.0 },
            share_of_size: SHARE_OF_LARGEST,
            largest: Largest::default(),
        };
        let is_supported = |claim: Claim| claim.is_supported(&settings, 4_000.0);
        assert!(!is_supported(claim(18.0, 0.2, true)));
        assert!(is_supported(claim(18.0, 0.3, true)));
        assert!(is_supported(claim(26.0, 0.2, true)));
        assert!(is_supported(claim(18.0, 0.2, false)), "a pose has no other form");
    }
}
