//! Intersections of rays with a mesh at any pose.
//!
//! The mesh itself never moves: rays are transformed into its frame, and hits out of it, so that the hierarchy over its
//! facets is built once for all poses.

use glam::DVec3;
use rayon::prelude::*;

use crate::frames::{Global, Pose, Ray};
use crate::geometry::Mesh;
use crate::trace::{Bvh, Fan, Hit};

/// With more facets per ray a hierarchy is built: a registration scans dozens of poses, and without a hierarchy
/// every scan reads all facets.
const FACETS_PER_RAY: usize = 20;

/// A mesh that is intersected with rays, at one pose after another.
pub struct Tracer<'a> {
    mesh: &'a Mesh,
    bvh: Bvh<'a>,
}

/// Rays that are intersected with a mesh, at one pose after another; those of one origin are sorted once.
pub struct RaySet<'a> {
    rays: &'a [Ray<Global>],
    fan: Option<Fan<'a>>,
}

impl<'a> RaySet<'a> {
    /// Prepares rays for the intersection with `mesh`.
    pub fn new(mesh: &Mesh, rays: &'a [Ray<Global>]) -> RaySet<'a> {
        let is_flat = mesh.facets.len() <= FACETS_PER_RAY * rays.len();
        RaySet { rays, fan: if is_flat { Fan::new(rays).ok() } else { None } }
    }

    /// The rays, in the order of [`Tracer::scan`].
    pub fn rays(&self) -> &'a [Ray<Global>] {
        self.rays
    }

    /// The closest hits of the rays, moved by `pose`.
    fn closest(&self, bvh: &Bvh, pose: &Pose<Global, Global>) -> Vec<Option<Hit>> {
        let there: Vec<Ray<Global>> = self.rays.iter().map(|ray| *pose * *ray).collect();
        match self.fan.as_ref().and_then(|fan| fan.carried(&there, pose)) {
            Some(fan) => fan.closest(bvh.mesh()),
            None => bvh.closest_of_each(&there),
        }
    }
}

/// The intersection of a ray with the mesh at a pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection {
    /// The hit; its point is where the mesh is at the pose.
    pub hit: Hit,
    /// Unit normal of the facet, on the radar's side.
    pub normal: DVec3,
}

impl<'a> Tracer<'a> {
    /// A hierarchy over the mesh is built when rays first need one.
    pub fn new(mesh: &'a Mesh) -> Tracer<'a> {
        Tracer { mesh, bvh: Bvh::new(mesh) }
    }

    /// Middle of the mesh's bounding box, m.
    pub fn middle(&self) -> DVec3 {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for vertex in &self.mesh.vertices {
            min = min.min(*vertex);
            max = max.max(*vertex);
        }
        0.5 * (min + max)
    }

    /// The closest intersection of a ray with the mesh moved by `pose`.
    pub fn intersect(
        &self,
        pose: &Pose<Global, Global>,
        ray: &Ray<Global>,
    ) -> Option<Intersection> {
        let hit = self.bvh.closest(&(pose.inverse() * *ray))?;
        Some(self.moved(pose, ray, hit))
    }

    /// The closest intersections of rays with the mesh moved by `pose`, in their order.
    pub fn scan(&self, pose: &Pose<Global, Global>, aims: &RaySet) -> Vec<Option<Intersection>> {
        const RAYS_PER_TASK: usize = 256;
        let hits = aims.closest(&self.bvh, &pose.inverse());
        aims.rays
            .par_iter()
            .zip(hits)
            .with_min_len(RAYS_PER_TASK)
            .map(|(ray, hit)| Some(self.moved(pose, ray, hit?)))
            .collect()
    }

    /// A hit of the mesh in its own frame, moved by `pose`.
    fn moved(&self, pose: &Pose<Global, Global>, ray: &Ray<Global>, hit: Hit) -> Intersection {
        let normal =
            pose.rotation() * self.mesh.area_normal(hit.facet as usize).normalize_or_zero();
        let turned = if normal.dot(ray.direction.xyz()) > 0.0 { -normal } else { normal };
        Intersection { hit: Hit { point: *pose * hit.point, ..hit }, normal: turned }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::scene::solids;

    #[test]
    fn moving_the_rays_is_moving_the_mesh() {
        let pose = Pose::from_euler_xyz(DVec3::new(0.2, -0.4, 1.0), DVec3::new(0.1, 0.2, -0.3));
        let mesh = solids::icosphere(0.4, 3);
        let mut moved = mesh.clone();
        moved.vertices.iter_mut().for_each(|v| *v = (pose * Point::from(*v)).xyz);
        let origin = Point::new(0.0, 0.0, 8.0);
        let ray = Ray { origin, direction: origin.towards(Point::new(0.2, 0.3, 0.0)).unwrap() };
        let (there, here) = (Tracer::new(&mesh), Tracer::new(&moved));
        let seen = there.intersect(&pose, &ray).unwrap();
        let same = here.intersect(&Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO), &ray).unwrap();
        assert_eq!(seen.hit.facet, same.hit.facet);
        assert!(seen.hit.point.distance_m(same.hit.point) < 1e-12);
        assert!(seen.normal.distance(same.normal) < 1e-12);
        assert!((seen.hit.cos_theta - same.hit.cos_theta).abs() < 1e-12);
        assert!(seen.normal.dot(ray.direction.xyz()) < 0.0);
    }

    #[test]
    fn few_and_many_rays_meet_what_each_meets_by_itself() {
        let mesh = solids::icosphere(0.4, 3);
        let pose = Pose::from_euler_xyz(DVec3::new(0.0, 0.3, 0.1), DVec3::new(0.05, 0.0, 0.1));
        let origin = Point::new(0.0, 0.0, 8.0);
        for count in [3, 200] {
            let aim =
                |ray: usize| Point::new(0.3 * (ray as f64).sin(), 0.3 * (ray as f64).cos(), 0.0);
            let towards = |ray| Ray { origin, direction: origin.towards(aim(ray)).unwrap() };
            let rays: Vec<Ray<Global>> = (0..count).map(towards).collect();
            let tracer = Tracer::new(&mesh);
            let seen = tracer.scan(&pose, &RaySet::new(&mesh, &rays));
            assert_eq!(tracer.bvh.is_built(), count == 3);
            for (ray, seen) in rays.iter().zip(seen) {
                let (seen, alone) = (seen.unwrap(), tracer.intersect(&pose, ray).unwrap());
                assert!(seen.hit.point.distance_m(alone.hit.point) < 1e-12);
            }
        }
    }
}
