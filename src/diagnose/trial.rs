//! Fits of one more effect: from the promise of every effect on a sample of the shots to a fit to all shots for
//! the best few.

use nalgebra::DVector;
use rayon::prelude::*;

use super::evidence::{Candidate, Largest, is_shown_by_alarms};
use super::problem::Sample;
use super::ranges::place_by_ranges;
use super::refit::{Fit, SCOUT, SEARCH};
use super::scorer::{Scorer, State};
use super::screen::Screen;
use super::settings::Diagnosis;
use super::size::Size;
use super::space::Space;
use crate::effects::{Effect, EffectParameter};
use crate::fit::minimise::Minimise;

/// Starts of an effect that are followed.
const STARTS: usize = 2;
/// How often a fit that has not converged is continued.
const LONGER: usize = 3;
/// Share of the best gain from which the fit of a target that moves is continued, too.
const SHARE_TO_CONTINUE: f64 = 0.8;
/// Gain in ln likelihood for which it is continued once more.
const WORTH_MORE: f64 = 3.0;
/// Distances by which the shape of a start is moved, in steps of the parameters.
const SHAPE_STEPS: [f64; 3] = [4.0, 2.0, 1.0];
/// How far from a start the target may be placed where the ranges do not determine it, in steps of the parameters.
const WITHIN: [f64; 2] = [1.0, 10.0];
/// Strengths of a start that are tried.
const STRENGTHS: [f64; 6] = [0.3, 1.0, 3.0, 7.0, 12.0, 20.0];
/// A start that promises less than this share of the best is not followed.
const SHARE_OF_START: f64 = 0.7;
/// A start that gains less than this share of its promise is moved by its gain instead.
const SHARE_OF_WORD: f64 = 0.3;
/// How far laws are from those stored, in ln p, from which on they may stand for an effect.
const FAR_OFF: f64 = 3.0;
/// Starts that the rest of a model is fitted to, and that search.
const FOLLOWED_BY_LAWS: usize = 4;
const FOLLOW: Minimise = Minimise { iterations: 4, tolerance: 0.5, patience: 2 };
/// An effect that promises less than this share of the best is not fitted.
const SHARE_TO_SCOUT: f64 = 0.05;
/// Most parameters of an effect that is fitted whatever it promises, where a start is far from the fitted model.
const MOST_NUMBERS_FAR: usize = 5;
/// Effects of each round, with all members of their families, that are fitted to all shots and predict held-out patches.
const SHORTLIST: usize = 5;
/// An effect that gains less than this share of the best is not among them.
const SHARE_OF_BEST: f64 = 0.3;
/// An effect that gains less than this share of its least gain on the sample is not fitted to all shots.
const SHARE_OF_LEAST: f64 = 0.5;
/// A refit that keeps less than this share of its promise does not count among them.
const SHARE_OF_PROMISE: f64 = 0.3;
/// An effect that gains less than this share of what it needs beside the effects already added is not searched for
/// further.
const SHARE_OF_HOPE: f64 = 0.5;

/// A fit of one more effect.
pub(super) struct Trial<'a> {
    pub effect: &'a dyn Effect,
    pub space: Space<'a>,
    starts: Vec<Start>,
    /// Whether one of them is followed whatever it promises.
    has_far_start: bool,
    /// Number of starts before the choice of the best.
    pub tried: usize,
    pub fit: Fit,
    pub size: Size,
    pub candidate: Candidate,
}

