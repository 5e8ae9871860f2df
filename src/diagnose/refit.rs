//! Base laws and effects, fitted together by maximum likelihood.
//!
//! Unknowns are the coordinates of every law that enough shots meet and the numbers of every effect in
//! units of their steps. The score of each chirp is a central difference of ln p. The curvature is
//! Σ L·(y/μ)·g·gᵀ with g the slope of ln μ for unknowns that move means, and the scores' products for
//! those that move only the law about the mean; the standard deviations come from the scores'
//! products at the end (Berndt, Hall, Hall & Hausman 1974).

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::folds::Folds;
use super::likelihood::{Declared, Likelihood, Term};
use super::select::SEARCH;
use super::shots::Observation;
use crate::brdf::Brdf;
use crate::effects::{Effect, Model, Prediction, PredictionCache, Receiver, Shot, Stage, rank};
use crate::fit::FitError;
use crate::fit::coordinates::{Coordinates, frequencies};
use crate::fit::minimise::{Local, Minimise, Stop};
use crate::fit::uncertainty::deviations;

/// The felt step of a shift of the target, m, as of the numbers of effects that shift it.
const SHIFT_STEP_M: f64 = 2e-3;
/// Step of a difference quotient: of a law's coordinate in its search, of an effect's number in its
/// steps.
const LAW_STEP: f64 = 5e-4;
const EFFECT_STEP: f64 = 0.25;
/// The same where facets move under the rays, first and last. ln p then has steps, of which a quotient
/// sees those within its width, and a search goes about as far at a time.
const WIDE_TO_NARROW: [f64; 3] = [1.0, 0.25, 0.06];
/// How far such steps are looked over, in standard deviations but no more than an effect's steps.
const ALONG_AXES: [f64; 4] = [0.3, 1.0, 3.0, 10.0];
/// Change of ln mean over a difference quotient that no smooth surface makes.
const SMOOTH: f64 = 0.5;
/// Times that a step which does not improve is halved.
const HALVINGS: usize = 5;
/// Shots that a law must have to be fitted.
pub(crate) const LEAST_SHOTS: usize = 100;

/// What was seen, and of what.
#[derive(Clone, Copy)]
pub(super) struct Problem<'a> {
    pub stage: &'a Stage<'a>,
    pub shots: &'a [Shot],
    pub observations: &'a [Observation],
    pub declared: Declared,
    pub receiver: Receiver,
    /// Of these shots.
    pub traced: &'a PredictionCache,
}

/// What is turned.
#[derive(Clone)]
pub(super) struct Space<'a> {
    laws: Vec<Brdf>,
    turned: Vec<(usize, Coordinates)>,
    /// Effects whose numbers are not turned.
    at_work: &'a [(&'a dyn Effect, Vec<f64>)],
    pub effects: Vec<&'a dyn Effect>,
}

/// Where a search ended.
#[derive(Clone, Debug)]
pub(super) struct Fitted {
    pub at: DVector<f64>,
    pub ln_likelihood: f64,
    pub converged: bool,
    /// Whether step after step from here was no improvement, shorter ones neither: to search on would be to
    /// try them again.
    pub is_stuck: bool,
}

