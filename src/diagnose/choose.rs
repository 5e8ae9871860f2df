//! The choice of the effects that a model lacks.
//!
//! All effects are screened on a sample of the shots. Those that promise enough are fitted together with
//! the scattering models, first to the sample, the best few to all shots. These predict held-out patches from fits
//! without them. One is accepted under four conditions. Its held-out gain exceeds one and a half
//! standard errors over patches (or, for means that shift in one small place, is far beyond chance and found again where it
//! was not fitted). Held-out errors do not grow, unless that gain leaves no doubt. Its gain in the
//! fit beats that of placebos and a stated least. It changes the data by a stated least size. Where placebos beat all, two effects that
//! predict held-out patches are tried together: either alone describes both worse than a wave does.

use nalgebra::DVector;

use super::clouds;
use super::error::DiagnoseError;
use super::evidence::{Candidate, CloudGain, Evidence, Largest};
use super::exchange::exchange;
use super::explanation::{Addition, Explanation};
use super::field::Structure;
use super::refit::{Fit, SCOUT};
use super::scorer::{HeldOut, State};
use super::settings::gain_of_starts;
use super::space::Space;
use super::support::{Judge, is_as_good};
use super::trial::{Found, Search, Trial};
use crate::effects::Effect;

/// Effects of the last round that are tested for being real beside the strongest.
const MOST_HIDDEN: usize = 2;
/// Effects of one round of which pairs are tried.
const MOST_PAIRED: usize = 4;
/// Share of the best held-out gain from which an effect may yet prove better.
const SHARE_OF_RIVAL: f64 = 0.9;
/// Rivals of each effect that are tried again.
const MOST_RIVALS: usize = 2;

/// The result of the choice.
pub(super) struct Choice<'a> {
    /// The model without effects.
    pub base: State<'a>,
    pub model: Explanation<'a>,
    /// Every effect of every round.
    pub ranking: Vec<Candidate>,
    /// The structure that a field finds beside the model.
    pub structure: Structure,
    /// Effects that are supported but for their size beside the strongest.
    pub hidden: Vec<Candidate>,
    /// The effect with the largest gain that several clouds together support and one of them excludes.
    pub excluded: Option<Candidate>,
}

/// Adds effects until none is supported, and removes those that others made superfluous or that are
/// smaller than the structure that the model leaves.
///
/// # Errors
/// When the base is found at a better place time and again.
pub(super) fn choose_effects<'a>(
    search: &Search,
    mut base: State<'a>,
    effects: &[&'a dyn Effect],
) -> Result<Choice<'a>, DiagnoseError> {
    let scorer = &search.scorer;
    let (mut ranking, mut hidden, mut excluded) = (Vec::new(), Vec::new(), None);
    let mut model = Explanation { state: base.clone(), added: Vec::new() };
    let (mut round, mut starts, mut found) = (0, 1, Vec::new());
    while model.added.len() < scorer.settings.most_effects {
        round += 1;
        let mut trials = search.trials(&model.state, effects, round, model.largest(), &found);
        let has_grown =
            add_best(search, &mut model, &mut trials) || add_pair(search, &mut model, &mut trials);
        if !has_grown {
            excluded = excluded_by_a_cloud(search, &model, &mut trials);
            hidden = hidden_by_the_strongest(search, &model, &mut trials);
        }
        found = trials.iter().filter_map(|one| Found::of(one, scorer.settings)).collect();
        // Of each family the member that was accepted, or the best.
        let mut candidates: Vec<Candidate> =
            trials.into_iter().map(|trial| trial.candidate).collect();
        candidates.sort_by_key(|candidate| !candidate.accepted);
        let mut names = Vec::new();
        candidates.retain(|candidate| {
            let key = (candidate.name, candidate.scans.clone());
            let is_first = !names.contains(&key);
            names.push(key);
            is_first
        });
        candidates.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        ranking.extend(candidates);
        if !has_grown {
            break;
        }
        if let Some(better) = scorer.better_base(&base, &model.state) {
            if starts >= scorer.settings.most_starts {
                let gain = better.fit.ln_likelihood - base.fit.ln_likelihood;
                if gain > scorer.settings.least_gain {
                    return Err(DiagnoseError::SearchFailed { gain });
                }
                continue;
            }
            starts += 1;
            (search.notify)(
                "starting again: with an effect the laws have found a better place without it",
            );
            base = better;
            model = Explanation { state: base.clone(), added: Vec::new() };
            ranking.clear();
        }
    }
    (search.notify)("testing whether each effect is needed");
    exchange(search, &mut model);
    model.remove_superfluous(scorer);
    let had_some = !model.added.is_empty();
    let mut structure = model.remove_smaller_than_structure(scorer);
    // A model from which all effects were removed differs from the base in the last digits.
    if had_some && model.added.is_empty() {
        model.state = base.clone();
        structure = scorer.structure(&model.state);
    }
    let space = &model.state.space;
    model.added.iter_mut().for_each(|one| one.class.retain(|name| !space.has(name, &[])));
    ranking.iter_mut().for_each(|one| one.accepted &= space.has(one.name, &one.scans));
    // Without an effect nothing is hidden, and what was exchanged for another is not.
    hidden.retain(|one| !space.effects.is_empty() && !space.has(one.name, &one.scans));
    Ok(Choice { base, model, ranking, structure, hidden, excluded })
}