impl Trial<'_> {
    /// Whether this motion of the target makes another with more parameters needless: each of those must gain 1 in ln p
    /// (Akaike, IEEE Trans. Autom. Control 19, 1974). A pose is the constant case of a motion.
    pub fn is_enough_for(&self, flexible: &Trial) -> bool {
        let [few, many] = [self, flexible].map(|trial| trial.candidate.numbers as f64);
        let more = flexible.candidate.gain - self.candidate.gain;
        let move_alike = self.effect.moves() && flexible.effect.moves();
        let [own, other] = [self, flexible].map(|trial| &trial.candidate.scans);
        move_alike && own == other && few < many && more < many - few
    }

    /// Whether this motion is so simple that a flexible one may only have found a way past an edge that it has not.
    fn may_catch_up_with(&self, best: &Trial) -> bool {
        let is_near = self.candidate.gain > SHARE_TO_CONTINUE * best.candidate.gain;
        let move_alike = self.effect.moves() && best.effect.moves();
        let is_simpler = self.candidate.numbers < best.candidate.numbers;
        move_alike && is_simpler && is_near && !self.is_enough_for(best)
    }

    /// Name and scans of its effect, which all members of a family share.
    fn key(&self) -> (&'static str, Vec<u16>) {
        (self.candidate.name, self.candidate.scans.clone())
    }
}

/// Where a fit of one more effect has ended. Beside effects that were added since, another fit may begin there: the laws may have
/// gone where they stand for the effect.
pub(super) struct Found {
    name: &'static str,
    scans: Vec<u16>,
    /// The unknowns of the scattering models and of the effect.
    laws: DVector<f64>,
    own: DVector<f64>,
}

impl Found {
    /// The end of a trial beside so many effects, if it gained more than chance.
    pub fn of(trial: &Trial, settings: &Diagnosis) -> Option<Found> {
        let Trial { effect, space, fit, candidate, tried, .. } = trial;
        let numbers = effect.parameters().len();
        let is_any = fit.ln_likelihood.is_finite()
            && candidate.gain.is_finite()
            && candidate.gain >= settings.least_gain_of(numbers, *tried);
        is_any.then(|| Found {
            name: effect.name(),
            scans: effect.scans().to_vec(),
            laws: fit.at.rows(0, space.base_len()).into_owned(),
            own: fit.at.rows(fit.at.len() - numbers, numbers).into_owned(),
        })
    }

    /// Whether it is of this member of a family.
    fn is_of(&self, effect: &dyn Effect) -> bool {
        self.name == effect.name()
            && self.scans == effect.scans()
            && self.own.len() == effect.parameters().len()
    }

    /// The same beside the effects of a model.
    fn beside(&self, state: &State) -> DVector<f64> {
        let others = state.fit.at.iter().skip(self.laws.len());
        let all = self.laws.iter().chain(others).chain(&self.own);
        DVector::from_iterator(state.fit.at.len() + self.own.len(), all.copied())
    }
}

/// Where a fit begins.
#[derive(Clone)]
struct Start {
    /// Gain in ln likelihood that is promised or found there.
    worth: f64,
    at: DVector<f64>,
}

/// Searches for one more effect.
#[derive(Clone, Copy)]
pub(super) struct Search<'p> {
    pub scorer: Scorer<'p>,
    /// A sample of the shots, for a first view.
    pub sample: &'p Sample,
    /// Receives a few words about each step.
    pub notify: &'p (dyn Fn(&str) + Sync),
}

