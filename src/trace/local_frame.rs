//! The local frame of a surface, in which scattering is described.

use glam::{DMat3, DVec3};

use super::hit::Hit;
use crate::frames::{Direction, Surface};
use crate::geometry::Mesh;

/// The local frame of a surface: x along its grain, z along its normal.
#[derive(Clone, Copy, Debug)]
pub struct LocalFrame {
    /// Columns: the three axes in the global frame.
    axes: DMat3,
}

impl LocalFrame {
    /// The frame at a unit normal. The grain, of any length, is projected along the normal; a grain along the normal has
    /// no direction on the surface, and the x axis is then an arbitrary one.
    pub fn new(normal: DVec3, grain: DVec3) -> LocalFrame {
        let along = grain - grain.dot(normal) * normal;
        let is_normal = along.length_squared() <= 1e-18 * grain.length_squared();
        let x = match along.try_normalize().filter(|_| !is_normal) {
            Some(x) => x,
            None => normal.any_orthonormal_vector(),
        };
        LocalFrame { axes: DMat3::from_cols(x, normal.cross(x), normal) }
    }

    /// The frame at a hit, with the normal on the side of the ray; `to_source` is the unit vector back along the ray.
    pub fn at_hit(mesh: &Mesh, hit: &Hit, to_source: DVec3, grain: DVec3) -> LocalFrame {
        let outward = mesh.area_normal(hit.facet as usize).normalize_or(to_source);
        let normal = if outward.dot(to_source) < 0.0 { -outward } else { outward };
        LocalFrame::new(normal, grain)
    }

    /// The unit normal.
    pub fn normal(&self) -> DVec3 {
        self.axes.z_axis
    }

    /// Converts a world direction, a unit vector, to the local frame.
    pub fn local(&self, world: DVec3) -> Direction<Surface> {
        let local = self.axes.transpose() * world;
        Direction::new(local).unwrap_or(Direction::from_angles(0.0, 0.0))
    }

    /// Converts a local vector to the world.
    pub fn world(&self, local: DVec3) -> DVec3 {
        self.axes * local
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::solids;
    use crate::trace::brute;
    use crate::trace::testing::ray;

    #[test]
    fn the_frame_stands_on_the_lit_side_and_follows_the_grain() {
        let mesh = solids::plate(1.0, 1.0);
        for side in [1.0, -1.0] {
            let ray = ray(DVec3::new(0.1, 0.2, 3.0 * side), DVec3::ZERO);
            let back = -ray.direction.xyz();
            let hit = brute::closest(&mesh, &ray).unwrap();
            let frame = LocalFrame::at_hit(&mesh, &hit, back, DVec3::new(3.0, 0.0, 5.0));
            assert!(frame.normal().distance(side * DVec3::Z) < 1e-15);
            assert!((frame.local(DVec3::X).xyz() - DVec3::X).length() < 1e-15);
            let there = frame.local(back);
            assert!((there.cos_theta() - hit.cos_theta).abs() < 1e-15);
            assert!((frame.world(there.xyz()) - back).length() < 1e-15);
        }
    }

    #[test]
    fn a_grain_that_stands_on_the_surface_still_gives_a_frame() {
        for grain in [DVec3::Z, DVec3::ZERO] {
            let frame = LocalFrame::new(DVec3::Z, grain);
            assert!((frame.world(DVec3::X).length() - 1.0).abs() < 1e-12);
        }
    }
}
