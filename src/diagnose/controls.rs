//! Controls of an answer: the gain of terms without a physical meaning, and the size from which on each effect is
//! recovered from simulated data.

use rayon::prelude::*;

use super::covariates::covariates;
use super::field::{Field, Model};
use super::placebo::Placebo;
use super::recovery::recover;
use super::refit::SCOUT;
use super::report::{Control, Controls};
use super::scorer::{Scorer, State};
use super::space::Space;
use super::trial::Search;
use crate::effects::Effect;

/// All controls, each against the base model. `numbers`: parameters of the meaningless terms.
pub(super) fn controls(
    search: &Search,
    base: &State,
    members: &[&dyn Effect],
    numbers: usize,
) -> Controls {
    // The first member of each family.
    let (mut effects, mut names) = (Vec::new(), Vec::new());
    for effect in members {
        let name = (effect.name(), effect.scans());
        if !names.contains(&name) {
            names.push(name);
            effects.push(*effect);
        }
    }
    let ((placebo, equal_df_spline), injection_recovery) = rayon::join(
        || (placebo(&search.scorer, base, numbers), spline(&search.scorer, base, numbers)),
        || effects.par_iter().map(|effect| recover(search, base, *effect)).collect(),
    );
    Controls { placebo: Some(placebo), equal_df_spline, injection_recovery }
}

/// A random smooth field with as many parameters.
fn placebo(scorer: &Scorer, base: &State, numbers: usize) -> Control {
    let placebo = Placebo::new(numbers, scorer.settings.seed);
    let mut space = base.space.clone();
    space.effects.push(&placebo);
    let start = Space::joined(&base.fit.at, &placebo, &vec![0.0; placebo.parameters().len()]);
    let fit = scorer.problem.fit(&space, &start, &[], &SCOUT);
    let held_out = scorer.held_out(&space, &fit.at);
    let [held_out_gain, held_out_se] = scorer.difference(&held_out, &base.held_out);
    Control {
        numbers: placebo.parameters().len(),
        over: "random waves over the target plane".to_owned(),
        gain: fit.ln_likelihood - base.fit.ln_likelihood,
        held_out_gain,
        held_out_se,
    }
}

/// A spline with as many parameters over the covariate on which the residual of the base depends most.
fn spline(scorer: &Scorer, base: &State, numbers: usize) -> Option<Control> {
    let problem = &scorer.problem;
    let prediction = &scorer.predict(base);
    let slopes = &problem.mean_slopes(&base.space, &base.fit.at);
    let mut best: Option<Control> = None;
    for mut covariate in covariates(problem.shots, prediction, problem.observations) {
        // One knot more than cells is the level, which the scattering models absorb.
        covariate.cells = numbers.max(1);
        let field = Field::spline(problem.shots, std::slice::from_ref(&covariate));
        let model = Model { problem, prediction, slopes };
        let structure = field.structure(model, scorer.folds);
        let [held_out_gain, held_out_se] = structure.gain;
        if best.as_ref().is_none_or(|best| held_out_gain > best.held_out_gain) {
            best = Some(Control {
                numbers: covariate.cells,
                over: covariate.name.to_owned(),
                gain: structure.fitted_gain,
                held_out_gain,
                held_out_se,
            });
        }
    }
    best
}
