//! The choice of terms: one by one, fitted with everything else, and added when nothing is left with them or when they
//! predict held-out angles.

use nalgebra::DVector;
use rayon::prelude::*;

use super::evidence::{CurveEvidence, RankedTerm};
use super::folds::Folds;
use super::model::{Fit, Model, Score, rms_apart_db};
use super::points::Points;
use super::settings::CurveDiagnosis;
use super::terms::Term;

/// Starts of a term with the fitted law of which the first steps are taken, and as many with laws drawn around the declared one.
const GLANCED: usize = 64;
/// Laws that are drawn: fitted without a deep film, a law may follow its fringes, and no search comes back from there.
const DRAWN: usize = 16;
/// Starts of a term that are followed to their end.
const FOLLOWED: usize = 8;
/// Terms of a round that are judged on held-out angles.
const SHORT_LIST: usize = 5;
/// How far one number of the law is moved to search again, in the coordinates of the search: levels and widths double.
const MOVED: f64 = std::f64::consts::LN_2;
/// Difference in held-out ln p below which two terms predict equally well; so does less than one standard error.
const SAME: f64 = 2.0;
/// How much better a model must be than another that explains the curve as well, in ln p less Schwarz's penalty: odds of 150
/// to one.
pub(super) const FAR_BETTER: f64 = 5.0;

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

/// A term that was added.
pub(super) struct Addition {
    pub term: &'static dyn Term,
    pub class: Vec<&'static str>,
    pub evidence: CurveEvidence,
}

impl Addition {
    /// Names of the term and of those that do as well.
    pub fn names(&self) -> impl Iterator<Item = &'static str> {
        [self.term.name()].into_iter().chain(self.class.iter().copied())
    }
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