impl<'a> Space<'a> {
    /// Laws of regions with few shots stay as they are.
    pub fn new(
        problem: &Problem,
        laws: &[Brdf],
        at_work: &'a [(&'a dyn Effect, Vec<f64>)],
    ) -> Result<Space<'a>, FitError> {
        let mut turned = Vec::new();
        for (region, law) in laws.iter().enumerate() {
            let here = |shot: &&Shot| usize::from(shot.region) == region;
            if problem.shots.iter().filter(here).count() >= LEAST_SHOTS {
                let looks = Some(problem.receiver.looks);
                turned.push((region, Coordinates::new(law, &frequencies(law), &[], looks)?));
            }
        }
        Ok(Space { laws: laws.to_vec(), turned, at_work, effects: Vec::new() })
    }

    /// With one more effect.
    pub fn with(&self, effect: &'a dyn Effect) -> Space<'a> {
        let mut space = self.clone();
        space.effects.push(effect);
        space
    }

    /// With one effect less, and a point without its numbers.
    pub fn without(&self, at: &DVector<f64>, index: usize) -> (Space<'a>, DVector<f64>) {
        let mut space = self.clone();
        let before: usize =
            self.effects.iter().take(index).map(|effect| effect.parameters().len()).sum();
        let gone = space.effects.remove(index).parameters().len();
        let first = self.base_len() + before;
        (space, at.clone().remove_rows(first, gone))
    }

    /// With the first effect as the last, and a point likewise.
    pub fn rotated(&self, at: &DVector<f64>) -> (Space<'a>, DVector<f64>) {
        let values = self.effect_values(at).into_iter().next();
        let Some((&first, values)) = self.effects.first().zip(values) else {
            return (self.clone(), at.clone());
        };
        let (space, at) = self.without(at, 0);
        (space.with(first), Space::joined(&at, first, &values))
    }

    /// Whether an effect of this name is among its.
    pub fn has(&self, name: &str) -> bool {
        self.effects.iter().any(|effect| effect.name() == name)
    }

    /// Unknowns of the effects for which rays would have to be traced anew: few, and hardly moved by
    /// another effect.
    pub fn costly(&self, at: &DVector<f64>) -> Vec<usize> {
        let mut first = self.base_len();
        let mut costly = Vec::new();
        for (effect, values) in self.effects.iter().zip(self.effect_values(at)) {
            let next = first + values.len();
            if effect.moves() || effect.survey_key(&values).is_some_and(|on| !on.is_empty()) {
                costly.extend(first..next);
            }
            first = next;
        }
        costly
    }

    /// Unknowns of the effects that move the target.
    fn moving(&self) -> impl Iterator<Item = usize> {
        let mut first = self.base_len();
        self.effects.iter().flat_map(move |effect| {
            let next = first + effect.parameters().len();
            let unknowns = if effect.moves() { first..next } else { next..next };
            first = next;
            unknowns
        })
    }

    /// The effect of an unknown, and which of its numbers it is; none for those of the laws.
    fn knob(&self, index: usize) -> Option<(&'a dyn Effect, usize)> {
        let mut number = index.checked_sub(self.base_len())?;
        for effect in &self.effects {
            if number < effect.parameters().len() {
                return Some((*effect, number));
            }
            number -= effect.parameters().len();
        }
        None
    }

    /// Unknowns of the laws; those of the effects follow.
    pub fn base_len(&self) -> usize {
        self.turned.iter().map(|(_, coordinates)| coordinates.len()).sum()
    }

    /// Where the laws' unknowns begin.
    pub fn start(&self) -> DVector<f64> {
        let starts =
            self.turned.iter().flat_map(|(_, c)| c.start().iter().copied().collect::<Vec<_>>());
        DVector::from_vec(starts.collect())
    }

    /// A point with the laws where they begin.
    pub fn restarted(&self, at: &DVector<f64>) -> DVector<f64> {
        let effects = at.iter().skip(self.base_len());
        DVector::from_vec(self.start().iter().chain(effects).copied().collect())
    }

    /// Points beside another by one unknown, and how far they are apart: on one side by a law's, which
    /// are smooth, on both by an effect's.
    fn beside(
        &self,
        at: &DVector<f64>,
        [lower, upper]: [&DVector<f64>; 2],
        index: usize,
        effect_step: f64,
    ) -> ([DVector<f64>; 2], f64) {
        let is_law = index < self.base_len();
        let step = if is_law { LAW_STEP } else { effect_step };
        let moved = |by: f64| {
            let mut there = at.clone();
            there[index] = (at[index] + by).clamp(lower[index], upper[index]);
            there
        };
        let more = moved(step);
        let is_one_sided = is_law && more[index] > at[index];
        let less = if is_one_sided { at.clone() } else { moved(-step) };
        let width = more[index] - less[index];
        ([more, less], width)
    }

    /// A point with the numbers of one more effect.
    pub fn joined(at: &DVector<f64>, effect: &dyn Effect, values: &[f64]) -> DVector<f64> {
        let knobs = effect.parameters().iter().zip(values);
        let more = knobs.map(|(knob, value)| value.clamp(knob.min, knob.max) / knob.step);
        DVector::from_iterator(at.len() + effect.parameters().len(), at.iter().copied().chain(more))
    }

    /// Name and value of every unknown of the laws, with its slope in the search.
    pub fn base_values(&self, at: &DVector<f64>) -> Vec<(usize, String, f64, f64)> {
        let all =
            self.turned.iter().flat_map(|(region, c)| c.list.iter().map(move |c| (*region, c)));
        let value = |((region, c), &u): ((usize, &crate::fit::coordinates::Coordinate), &f64)| {
            (region, c.name.clone(), c.value(u), c.slope(u))
        };
        all.zip(at.iter()).map(value).collect()
    }

    /// Numbers of every effect.
    pub fn effect_values(&self, at: &DVector<f64>) -> Vec<Vec<f64>> {
        let mut rest = at.iter().skip(self.base_len());
        let values = |effect: &&dyn Effect| {
            let knobs =
                effect.parameters().iter().zip(rest.by_ref().take(effect.parameters().len()));
            knobs.map(|(knob, u)| (u * knob.step).clamp(knob.min, knob.max)).collect()
        };
        self.effects.iter().map(values).collect()
    }

    /// The model at a point.
    pub fn model(&self, receiver: Receiver, at: &DVector<f64>) -> Model<'a> {
        let mut laws = self.laws.clone();
        let mut from = 0;
        for (region, coordinates) in &self.turned {
            let part = at.rows(from, coordinates.len()).into_owned();
            from += coordinates.len();
            if let Some(law) = laws.get_mut(*region) {
                *law = coordinates.model(&part);
            }
        }
        let found = self.effects.iter().copied().zip(self.effect_values(at));
        let mut effects: Vec<_> = self.at_work.iter().cloned().chain(found).collect();
        effects.sort_by_key(|(effect, _)| rank(effect.name()));
        Model { laws, receiver, effects }
    }

    /// Least and largest value of every unknown.
    pub fn bounds(&self) -> [DVector<f64>; 2] {
        let knobs = || self.effects.iter().flat_map(|effect| effect.parameters());
        let laws = |end: fn(&Coordinates) -> DVector<f64>| {
            self.turned.iter().flat_map(move |(_, c)| end(c).iter().copied().collect::<Vec<_>>())
        };
        let lower = laws(Coordinates::lower).chain(knobs().map(|knob| knob.min / knob.step));
        let upper = laws(Coordinates::upper).chain(knobs().map(|knob| knob.max / knob.step));
        [DVector::from_vec(lower.collect()), DVector::from_vec(upper.collect())]
    }
}

