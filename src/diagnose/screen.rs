//! What an effect would gain, without fitting it: a score test on a sample of the shots.
//!
//! The change Δ of ln mean and range by an effect at given values has the score U = Σ s·Δ and, with
//! what the model so far can absorb taken out, the information I = Δᵀ(W − WJ(JᵀWJ)⁻¹JᵀW)Δ. Scaled as
//! far as it is worth it gains U²/2I in ln likelihood (Rao's test). An effect of the law about the mean
//! has no such Δ and gains what it gains at the values.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::likelihood::Term;
use super::refit::{Problem, Slope, Space, sum};
use super::score::DB;
use super::shots::Observation;
use crate::effects::{PredictionCache, Shot};

/// Shots that a screening needs; more only take time.
const ENOUGH: usize = 2500;

/// Standard deviation, in the search, of a number of a law that hardly matters any more: a factor of a thousand.
const OPEN: f64 = 7.0;

/// A start is scaled at most so far.
const MOST_SCALE: f64 = 5.0;

/// Every so many shots of a scan.
pub(super) struct Sample {
    shots: Vec<Shot>,
    observations: Vec<Observation>,
    traced: PredictionCache,
    /// Shots that each of them stands for.
    pub weight: f64,
}

impl Sample {
    /// Of a problem.
    pub fn new(problem: &Problem) -> Sample {
        let every = (problem.shots.len() / ENOUGH).max(1);
        let shots: Vec<Shot> = problem.shots.iter().step_by(every).copied().collect();
        let observations = problem.observations.iter().step_by(every).copied().collect();
        let weight = problem.shots.len() as f64 / shots.len().max(1) as f64;
        Sample { shots, observations, traced: PredictionCache::default(), weight }
    }

    /// The problem of these shots alone.
    pub fn problem<'a>(&'a self, whole: &Problem<'a>) -> Problem<'a> {
        let Sample { shots, observations, traced, .. } = self;
        Problem { shots, observations, traced, ..*whole }
    }
}

/// A model that effects are held against.
pub(super) struct Screen<'a> {
    pub problem: Problem<'a>,
    terms: Vec<Term>,
    slopes: Vec<Vec<Slope>>,
    absorbs: Option<Cholesky<f64, Dyn>>,
    /// The step that the model's own numbers would still take.
    own_step: DVector<f64>,
    /// Whether the shots leave a number of a law open: a fit has carried it so far that it hardly matters.
    pub leaves_laws_open: bool,
}

/// One shot's change by an effect: of ln mean, and of the range, m.
type Change = [f64; 2];