impl<'p> Search<'p> {
    /// Every effect that the model does not have yet, best first. The best few are fitted to all shots, the
    /// rest to a sample.
    pub fn trials<'a>(
        &self,
        state: &State<'a>,
        effects: &[&'a dyn Effect],
        round: usize,
        largest: Largest,
        found: &[Found],
    ) -> Vec<Trial<'a>> {
        (self.notify)(&format!("round {round}: screening {} effects", effects.len()));
        let screen = self.screen(state);
        let absent: Vec<_> = effects
            .iter()
            .filter(|effect| !state.space.has(effect.name(), effect.scans()))
            .collect();
        let mut trials: Vec<Trial> = absent
            .into_par_iter()
            .filter_map(|effect| self.promise(state, &screen, *effect, round, found))
            .collect();
        sort(&mut trials);
        self.scout_promising(state, &screen, &mut trials, round);
        sort(&mut trials);
        // Effects on the scatter need the smaller gain.
        let shots = self.scorer.problem.independent_shots();
        let hopeless = SHARE_OF_HOPE * largest.least_gain(true, shots);
        self.refit_shortlist(state, &mut trials, round, hopeless);
        sort(&mut trials);
        if let Some((first, others)) = trials.split_first_mut() {
            others.iter_mut().filter(|other| other.may_catch_up_with(first)).for_each(|other| {
                self.continue_fit(state, other, hopeless);
            });
            self.continue_fit(state, first, hopeless);
        }
        sort(&mut trials);
        trials
    }

    /// One effect, fitted to all shots whatever it promises.
    pub fn trial<'a>(&self, state: &State<'a>, effect: &'a dyn Effect) -> Option<Trial<'a>> {
        let screen = self.screen(state);
        let mut trial = self.promise(state, &screen, effect, 0, &[])?;
        self.scout(state, &screen, &mut trial);
        self.refit(state, &mut trial);
        Some(trial)
    }

    /// The sample as seen by a model.
    fn screen(&self, state: &State) -> Screen<'p> {
        let problem = self.sample.problem(&self.scorer.problem);
        Screen::new(problem, &state.space, &state.fit.at)
    }

    /// Fits those trials to the sample that promise enough.
    fn scout_promising(&self, state: &State, screen: &Screen, trials: &mut [Trial], round: usize) {
        let mut best = 0.25 * self.scorer.settings.least_gain_of(1, 1) / SHARE_TO_SCOUT;
        // Motions that have found nothing, by name and scans.
        let mut at_rest = Vec::new();
        for trial in trials {
            if at_rest.contains(&trial.key()) {
                trial.candidate.gain = 0.0;
                continue;
            }
            let is_far_and_cheap = trial.has_far_start
                && trial.candidate.numbers <= MOST_NUMBERS_FAR
                && !trial.effect.moves();
            if trial.candidate.gain >= SHARE_TO_SCOUT * best || is_far_and_cheap {
                (self.notify)(&format!("round {round}: trying {}", trial.effect.name()));
                self.scout(state, screen, trial);
                best = best.max(trial.candidate.gain);
                // Of a motion the simplest members show something, and flexible ones take long.
                let least =
                    self.scorer.settings.least_gain_of(trial.candidate.numbers, trial.tried);
                if trial.effect.moves() && trial.candidate.gain < SHARE_OF_LEAST * least {
                    at_rest.push(trial.key());
                }
            }
        }
    }

    /// Fits the best few trials to all shots. They are compared with what the refits keep: a sample may promise what
    /// all shots do not.
    fn refit_shortlist(&self, state: &State, trials: &mut [Trial], round: usize, hopeless: f64) {
        let settings = self.scorer.settings;
        let mut best = SHARE_OF_LEAST * settings.least_gain_of(1, 1) / SHARE_OF_BEST;
        let mut kept: Vec<(&str, Vec<u16>)> = Vec::new();
        for trial in trials {
            let promised = trial.candidate.gain;
            let is_full = kept.len() == SHORTLIST && !kept.contains(&trial.key());
            let least = settings.least_gain_of(trial.candidate.numbers, trial.tried);
            let of_alarms = self.scorer.gain_of_alarms(state, &trial.space, &trial.fit.at);
            let is_behind = is_full || promised < hopeless.max(SHARE_OF_BEST * best);
            if promised < SHARE_OF_LEAST * least
                || is_behind && !is_shown_by_alarms(of_alarms, least)
            {
                continue;
            }
            (self.notify)(&format!("round {round}: refitting with {}", trial.effect.name()));
            self.refit(state, trial);
            // What gains less than its parameters need is no measure for others.
            if trial.candidate.gain >= least {
                best = best.max(trial.candidate.gain);
            }
            if trial.candidate.gain >= SHARE_OF_PROMISE * promised && !kept.contains(&trial.key()) {
                kept.push(trial.key());
            }
        }
    }

    /// An effect at the start that promises most.
    fn promise<'a>(
        &self,
        state: &State<'a>,
        screen: &Screen,
        effect: &'a dyn Effect,
        round: usize,
        found: &[Found],
    ) -> Option<Trial<'a>> {
        let space = state.space.with(effect);
        let problem = &self.scorer.problem;
        let values = problem.starts(effect);
        let mut starts = self.promising_starts(state, screen, &space, effect, &values);
        for start in &mut starts {
            self.improve(screen, &space, effect, start);
            if effect.moves() {
                self.place(screen, &space, effect, start);
            }
        }
        // A start at which the effect is absent promises nothing; it is tried all the same.
        let is_absent = values.len() == 1 && starts.iter().all(|start| start.worth == 0.0);
        // Without an effect that bends the whole curve, such as a ceiling, the scattering models may be far from those
        // that fit best with it. Beside other effects they are near, but one on the scatter may gain only where they
        // follow it. Laws far from those stored may stand for an effect that is still missing.
        let is_first = state.space.effects.is_empty() && !is_absent;
        let most = starts.first().map_or(0.0, |start| start.worth);
        let least = self.scorer.settings.least_gain_of(effect.parameters().len(), values.len());
        let mut has_far_start = false;
        let is_far_off = state.space.off_the_stored(&state.fit.at) > FAR_OFF;
        let far = if is_first || screen.leaves_laws_open || is_far_off {
            let declared = state.space.restarted(&state.fit.at);
            likeliest(screen, &space, &joined(&declared, effect, &values))
                .and_then(|best| likeliest(screen, &space, &of_all_strengths(effect, &best)))
        } else if most < least && !is_absent {
            likeliest_beside_laws(screen, &space, effect, joined(&state.fit.at, effect, &values))
        } else {
            None
        };
        if let Some(at) = far {
            // Followed whatever it promises: a promise is about a step from the fitted scattering models.
            has_far_start = true;
            starts.push(Start { worth: most, at });
        }
        if let Some(found) = found.iter().find(|one| one.is_of(effect)) {
            has_far_start = true;
            starts.push(Start { worth: most, at: found.beside(state) });
        }
        let Start { worth, at } = starts.first()?.clone();
        let gain = if is_absent { f64::INFINITY } else { worth };
        let candidate = Candidate::sampled(round, effect, gain);
        let fit = Fit { at, ln_likelihood: f64::NEG_INFINITY, converged: false, is_stuck: false };
        let (tried, size) = (values.len(), Size::default());
        Some(Trial { effect, space, starts, has_far_start, tried, fit, size, candidate })
    }

    /// The starts of different shapes that promise most, best first.
    fn promising_starts(
        &self,
        state: &State,
        screen: &Screen,
        space: &Space,
        effect: &dyn Effect,
        values: &[Vec<f64>],
    ) -> Vec<Start> {
        let mut starts: Vec<Start> = values
            .iter()
            .map(|values| {
                let at = Space::joined(&state.fit.at, effect, values);
                Start { worth: self.sample.weight * screen.promise(space, &at), at }
            })
            .collect();
        starts.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        // Starts that differ by their strength alone lead to the same place.
        let mut shapes: Vec<Vec<f64>> = Vec::new();
        starts.retain(|start| {
            let shape: Vec<f64> = start.at.iter().skip(state.fit.at.len() + 1).copied().collect();
            let is_new = !shapes.contains(&shape);
            shapes.push(shape);
            is_new
        });
        starts.truncate(STARTS);
        starts
    }

    /// Moves a start to where it is worth most: the shape of the effect, such as a place, by the promise, and
    /// then the strength by the gain.
    fn improve(&self, screen: &Screen, space: &Space, effect: &dyn Effect, start: &mut Start) {
        let weight = self.sample.weight;
        if start.worth > 0.0 {
            climb(effect, start, SHAPE_STEPS.len(), |at| weight * screen.promise(space, at));
        }
        let gain = |at: &DVector<f64>| weight * screen.gain(space, at);
        let mut strengths =
            of_all_strengths(effect, &start.at).map(|at| Start { worth: gain(&at), at });
        strengths.sort_by(|a, b| b.worth.total_cmp(&a.worth));
        // Far from the data a promise may be due to other effects, and no strength keeps it.
        if strengths[0].worth < SHARE_OF_WORD * start.worth {
            strengths.iter_mut().for_each(|start| climb(effect, start, 1, gain));
        }
        if let Some(best) = strengths.into_iter().max_by(|a, b| a.worth.total_cmp(&b.worth)) {
            start.at = best.at;
        }
    }

    /// Moves a start to where the ranges place the target, if that is more likely.
    fn place(&self, screen: &Screen, space: &Space, effect: &dyn Effect, start: &mut Start) {
        let problem = &self.scorer.problem;
        let placed = WITHIN.map(|steps| place_by_ranges(problem, space, effect, &start.at, steps));
        let all = placed
            .into_iter()
            .chain([start.at.clone()])
            .map(|at| (screen.problem.ln_likelihood(space, &at), at));
        if let Some(best) = all.max_by(|a, b| a.0.total_cmp(&b.0)) {
            start.at = best.1;
        }
    }

    /// Fits a trial to the sample.
    fn scout(&self, state: &State, screen: &Screen, trial: &mut Trial) {
        let space = &trial.space;
        let here = screen.problem.ln_likelihood(&state.space, &state.fit.at);
        let held = state.space.costly(&state.fit.at);
        let most = trial.starts.first().map_or(0.0, |start| start.worth);
        // Lobes in each other's place may be as likely as those stored.
        let worth = |fit: &Fit| self.sample.weight * fit.ln_likelihood - space.against(&fit.at);
        let best = trial
            .starts
            .iter()
            .filter(|start| start.worth >= SHARE_OF_START * most)
            .map(|start| screen.problem.fit(space, &start.at, &held, &SCOUT))
            .filter(|fit| fit.ln_likelihood.is_finite())
            .max_by(|a, b| worth(a).total_cmp(&worth(b)));
        let Some(mut best) = best else { return };
        // A fit that must move the scattering models far takes many steps.
        for _ in 0..LONGER {
            if best.converged || is_at_rest(&best, trial.effect) {
                break;
            }
            best = screen.problem.fit(space, &best.at, &held, &SCOUT);
        }
        trial.candidate.gain = self.sample.weight * (best.ln_likelihood - here);
        self.set_fit(state, trial, best);
    }

    /// Fits a trial to all shots.
    pub fn refit(&self, state: &State, trial: &mut Trial) {
        let problem = &self.scorer.problem;
        let held = state.space.costly(&state.fit.at);
        // A fit to the sample may be worse for all shots than the effect's absence.
        let absent: Vec<f64> = trial.effect.parameters().iter().map(|known| known.absent).collect();
        let without = Space::joined(&state.fit.at, trial.effect, &absent);
        let [ln_with, ln_without] =
            [&trial.fit.at, &without].map(|at| problem.ln_likelihood(&trial.space, at));
        let start = if ln_with < ln_without { without } else { trial.fit.at.clone() };
        let fit = problem.fit(&trial.space, &start, &held, &SEARCH);
        trial.candidate.gain = fit.ln_likelihood - state.fit.ln_likelihood;
        trial.candidate.sampled = false;
        self.set_fit(state, trial, fit);
    }

    /// Takes a fit over into a trial.
    fn set_fit(&self, state: &State, trial: &mut Trial, fit: Fit) {
        trial.size = self.scorer.size(state, &trial.space, &fit.at);
        trial.candidate.size_db = trial.size.larger_db();
        trial.candidate.converged = fit.converged;
        trial.fit = fit;
    }

    /// Continues the fit of an effect while it gains: a fit that moves facets under the rays may stop
    /// before a jump of ln p.
    fn continue_fit(&self, state: &State, trial: &mut Trial, hopeless: f64) {
        for _ in 0..LONGER {
            let Candidate { gain, sampled, converged, numbers, .. } = trial.candidate;
            let least = self.scorer.settings.least_gain_of(numbers, trial.tried).max(hopeless);
            if sampled || converged || gain < least || is_at_rest(&trial.fit, trial.effect) {
                return;
            }
            if trial.effect.moves()
                && let Some(at) = self.scorer.problem.along_axes(&trial.space, &trial.fit.at)
            {
                trial.fit.at = at;
            }
            self.refit(state, trial);
            if trial.candidate.gain < gain + WORTH_MORE {
                return;
            }
        }
    }
}

