//! Whether several clouds of one target contradict each other.
//!
//! They do so in two ways. Laws that are refitted to one cloud alone predict its held-out patches better than the laws of
//! all; or an effect that the clouds together support makes the predictions of one of them worse.

use super::choose::Choice;
use super::clouds::parts;
use super::evidence::{Candidate, CloudGain};
use super::problem::Problem;
use super::refit::SEARCH;
use super::report::Contradiction;
use super::scorer::{Scorer, State};
use super::size::Size;
use super::support::NO_DOUBT;

/// The contradictions of several clouds; none of one cloud.
pub(super) fn contradictions(scorer: &Scorer, choice: &Choice) -> Vec<Contradiction> {
    if scorer.problem.views.stages.len() < 2 {
        return Vec::new();
    }
    let Choice { base, model, excluded, .. } = choice;
    // Effects may make up for laws that differ: if laws of their own, without an effect, explain the clouds as well, that is
    // the simpler answer.
    let apart = laws_apart(scorer, base, 0.0);
    let of_laws: f64 = apart.iter().map(|one| one.gain).sum();
    let [of_effects, _] = scorer.difference(&model.state.held_out, &base.held_out);
    let mut found = if of_laws >= of_effects {
        apart
    } else {
        laws_apart(scorer, &model.state, model.largest().size_db)
    };
    found.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    found.extend(excluded.iter().filter_map(of_effect));
    found
}

/// The cloud that excludes an effect.
fn of_effect(candidate: &Candidate) -> Option<Contradiction> {
    let worst = candidate.acting().min_by(|a, b| a.gain.total_cmp(&b.gain))?;
    let CloudGain { cloud, gain, se } = *worst;
    let (effect, size_db) = (Some(candidate.name), candidate.size_db);
    worst.contradicts().then_some(Contradiction { cloud, effect, gain, se, size_db })
}

/// The clouds whose held-out patches laws of their own predict better than those of all, beyond doubt and by more than
/// structure that counts beside a largest effect of this size, dB. Effects stay.
fn laws_apart(scorer: &Scorer, state: &State, largest_db: f64) -> Vec<Contradiction> {
    let mut found = Vec::new();
    let held: Vec<usize> = (state.space.base_len()..state.fit.at.len()).collect();
    for (scan, range) in parts(scorer.problem.shots) {
        let number = usize::from(scan);
        let (shared, folds) =
            (scorer.problem.shared.part(range.clone()), scorer.folds.part(range.clone()));
        let problem = Problem {
            shots: &scorer.problem.shots[range.clone()],
            observations: &scorer.problem.observations[range.clone()],
            alarms: &scorer.problem.alarms[number..=number],
            shared: &shared,
            ..scorer.problem
        };
        let alone = Scorer { problem, folds: &folds, settings: scorer.settings };
        let fit = problem.fit(&state.space, &state.fit.at, &held, &SEARCH);
        let own = alone.held_out_but(&state.space, &fit.at, &held);
        let joint = &state.held_out.shots[range];
        let gains: Vec<f64> = own.shots.iter().zip(joint).map(|(a, b)| a.ln_p - b.ln_p).collect();
        let [gain, se] = folds.sum(&gains);
        let [before, after] = [&state.fit.at, &fit.at].map(|at| problem.predict(&state.space, at));
        let size_db = Size::of(problem.observations, &before, &after).mean_db;
        let counts = scorer.settings.least_gain.max(NO_DOUBT * se);
        if gain > counts && size_db >= scorer.least_structure_db(largest_db) {
            found.push(Contradiction { cloud: number + 1, effect: None, gain, se, size_db });
        }
    }
    found
}
