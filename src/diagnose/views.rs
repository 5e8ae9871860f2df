//! The scans of one target that are diagnosed together, and how the first of them sees what the others do.
//!
//! A place on the target is one place in all scans: its x_t and y_t are those at which the first scan's antenna sees it.
//! Everything that belongs to the target, such as a patch of another material or the patches that are held out, counts
//! in these, whatever the pose of the target or the place of the antenna.

use std::borrow::Cow;

use super::error::DiagnoseError;
use crate::effects::{Shot, Stage};
use crate::frames::{Direction, Global, Point, Pose, Ray};
use crate::measure::icp::point_to_point;
use crate::radar::Radar;

/// Largest distance of a vertex from its place on the first scan's target, m: a sixteenth of the spot.
const SAME_PLACE_M: f64 = 1e-3;

/// Several scans of one rigid target.
pub(super) struct Views<'a> {
    /// Instrument and target of each scan.
    pub stages: &'a [Stage<'a>],
    /// From the target as each scan has it to where the first has it.
    to_first: Vec<Pose<Global, Global>>,
}

impl<'a> Views<'a> {
    /// The views of some scans.
    ///
    /// # Errors
    /// When the meshes are not one mesh that was moved as a whole.
    pub fn new(stages: &'a [Stage<'a>]) -> Result<Views<'a>, DiagnoseError> {
        let mut to_first = vec![Pose::NONE; stages.len()];
        for (number, stage) in stages.iter().enumerate().skip(1) {
            let moved = moved_as_a_whole(stage, &stages[0]);
            to_first[number] = moved.ok_or(DiagnoseError::OtherTarget { cloud: number + 1 })?;
        }
        Ok(Views { stages, to_first })
    }

    /// The stage of a shot.
    pub fn stage(&self, shot: &Shot) -> &'a Stage<'a> {
        &self.stages[usize::from(shot.scan)]
    }

    /// For every scan the first one of the same instrument: of the same radar, wherever that stands and however it scans.
    pub fn instruments(&self) -> Vec<usize> {
        let radars = || self.stages.iter().map(|stage| stage.geometry.radar);
        radars()
            .map(|radar| radars().take_while(|other| !is_same_instrument(radar, other)).count())
            .collect()
    }

    /// A shot as the first scan's antenna would see the same point of the target where the first scan has it. The angles at
    /// which the surface is met stay those of the shot.
    pub fn in_first(&self, shot: &Shot) -> Shot {
        if shot.scan == 0 {
            return *shot;
        }
        // The point belongs to the target, wherever an effect has moved that.
        let moved = self.to_first[usize::from(shot.scan)] * shot.target.inverse();
        let point = moved * shot.hit.point;
        let first = &self.stages[0].geometry;
        let frames = first.radar.frames();
        let origin = first.chirps.rays.first().map_or(frames.origin(), |ray| ray.origin);
        let Some(direction) = origin.towards(point) else { return *shot };
        let ray = Ray { origin, direction };
        let seen = Point::from(origin.xyz + frames.pattern_range_m * direction.xyz());
        let place = (frames.global_from_target.inverse() * seen).xyz;
        let mut there = Shot { ray, xt_m: place.x, yt_m: place.y, target: Pose::NONE, ..*shot };
        there.hit.point = point;
        there.hit.range_m = point.xyz.distance(origin.xyz);
        if let Some(normal) = Direction::<Global>::new(shot.normal) {
            there.normal = (moved * normal).xyz();
        }
        there
    }

    /// All shots as the first scan's antenna would see them.
    pub fn all_in_first<'s>(&self, shots: &'s [Shot]) -> Cow<'s, [Shot]> {
        if self.stages.len() == 1 {
            return Cow::Borrowed(shots);
        }
        shots.iter().map(|shot| self.in_first(shot)).collect()
    }
}

/// The map from the target of a stage to that of another; none where the meshes differ by more than a motion.
fn moved_as_a_whole(stage: &Stage, first: &Stage) -> Option<Pose<Global, Global>> {
    let [from, to] = [stage, first].map(|stage| stage.geometry.bvh.mesh());
    if from.vertices.len() != to.vertices.len() || from.facets != to.facets {
        return None;
    }
    let pairs: Vec<_> = from.vertices.iter().copied().zip(to.vertices.iter().copied()).collect();
    let pose = if from.vertices == to.vertices {
        Pose::NONE
    } else {
        point_to_point(&pairs, &vec![1.0; pairs.len()])?
    };
    let is_off = |(a, b): &(glam::DVec3, glam::DVec3)| {
        (pose * Point::from(*a)).xyz.distance(*b) > SAME_PLACE_M
    };
    (!pairs.iter().any(is_off)).then_some(pose)
}

/// Whether two radars are one but for their place and their scan.
fn is_same_instrument(a: &Radar, b: &Radar) -> bool {
    let there = Radar {
        primary_focus_m: b.primary_focus_m,
        alpha_deg: b.alpha_deg,
        position_m: b.position_m,
        look_at_m: b.look_at_m,
        up: b.up,
        scan: b.scan.clone(),
        ..a.clone()
    };
    there == *b
}
