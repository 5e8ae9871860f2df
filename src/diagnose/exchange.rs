//! Effects against rivals that did nearly as well when they were chosen, and against a more flexible member of their own
//! family: effects added later may have made the difference clear.

use super::clouds;
use super::evidence::{Evidence, Largest};
use super::explanation::{Addition, Explanation};
use super::scorer::{Scorer, State};
use super::settings::gain_of_starts;
use super::support::{Judge, is_as_good};
use super::trial::{Search, Trial};
use crate::effects::Effect;

/// Compares each of several effects with its rivals, and replaces it by a better one.
pub(super) fn exchange<'a>(search: &Search, model: &mut Explanation<'a>) {
    if model.added.len() < 2 {
        return;
    }
    for _ in 0..model.added.len() {
        // The first effect becomes the last, where a new one is added.
        let mut one = model.added.remove(0);
        (model.state.space, model.state.fit.at) = model.state.space.rotated(&model.state.fit.at);
        let mut rivals = std::mem::take(&mut one.rivals);
        let (others, _) = model.state.space.without(&model.state.fit.at, model.added.len());
        rivals.retain(|rival| !others.has(rival.name(), rival.scans()));
        if !rivals.is_empty() {
            let without = search.scorer.without(&model.state, model.added.len());
            let largest = model.largest();
            for rival in rivals {
                contest(search, &without, &mut model.state, &mut one, rival, largest);
            }
        }
        model.added.push(one);
    }
}

/// Compares the last effect of a model with another, which replaces it if it is better and
/// supported by itself.
fn contest<'a>(
    search: &Search,
    without: &State<'a>,
    state: &mut State<'a>,
    last: &mut Addition<'a>,
    rival: &'a dyn Effect,
    largest: Largest,
) {
    let scorer = &search.scorer;
    last.class.retain(|name| *name != rival.name());
    let Some(mut trial) = search.trial(without, rival) else { return };
    let judge = Judge::new(*scorer, without, largest);
    let Some((held_out, _)) = judge.support(&mut trial) else { return };
    let Trial { space, fit, mut candidate, tried, .. } = trial;
    let with_rival = scorer.settle(without, space, fit, held_out);
    candidate.held_out = Some(scorer.difference(&with_rival.held_out, &without.held_out));
    candidate.by_cloud = clouds::gains(scorer, &with_rival.held_out, &without.held_out);
    if candidate.is_excluded() {
        return;
    }
    // Of effects that predict equally well the one that is worth more is better.
    let [better, se] = scorer.difference(&with_rival.held_out, &state.held_out);
    let ahead = counted(scorer, &with_rival, without) - counted(scorer, state, without);
    let errors = scorer.settings.standard_errors;
    let is_tied =
        is_as_good([better, se], ahead, errors) && is_as_good([-better, se], -ahead, errors);
    let by_starts = gain_of_starts(tried);
    let own = scorer.worth(state) - last.by_starts;
    let other = scorer.worth(&with_rival) - by_starts;
    let is_better = if is_tied { other > own } else { better > 0.0 };
    let mut loser = rival.name();
    if is_better {
        let placebo_gain = judge.placebo_gain(candidate.numbers);
        if candidate.gain <= placebo_gain {
            return;
        }
        candidate.placebo_gain = Some(placebo_gain);
        loser = state.space.effects.last().map_or(loser, |effect| effect.name());
        last.evidence = Evidence::from(&candidate);
        last.by_starts = by_starts;
        *state = with_rival;
    }
    let is_other = state.space.effects.last().is_some_and(|effect| effect.name() != loser);
    if is_tied && is_other {
        last.class.push(loser);
    } else if is_better {
        last.class.clear();
    }
}

/// The gain of a model over another that counts: that of the fit bounds that of held-out shots.
fn counted(scorer: &Scorer, state: &State, without: &State) -> f64 {
    let [held_out, _] = scorer.difference(&state.held_out, &without.held_out);
    held_out.min(state.fit.ln_likelihood - without.fit.ln_likelihood)
}
