//! A mesh as a fan of rays sees it: every corner as (u, v, 1/z).

use glam::{DVec3, Vec4};
use rayon::prelude::*;

use super::ROUNDING;
use super::fan::Fan;
use super::lanes::Form;
use crate::geometry::Mesh;

/// Corners farther than this from the axis have no place in the picture: cosine of 89.4°.
const LEAST_COS: f64 = 0.01;

/// Corners nearer than this have none either, m.
const LEAST_DEPTH_M: f64 = 1e-6;

/// The projected mesh.
pub(super) struct Picture<'a> {
    pub fan: &'a Fan<'a>,
    pub mesh: &'a Mesh,
    /// (u, v, 1/z, 0) of every vertex; all 0 for one that has no place in the picture.
    corners: Vec<Vec4>,
    /// Where the rays are; without bounds in the other two components.
    field: [Vec4; 2],
}

/// A facet in the picture, and the cells that its box touches.
pub(super) struct Patch {
    corners: [Vec4; 3],
    low: Vec4,
    high: Vec4,
    pub columns: [usize; 2],
    pub rows: [usize; 2],
}

impl<'a> Picture<'a> {
    pub fn new(fan: &'a Fan, mesh: &'a Mesh) -> Picture<'a> {
        let corner = |vertex: &DVec3| {
            let at = fan.frame * (*vertex - fan.origin);
            let is_ahead =
                at.z > LEAST_DEPTH_M && at.z * at.z > LEAST_COS * LEAST_COS * at.length_squared();
            let w = 1.0 / at.z;
            let corner = Vec4::new((at.x * w) as f32, (at.y * w) as f32, w as f32, 0.0);
            if is_ahead { corner } else { Vec4::ZERO }
        };
        let corners = mesh.vertices.par_iter().with_min_len(4096).map(corner).collect();
        let ([u_min, v_min], [u_max, v_max]) = (fan.grid.min, fan.grid.max);
        let field = [
            Vec4::new(u_min, v_min, f32::NEG_INFINITY, f32::NEG_INFINITY),
            Vec4::new(u_max, v_max, f32::INFINITY, f32::INFINITY),
        ];
        Picture { fan, mesh, corners, field }
    }

    /// A facet; `None` when no ray passes near it or it has no place in the picture.
    #[inline(always)]
    pub fn patch(&self, facet: u32) -> Option<Patch> {
        let corners = self.mesh.facets[facet as usize].map(|vertex| self.corners[vertex as usize]);
        let [a, b, c] = corners;
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let grid = &self.fan.grid;
        // Both the corners and the rays are rounded.
        let slack = 4.0 * ROUNDING * low.abs().max(high.abs()).max(Vec4::splat(grid.reach));
        let (near, far) = (low - slack, high + slack);
        if (far.cmplt(self.field[0]) | near.cmpgt(self.field[1])).any() || low.z <= 0.0 {
            return None;
        }
        let columns = [grid.step(0, near.x), grid.step(0, far.x)];
        let rows = [grid.step(1, near.y), grid.step(1, far.y)];
        Some(Patch { corners, low, high, columns, rows })
    }

    /// Facets that rays may meet and that have no place in the picture.
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
        // The rays lie in a pyramid; a facet wholly beyond one of its sides is not met.
        const MARGIN: f64 = 1e-6;
        let Fan { frame, origin, ref grid, .. } = *self.fan;
        let corners = self.mesh.corners(facet as usize).map(|corner| frame * (corner - origin));
        let beyond = |side: &dyn Fn(DVec3) -> f64| {
            corners.iter().all(|&at| side(at) < -MARGIN * at.length())
        };
        let [u_min, v_min] = grid.min.map(f64::from);
        let [u_max, v_max] = grid.max.map(f64::from);
        !(beyond(&|at| at.z)
            || beyond(&|at| at.x - u_min * at.z)
            || beyond(&|at| u_max * at.z - at.x)
            || beyond(&|at| at.y - v_min * at.z)
            || beyond(&|at| v_max * at.z - at.y)
            || self.mesh.is_degenerate(facet as usize))
    }
}

impl Patch {
    /// Whether the facet surely has an area: one that is not seen edge-on and whose corners are not far apart in depth. The
    /// corners of one without area are collinear to 10⁻¹² of its length, at most 200 depths of the farthest,
    /// and its picture can only be wide enough if one corner is 300 times as near as another.
    #[inline(always)]
    pub fn has_area(&self, form: &Form) -> bool {
        form.area > 3.0 * form.doubt && self.high.z < 64.0 * self.low.z
    }

    /// The forms of the facet, for rays within its cells.
    ///
    /// Let M be the largest coordinate, L the longest side of the box and two cells more, and η = 2⁻²⁴.
    /// Coordinates err by 1.1·ηM, their differences by 2.2·ηM + ηL, an area by 8.8·ηLM + 8·ηL², and the
    /// third area, which is what the other two leave, by 27·ηLM + 34·ηL²: all by less than
    /// e = 36·ηL(M + L). Where rounding turned the sign of the whole area, a point inside may
    /// show −2e, hence a doubt of 2e. The shares of two corners err by 2e/area each and the
    /// inverse depths by a few η.
    #[inline(always)]
    pub fn form(&self, cell: [f32; 2], reach: f32) -> Form {
        let [a, b, c] = self.corners;
        let sides = self.high - self.low;
        let length = (sides.x + 2.0 * cell[0]).max(sides.y + 2.0 * cell[1]);
        let most = self.low.abs().max(self.high.abs());
        let doubt = 72.0 * ROUNDING * length * (most.x.max(most.y).max(reach) + length);
        let (ab, ca) = (b - a, a - c);
        let area = ab.y * ca.x - ab.x * ca.y;
        let (ab, ca, area) = if area < 0.0 { (-ab, -ca, -area) } else { (ab, ca, area) };
        let rounding = 8.0 * ROUNDING * self.high.z;
        let [w, w_b, w_c, w_doubt] = if area > 3.0 * doubt {
            let per_area = 1.0 / area;
            let spread = 3.0 * doubt * per_area * sides.z;
            [a.z, (b.z - a.z) * per_area, (c.z - a.z) * per_area, spread + rounding]
        } else {
            // Seen edge-on: nothing is sure but that it is no nearer than its nearest corner.
            [self.high.z, 0.0, 0.0, rounding]
        };
        let [at, ab, ca] = [a, ab, ca].map(|corner| [corner.x, corner.y]);
        Form { at, ab, ca, area, doubt, w, w_b, w_c, w_doubt }
    }
}
