//! What an answer is to be held against: terms that mean nothing and gain something all the same, and the
//! size from which each effect would have been seen.

use nalgebra::DVector;

use super::covariates::covariates;
use super::field::Field;
use super::looks::Observation;
use super::placebo::Placebo;
use super::refit::{Problem, Space};
use super::screen::Screen;
use super::select::{Selection, State};
use super::{Control, Controls, Power};
use crate::effects::{Effect, Prediction};
use crate::radar::random::{Key, Purpose};

/// Strength of an injected effect, in sizes that would just be seen.
const INJECTED: f64 = 2.0;

/// All controls, beside the base model.
pub(super) fn controls(
    selection: &Selection,
    base: &State,
    effects: &[&dyn Effect],
    numbers: usize,
) -> Controls {
    Controls {
        placebo: placebo(selection, base, numbers),
        equal_df_spline: spline(selection, base, numbers),
        injection_recovery: powers(selection, base, effects),
    }
}

fn placebo(selection: &Selection, base: &State, numbers: usize) -> Option<Control> {
    let placebo = Placebo::new(numbers, selection.settings.seed, 0);
    let mut space = base.space.clone();
    space.effects.push(&placebo);
    let zero = vec![0.0; placebo.knobs().len()];
    let start = Space::joined(&base.fitted.at, &placebo, &zero);
    let (fitted, [held_out_gain, held_out_se]) = selection.fitted(base, &space, &start);
    Some(Control {
        numbers: placebo.knobs().len(),
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
    let mut all = covariates(problem.looks, &prediction, problem.observations);
    let laws = selection.problem.mean_slopes(&base.space, &base.fitted.at);
    let mut best: Option<Control> = None;
    for covariate in &mut all {
        covariate.cells = numbers.max(2);
        let field = Field::spline(problem.looks, std::slice::from_ref(covariate));
        let structure = field.structure(problem, &prediction, &laws, selection.folds);
        let [held_out_gain, held_out_se] = structure.gain;
        if best.as_ref().is_none_or(|best| held_out_gain > best.held_out_gain) {
            let over = covariate.name.to_owned();
            let gain = structure.fitted_gain;
            best =
                Some(Control { numbers: field.numbers(), over, gain, held_out_gain, held_out_se });
        }
    }
    best
}

/// The size from which each effect would be seen beside the base model.
fn powers(selection: &Selection, base: &State, effects: &[&dyn Effect]) -> Vec<Power> {
    let sample = selection.sample;
    let problem = sample.problem(&selection.problem);
    let screen = Screen::new(problem, &base.space, &base.fitted.at);
    let power = |effect: &&dyn Effect| {
        let least_gain = selection.settings.least_gain_of(effect.knobs().len(), 1);
        let space = base.space.with(*effect);
        let starts = effect.starts(problem.stage, problem.looks);
        let every = starts.len().div_ceil(MOST_STARTS).max(1);
        let present = |values: &Vec<f64>| {
            let knobs = effect.knobs().iter().zip(values);
            // Where an effect starts from nothing, a felt change of all its numbers stands for it.
            let all_absent = knobs.clone().all(|(knob, value)| knob.absent == *value);
            let moved =
                knobs.map(|(k, v)| if all_absent { v + k.step } else { *v }).collect::<Vec<_>>();
            Space::joined(&base.fitted.at, *effect, &moved)
        };
        let found = starts.iter().step_by(every).map(present).filter_map(|at| {
            let [information, size_db] = screen.felt(&space, &at);
            let gain_of_unit = 0.5 * sample.weight * information;
            let useful = gain_of_unit > 0.0 && size_db > 0.0;
            useful.then(|| ((least_gain / gain_of_unit).sqrt(), size_db, at))
        });
        let least = found.min_by(|a, b| (a.0 * a.1).total_cmp(&(b.0 * b.1)));
        let recovered = least
            .as_ref()
            .map(|(scale, _, at)| recovered(selection, base, &space, at, INJECTED * scale));
        // Nothing smaller than the least size is ever believed.
        let least_size_db = selection.settings.least_size_db;
        let least_db = least.map(|(scale, size_db, _)| (scale * size_db).max(least_size_db));
        Power { name: effect.name(), least_db, recovered }
    };
    effects.iter().map(power).collect()
}

/// Starts of an effect that the power is taken over.
const MOST_STARTS: usize = 12;

/// Whether the effect, so many times as strong as at a point, is seen again in drawn data.
fn recovered(
    selection: &Selection,
    base: &State,
    space: &Space,
    at: &DVector<f64>,
    scale: f64,
) -> bool {
    let problem = &selection.problem;
    let [bare, full] = [problem.predict(&base.space, &base.fitted.at), problem.predict(space, at)];
    let looks = bare.receiver.looks;
    let draw = |look: usize| {
        let key = Key {
            seed: selection.settings.seed,
            chirp: look as u64,
            sub_ray: 4,
            purpose: Purpose::Fit,
        };
        let mean_w = bare.mean_w(look);
        let changed = |p: &Prediction| p.arrived.get(look).copied().flatten();
        // Means with thermal noise, so that more of that is put in, too.
        let ln_factor = match [bare.passed_w(look), full.passed_w(look)] {
            [bare_w, full_w] if bare_w > 0.0 && full_w > 0.0 => scale * (full_w / bare_w).ln(),
            _ => 0.0,
        };
        let mut draws = key.draws();
        let drawn_w = bare.saturating.passed_w(mean_w, mean_w * draws.gamma(looks));
        let power_w = drawn_w * ln_factor.clamp(-5.0, 5.0).exp();
        let is_detected = power_w >= problem.declared.threshold_w;
        let range_m = changed(&bare).zip(changed(&full)).map(|(bare, full)| {
            let error_m = problem.declared.range_sd_m * draws.gaussian();
            bare.range_m + scale * (full.range_m - bare.range_m) + error_m
        });
        let (power_w, range_m) = (Some(power_w), range_m);
        if is_detected { Observation { power_w, range_m } } else { Observation::default() }
    };
    let drawn: Vec<Observation> = (0..problem.looks.len()).map(draw).collect();
    let problem = Problem { observations: &drawn, ..*problem };
    let screen = Screen::new(problem, &base.space, &base.fitted.at);
    let least =
        selection.settings.least_gain_of(space.effects.last().map_or(1, |e| e.knobs().len()), 1);
    screen.promise(space, at) >= least
}
