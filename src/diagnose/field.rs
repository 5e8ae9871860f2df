//! Structure of unknown origin: a smooth field over all covariates at once, fitted in addition to the model.
//!
//! ln mean gets a sum over covariates of piecewise linear functions with knots at quantiles, and a
//! bilinear map over the target plane. A ridge holds every number near zero. The unknowns of the scattering models
//! are free at the same time, so that the field takes only what they cannot absorb. It is found by
//! scoring on all folds but one and judged on that one. Its gain is an upper bound of what any other model of the
//! mean could still gain; it identifies no cause.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::covariates::{Covariate, quantiles};
use super::folds::Folds;
use super::likelihood::{Likelihood, Term};
use super::problem::Problem;
use super::score::DB;
use crate::effects::{Prediction, Shot};

/// Side of a cell of the map, m.
const MAP_CELL_M: f64 = 0.08;
/// Prior standard deviations of a number, in ln mean. The one with the best held-out ln p is used.
const SIZES: [f64; 3] = [0.03, 0.1, 0.4];
/// Scoring steps of a fit.
const STEPS: usize = 3;
/// Largest change of ln mean: beyond it the mean is no longer a small change of the model's.
const MOST_CHANGE: f64 = 3.0;

/// The numbers of a field at one shot, with their weights.
type Entry = Vec<(usize, f64)>;

/// A design over the shots of a scan.
pub(super) struct Field {
    entries: Vec<Entry>,
    /// Covariate of every number.
    names: Vec<&'static str>,
}

/// The model that a field is added to.
#[derive(Clone, Copy)]
pub(super) struct Model<'a> {
    pub problem: &'a Problem<'a>,
    pub prediction: &'a Prediction,
    /// Slopes of ln mean by the model's own unknowns, one list per unknown.
    pub slopes: &'a [Vec<f64>],
}

/// The result of a field.
pub(super) struct Structure {
    /// ln factor on the mean of every shot, by a field fitted without its fold.
    pub ln_factor: Vec<f64>,
    /// Gain in held-out ln p, and its standard error.
    pub gain: [f64; 2],
    /// Gain in ln likelihood of a field fitted to all folds.
    pub fitted_gain: f64,
    /// Root mean square change over the detections, dB.
    pub size_db: f64,
    /// Root mean square change over the detections by the part of every covariate, dB, largest first.
    pub parts_db: Vec<(&'static str, f64)>,
}

impl Field {
    /// A field over these covariates and the target plane.
    pub fn new(shots: &[Shot], covariates: &[Covariate]) -> Field {
        let mut field = Field::spline(shots, covariates);
        field.add_map(shots);
        field
    }

    /// A field over these covariates alone.
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

