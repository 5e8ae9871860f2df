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
use super::refit::{Fitted, Problem, Space, sum};
use super::residual::speckle_sd_db;
use super::score::{DB, Scored, scored};
use super::screen::{Sample, Screen};
use super::{Diagnosis, Evidence};
use crate::effects::{Effect, Prediction, Receiver};
use crate::fit::minimise::Minimise;

/// Steps of a fit, and of one on the sample that only shows whether an effect is worth it.
const SEARCH: Minimise = Minimise { iterations: 30, tolerance: 1e-2 };
const SCOUT: Minimise = Minimise { iterations: 12, tolerance: 0.1 };
/// Starts of an effect that are followed.
const STARTS: usize = 2;
/// And none that promises less than this share of what the best does.
const SHARE_OF_START: f64 = 0.7;
/// Effects that promise less than this share of the best are not fitted at all.
const SHARE_TO_SCOUT: f64 = 0.1;
/// Effects of each round that are fitted to all looks and predict held-out patches: at most so many,
/// and none that gains less than this share of the best.
const SHORTLIST: usize = 5;
const SHARE_OF_BEST: f64 = 0.3;
/// Placebos of each comparison.
const PLACEBOS: u64 = 3;
/// Looks of a first fit of the base, that is not caught far from the data.
const WIDE_LOOKS: f64 = 4.0;

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
    /// Whether that is from a sample of the looks, too little to be fitted to all of them.
    pub sampled: bool,
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
    /// What they promise, and where they are.
    starts: Vec<(f64, DVector<f64>)>,
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
        let Receiver { looks, .. } = self.problem.receiver;
        let receiver = Receiver { looks: looks.min(WIDE_LOOKS), ..self.problem.receiver };
        let sample = Sample::new(&self.problem);
        let wide = Problem { receiver, ..sample.problem(&self.problem) };
        let start = wide.fit(&space, &space.start(), 0, &SEARCH).at;
        let fitted = self.problem.fit(&space, &start, 0, &SEARCH);
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

    /// Every effect that is not there yet, best first. Those worth it are fitted to all looks, the
    /// rest to a sample.
    fn trials<'a>(
        &self,
        state: &State<'a>,
        effects: &[&'a dyn Effect],
        round: usize,
    ) -> Vec<Trial<'a>> {
        let absent = |effect: &&&dyn Effect| {
            state.space.effects.iter().all(|there| there.name() != effect.name())
        };
        let sample = Sample::new(&self.problem);
        let screen = Screen::new(sample.problem(&self.problem), &state.space, &state.fitted.at);
        let mut trials: Vec<Trial> = effects
            .iter()
            .filter(absent)
            .filter_map(|effect| self.promised(state, &screen, sample.weight, *effect, round))
            .collect();
        sort(&mut trials);
        let mut best = 0.25 * self.settings.least_gain / SHARE_TO_SCOUT;
        for trial in &mut trials {
            if trial.candidate.gain >= SHARE_TO_SCOUT * best {
                self.scout(state, &screen, sample.weight, trial);
                best = best.max(trial.candidate.gain);
            }
        }
        sort(&mut trials);
        let best = trials.first().map_or(0.0, |trial| trial.candidate.gain);
        let least = (SHARE_OF_BEST * best).max(0.5 * self.settings.least_gain);
        for trial in trials.iter_mut().take(SHORTLIST) {
            if trial.candidate.gain >= least {
                self.refit(state, trial);
            }
        }
        sort(&mut trials);
        trials
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
        let starts = effect.starts(self.problem.stage, self.problem.looks);
        let mut starts: Vec<(f64, DVector<f64>)> = starts
            .iter()
            .map(|values| {
                let start = Space::joined(&state.fitted.at, effect, values);
                (weight * screen.promise(&space, &start), start)
            })
            .collect();
        starts.sort_by(|a, b| b.0.total_cmp(&a.0));
        starts.truncate(STARTS);
        let (gain, at) = starts.first()?.clone();
        // Where the effect is absent there is nothing to promise.
        let gain = if starts.len() == 1 && gain == 0.0 { f64::INFINITY } else { gain };
        let candidate = Candidate {
            round,
            name: effect.name(),
            numbers: effect.knobs().len(),
            gain,
            sampled: true,
            placebo_gain: None,
            held_out: None,
            size_db: 0.0,
            converged: false,
            accepted: false,
        };
        let fitted = Fitted { at, ln_likelihood: f64::NEG_INFINITY, converged: false };
        Some(Trial { effect, space, starts, fitted, candidate })
    }

    /// Fits a trial to the sample.
    fn scout(&self, state: &State, screen: &Screen, weight: f64, trial: &mut Trial) {
        let space = &trial.space;
        let here = sum(&screen.problem.terms(&state.space, &state.fitted.at));
        let most = trial.starts.first().map_or(0.0, |start| start.0);
        let useful = trial.starts.iter().filter(|start| start.0 >= SHARE_OF_START * most);
        let scouts = useful.map(|(_, start)| screen.problem.fit(space, start, 0, &SCOUT));
        let best = scouts
            .filter(|fit| fit.ln_likelihood.is_finite())
            .max_by(|a, b| a.ln_likelihood.total_cmp(&b.ln_likelihood));
        if let Some(best) = best {
            trial.candidate.gain = weight * (best.ln_likelihood - here);
            trial.candidate.size_db = self.size_db(state, space, &best.at);
            trial.candidate.converged = best.converged;
            trial.fitted = best;
        }
    }

    /// Fits a trial to all looks.
    fn refit(&self, state: &State, trial: &mut Trial) {
        trial.fitted = self.problem.fit(&trial.space, &trial.fitted.at, 0, &SEARCH);
        trial.candidate.gain = trial.fitted.ln_likelihood - state.fitted.ln_likelihood;
        trial.candidate.sampled = false;
        trial.candidate.size_db = self.size_db(state, &trial.space, &trial.fitted.at);
        trial.candidate.converged = trial.fitted.converged;
    }

    /// The effect to add: its place, its held-out scores, and the names that do as well.
    fn chosen(
        &self,
        state: &State,
        trials: &mut [Trial],
    ) -> Option<(usize, Vec<Scored>, Vec<&'static str>)> {
        let mut passed: Vec<(usize, Vec<Scored>, f64)> = Vec::new();
        for (index, trial) in trials.iter_mut().enumerate().filter(|t| !t.1.candidate.sampled) {
            let Diagnosis { least_gain, least_size_db, standard_errors, .. } = *self.settings;
            if trial.candidate.gain < least_gain || trial.candidate.size_db < least_size_db {
                continue;
            }
            let held_out = self.held_out(&trial.space, &trial.fitted.at);
            let [gain, se] = self.difference(&held_out, &state.held_out);
            trial.candidate.held_out = Some([gain, se]);
            if gain > standard_errors * se {
                passed.push((index, held_out, gain));
            }
        }
        passed.sort_by(|a, b| b.2.total_cmp(&a.2));
        while let Some(best) = passed.first() {
            let trial = trials.get_mut(best.0)?;
            let placebo = self.placebo_gain(state, trial.effect.knobs().len());
            trial.candidate.placebo_gain = Some(placebo);
            if trial.candidate.gain > placebo {
                break;
            }
            passed.remove(0);
        }
        let best = passed.first()?;
        let as_good = |other: &&(usize, Vec<Scored>, f64)| {
            let [worse, se] = self.difference(&best.1, &other.1);
            worse <= se
        };
        let class = passed.iter().skip(1).filter(as_good);
        let names = class.map(|one| trials[one.0].candidate.name).collect();
        Some((best.0, best.1.clone(), names))
    }

    /// Sum over all looks of a difference in ln p, and its standard error over patches.
    fn difference(&self, a: &[Scored], b: &[Scored]) -> [f64; 2] {
        let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a.ln_p - b.ln_p).collect();
        self.folds.sum(&differences)
    }

    fn placebo_gain(&self, state: &State, numbers: usize) -> f64 {
        let screen = Screen::new(self.problem, &state.space, &state.fitted.at);
        let gain = |draw: u64| {
            let placebo = Placebo::new(numbers, self.settings.seed, draw);
            let mut space = state.space.clone();
            space.effects.push(&placebo);
            let knobs = placebo.knobs();
            let only = |k: usize| {
                let values: Vec<f64> = knobs
                    .iter()
                    .enumerate()
                    .map(|(i, knob)| if i == k { knob.step } else { 0.0 })
                    .collect();
                Space::joined(&state.fitted.at, &placebo, &values)
            };
            screen.promise_of_all(&space, &(0..knobs.len()).map(only).collect::<Vec<_>>())
        };
        (0..PLACEBOS).map(gain).fold(0.0, f64::max)
    }

    /// Every look, predicted by a fit without its fold.
    fn held_out(&self, space: &Space, at: &DVector<f64>) -> Vec<Scored> {
        let Problem { declared, observations, .. } = self.problem;
        let mut all: Vec<(usize, Scored)> = Vec::new();
        for (fold, at) in self.problem.fit_without(space, at, self.folds).iter().enumerate() {
            let prediction = self.problem.predict(space, at);
            let held_out = |look: usize| self.folds.fold.get(look) == Some(&fold);
            all.extend(scored(&prediction, declared, observations, &held_out));
        }
        all.sort_by_key(|(look, _)| *look);
        all.into_iter().map(|(_, scored)| scored).collect()
    }

    fn size_db(&self, state: &State, space: &Space, at: &DVector<f64>) -> f64 {
        let before = self.problem.predict(&state.space, &state.fitted.at);
        let after = self.problem.predict(space, at);
        let spread = |looks: f64| speckle_sd_db(looks);
        // Spreads add in squares.
        let wider = |a: f64, b: f64| (a * a - b * b).abs().sqrt();
        let spread_db = wider(spread(after.receiver.looks), spread(before.receiver.looks));
        let mean = |p: &Prediction, look: usize| {
            let power_w = p.arrived.get(look).copied().flatten().map_or(0.0, |a| a.power_w);
            (power_w + p.receiver.noise_w).max(f64::MIN_POSITIVE).ln()
        };
        let seen =
            self.problem.observations.iter().enumerate().filter(|(_, o)| o.power_w.is_some());
        let squares =
            seen.map(|(look, _)| (DB * (mean(&after, look) - mean(&before, look))).powi(2));
        let (sum, count) = squares.fold((0.0, 0.0), |(s, n), x| (s + x, n + 1.0));
        let tilt = |p: &Prediction| DB * p.receiver.tilt_sd_rad * rms(&p.slope_per_rad);
        let tilt_db = wider(tilt(&after), tilt(&before));
        (sum / f64::max(count, 1.0)).sqrt().max(spread_db).max(tilt_db)
    }
}

fn sort(trials: &mut [Trial]) {
    trials.sort_by(|a, b| b.candidate.gain.total_cmp(&a.candidate.gain));
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