/// Moves the shape of an effect, parameter by parameter, to where a start is worth more.
fn climb(
    effect: &dyn Effect,
    start: &mut Start,
    rounds: usize,
    worth_of: impl Fn(&DVector<f64>) -> f64,
) {
    let first = start.at.len().saturating_sub(effect.parameters().len());
    let shapes: Vec<(usize, &EffectParameter)> = effect
        .parameters()
        .iter()
        .enumerate()
        .skip(1)
        .filter(|(_, known)| known.absent != known.max)
        .collect();
    for (index, known) in shapes.repeat(rounds) {
        for steps in SHAPE_STEPS.iter().flat_map(|s| [*s, -*s]) {
            let mut at = start.at.clone();
            let place = &mut at[first + index];
            *place = (*place + steps).clamp(known.min / known.step, known.max / known.step);
            let worth = worth_of(&at);
            if worth > start.worth {
                *start = Start { worth, at };
            }
        }
    }
}

/// Whether a further search would repeat the same steps. A target that moves is searched by wider steps first.
fn is_at_rest(fit: &Fit, effect: &dyn Effect) -> bool {
    fit.is_stuck && !effect.moves()
}

/// The starts of an effect, with the model so far at a point.
fn joined(at: &DVector<f64>, effect: &dyn Effect, values: &[Vec<f64>]) -> Vec<DVector<f64>> {
    values.iter().map(|values| Space::joined(at, effect, values)).collect()
}

