//! Where ranges put a target that does not stand still where the scene has it: robust least squares of measured
//! less predicted ranges, with every ray traced anew after each step, as in the registration of points to
//! planes (Chen & Medioni, Image and Vision Computing 10, 1992).
//!
//! Powers have edges everywhere, at which a search that begins far away stays; ranges change smoothly with the place
//! of a surface, and those of rays that meet another surface by then have no weight.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::refit::{Problem, Space};
use super::shots::Observation;
use crate::effects::{Effect, Shot};
use crate::frames::{Global, Pose};
use crate::measure::icp::bulk_sd_m;

/// Rounds of tracing at most, and the step, in those of the effect's numbers, that is worth no further one.
const ROUNDS: usize = 12;
const ARRIVED: f64 = 0.01;
/// Where the weight of a range ends, in standard deviations: Tukey's biweight with 95 % efficiency.
const BIWEIGHT: f64 = 4.685;
/// Step over which the way of a surface point is seen, in those of the numbers.
const STEP: f64 = 1e-3;

/// A point with the numbers of its last effect where the ranges put the target, and where they tell
/// nothing, as of a shift of a plane in itself, within so many steps of the start; the start where they tell nothing
/// at all.
pub(super) fn placed(
    problem: &Problem,
    space: &Space,
    effect: &dyn Effect,
    start: &DVector<f64>,
    within: f64,
) -> DVector<f64> {
    let mut at = start.clone();
    let first = at.len() - effect.parameters().len();
    let [lower, upper] = space.bounds();
    for _ in 0..ROUNDS {
        let Some(step) = step(problem, space, effect, [start, &at], within) else {
            return start.clone();
        };
        for (index, by) in (first..).zip(&step) {
            at[index] = (at[index] + by).clamp(lower[index], upper[index]);
        }
        if step.amax() < ARRIVED {
            break;
        }
    }
    at
}

/// A shot with a range: measured less predicted, m, and the change of the predicted one by every number, m per step.
struct Row {
    off_m: f64,
    by_number: Vec<f64>,
}

/// The step from the second point, on the way from the first; numbers are normal about this one beforehand.
fn step(
    problem: &Problem,
    space: &Space,
    effect: &dyn Effect,
    [start, at]: [&DVector<f64>; 2],
    within: f64,
) -> Option<DVector<f64>> {
    let model = space.model(problem.receiver, at);
    let values = space.effect_values(at).pop()?;
    let row = |(shot, seen): (&Shot, &Observation)| {
        let range_m = seen.range_m.filter(|_| problem.declared.range_sd_m > 0.0)?;
        let placed = model.placed(problem.stage, *shot)?;
        let by_number =
            (0..values.len()).map(|number| slope(problem, effect, &values, number, &placed));
        Some(Row { off_m: range_m - placed.hit.range_m, by_number: by_number.collect() })
    };
    let rows: Vec<Row> =
        problem.shots.par_iter().zip(problem.observations).filter_map(row).collect();
    let sd_m = bulk_sd_m(rows.iter().map(|row| row.off_m)).max(problem.declared.range_sd_m);
    let moved = (at - start).remove_rows(0, at.len() - values.len());
    let mut normal = DMatrix::identity(values.len(), values.len()) / within.powi(2);
    let mut right = -moved / within.powi(2);
    for Row { off_m, by_number } in &rows {
        let x = off_m / (BIWEIGHT * sd_m);
        let weight = if x.abs() < 1.0 { ((1.0 - x * x) / sd_m).powi(2) } else { 0.0 };
        let slopes = DVector::from_column_slice(by_number);
        normal.ger(weight, &slopes, &slopes, 1.0);
        right.axpy(weight * off_m, &slopes, 1.0);
    }
    normal.cholesky().map(|cholesky| cholesky.solve(&right))
}

/// Change of the range of a shot by one number, m per step: the way of the surface point that it meets, seen
/// along the ray.
fn slope(
    problem: &Problem,
    effect: &dyn Effect,
    values: &[f64],
    number: usize,
    shot: &Shot,
) -> f64 {
    let motion = |values: &[f64]| effect.motion(values, problem.stage, shot).unwrap_or(Pose::NONE);
    let mut moved = values.to_vec();
    moved[number] += STEP * effect.parameters()[number].step;
    let motion: Pose<Global, Global> = motion(&moved) * motion(values).inverse();
    let way_m = (motion * shot.hit.point).xyz - shot.hit.point.xyz;
    -way_m.dot(shot.normal) / (STEP * shot.hit.cos_theta.max(0.05))
}
