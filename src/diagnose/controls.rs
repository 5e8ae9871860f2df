//! What an answer is to be held against: terms that mean nothing and gain something all the same, and the
//! size from which each effect is found again in drawn data.
//!
//! These are a sample of the shots, so that the size has the scatter of one drawn scan.

use nalgebra::DVector;
use rayon::prelude::*;

use super::covariates::covariates;
use super::field::Field;
use super::folds::Folds;
use super::likelihood::Declared;
use super::placebo::Placebo;
use super::refit::{Problem, Space};
use super::screen::Screen;
use super::select::{SCOUT, Selection, State, larger, sizes_db};
use super::shots::Observation;
use super::{Control, Controls, Diagnosis, Power};
use crate::effects::{Effect, Prediction, PredictionCache};
use crate::radar::random::{Key, Purpose};

/// All controls, beside the base model.
pub(super) fn controls(
    selection: &Selection,
    base: &State,
    effects: &[&dyn Effect],
    numbers: usize,
) -> Controls {
    let ((placebo, equal_df_spline), injection_recovery) = rayon::join(
        || (placebo(selection, base, numbers), spline(selection, base, numbers)),
        || powers(selection, base, effects),
    );
    Controls { placebo, equal_df_spline, injection_recovery }
}

fn placebo(selection: &Selection, base: &State, numbers: usize) -> Option<Control> {
    let placebo = Placebo::new(numbers, selection.settings.seed);
    let mut space = base.space.clone();
    space.effects.push(&placebo);
    let zero = vec![0.0; placebo.parameters().len()];
    let start = Space::joined(&base.fitted.at, &placebo, &zero);
    let (fitted, [held_out_gain, held_out_se]) = selection.fitted(base, &space, &start);
    Some(Control {
        numbers: placebo.parameters().len(),
        over: "random waves over the target plane".to_owned(),
        gain: fitted.ln_likelihood - base.fitted.ln_likelihood,
        held_out_gain,
        held_out_se,
    })
}

/// A spline with as many numbers over the covariate that goes with most of what the base leaves.
fn spline(selection: &Selection, base: &State, numbers: usize) -> Option<Control> {
    let problem = &selection.problem;
    let prediction = problem.predict(&base.space, &base.fitted.at);
    let mut all = covariates(problem.shots, &prediction, problem.observations);
    let laws = selection.problem.mean_slopes(&base.space, &base.fitted.at);
    let mut best: Option<Control> = None;
    for covariate in &mut all {
        // One number more than these is the level, which the laws absorb.
        covariate.cells = numbers.max(1);
        let field = Field::spline(problem.shots, std::slice::from_ref(covariate));
        let structure = field.structure(problem, &prediction, &laws, selection.folds);
        let [held_out_gain, held_out_se] = structure.gain;
        if best.as_ref().is_none_or(|best| held_out_gain > best.held_out_gain) {
            let over = covariate.name.to_owned();
            let gain = structure.fitted_gain;
            best =
                Some(Control { numbers: covariate.cells, over, gain, held_out_gain, held_out_se });
        }
    }
    best
}

/// From which size on each effect is found in data that the base model draws with it.
fn powers(selection: &Selection, base: &State, effects: &[&dyn Effect]) -> Vec<Power> {
    let sample = selection.sample;
    let problem = sample.problem(&selection.problem);
    let Diagnosis { block_m, folds, seed, .. } = *selection.settings;
    let folds = &Folds::new(problem.shots, block_m, folds, seed);
    let power = |effect: &&dyn Effect| {
        // What was traced for one effect is of no use to another.
        let traced = &PredictionCache::default();
        let problem = Problem { traced, ..problem };
        Bench { problem, folds, selection, base }.power(*effect)
    };
    effects.par_iter().map(power).collect()
}

/// Where effects are put in and looked for: a sample of the shots, each of which stands for several.
struct Bench<'a> {
    problem: Problem<'a>,
    folds: &'a Folds,
    selection: &'a Selection<'a>,
    base: &'a State<'a>,
}

/// An effect of one strength: its size as put in, dB, and the point.
type Rung = (f64, DVector<f64>);

/// What came of looking for an effect.
struct Search {
    is_found: bool,
    /// What the effect left to be seen once the laws had taken their part of it, dB.
    size_db: f64,
}