/// The likeliest of some starts.
fn likeliest(screen: &Screen, space: &Space, starts: &[DVector<f64>]) -> Option<DVector<f64>> {
    let gains = starts.iter().map(|start| (screen.gain(space, start), start));
    gains.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, at)| at.clone())
}

/// The likeliest start where the model so far follows it: an error of the angle fits none whose lobes are as wide already as
/// both together.
fn likeliest_beside_laws(
    screen: &Screen,
    space: &Space,
    effect: &dyn Effect,
    starts: Vec<DVector<f64>>,
) -> Option<DVector<f64>> {
    let mut starts: Vec<(f64, DVector<f64>)> =
        starts.into_iter().map(|start| (screen.gain(space, &start), start)).collect();
    starts.sort_by(|a, b| b.0.total_cmp(&a.0));
    starts.truncate(FOLLOWED_BY_LAWS);
    let fits = starts.iter().map(|(_, start)| {
        let held: Vec<usize> = (start.len() - effect.parameters().len()..start.len()).collect();
        screen.problem.fit(space, start, &held, &FOLLOW)
    });
    fits.max_by(|a, b| a.ln_likelihood.total_cmp(&b.ln_likelihood)).map(|fit| fit.at)
}

/// A start with its effect in each of [`STRENGTHS`].
fn of_all_strengths(effect: &dyn Effect, start: &DVector<f64>) -> [DVector<f64>; STRENGTHS.len()] {
    let first = start.len() - effect.parameters().len();
    STRENGTHS.map(|scale| {
        let mut at = start.clone();
        if let Some(known) = effect.parameters().first() {
            let value = known.absent + scale * (start[first] * known.step - known.absent);
            at[first] = value.clamp(known.min, known.max) / known.step;
        }
        at
    })
}

