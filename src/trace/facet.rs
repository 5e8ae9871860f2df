//! One ray, one facet, in f64.

use glam::DVec3;

use super::Hit;
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;

/// Distance along the ray to a facet, m; `None` when it passes beside or behind.
///
/// The three edge volumes d·(a × b) of two facets that share an edge are exact negatives of each
/// other, and zero counts as inside, so that no ray slips between neighbours.
pub(super) fn crossing_m(mesh: &Mesh, facet: usize, ray: &Ray<Global>) -> Option<f64> {
    let origin = ray.origin.xyz;
    let direction = ray.direction.xyz();
    let [a, b, c] = mesh.corners(facet).map(|corner| corner - origin);
    let volume = |from: DVec3, to: DVec3| direction.dot(from.cross(to));
    let [ab, bc, ca] = [volume(a, b), volume(b, c), volume(c, a)];
    let all = |inside: fn(f64) -> bool| inside(ab) && inside(bc) && inside(ca);
    if !all(|v| v >= 0.0) && !all(|v| v <= 0.0) {
        return None;
    }
    let normal = mesh.area_normal(facet);
    let range_m = a.dot(normal) / direction.dot(normal);
    (range_m > 0.0 && range_m.is_finite()).then_some(range_m)
}

/// Completes a hit from the facet and the distance.
pub(super) fn measured(mesh: &Mesh, facet: u32, ray: &Ray<Global>, range_m: f64) -> Hit {
    let normal = mesh.area_normal(facet as usize).normalize_or_zero();
    let direction = ray.direction.xyz();
    Hit {
        facet,
        range_m,
        point: (ray.origin.xyz + range_m * direction).into(),
        cos_theta: direction.dot(normal).abs(),
    }
}
