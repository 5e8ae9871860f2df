//! One round's fits of every effect that is not there yet, from what a sample of the shots promises to
//! a fit of all shots for the best few.

use nalgebra::DVector;
use rayon::prelude::*;

use super::ranges;
use super::refit::{Fitted, Space, sum};
use super::screen::Screen;
use super::select::{Candidate, SCOUT, SEARCH, Selection, State, larger};
use super::support::Largest;
use crate::effects::{Effect, EffectParameter};

/// Starts of an effect that are followed.
const STARTS: usize = 2;
/// How often a fit to the sample is continued that has not settled.
const LONGER: usize = 3;
/// Gain in ln likelihood for which it is continued once more.
const WORTH_MORE: f64 = 3.0;
/// How far the shape of a start is moved, in felt steps.
const SHAPE_STEPS: [f64; 3] = [4.0, 2.0, 1.0];
/// How far from a start the ranges may put the target where they tell nothing, in felt steps.
const WITHIN: [f64; 2] = [1.0, 10.0];
/// Strengths of a start that are tried.
const STRENGTHS: [f64; 6] = [0.3, 1.0, 3.0, 7.0, 12.0, 20.0];
/// Of the starts that are followed none promises less than this share of what the best does.
const SHARE_OF_START: f64 = 0.7;
/// One that gains less than this share of its promise is moved by what it gains.
const SHARE_OF_WORD: f64 = 0.3;
/// Effects that promise less than this share of the best are not fitted at all.
const SHARE_TO_SCOUT: f64 = 0.05;
/// Effects of each round that are fitted to all shots and predict held-out patches: at most so many,
/// and none that gains less than this share of the best.
const SHORTLIST: usize = 5;
/// A refit that keeps less of its promise does not count among them.
const SHARE_OF_PROMISE: f64 = 0.3;
const SHARE_OF_BEST: f64 = 0.3;
/// One that gains less than this share of what it must beside the effects that are there is not searched for
/// further.
const SHARE_OF_HOPE: f64 = 0.5;

/// A fit of one more effect.
pub(super) struct Trial<'a> {
    pub effect: &'a dyn Effect,
    pub space: Space<'a>,
    /// What they promise, and where they are.
    starts: Vec<(f64, DVector<f64>)>,
    /// How many starts there were.
    pub tried: usize,
    pub fitted: Fitted,
    /// What it changes of the means and of the spread, dB.
    pub sizes_db: [f64; 2],
    pub candidate: Candidate,
}

