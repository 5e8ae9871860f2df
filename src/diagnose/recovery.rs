//! Injection and recovery: the size from which on an effect is found in data that the base model simulates with it.
//!
//! The data are a sample of the shots, so that the size has the scatter of one simulated scan.

use nalgebra::DVector;

use super::folds::Folds;
use super::observation::{Observation, ReceiverLimits};
use super::problem::{Problem, caches};
use super::refit::SCOUT;
use super::report::Power;
use super::scorer::{Scorer, State};
use super::screen::Screen;
use super::settings::Diagnosis;
use super::size::Size;
use super::space::Space;
use super::trial::Search;
use crate::effects::{Effect, Prediction};
use crate::radar::random::{Key, Purpose};

/// Starts of an effect that are considered.
const MOST_STARTS: usize = 12;
/// Smallest size that is tried, dB.
const LEAST_RUNG_DB: f64 = 0.05;
/// Strengths that are tried, in the strength that a score test just detects.
const SCALES: [f64; 5] = [0.5, 1.0, 2.0, 4.0, 8.0];
/// Distances from a start that are tried for an effect far from its absent value, in steps of its parameter.
const STEPS: [f64; 4] = [0.0, 2.0, 5.0, 10.0];
/// Distance from the absent value, in steps, beyond which no straight line leads there: the parameter is a level or a
/// number of looks whose end stands for absent.
const FAR_STEPS: f64 = 30.0;

/// The size from which on an effect is found in simulated data.
pub(super) fn recover(search: &Search, base: &State, effect: &dyn Effect) -> Power {
    // Rays traced for one effect are of no use to another.
    let traced = &caches(search.scorer.problem.traced.len());
    let problem = Problem { traced, ..search.sample.problem(&search.scorer.problem) };
    let settings = search.scorer.settings;
    let Diagnosis { block_m, folds, seed, .. } = *settings;
    let make = if problem.shared.is_any() { Folds::of_shared } else { Folds::new };
    let folds = &make(&problem.views.all_in_first(problem.shots), block_m, folds, seed);
    let scorer = Scorer { problem, folds, settings };
    Bench { scorer, weight: search.sample.weight, base, effect, notify: search.notify }.power()
}

/// Where an effect is injected and searched for.
struct Bench<'a> {
    scorer: Scorer<'a>,
    /// Shots of the scan per shot of the sample.
    weight: f64,
    base: &'a State<'a>,
    effect: &'a dyn Effect,
    notify: &'a (dyn Fn(&str) + Sync),
}

/// An effect of one strength.
struct Rung {
    /// Injected size, dB.
    size_db: f64,
    at: DVector<f64>,
}

/// The result of a search for an injected effect.
struct Recovery {
    is_found: bool,
    /// Size that remains once the scattering models have absorbed their part, dB.
    size_db: f64,
}

