//! The intersection of a ray with a facet, in f64.

use glam::DVec3;

use super::hit::Hit;
use crate::frames::{Global, Point, Ray};
use crate::geometry::Mesh;

/// A ray prepared for tests against many facets.
///
/// The test is watertight (Woop, Benthin and Wald, JCGT 2 (2013) 65). A shear turns the ray into an axis; where it
/// puts a corner depends on the corner and the ray alone. The side of an edge on which the ray passes is then the
/// sign of a difference of two products. Rounding can make that zero, which counts as inside, but cannot
/// change its sign. So no ray slips between neighbours or through a common corner.
pub(super) struct Line<'a> {
    ray: &'a Ray<Global>,
    /// The axis with the largest component of the direction.
    along: usize,
    /// The other two axes.
    beside: [usize; 2],
    /// Direction along these two over direction along the first.
    shear: [f64; 2],
}

impl<'a> Line<'a> {
    #[inline]
    pub fn new(ray: &'a Ray<Global>) -> Line<'a> {
        let direction = ray.direction.xyz();
        let along = direction.abs().max_position();
        let beside = [(along + 1) % 3, (along + 2) % 3];
        Line { ray, along, beside, shear: beside.map(|axis| direction[axis] / direction[along]) }
    }

    /// Distance along the ray to a facet, m; `None` if the ray misses it.
    #[inline(always)]
    pub fn range_to_facet_m(&self, mesh: &Mesh, facet: usize) -> Option<f64> {
        let Line { ray, along, beside: [across, up], shear } = *self;
        let beside = |corner: DVec3| {
            let at = (corner - ray.origin.xyz).to_array();
            [at[across] - shear[0] * at[along], at[up] - shear[1] * at[along]]
        };
        let [a, b, c] = mesh.corners(facet);
        let [a, b, c] = [beside(a), beside(b), beside(c)];
        let edge = |from: [f64; 2], to: [f64; 2]| from[0] * to[1] - from[1] * to[0];
        let [ab, bc, ca] = [edge(a, b), edge(b, c), edge(c, a)];
        let all = |inside: fn(f64) -> bool| inside(ab) && inside(bc) && inside(ca);
        if !all(|v| v >= 0.0) && !all(|v| v <= 0.0) {
            return None;
        }
        range_to_plane_m(mesh, facet, ray)
    }
}

/// Distance along the ray to the plane of a facet, m; `None` if the plane lies behind or along the ray.
#[inline]
pub(super) fn range_to_plane_m(mesh: &Mesh, facet: usize, ray: &Ray<Global>) -> Option<f64> {
    let corners = mesh.corners(facet);
    let range_m = crossing_range_m(ray.origin.xyz, ray.direction.xyz(), corners, normal(corners));
    is_ahead(range_m).then_some(range_m)
}

/// Normal of a facet; its length is twice the area.
#[inline(always)]
fn normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}

/// Cosine of the incidence angle below which a ray counts as parallel to a facet with perpendicular edges, because
/// rounding would decide where it crosses the plane. For slivers the limit is larger.
pub(super) const GRAZING: f64 = 1e-10;

/// Signed distance along a ray to the plane of a facet, m; NaN for a ray parallel to it. All callers share this
/// function, so that all get the same bits.
#[inline(always)]
fn crossing_range_m(origin: DVec3, along: DVec3, [a, b, c]: [DVec3; 3], normal: DVec3) -> f64 {
    let sinks = along.dot(normal);
    let edges2 = (b - a).length_squared() * (c - a).length_squared();
    let range_m = (a - origin).dot(normal) / sinks;
    if sinks * sinks <= GRAZING * GRAZING * edges2 { f64::NAN } else { range_m }
}

/// Whether a distance, m, is positive and finite. Plain comparisons, since these compile to vector instructions.
#[inline(always)]
fn is_ahead(range_m: f64) -> bool {
    (range_m > 0.0) & (range_m < f64::INFINITY)
}

/// The hit of a ray on the plane of a facet; `None` if the plane lies behind or along the ray.
#[inline]
pub(super) fn plane_hit(mesh: &Mesh, facet: u32, ray: &Ray<Global>) -> Option<Hit> {
    let mut hit = [None];
    plane_hits(mesh, [facet], [ray], &mut hit);
    hit[0]
}

/// The hits of `N` rays of one origin, each on the plane of its facet, computed in parallel lanes. `hits` may be
/// shorter than `N`. A hit is `None` if the plane lies behind or along the ray, or if the facet does not exist.
#[inline(always)]
pub(super) fn plane_hits<const N: usize>(
    mesh: &Mesh,
    facets: [u32; N],
    rays: [&Ray<Global>; N],
    hits: &mut [Option<Hit>],
) {
    let origin = rays[0].origin.xyz;
    let [mut along, mut a, mut b, mut c] = [[[0.0; N]; 3]; 4];
    for lane in 0..N {
        let set = |list: &mut [[f64; N]; 3], at: DVec3| {
            list.iter_mut().zip(at.to_array()).for_each(|(list, at)| list[lane] = at);
        };
        set(&mut along, rays[lane].direction.xyz());
        if let Some(corners) = mesh.facets.get(facets[lane] as usize) {
            let corners = corners.map(|vertex| mesh.vertices[vertex as usize]);
            [&mut a, &mut b, &mut c].into_iter().zip(corners).for_each(|(list, at)| set(list, at));
        }
    }
    let mut point = [[0.0; N]; 3];
    let [mut range_m, mut cos_theta] = [[0.0; N]; 2];
    for lane in 0..N {
        let [along, a, b, c] = [&along, &a, &b, &c]
            .map(|list| DVec3::new(list[0][lane], list[1][lane], list[2][lane]));
        let normal = normal([a, b, c]);
        range_m[lane] = crossing_range_m(origin, along, [a, b, c], normal);
        let per_length = 1.0 / normal.dot(normal).sqrt();
        let unit = if per_length < f64::INFINITY { normal * per_length } else { DVec3::ZERO };
        cos_theta[lane] = along.dot(unit).abs();
        let at = origin + range_m[lane] * along;
        for (list, at) in point.iter_mut().zip(at.to_array()) {
            list[lane] = at;
        }
    }
    for (lane, hit) in hits.iter_mut().enumerate().take(N) {
        let [x, y, z] = [0, 1, 2].map(|axis| point[axis][lane]);
        *hit = is_ahead(range_m[lane]).then_some(Hit {
            facet: facets[lane],
            range_m: range_m[lane],
            point: Point::new(x, y, z),
            cos_theta: cos_theta[lane],
        });
    }
}