impl Selection<'_> {
    /// Every effect that is not there yet, best first. Those worth it are fitted to all shots, the
    /// rest to a sample.
    pub fn trials<'a>(
        &self,
        state: &State<'a>,
        effects: &[&'a dyn Effect],
        round: usize,
        largest: Largest,
    ) -> Vec<Trial<'a>> {
        let absent = |effect: &&&dyn Effect| !state.space.has(effect.name());
        (self.hear)(&format!("round {round}: screening {} effects", effects.len()));
        let sample = self.sample;
        let screen = Screen::new(sample.problem(&self.problem), &state.space, &state.fitted.at);
        let promised =
            |effect: &&'a dyn Effect| self.promised(state, &screen, sample.weight, *effect, round);
        let absent: Vec<_> = effects.iter().filter(absent).collect();
        let mut trials: Vec<Trial> = absent.into_par_iter().filter_map(promised).collect();
        sort(&mut trials);
        let mut best = 0.25 * self.settings.least_gain_of(1, 1) / SHARE_TO_SCOUT;
        for trial in &mut trials {
            if trial.candidate.gain >= SHARE_TO_SCOUT * best {
                (self.hear)(&format!("round {round}: trying {}", trial.effect.name()));
                self.scout(state, &screen, sample.weight, trial);
                best = best.max(trial.candidate.gain);
            }
        }
        sort(&mut trials);
        // Measured by what the refits keep: a sample may promise what all shots do not.
        let (mut best, mut kept) = (0.5 * self.settings.least_gain_of(1, 1) / SHARE_OF_BEST, 0);
        // An effect of the scatter needs the lesser gain.
        let hopeless = SHARE_OF_HOPE * largest.least_gain(true, self.problem.shots.len());
        for trial in &mut trials {
            let promised = trial.candidate.gain;
            if kept == SHORTLIST || promised < hopeless.max(SHARE_OF_BEST * best) {
                break;
            }
            (self.hear)(&format!("round {round}: refitting with {}", trial.effect.name()));
            self.refit(state, trial);
            best = best.max(trial.candidate.gain);
            kept += usize::from(trial.candidate.gain >= SHARE_OF_PROMISE * promised);
        }
        sort(&mut trials);
        if let Some(first) = trials.first_mut() {
            self.continued(state, first, hopeless);
            sort(&mut trials);
        }
        trials
    }

    /// One effect, fitted to all shots whatever it promises.
    pub fn tried<'a>(&self, state: &State<'a>, effect: &'a dyn Effect) -> Option<Trial<'a>> {
        let problem = self.sample.problem(&self.problem);
        let screen = Screen::new(problem, &state.space, &state.fitted.at);
        let mut trial = self.promised(state, &screen, self.sample.weight, effect, 0)?;
        self.scout(state, &screen, self.sample.weight, &mut trial);
        self.refit(state, &mut trial);
        Some(trial)
    }

    /// An effect at the start that promises most.
    fn promised<'a>(
        &self,
        state: &State<'a>,
        screen: &Screen,
        weight: f64,
        effect: &'a dyn Effect,
        round: usize,
    ) -> Option<Trial<'a>> {
        let space = state.space.with(effect);
        let values = effect.starts(self.problem.stage, self.problem.shots);
        let mut starts: Vec<(f64, DVector<f64>)> = values
            .iter()
            .map(|values| {
                let start = Space::joined(&state.fitted.at, effect, values);
                (weight * screen.promise(&space, &start), start)
            })
            .collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        let tried = starts.len();
        // Starts that differ by their strength alone lead to the same place.
        let mut shapes: Vec<Vec<f64>> = Vec::new();
        starts.retain(|(_, start)| {
            let shape: Vec<f64> = start.iter().skip(state.fitted.at.len() + 1).copied().collect();
            let is_new = !shapes.contains(&shape);
            shapes.push(shape);
            is_new
        });
        starts.truncate(STARTS);
        starts.iter_mut().for_each(|start| self.placed(screen, &space, effect, start));
        if effect.moves() {
            starts.iter_mut().for_each(|(_, start)| self.ranged(screen, &space, effect, start));
        }
        // A start at which the effect is absent promises nothing, and is tried all the same.
        let is_absent = tried == 1 && starts.iter().all(|start| start.0 == 0.0);
        // Without an effect that bends the whole curve, such as a ceiling, the laws may have come far from any that
        // go with it.
        let is_first = state.space.effects.is_empty() && !is_absent;
        if (is_first || screen.leaves_laws_open)
            && let Some(start) = from_declared_laws(screen, state, &space, effect, &values)
        {
            // Followed whatever it promises: the promise is of a step from the fitted laws.
            starts.push((starts.first().map_or(0.0, |start| start.0), start));
        }
        let (gain, at) = starts.first()?.clone();
        let gain = if is_absent { f64::INFINITY } else { gain };
        let candidate = Candidate {
            round,
            name: effect.name(),
            numbers: effect.parameters().len(),
            gain,
            sampled: true,
            placebo_gain: None,
            held_out: None,
            size_db: 0.0,
            converged: false,
            accepted: false,
        };
        let fitted =
            Fitted { at, ln_likelihood: f64::NEG_INFINITY, converged: false, is_stuck: false };
        Some(Trial { effect, space, starts, tried, fitted, sizes_db: [0.0; 2], candidate })
    }

    /// Moves a start to where it is worth most: what only shapes the effect, such as a place, by what it promises, and
    /// then its strength by what it gains.
    fn placed(
        &self,
        screen: &Screen,
        space: &Space,
        effect: &dyn Effect,
        start: &mut (f64, DVector<f64>),
    ) {
        let weight = self.sample.weight;
        if start.0 > 0.0 {
            climb(effect, start, SHAPE_STEPS.len(), |at| weight * screen.promise(space, at));
        }
        let Some(knob) = effect.parameters().first() else { return };
        let (first, promise) = (start.1.len() - effect.parameters().len(), start.0);
        let gain = |at: &DVector<f64>| weight * screen.gain(space, at);
        let scaled = |scale: f64| {
            let mut scaled = start.1.clone();
            let value = knob.absent + scale * (start.1[first] * knob.step - knob.absent);
            scaled[first] = value.clamp(knob.min, knob.max) / knob.step;
            (gain(&scaled), scaled)
        };
        let mut strengths = STRENGTHS.map(scaled).to_vec();
        strengths.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Far from the data a promise takes in what is no part of it, and none of the strengths keeps it.
        if strengths.first().is_some_and(|best| best.0 < SHARE_OF_WORD * promise) {
            strengths.iter_mut().for_each(|start| climb(effect, start, 1, gain));
        }
        if let Some(best) = strengths.into_iter().max_by(|a, b| a.0.total_cmp(&b.0)) {
            start.1 = best.1;
        }
    }

    /// Moves a start to where the ranges put the target, if that is likelier.
    fn ranged(
        &self,
        screen: &Screen,
        space: &Space,
        effect: &dyn Effect,
        start: &mut DVector<f64>,
    ) {
        let ln_p = |at: &DVector<f64>| sum(&screen.problem.terms(space, at));
        let there = WITHIN.map(|steps| ranges::placed(&self.problem, space, effect, start, steps));
        let all = there.into_iter().chain([start.clone()]).map(|at| (ln_p(&at), at));
        if let Some(best) = all.max_by(|a, b| a.0.total_cmp(&b.0)) {
            *start = best.1;
        }
    }

    /// Fits a trial to the sample.
    fn scout(&self, state: &State, screen: &Screen, weight: f64, trial: &mut Trial) {
        let space = &trial.space;
        let here = sum(&screen.problem.terms(&state.space, &state.fitted.at));
        let most = trial.starts.first().map_or(0.0, |start| start.0);
        let useful = trial.starts.iter().filter(|start| start.0 >= SHARE_OF_START * most);
        let held = state.space.costly(&state.fitted.at);
        let scouts = useful.map(|(_, start)| screen.problem.fit(space, start, &held, &SCOUT));
        let best = scouts
            .filter(|fit| fit.ln_likelihood.is_finite())
            .max_by(|a, b| a.ln_likelihood.total_cmp(&b.ln_likelihood));
        if let Some(mut best) = best {
            // One that must carry the laws far away with it comes slowly.
            for _ in 0..LONGER {
                if best.converged || is_at_rest(&best, trial.effect) {
                    break;
                }
                best = screen.problem.fit(space, &best.at, &held, &SCOUT);
            }
            trial.candidate.gain = weight * (best.ln_likelihood - here);
            trial.candidate.converged = best.converged;
            trial.sizes_db = self.sizes_db(state, space, &best.at);
            trial.fitted = best;
            trial.candidate.size_db = larger(trial.sizes_db);
        }
    }

    /// Fits a trial to all shots.
    fn refit(&self, state: &State, trial: &mut Trial) {
        let held = state.space.costly(&state.fitted.at);
        let ln_p = |at: &DVector<f64>| sum(&self.problem.terms(&trial.space, at));
        // What suits the sample may suit the whole worse than no effect at all.
        let absent: Vec<f64> = trial.effect.parameters().iter().map(|knob| knob.absent).collect();
        let without = Space::joined(&state.fitted.at, trial.effect, &absent);
        let is_worse = ln_p(&trial.fitted.at) < ln_p(&without);
        let start = if is_worse { without } else { trial.fitted.at.clone() };
        trial.fitted = self.problem.fit(&trial.space, &start, &held, &SEARCH);
        trial.candidate.gain = trial.fitted.ln_likelihood - state.fitted.ln_likelihood;
        trial.candidate.sampled = false;
        trial.sizes_db = self.sizes_db(state, &trial.space, &trial.fitted.at);
        trial.candidate.size_db = larger(trial.sizes_db);
        trial.candidate.converged = trial.fitted.converged;
    }

    /// Goes on with the fit of the best effect while it gains: one that moves facets under the rays may rest
    /// before a step of ln p.
    fn continued(&self, state: &State, trial: &mut Trial, hopeless: f64) {
        for _ in 0..LONGER {
            let Candidate { gain, sampled, converged, numbers, .. } = trial.candidate;
            let least = self.settings.least_gain_of(numbers, trial.tried).max(hopeless);
            if sampled || converged || gain < least {
                return;
            }
            if is_at_rest(&trial.fitted, trial.effect) {
                return;
            }
            if trial.effect.moves()
                && let Some(at) = self.problem.along_axes(&trial.space, &trial.fitted.at)
            {
                trial.fitted.at = at;
            }
            self.refit(state, trial);
            if trial.candidate.gain < gain + WORTH_MORE {
                return;
            }
        }
    }
}

