//! The bounding boxes of facets in f32, as a binary tree that `obvhs` builds.

use std::time::Duration;

use glam::{DVec3, Vec3A};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::builder::build_bvh2;

use crate::frames::{Global, Ray};
use crate::geometry::Mesh;

/// Margin of every box, as a share of the mesh's radius: about eighty times the rounding of f32.
pub(super) const PADDING: f64 = 1e-5;

/// A binary tree of bounding boxes. Coordinates count from the centre of `sphere`.
pub(super) struct Boxes {
    pub tree: Bvh2,
    /// Facet of each leaf entry.
    pub facets: Vec<u32>,
    /// A sphere around all facets.
    pub sphere: Sphere,
}

impl Boxes {
    /// Builds the tree over facets, all of which must have an area.
    pub fn new(mesh: &Mesh, facets: &[u32]) -> Boxes {
        let sphere = Sphere::around(mesh, facets);
        let padding = Vec3A::splat((PADDING * sphere.radius_m) as f32);
        let boxes: Vec<Aabb> = facets
            .iter()
            .map(|&facet| {
                let corners =
                    mesh.corners(facet as usize).map(|corner| (corner - sphere.centre).as_vec3a());
                let tight = Aabb::from_points(&corners);
                Aabb::new(tight.min - padding, tight.max + padding)
            })
            .collect();
        // Slower presets take far longer to build, and their trees are hardly faster when eight boxes are tested at once.
        let tree = build_bvh2(&boxes, BvhBuildParams::fast_build(), &mut Duration::default());
        let facets = tree.primitive_indices.iter().map(|&entry| facets[entry as usize]).collect();
        Boxes { tree, facets, sphere }
    }
}

/// A sphere around facets. f32 is precise for coordinates from its centre, and for distances from where a ray enters.
#[derive(Clone, Copy)]
pub(super) struct Sphere {
    pub centre: DVec3,
    pub radius_m: f64,
}

impl Sphere {
    /// A sphere around the corners of facets.
    fn around(mesh: &Mesh, facets: &[u32]) -> Sphere {
        let corners = || facets.iter().flat_map(|&facet| mesh.corners(facet as usize));
        let min = corners().fold(DVec3::INFINITY, DVec3::min);
        let max = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
        let centre = 0.5 * (min + max);
        let radius_m = corners().map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        Sphere { centre, radius_m }
    }

    /// Distance at which a ray enters the sphere, m; 0 if it starts inside, `None` if it misses.
    #[inline]
    pub fn entry_m(&self, ray: &Ray<Global>) -> Option<f64> {
        self.entry_within_m(ray, 0.0)
    }

    /// Distance at which a ray enters a sphere that is larger by `margin_m`, m; 0 if it starts inside, `None` if it
    /// misses.
    #[inline]
    pub fn entry_within_m(&self, ray: &Ray<Global>, margin_m: f64) -> Option<f64> {
        let to_centre = self.centre - ray.origin.xyz;
        let along_m = to_centre.dot(ray.direction.xyz());
        let beside2 = (to_centre - along_m * ray.direction.xyz()).length_squared();
        let radius_m = (self.radius_m + margin_m) * (1.0 + PADDING);
        let half_chord_m = (radius_m * radius_m - beside2).max(0.0).sqrt();
        let reached = beside2 <= radius_m * radius_m && along_m + half_chord_m > 0.0;
        reached.then(|| (along_m - half_chord_m).max(0.0))
    }
}
