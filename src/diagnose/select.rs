//! Which effect a model lacks: all are tried, and one is believed if it predicts what it has not seen.
//!
//! Every effect is screened on a sample of the shots; those that promise enough are fitted together with
//! the base, first on the sample, the best few on all shots. These predict held-out patches from fits
//! without them. One is accepted when that gain, or the one in the fit if it is less, is more than two
//! standard errors over patches (or, for what shifts means in one small place, far beyond chance and
//! found again where it was not fitted), held-out errors do not grow, its gain in the fit beats that of
//! placebos and a stated least, and it changes the data by a stated least size. Where placebos beat all, two that predict held-out patches are tried together: each alone is a
//! worse picture of both than a wave.

use std::cell::OnceCell;

use nalgebra::DVector;
use serde::Serialize;

use super::covariates::covariates;
use super::field::{Field, Structure, scaled, terms};
use super::folds::Folds;
use super::placebo::Placebo;
use super::refit::{Fitted, Problem, Space, sum};
use super::residual::{self, Unexplained, speckle_sd_db};
use super::score::{DB, Scored, scored};
use super::screen::{Sample, Screen};
use super::support::{Claim, Largest, Left};
use super::trial::Trial;
use super::{Diagnosis, Evidence};
use crate::effects::{Effect, EffectParameter, Prediction, Receiver};
use crate::fit::minimise::Minimise;

/// Steps of a fit, and of one on the sample that only shows whether an effect is worth it.
pub(super) const SEARCH: Minimise = Minimise { iterations: 20, tolerance: 0.1, patience: PATIENCE };
pub(super) const SCOUT: Minimise = Minimise { iterations: 12, tolerance: 0.1, patience: PATIENCE };
/// After so many steps in a row without an improvement the next would be a thousandth of a full one, or less.
const PATIENCE: usize = 8;
/// An effect that changes less than this share of what the largest does may be the error of its form.
pub(super) const SHARE_OF_LARGEST: f64 = 0.2;
/// Structure that is left, likewise.
pub(super) const SHARE_OF_FORM: f64 = 0.25;
/// Standard errors by which a field's held-out gain must exceed nothing.
const FIELD_ERRORS: f64 = 3.0;
/// Probability by chance of what neighbours have in common.
const CHANCE: f64 = 1e-3;
/// Effects of one round of which pairs are tried.
const MOST_PAIRED: usize = 4;
/// Difference in ln p of all held-out shots that tells no two effects apart: odds of twenty to one.
pub(super) const SAME: f64 = 3.0;
/// Share of the best held-out gain that others reach which may yet prove better.
const SHARE_OF_RIVAL: f64 = 0.9;
/// Others of each effect that are tried again.
const MOST_RIVALS: usize = 2;
/// Looks of a first fit of the base, that is not caught far from the data, and of the question whether it
/// is of the right target at all.
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
    /// Whether that is from a sample of the shots, too little to be fitted to all of them.
    pub sampled: bool,
    /// Largest gain of a placebo with as many numbers, at most six; only for effects on the short list.
    pub placebo_gain: Option<f64>,
    /// Gain in ln p of held-out patches and its standard error; only for effects on the short list.
    pub held_out: Option<[f64; 2]>,
    /// What it changes: root mean square of mean powers, or of the spread, dB.
    pub size_db: f64,
    /// Whether the fit converged.
    pub converged: bool,
    /// Whether it was added in this round and stayed.
    pub accepted: bool,
}

/// What the selection ends with.
pub(super) struct Selected<'a> {
    pub state: State<'a>,
    /// Every effect of every round.
    pub ranking: Vec<Candidate>,
    /// What was added and stayed, in the order of the model's effects.
    pub added: Vec<Added<'a>>,
    /// What a field finds beside it.
    pub structure: Structure,
}

/// A model, fitted to all shots and by folds.
#[derive(Clone)]
pub(super) struct State<'a> {
    pub space: Space<'a>,
    pub fitted: Fitted,
    /// Every shot, predicted by a fit without its fold.
    pub held_out: Vec<Scored>,
}