impl Problem<'_> {
    /// What a point predicts.
    pub fn predict(&self, space: &Space, at: &DVector<f64>) -> Prediction {
        space.model(self.receiver, at).predict_with(self.stage, self.shots, self.traced)
    }

    /// Every chirp's part of the likelihood at a point.
    pub fn terms(&self, space: &Space, at: &DVector<f64>) -> Vec<Term> {
        self.terms_of(&space.model(self.receiver, at))
    }

    fn terms_of(&self, model: &Model) -> Vec<Term> {
        let prediction = model.predict_with(self.stage, self.shots, self.traced);
        let likelihood = Likelihood::new(&prediction, self.declared);
        let seen = self.observations.par_iter().enumerate();
        seen.map(|(shot, seen)| likelihood.term(shot, seen)).collect()
    }

    /// The most likely point from a start. The unknowns numbered in `held` stay.
    pub fn fit(
        &self,
        space: &Space,
        start: &DVector<f64>,
        held: &[usize],
        search: &Minimise,
    ) -> Fitted {
        let [mut lower, mut upper] = space.bounds();
        for &index in held {
            (lower[index], upper[index]) = (start[index], start[index]);
        }
        let bounds = [&lower, &upper];
        let value = |at: &DVector<f64>| -sum(&self.terms(space, at));
        let from = |start: &DVector<f64>, step: f64| {
            let found = search.run_with(start, bounds, value, |at| {
                let terms = self.terms(space, at);
                let slopes = self.slopes_over(step, space, at, bounds, &terms);
                local(&terms, &slopes, &|_| true)
            });
            let (ln_likelihood, converged) = (-found.local.value, found.converged());
            let is_stuck = found.stop == Stop::Stuck;
            Fitted { at: found.at, ln_likelihood, converged, is_stuck }
        };
        let moves = space.moving().any(|index| lower[index] < upper[index]);
        let [wide, middle, narrow] = WIDE_TO_NARROW;
        match moves {
            true => from(&from(&from(start, wide).at, middle).at, narrow),
            false => from(start, EFFECT_STEP),
        }
    }

    /// The most likely points of fits without each fold in turn, by a full step from the most likely
    /// point of all shots: the folds' points differ from it by about its standard deviation, over which
    /// ln likelihood is a parabola. One after the other, so that what was traced for one can be asked for at once.
    pub fn fit_without(
        &self,
        space: &Space,
        at: &DVector<f64>,
        folds: &Folds,
    ) -> impl Iterator<Item = DVector<f64>> {
        let [lower, upper] = space.bounds();
        let terms = self.terms(space, at);
        let slopes = self.slopes(space, at, [&lower, &upper], &terms);
        let without = move |fold: usize| {
            let used = |shot: usize| folds.fold.get(shot) != Some(&fold);
            let local = local(&terms, &slopes, &used);
            let bounds = [&lower, &upper];
            let ln_p = |terms: &[Term]| -> f64 {
                let used = terms.iter().enumerate().filter(|(shot, _)| used(*shot));
                used.map(|(_, term)| term.ln_p).sum()
            };
            let (here, mut there) = (ln_p(&terms), SEARCH.newton(at, bounds, &local));
            for _ in 0..HALVINGS {
                if ln_p(&self.terms(space, &there)) >= here {
                    return there;
                }
                there = 0.5 * (there + at);
            }
            at.clone()
        };
        (0..folds.folds).map(without)
    }

    /// The most likely of some points on the principal axes of the curvature, where one is more likely than the
    /// middle. A target whose ranges leave it free to turn in itself is held by its edges alone, of which
    /// ln p sees one chirp after the other, and slopes next to nothing.
    pub fn along_axes(&self, space: &Space, at: &DVector<f64>) -> Option<DVector<f64>> {
        let [lower, upper] = space.bounds();
        let terms = self.terms(space, at);
        let slopes = self.slopes(space, at, [&lower, &upper], &terms);
        // What an edge passes over bends ln p without end.
        let is_smooth = |shot: usize| {
            let mut of_effects = slopes.iter().skip(space.base_len());
            of_effects.all(|slopes| slopes[shot].ln_mean.abs() * EFFECT_STEP < SMOOTH)
        };
        let axes = local(&terms, &slopes, &is_smooth).curvature.symmetric_eigen();
        let mut best = (sum(&terms), None);
        for (axis, bend) in axes.eigenvectors.column_iter().zip(&axes.eigenvalues) {
            let reach = bend.max(f64::MIN_POSITIVE).sqrt().recip().min(1.0);
            for length in ALONG_AXES.iter().flat_map(|by| [by * reach, -by * reach]) {
                let there = (at + axis * length).zip_zip_map(&lower, &upper, f64::clamp);
                let ln_p = sum(&self.terms(space, &there));
                if ln_p > best.0 {
                    best = (ln_p, Some(there));
                }
            }
        }
        best.1
    }

    /// Standard deviation of every unknown in the search; infinite for those that a bound holds or
    /// that the data cannot tell.
    pub fn sd(&self, space: &Space, at: &DVector<f64>) -> Vec<f64> {
        let [lower, upper] = space.bounds();
        let slopes = self.slopes(space, at, [&lower, &upper], &self.terms(space, at));
        let inside = |&i: &usize| at[i] > lower[i] && at[i] < upper[i];
        let free: Vec<usize> = (0..at.len()).filter(inside).collect();
        let mut products: DMatrix<f64> = DMatrix::zeros(free.len(), free.len());
        for (row, &i) in free.iter().enumerate() {
            for (column, &j) in free.iter().enumerate() {
                let pairs = slopes[i].iter().zip(&slopes[j]);
                products[(row, column)] = pairs.map(|(a, b)| a.ln_p * b.ln_p).sum();
            }
        }
        let mut sd = vec![f64::INFINITY; at.len()];
        for (&i, found) in free.iter().zip(deviations(&products)) {
            sd[i] = found.unwrap_or(f64::INFINITY);
        }
        sd
    }

    /// Slopes of every shot by every unknown: forward differences for those of the laws, which are
    /// smooth, and central ones over felt steps for those of effects, which facets make rough.
    pub fn slopes(
        &self,
        space: &Space,
        at: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
        here: &[Term],
    ) -> Vec<Vec<Slope>> {
        self.slopes_over(EFFECT_STEP, space, at, bounds, here)
    }

    /// The same by other steps of the effects' numbers.
    fn slopes_over(
        &self,
        effect_step: f64,
        space: &Space,
        at: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
        here: &[Term],
    ) -> Vec<Vec<Slope>> {
        let shifts = |index: usize| {
            let (effect, knob) = space.knob(index)?;
            let shift = move |shot| effect.shifts(knob, shot);
            let (axis, _) = shift(self.shots.first()?)?;
            Some((axis, shift, effect.parameters()[knob].step))
        };
        let is_free = |index: &usize| bounds[0][*index] < bounds[1][*index];
        let free = || (0..at.len()).filter(is_free);
        let axes: BTreeSet<usize> = free().filter_map(|i| Some(shifts(i)?.0)).collect();
        let by_shift: BTreeMap<usize, Vec<Slope>> = axes
            .into_par_iter()
            .map(|axis| (axis, self.slopes_by_shift(effect_step * SHIFT_STEP_M, space, at, axis)))
            .collect();
        let slope = |index: usize| {
            if !is_free(&index) {
                return vec![Slope::default(); self.shots.len()];
            }
            if let Some((axis, shift, step)) = shifts(index) {
                let per_unit = |shot| shift(shot).map_or(0.0, |(_, per_unit)| per_unit * step);
                let slopes = self.shots.iter().zip(&by_shift[&axis]);
                return slopes.map(|(shot, slope)| slope.times(per_unit(shot))).collect();
            }
            let ([more, less], width) = space.beside(at, bounds, index, effect_step);
            let terms = |there: &DVector<f64>| match there == at {
                true => here.to_vec(),
                false => self.terms(space, there),
            };
            quotients(&terms(&more), &terms(&less), width)
        };
        (0..at.len()).into_par_iter().map(slope).collect()
    }

    /// Slopes of every shot by a shift of the target along an axis, per m: with them those by all unknowns that
    /// do nothing else are known.
    fn slopes_by_shift(
        &self,
        step_m: f64,
        space: &Space,
        at: &DVector<f64>,
        axis: usize,
    ) -> Vec<Slope> {
        let terms = |by_m: f64| self.terms_of(&space.model(self.receiver, at).shifted(axis, by_m));
        quotients(&terms(step_m), &terms(-step_m), 2.0 * step_m)
    }

    /// Slopes of ln mean before the receiver by every unknown that changes it: unlike [`Term::ln_mean`]
    /// that depends on nothing that was seen.
    pub fn mean_slopes(&self, space: &Space, at: &DVector<f64>) -> Vec<Vec<f64>> {
        let [lower, upper] = space.bounds();
        let ln_means = |at: &DVector<f64>| -> Vec<f64> {
            let prediction = self.predict(space, at);
            let ln_mean = |shot| prediction.mean_w(shot).max(f64::MIN_POSITIVE).ln();
            (0..self.shots.len()).map(ln_mean).collect()
        };
        let slopes = (0..at.len()).map(|index| {
            let (ends, width) = space.beside(at, [&lower, &upper], index, EFFECT_STEP);
            let [more, less] = ends.map(|end| ln_means(&end));
            more.iter().zip(less).map(|(a, b)| (a - b) / width.max(f64::MIN_POSITIVE)).collect()
        });
        slopes.filter(|slopes: &Vec<f64>| slopes.iter().any(|slope| *slope != 0.0)).collect()
    }
}

