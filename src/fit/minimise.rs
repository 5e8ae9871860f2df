//! Levenberg–Marquardt with bounds, on a dozen unknowns.
//!
//! A cost is known by its local quadratic: value, gradient g and a curvature H that is never
//! negative (JᵀJ of least squares, the scores' outer products of a likelihood). A step solves
//! (H + λ·diag H)·d = −g on the unknowns that are not held by a bound, λ falling with success and
//! rising with failure (Marquardt 1963, DOI 10.1137/0111030). The end is where the Newton decrement
//! gᵀH⁻¹g/2, the improvement that a full step still promises, is below a tolerance.

use nalgebra::{DMatrix, DVector};
use serde::Serialize;

/// The local quadratic of a cost.
#[derive(Clone, Debug)]
pub(crate) struct Local {
    /// The cost.
    pub value: f64,
    /// Its gradient.
    pub gradient: DVector<f64>,
    /// Its curvature, symmetric and positive semidefinite.
    pub curvature: DMatrix<f64>,
}

impl Local {
    /// Zero, as the start of a sum.
    pub fn zero(len: usize) -> Local {
        let (gradient, curvature) = (DVector::zeros(len), DMatrix::zeros(len, len));
        Local { value: 0.0, gradient, curvature }
    }

    /// Adds `first`·j to the gradient and `second`·j·jᵀ to the curvature.
    #[inline(always)]
    pub fn add(&mut self, first: f64, second: f64, j: &[f64]) {
        if first != 0.0 {
            self.gradient.as_mut_slice().iter_mut().zip(j).for_each(|(sum, a)| *sum += first * a);
        }
        if second != 0.0 {
            // The matrix is stored by columns, one after the other.
            let columns = self.curvature.as_mut_slice().chunks_exact_mut(j.len().max(1));
            for (column, a) in columns.zip(j) {
                let by = second * a;
                if by == 0.0 {
                    continue;
                }
                column.iter_mut().zip(j).for_each(|(sum, b)| *sum += by * b);
            }
        }
    }

    /// Adds another sum.
    pub fn merge(mut self, other: Local) -> Local {
        self.value += other.value;
        self.gradient += other.gradient;
        self.curvature += other.curvature;
        self
    }
}

/// Why a search ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stop {
    /// No step promises an improvement: converged.
    Stationary,
    /// Every unknown is at a bound: converged, but determined by the bounds and not by the data.
    Bounded,
    /// No step improves although one should, as far as patience goes.
    Stuck,
    /// The iterations ran out.
    Iterations,
    /// The cost is not finite at the start.
    NotFinite,
    /// From other starts the search ended at a worse optimum, by more than chance explains.
    StartsDisagree,
}

impl Stop {
    /// The word that JSON uses.
    pub fn as_str(self) -> &'static str {
        match self {
            Stop::Stationary => "stationary",
            Stop::Bounded => "bounded",
            Stop::Stuck => "stuck",
            Stop::Iterations => "iterations",
            Stop::NotFinite => "not-finite",
            Stop::StartsDisagree => "starts-disagree",
        }
    }
}

/// Search settings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Minimise {
    /// Most steps tried.
    pub iterations: usize,
    /// Promised improvement that is no longer worth a step, in the unit of the cost.
    pub tolerance: f64,
    /// Failed steps in a row after which the search ends; each is damped six times more than the one before.
    pub patience: usize,
}

/// Where a search ended.
#[derive(Clone, Debug)]
pub(crate) struct Minimum {
    /// The point.
    pub at: DVector<f64>,
    /// The cost there.
    pub local: Local,
    /// Steps tried.
    pub iterations: usize,
    /// Why it ended.
    pub stop: Stop,
}

/// Longest change of an unknown that is considered. An unknown whose change by this much improves the cost by less
/// than the tolerance is held: where the cost is flat, its step would be without limit and spoil those of the others.
const REACH: f64 = 10.0;

/// Smallest, first and largest damping λ, and how it falls and rises.
const DAMPING: [f64; 3] = [1e-9, 1e-3, 1e9];
const EASE: f64 = 0.2;
const TIGHTEN: f64 = 6.0;

impl Minimise {
    /// Searches from `start` within `[lower, upper]`; equal bounds hold an unknown.
    pub fn run(
        &self,
        start: &DVector<f64>,
        bounds: [&DVector<f64>; 2],
        cost: impl Fn(&DVector<f64>) -> Local,
    ) -> Minimum {
        self.run_with(start, bounds, |_| f64::NEG_INFINITY, cost)
    }

