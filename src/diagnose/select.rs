//! Which effect a model lacks: all are tried, and one is believed if it predicts what it has not seen.
//!
//! Every effect is fitted together with the base. The best few by ln likelihood predict held-out
//! patches from fits that never saw them. One is accepted when that gain is more than two standard
//! errors over patches, its gain in the fit beats that of placebos with as many numbers and a stated
//! least, and it changes the data by a stated least size.

use nalgebra::DVector;
use serde::Serialize;

use super::folds::Folds;
use super::placebo::Placebo;
use super::refit::{Fitted, Problem, Space};
use super::residual::speckle_sd_db;
use super::score::{DB, Scored, scored};
use super::{Diagnosis, Evidence};
use crate::effects::Effect;
use crate::fit::minimise::Minimise;

/// Steps of a fit, and of one that only looks whether a start is worth more.
const SEARCH: Minimise = Minimise { iterations: 40, tolerance: 1e-3 };
const SCOUT: Minimise = Minimise { iterations: 6, tolerance: 0.1 };
/// Effects of each round that predict held-out patches.
const SHORTLIST: usize = 3;
/// Placebos of each comparison.
const PLACEBOS: u64 = 3;

/// One effect of one round.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Candidate {
    /// Round, from 1.
    pub round: usize,
    /// The effect.
    pub name: &'static str,
    /// Its numbers.
    pub numbers: usize,
    /// Gain in ln likelihood over the model so far.
    pub gain: f64,
    /// Largest gain of a placebo with as many numbers, at most six; only for effects on the short list.
    pub placebo_gain: Option<f64>,
    /// Gain in ln p of held-out patches and its standard error; only for effects on the short list.
    pub held_out: Option<[f64; 2]>,
    /// What it changes: root mean square of mean powers, or of the spread, dB.
    pub size_db: f64,
    /// Whether the fit converged.
    pub converged: bool,
    /// Whether it was added.
    pub accepted: bool,
}

/// A model, fitted to all looks and by folds.
pub(super) struct State<'a> {
    pub space: Space<'a>,
    pub fitted: Fitted,
    /// Every look, predicted by a fit without its fold.
    pub held_out: Vec<Scored>,
}

/// An effect that was added.
pub(super) struct Added {
    pub class: Vec<&'static str>,
    pub evidence: Evidence,
}

/// A fit of one more effect.
struct Trial<'a> {
    effect: &'a dyn Effect,
    space: Space<'a>,
    fitted: Fitted,
    candidate: Candidate,
}

/// All that the selection needs.
pub(super) struct Selection<'p> {
    pub problem: Problem<'p>,
    pub folds: &'p Folds,
    pub settings: &'p Diagnosis,
}