/// Effects that the data support by themselves, and that get no name because the strongest one is so much larger.
fn hidden_by_the_strongest<'a>(
    search: &Search,
    model: &Explanation<'a>,
    trials: &mut [Trial<'a>],
) -> Vec<Candidate> {
    let (scorer, mut found) = (&search.scorer, Vec::<Candidate>::new());
    if model.added.is_empty() {
        return found;
    }
    let judge = Judge::new(*scorer, &model.state, Largest::default());
    let least = |trial: &Trial| scorer.settings.least_gain_of(trial.candidate.numbers, trial.tried);
    let promising = trials.iter_mut().filter(|trial| trial.candidate.gain > least(trial));
    for trial in promising.take(MOST_HIDDEN) {
        if trial.candidate.sampled {
            search.refit(&model.state, trial);
        }
        if judge.support(trial).is_some()
            && trial.candidate.size_db >= scorer.settings.least_structure_db
            && judge.beats_placebos(trial)
            && !found.iter().any(|one| one.is_same(&trial.candidate))
        {
            found.push(trial.candidate.clone());
        }
    }
    found
}

/// The effect with the largest gain that beats placebos and that one of several clouds excludes.
fn excluded_by_a_cloud<'a>(
    search: &Search,
    model: &Explanation<'a>,
    trials: &mut [Trial<'a>],
) -> Option<Candidate> {
    let judge = Judge::new(search.scorer, &model.state, model.largest());
    for trial in trials.iter_mut().filter(|trial| trial.candidate.is_excluded()) {
        if judge.beats_placebos(trial) {
            return Some(trial.candidate.clone());
        }
    }
    None
}

/// A trial that the data support.
struct Contender {
    /// Its place among the trials.
    trial: usize,
    held_out: HeldOut,
    /// The gain that counts.
    gain: f64,
}

/// A contender with everything refitted that its trial kept fixed.
struct Settled<'a> {
    trial: usize,
    candidate: Candidate,
    /// What it is [worth](Scorer::worth), less what chance gives the best of its starts.
    worth: f64,
    state: State<'a>,
}

/// Adds the best trial that is supported; false where there is none.
fn add_best<'a>(search: &Search, model: &mut Explanation<'a>, trials: &mut [Trial<'a>]) -> bool {
    let scorer = &search.scorer;
    let judge = Judge::new(*scorer, &model.state, model.largest());
    let mut contenders = contenders(&judge, trials);
    while let Some(best) = contenders.first()
        && !judge.beats_placebos(&mut trials[best.trial])
    {
        contenders.remove(0);
    }
    let Some(first) = contenders.first() else { return false };
    // Of those that predict equally well, by the rule of one standard error, the one that is worth most is added.
    let mut tied = Vec::new();
    for other in &contenders {
        let worse = scorer.difference(&first.held_out, &other.held_out);
        if is_as_good(worse, first.gain - other.gain, scorer.settings.standard_errors)
            && (other.trial == first.trial || judge.beats_placebos(&mut trials[other.trial]))
        {
            tied.push(other);
        }
    }
    // Laws far from those stored may be as likely as near ones: each is judged by the nearer.
    let mut settled = Vec::new();
    for one in tied {
        let Trial { space, fit, candidate, tried, .. } = &trials[one.trial];
        let (space, fit, held_out) = (space.clone(), fit.clone(), one.held_out.clone());
        let state = scorer.settle(&model.state, space, fit, held_out);
        let worth = scorer.worth(&state) - gain_of_starts(*tried);
        settled.push(Settled { trial: one.trial, candidate: candidate.clone(), worth, state });
    }
    let most = settled.iter().max_by(|a, b| a.worth.total_cmp(&b.worth));
    let Some(best) = most else { return false };
    // Of its family the simplest member.
    let chosen = best.candidate.clone();
    let family = settled.iter().filter(|one| one.candidate.is_same(&chosen));
    let best = family.min_by_key(|one| one.candidate.numbers).map_or(best.trial, |one| one.trial);
    let mut class: Vec<&'static str> = Vec::new();
    for other in settled.iter().map(|one| one.candidate.name) {
        if other != chosen.name && !class.contains(&other) {
            class.push(other);
        }
    }
    // Beside other effects, a more flexible member of its family or another effect may prove better.
    let own = trials[best].candidate.numbers;
    let is_more_flexible = |one: &&Contender| {
        let Candidate { numbers, .. } = trials[one.trial].candidate;
        trials[one.trial].candidate.is_same(&chosen) && numbers > own
    };
    let others = contenders
        .iter()
        .filter(|one| !trials[one.trial].candidate.is_same(&chosen))
        .filter(|one| one.gain >= SHARE_OF_RIVAL * first.gain)
        .take(MOST_RIVALS);
    let rivals = contenders.iter().filter(is_more_flexible).take(1).chain(others);
    let rivals = rivals.map(|one| trials[one.trial].effect).collect();
    let candidate = &mut trials[best].candidate;
    candidate.accepted = true;
    let evidence = Evidence::from(&*candidate);
    let by_starts = gain_of_starts(trials[best].tried);
    model.added.push(Addition { class, evidence, by_starts, rivals });
    settled.retain(|one| one.trial == best);
    let Some(added) = settled.pop() else { return false };
    model.state = added.state;
    true
}

