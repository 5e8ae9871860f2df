//! The choice of terms: one by one, fitted with everything else, and added when nothing is left with them or when they
//! predict held-out angles.

use nalgebra::DVector;
use rayon::prelude::*;

use super::evidence::{CurveEvidence, RankedTerm};
use super::folds::Folds;
use super::model::{Fit, Model, Score};
use super::points::Points;
use super::settings::CurveDiagnosis;
use super::terms::Term;

/// Starts of a term of which the first steps are taken.
const GLANCED: usize = 64;
/// Starts of a term that are followed to their end.
const FOLLOWED: usize = 8;
/// Terms of a round that are judged on held-out angles.
const SHORT_LIST: usize = 5;
/// How far one number of the law is moved to search again, in the coordinates of the search: levels and widths double.
const MOVED: f64 = std::f64::consts::LN_2;
/// Difference in held-out ln p below which two terms predict equally well; so does less than one standard error.
const SAME: f64 = 2.0;

/// A model, its fit to everything, and its fits to everything but a fold.
#[derive(Clone)]
pub(super) struct State {
    pub model: Model,
    pub fitted: Fit,
    /// Fits without each fold.
    pub of_fold: Vec<Fit>,
    /// Score of every point by the fit without its fold.
    pub held_out: Vec<Score>,
}

impl State {
    /// Schwarz's criterion, halved (Ann. Stat. 6 (1978) 461): of models that explain a curve the one with the least is the
    /// best.
    pub fn criterion(&self) -> f64 {
        0.5 * self.model.unknowns() as f64 * (self.held_out.len() as f64).ln() - self.fitted.log_p
    }
}

/// A term that was added.
pub(super) struct Addition {
    pub term: &'static dyn Term,
    pub class: Vec<&'static str>,
    pub evidence: CurveEvidence,
}

/// Chooses the terms of a curve.
#[derive(Clone, Copy)]
pub(super) struct Selection<'a> {
    pub points: &'a Points,
    pub folds: &'a Folds,
    pub settings: &'a CurveDiagnosis,
    /// Whether a model leaves no more than a known noise.
    pub leaves_nothing: &'a (dyn Fn(&Selection, &State) -> bool + Sync),
}

/// A fit of one more term.
struct Trial {
    term: &'static dyn Term,
    ranked: RankedTerm,
    state: Option<State>,
    leaves_nothing: bool,
    model: Model,
    fitted: Fit,
}