    /// As [`run`](Self::run), with a cheap lower bound of the cost: a step whose `value` is not below the
    /// cost so far is refused without computing the cost there.
    pub fn run_with(
        &self,
        start: &DVector<f64>,
        [lower, upper]: [&DVector<f64>; 2],
        value: impl Fn(&DVector<f64>) -> f64,
        cost: impl Fn(&DVector<f64>) -> Local,
    ) -> Minimum {
        let mut at = clamped(start, lower, upper);
        let mut local = cost(&at);
        let mut damping = DAMPING[1];
        let (mut iterations, mut rejected) = (0, 0);
        let stop = loop {
            if !local.value.is_finite() {
                break Stop::NotFinite;
            }
            let free = self.free(&at, &local, lower, upper);
            if free.is_empty() {
                break Stop::Bounded;
            }
            if self.is_done(&local, &free) {
                break Stop::Stationary;
            }
            if damping > DAMPING[2] || rejected >= self.patience {
                break Stop::Stuck;
            }
            if iterations == self.iterations {
                break Stop::Iterations;
            }
            iterations += 1;
            let next = clamped(&(&at + step(&local, &free, damping)), lower, upper);
            let there = (value(&next) < local.value).then(|| cost(&next));
            match there.filter(|there| there.value < local.value) {
                Some(there) => {
                    (at, local) = (next, there);
                    damping = (damping * EASE).max(DAMPING[0]);
                    rejected = 0;
                }
                None => {
                    damping *= TIGHTEN;
                    rejected += 1;
                }
            }
        };
        Minimum { at, local, iterations, stop }
    }

    /// Where the full Newton step from a point leads, on the unknowns that no bound holds.
    pub fn newton(
        &self,
        at: &DVector<f64>,
        [lower, upper]: [&DVector<f64>; 2],
        local: &Local,
    ) -> DVector<f64> {
        let free = self.free(at, local, lower, upper);
        clamped(&(at + step(local, &free, DAMPING[0])), lower, upper)
    }

    fn is_done(&self, local: &Local, free: &[usize]) -> bool {
        let newton = step(local, free, DAMPING[0]);
        -0.5 * local.gradient.dot(&newton) < self.tolerance
    }

    /// Unknowns that a step may move: inside their bounds or drawn inwards, and not flat.
    fn free(
        &self,
        at: &DVector<f64>,
        local: &Local,
        lower: &DVector<f64>,
        upper: &DVector<f64>,
    ) -> Vec<usize> {
        let mut free = Vec::new();
        for i in 0..at.len() {
            let (slope, bend) = (local.gradient[i], local.curvature[(i, i)]);
            let held_below = at[i] <= lower[i] && slope >= 0.0;
            let held_above = at[i] >= upper[i] && slope <= 0.0;
            let is_flat = slope.abs() * REACH + 0.5 * bend * REACH * REACH < self.tolerance;
            if lower[i] < upper[i] && !held_below && !held_above && !is_flat {
                free.push(i);
            }
        }
        free
    }
}

impl Minimum {
    /// Whether the search ended where the cost is least nearby.
    pub fn converged(&self) -> bool {
        matches!(self.stop, Stop::Stationary | Stop::Bounded)
    }
}

fn clamped(at: &DVector<f64>, lower: &DVector<f64>, upper: &DVector<f64>) -> DVector<f64> {
    at.zip_zip_map(lower, upper, |x, low, high| x.max(low).min(high))
}

fn step(local: &Local, free: &[usize], damping: f64) -> DVector<f64> {
    let count = free.len();
    let largest = free.iter().map(|&i| local.curvature[(i, i)]).fold(0.0, f64::max);
    let matrix = DMatrix::from_fn(count, count, |row, column| {
        let entry = local.curvature[(free[row], free[column])];
        let ridge = damping * entry + 1e-14 * largest + f64::MIN_POSITIVE;
        if row == column { entry + ridge } else { entry }
    });
    let downhill = DVector::from_fn(count, |row, _| -local.gradient[free[row]]);
    let solved = matrix.cholesky().map(|c| c.solve(&downhill));
    let mut step = DVector::zeros(local.gradient.len());
    for (&i, d) in free.iter().zip(solved.unwrap_or(downhill).iter()) {
        step[i] = *d;
    }
    step
}