impl Bench<'_> {
    fn power(&self, effect: &dyn Effect) -> Power {
        let rungs = self.rungs(effect);
        let tried = effect.starts(self.problem.stage, self.problem.shots).len();
        // What is found is found when stronger, too.
        let (mut missed, mut found): (Vec<f64>, Option<f64>) = (Vec::new(), None);
        let mut open: &[Rung] = &rungs;
        while let Some((_, at)) = open.get(open.len() / 2) {
            let (weaker, stronger) = open.split_at(open.len() / 2);
            let Search { is_found, size_db } = self.search(effect, tried, at);
            if is_found {
                (found, open) = (Some(size_db), weaker);
            } else {
                missed.push(size_db);
                open = stronger.get(1..).unwrap_or_default();
            }
        }
        // Sizes as they are left need not be in the order of those put in.
        let is_below = |db: &f64| found.is_none_or(|found| *db < found);
        let missed_db = missed.into_iter().filter(is_below).max_by(f64::total_cmp);
        Power { name: effect.name(), least_db: found, missed_db }
    }

    /// The effect in strengths about where a score test would just see it, weakest first.
    fn rungs(&self, effect: &dyn Effect) -> Vec<Rung> {
        let Bench { problem, base, selection, .. } = self;
        let space = base.space.with(effect);
        let screen = Screen::new(*problem, &base.space, &base.fitted.at);
        let starts = effect.starts(problem.stage, problem.shots);
        let every = starts.len().div_ceil(MOST_STARTS).max(1);
        let starts: Vec<Vec<f64>> = starts.into_iter().step_by(every).collect();
        let joined = |values: &Vec<f64>| Space::joined(&base.fitted.at, effect, values);
        let scaled = |values: &Vec<f64>, scale: f64| joined(&scaled(effect, values, scale));
        let points: Vec<DVector<f64>> = if starts.iter().any(|start| is_far(effect, start)) {
            starts.iter().flat_map(|start| stronger(effect, start)).map(|at| joined(&at)).collect()
        } else {
            let promised = starts.iter().filter_map(|start| {
                let [information, size_db] = screen.felt(&space, &scaled(start, 1.0));
                let gain_of_unit = 0.5 * selection.sample.weight * information;
                let scale = (self.least_gain(effect) / gain_of_unit).sqrt();
                // As strong as its bounds allow is as strong as it can be missed.
                let most = most_scale(effect, start);
                let is_felt = size_db > 0.0 && most > 0.0 && scale.is_finite();
                is_felt.then_some((scale.min(most) * size_db, scale, start))
            });
            let best = promised.min_by(|a, b| a.0.total_cmp(&b.0));
            let about = |(_, scale, start): (f64, f64, &Vec<f64>)| {
                let most = most_scale(effect, start);
                SCALES.map(|times| scaled(start, (times * scale).min(most))).to_vec()
            };
            best.map(about).unwrap_or_default()
        };
        let bare = problem.predict(&base.space, &base.fitted.at);
        let sized = points.into_iter().map(|at| {
            let sizes_db = sizes_db(problem, &bare, &problem.predict(&space, &at));
            (larger(sizes_db), at)
        });
        // Where the base has nothing for an effect to act on, none of its strengths changes anything.
        let is_felt = |(size_db, _): &Rung| *size_db > LEAST_RUNG_DB;
        let mut rungs: Vec<Rung> = sized.filter(is_felt).collect();
        rungs.sort_by(|a, b| a.0.total_cmp(&b.0));
        rungs.dedup_by(|a, b| a.1 == b.1);
        rungs
    }

    fn least_gain(&self, effect: &dyn Effect) -> f64 {
        self.selection.settings.least_gain_of(effect.parameters().len(), 1)
    }

    /// Looks for an effect, as if from so many starts, in data drawn with it. The search begins where the effect
    /// was put in: it tells what the data hold, not whether a search from afar would get there.
    fn search(&self, effect: &dyn Effect, tried: usize, at: &DVector<f64>) -> Search {
        let State { space: bare, fitted, .. } = self.base;
        let with = bare.with(effect);
        let truth = self.problem.predict(&with, at);
        let drawn = self.drawn(&truth);
        let problem = Problem { observations: &drawn, ..self.problem };
        let before = problem.fit(bare, &fitted.at, &[], &SCOUT);
        let after = problem.fit(&with, at, &[], &SCOUT);
        let Selection { sample, settings, hear, .. } = *self.selection;
        // So many shots as the scan has, of which each of these stands for several.
        let gain = sample.weight * (after.ln_likelihood - before.ln_likelihood);
        let predicted = [(bare, &before.at), (&with, &after.at)];
        let [now, then] = predicted.map(|(space, at)| problem.predict(space, at));
        let is_large = larger(sizes_db(&problem, &now, &then)) >= settings.least_size_db;
        let size_db = larger(sizes_db(&problem, &now, &truth));
        if gain < settings.least_gain_of(effect.parameters().len(), tried) || !is_large {
            return Search { is_found: false, size_db };
        }
        let selection = Selection { problem, sample, folds: self.folds, settings, hear };
        let [without, with] = predicted.map(|(space, at)| selection.held_out(space, at));
        let [held_out, se] = selection.difference(&with, &without);
        let [held_out, se] = [sample.weight * held_out, sample.weight.sqrt() * se];
        Search { is_found: held_out.min(gain) > settings.standard_errors * se, size_db }
    }

    /// Data as a prediction draws them.
    fn drawn(&self, prediction: &Prediction) -> Vec<Observation> {
        let Declared { threshold_w, range_sd_m } = self.problem.declared;
        let draw = |shot: usize| {
            let seed = self.selection.settings.seed;
            let chirp = shot as u64;
            let mut draws = Key { seed, chirp, sub_ray: 4, purpose: Purpose::Fit }.draws();
            let mut left = draws.uniform();
            let mut tilted_w = 0.0;
            for (power_w, weight) in prediction.powers_w(shot) {
                if left >= 0.0 {
                    tilted_w = power_w;
                }
                left -= weight;
            }
            let mean_w = tilted_w + prediction.receiver.noise_w;
            let drawn_w = mean_w * draws.gamma(prediction.receiver.looks);
            let power_w = prediction.saturating.passed_w(mean_w, drawn_w);
            let arrived = prediction.arrived.get(shot).copied().flatten();
            let range_m = arrived
                .map(|a| a.range_m + range_sd_m.hypot(a.spread_m) * draws.gaussian())
                .filter(|_| range_sd_m > 0.0);
            match power_w >= threshold_w {
                true => Observation { power_w: Some(power_w), range_m },
                false => Observation::default(),
            }
        };
        (0..self.problem.shots.len()).map(draw).collect()
    }
}