/// Sorts trials by their gain, best first.
fn sort(trials: &mut [Trial]) {
    trials.sort_by(|a, b| b.candidate.gain.total_cmp(&a.candidate.gain));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::Diagnosis;
    use crate::diagnose::tests::{BOWL, DRIFT, searched};

    /// A drift at its starts.
    fn trial<'a>(search: &Search, state: &State<'a>) -> Trial<'a> {
        search.promise(state, &search.screen(state), &DRIFT, 1, &[]).unwrap()
    }

    #[test]
    fn the_first_effect_is_also_searched_from_the_laws_as_declared() {
        let settings = Diagnosis { seed: 5, ..Diagnosis::default() };
        searched((&BOWL, vec![-6.0]), &settings, &|search, space| {
            let (declared, base) = (space.start(), search.scorer.base(search.sample, space));
            let first = trial(search, &base);
            let laws = base.space.base_len() - 1;
            let far = &first.starts.last().unwrap().at;
            assert!(first.has_far_start);
            assert_eq!(far.rows(0, laws), declared.rows(0, laws));
            assert!((far.rows(0, laws) - base.fit.at.rows(0, laws)).norm() > 0.05);
            // It is at least as likely as the starts of the effect.
            let screen = search.screen(&base);
            for value in [0.3, -0.3] {
                let start = Space::joined(&base.space.restarted(&base.fit.at), &DRIFT, &[value]);
                let gains = [far, &start].map(|at| screen.gain(&first.space, at));
                assert!(gains[0] >= gains[1] - 1e-9, "{gains:?}");
            }
            // Beside an effect only laws that the data leave open are; others stay where they are, and an effect that promises
            // nothing there is followed from where they fit it best.
            let with = base.space.with(&BOWL);
            let start = Space::joined(&base.fit.at, &BOWL, &[-6.0]);
            let fit = search.scorer.problem.fit(&with, &start, &[], &SEARCH);
            let with = search.scorer.state(with, fit);
            assert!(!search.screen(&with).leaves_laws_open);
            let beside = trial(search, &with);
            assert!(beside.has_far_start && beside.candidate.gain < settings.least_gain);
            let far = &beside.starts.last().unwrap().at;
            assert!((far.rows(0, laws) - with.fit.at.rows(0, laws)).norm() < 0.05);
        });
    }

    #[test]
    fn where_an_effect_was_found_is_a_start_beside_another() {
        let settings = Diagnosis { seed: 5, ..Diagnosis::default() };
        searched((&BOWL, vec![-6.0]), &settings, &|search, space| {
            let base = search.scorer.base(search.sample, space);
            let mut first = search.promise(&base, &search.screen(&base), &BOWL, 1, &[]).unwrap();
            search.refit(&base, &mut first);
            let found = Found::of(&first, &settings).unwrap();
            // Beside another effect, with laws that have gone elsewhere.
            let with = base.space.with(&DRIFT);
            let mut at = Space::joined(&base.fit.at, &DRIFT, &[0.3]);
            at[0] += 0.5;
            let fit = Fit { at, ..base.fit.clone() };
            let state = State { space: with, fit, held_out: base.held_out.clone() };
            let start = found.beside(&state);
            let laws = base.space.base_len();
            assert_eq!(start.rows(0, laws), first.fit.at.rows(0, laws));
            assert_eq!(start[laws], state.fit.at[laws]);
            assert_eq!(start[laws + 1], first.fit.at[laws]);
            let second =
                search.promise(&state, &search.screen(&state), &BOWL, 2, &[found]).unwrap();
            assert_eq!(second.starts.last().unwrap().at, start);
            // Nothing is kept of an effect that gains no more than chance.
            let mut drift = trial(search, &base);
            drift.candidate.gain = 0.0;
            assert!(Found::of(&drift, &settings).is_none());
        });
    }
}