/// The values after a step of each unknown, with the step, for one-sided differences. A step that would pass the upper
/// bound goes the other way.
pub(crate) fn step_each<T>(
    at: &DVector<f64>,
    upper: &DVector<f64>,
    step: f64,
    value: impl Fn(&DVector<f64>) -> T,
) -> Vec<(f64, T)> {
    let one = |index: usize| {
        let step = if at[index] + step > upper[index] { -step } else { step };
        let mut there = at.clone();
        there[index] += step;
        (step, value(&there))
    };
    (0..at.len()).map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEARCH: Minimise = Minimise { iterations: 200, tolerance: 1e-14, patience: usize::MAX };

    fn add_residual(local: &mut Local, residual: f64, jacobian: &[f64]) {
        local.value += 0.5 * residual * residual;
        local.add(residual, 1.0, jacobian);
    }

    /// Rosenbrock's valley: residuals 10(y − x²) and 1 − x.
    fn valley(at: &DVector<f64>) -> Local {
        let mut local = Local::zero(2);
        add_residual(&mut local, 10.0 * (at[1] - at[0] * at[0]), &[-20.0 * at[0], 10.0]);
        add_residual(&mut local, 1.0 - at[0], &[-1.0, 0.0]);
        local
    }

    fn vector(values: [f64; 2]) -> DVector<f64> {
        DVector::from_row_slice(&values)
    }

    #[test]
    fn the_valley_is_followed_to_its_end() {
        let bounds = [&vector([-5.0, -5.0]), &vector([5.0, 5.0])];
        let found = SEARCH.run(&vector([-1.2, 1.0]), bounds, valley);
        assert_eq!(found.stop, Stop::Stationary);
        assert!((found.at - vector([1.0, 1.0])).norm() < 1e-6);
    }

    #[test]
    fn a_bound_holds_and_the_rest_still_moves() {
        let bounds = [&vector([-5.0, -5.0]), &vector([0.5, 5.0])];
        let found = SEARCH.run(&vector([-1.2, 1.0]), bounds, valley);
        assert!(found.converged());
        assert!((found.at - vector([0.5, 0.25])).norm() < 1e-6);
    }

    #[test]
    fn a_held_unknown_stays_and_no_number_is_said() {
        let bounds = [&vector([2.0, -5.0]), &vector([2.0, 5.0])];
        let found = SEARCH.run(&vector([2.0, 0.0]), bounds, valley);
        assert!((found.at - vector([2.0, 4.0])).norm() < 1e-6);
        let nan = |_: &DVector<f64>| Local { value: f64::NAN, ..Local::zero(2) };
        assert_eq!(SEARCH.run(&vector([2.0, 0.0]), bounds, nan).stop, Stop::NotFinite);
    }

    #[test]
    fn a_flat_direction_does_not_stop_the_rest() {
        let flat = |at: &DVector<f64>| {
            let mut local = Local::zero(2);
            add_residual(&mut local, at[0] + at[1] - 1.0, &[1.0, 1.0]);
            local
        };
        let bounds = [&vector([-5.0, -5.0]), &vector([5.0, 5.0])];
        let found = SEARCH.run(&vector([3.0, 1.0]), bounds, flat);
        assert!(found.converged() && found.local.value < 1e-12);
    }

    #[test]
    fn an_unknown_that_hardly_matters_does_not_spoil_the_steps_of_the_rest() {
        // Its full step is 10⁵ long, and leads where the cost is worse.
        let cost = |at: &DVector<f64>| {
            let mut local = Local::zero(2);
            add_residual(&mut local, at[0] - 3.0, &[1.0, 0.0]);
            add_residual(&mut local, 1.0 - 1e-5 * at[1].min(1.0), &[0.0, -1e-5]);
            local.value += 1e-3 * (at[1] - 1.0).max(0.0);
            local
        };
        let bounds = [&vector([-1e9; 2]), &vector([1e9; 2])];
        let search = Minimise { tolerance: 0.1, patience: 3, ..SEARCH };
        let found = search.run(&vector([0.0, 0.0]), bounds, cost);
        assert!(found.converged() && (found.at[0] - 3.0).abs() < 0.5, "{found:?}");
    }
}