impl Bench<'_> {
    /// Bisects the strengths for the weakest one that is found.
    fn power(&self) -> Power {
        let problem = &self.scorer.problem;
        let rungs = self.rungs();
        let tried = problem.starts(self.effect).len();
        // An effect that is found is also found when stronger.
        let (mut missed, mut found): (Vec<f64>, Option<f64>) = (Vec::new(), None);
        let mut open: &[Rung] = &rungs;
        while let Some(rung) = open.get(open.len() / 2) {
            let (weaker, stronger) = open.split_at(open.len() / 2);
            (self.notify)(&format!("controls: from which size {} is found", self.effect.name()));
            let Recovery { is_found, size_db } = self.search(tried, &rung.at);
            if is_found {
                (found, open) = (Some(size_db), weaker);
            } else {
                missed.push(size_db);
                open = stronger.get(1..).unwrap_or_default();
            }
        }
        // Remaining sizes need not be in the order of those injected.
        missed.retain(|db| found.is_none_or(|found| *db < found));
        let missed_db = missed.into_iter().max_by(f64::total_cmp);
        Power {
            name: self.effect.name(),
            scans: self.effect.scans().to_vec(),
            least_db: found,
            missed_db,
        }
    }

    /// The effect in strengths about the one that a score test just detects, weakest first.
    fn rungs(&self) -> Vec<Rung> {
        let Scorer { problem, .. } = self.scorer;
        let State { space, fit, .. } = self.base;
        let with = space.with(self.effect);
        let bare = problem.predict(space, &fit.at);
        let mut rungs = Vec::new();
        for at in self.points(&with) {
            let size = Size::of(problem.observations, &bare, &problem.predict(&with, &at));
            // Where nothing in the base responds to an effect, no strength changes anything.
            if size.larger_db() > LEAST_RUNG_DB {
                rungs.push(Rung { size_db: size.larger_db(), at });
            }
        }
        rungs.sort_by(|a, b| a.size_db.total_cmp(&b.size_db));
        rungs.dedup_by(|a, b| a.at == b.at);
        rungs
    }

    /// Points at which the effect is injected.
    fn points(&self, with: &Space) -> Vec<DVector<f64>> {
        let Scorer { problem, .. } = self.scorer;
        let effect = self.effect;
        let starts = problem.starts(effect);
        let every = starts.len().div_ceil(MOST_STARTS).max(1);
        let starts: Vec<Vec<f64>> = starts.into_iter().step_by(every).collect();
        if starts.iter().any(|start| is_far(effect, start)) {
            let stronger = starts.iter().flat_map(|start| stronger(effect, start));
            return stronger.map(|values| self.joined(&values)).collect();
        }
        // The start at which the smallest change of the data would just be detected.
        let screen = Screen::new(problem, &self.base.space, &self.base.fit.at);
        let mut best: Option<(f64, f64, &[f64])> = None;
        for start in &starts {
            let [information, size_db] =
                screen.felt(with, &self.joined(&scaled(effect, start, 1.0)));
            let gain_of_unit = 0.5 * self.weight * information;
            let scale = (self.least_gain(1) / gain_of_unit).sqrt();
            // Bounds limit the strength.
            let most = most_scale(effect, start);
            let just_felt_db = scale.min(most) * size_db;
            if size_db > 0.0
                && most > 0.0
                && scale.is_finite()
                && best.is_none_or(|(best_db, ..)| just_felt_db.total_cmp(&best_db).is_lt())
            {
                best = Some((just_felt_db, scale, start));
            }
        }
        let Some((_, scale, start)) = best else { return Vec::new() };
        let most = most_scale(effect, start);
        SCALES.map(|times| self.joined(&scaled(effect, start, (times * scale).min(most)))).to_vec()
    }

    /// The base with the effect at these values.
    fn joined(&self, values: &[f64]) -> DVector<f64> {
        Space::joined(&self.base.fit.at, self.effect, values)
    }

    /// Least gain of the effect when searched from this number of starts.
    fn least_gain(&self, starts: usize) -> f64 {
        self.scorer.settings.least_gain_of(self.effect.parameters().len(), starts)
    }

    /// Searches for the effect, as if from `tried` starts, in data simulated with it. The search begins at the
    /// injected values: it shows what the data hold, not whether a search from afar would get there.
    fn search(&self, tried: usize, at: &DVector<f64>) -> Recovery {
        let State { space: bare, fit, .. } = self.base;
        let with = bare.with(self.effect);
        let truth = self.scorer.problem.predict(&with, at);
        let observations = &self.simulate(&truth);
        // Chirps beside the target are not simulated.
        let problem = Problem { observations, alarms: &[], ..self.scorer.problem };
        let before = problem.fit(bare, &fit.at, &[], &SCOUT);
        let after = problem.fit(&with, at, &[], &SCOUT);
        // The scan has more shots than the sample.
        let gain = self.weight * (after.ln_likelihood - before.ln_likelihood);
        let now = problem.predict(bare, &before.at);
        let then = problem.predict(&with, &after.at);
        let size_db = Size::of(observations, &now, &truth).larger_db();
        let is_large =
            Size::of(observations, &now, &then).larger_db() >= self.scorer.settings.least_size_db;
        if gain < self.least_gain(tried) || !is_large {
            return Recovery { is_found: false, size_db };
        }
        let scorer = Scorer { problem, ..self.scorer };
        let without = scorer.held_out(bare, &before.at);
        let [held_out, se] = scorer.difference(&scorer.held_out(&with, &after.at), &without);
        // The simulated shots are independent, and those of the scan scatter by the root of what they count more.
        let shared = problem.independent_shots() / problem.shots.len().max(1) as f64;
        let [held_out, se] = [self.weight * held_out, (self.weight / shared).sqrt() * se];
        Recovery { is_found: held_out.min(gain) > scorer.settings.standard_errors * se, size_db }
    }

    /// Random data of a prediction.
    fn simulate(&self, prediction: &Prediction) -> Vec<Observation> {
        let shots = 0..self.scorer.problem.shots.len();
        shots.map(|shot| self.simulate_shot(prediction, shot)).collect()
    }

    fn simulate_shot(&self, prediction: &Prediction, shot: usize) -> Observation {
        let ReceiverLimits { threshold_w, range_sd_m } = self.scorer.problem.declared;
        let (seed, chirp) = (self.scorer.settings.seed, shot as u64);
        let mut draws = Key { seed, chirp, sub_ray: 4, purpose: Purpose::Fit }.draws();
        // One of the tilts, by its weight.
        let mut left = draws.uniform();
        let mut tilted_w = 0.0;
        for (power_w, weight) in prediction.powers_w(shot) {
            if left >= 0.0 {
                tilted_w = power_w;
            }
            left -= weight;
        }
        // Noise, speckle and the receiver.
        let mean_w = tilted_w + prediction.receiver.noise_w;
        let drawn_w = mean_w * draws.gamma(prediction.looks(shot, tilted_w));
        let power_w = prediction.saturating.passed_w(mean_w, drawn_w);
        let arrived = prediction.arrived.get(shot).copied().flatten();
        let range_m = arrived
            .map(|a| a.range_m + range_sd_m.hypot(a.spread_m) * draws.gaussian())
            .filter(|_| range_sd_m > 0.0);
        if power_w >= threshold_w {
            Observation::detected(power_w, range_m)
        } else {
            Observation::default()
        }
    }
}