/// Starts of an effect that are looked at.
const MOST_STARTS: usize = 12;
/// Smallest size that is tried, dB.
const LEAST_RUNG_DB: f64 = 0.05;
/// Strengths, in those that a score test would just see.
const SCALES: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];
/// Steps of a number beyond where a search for it begins.
const STEPS: [f64; 4] = [0.0, 2.0, 5.0, 10.0];
/// Steps from where an effect is absent beyond which no line leads there: a level or a number of looks
/// whose end stands for none.
const FAR_STEPS: f64 = 30.0;

fn is_far(effect: &dyn Effect, values: &[f64]) -> bool {
    let first = effect.parameters().iter().zip(values).next();
    first.is_some_and(|(knob, value)| (value - knob.absent).abs() > FAR_STEPS * knob.step)
}

/// The effect at a start, and ever further from where it is absent, within its bounds.
fn stronger(effect: &dyn Effect, start: &[f64]) -> Vec<Vec<f64>> {
    let Some((knob, value)) = effect.parameters().iter().zip(start).next() else {
        return Vec::new();
    };
    let away = knob.step.copysign(value - knob.absent);
    let at = |steps: f64| {
        let mut at = start.to_vec();
        at[0] = (value + steps * away).clamp(knob.min, knob.max);
        at
    };
    STEPS.map(at).to_vec()
}

/// The most times as strong that an effect can be within its bounds; 0 where the start itself is beyond them.
fn most_scale(effect: &dyn Effect, values: &[f64]) -> f64 {
    let once = scaled(effect, values, 1.0);
    let most = effect.parameters().iter().zip(once).enumerate().map(|(index, (knob, value))| {
        let change = value - knob.absent;
        match (index == 0 || values[index] == knob.absent, change) {
            _ if value < knob.min || value > knob.max => 0.0,
            (false, _) | (true, 0.0) => f64::INFINITY,
            (true, up) if up > 0.0 => (knob.max - knob.absent) / up,
            (true, down) => (knob.min - knob.absent) / down,
        }
    });
    most.fold(f64::INFINITY, f64::min)
}

/// So many times as strong. The first number is the strength and the others a shape, or, where a start is
/// nothing at all, a felt change of every number stands for it.
fn scaled(effect: &dyn Effect, values: &[f64], scale: f64) -> Vec<f64> {
    let is_nothing =
        effect.parameters().iter().zip(values).all(|(knob, value)| knob.absent == *value);
    let knobs = effect.parameters().iter().zip(values).enumerate();
    let scaled = knobs.map(|(index, (knob, value))| match (is_nothing, index) {
        (true, _) => knob.absent + scale * knob.step,
        (false, 0) => knob.absent + scale * (value - knob.absent),
        (false, _) => *value,
    });
    scaled.collect()
}
