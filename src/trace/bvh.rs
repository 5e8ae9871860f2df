//! A hierarchy of bounding boxes over a mesh, which traces any ray. f32 culls, f64 decides.

use std::sync::OnceLock;

use rayon::prelude::*;

use super::boxes::Boxes;
use super::bundle;
use super::eightfold::Eightfold;
use super::hit::{Hit, allocate_hits};
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;

/// A hierarchy of bounding boxes over one mesh. It is built on first use.
pub struct Bvh<'a> {
    mesh: &'a Mesh,
    /// Its facets; `None` for all that have an area.
    only: Option<Vec<u32>>,
    /// The binary tree, for graphics processors.
    boxes: OnceLock<Boxes>,
    /// The tree with eight branches per node, for the CPU.
    eightfold: OnceLock<Eightfold>,
}

impl<'a> Bvh<'a> {
    /// A hierarchy over all facets that have an area.
    pub fn new(mesh: &'a Mesh) -> Bvh<'a> {
        Bvh { mesh, only: None, boxes: OnceLock::new(), eightfold: OnceLock::new() }
    }

    /// A hierarchy over these facets, all of which must have an area.
    pub(super) fn over(mesh: &'a Mesh, facets: Vec<u32>) -> Bvh<'a> {
        Bvh { only: Some(facets), ..Bvh::new(mesh) }
    }

    /// The mesh.
    pub fn mesh(&self) -> &'a Mesh {
        self.mesh
    }

    /// Whether the hierarchy has been built.
    pub fn is_built(&self) -> bool {
        self.eightfold.get().is_some() || self.boxes.get().is_some()
    }

    /// The closest hit of one ray; among equally near facets, the one with the smallest number.
    pub fn closest(&self, ray: &Ray<Global>) -> Option<Hit> {
        let mut hit = [None];
        self.eightfold().closest(self.mesh, std::slice::from_ref(ray), &mut hit);
        hit[0]
    }

    /// The closest hit of each ray, computed on all threads.
    pub fn closest_of_each(&self, rays: &[Ray<Global>]) -> Vec<Option<Hit>> {
        /// Rays of one task.
        const RAYS: usize = 64;
        let mut hits = allocate_hits(rays.len());
        let tasks = rays.par_chunks(RAYS).zip(hits.par_chunks_mut(RAYS));
        tasks.for_each(|(rays, hits)| self.eightfold().closest(self.mesh, rays, hits));
        hits
    }

    /// The closest hit of each ray of some spots, one spot after the other, computed on one thread. The rays of a spot nearly
    /// coincide and go through the hierarchy together.
    pub fn closest_of_spots(&self, rays: &[Ray<Global>], rays_per_spot: usize) -> Vec<Option<Hit>> {
        let mut hits = vec![None; rays.len()];
        bundle::closest(self.eightfold(), self.mesh, rays, rays_per_spot, &mut hits);
        hits
    }

    fn eightfold(&self) -> &Eightfold {
        self.eightfold.get_or_init(|| match self.boxes.get() {
            Some(boxes) => Eightfold::new(self.mesh, boxes),
            None => Eightfold::new(self.mesh, &self.build()),
        })
    }

    /// The binary tree, built on first use.
    pub(super) fn boxes(&self) -> &Boxes {
        self.boxes.get_or_init(|| self.build())
    }

    fn build(&self) -> Boxes {
        if let Some(facets) = &self.only {
            return Boxes::new(self.mesh, facets);
        }
        let mut facets: Vec<u32> = (0..self.mesh.facets.len() as u32).collect();
        facets.retain(|&facet| !self.mesh.is_degenerate(facet as usize));
        Boxes::new(self.mesh, &facets)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::trace::brute;
    use crate::trace::testing::{mesh, ray, soup};
    use proptest::prelude::*;

    fn plate() -> Mesh {
        let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
        mesh(&corners.map(|[x, y]| [x, y, 0.0]), &[[0, 1, 2], [0, 2, 3]])
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
    fn a_mesh_without_facets_is_not_hit() {
        let empty = Mesh { vertices: vec![], facets: vec![], labels: vec![] };
        let none = Bvh::new(&empty);
        assert_eq!(none.closest(&ray(DVec3::Z, DVec3::ZERO)), None);
        let only_slivers = Mesh { facets: vec![[0, 0, 2]], ..plate() };
        assert_eq!(Bvh::new(&only_slivers).closest(&ray(DVec3::Z, DVec3::ZERO)), None);
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
        let (mut mesh, mut back) = (plate(), plate());
        back.vertices.iter_mut().for_each(|vertex| vertex.z = 4.0);
        mesh.append(&back).unwrap();
        let hit = Bvh::new(&mesh).closest(&ray(DVec3::new(0.1, 0.2, 3.0), DVec3::ZERO)).unwrap();
        assert!(hit.facet < 2 && hit.range_m < 3.1);
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