/// Slopes of one shot by one unknown.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Slope {
    pub ln_p: f64,
    pub ln_mean: f64,
    pub range_m: f64,
}

impl Slope {
    fn times(self, by: f64) -> Slope {
        let Slope { ln_p, ln_mean, range_m } = self;
        Slope { ln_p: by * ln_p, ln_mean: by * ln_mean, range_m: by * range_m }
    }
}

/// Slopes of all shots from their terms at two points that are so far apart; none where they are one.
fn quotients(more: &[Term], less: &[Term], width: f64) -> Vec<Slope> {
    let per_width = if width > 0.0 { 1.0 / width } else { 0.0 };
    let difference = |(a, b): (&Term, &Term)| Slope {
        ln_p: a.ln_p - b.ln_p,
        ln_mean: a.ln_mean - b.ln_mean,
        range_m: a.range_m - b.range_m,
    };
    more.iter().zip(less).map(|pair| difference(pair).times(per_width)).collect()
}

/// ln likelihood.
pub(super) fn sum(terms: &[Term]) -> f64 {
    terms.iter().map(|term| term.ln_p).sum()
}

/// −ln likelihood near a point, by the shots that count.
fn local(terms: &[Term], slopes: &[Vec<Slope>], counts: &dyn Fn(usize) -> bool) -> Local {
    let unknowns = slopes.len();
    let moves = |s: &Slope| s.ln_mean.abs() > 1e-9 || s.range_m.abs() > 1e-12;
    let moves_mean: Vec<bool> = slopes.iter().map(|s| s.iter().any(moves)).collect();
    let mut sum = Local::zero(unknowns);
    let mut rows = [vec![0.0; unknowns], vec![0.0; unknowns], vec![0.0; unknowns]];
    for (shot, term) in terms.iter().enumerate().filter(|(shot, _)| counts(*shot)) {
        sum.value -= term.ln_p;
        let [means, ranges, laws] = &mut rows;
        for (index, slopes) in slopes.iter().enumerate() {
            let slope = slopes[shot];
            sum.gradient[index] -= slope.ln_p;
            match moves_mean[index] {
                true => (means[index], ranges[index]) = (slope.ln_mean, slope.range_m),
                false => laws[index] = slope.ln_p,
            }
        }
        for (row, weight) in rows.iter().zip([term.bend, term.range_bend, 1.0]) {
            sum.add(0.0, weight, row);
        }
    }
    sum
}
