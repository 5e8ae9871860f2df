//! Structure of unknown origin: a smooth field over every covariate at once, fitted beside the model.
//!
//! ln mean gets Σ over covariates of a piecewise linear function with knots at quantiles, and a
//! bilinear map over the target plane; a ridge holds every number near nothing, and the laws' own
//! numbers are free beside it, so that the field takes only what they cannot absorb. It is found by
//! scoring on all folds but one and judged on that one. What it gains there is what any model of the
//! mean could still gain; that it names nothing is the point.

use nalgebra::{DMatrix, DVector};

use super::covariates::{Covariate, quantiles};
use super::folds::Folds;
use super::likelihood::{Likelihood, Term};
use super::refit::Problem;
use super::score::DB;
use crate::effects::{Prediction, Shot};

/// Side of a cell of the map, m.
const MAP_CELL_M: f64 = 0.08;
/// How large a number may be, as the standard deviation of ln mean; the best by held-out ln p.
const SIZES: [f64; 3] = [0.03, 0.1, 0.4];
const STEPS: usize = 3;

/// A field's numbers at one shot: which, and with which weight.
type Entry = Vec<(usize, f64)>;

/// A design over the shots of a scan.
pub(super) struct Field {
    entries: Vec<Entry>,
    /// Name of what a number goes over.
    names: Vec<&'static str>,
}

/// What the field finds.
pub(super) struct Structure {
    /// ln factor on the mean of every shot, by a field that has not seen its fold.
    pub ln_factor: Vec<f64>,
    /// Gain in held-out ln p, and its standard error.
    pub gain: [f64; 2],
    /// Gain in ln likelihood where it has seen all folds.
    pub fitted_gain: f64,
    /// Root mean square over the detections of what it changes, dB.
    pub size_db: f64,
    /// The same of every covariate's part.
    pub parts_db: Vec<(&'static str, f64)>,
}

impl Field {
    /// Over these covariates and the target plane.
    pub fn new(shots: &[Shot], covariates: &[Covariate]) -> Field {
        let mut field = Field::spline(shots, covariates);
        field.add_map(shots);
        field
    }

    /// Over these covariates alone.
    pub fn spline(shots: &[Shot], covariates: &[Covariate]) -> Field {
        let mut field = Field { entries: vec![Vec::new(); shots.len()], names: Vec::new() };
        for covariate in covariates {
            let knots = quantiles(&covariate.values, covariate.cells);
            let first = field.names.len();
            field.names.extend(knots.iter().map(|_| covariate.name));
            for (entry, value) in field.entries.iter_mut().zip(&covariate.values) {
                let [(low, share), high] = hats(&knots, *value);
                entry.extend([(first + low, share), (first + high.0, high.1)]);
            }
        }
        field
    }

    fn add_map(&mut self, shots: &[Shot]) {
        let mut corners = std::collections::BTreeMap::new();
        for (entry, shot) in self.entries.iter_mut().zip(shots) {
            let [x, y] = [shot.xt_m, shot.yt_m].map(|x| x / MAP_CELL_M);
            let [i, j] = [x, y].map(f64::floor);
            for (di, dj) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
                let weight = (1.0 - (x - i - di).abs()) * (1.0 - (y - j - dj).abs());
                let next = self.names.len();
                let number = *corners.entry([(i + di) as i64, (j + dj) as i64]).or_insert(next);
                if number == next {
                    self.names.push("map");
                }
                entry.push((number, weight));
            }
        }
    }

