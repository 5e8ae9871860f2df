//! Bounding volume hierarchy by `obvhs`: boxes in f32, the decision in f64.
//!
//! The library's own triangle tests lose rays on shared edges; ours is in `facet.rs`.

use std::sync::OnceLock;
use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;
use obvhs::ray::{Ray as BoxRay, RayHit};

use super::Hit;
use super::facet::{Line, met};
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;

/// Boxes are grown by this share of the mesh's radius, some eighty times the rounding of f32.
const PADDING: f64 = 1e-5;

/// A hierarchy over one mesh, built when the first ray asks for it.
pub struct Bvh<'a> {
    mesh: &'a Mesh,
    /// The facets that it holds; none for all that have an area.
    only: Option<Vec<u32>>,
    boxes: OnceLock<Boxes>,
}

/// The boxes, in f32 and from the centre of a sphere around the facets.
pub(super) struct Boxes {
    pub(super) tree: Bvh2,
    /// Facet of each leaf entry.
    pub(super) facets: Vec<u32>,
    pub(super) centre: DVec3,
    pub(super) radius_m: f64,
}

impl<'a> Bvh<'a> {
    /// A hierarchy over all facets that have an area.
    pub fn new(mesh: &'a Mesh) -> Bvh<'a> {
        Bvh { mesh, only: None, boxes: OnceLock::new() }
    }

    /// The same over some facets, which must have an area.
    pub(super) fn over(mesh: &'a Mesh, facets: Vec<u32>) -> Bvh<'a> {
        Bvh { only: Some(facets), ..Bvh::new(mesh) }
    }

    /// The mesh that it is over.
    pub fn mesh(&self) -> &'a Mesh {
        self.mesh
    }

    /// Whether a ray has asked for it yet.
    pub fn is_built(&self) -> bool {
        self.boxes.get().is_some()
    }

    /// The closest hit of one ray; of equally near facets the one with the smallest number.
    pub fn closest(&self, ray: &Ray<Global>) -> Option<Hit> {
        self.boxes().closest(self.mesh, ray)
    }

    /// The hierarchy itself, which is built if it is not yet.
    pub(super) fn boxes(&self) -> &Boxes {
        self.boxes.get_or_init(|| {
            let live = |&facet: &u32| !self.mesh.is_degenerate(facet as usize);
            let all = || (0..self.mesh.facets.len() as u32).filter(live).collect();
            Boxes::new(self.mesh, self.only.clone().unwrap_or_else(all))
        })
    }
}

impl Boxes {
    fn new(mesh: &Mesh, facets: Vec<u32>) -> Boxes {
        let (centre, radius_m) = bounding_sphere(mesh, &facets);
        let padding = Vec3A::splat((PADDING * radius_m) as f32);
        let boxes: Vec<Aabb> = facets
            .iter()
            .map(|&facet| {
                let corners = mesh.corners(facet as usize).map(|c| (c - centre).as_vec3a());
                let tight = Aabb::from_points(&corners);
                Aabb::new(tight.min - padding, tight.max + padding)
            })
            .collect();
        let tree = build_bvh2(&boxes, BvhBuildParams::medium_build(), &mut Duration::default());
        let facets = tree.primitive_indices.iter().map(|&entry| facets[entry as usize]).collect();
        Boxes { tree, facets, centre, radius_m }
    }

    fn closest(&self, mesh: &Mesh, ray: &Ray<Global>) -> Option<Hit> {
        let start_m = self.entry_m(ray)?;
        let origin = ray.origin.xyz + start_m * ray.direction.xyz() - self.centre;
        let box_ray = BoxRay::new_inf(origin.as_vec3a(), ray.direction.xyz().as_vec3a());
        let line = Line::new(ray);
        let mut best: Option<(f64, u32)> = None;
        self.tree.ray_traverse(box_ray, &mut RayHit::none(), |_, entry| {
            let facet = self.facets[entry];
            if let Some(range_m) = line.crossing_m(mesh, facet as usize)
                && best.is_none_or(|nearest| (range_m, facet) < nearest)
            {
                best = Some((range_m, facet));
            }
            // Later boxes are skipped only when they are farther by more than f32 can blur.
            best.map_or(f32::INFINITY, |(range_m, _)| {
                (range_m - start_m + 2.0 * PADDING * self.radius_m) as f32
            })
        });
        let (_, facet) = best?;
        let [hit] = met(mesh, [facet], [ray]);
        hit
    }

    /// Distance at which the ray reaches the sphere around the facets, m; f32 is precise from there.
    pub(super) fn entry_m(&self, ray: &Ray<Global>) -> Option<f64> {
        self.entry_beside_m(ray, 0.0)
    }

