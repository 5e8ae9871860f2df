//! The gain of an effect without a fit: a score test on a sample of the shots.
//!
//! The change Δ of ln mean and range by an effect at given values has the score U = Σ s·Δ and, less the part that
//! the model so far can absorb, the information I = Δᵀ(W − WJ(JᵀWJ)⁻¹JᵀW)Δ. Scaled to its best
//! strength it gains U²/2I in ln likelihood (Rao's test). An effect that only changes the distribution about the
//! mean has no such Δ; its gain is that at the values themselves.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::likelihood::Term;
use super::placebo::Placebo;
use super::problem::{Problem, Slope, ln_likelihood};
use super::score::DB;
use super::space::Space;
use crate::effects::Effect;

/// Standard deviation of an unknown of a scattering model from which on it hardly matters: a factor of a thousand.
const OPEN: f64 = 7.0;
/// Largest scale of a start.
const MOST_SCALE: f64 = 5.0;

/// A model that effects are compared with.
pub(super) struct Screen<'a> {
    pub problem: Problem<'a>,
    terms: Vec<Term>,
    ln_likelihood: f64,
    ln_p_of_alarms: f64,
    slopes: Vec<Vec<Slope>>,
    /// Information on the model's own unknowns.
    absorbs: Option<Cholesky<f64, Dyn>>,
    /// The step that the model's own unknowns would still take.
    own_step: DVector<f64>,
    /// Whether the data leave an unknown of a scattering model open: a fit has moved it to where it hardly matters.
    pub leaves_laws_open: bool,
}

/// Change of ln mean and of range, m, of one shot by an effect.
#[derive(Clone, Copy)]
struct Change {
    ln_mean: f64,
    range_m: f64,
}