/// Moves what only shapes an effect for so many rounds to where a start is worth more.
fn climb(
    effect: &dyn Effect,
    (worth, start): &mut (f64, DVector<f64>),
    rounds: usize,
    worth_of: impl Fn(&DVector<f64>) -> f64,
) {
    let first = start.len().saturating_sub(effect.parameters().len());
    let shapes = effect.parameters().iter().enumerate().skip(1);
    let is_shape = |(_, knob): &(usize, &EffectParameter)| knob.absent != knob.max;
    for (index, knob) in shapes.filter(is_shape).collect::<Vec<_>>().repeat(rounds) {
        for steps in SHAPE_STEPS.iter().flat_map(|s| [*s, -*s]) {
            let mut moved = start.clone();
            let place = &mut moved[first + index];
            *place = (*place + steps).clamp(knob.min / knob.step, knob.max / knob.step);
            let there = worth_of(&moved);
            if there > *worth {
                (*worth, *start) = (there, moved);
            }
        }
    }
}

/// Whether to search on would be to try the same steps again; a target that moves is searched by wider steps first.
fn is_at_rest(fitted: &Fitted, effect: &dyn Effect) -> bool {
    fitted.is_stuck && !effect.moves()
}

/// The best start with the laws as the scene declares them.
fn from_declared_laws(
    screen: &Screen,
    state: &State,
    space: &Space,
    effect: &dyn Effect,
    values: &[Vec<f64>],
) -> Option<DVector<f64>> {
    let declared = state.space.restarted(&state.fitted.at);
    let starts = values.iter().map(|values| Space::joined(&declared, effect, values));
    let gains = starts.map(|start| (screen.gain(space, &start), start));
    gains.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, start)| start)
}

fn sort(trials: &mut [Trial]) {
    trials.sort_by(|a, b| b.candidate.gain.total_cmp(&a.candidate.gain));
}