/// The trials that the data support, the one with the largest gain first.
fn contenders(judge: &Judge, trials: &mut [Trial]) -> Vec<Contender> {
    let mut contenders = Vec::new();
    for (index, trial) in trials.iter_mut().enumerate() {
        if !trial.candidate.sampled
            && let Some((held_out, gain)) = judge.support(trial)
        {
            contenders.push(Contender { trial: index, held_out, gain });
        }
    }
    let cases: Vec<&Trial> = contenders.iter().map(|one| &trials[one.trial]).collect();
    let is_needless = |one: &&Trial| cases.iter().any(|other| other.is_enough_for(one));
    let mut needless = cases.iter().map(is_needless).collect::<Vec<bool>>().into_iter();
    contenders.retain(|_| !needless.next().unwrap_or(false));
    contenders.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    contenders
}

/// Two effects in one fit.
struct Pair<'t, 'a> {
    trials: [&'t Trial<'a>; 2],
    space: Space<'a>,
    fit: Fit,
}

/// Adds two effects of which each predicts held-out patches but gains less than placebos, because these
/// also fit the part of the other. Together they must gain more than placebos. False where no pair does.
fn add_pair<'a>(search: &Search, model: &mut Explanation<'a>, trials: &mut [Trial<'a>]) -> bool {
    let scorer = &search.scorer;
    if model.added.len() + 2 > scorer.settings.most_effects {
        return false;
    }
    let Some(Pair { trials: pair, space, fit }) = best_pair(search, &model.state, trials) else {
        return false;
    };
    let gain = fit.ln_likelihood - model.state.fit.ln_likelihood;
    let numbers = pair.iter().map(|trial| trial.candidate.numbers).sum();
    let placebo_gain = Judge::new(*scorer, &model.state, model.largest()).placebo_gain(numbers);
    let next = scorer.state(space, fit);
    if gain <= placebo_gain || !are_both_needed(search, &next, pair) {
        return false;
    }
    // Each has the evidence of both: alone it has none.
    let [held_out_gain, held_out_se] = scorer.difference(&next.held_out, &model.state.held_out);
    let by_cloud = clouds::gains(scorer, &next.held_out, &model.state.held_out);
    if by_cloud.iter().any(CloudGain::contradicts) {
        return false;
    }
    for trial in pair {
        let size_db = trial.candidate.size_db;
        let by_cloud = by_cloud.clone();
        let evidence =
            Evidence { gain, placebo_gain, held_out_gain, held_out_se, size_db, by_cloud };
        let by_starts = gain_of_starts(trial.tried);
        model.added.push(Addition { class: Vec::new(), evidence, by_starts, rivals: Vec::new() });
    }
    model.state = next;
    let pair = pair.map(|trial| trial.candidate.clone());
    for trial in trials.iter_mut() {
        trial.candidate.accepted |= pair.iter().any(|one| one.is_same(&trial.candidate));
    }
    true
}

/// The likeliest pair of effects that predict held-out patches and gain less than placebos.
fn best_pair<'t, 'a>(
    search: &Search,
    state: &State<'a>,
    trials: &'t [Trial<'a>],
) -> Option<Pair<'t, 'a>> {
    let errors = search.scorer.settings.standard_errors;
    let mut beaten = Vec::new();
    for trial in trials {
        let Candidate { gain, placebo_gain, held_out, .. } = trial.candidate;
        let predicts = held_out.is_some_and(|[gain, se]| gain > errors * se);
        if predicts && placebo_gain.is_some_and(|placebo| gain <= placebo) {
            beaten.push(trial);
        }
    }
    beaten.truncate(MOST_PAIRED);
    let mut pairs = Vec::new();
    for (index, &a) in beaten.iter().enumerate() {
        for &b in beaten[index + 1..].iter().filter(|b| !b.candidate.is_same(&a.candidate)) {
            let space = a.space.with(b.effect);
            let start = a.fit.at.iter().chain(b.fit.at.iter().skip(state.fit.at.len()));
            let start = DVector::from_vec(start.copied().collect());
            let fit = search.scorer.problem.fit(&space, &start, &[], &SCOUT);
            pairs.push(Pair { trials: [a, b], space, fit });
        }
    }
    pairs.into_iter().max_by(|a, b| a.fit.ln_likelihood.total_cmp(&b.fit.ln_likelihood))
}

/// Whether a model with a pair of effects predicts held-out patches better than with either alone.
fn are_both_needed(search: &Search, both: &State, pair: [&Trial; 2]) -> bool {
    let scorer = &search.scorer;
    pair.iter().all(|trial| {
        let alone = scorer.held_out(&trial.space, &trial.fit.at);
        let [gain, se] = scorer.difference(&both.held_out, &alone);
        gain > scorer.settings.standard_errors * se
    })
}