impl<'a> Screen<'a> {
    /// The screen of a model at its most likely point.
    pub fn new(problem: Problem<'a>, space: &Space, at: &DVector<f64>) -> Screen<'a> {
        let terms = problem.terms(space, at);
        let [lower, upper] = space.bounds();
        let mut slopes = problem.slopes(space, at, [&lower, &upper], &terms);
        let leaves_laws_open = slopes
            .iter()
            .take(space.base_len())
            .any(|slopes| product(&terms, slopes, slopes) * OPEN * OPEN < 1.0);
        // What else pulls the unknowns that change means or ranges.
        let changes =
            |slopes: &[Slope]| slopes.iter().any(|s| s.ln_mean != 0.0 || s.range_m != 0.0);
        let kept: Vec<usize> = (0..slopes.len()).filter(|&index| changes(&slopes[index])).collect();
        slopes = kept.iter().map(|&index| std::mem::take(&mut slopes[index])).collect();
        let beside = problem.local_beside(space, at, [&lower, &upper]);
        let curvature = DMatrix::from_fn(slopes.len(), slopes.len(), |i, j| {
            product(&terms, &slopes[i], &slopes[j]) + beside.curvature[(kept[i], kept[j])]
        });
        // A small ridge keeps the matrix positive where unknowns do the same.
        let ridge = 1e-9 * curvature.diagonal().iter().fold(0.0, |most: f64, x| most.max(*x));
        let curvature = curvature + DMatrix::identity(slopes.len(), slopes.len()) * ridge;
        let absorbs = curvature.cholesky();
        let pulls = slopes.iter().zip(&kept).map(|(slopes, &index)| {
            let pulls = terms.iter().zip(slopes);
            let pull: f64 = pulls.map(|(term, slope)| along(term, Change::from(slope))).sum();
            pull - beside.gradient[index]
        });
        let own: DVector<f64> = DVector::from_iterator(slopes.len(), pulls);
        let own_step = absorbs.as_ref().map_or(DVector::zeros(slopes.len()), |c| c.solve(&own));
        let ln_likelihood = problem.ln_likelihood(space, at);
        let ln_p_of_alarms = problem.ln_p_of_alarms(space, at);
        Screen {
            problem,
            terms,
            ln_likelihood,
            ln_p_of_alarms,
            slopes,
            absorbs,
            own_step,
            leaves_laws_open,
        }
    }

    /// Gain in ln likelihood that a start promises.
    pub fn promise(&self, space: &Space, at: &DVector<f64>) -> f64 {
        let there = self.problem.terms(space, at);
        let alarms = self.problem.ln_p_of_alarms(space, at) - self.ln_p_of_alarms;
        let gain = ln_likelihood(&there) - ln_likelihood(&self.terms) + alarms;
        let changes = changes(&self.terms, &there);
        let [score, information] = [self.score(&changes), self.information(&changes)];
        let is_useful = score > 0.0 && information > 0.0;
        // A straight line from where the effect is absent is no guide farther away.
        let scale = if is_useful { (score / information).min(MOST_SCALE) } else { 0.0 };
        (scale * score - 0.5 * scale * scale * information).max(gain)
    }

    /// Information on the change at a point beyond what the model absorbs, and the root mean
    /// square of that change of the means, dB.
    pub fn felt(&self, space: &Space, at: &DVector<f64>) -> [f64; 2] {
        let changes = changes(&self.terms, &self.problem.terms(space, at));
        let squares: f64 = changes.iter().map(|change| change.ln_mean.powi(2)).sum();
        [self.information(&changes), DB * (squares / changes.len().max(1) as f64).sqrt()]
    }

    /// Gain in ln likelihood at a point.
    pub fn gain(&self, space: &Space, at: &DVector<f64>) -> f64 {
        self.problem.ln_likelihood(space, at) - self.ln_likelihood
    }

    /// Gain in ln likelihood that a placebo with this number of parameters promises beside the model.
    pub fn placebo_gain(&self, space: &Space, at: &DVector<f64>, numbers: usize, seed: u64) -> f64 {
        let placebo = Placebo::new(numbers, seed);
        let mut with = space.clone();
        with.effects.push(&placebo);
        let parameters = placebo.parameters();
        let mut starts = Vec::new();
        for number in 0..parameters.len() {
            let mut values = vec![0.0; parameters.len()];
            values[number] = parameters[number].step;
            starts.push(Space::joined(at, &placebo, &values));
        }
        self.promise_of_all(&with, &starts).max(0.0)
    }

    /// Slope of ln likelihood along a change, less the part that the model absorbs.
    fn score(&self, changes: &[Change]) -> f64 {
        let all: f64 = self.terms.iter().zip(changes).map(|(term, c)| along(term, *c)).sum();
        all - self.with_model(changes).dot(&self.own_step)
    }

    /// Gain in ln likelihood that several changes promise together, each at its best strength.
    fn promise_of_all(&self, space: &Space, ats: &[DVector<f64>]) -> f64 {
        let changes: Vec<Vec<Change>> =
            ats.iter().map(|at| changes(&self.terms, &self.problem.terms(space, at))).collect();
        let scores = changes.iter().map(|changes| self.score(changes));
        let score = DVector::from_iterator(changes.len(), scores);
        let information = DMatrix::from_fn(changes.len(), changes.len(), |i, j| {
            self.shared_information(&changes[i], &changes[j])
        });
        let solved = information.cholesky().map(|c| c.solve(&score));
        solved.map_or(0.0, |solved| 0.5 * score.dot(&solved))
    }

    /// Information on a change beyond what the model absorbs.
    fn information(&self, changes: &[Change]) -> f64 {
        let all: f64 = self.terms.iter().zip(changes).map(|(term, c)| inner(term, *c, *c)).sum();
        let left = self.shared_information(changes, changes);
        // The remainder of a change that is absorbed as a whole is rounding.
        if left > 1e-6 * all { left } else { 0.0 }
    }

    /// Information that two changes share beyond what the model absorbs.
    fn shared_information(&self, a: &[Change], b: &[Change]) -> f64 {
        let all: f64 =
            self.terms.iter().zip(a.iter().zip(b)).map(|(term, (a, b))| inner(term, *a, *b)).sum();
        let [with_a, with_b] = [a, b].map(|changes| self.with_model(changes));
        all - self.absorbs.as_ref().map_or(0.0, |c| with_a.dot(&c.solve(&with_b)))
    }

    /// Information that a change shares with every unknown of the model.
    fn with_model(&self, changes: &[Change]) -> DVector<f64> {
        let shared = self.slopes.iter().map(|slopes| {
            let pairs = self.terms.iter().zip(slopes.iter().zip(changes));
            pairs.map(|(term, (slope, c))| inner(term, Change::from(slope), *c)).sum()
        });
        DVector::from_iterator(self.slopes.len(), shared)
    }
}

impl From<&Slope> for Change {
    fn from(slope: &Slope) -> Change {
        Change { ln_mean: slope.ln_mean, range_m: slope.range_m }
    }
}

/// Information that two unknowns share.
fn product(terms: &[Term], a: &[Slope], b: &[Slope]) -> f64 {
    let pairs = terms.iter().zip(a.iter().zip(b));
    pairs.map(|(term, (a, b))| inner(term, Change::from(a), Change::from(b))).sum()
}

/// Change of every shot between two predictions.
fn changes(before: &[Term], after: &[Term]) -> Vec<Change> {
    let pairs = before.iter().zip(after);
    pairs
        .map(|(before, after)| {
            // A ray that misses after a move has no range; its change is in the power.
            let has_ranges = before.range_m > 0.0 && after.range_m > 0.0;
            let range_m = if has_ranges { after.range_m - before.range_m } else { 0.0 };
            Change { ln_mean: after.ln_mean - before.ln_mean, range_m }
        })
        .collect()
}

/// Slope of ln p of a shot along a change.
fn along(term: &Term, change: Change) -> f64 {
    term.pull * change.ln_mean + term.range_slope * change.range_m
}

/// Information of a shot that two changes share.
fn inner(term: &Term, a: Change, b: Change) -> f64 {
    term.bend * a.ln_mean * b.ln_mean + term.range_bend * a.range_m * b.range_m
}
