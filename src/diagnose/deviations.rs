//! Standard deviations of all unknowns of a fit.
//!
//! They come from the products of the scores at the end (Berndt, Hall, Hall & Hausman 1974), and from their scatter over
//! cells of the target where that is wider. Those of a pose are widened until ln p falls as they
//! promise: a body of revolution turns about its axis without a sign, by a little of each shift and turn.

use nalgebra::{DMatrix, DVector};

use super::folds::Folds;
use super::likelihood::Term;
use super::problem::{Problem, Slope};
use super::refit::{SEARCH, WIDE_TO_NARROW};
use super::space::Space;
use super::told::{self, LEAST_FALL};
use crate::fit::uncertainty::deviations;

/// How far an unknown that moves the target is changed to see what ln p tells of it, in steps of its parameter.
const MOST_STEPS: f64 = 10.0;
/// Most parameters of an effect for which ln p is looked at: a shift and a turn. A motion has dozens, and takes minutes.
const MOST_MOVING: usize = 6;
/// Curvature, in that of each unknown alone, which holds unknowns that the smooth parts of the surface leave free.
const HOLD: f64 = 1e-4;
/// Fall of ln p below which one counts as chance.
const CHANCE: f64 = 1.0;

impl Problem<'_> {
    /// Standard deviation of every unknown; infinite where a bound holds it or the data do not determine it. The larger of
    /// that of a right model and that of a model which is off from cell to cell of the target (Huber 1967, White 1982):
    /// B⁻¹·J·B⁻¹ with the products B of the shots' scores and those J of the cells' scores.
    pub fn sd(&self, space: &Space, at: &DVector<f64>, folds: &Folds) -> Vec<f64> {
        let [lower, upper] = space.bounds();
        let terms = self.terms(space, at);
        let slopes = self.slopes(space, at, [&lower, &upper], &terms);
        let beside = self.local_beside(space, at, [&lower, &upper]).curvature;
        let free: Vec<usize> =
            (0..at.len()).filter(|&i| at[i] > lower[i] && at[i] < upper[i]).collect();
        let of_free =
            |whole: DMatrix<f64>| (whole + &beside).select_rows(&free).select_columns(&free);
        let of_cells = of_free(products_of_cells(&slopes, folds));
        let of_shots = of_free(products(&terms, [&slopes, &slopes]));
        let mut told = deviations(&of_shots);
        if !space.moving().is_empty() {
            let wide = self.slopes_over(WIDE_TO_NARROW[0], space, at, [&lower, &upper], &terms);
            let both = of_free(products(&terms, [&slopes, &wide]));
            told = told::deviations(&of_shots, &both);
            let alone = of_shots.diagonal().map(|bend| bend.max(f64::MIN_POSITIVE).sqrt().recip());
            let smooth = self.smooth_curvature(space, &terms, &slopes);
            let smooth = smooth.select_rows(&free).select_columns(&free);
            let ways = Ways { together: moving_together(&smooth, &alone), free: &free, alone };
            self.widen(space, at, &ways, &mut told);
        }
        let inverse = of_shots.try_inverse().map(|inverse| &inverse * of_cells * &inverse);
        let mut sd = vec![f64::INFINITY; at.len()];
        for (place, (&i, told)) in free.iter().zip(told).enumerate() {
            let over_cells =
                inverse.as_ref().map_or(0.0, |all| all[(place, place)].max(0.0).sqrt());
            if let Some(of_model) = told {
                sd[i] = of_model.max(over_cells);
            }
        }
        sd
    }

    /// Widens the standard deviations of unknowns that move the target until ln p falls as they promise, with all others where
    /// they are likeliest. What moves along where ln p does not fall is told no better. `told` is of the free unknowns.
    fn widen(&self, space: &Space, at: &DVector<f64>, ways: &Ways, told: &mut [Option<f64>]) {
        let Ways { free, alone, together } = ways;
        let [lower, upper] = space.bounds();
        let (moving, here) = (space.moving_of(MOST_MOVING), self.ln_likelihood(space, at));
        if moving.is_empty() {
            return;
        }
        let mut least = vec![0.0; free.len()];
        for place in (0..free.len()).filter(|&place| moving.contains(&free[place])) {
            // A direction that nothing tells may need another unknown, which seems told by itself.
            let from = told[place].unwrap_or(alone[place]);
            let widened = told::widened(from, MOST_STEPS, |by| {
                let mut start = at.clone();
                free.iter()
                    .zip(together.column(place))
                    .for_each(|(&i, part)| start[i] += by * part);
                let start = start.zip_zip_map(&lower, &upper, f64::clamp);
                let there = self.fit(space, &start, &[free[place]], &SEARCH);
                let fall = here - there.ln_likelihood;
                if fall < LEAST_FALL {
                    let deviations = (2.0 * fall.max(CHANCE)).sqrt();
                    for (least, &i) in least.iter_mut().zip(*free) {
                        *least = f64::max(*least, (there.at[i] - at[i]).abs() / deviations);
                    }
                }
                fall
            });
            told[place] = told[place].and(widened);
        }
        for (told, least) in told.iter_mut().zip(least) {
            *told = told.map(|sd| sd.max(least));
        }
    }
}

/// How free unknowns move.
struct Ways<'a> {
    free: &'a [usize],
    /// Deviations with all others known.
    alone: DVector<f64>,
    /// In each column how all move with that of the column, where they keep to the surface.
    together: DMatrix<f64>,
}

/// [`Ways::together`] by the curvature of the shots that no edge passes over. `alone`: deviations with all others known.
fn moving_together(smooth: &DMatrix<f64>, alone: &DVector<f64>) -> DMatrix<f64> {
    let len = alone.len();
    let scaled = DMatrix::from_fn(len, len, |row, column| {
        let hold = if row == column { HOLD } else { 0.0 };
        alone[row] * smooth[(row, column)] * alone[column] + hold
    });
    let Some(inverse) = scaled.try_inverse() else { return DMatrix::identity(len, len) };
    DMatrix::from_fn(len, len, |row, column| {
        let part = inverse[(row, column)] / inverse[(column, column)];
        part * alone[row] / alone[column]
    })
}

/// Sum of the products of the shots' scores, by slopes of one or of two widths. Powers that share speckle count for less,
/// ranges do not. Without shared speckle both are one score.
fn products(terms: &[Term], [one, other]: [&[Vec<Slope>]; 2]) -> DMatrix<f64> {
    DMatrix::from_fn(one.len(), one.len(), |i, j| {
        let pairs = terms.iter().zip(one[i].iter().zip(&other[j]));
        let products = pairs.map(|(term, (a, b))| {
            if term.weight == 1.0 {
                return a.ln_p * b.ln_p;
            }
            let [power_a, power_b] = [a, b].map(|slope| slope.ln_p - slope.ln_range);
            power_a * power_b / term.weight + a.ln_range * b.ln_range
        });
        products.sum()
    })
}

/// Sum of the products of the cells' scores.
fn products_of_cells(slopes: &[Vec<Slope>], folds: &Folds) -> DMatrix<f64> {
    let of_cells: Vec<DVector<f64>> = slopes
        .iter()
        .map(|slopes| {
            let scores: Vec<f64> = slopes.iter().map(|slope| slope.ln_p).collect();
            DVector::from_vec(folds.cell_sums(&scores))
        })
        .collect();
    let cells = of_cells.first().map_or(2, |sums| sums.len().max(2)) as f64;
    let products = |i: usize, j: usize| of_cells[i].dot(&of_cells[j]);
    DMatrix::from_fn(slopes.len(), slopes.len(), products) * (cells / (cells - 1.0))
}