/// An effect that was added.
pub(super) struct Added<'a> {
    pub class: Vec<&'static str>,
    pub evidence: Evidence,
    /// Others that did nearly as well.
    pub rivals: Vec<&'a dyn Effect>,
}

/// The effect of a round that is to be added.
struct Chosen<'a> {
    trial: usize,
    held_out: Vec<Scored>,
    /// Names that predict as well.
    class: Vec<&'static str>,
    rivals: Vec<&'a dyn Effect>,
}

/// All that the selection needs.
pub(super) struct Selection<'p> {
    pub problem: Problem<'p>,
    /// Some of its shots, for a first view.
    pub sample: &'p Sample,
    pub folds: &'p Folds,
    pub settings: &'p Diagnosis,
    /// Told in a few words what is being done.
    pub hear: &'p (dyn Fn(&str) + Sync),
}

impl Selection<'_> {
    /// The model without effects.
    pub fn base<'a>(&self, space: Space<'a>) -> State<'a> {
        let receiver = wide(self.problem.receiver);
        let wide = Problem { receiver, ..self.sample.problem(&self.problem) };
        let near = wide.fit(&space, &space.start(), &[], &SEARCH).at;
        // The scene's own laws may be right already, as for a cloud without speckle that it rendered.
        let ln_p = |at: &DVector<f64>| sum(&self.problem.terms(&space, at));
        let start = if ln_p(&near) > ln_p(&space.start()) { near } else { space.start() };
        let fitted = self.problem.fit(&space, &start, &[], &SEARCH);
        let held_out = self.held_out(&space, &fitted.at);
        State { space, fitted, held_out }
    }

    /// Adds effects until none passes, and takes away what the others made superfluous or what is
    /// smaller than the structure that is left.
    pub fn run<'a>(&self, base: State<'a>, effects: &[&'a dyn Effect]) -> Selected<'a> {
        let (mut ranking, mut added) = (Vec::new(), Vec::new());
        let mut state = base.clone();
        for round in 1.. {
            if added.len() >= self.settings.most_effects {
                break;
            }
            let largest = Largest::of(&added);
            let mut trials = self.trials(&state, effects, round, largest);
            let chosen = self.chosen(&state, &mut trials, largest);
            let Some(Chosen { trial: index, held_out, class, rivals }) = chosen else {
                let pair = match added.len() + 2 <= self.settings.most_effects {
                    true => self.pair(&state, &mut trials),
                    false => None,
                };
                ranking.extend(trials.into_iter().map(|trial| trial.candidate));
                let Some((both, next)) = pair else { break };
                added.extend(both);
                state = next;
                continue;
            };
            if let Some(trial) = trials.get_mut(index) {
                trial.candidate.accepted = true;
                let space = trial.space.clone();
                let (fitted, held_out) = self.settled(&state, &space, &trial.fitted, held_out);
                state = State { space, fitted, held_out };
                let Candidate { gain, size_db, .. } = trial.candidate;
                let [held_out_gain, held_out_se] = trial.candidate.held_out.unwrap_or_default();
                let placebo_gain = trial.candidate.placebo_gain.unwrap_or_default();
                let evidence = Evidence { gain, placebo_gain, held_out_gain, held_out_se, size_db };
                added.push(Added { class, evidence, rivals });
            }
            ranking.extend(trials.into_iter().map(|trial| trial.candidate));
        }
        (self.hear)("asking what each effect is needed for");
        self.exchange(&mut state, &mut added);
        self.prune(&mut state, &mut added);
        let mut structure = self.structure(&state);
        let had_some = !added.is_empty();
        while let Some(least) = smallest(&added)
            && self.is_structured(&structure, 0.0)
            && added[least].evidence.size_db < structure.size_db
        {
            let without = self.without(&state, least);
            let left = self.structure(&without);
            // What predicts more than any field of the means is no error of their form.
            let [gain, _] = self.difference(&state.held_out, &without.held_out);
            if gain > left.gain[0] {
                break;
            }
            (state, structure) = (without, left);
            added.remove(least);
        }
        // What is fitted anew without its effects differs from the base in the last digits.
        if had_some && added.is_empty() {
            state = base;
            structure = self.structure(&state);
        }
        added.iter_mut().for_each(|one| one.class.retain(|name| !state.space.has(name)));
        ranking.iter_mut().for_each(|one| one.accepted &= state.space.has(one.name));
        Selected { state, ranking, added, structure }
    }

    /// The fit of an effect that is taken in, with everything free that its trial held, and its held-out
    /// shots.
    pub(super) fn settled(
        &self,
        before: &State,
        space: &Space,
        trial: &Fitted,
        mut held_out: Vec<Scored>,
    ) -> (Fitted, Vec<Scored>) {
        let mut fitted = trial.clone();
        if !before.space.costly(&before.fitted.at).is_empty() {
            fitted = self.problem.fit(space, &fitted.at, &[], &SCOUT);
            held_out = self.held_out(space, &fitted.at);
        }
        // Laws that were fitted without the effect may be far from any that go with it.
        let (start, held) = (space.restarted(&fitted.at), space.costly(&fitted.at));
        let again = self.problem.fit(space, &start, &held, &SEARCH);
        let gain = again.ln_likelihood - fitted.ln_likelihood;
        let has_arrived = again.converged && !fitted.converged && gain >= -SEARCH.tolerance;
        if gain > SEARCH.tolerance || has_arrived {
            fitted = match held.is_empty() {
                true => again,
                false => self.problem.fit(space, &again.at, &[], &SCOUT),
            };
            held_out = self.held_out(space, &fitted.at);
        }
        (fitted, held_out)
    }

    /// Whether what a field finds is more than chance and more than a law's form may be off.
    pub fn is_structured(&self, structure: &Structure, largest_db: f64) -> bool {
        let [gain, se] = structure.gain;
        let least_db = self.settings.least_structure_db.max(SHARE_OF_FORM * largest_db);
        gain > FIELD_ERRORS * se && structure.size_db >= least_db
    }

    /// Whether what neighbours have in common is more than chance and than a law's form may be off.
    pub fn is_shared(&self, neighbours: &Unexplained, largest_db: f64) -> bool {
        let least_db = self.settings.least_structure_db.max(SHARE_OF_FORM * largest_db);
        neighbours.p_value < CHANCE && neighbours.strength_db >= least_db
    }

    /// What neighbours have in common beyond a model, dB.
    pub(super) fn shared_db(&self, state: &State) -> f64 {
        let problem = &self.problem;
        let prediction = problem.predict(&state.space, &state.fitted.at);
        let z =
            residual::z(&prediction, problem.declared, problem.observations, self.settings.seed);
        let sd_db = speckle_sd_db(prediction.receiver.looks);
        let spot_m = problem.stage.geometry.radar.spot_diameter_m;
        residual::of_neighbours(&z, problem.shots, spot_m, sd_db, self.folds).strength_db
    }

    /// The field beside a model.
    pub(super) fn structure(&self, state: &State) -> Structure {
        let problem = &self.problem;
        let prediction = problem.predict(&state.space, &state.fitted.at);
        let covariates = covariates(problem.shots, &prediction, problem.observations);
        let laws = problem.mean_slopes(&state.space, &state.fitted.at);
        Field::new(problem.shots, &covariates).structure(problem, &prediction, &laws, self.folds)
    }

    /// A fit of one more term, and its held-out gain with the standard error.
    pub fn fitted(&self, base: &State, space: &Space, start: &DVector<f64>) -> (Fitted, [f64; 2]) {
        let fitted = self.problem.fit(space, start, &[], &SCOUT);
        let held_out = self.held_out(space, &fitted.at);
        (fitted, self.difference(&held_out, &base.held_out))
    }

    /// The model without one of its effects.
    pub(super) fn without<'a>(&self, state: &State<'a>, index: usize) -> State<'a> {
        let (space, start) = state.space.without(&state.fitted.at, index);
        let fitted = self.problem.fit(&space, &start, &[], &SEARCH);
        let held_out = self.held_out(&space, &fitted.at);
        State { space, fitted, held_out }
    }

    /// Takes away effects that the later ones made superfluous.
    fn prune(&self, state: &mut State, added: &mut Vec<Added>) {
        while added.len() > 1 {
            let mut losses: Vec<(usize, State, f64, bool)> = (0..added.len())
                .map(|index| {
                    let without = self.without(state, index);
                    let loss = state.fitted.ln_likelihood - without.fitted.ln_likelihood;
                    let [gain, se] = self.difference(&state.held_out, &without.held_out);
                    let sizes_db = self.sizes_db(&without, &state.space, &state.fitted.at);
                    let numbers = state.space.effects[index].parameters().len();
                    let is_needed = self.is_supported(&Claim {
                        gain: loss,
                        least: self.settings.least_gain_of(numbers, 1),
                        held_out: [gain, se],
                        sizes_db,
                        share_of_size: SHARE_OF_LARGEST,
                        largest: Largest::of(added),
                    });
                    (index, without, loss, is_needed)
                })
                .collect();
            losses.sort_by(|a, b| a.2.total_cmp(&b.2));
            match losses.into_iter().find(|(.., is_needed)| !is_needed) {
                Some((index, without, ..)) => {
                    *state = without;
                    added.remove(index);
                }
                None => return,
            }
        }
    }

    /// The effect to add.
    fn chosen<'a>(
        &self,
        state: &State<'a>,
        trials: &mut [Trial<'a>],
        largest: Largest,
    ) -> Option<Chosen<'a>> {
        let mut passed: Vec<(usize, Vec<Scored>, f64)> = Vec::new();
        let left = Left::default();
        for (index, trial) in trials.iter_mut().enumerate().filter(|t| !t.1.candidate.sampled) {
            if let Some((held_out, gain)) = self.support(state, trial, largest, &left) {
                passed.push((index, held_out, gain));
            }
        }
        passed.sort_by(|a, b| b.2.total_cmp(&a.2));
        let screen = OnceCell::new();
        let mut beats_placebos = |index: usize| {
            let Some(Trial { effect, candidate, .. }) = trials.get_mut(index) else { return false };
            let new = || Screen::new(self.problem, &state.space, &state.fitted.at);
            let placebo =
                self.placebo_gain(state, screen.get_or_init(new), effect.parameters().len());
            candidate.placebo_gain = Some(placebo);
            candidate.gain > placebo
        };
        while passed.first().is_some_and(|best| !beats_placebos(best.0)) {
            passed.remove(0);
        }
        let first = passed.first()?;
        // Of those that the data do not tell apart the simplest comes first, by the rule of one standard error,
        // and of equally simple ones the likelier.
        let is_tied = |other: &&(usize, Vec<Scored>, f64)| {
            let [worse, se] = self.difference(&first.1, &other.1);
            worse <= se.max(SAME)
        };
        let mut tied: Vec<_> = passed.iter().filter(is_tied).collect();
        tied.retain(|one| one.0 == first.0 || beats_placebos(one.0));
        let count = |one: &&&(usize, Vec<Scored>, f64)| {
            let Trial { space, fitted, .. } = &trials[one.0];
            numbers(space, &fitted.at)
        };
        let best = *tied.iter().min_by_key(count)?;
        let class = tied.iter().filter(|other| other.0 != best.0);
        let class = class.map(|one| trials[one.0].candidate.name).collect();
        let rivals =
            passed.iter().filter(|one| one.0 != best.0 && one.2 >= SHARE_OF_RIVAL * first.2);
        let rivals = rivals.take(MOST_RIVALS).map(|one| trials[one.0].effect).collect();
        Some(Chosen { trial: best.0, held_out: best.1.clone(), class, rivals })
    }

    /// Two effects of which each predicts held-out patches but does worse than placebos, because these
    /// fit what the other does, too; together they must do better than placebos.
    fn pair<'a>(
        &self,
        state: &State<'a>,
        trials: &mut [Trial<'a>],
    ) -> Option<([Added<'a>; 2], State<'a>)> {
        let errors = self.settings.standard_errors;
        let is_beaten = |trial: &&Trial| {
            let Candidate { gain, placebo_gain, held_out, .. } = trial.candidate;
            let predicts = held_out.is_some_and(|[gain, se]| gain > errors * se);
            predicts && placebo_gain.is_some_and(|placebo| gain <= placebo)
        };
        let beaten: Vec<&Trial> = trials.iter().filter(is_beaten).take(MOST_PAIRED).collect();
        let pairs = beaten
            .iter()
            .enumerate()
            .flat_map(|(i, a)| beaten.iter().skip(i + 1).map(move |b| [*a, *b]));
        let fits = pairs.map(|[a, b]| {
            let space = a.space.with(b.effect);
            let start = a.fitted.at.iter().chain(b.fitted.at.iter().skip(state.fitted.at.len()));
            let start = DVector::from_vec(start.copied().collect());
            (self.problem.fit(&space, &start, &[], &SCOUT), space, [a, b])
        });
        let (fitted, space, pair) =
            fits.max_by(|a, b| a.0.ln_likelihood.total_cmp(&b.0.ln_likelihood))?;
        let gain = fitted.ln_likelihood - state.fitted.ln_likelihood;
        let screen = Screen::new(self.problem, &state.space, &state.fitted.at);
        let numbers = pair.iter().map(|trial| trial.candidate.numbers).sum();
        let placebo_gain = self.placebo_gain(state, &screen, numbers);
        let held_out = self.held_out(&space, &fitted.at);
        let beyond = |trial: &Trial| {
            self.difference(&held_out, &self.held_out(&trial.space, &trial.fitted.at))
        };
        let are_needed = pair.iter().all(|trial| {
            let [gain, se] = beyond(trial);
            gain > errors * se
        });
        if gain <= placebo_gain || !are_needed {
            return None;
        }
        // Each has the evidence of both: alone it has none.
        let [held_out_gain, held_out_se] = self.difference(&held_out, &state.held_out);
        let added = pair.map(|trial| {
            let size_db = trial.candidate.size_db;
            let evidence = Evidence { gain, placebo_gain, held_out_gain, held_out_se, size_db };
            Added { class: Vec::new(), evidence, rivals: Vec::new() }
        });
        let names = pair.map(|trial| trial.candidate.name);
        for trial in trials.iter_mut().filter(|trial| names.contains(&trial.candidate.name)) {
            trial.candidate.accepted = true;
        }
        Some((added, State { space, fitted, held_out }))
    }

    /// What an effect gains where the means are already corrected by a field: scatter that is only
    /// structure of the means gains nothing there.
    pub(super) fn gain_beside(&self, state: &State, trial: &Trial, structure: &Structure) -> f64 {
        let ln_p = |space: &Space, fitted: &Fitted| {
            let prediction = self.problem.predict(space, &fitted.at);
            sum(&terms(&self.problem, &prediction, &structure.ln_factor))
        };
        ln_p(&trial.space, &trial.fitted) - ln_p(&state.space, &state.fitted)
    }

    /// Sum over all shots of a difference in ln p, and its standard error over patches.
    pub(super) fn difference(&self, a: &[Scored], b: &[Scored]) -> [f64; 2] {
        let differences: Vec<f64> = a.iter().zip(b).map(|(a, b)| a.ln_p - b.ln_p).collect();
        self.folds.sum(&differences)
    }

    /// What a placebo with so many numbers promises.
    pub(super) fn placebo_gain(&self, state: &State, screen: &Screen, numbers: usize) -> f64 {
        let placebo = Placebo::new(numbers, self.settings.seed);
        let mut space = state.space.clone();
        space.effects.push(&placebo);
        let knobs = placebo.parameters();
        let only = |k: usize| {
            let values: Vec<f64> = knobs
                .iter()
                .enumerate()
                .map(|(i, knob)| if i == k { knob.step } else { 0.0 })
                .collect();
            Space::joined(&state.fitted.at, &placebo, &values)
        };
        let starts: Vec<_> = (0..knobs.len()).map(only).collect();
        screen.promise_of_all(&space, &starts).max(0.0)
    }

    /// Every shot, predicted by a fit without its fold.
    pub(super) fn held_out(&self, space: &Space, at: &DVector<f64>) -> Vec<Scored> {
        self.held_out_with(space, at, &[])
    }

    /// The same with factors on the means, of which the logarithms are given.
    pub(super) fn held_out_with(
        &self,
        space: &Space,
        at: &DVector<f64>,
        ln_factor: &[f64],
    ) -> Vec<Scored> {
        let Problem { declared, observations, .. } = self.problem;
        let mut all: Vec<(usize, Scored)> = Vec::new();
        for (fold, at) in self.problem.fit_without(space, at, self.folds).enumerate() {
            let prediction = scaled(self.problem.predict(space, &at), ln_factor);
            let held_out = |shot: usize| self.folds.fold.get(shot) == Some(&fold);
            all.extend(scored(&prediction, declared, observations, &held_out));
        }
        all.sort_by_key(|(shot, _)| *shot);
        all.into_iter().map(|(_, scored)| scored).collect()
    }

    /// What a model with more effects changes, dB.
    pub fn sizes_db(&self, state: &State, space: &Space, at: &DVector<f64>) -> [f64; 2] {
        let before = self.problem.predict(&state.space, &state.fitted.at);
        sizes_db(&self.problem, &before, &self.problem.predict(space, at))
    }
}