    /// What the field finds beside a model whose laws have these slopes.
    pub fn structure(
        &self,
        problem: &Problem,
        prediction: &Prediction,
        laws: &[Vec<f64>],
        folds: &Folds,
    ) -> Structure {
        let here = terms(problem, prediction, &vec![0.0; self.entries.len()]);
        let at_size = |size: f64| {
            let mut ln_factor = vec![0.0; self.entries.len()];
            for fold in 0..folds.folds {
                let used = |shot: usize| folds.fold.get(shot) != Some(&fold);
                let numbers = self.fit(problem, prediction, laws, size, &used);
                for (shot, factor) in ln_factor.iter_mut().enumerate() {
                    if !used(shot) {
                        *factor = self.ln_factor(&numbers, laws, shot);
                    }
                }
            }
            let there = terms(problem, prediction, &ln_factor);
            let gains: Vec<f64> = there.iter().zip(&here).map(|(a, b)| a.ln_p - b.ln_p).collect();
            (size, folds.sum(&gains), ln_factor)
        };
        let best = SIZES.map(at_size).into_iter().max_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        let (size, gain, ln_factor) = best.unwrap_or_default();
        let numbers = self.fit(problem, prediction, laws, size, &|_| true);
        let detected: Vec<usize> = (0..self.entries.len())
            .filter(|shot| problem.observations.get(*shot).is_some_and(|o| o.power_w.is_some()))
            .collect();
        let rms_db = |part: &dyn Fn(usize) -> f64| {
            // As it is seen: what a receiver does not pass counts for nothing.
            let seen =
                |shot: usize| part(shot) * prediction.saturating.passes(prediction.mean_w(shot));
            let sum: f64 = detected.iter().map(|shot| seen(*shot).powi(2)).sum();
            DB * (sum / detected.len().max(1) as f64).sqrt()
        };
        let mut names = self.names.clone();
        names.dedup();
        let part = |name: &&'static str| (*name, rms_db(&|shot| self.part(&numbers, name, shot)));
        let mut parts_db: Vec<(&'static str, f64)> = names.iter().map(part).collect();
        parts_db.sort_by(|a, b| b.1.total_cmp(&a.1));
        let size_db = rms_db(&|shot| ln_factor.get(shot).copied().unwrap_or(0.0));
        let factors: Vec<f64> =
            (0..self.entries.len()).map(|shot| self.ln_factor(&numbers, laws, shot)).collect();
        let there = terms(problem, prediction, &factors);
        let fitted_gain = there.iter().zip(&here).map(|(a, b)| a.ln_p - b.ln_p).sum();
        Structure { size_db, ln_factor, gain, fitted_gain, parts_db }
    }

    /// Most likely numbers of the field, and after them those of the laws.
    fn fit(
        &self,
        problem: &Problem,
        prediction: &Prediction,
        laws: &[Vec<f64>],
        size: f64,
        used: &dyn Fn(usize) -> bool,
    ) -> DVector<f64> {
        let count = self.names.len() + laws.len();
        let mut numbers = DVector::zeros(count);
        // A receiver that saturates passes less of a change.
        let passes: Vec<f64> = (0..self.entries.len())
            .map(|shot| prediction.saturating.passes(prediction.mean_w(shot)))
            .collect();
        for _ in 0..STEPS {
            let factors: Vec<f64> =
                (0..self.entries.len()).map(|shot| self.ln_factor(&numbers, laws, shot)).collect();
            let terms = terms(problem, prediction, &factors);
            let mut curvature = DMatrix::zeros(count, count);
            let mut downhill = DVector::zeros(count);
            for (shot, term) in terms.iter().enumerate().filter(|(shot, _)| used(*shot)) {
                let mut row = self.row(laws, shot);
                row.iter_mut().for_each(|(_, a)| *a *= passes[shot]);
                for &(i, a) in &row {
                    downhill[i] += a * term.slope;
                    for &(j, b) in row.iter().filter(|(j, _)| *j <= i) {
                        curvature[(i, j)] += a * b * term.bend;
                    }
                }
            }
            for i in 0..self.names.len() {
                curvature[(i, i)] += size.powi(-2);
                downhill[i] -= numbers[i] * size.powi(-2);
            }
            for i in self.names.len()..count {
                curvature[(i, i)] *= 1.0 + 1e-9;
                curvature[(i, i)] += 1e-9;
            }
            curvature.fill_upper_triangle_with_lower_triangle();
            let Some(solved) = curvature.cholesky().map(|c| c.solve(&downhill)) else { break };
            numbers += solved;
        }
        numbers
    }

    fn row(&self, laws: &[Vec<f64>], shot: usize) -> Entry {
        let mut row = self.entries.get(shot).cloned().unwrap_or_default();
        let first = self.names.len();
        let of_laws = laws
            .iter()
            .enumerate()
            .filter_map(|(k, slopes)| slopes.get(shot).map(|slope| (first + k, *slope)));
        row.extend(of_laws.filter(|(_, slope)| *slope != 0.0));
        row
    }

    fn ln_factor(&self, numbers: &DVector<f64>, laws: &[Vec<f64>], shot: usize) -> f64 {
        // Beyond this the mean is no longer a small change of the model's.
        self.row(laws, shot).iter().map(|(i, a)| a * numbers[*i]).sum::<f64>().clamp(-3.0, 3.0)
    }

    fn part(&self, numbers: &DVector<f64>, name: &str, shot: usize) -> f64 {
        let entry = self.entries.get(shot).into_iter().flatten();
        entry.filter(|(i, _)| self.names[*i] == name).map(|(i, a)| a * numbers[*i]).sum()
    }
}

/// With factors on the mean powers of the first shots, of which the logarithms are given.
pub(super) fn scaled(mut prediction: Prediction, ln_factor: &[f64]) -> Prediction {
    for (arrived, ln_factor) in prediction.arrived.iter_mut().zip(ln_factor) {
        if let Some(arrived) = arrived {
            arrived.power_w *= ln_factor.exp();
        }
    }
    prediction
}

/// Every shot's part of the likelihood with factors on the means.
pub(super) fn terms(problem: &Problem, prediction: &Prediction, ln_factor: &[f64]) -> Vec<Term> {
    let prediction = scaled(prediction.clone(), ln_factor);
    let likelihood = Likelihood::new(&prediction, problem.declared);
    let seen = problem.observations.iter().enumerate();
    seen.map(|(shot, seen)| likelihood.term(shot, seen)).collect()
}

/// The two knots about a value and the share of each.
fn hats(knots: &[f64], value: f64) -> [(usize, f64); 2] {
    let above = knots.partition_point(|knot| *knot <= value).clamp(1, knots.len().max(2) - 1);
    let [low, high] = [above - 1, above].map(|k| knots.get(k).copied().unwrap_or(value));
    let share = if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
    [(above - 1, 1.0 - share), (above.min(knots.len().max(1) - 1), share)]
}
