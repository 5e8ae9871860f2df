//! Surfaces, and the conversion between world directions and the local frame of scattering. No other file of the
//! renderer uses both.

use glam::DVec3;

use crate::brdf::Scattering;
use crate::frames::{Direction, Surface as Local};
use crate::geometry::Mesh;
use crate::trace::Hit;

/// The surface of the facets of one region.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    /// Its scattering model.
    pub scattering: &'a dyn Scattering,
    /// Direction of its grain in the global frame, of any length. On a facet it is projected along the normal. Azimuths
    /// count from it, and `m` of an anisotropic model is the roughness along it.
    pub grain: DVec3,
}

impl<'a> Surface<'a> {
    /// A surface whose grain is the y axis, upwards.
    pub fn new(scattering: &'a dyn Scattering) -> Surface<'a> {
        Surface { scattering, grain: DVec3::Y }
    }
}

/// The orientation of the surface at a hit on a target that effects have moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facing {
    /// Unit normal, towards the radar.
    pub normal: DVec3,
    /// Azimuth of the radar about it, from the grain of the region, rad.
    pub azimuth_rad: f64,
}

/// The local frame of a facet at a hit: the normal on the side of the ray, the tangent along the grain.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LocalFrame {
    pub normal: DVec3,
    tangent: DVec3,
    bitangent: DVec3,
}

impl LocalFrame {
    /// The frame at a hit; `to_source` is the unit vector back along the ray.
    pub fn new(mesh: &Mesh, hit: &Hit, to_source: DVec3, grain: DVec3) -> LocalFrame {
        let outward = mesh.area_normal(hit.facet as usize).normalize_or(to_source);
        let normal = if outward.dot(to_source) < 0.0 { -outward } else { outward };
        let along = grain - grain.dot(normal) * normal;
        // A grain along the normal has no direction on the surface.
        let is_normal = along.length_squared() <= 1e-18 * grain.length_squared();
        let tangent = match along.try_normalize().filter(|_| !is_normal) {
            Some(tangent) => tangent,
            None => normal.any_orthonormal_vector(),
        };
        LocalFrame { normal, tangent, bitangent: normal.cross(tangent) }
    }

    /// Converts a world direction, a unit vector, to the local frame.
    pub fn local(&self, world: DVec3) -> Direction<Local> {
        let xyz =
            DVec3::new(world.dot(self.tangent), world.dot(self.bitangent), world.dot(self.normal));
        Direction::new(xyz).unwrap_or(Direction::from_angles(0.0, 0.0))
    }

    /// Converts a local direction, a unit vector, to the world.
    pub fn world(&self, local: DVec3) -> DVec3 {
        local.x * self.tangent + local.y * self.bitangent + local.z * self.normal
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::{Point, Ray};
    use crate::scene::solids;
    use crate::trace::brute;

    #[test]
    fn the_frame_stands_on_the_lit_side_and_follows_the_grain() {
        let mesh = solids::plate(1.0, 1.0);
        for side in [1.0, -1.0] {
            let origin = Point::new(0.1, 0.2, 3.0 * side);
            let direction = origin.towards(Point::new(0.0, 0.0, 0.0)).unwrap();
            let hit = brute::closest(&mesh, &Ray { origin, direction }).unwrap();
            let frame = LocalFrame::new(&mesh, &hit, -direction.xyz(), DVec3::new(3.0, 0.0, 5.0));
            assert!(frame.normal.distance(side * DVec3::Z) < 1e-15);
            assert!((frame.local(DVec3::X).xyz() - DVec3::X).length() < 1e-15);
            let there = frame.local(-direction.xyz());
            assert!((there.cos_theta() - hit.cos_theta).abs() < 1e-15);
            assert!((frame.world(there.xyz()) + direction.xyz()).length() < 1e-15);
        }
    }

    #[test]
    fn a_grain_that_stands_on_the_surface_still_gives_a_frame() {
        let mesh = solids::plate(1.0, 1.0);
        let origin = Point::new(0.0, 0.0, 1.0);
        let direction = origin.towards(Point::new(0.1, 0.1, 0.0)).unwrap();
        let hit = brute::closest(&mesh, &Ray { origin, direction }).unwrap();
        for grain in [DVec3::Z, DVec3::ZERO] {
            let frame = LocalFrame::new(&mesh, &hit, -direction.xyz(), grain);
            assert!((frame.tangent.length() - 1.0).abs() < 1e-12);
        }
    }
}