/// A round of trials: its number, from 1, and the model to which a term is added.
#[derive(Clone, Copy)]
struct Round<'a> {
    law: &'static str,
    number: usize,
    state: &'a State,
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

    /// Adds terms to the scattering model of this name while one is supported, and something is left.
    pub fn run(
        &self,
        law: &'static str,
        mut state: State,
        terms: &[&'static dyn Term],
    ) -> (State, Vec<RankedTerm>, Vec<Addition>) {
        let (mut ranking, mut added) = (Vec::new(), Vec::<Addition>::new());
        for round in 1..=self.settings.most_terms + 1 {
            let mut left = terms.to_vec();
            left.retain(|term| added.iter().all(|added| added.term.name() != term.name()));
            let mut trials = self.trials(Round { law, number: round, state: &state }, &left);
            let best = self.best(&trials).filter(|_| round <= self.settings.most_terms);
            let is_last = best.is_some_and(|index| trials[index].leaves_nothing);
            let next = best.and_then(|index| {
                let class = self.class(&trials, index);
                let name = trials[index].ranked.name;
                added.iter_mut().for_each(|one| one.class.retain(|alike| *alike != name));
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
    fn trials(&self, round: Round, terms: &[&'static dyn Term]) -> Vec<Trial> {
        let state = round.state;
        let mut trials: Vec<Trial> =
            terms.par_iter().map(|term| self.trial(round, *term)).collect();
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
    fn trial(&self, round: Round, term: &'static dyn Term) -> Trial {
        let Round { law, number, state } = round;
        let points = self.points;
        let all = vec![true; points.points.len()];
        let model = state.model.with(term);
        let drawn = (1..=DRAWN).map(|number| self.drawn(state, number));
        let mut starts =
            self.best_starts(state, term, std::slice::from_ref(&state.fitted.at), misfit);
        starts.extend(self.best_starts(state, term, &drawn.collect::<Vec<_>>(), scatter));
        for (left, at) in &mut starts {
            *at = model.glance(points, at);
            *left = misfit(points, &model.levels_db(at, &points.points));
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        let fits = starts.iter().take(FOLLOWED).map(|(_, at)| model.fit(points, &all, at));
        let fitted = fits.max_by(|a, b| a.log_p.total_cmp(&b.log_p)).unwrap_or_else(|| {
            let absent: Vec<f64> = term.parameters().iter().map(|known| known.absent).collect();
            model.fit(points, &all, &joined(&state.fitted.at, term, &absent))
        });
        let ranked = RankedTerm {
            law,
            round: number,
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

    /// A law drawn around the declared one, with the terms as fitted.
    fn drawn(&self, state: &State, number: usize) -> DVector<f64> {
        let law = state.model.coordinates.drawn(self.settings.seed, number);
        let mut at = state.fitted.at.clone();
        at.rows_mut(0, law.len()).copy_from(&law);
        at
    }

    /// The starts of a term with these laws that leave least by this measure, and what they leave.
    fn best_starts(
        &self,
        state: &State,
        term: &'static dyn Term,
        laws: &[DVector<f64>],
        left: impl Fn(&Points, &[f64]) -> f64,
    ) -> Vec<(f64, DVector<f64>)> {
        let (points, values) = (self.points, term.starts());
        let mut starts = Vec::new();
        for law in laws {
            let levels = state.model.levels_with(law, term, &values, &points.points);
            let pairs = values.iter().zip(&levels);
            starts.extend(
                pairs.map(|(values, levels_db)| {
                    (left(points, levels_db), joined(law, term, values))
                }),
            );
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.truncate(GLANCED);
        starts
    }

    /// Rms change of the levels by a model with one more term, dB.
    fn size_db(&self, state: &State, model: &Model, fitted: &Fit) -> f64 {
        let points = &self.points.points;
        let before = state.model.levels_db(&state.fitted.at, points);
        let after = model.levels_db(&fitted.at, points);
        rms_apart_db(&before, &after)
    }

    /// Searches a term once more from the law as declared and from laws beside the one found: the law without the term may
    /// lie in another valley, or at a bound where its numbers do nothing.
    fn search_again(&self, state: &State, trial: &mut Trial) {
        let all = vec![true; self.points.points.len()];
        let coordinates = &trial.model.coordinates;
        let (lower, upper, numbers) =
            (coordinates.lower(), coordinates.upper(), 0..coordinates.len());
        let beside = numbers.flat_map(|number| [(number, MOVED), (number, -MOVED)]);
        for moved in [None].into_iter().chain(beside.map(Some)) {
            let mut start = trial.fitted.at.clone();
            match moved {
                None => start.rows_mut(0, coordinates.len()).copy_from(&trial.model.start()),
                Some((number, step)) => {
                    start[number] = (start[number] + step).clamp(lower[number], upper[number]);
                }
            }
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
                    b.fitted.criterion().total_cmp(&a.fitted.criterion())
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

    /// Other supported terms that do as well as the best.
    fn class(&self, trials: &[Trial], best: usize) -> Vec<&'static str> {
        let others = trials.iter().enumerate().filter(|(index, _)| *index != best);
        let supported = others.filter(|(_, trial)| self.is_supported(trial));
        let alike = supported.filter(|(_, trial)| self.is_alike(trial, &trials[best]));
        alike.map(|(_, trial)| trial.ranked.name).collect()
    }

    /// Whether a term does as well as the best: where that leaves nothing, it leaves nothing either and is not far less
    /// likely, else it predicts held-out angles as well.
    fn is_alike(&self, trial: &Trial, best: &Trial) -> bool {
        if best.leaves_nothing {
            let behind = trial.fitted.criterion() - best.fitted.criterion();
            return trial.leaves_nothing && behind < FAR_BETTER;
        }
        let states = trial.state.as_ref().zip(best.state.as_ref());
        states.is_some_and(|(state, best)| {
            let [behind, se] = self.gain(&state.held_out, &best.held_out);
            behind <= SAME.max(se)
        })
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
fn misfit(points: &Points, levels_db: &[f64]) -> f64 {
    let residual_db = points.detected_residuals_db(levels_db);
    residual_db.iter().map(|residual_db| residual_db.powi(2)).sum()
}

/// The same less that of the mean residual: a search finds the level in a step.
fn scatter(points: &Points, levels_db: &[f64]) -> f64 {
    let residual_db = points.detected_residuals_db(levels_db);
    let mean_db = residual_db.iter().sum::<f64>() / residual_db.len().max(1) as f64;
    residual_db.iter().map(|residual_db| (residual_db - mean_db).powi(2)).sum()
}