impl Selection<'_> {
    /// A fitted model with its held-out scores.
    pub fn state(&self, model: Model, fitted: Fit) -> State {
        let points = &self.points.points;
        let of_fold: Vec<Fit> = (0..self.folds.folds)
            .into_par_iter()
            .map(|fold| {
                let used: Vec<bool> = self.folds.fold.iter().map(|f| *f != fold).collect();
                model.fit(self.points, &used, &fitted.at)
            })
            .collect();
        let scored: Vec<Vec<Score>> =
            of_fold.iter().map(|fitted| model.scores(fitted, points)).collect();
        let held_out = self
            .folds
            .fold
            .iter()
            .enumerate()
            .filter_map(|(index, &fold)| scored.get(fold)?.get(index).copied())
            .collect();
        State { model, fitted, of_fold, held_out }
    }

    /// Adds terms while one is supported, and something is left.
    pub fn run(
        &self,
        mut state: State,
        terms: &[&'static dyn Term],
    ) -> (State, Vec<RankedTerm>, Vec<Addition>) {
        let (mut ranking, mut added) = (Vec::new(), Vec::<Addition>::new());
        for round in 1..=self.settings.most_terms + 1 {
            let mut left = terms.to_vec();
            left.retain(|term| added.iter().all(|added| added.term.name() != term.name()));
            let mut trials = self.trials(round, &state, &left);
            let best = self.best(&trials).filter(|_| round <= self.settings.most_terms);
            let is_last = best.is_some_and(|index| trials[index].leaves_nothing);
            let next = best.and_then(|index| {
                let class = self.class(&trials, index);
                let (addition, next) = trials[index].accept(class);
                added.push(addition);
                next
            });
            ranking.extend(trials.into_iter().map(|trial| trial.ranked));
            let Some(next) = next else { break };
            state = next;
            if is_last {
                break;
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
        trials.par_iter_mut().take(SHORT_LIST).for_each(|trial| self.search_again(state, trial));
        trials.sort_by(|a, b| b.ranked.gain.total_cmp(&a.ranked.gain));
        for trial in trials.iter_mut().take(SHORT_LIST).filter(|t| t.ranked.gain >= least_gain) {
            let with = self.state(trial.model.clone(), trial.fitted.clone());
            trial.ranked.held_out = Some(self.gain(&state.held_out, &with.held_out));
            trial.leaves_nothing = (self.leaves_nothing)(self, &with);
            trial.state = Some(with);
        }
        trials
    }

    /// A term fitted from its best starts.
    fn trial(&self, round: usize, state: &State, term: &'static dyn Term) -> Trial {
        let points = self.points;
        let all = vec![true; points.points.len()];
        let model = state.model.with(term);
        let mut starts: Vec<(f64, DVector<f64>)> = Vec::new();
        for values in term.starts() {
            let at = joined(&state.fitted.at, term, &values);
            starts.push((misfit(&model, &at, points), at));
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.truncate(GLANCED);
        for (left, at) in &mut starts {
            *at = model.glance(points, at);
            *left = misfit(&model, at, points);
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let fits = starts.iter().take(FOLLOWED).map(|(_, at)| model.fit(points, &all, at));
        let fitted = fits.max_by(|a, b| a.log_p.total_cmp(&b.log_p)).unwrap_or_else(|| {
            let absent: Vec<f64> = term.parameters().iter().map(|known| known.absent).collect();
            model.fit(points, &all, &joined(&state.fitted.at, term, &absent))
        });
        let ranked = RankedTerm {
            round,
            name: term.name(),
            numbers: term.parameters().len(),
            gain: fitted.log_p - state.fitted.log_p,
            held_out: None,
            size_db: self.size_db(state, &model, &fitted),
            converged: fitted.converged,
            accepted: false,
        };
        Trial { term, ranked, state: None, leaves_nothing: false, model, fitted }
    }

    /// Rms change of the levels by a model with one more term, dB.
    fn size_db(&self, state: &State, model: &Model, fitted: &Fit) -> f64 {
        let points = &self.points.points;
        let before = state.model.levels_db(&state.fitted.at, points);
        let after = model.levels_db(&fitted.at, points);
        let squares: f64 = before.iter().zip(&after).map(|(a, b)| (a - b).powi(2)).sum();
        (squares / before.len().max(1) as f64).sqrt()
    }

    /// Searches a term once more from laws beside the one found: the law without the term may lie in another valley.
    fn search_again(&self, state: &State, trial: &mut Trial) {
        let all = vec![true; self.points.points.len()];
        let coordinates = &trial.model.coordinates;
        let (lower, upper, numbers) =
            (coordinates.lower(), coordinates.upper(), 0..coordinates.len());
        for (number, step) in numbers.flat_map(|number| [(number, MOVED), (number, -MOVED)]) {
            let mut start = trial.fitted.at.clone();
            start[number] = (start[number] + step).clamp(lower[number], upper[number]);
            let found = trial.model.fit(self.points, &all, &start);
            if found.log_p > trial.fitted.log_p {
                trial.ranked.gain += found.log_p - trial.fitted.log_p;
                trial.ranked.converged = found.converged;
                trial.ranked.size_db = self.size_db(state, &trial.model, &found);
                trial.fitted = found;
            }
        }
    }

    /// The likeliest term that leaves nothing, else the supported one with the largest held-out gain.
    fn best(&self, trials: &[Trial]) -> Option<usize> {
        let supported = (0..trials.len()).filter(|&index| self.is_supported(&trials[index]));
        supported.max_by(|&a, &b| {
            let [a, b] = [a, b].map(|index| &trials[index]);
            a.leaves_nothing.cmp(&b.leaves_nothing).then_with(|| {
                if a.leaves_nothing {
                    b.criterion().total_cmp(&a.criterion())
                } else {
                    a.held_out_gain().total_cmp(&b.held_out_gain())
                }
            })
        })
    }

    /// Whether a term changes enough, and leaves nothing or predicts held-out angles.
    fn is_supported(&self, trial: &Trial) -> bool {
        let Some([gain, se]) = trial.ranked.held_out else { return false };
        let is_predictive = gain > self.settings.standard_errors * se && gain > SAME;
        (trial.leaves_nothing || is_predictive)
            && trial.ranked.size_db >= self.settings.least_size_db
    }

    /// Other supported terms that predict held-out angles as well as the best, and leave as little.
    fn class(&self, trials: &[Trial], best: usize) -> Vec<&'static str> {
        let Some((best_leaves_nothing, winner)) =
            trials.get(best).and_then(|trial| Some((trial.leaves_nothing, trial.state.as_ref()?)))
        else {
            return Vec::new();
        };
        let mut class = Vec::new();
        for (index, trial) in trials.iter().enumerate() {
            if index != best
                && self.is_supported(trial)
                && trial.leaves_nothing == best_leaves_nothing
                && let Some(state) = &trial.state
            {
                let [behind, se] = self.gain(&state.held_out, &winner.held_out);
                if behind <= SAME.max(se) {
                    class.push(trial.ranked.name);
                }
            }
        }
        class
    }

    /// Gain in ln p of held-out angles and its standard error over runs.
    pub fn gain(&self, before: &[Score], after: &[Score]) -> [f64; 2] {
        let gains: Vec<f64> = before.iter().zip(after).map(|(b, a)| a.log_p - b.log_p).collect();
        self.folds.sum(&gains)
    }
}

impl Trial {
    /// Gain in ln p of held-out angles; 0 where it is unknown.
    fn held_out_gain(&self) -> f64 {
        self.ranked.held_out.map_or(0.0, |[gain, _]| gain)
    }

    /// Schwarz's criterion, infinite where the term was not judged.
    fn criterion(&self) -> f64 {
        self.state.as_ref().map_or(f64::INFINITY, State::criterion)
    }

    /// Accepts the term: the addition, and the model with it.
    fn accept(&mut self, class: Vec<&'static str>) -> (Addition, Option<State>) {
        self.ranked.accepted = true;
        let [held_out_gain, held_out_se] = self.ranked.held_out.unwrap_or_default();
        let RankedTerm { gain, size_db, .. } = self.ranked;
        let evidence = CurveEvidence { gain, held_out_gain, held_out_se, size_db };
        (Addition { term: self.term, class, evidence }, self.state.take())
    }
}

/// A point with the parameters of one more term.
fn joined(at: &DVector<f64>, term: &dyn Term, values: &[f64]) -> DVector<f64> {
    let more = term.parameters().iter().zip(values).map(|(known, value)| value / known.step);
    DVector::from_vec(at.iter().copied().chain(more).collect())
}

/// Sum of the squared residuals of the detections over their spreads, dB².
fn misfit(model: &Model, at: &DVector<f64>, points: &Points) -> f64 {
    let levels_db = model.levels_db(at, &points.points);
    let pairs = points.points.iter().zip(levels_db).filter(|(point, _)| !point.censored);
    pairs.map(|(point, db)| ((point.f_db - db) / point.spread).powi(2)).sum()
}
