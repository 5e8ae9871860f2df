//! Terms one by one: fitted with everything else, and added when they predict held-out angles.

use nalgebra::DVector;
use rayon::prelude::*;
use serde::Serialize;

use super::folds::Folds;
use super::model::{Fitted, Model, Scored};
use super::points::Points;
use super::terms::Term;
use super::{CurveDiagnosis, CurveEvidence};

/// Starts of a term that are followed to their end.
const FOLLOWED: usize = 3;
/// Terms of a round that are judged on held-out angles.
const SHORT_LIST: usize = 5;
/// Held-out ln p by which one term must beat another to be told from it, besides one standard error.
const SAME: f64 = 2.0;

/// A term in one round.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Ranked {
    /// Round, from 1.
    pub round: usize,
    /// The term.
    pub name: &'static str,
    /// Its numbers.
    pub numbers: usize,
    /// Gain in ln likelihood over the model before.
    pub gain: f64,
    /// Gain in ln p of held-out angles and its standard error; none off the short list.
    pub held_out: Option<[f64; 2]>,
    /// Root mean square change of the levels, dB.
    pub size_db: f64,
    /// Whether its fit converged.
    pub converged: bool,
    /// Whether it was added.
    pub accepted: bool,
}

/// A model, its fit to everything, and its fits to everything but a fold.
#[derive(Clone)]
pub(super) struct State {
    pub model: Model,
    pub fitted: Fitted,
    pub of_fold: Vec<Fitted>,
    pub held_out: Vec<Scored>,
}

/// A term that was added, before the numbers of the last fit are known.
pub(super) struct Added {
    pub term: &'static dyn Term,
    pub class: Vec<&'static str>,
    pub evidence: CurveEvidence,
}

#[derive(Clone, Copy)]
pub(super) struct Selection<'a> {
    pub points: &'a Points,
    pub folds: &'a Folds,
    pub settings: &'a CurveDiagnosis,
}

struct Trial {
    term: &'static dyn Term,
    ranked: Ranked,
    state: Option<State>,
    model: Model,
    fitted: Fitted,
}

