//! Where the ranges place a target that has moved from its pose in the scene: robust least squares of measured
//! less predicted ranges, with every ray traced anew after each step, as in the registration of points to
//! planes (Chen & Medioni, Image and Vision Computing 10, 1992).
//!
//! Powers jump at edges, and a search by powers that begins far away stops there. Ranges change smoothly with the place
//! of a surface, and the rays that meet another surface by then have no weight.

use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;

use super::observation::Observation;
use super::problem::Problem;
use super::space::Space;
use crate::effects::{Effect, Model, Shot, Stage, Twist, way_m};
use crate::measure::icp::bulk_sd_m;

/// Most rounds of tracing.
const ROUNDS: usize = 12;
/// Step that needs no further round, in steps of the effect's parameters.
const ARRIVED: f64 = 0.01;
/// Where the weight of a range ends, in standard deviations: Tukey's biweight with 95 % efficiency.
const BIWEIGHT: f64 = 4.685;

/// A point with the parameters of its last effect where the ranges place the target. Directions that the ranges do
/// not determine, such as a shift of a plane in itself, stay within `within` steps of the start. Returns the start
/// where the ranges determine nothing.
pub(super) fn place_by_ranges(
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

/// One measured range.
struct Row {
    /// Measured less predicted range, m.
    off_m: f64,
    /// Change of the predicted range by every parameter, m per step.
    slopes_m: Vec<f64>,
}

/// A Gauss–Newton step at the second of two points. The parameters have a normal prior about the first.
fn step(
    problem: &Problem,
    space: &Space,
    effect: &dyn Effect,
    [start, at]: [&DVector<f64>; 2],
    within: f64,
) -> Option<DVector<f64>> {
    let rows = rows(problem, space, effect, at);
    let unknowns = effect.parameters().len();
    let sd_m = bulk_sd_m(rows.iter().map(|row| row.off_m)).max(problem.declared.range_sd_m);
    let moved = (at - start).remove_rows(0, at.len() - unknowns);
    let mut normal = DMatrix::identity(unknowns, unknowns) / within.powi(2);
    let mut right = -moved / within.powi(2);
    for Row { off_m, slopes_m } in &rows {
        let x = off_m / (BIWEIGHT * sd_m);
        let weight = if x.abs() < 1.0 { ((1.0 - x * x) / sd_m).powi(2) } else { 0.0 };
        let slopes = DVector::from_column_slice(slopes_m);
        normal.ger(weight, &slopes, &slopes, 1.0);
        right.axpy(weight * off_m, &slopes, 1.0);
    }
    normal.cholesky().map(|cholesky| cholesky.solve(&right))
}

/// Every range that the target at a point has a prediction for.
fn rows(problem: &Problem, space: &Space, effect: &dyn Effect, at: &DVector<f64>) -> Vec<Row> {
    let scans = problem.views.stages.len();
    let models: Vec<Model> =
        (0..scans).map(|scan| space.model(problem.receiver, at, scan as u16)).collect();
    let values = space.effect_values(at).pop().unwrap_or_default();
    let pairs = problem.shots.par_iter().zip(problem.observations);
    pairs
        .filter_map(|(shot, seen): (&Shot, &Observation)| {
            let range_m = seen.range_m.filter(|_| problem.declared.range_sd_m > 0.0)?;
            let model = models.get(usize::from(shot.scan)).filter(|_| effect.acts_on(shot.scan))?;
            let stage = problem.stage(shot);
            let placed = model.placed(stage, *shot)?;
            let twists = effect.twists(&values, stage, &placed);
            let steps = effect.parameters().iter().map(|known| known.step);
            let slopes_m = twists.iter().zip(steps);
            let slopes_m = slopes_m.map(|(twist, step)| step * slope_m(stage, twist, &placed));
            let expected_m = stage.range_m(placed.ray.origin, &placed.hit);
            Some(Row { off_m: range_m - expected_m, slopes_m: slopes_m.collect() })
        })
        .collect()
}

/// Change of the range of a shot by a small motion of the target, m: the way of its surface point, projected on the normal
/// and seen along the ray. At an antenna apart from the radar's, half of that and of what it adds to the way back.
fn slope_m(stage: &Stage, twist: &Twist, shot: &Shot) -> f64 {
    let way_m = way_m(twist, stage.middle, shot.hit.point.xyz);
    let along_ray_m = -way_m.dot(shot.normal) / shot.hit.cos_theta.max(0.05);
    let towards = stage.antenna.and_then(|at| shot.hit.point.towards(at.position));
    towards.map_or(along_ray_m, |towards| {
        0.5 * (1.0 - shot.ray.direction.xyz().dot(towards.xyz())) * along_ray_m
    })
}
