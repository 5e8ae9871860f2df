//! The test oracle: the intersection formula of Möller and Trumbore (J. Graphics Tools 2 (1997) 21) in f64 over all
//! facets, which is the paper's own method. It is slow and simple, and every faster tracer is compared with it.

use super::facet::GRAZING;
use super::hit::Hit;
use crate::frames::{Global, Ray};
use crate::geometry::Mesh;

/// The closest hit of one ray; among equally near facets, the one with the smallest number.
pub fn closest(mesh: &Mesh, ray: &Ray<Global>) -> Option<Hit> {
    let mut best: Option<Hit> = None;
    for facet in 0..mesh.facets.len() {
        if let Some(range_m) = intersect(mesh, facet, ray)
            && best.is_none_or(|hit| range_m < hit.range_m)
            && !mesh.is_degenerate(facet)
        {
            let (along, normal) =
                (ray.direction.xyz(), mesh.area_normal(facet).normalize_or_zero());
            best = Some(Hit {
                facet: facet as u32,
                range_m,
                point: (ray.origin.xyz + range_m * along).into(),
                cos_theta: along.dot(normal).abs(),
            });
        }
    }
    best
}

/// Distance along the ray to the facet, m; `None` if the ray misses it or grazes its plane.
fn intersect(mesh: &Mesh, facet: usize, ray: &Ray<Global>) -> Option<f64> {
    let [a, b, c] = mesh.corners(facet);
    let (ab, ac, direction) = (b - a, c - a, ray.direction.xyz());
    let p = direction.cross(ac);
    let determinant = ab.dot(p);
    let from_a = ray.origin.xyz - a;
    let q = from_a.cross(ab);
    let u = from_a.dot(p) / determinant;
    let v = direction.dot(q) / determinant;
    let t = ac.dot(q) / determinant;
    let is_within = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0;
    // This test comes last, since few facets get this far.
    (is_within && determinant.abs() > GRAZING * ab.length() * ac.length()).then_some(t)
}