impl Selection<'_> {
    /// The model without effects.
    pub fn base<'a>(&self, space: Space<'a>) -> State<'a> {
        let fitted = self.problem.fit(&space, &space.start(), &self.all(), 0, &SEARCH);
        let held_out = self.held_out(&space, &fitted.at);
        State { space, fitted, held_out }
    }

    /// Adds effects until none passes. The ranking of every round, and what was added.
    pub fn run<'a>(
        &self,
        mut state: State<'a>,
        effects: &[&'a dyn Effect],
    ) -> (State<'a>, Vec<Candidate>, Vec<Added>) {
        let (mut ranking, mut added) = (Vec::new(), Vec::new());
        for round in 1..=self.settings.most_effects + 1 {
            let mut trials = self.trials(&state, effects, round);
            let chosen = match round <= self.settings.most_effects {
                true => self.chosen(&state, &mut trials),
                false => None,
            };
            let Some((index, held_out, class)) = chosen else {
                ranking.extend(trials.into_iter().map(|trial| trial.candidate));
                break;
            };
            if let Some(trial) = trials.get_mut(index) {
                trial.candidate.accepted = true;
                let (space, fitted) = (trial.space.clone(), trial.fitted.clone());
                state = State { space, fitted, held_out };
                let Candidate { gain, size_db, .. } = trial.candidate;
                let [held_out_gain, held_out_se] = trial.candidate.held_out.unwrap_or_default();
                let placebo_gain = trial.candidate.placebo_gain.unwrap_or_default();
                let evidence = Evidence { gain, placebo_gain, held_out_gain, held_out_se, size_db };
                added.push(Added { class, evidence });
            }
            ranking.extend(trials.into_iter().map(|trial| trial.candidate));
        }
        (state, ranking, added)
    }

    fn all(&self) -> Vec<bool> {
        vec![true; self.problem.looks.len()]
    }

    /// Every effect that is not there yet, best first.
    fn trials<'a>(
        &self,
        state: &State<'a>,
        effects: &[&'a dyn Effect],
        round: usize,
    ) -> Vec<Trial<'a>> {
        let absent = |effect: &&&dyn Effect| {
            state.space.effects.iter().all(|there| there.name() != effect.name())
        };
        let mut trials: Vec<Trial> = effects
            .iter()
            .filter(absent)
            .filter_map(|effect| self.trial(state, *effect, round))
            .collect();
        trials.sort_by(|a, b| b.candidate.gain.total_cmp(&a.candidate.gain));
        trials
    }

    fn trial<'a>(
        &self,
        state: &State<'a>,
        effect: &'a dyn Effect,
        round: usize,
    ) -> Option<Trial<'a>> {
        let space = state.space.with(effect);
        let fitted = self.best_fit(state, &space, effect)?;
        let candidate = Candidate {
            round,
            name: effect.name(),
            numbers: effect.knobs().len(),
            gain: fitted.ln_likelihood - state.fitted.ln_likelihood,
            placebo_gain: None,
            held_out: None,
            size_db: self.size_db(state, &space, &fitted.at),
            converged: fitted.converged,
            accepted: false,
        };
        Some(Trial { effect, space, fitted, candidate })
    }

    /// From every start a short search with the rest held, from the best of them a full one.
    fn best_fit(&self, state: &State, space: &Space, effect: &dyn Effect) -> Option<Fitted> {
        let (all, held) = (self.all(), state.fitted.at.len());
        let scout = |values: Vec<f64>| {
            let start = Space::joined(&state.fitted.at, effect, &values);
            self.problem.fit(space, &start, &all, held, &SCOUT)
        };
        let starts = effect.starts(self.problem.stage, self.problem.looks);
        let scouts = starts.into_iter().map(scout).filter(|fit| fit.ln_likelihood.is_finite());
        let best = scouts.max_by(|a, b| a.ln_likelihood.total_cmp(&b.ln_likelihood))?;
        Some(self.problem.fit(space, &best.at, &all, 0, &SEARCH))
    }

    /// The effect to add: its place, its held-out scores, and the names that do as well.
    fn chosen(
        &self,
        state: &State,
        trials: &mut [Trial],
    ) -> Option<(usize, Vec<Scored>, Vec<&'static str>)> {
        let mut passed: Vec<(usize, Vec<Scored>, f64)> = Vec::new();
        for (index, trial) in trials.iter_mut().enumerate().take(SHORTLIST) {
            let least = self.settings.least_gain;
            if trial.candidate.gain < least || trial.candidate.size_db < self.settings.least_size_db
            {
                continue;
            }
            let placebo = self.placebo_gain(state, trial.effect.knobs().len());
            let held_out = self.held_out(&trial.space, &trial.fitted.at);
            let [gain, se] = self.difference(&held_out, &state.held_out);
            trial.candidate.placebo_gain = Some(placebo);
            trial.candidate.held_out = Some([gain, se]);
            if gain > self.settings.standard_errors * se && trial.candidate.gain > placebo {
                passed.push((index, held_out, gain));
            }
        }
        let best = passed.iter().max_by(|a, b| a.2.total_cmp(&b.2))?;
        let as_good = |other: &&(usize, Vec<Scored>, f64)| {
            let [worse, se] = self.difference(&best.1, &other.1);
            worse <= se
        };
        let class: Vec<&(usize, Vec<Scored>, f64)> = passed.iter().filter(as_good).collect();
        let numbers = |one: &&&(usize, Vec<Scored>, f64)| trials[one.0].candidate.numbers;
        // Among equals the simplest; of these the likeliest, which stands first.
        let simplest = class.iter().min_by_key(numbers)?;
        let others = class.iter().filter(|one| one.0 != simplest.0);
        let names = others.map(|one| trials[one.0].candidate.name).collect();
        Some((simplest.0, simplest.1.clone(), names))
    }

    /// Sum over all looks of a difference in ln p, and its standard error over patches.
    fn difference(&self, a: &[Scored], b: &[Scored]) -> [f64; 2] {
        let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a.ln_p - b.ln_p).collect();
        self.folds.sum(&differences)
    }

    fn placebo_gain(&self, state: &State, numbers: usize) -> f64 {
        let gain = |draw: u64| {
            let placebo = Placebo::new(numbers, self.settings.seed, draw);
            let mut space = state.space.clone();
            space.effects.push(&placebo);
            let zero = vec![0.0; placebo.knobs().len()];
            let start = Space::joined(&state.fitted.at, &placebo, &zero);
            let fitted = self.problem.fit(&space, &start, &self.all(), 0, &SEARCH);
            fitted.ln_likelihood - state.fitted.ln_likelihood
        };
        (0..PLACEBOS).map(gain).fold(0.0, f64::max)
    }

    /// Every look, predicted by a fit without its fold.
    fn held_out(&self, space: &Space, at: &DVector<f64>) -> Vec<Scored> {
        let mut all: Vec<(usize, Scored)> = Vec::new();
        for fold in 0..self.folds.folds {
            let used: Vec<bool> = self.folds.fold.iter().map(|f| *f != fold).collect();
            let fitted = self.problem.fit(space, at, &used, 0, &SEARCH);
            let prediction = self.problem.predict(space, &fitted.at);
            let Problem { declared, observations, .. } = self.problem;
            all.extend(scored(&prediction, declared, observations, &|look| !used[look]));
        }
        all.sort_by_key(|(look, _)| *look);
        all.into_iter().map(|(_, scored)| scored).collect()
    }

    fn size_db(&self, state: &State, space: &Space, at: &DVector<f64>) -> f64 {
        let before = self.problem.predict(&state.space, &state.fitted.at);
        let after = self.problem.predict(space, at);
        let spread = |looks: f64| speckle_sd_db(looks);
        let spread_db = (spread(after.receiver.looks) - spread(before.receiver.looks)).abs();
        let mean = |p: &crate::effects::Prediction, look: usize| {
            let power_w = p.arrived.get(look).copied().flatten().map_or(0.0, |a| a.power_w);
            (power_w + p.receiver.noise_w).max(f64::MIN_POSITIVE).ln()
        };
        let seen =
            self.problem.observations.iter().enumerate().filter(|(_, o)| o.power_w.is_some());
        let squares =
            seen.map(|(look, _)| (DB * (mean(&after, look) - mean(&before, look))).powi(2));
        let (sum, count) = squares.fold((0.0, 0.0), |(s, n), x| (s + x, n + 1.0));
        let tilt_db = DB * after.receiver.tilt_sd_rad * rms(&after.slope_per_rad)
            - DB * before.receiver.tilt_sd_rad * rms(&before.slope_per_rad);
        (sum / f64::max(count, 1.0)).sqrt().max(spread_db).max(tilt_db.abs())
    }
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
