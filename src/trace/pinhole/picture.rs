//! Projects a mesh into the frame of a fan: every corner becomes (u, v, 1/z).

use glam::{DVec3, Vec4};
use rayon::prelude::*;

use super::fan::Fan;
use super::lanes::LANES;
use super::patches::Patches;
use crate::geometry::Mesh;
use crate::lanes::{Wide, widest};

/// Least cosine between a corner and the axis of the fan, 89.4°. Corners beyond are not projected.
const LEAST_COS: f64 = 0.01;

/// Least depth of a corner, m. Corners nearer are not projected.
const LEAST_DEPTH_M: f64 = 1e-6;

/// The projected mesh.
pub(super) struct Picture<'a> {
    pub fan: &'a Fan<'a>,
    pub mesh: &'a Mesh,
    /// (u, v, 1/z, 0) of every vertex; all 0 for one that is not projected.
    corners: Vec<Vec4>,
}

impl<'a> Picture<'a> {
    pub fn new(fan: &'a Fan, mesh: &'a Mesh) -> Picture<'a> {
        let blocks = mesh.vertices.par_chunks(LANES).with_min_len(256);
        let corners: Vec<_> = blocks.map(|vertices| widest(Projection { fan, vertices })).collect();
        let mut corners = corners.into_flattened();
        corners.truncate(mesh.vertices.len());
        Picture { fan, mesh, corners }
    }

    /// Projects a block of facets. A lane whose facet does not exist or is not projected counts as not seen.
    #[inline(always)]
    pub fn patches(&self, facets: &[u32; LANES]) -> Patches {
        let mut corners = [[[0.0; LANES]; 3]; 3];
        for (lane, &facet) in facets.iter().enumerate() {
            let Some(vertices) = self.mesh.facets.get(facet as usize) else { continue };
            for (corner, &vertex) in corners.iter_mut().zip(vertices) {
                let at = self.corners[vertex as usize].to_array();
                corner.iter_mut().zip(at).for_each(|(part, at)| part[lane] = at);
            }
        }
        Patches::new(corners, &self.fan.order.grid)
    }

    /// The facets that are not projected and that rays may hit.
    pub fn left_out(&self) -> Vec<u32> {
        if self.corners.par_iter().with_min_len(4096).all(|corner| corner.z > 0.0) {
            return Vec::new();
        }
        let facets = 0..self.mesh.facets.len() as u32;
        facets.into_par_iter().with_min_len(4096).filter(|&facet| self.is_left_out(facet)).collect()
    }

    fn is_left_out(&self, facet: u32) -> bool {
        let corners = self.mesh.facets[facet as usize];
        if corners.iter().all(|&vertex| self.corners[vertex as usize].z > 0.0) {
            return false;
        }
        // The rays lie in a pyramid. A facet wholly beyond one of its sides is not hit.
        const MARGIN: f64 = 1e-6;
        let Fan { frame, origin, ref order, .. } = *self.fan;
        let corners = self.mesh.corners(facet as usize).map(|corner| frame * (corner - origin));
        let beyond = |side: &dyn Fn(DVec3) -> f64| {
            corners.iter().all(|&at| side(at) < -MARGIN * at.length())
        };
        let [u_min, v_min] = order.grid.min.map(f64::from);
        let [u_max, v_max] = order.grid.max.map(f64::from);
        !(beyond(&|at| at.z)
            || beyond(&|at| at.x - u_min * at.z)
            || beyond(&|at| u_max * at.z - at.x)
            || beyond(&|at| at.y - v_min * at.z)
            || beyond(&|at| v_max * at.z - at.y)
            || self.mesh.is_degenerate(facet as usize))
    }
}

/// Projects up to [`LANES`] vertices to (u, v, 1/z, 0).
struct Projection<'a> {
    fan: &'a Fan<'a>,
    vertices: &'a [DVec3],
}

impl Wide for Projection<'_> {
    type Answer = [Vec4; LANES];

    #[inline(always)]
    fn run(self) -> [Vec4; LANES] {
        let mut places = [[0.0; LANES]; 3];
        for (lane, vertex) in self.vertices.iter().enumerate() {
            let at = vertex.to_array();
            places.iter_mut().zip(at).for_each(|(list, at)| list[lane] = at);
        }
        let mut corners = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let place = DVec3::new(places[0][lane], places[1][lane], places[2][lane]);
            let at = self.fan.frame * (place - self.fan.origin);
            let is_ahead = (at.z > LEAST_DEPTH_M)
                & (at.z * at.z > LEAST_COS * LEAST_COS * at.length_squared());
            let w = 1.0 / at.z;
            let corner = [(at.x * w) as f32, (at.y * w) as f32, w as f32];
            for (list, part) in corners.iter_mut().zip(corner) {
                list[lane] = if is_ahead { part } else { 0.0 };
            }
        }
        std::array::from_fn(|lane| {
            Vec4::new(corners[0][lane], corners[1][lane], corners[2][lane], 0.0)
        })
    }
}