/// Whether a start is so far from the absent value that no straight line leads there.
fn is_far(effect: &dyn Effect, values: &[f64]) -> bool {
    let first = effect.parameters().iter().zip(values).next();
    first.is_some_and(|(known, value)| (value - known.absent).abs() > FAR_STEPS * known.step)
}

/// The effect at a start, and ever farther from its absent value, within its bounds.
fn stronger(effect: &dyn Effect, start: &[f64]) -> Vec<Vec<f64>> {
    let Some((known, value)) = effect.parameters().iter().zip(start).next() else {
        return Vec::new();
    };
    let away = known.step.copysign(value - known.absent);
    let mut all = Vec::new();
    for steps in STEPS {
        let mut at = start.to_vec();
        at[0] = (value + steps * away).clamp(known.min, known.max);
        all.push(at);
    }
    all
}

/// The largest scale of an effect within its bounds; 0 where the start itself is beyond them.
fn most_scale(effect: &dyn Effect, values: &[f64]) -> f64 {
    let once = scaled(effect, values, 1.0);
    let mut most = f64::INFINITY;
    for (index, (known, value)) in effect.parameters().iter().zip(once).enumerate() {
        if value < known.min || value > known.max {
            return 0.0;
        }
        let change = value - known.absent;
        if (index != 0 && values[index] != known.absent) || change == 0.0 {
            continue;
        }
        let end = if change > 0.0 { known.max } else { known.min };
        most = most.min((end - known.absent) / change);
    }
    most
}

/// The effect at a multiple of its strength. The first parameter is the strength and the others are a shape. Where a
/// start is absent altogether, one step of every parameter stands for it.
fn scaled(effect: &dyn Effect, values: &[f64], scale: f64) -> Vec<f64> {
    let parameters = || effect.parameters().iter().zip(values);
    if parameters().all(|(known, value)| known.absent == *value) {
        return effect.parameters().iter().map(|known| known.absent + scale * known.step).collect();
    }
    let mut scaled = values.to_vec();
    if let Some((known, value)) = parameters().next() {
        scaled[0] = known.absent + scale * (value - known.absent);
    }
    scaled
}
