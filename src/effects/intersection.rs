//! Intersections of a shot with the target along another ray, or with a target that has moved.

use glam::{DMat3, DVec3};

use super::shot::{Shot, Stage};
use crate::frames::{Direction, Global, Pose, Ray, Surface};
use crate::trace::Hit;

/// Axes on a surface: along the grain, across it, and the normal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Axes(DMat3);

impl Axes {
    /// At a normal; a grain that stands on the surface has no direction along it.
    pub(super) fn new(normal: DVec3, grain: DVec3) -> Axes {
        let along = grain - grain.dot(normal) * normal;
        let stands = along.length_squared() <= 1e-18 * grain.length_squared();
        let along = if stands { normal.any_orthonormal_vector() } else { along.normalize() };
        Axes(DMat3::from_cols(along, normal.cross(along), normal))
    }

    /// At the surface of a shot.
    pub(super) fn of(stage: &Stage, shot: &Shot) -> Axes {
        Axes::new(shot.normal, grain(stage, shot.region))
    }

    fn normal(&self) -> DVec3 {
        self.0.z_axis
    }

    /// A unit vector of the world, seen from the surface.
    pub(super) fn local(&self, world: DVec3) -> Direction<Surface> {
        let above = Direction::from_angles(0.0, 0.0);
        Direction::new(self.0.transpose() * world).unwrap_or(above)
    }

    /// A vector of the surface, in the world.
    pub(super) fn world(&self, local: DVec3) -> DVec3 {
        self.0 * local
    }
}

fn grain(stage: &Stage, region: u16) -> DVec3 {
    stage.grain_of_region.get(usize::from(region)).copied().unwrap_or(DVec3::Y)
}

/// The shot along another ray, at the closest hit of that ray; `None` where the ray misses.
pub(super) fn shot_along(stage: &Stage, shot: &Shot, ray: Ray<Global>) -> Option<Shot> {
    let hit = stage.geometry.bvh.closest(&ray)?;
    Some(surface_at(stage, &ray, &hit).shot(shot, ray, hit))
}

/// The surface where a ray hits it.
pub(super) struct HitSurface {
    /// Towards the ray's origin.
    normal: DVec3,
    pub region: u16,
    /// Back along the ray.
    pub to_radar: Direction<Surface>,
}

/// A facet, whose two sides are alike.
pub(super) struct Facet {
    /// At its outward normal; `None` where rounding leaves no normal.
    axes: Option<Axes>,
    grain: DVec3,
    region: u16,
}

impl Facet {
    pub(super) fn of(stage: &Stage, number: usize) -> Facet {
        let region = stage.geometry.region_of_facet.get(number).copied().unwrap_or(0);
        let (normal, grain) = (stage.geometry.bvh.mesh().area_normal(number), grain(stage, region));
        let axes = normal.try_normalize().map(|normal| Axes::new(normal, grain));
        Facet { axes, grain, region }
    }

    /// The side of it from which a ray comes.
    pub(super) fn surface(&self, ray: &Ray<Global>) -> HitSurface {
        let back = -ray.direction.xyz();
        let axes = match self.axes {
            None => Axes::new(back, self.grain),
            Some(axes) if axes.normal().dot(back) < 0.0 => Axes::new(-axes.normal(), self.grain),
            Some(axes) => axes,
        };
        HitSurface { normal: axes.normal(), region: self.region, to_radar: axes.local(back) }
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

/// The ray in the frame of a target that has moved: what it hits there, the true ray hits on the moved target.
pub(super) fn seen_from(target: &Pose<Global, Global>, ray: &Ray<Global>) -> Ray<Global> {
    let back = target.inverse();
    Ray { origin: back * ray.origin, direction: back * ray.direction }
}

/// The shot at a target that has moved, from the closest hit of its ray as [`seen_from`] the target, and the
/// direction of the radar from its surface.
pub(super) fn moved(
    stage: &Stage,
    shot: &Shot,
    target: Pose<Global, Global>,
    ray: Ray<Global>,
    hit: Hit,
) -> (Shot, Direction<Surface>) {
    let surface = surface_at(stage, &ray, &hit);
    let there = surface.shot(shot, ray, hit);
    let hit = Hit { point: target * there.hit.point, ..there.hit };
    let normal = target.rotation() * there.normal;
    (Shot { ray: shot.ray, hit, normal, target, ..there }, surface.to_radar)
}