impl<'a> Screen<'a> {
    /// Of a model at its most likely point.
    pub fn new(problem: Problem<'a>, space: &Space, at: &DVector<f64>) -> Screen<'a> {
        let terms = problem.terms(space, at);
        let [lower, upper] = space.bounds();
        let mut slopes = problem.slopes(space, at, [&lower, &upper], &terms);
        let information = |slopes: &Vec<Slope>| -> f64 {
            terms.iter().zip(slopes).map(|(term, s)| inner(term, change(s), change(s))).sum()
        };
        let mut of_laws = slopes.iter().take(space.base_len());
        let leaves_laws_open = of_laws.any(|slopes| information(slopes) * OPEN * OPEN < 1.0);
        slopes.retain(|slopes| slopes.iter().any(|s| s.ln_mean != 0.0 || s.range_m != 0.0));
        let product = |a: &[Slope], b: &[Slope]| {
            let pairs = terms.iter().zip(a.iter().zip(b));
            pairs.map(|(term, (a, b))| inner(term, change(a), change(b))).sum::<f64>()
        };
        let curvature =
            DMatrix::from_fn(slopes.len(), slopes.len(), |i, j| product(&slopes[i], &slopes[j]));
        let ridge = 1e-9 * curvature.diagonal().iter().fold(0.0, |most: f64, x| most.max(*x));
        let curvature = curvature + DMatrix::identity(slopes.len(), slopes.len()) * ridge;
        let absorbs = curvature.cholesky();
        let pull = |slopes: &Vec<Slope>| {
            terms.iter().zip(slopes).map(|(term, s)| along(term, change(s))).sum::<f64>()
        };
        let own = DVector::from_iterator(slopes.len(), slopes.iter().map(pull));
        let own_step = absorbs.as_ref().map_or(DVector::zeros(slopes.len()), |c| c.solve(&own));
        Screen { problem, terms, slopes, absorbs, own_step, leaves_laws_open }
    }

    /// Gain in ln likelihood that a start promises.
    pub fn promise(&self, space: &Space, at: &DVector<f64>) -> f64 {
        let there = self.problem.terms(space, at);
        let gain = sum(&there) - sum(&self.terms);
        let changes: Vec<Change> = self.terms.iter().zip(&there).map(apart).collect();
        let [score, information] = [self.score(&changes), self.information(&changes)];
        let useful = score > 0.0 && information > 0.0;
        // Further than this, a line from where the effect is absent is no guide.
        let scale = if useful { (score / information).min(MOST_SCALE) } else { 0.0 };
        (scale * score - 0.5 * scale * scale * information).max(gain)
    }

    /// Information on the change that a point makes, beyond what the model absorbs, and the root mean
    /// square of that change of the means, dB.
    pub fn felt(&self, space: &Space, at: &DVector<f64>) -> [f64; 2] {
        let there = self.problem.terms(space, at);
        let changes: Vec<Change> = self.terms.iter().zip(&there).map(apart).collect();
        let squares: f64 = changes.iter().map(|[mean, _]| mean.powi(2)).sum();
        [self.information(&changes), DB * (squares / changes.len().max(1) as f64).sqrt()]
    }

    /// What a point gains in ln likelihood.
    pub fn gain(&self, space: &Space, at: &DVector<f64>) -> f64 {
        sum(&self.problem.terms(space, at)) - sum(&self.terms)
    }

    /// Slope of ln likelihood along a change, less what the model absorbs of it.
    fn score(&self, changes: &[Change]) -> f64 {
        let all: f64 = self.terms.iter().zip(changes).map(|(term, c)| along(term, *c)).sum();
        all - self.with_model(changes).dot(&self.own_step)
    }

    /// Gain in ln likelihood that several changes promise together, each as far as it is worth it.
    pub fn promise_of_all(&self, space: &Space, ats: &[DVector<f64>]) -> f64 {
        let changes: Vec<Vec<Change>> = ats
            .iter()
            .map(|at| self.terms.iter().zip(&self.problem.terms(space, at)).map(apart).collect())
            .collect();
        let score = DVector::from_iterator(
            changes.len(),
            changes.iter().map(|changes| self.score(changes)),
        );
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
        // What is left of a change that is all absorbed is rounding.
        if left > 1e-6 * all { left } else { 0.0 }
    }

    fn shared_information(&self, a: &[Change], b: &[Change]) -> f64 {
        let all: f64 =
            self.terms.iter().zip(a.iter().zip(b)).map(|(term, (a, b))| inner(term, *a, *b)).sum();
        let [with_a, with_b] = [a, b].map(|changes| self.with_model(changes));
        all - self.absorbs.as_ref().map_or(0.0, |c| with_a.dot(&c.solve(&with_b)))
    }

    fn with_model(&self, changes: &[Change]) -> DVector<f64> {
        let with = |slopes: &Vec<Slope>| {
            let pairs = self.terms.iter().zip(slopes.iter().zip(changes));
            pairs.map(|(term, (slope, c))| inner(term, change(slope), *c)).sum::<f64>()
        };
        DVector::from_iterator(self.slopes.len(), self.slopes.iter().map(with))
    }
}

fn change(slope: &Slope) -> Change {
    [slope.ln_mean, slope.range_m]
}

fn apart((before, after): (&Term, &Term)) -> Change {
    // A ray that misses after a move has no range; what it would change is in its power.
    let seen = before.range_m > 0.0 && after.range_m > 0.0;
    [after.ln_mean - before.ln_mean, if seen { after.range_m - before.range_m } else { 0.0 }]
}

fn along(term: &Term, [mean, range]: Change) -> f64 {
    term.pull * mean + term.range_slope * range
}

fn inner(term: &Term, a: Change, b: Change) -> f64 {
    term.bend * a[0] * b[0] + term.range_bend * a[1] * b[1]
}