impl Selection<'_> {
    /// A fitted model with its held-out scores.
    pub fn state(&self, model: Model, fitted: Fitted) -> State {
        let points = &self.points.points;
        let of_fold: Vec<Fitted> = (0..self.folds.folds)
            .into_par_iter()
            .map(|fold| {
                let used: Vec<bool> = self.folds.fold.iter().map(|f| *f != fold).collect();
                model.fit(self.points, &used, &fitted.at)
            })
            .collect();
        let scored: Vec<Vec<Scored>> =
            of_fold.iter().map(|fitted| model.scored(fitted, points)).collect();
        let held_out = self
            .folds
            .fold
            .iter()
            .enumerate()
            .filter_map(|(index, &fold)| scored.get(fold)?.get(index).copied())
            .collect();
        State { model, fitted, of_fold, held_out }
    }

    /// Adds terms while one is supported.
    pub fn run(
        &self,
        mut state: State,
        terms: &[&'static dyn Term],
    ) -> (State, Vec<Ranked>, Vec<Added>) {
        let (mut ranking, mut added) = (Vec::new(), Vec::<Added>::new());
        for round in 1..=self.settings.most_terms + 1 {
            let is_new = |term: &&&'static dyn Term| {
                added.iter().all(|added| added.term.name() != term.name())
            };
            let left: Vec<&'static dyn Term> = terms.iter().filter(is_new).copied().collect();
            let mut trials = self.trials(round, &state, &left);
            let best = match round <= self.settings.most_terms {
                true => self.best(&trials),
                false => None,
            };
            let chosen = best.map(|index| {
                let class = self.class(&trials, index);
                let trial = &mut trials[index];
                trial.ranked.accepted = true;
                let [held_out_gain, held_out_se] = trial.ranked.held_out.unwrap_or_default();
                let Ranked { gain, size_db, .. } = trial.ranked;
                let evidence = CurveEvidence { gain, held_out_gain, held_out_se, size_db };
                added.push(Added { term: trial.term, class, evidence });
                trial.state.take()
            });
            ranking.extend(trials.into_iter().map(|trial| trial.ranked));
            match chosen.flatten() {
                Some(next) => state = next,
                None => break,
            }
        }
        (state, ranking, added)
    }

    /// Every term with the model, best gain first; the first few with their held-out scores.
    fn trials(&self, round: usize, state: &State, terms: &[&'static dyn Term]) -> Vec<Trial> {
        let mut trials: Vec<Trial> =
            terms.par_iter().map(|term| self.trial(round, state, *term)).collect();
        trials.sort_by(|a, b| b.ranked.gain.total_cmp(&a.ranked.gain));
        let least_gain = self.settings.least_gain;
        for trial in trials.iter_mut().take(SHORT_LIST).filter(|t| t.ranked.gain >= least_gain) {
            let with = self.state(trial.model.clone(), trial.fitted.clone());
            trial.ranked.held_out = Some(self.gain(&state.held_out, &with.held_out));
            trial.state = Some(with);
        }
        trials
    }

    fn trial(&self, round: usize, state: &State, term: &'static dyn Term) -> Trial {
        let points = self.points;
        let all = vec![true; points.points.len()];
        let model = state.model.with(term);
        let joined = |values: Vec<f64>| {
            let steps = term.parameters().iter().zip(values).map(|(knob, value)| value / knob.step);
            let law = state.fitted.at.iter().copied();
            DVector::from_vec(law.chain(steps).collect())
        };
        let misfit = |at: &DVector<f64>| -> f64 {
            let levels = model.levels_db(at, &points.points);
            let pairs = points.points.iter().zip(levels).filter(|(point, _)| !point.censored);
            pairs.map(|(point, db)| (point.f_db - db).powi(2)).sum()
        };
        let mut starts: Vec<(f64, DVector<f64>)> =
            term.starts().into_iter().map(joined).map(|at| (misfit(&at), at)).collect();
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let absent = joined(term.parameters().iter().map(|knob| knob.absent).collect());
        let fits = starts.iter().take(FOLLOWED).map(|(_, at)| model.fit(points, &all, at));
        let fitted = fits
            .max_by(|a, b| a.log_p.total_cmp(&b.log_p))
            .unwrap_or_else(|| model.fit(points, &all, &absent));
        let [before, after] = [
            state.model.levels_db(&state.fitted.at, &points.points),
            model.levels_db(&fitted.at, &points.points),
        ];
        let squares: f64 = before.iter().zip(&after).map(|(a, b)| (a - b).powi(2)).sum();
        let ranked = Ranked {
            round,
            name: term.name(),
            numbers: term.parameters().len(),
            gain: fitted.log_p - state.fitted.log_p,
            held_out: None,
            size_db: (squares / before.len().max(1) as f64).sqrt(),
            converged: fitted.converged,
            accepted: false,
        };
        Trial { term, ranked, state: None, model, fitted }
    }

    /// The supported term with the largest held-out gain.
    fn best(&self, trials: &[Trial]) -> Option<usize> {
        let gain = |trial: &Trial| trial.ranked.held_out.map_or(0.0, |[gain, _]| gain);
        (0..trials.len())
            .filter(|&index| self.is_supported(&trials[index].ranked))
            .max_by(|&a, &b| gain(&trials[a]).total_cmp(&gain(&trials[b])))
    }

    fn is_supported(&self, ranked: &Ranked) -> bool {
        let enough =
            |[gain, se]: [f64; 2]| gain > self.settings.standard_errors * se && gain > SAME;
        ranked.held_out.is_some_and(enough) && ranked.size_db >= self.settings.least_size_db
    }

    /// Other supported terms that predict held-out angles as well as the best.
    fn class(&self, trials: &[Trial], best: usize) -> Vec<&'static str> {
        let Some(winner) = trials.get(best).and_then(|trial| trial.state.as_ref()) else {
            return Vec::new();
        };
        let as_good = |trial: &&Trial| {
            let Some(state) = &trial.state else { return false };
            let [behind, se] = self.gain(&state.held_out, &winner.held_out);
            self.is_supported(&trial.ranked) && behind <= SAME.max(se)
        };
        let others = trials.iter().enumerate().filter(|(index, _)| *index != best);
        others.map(|(_, trial)| trial).filter(as_good).map(|trial| trial.ranked.name).collect()
    }

    /// Gain in ln p of held-out angles and its standard error over runs.
    pub fn gain(&self, before: &[Scored], after: &[Scored]) -> [f64; 2] {
        let gains: Vec<f64> = before.iter().zip(after).map(|(b, a)| a.log_p - b.log_p).collect();
        self.folds.sum(&gains)
    }
}
