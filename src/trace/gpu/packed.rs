//! A hierarchy and rays as the device takes them: in f32, in radii of the sphere around the mesh and
//! from its centre. `closest.wgsl` reads the same words.

use rayon::prelude::*;

use crate::frames::{Global, Ray};
use crate::geometry::Mesh;
use crate::trace::bvh::Boxes;

/// Answers of the device beside the number of a leaf entry: the ray meets nothing, or f32 cannot tell what.
pub(super) const NOTHING: u32 = u32::MAX;
const UNSURE: u32 = u32::MAX - 1;

/// For a ray whose answer is not known before it is traced.
const UNKNOWN: u32 = 0;

/// A box and what is in it.
pub(super) type Node = [u32; 8];

/// The corners of a leaf entry's facet.
pub(super) type Corners = [[f32; 4]; 3];

/// A ray from where it comes near the mesh.
pub(super) type Aim = [u32; 8];

/// Rays from farther off are not the device's, in radii: f64 places their entry to 2⁻³⁰ up to here.
const FARTHEST: f64 = (1u64 << 20) as f64;

/// A ray starts this much before it comes near the mesh, so that it meets what is there at a depth that is surely positive;
/// in radii.
const RUN_UP: f64 = 0.01;

/// All boxes, the root first.
pub(super) fn nodes(boxes: &Boxes) -> Vec<Node> {
    let per_m = 1.0 / boxes.radius_m;
    let word = |metres: f32| ((f64::from(metres) * per_m) as f32).to_bits();
    let nodes = boxes.tree.nodes.par_iter().map(|node| {
        let [[x, y, z], [u, v, w]] =
            [node.aabb.min, node.aabb.max].map(|corner| corner.to_array().map(word));
        [x, y, z, node.prim_count, u, v, w, node.first_index]
    });
    nodes.collect()
}

/// The corners of all leaf entries.
pub(super) fn corners(boxes: &Boxes, mesh: &Mesh) -> Vec<Corners> {
    let per_m = 1.0 / boxes.radius_m;
    let corners = boxes.facets.par_iter().map(|&facet| {
        mesh.corners(facet as usize)
            .map(|corner| ((corner - boxes.centre) * per_m).as_vec3().extend(0.0).to_array())
    });
    corners.collect()
}

/// Rays, or what is known of them without asking.
pub(super) fn aims(boxes: &Boxes, rays: &[Ray<Global>]) -> Vec<Aim> {
    rays.par_iter().with_min_len(1024).map(|ray| aim(boxes, ray)).collect()
}

fn aim(boxes: &Boxes, ray: &Ray<Global>) -> Aim {
    let known = |answer| [0, 0, 0, answer, 0, 0, 0, 0];
    let Some(entry_m) = boxes.entry_m(ray) else { return known(NOTHING) };
    let (from_centre, direction) = (ray.origin.xyz - boxes.centre, ray.direction.xyz());
    if from_centre.length() > FARTHEST * boxes.radius_m {
        return known(UNSURE);
    }
    let start_m = (entry_m - RUN_UP * boxes.radius_m).max(0.0);
    let origin = (from_centre + start_m * direction) / boxes.radius_m;
    // Its largest component becomes 1 or -1, exactly.
    let slopes = direction / direction.abs().max_element();
    let [x, y, z] = origin.as_vec3().to_array().map(f32::to_bits);
    let [u, v, w] = slopes.as_vec3().to_array().map(f32::to_bits);
    [x, y, z, UNKNOWN, u, v, w, 0]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::frames::Point;
    use crate::scene::solids;
    use crate::trace::Bvh;

    /// A ball of 0.25 m at (40, 40, 40) m.
    fn ball() -> Mesh {
        let mut ball = solids::icosphere(0.25, 2);
        ball.vertices.iter_mut().for_each(|vertex| *vertex += DVec3::splat(40.0));
        ball
    }

    fn aimed(from: DVec3, to: DVec3) -> Aim {
        let (ball, origin) = (ball(), Point::from(from));
        let ray = Ray { origin, direction: origin.towards(to.into()).unwrap() };
        aim(Bvh::new(&ball).boxes(), &ray)
    }

    fn vector(words: &[u32]) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|i| f64::from(f32::from_bits(words[i]))))
    }

    #[test]
    fn a_mesh_fills_the_unit_sphere() {
        let ball = ball();
        let bvh = Bvh::new(&ball);
        let corners = corners(bvh.boxes(), &ball);
        assert_eq!(corners.len(), ball.facets.len());
        for &[x, y, z, _] in corners.as_flattened() {
            assert!((x.hypot(y).hypot(z) - 1.0).abs() < 1e-6);
        }
        let nodes = nodes(bvh.boxes());
        assert_eq!(nodes.iter().map(|node| node[3] as usize).sum::<usize>(), corners.len());
        assert!((vector(&nodes[0][4..7]) - DVec3::ONE).abs().max_element() < 0.2);
    }

    #[test]
    fn a_ray_starts_shortly_before_the_sphere() {
        let at = DVec3::splat(40.0);
        let aim = aimed(at + DVec3::new(0.1, 1000.0, 0.0), at + DVec3::new(0.1, 0.0, 0.0));
        let half_chord = (1.0f64 - 0.16).sqrt();
        assert!((vector(&aim[..3]) - DVec3::new(0.4, half_chord + RUN_UP, 0.0)).length() < 1e-4);
        assert_eq!((aim[3], vector(&aim[4..7])), (UNKNOWN, DVec3::NEG_Y));
        let inside = aimed(at + 0.1 * DVec3::X, at + DVec3::new(0.2, 0.1, -0.05));
        assert!((vector(&inside[..3]) - 0.4 * DVec3::X).length() < 1e-6);
        assert!((vector(&inside[4..7]) - DVec3::new(1.0, 1.0, -0.5)).length() < 1e-6);
    }

    #[test]
    fn what_is_known_is_not_asked() {
        let at = DVec3::splat(40.0);
        assert_eq!(aimed(at + 2.0 * DVec3::X, at + 2.0 * DVec3::Y)[3], NOTHING);
        assert_eq!(aimed(at + 2.0 * DVec3::X, at + 3.0 * DVec3::X)[3], NOTHING);
        assert_eq!(aimed(at + 1e6 * DVec3::X, at)[3], UNSURE);
    }
}
