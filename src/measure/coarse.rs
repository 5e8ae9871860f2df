//! The paper's loop (Fig. 8): virtual scan with the measurement's own pattern, nearest neighbours,
//! alignment, until the pose stops changing.

use glam::DVec3;

use super::error::RegistrationError;
use super::icp::{Gap, Motion, NormalEquations, bulk_sd_m, median, point_to_point, rigid};
use super::nearest::Nearest;
use super::settings::{Metric, Registration};
use super::tracer::Intersection;
use super::view::View;
use crate::frames::{Global, Point, Pose};

/// Each virtual scan pairs points within half the reach of the one before, down to this, m.
const LEAST_REACH_M: f64 = 0.02;
/// Pairs farther apart sideways than this many times the median lie beyond the edge of the virtual scan.
const BEYOND_THE_EDGE: f64 = 4.0;
/// Directions with less than this share of the best one's information are left to the loop along the rays, which knows what
/// the points tell: a sphere would turn from facet to facet.
const WEAKEST_SHARE: f64 = 1e-3;
/// With a smaller share of points near the mesh, the clouds do not overlap.
const LEAST_OVERLAP: f64 = 0.2;

/// The result of a coarse alignment.
pub(super) struct Alignment {
    pub pose: Pose<Global, Global>,
    pub scans: usize,
    pub steps: usize,
    pub still: bool,
}

/// A measured point and its neighbour on the model.
struct Pair {
    model: DVec3,
    measured: DVec3,
    normal: DVec3,
}

/// Aligns until a whole virtual scan changes the pose by less than `still_m`.
pub(super) fn align(
    view: &View,
    settings: &Registration,
    start: Pose<Global, Global>,
    still_m: f64,
) -> Result<Alignment, RegistrationError> {
    let mut aligned = Alignment { pose: start, scans: 0, steps: 0, still: false };
    let mut reach_m = settings.reach_m;
    while aligned.scans < settings.max_scans && !aligned.still {
        let seen: Vec<Intersection> =
            view.tracer.scan(&aligned.pose, &view.chirps).into_iter().flatten().collect();
        let (moved, steps) = align_to(view, settings, &seen, reach_m)?;
        aligned.pose = rigid(&(moved * aligned.pose));
        aligned.scans += 1;
        aligned.steps += steps;
        aligned.still = reach_m <= LEAST_REACH_M && change_m(view, &moved) < still_m;
        reach_m = (0.5 * reach_m).max(LEAST_REACH_M);
    }
    Ok(aligned)
}

/// How far a motion takes the target: shift of its pivot plus turn times its size, m.
pub(super) fn change_m(view: &View, moved: &Pose<Global, Global>) -> f64 {
    let motion = Motion::of(moved, view.pivot);
    motion.shift_m.length() + motion.turn_rad.length() * view.length_m
}

/// Iterates against one virtual scan; returns the motion of the model and the number of steps.
fn align_to(
    view: &View,
    settings: &Registration,
    seen: &[Intersection],
    reach_m: f64,
) -> Result<(Pose<Global, Global>, usize), RegistrationError> {
    let places: Vec<DVec3> = seen.iter().map(|seen| seen.hit.point.xyz).collect();
    let tree = Nearest::new(&places).ok_or(RegistrationError::NothingInView)?;
    let stride = view.points.len().div_ceil(settings.coarse_points.max(1));
    let chosen: Vec<DVec3> = view.points.iter().copied().step_by(stride).collect();
    let mut moved = Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
    for step in 1..=settings.max_steps {
        let pairs = pairs(&chosen, &tree, seen, &moved, reach_m);
        if (pairs.len() as f64) < LEAST_OVERLAP * chosen.len() as f64 {
            let (near, points) = (pairs.len(), chosen.len());
            return Err(RegistrationError::NoOverlap { near, points, reach_m });
        }
        let motion = closing(view, settings, &pairs);
        moved = rigid(&(motion * moved));
        if change_m(view, &motion) < settings.still_m {
            return Ok((moved, step));
        }
    }
    Ok((moved, settings.max_steps))
}

/// Pairs each measured point with the nearest of the virtual ones, moved by `moved`, within `reach_m`.
fn pairs(
    points: &[DVec3],
    tree: &Nearest,
    seen: &[Intersection],
    moved: &Pose<Global, Global>,
    reach_m: f64,
) -> Vec<Pair> {
    let back = moved.inverse();
    let mut pairs = Vec::new();
    for &measured in points {
        let (number, distance_m) = tree.find((back * Point::from(measured)).xyz);
        if let Some(seen) = seen.get(number).filter(|_| distance_m <= reach_m) {
            let model = (*moved * seen.hit.point).xyz;
            pairs.push(Pair { model, measured, normal: moved.rotation() * seen.normal });
        }
    }
    // Pairs beyond the edge of the virtual scan lie far apart sideways.
    let typical_m = median(pairs.iter().map(Pair::sideways_m));
    pairs.retain(|pair| pair.sideways_m() <= BEYOND_THE_EDGE * typical_m);
    pairs
}

impl Pair {
    /// Distance of the two points.
    fn apart_m(&self) -> f64 {
        self.model.distance(self.measured)
    }

    /// Distance of the two points within the surface of the model.
    fn sideways_m(&self) -> f64 {
        (self.measured - self.model).reject_from_normalized(self.normal).length()
    }

    /// The gap along the normal of the model.
    fn gap(&self) -> Gap {
        let size_m = self.normal.dot(self.measured - self.model);
        Gap { at: self.model, gradient: self.normal, size_m }
    }
}

/// The motion of the model that closes the pairs best.
fn closing(view: &View, settings: &Registration, pairs: &[Pair]) -> Pose<Global, Global> {
    // Far below any range noise: a perfect fit must not divide by zero.
    const LEAST_SD_M: f64 = 1e-9;
    if settings.metric == Metric::PointToPoint {
        let ends: Vec<(DVec3, DVec3)> = pairs.iter().map(|p| (p.model, p.measured)).collect();
        let sd_m = bulk_sd_m(pairs.iter().map(Pair::apart_m)).max(LEAST_SD_M);
        let weights: Vec<f64> =
            pairs.iter().map(|pair| settings.kernel.weight(pair.apart_m() / sd_m)).collect();
        let still = Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
        return point_to_point(&ends, &weights).unwrap_or(still);
    }
    let gaps: Vec<Gap> = pairs.iter().map(Pair::gap).collect();
    let sd_m = bulk_sd_m(gaps.iter().map(|gap| gap.size_m)).max(LEAST_SD_M);
    let weighted = gaps.iter().map(|gap| (*gap, settings.kernel.weight(gap.size_m / sd_m)));
    NormalEquations::new(weighted, view.pivot, view.length_m).solve(WEAKEST_SHARE).about(view.pivot)
}