    /// The same of a sphere that is larger by `beside_m`.
    pub(super) fn entry_beside_m(&self, ray: &Ray<Global>, beside_m: f64) -> Option<f64> {
        let to_centre = self.centre - ray.origin.xyz;
        let along_m = to_centre.dot(ray.direction.xyz());
        let beside2 = (to_centre - along_m * ray.direction.xyz()).length_squared();
        let radius_m = (self.radius_m + beside_m) * (1.0 + PADDING);
        let half_chord_m = (radius_m * radius_m - beside2).max(0.0).sqrt();
        let reached = beside2 <= radius_m * radius_m && along_m + half_chord_m > 0.0;
        reached.then(|| (along_m - half_chord_m).max(0.0))
    }
}

/// A sphere around the corners of some facets: centre and radius, m.
fn bounding_sphere(mesh: &Mesh, facets: &[u32]) -> (DVec3, f64) {
    let corners = || facets.iter().flat_map(|&facet| mesh.corners(facet as usize));
    let min = corners().fold(DVec3::INFINITY, DVec3::min);
    let max = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let centre = 0.5 * (min + max);
    (centre, corners().map(|corner| corner.distance(centre)).fold(0.0, f64::max))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::trace::brute;
    use proptest::prelude::*;

    fn plate() -> Mesh {
        Mesh {
            vertices: [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
                .map(|(x, y)| DVec3::new(x, y, 0.0))
                .to_vec(),
            facets: vec![[0, 1, 2], [0, 2, 3]],
            labels: vec![],
        }
    }

    fn ray(origin: DVec3, through: DVec3) -> Ray<Global> {
        let origin = Point::from(origin);
        Ray { origin, direction: origin.towards(through.into()).unwrap() }
    }

    #[test]
    fn no_ray_slips_through_a_diagonal() {
        let mesh = plate();
        let bvh = Bvh::new(&mesh);
        let origin = DVec3::new(0.3, -0.2, 8.0);
        for step in 0..=10_000 {
            let s = f64::from(step) / 5_000.0 - 1.0;
            let hit = bvh.closest(&ray(origin, DVec3::new(s, s, 0.0)));
            assert!(hit.is_some_and(|hit| hit.point.xyz.z.abs() < 1e-12), "{s}");
        }
    }

    #[test]
    fn angles_and_ranges_are_those_of_the_plane() {
        let mesh = plate();
        let hit = Bvh::new(&mesh).closest(&ray(DVec3::new(0.0, 0.0, 3.0), DVec3::X)).unwrap();
        assert!((hit.range_m - 10f64.sqrt()).abs() < 1e-14);
        assert!((hit.theta_rad() - (1.0f64 / 3.0).atan()).abs() < 1e-14);
    }

    #[test]
    fn facets_behind_without_area_or_out_of_reach_are_not_hit() {
        let mut mesh = plate();
        mesh.facets.push([0, 0, 2]);
        let bvh = Bvh::new(&mesh);
        assert!(bvh.closest(&ray(DVec3::Z, 2.0 * DVec3::Z)).is_none());
        assert!(bvh.closest(&ray(DVec3::Z, DVec3::new(9.0, 0.0, 0.0))).is_none());
        // Along the plate: parallel to both facets.
        assert!(bvh.closest(&ray(DVec3::new(-3.0, 0.0, 0.0), DVec3::ZERO)).is_none());
    }

    #[test]
    fn nothing_is_built_before_the_first_ray() {
        let mesh = plate();
        let bvh = Bvh::new(&mesh);
        assert!(bvh.mesh().facets.len() == 2 && !bvh.is_built());
        bvh.closest(&ray(DVec3::Z, DVec3::ZERO));
        assert!(bvh.is_built());
    }

    #[test]
    fn from_inside_a_box_the_nearer_wall_is_hit() {
        let mut mesh = plate();
        let back = Mesh {
            vertices: mesh.vertices.iter().map(|v| *v + 4.0 * DVec3::Z).collect(),
            ..plate()
        };
        mesh.append(&back).unwrap();
        let hit = Bvh::new(&mesh).closest(&ray(DVec3::new(0.1, 0.2, 3.0), DVec3::ZERO)).unwrap();
        assert!(hit.facet < 2 && hit.range_m < 3.1);
    }

    prop_compose! {
        fn soup()(
            corners in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 3..90),
            picks in prop::collection::vec(prop::array::uniform3(0usize..90), 1..60),
        ) -> Mesh {
            let n = corners.len();
            Mesh {
                vertices: corners.into_iter().map(DVec3::from).collect(),
                facets: picks.into_iter().map(|p| p.map(|i| (i % n) as u32)).collect(),
                labels: vec![],
            }
        }
    }

    proptest! {
        #[test]
        fn the_hierarchy_agrees_with_the_naive_loop(
            mesh in soup(),
            // Within a facet: exactly on an outer edge the two may round to different sides.
            aims in prop::collection::vec((0usize..60, 0.01f64..0.49, 0.01f64..0.49), 20),
            far in 2.0f64..20.0,
        ) {
            let bvh = Bvh::new(&mesh);
            let origin = DVec3::new(0.4, 0.3, far);
            for (facet, u, v) in aims {
                let facet = facet % mesh.facets.len();
                if mesh.is_degenerate(facet) {
                    continue;
                }
                let [a, b, c] = mesh.corners(facet);
                let aim = ray(origin, a + u * (b - a) + v * (c - a));
                match (bvh.closest(&aim), brute::closest(&mesh, &aim)) {
                    (None, None) => {}
                    // Looser than on a good mesh: a sliver's plane is hardly defined.
                    (Some(fast), Some(slow)) => prop_assert!(
                        (fast.range_m - slow.range_m).abs() < 1e-9 * slow.range_m,
                        "{fast:?} {slow:?}"
                    ),
                    other => prop_assert!(false, "{other:?}"),
                }
            }
        }
    }
}
