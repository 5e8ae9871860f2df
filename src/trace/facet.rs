//! One ray, one facet, in f64.

use super::Hit;
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;

/// Distance along the ray to a facet, m; `None` when it passes beside or behind.
///
/// By Woop, Benthin and Wald (JCGT 2 (2013) 65): the corners are sheared so that the ray becomes an axis,
/// which depends on the corner and the ray alone, and an edge is the difference of two products. Rounding
/// cannot turn its sign, only make it zero, which counts as inside: no ray slips between
/// neighbours, nor through the corner where many meet.
pub(super) fn crossing_m(mesh: &Mesh, facet: usize, ray: &Ray<Global>) -> Option<f64> {
    let direction = ray.direction.xyz();
    let along = direction.abs().max_position();
    let [across, up] = [(along + 1) % 3, (along + 2) % 3];
    let shear = [direction[across], direction[up]].map(|part| part / direction[along]);
    let [a, b, c] = mesh.corners(facet).map(|corner| {
        let at = corner - ray.origin.xyz;
        [at[across] - shear[0] * at[along], at[up] - shear[1] * at[along]]
    });
    let edge = |from: [f64; 2], to: [f64; 2]| from[0] * to[1] - from[1] * to[0];
    let [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)];
    let all = |inside: fn(f64) -> bool| inside(ab) && inside(bc) && inside(ca);
    if !all(|v| v >= 0.0) && !all(|v| v <= 0.0) {
        return None;
    }
    plane_m(mesh, facet, ray)
}

/// Distance along the ray to the plane of a facet, m, for a ray that passes through the facet; `None`
/// when it lies behind or along the ray.
#[inline]
pub(super) fn plane_m(mesh: &Mesh, facet: usize, ray: &Ray<Global>) -> Option<f64> {
    let (origin, direction) = (ray.origin.xyz, ray.direction.xyz());
    let [a, _, _] = mesh.corners(facet);
    let normal = mesh.area_normal(facet);
    let range_m = (a - origin).dot(normal) / direction.dot(normal);
    (range_m > 0.0 && range_m.is_finite()).then_some(range_m)
}

/// Completes a hit from the facet and the distance.
#[inline]
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