/// The receiver with speckle in which nothing of the right target is far off.
pub(super) fn wide(receiver: Receiver) -> Receiver {
    Receiver { looks: receiver.looks.min(WIDE_LOOKS), ..receiver }
}

/// Root mean square change of the means of all detections, and change of the spread, dB.
pub(super) fn sizes_db(problem: &Problem, before: &Prediction, after: &Prediction) -> [f64; 2] {
    // Spreads add in squares.
    let wider = |a: f64, b: f64| (a * a - b * b).abs().sqrt();
    let [now, then] = [after, before].map(|p| speckle_sd_db(p.receiver.looks));
    let mean = |p: &Prediction, shot: usize| p.passed_w(shot).max(f64::MIN_POSITIVE).ln();
    let observations = problem.observations.iter().enumerate();
    let changes: Vec<f64> = observations
        .filter(|(_, o)| o.power_w.is_some())
        .map(|(shot, _)| DB * (mean(after, shot) - mean(before, shot)))
        .collect();
    let tilt = |p: &Prediction| {
        let spreads: Vec<f64> = (0..p.tilts.len()).map(|shot| p.tilt_spread(shot)).collect();
        DB * rms(&spreads)
    };
    [rms(&changes), wider(now, then).max(wider(tilt(after), tilt(before)))]
}

pub(super) fn larger([a, b]: [f64; 2]) -> f64 {
    a.max(b)
}

/// How many numbers of the last effect of a model are not where it is absent. Where a target stands every number
/// tells, however small.
pub(super) fn numbers(space: &Space, at: &DVector<f64>) -> usize {
    let Some((effect, values)) = space.effects.last().zip(space.effect_values(at).pop()) else {
        return 0;
    };
    let knobs = effect.parameters().iter().zip(values);
    let is_used = |(knob, value): &(&EffectParameter, f64)| (value - knob.absent).abs() > knob.step;
    knobs.filter(|number| effect.moves() || is_used(number)).count()
}

/// Which of the effects is the smallest.
fn smallest(added: &[Added]) -> Option<usize> {
    let sizes = added.iter().map(|a| a.evidence.size_db).enumerate();
    sizes.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(index, _)| index)
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|x| x * x).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
