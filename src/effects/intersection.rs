//! Intersections of a shot with the target along another ray, or with a target that has moved.

use glam::{DMat3, DVec3};

use super::shot::{Shot, Stage};
use crate::frames::{Direction, Global, Pose, Ray, Surface};
use crate::trace::{Hit, LocalFrame};

/// The local frame at the surface of a shot.
pub(super) fn local_frame(stage: &Stage, shot: &Shot) -> LocalFrame {
    LocalFrame::new(shot.normal, grain(stage, shot.region))
}

/// Direction of the grain of a region, global frame, where the scene has the target.
pub(super) fn grain(stage: &Stage, region: u16) -> DVec3 {
    stage.grain_of_region.get(usize::from(region)).copied().unwrap_or(DVec3::Y)
}

/// The shot along another ray, at the closest hit of that ray; `None` where the ray misses.
pub(super) fn shot_along(stage: &Stage, shot: &Shot, ray: Ray<Global>) -> Option<Shot> {
    let hit = stage.geometry.bvh.closest(&ray)?;
    Some(shot_at(stage, &Shot { ray, ..*shot }, hit))
}

/// The shot at a hit of its ray.
pub(crate) fn shot_at(stage: &Stage, shot: &Shot, hit: Hit) -> Shot {
    surface_at(stage, &shot.ray, &hit).shot(shot, shot.ray, hit)
}

/// The surface where a ray hits it.
pub(super) struct HitSurface {
    /// Towards the ray's origin.
    normal: DVec3,
    pub region: u16,
    /// Back along the ray.
    pub to_radar: Direction<Surface>,
}

/// A facet, which scatters alike on both sides.
pub(super) struct Facet {
    /// The frame at its outward normal; `None` where rounding leaves no normal.
    frame: Option<LocalFrame>,
    grain: DVec3,
    region: u16,
}

impl Facet {
    pub(super) fn of(stage: &Stage, number: usize) -> Facet {
        let region = stage.geometry.region_of_facet.get(number).copied().unwrap_or(0);
        let (normal, grain) = (stage.geometry.bvh.mesh().area_normal(number), grain(stage, region));
        let frame = normal.try_normalize().map(|normal| LocalFrame::new(normal, grain));
        Facet { frame, grain, region }
    }

    /// The surface on the side from which a ray comes.
    pub(super) fn surface(&self, ray: &Ray<Global>) -> HitSurface {
        let back = -ray.direction.xyz();
        let frame = match self.frame {
            None => LocalFrame::new(back, self.grain),
            Some(frame) if frame.normal().dot(back) < 0.0 => {
                LocalFrame::new(-frame.normal(), self.grain)
            }
            Some(frame) => frame,
        };
        HitSurface { normal: frame.normal(), region: self.region, to_radar: frame.local(back) }
    }
}

/// The surface at the closest hit of a ray.
pub(super) fn surface_at(stage: &Stage, ray: &Ray<Global>, hit: &Hit) -> HitSurface {
    Facet::of(stage, hit.facet as usize).surface(ray)
}

impl HitSurface {
    /// A shot whose ray hits here.
    fn shot(&self, shot: &Shot, ray: Ray<Global>, hit: Hit) -> Shot {
        let to_radar = self.to_radar.xyz();
        let azimuth_rad = to_radar.y.atan2(to_radar.x);
        Shot { ray, hit, normal: self.normal, azimuth_rad, region: self.region, ..*shot }
    }
}

/// A motion of the target: a turn about `pivot`, and then a shift.
pub(super) fn motion(rotation: DMat3, pivot: DVec3, shift_m: DVec3) -> Pose<Global, Global> {
    Pose::new(rotation, pivot + shift_m - rotation * pivot)
}

/// The shot at a target that has moved, and the direction of the radar from its surface. `ray` is its ray in the frame of
/// the target, and `hit` the closest hit of that, on `facet`.
pub(super) fn moved(
    facet: &Facet,
    shot: &Shot,
    target: Pose<Global, Global>,
    ray: Ray<Global>,
    hit: Hit,
) -> (Shot, Direction<Surface>) {
    let surface = facet.surface(&ray);
    let there = surface.shot(shot, ray, hit);
    let hit = Hit { point: target * there.hit.point, ..there.hit };
    let normal = target.rotation() * there.normal;
    (Shot { ray: shot.ray, hit, normal, target, ..there }, surface.to_radar)
}