    /// Adds a bilinear map over the target plane.
    fn add_map(&mut self, shots: &[Shot]) {
        let mut corners = BTreeMap::new();
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

    /// The structure that the field finds beside a model.
    pub fn structure(&self, model: Model, folds: &Folds) -> Structure {
        let without = model.terms(&vec![0.0; self.entries.len()]);
        // The prior under which the field predicts held-out patches best.
        let tried = SIZES.map(|size| {
            let ln_factor = self.held_out_factors(model, size, folds);
            (size, folds.sum(&gains(&model.terms(&ln_factor), &without)), ln_factor)
        });
        let best = tried.into_iter().max_by(|a, b| a.1[0].total_cmp(&b.1[0]));
        let (size, gain, ln_factor) = best.unwrap_or_default();
        // The field of all folds, and the share of every covariate in it.
        let numbers = self.fit(model, size, |_| true);
        let mut names = self.names.clone();
        names.dedup();
        let mut parts_db: Vec<(&'static str, f64)> = names
            .iter()
            .map(|name| (*name, model.rms_db(|shot| self.part(&numbers, name, shot))))
            .collect();
        parts_db.sort_by(|a, b| b.1.total_cmp(&a.1));
        let size_db = model.rms_db(|shot| ln_factor.get(shot).copied().unwrap_or(0.0));
        let with = model.terms(&self.ln_factors(&numbers, model.slopes));
        let fitted_gain = gains(&with, &without).iter().sum();
        Structure { size_db, ln_factor, gain, fitted_gain, parts_db }
    }

    /// ln factor of every shot by a field fitted without its fold.
    fn held_out_factors(&self, model: Model, size: f64, folds: &Folds) -> Vec<f64> {
        let mut ln_factor = vec![0.0; self.entries.len()];
        for fold in 0..folds.folds {
            let numbers = self.fit(model, size, |shot| !folds.holds_out(fold, shot));
            for (shot, factor) in ln_factor.iter_mut().enumerate() {
                if folds.holds_out(fold, shot) {
                    *factor = self.ln_factor(&numbers, model.slopes, shot);
                }
            }
        }
        ln_factor
    }

    /// Most likely numbers of the field, and after them those of the model's unknowns.
    fn fit(&self, model: Model, size: f64, used: impl Fn(usize) -> bool) -> DVector<f64> {
        let count = self.names.len() + model.slopes.len();
        let mut numbers = DVector::zeros(count);
        // A saturating receiver passes part of a change.
        let passes: Vec<f64> = (0..self.entries.len()).map(|shot| model.passes(shot)).collect();
        for _ in 0..STEPS {
            let terms = model.terms(&self.ln_factors(&numbers, model.slopes));
            let mut curvature = DMatrix::zeros(count, count);
            let mut downhill = DVector::zeros(count);
            for (shot, term) in terms.iter().enumerate().filter(|(shot, _)| used(*shot)) {
                let mut row = self.row(model.slopes, shot);
                row.iter_mut().for_each(|(_, a)| *a *= passes[shot]);
                for &(i, a) in &row {
                    downhill[i] += a * term.slope;
                    for &(j, b) in row.iter().filter(|(j, _)| *j <= i) {
                        curvature[(i, j)] += a * b * term.bend;
                    }
                }
            }
            // The prior of the field, and a small ridge for the model's unknowns.
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

    /// The design at one shot, with the slopes of the model's unknowns.
    fn row(&self, slopes: &[Vec<f64>], shot: usize) -> Entry {
        let mut row = self.entries.get(shot).cloned().unwrap_or_default();
        for (index, slopes) in (self.names.len()..).zip(slopes) {
            row.extend(
                slopes.get(shot).filter(|slope| **slope != 0.0).map(|slope| (index, *slope)),
            );
        }
        row
    }

    fn ln_factors(&self, numbers: &DVector<f64>, slopes: &[Vec<f64>]) -> Vec<f64> {
        (0..self.entries.len()).map(|shot| self.ln_factor(numbers, slopes, shot)).collect()
    }

    /// ln factor on the mean of a shot.
    fn ln_factor(&self, numbers: &DVector<f64>, slopes: &[Vec<f64>], shot: usize) -> f64 {
        let sum = self.row(slopes, shot).iter().map(|(i, a)| a * numbers[*i]).sum::<f64>();
        sum.clamp(-MOST_CHANGE, MOST_CHANGE)
    }

    /// The part of one covariate in the ln factor of a shot.
    fn part(&self, numbers: &DVector<f64>, name: &str, shot: usize) -> f64 {
        let entry = self.entries.get(shot).into_iter().flatten();
        entry.filter(|(i, _)| self.names[*i] == name).map(|(i, a)| a * numbers[*i]).sum()
    }
}

impl Model<'_> {
    /// The part of every shot in the likelihood with factors on the means.
    fn terms(&self, ln_factor: &[f64]) -> Vec<Term> {
        terms(self.problem, self.prediction, ln_factor)
    }

    /// Share of a small change of the mean that the receiver passes.
    fn passes(&self, shot: usize) -> f64 {
        self.prediction.saturating.passes(self.prediction.mean_w(shot))
    }

    /// Root mean square over the detections of a change of ln mean, as the receiver passes it, dB.
    fn rms_db(&self, change: impl Fn(usize) -> f64) -> f64 {
        let (mut sum, mut count) = (0.0, 0usize);
        for (shot, seen) in self.problem.observations.iter().enumerate() {
            if seen.power_w.is_some() {
                sum += (change(shot) * self.passes(shot)).powi(2);
                count += 1;
            }
        }
        DB * (sum / count.max(1) as f64).sqrt()
    }
}

/// A prediction with factors on its first mean powers, given by their logarithms.
pub(super) fn scaled(mut prediction: Prediction, ln_factor: &[f64]) -> Prediction {
    for (arrived, ln_factor) in prediction.arrived.iter_mut().zip(ln_factor) {
        if let Some(arrived) = arrived {
            arrived.power_w *= ln_factor.exp();
        }
    }
    prediction
}

/// The part of every shot in the likelihood with factors on the means.
pub(super) fn terms(problem: &Problem, prediction: &Prediction, ln_factor: &[f64]) -> Vec<Term> {
    let prediction = scaled(prediction.clone(), ln_factor);
    Likelihood::new(&prediction, problem.declared, problem.shared).terms(problem.observations)
}

/// Gain in ln p of every shot.
fn gains(with: &[Term], without: &[Term]) -> Vec<f64> {
    with.iter().zip(without).map(|(a, b)| a.ln_p - b.ln_p).collect()
}

/// The two knots about a value and their shares.
fn hats(knots: &[f64], value: f64) -> [(usize, f64); 2] {
    let above = knots.partition_point(|knot| *knot <= value).clamp(1, knots.len().max(2) - 1);
    let [low, high] = [above - 1, above].map(|k| knots.get(k).copied().unwrap_or(value));
    let share = if high > low { ((value - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
    [(above - 1, 1.0 - share), (above.min(knots.len().max(1) - 1), share)]
}
