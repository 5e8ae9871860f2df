//! The projections of a block of facets, and their linear forms, in f32.

use super::fan::Grid;
use super::lanes::{Form, LANES, Lanes, ROUNDING};
use crate::lanes::{least, most};
use crate::trace::facet::GRAZING;

/// Stands for no facet.
pub(super) const NONE: u32 = u32::MAX;

/// Bound below which a ray may count as parallel to a facet: twice that of `facet.rs`, for rounding.
const ALONG: f32 = 2.0 * GRAZING as f32;

/// The projections of a block of facets, and the cells that their bounding boxes touch.
pub(super) struct Patches {
    /// u, v and 1/z of the three corners.
    corners: [[Lanes; 3]; 3],
    /// Least and largest u, v and 1/z.
    low: [Lanes; 3],
    high: [Lanes; 3],
    /// First and last column, first and last row.
    cells: [[[u32; LANES]; 2]; 2],
    /// 1 for a facet that is projected and that rays may hit.
    is_seen: [u32; LANES],
}

/// A rectangle of cells: first and last column, first and last row.
#[derive(Clone, Copy)]
pub(super) struct Cells {
    pub columns: [usize; 2],
    pub rows: [usize; 2],
}

/// The linear forms of a block of facets; their fields are those of [`Form`].
pub(super) struct Forms {
    at: [Lanes; 2],
    ab: [Lanes; 2],
    ca: [Lanes; 2],
    area: Lanes,
    doubt: Lanes,
    w: [Lanes; 3],
    w_doubt: Lanes,
    has_area: [u32; LANES],
}

impl Patches {
    /// Facets with these corners (u, v, 1/z). A facet with a corner of all 0 is not projected.
    #[inline(always)]
    pub fn new(corners: [[Lanes; 3]; 3], grid: &Grid) -> Patches {
        let [a, b, c] = &corners;
        let (mut low, mut high) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for axis in 0..3 {
            for lane in 0..LANES {
                let [a, b, c] = [a[axis][lane], b[axis][lane], c[axis][lane]];
                low[axis][lane] = least(least(a, b), c);
                high[axis][lane] = most(most(a, b), c);
            }
        }
        let mut cells = [[[0; LANES]; 2]; 2];
        let mut is_seen = [0; LANES];
        for lane in 0..LANES {
            is_seen[lane] = u32::from(low[2][lane] > 0.0);
        }
        for axis in 0..2 {
            for lane in 0..LANES {
                let (low, high) = (low[axis][lane], high[axis][lane]);
                // Covers the rounding of both corners and rays.
                let slack = 4.0 * ROUNDING * most(most(low.abs(), high.abs()), grid.reach);
                let (near, far) = (low - slack, high + slack);
                let in_field = (far >= grid.min[axis]) & (near <= grid.max[axis]);
                is_seen[lane] &= u32::from(in_field);
                cells[axis][0][lane] = grid.step(axis, near);
                cells[axis][1][lane] = grid.step(axis, far);
            }
        }
        Patches { corners, low, high, cells, is_seen }
    }

    /// The lanes of the facets that are projected and that rays may hit.
    #[inline(always)]
    pub fn seen(&self) -> impl Iterator<Item = usize> {
        let bits = (0..LANES).fold(0, |bits, lane| bits | self.is_seen[lane] << lane);
        std::iter::successors(Some(bits), |bits| Some(bits & bits.wrapping_sub(1)))
            .take_while(|&bits: &u32| bits != 0)
            .map(|bits| bits.trailing_zeros() as usize)
    }

    /// The cells that the bounding box of a facet touches.
    #[inline(always)]
    pub fn cells(&self, lane: usize) -> Cells {
        let [columns, rows] = &self.cells;
        let of = |[first, last]: &[[u32; LANES]; 2]| [first[lane] as usize, last[lane] as usize];
        Cells { columns: of(columns), rows: of(rows) }
    }

    /// The forms of the facets, valid for rays within their cells.
    ///
    /// Let M be the largest coordinate, L the longest side of the box plus two cells, and η = 2⁻²⁴.
    /// The errors are at most 1.1·ηM for coordinates, 2.2·ηM + ηL for their differences, 8.8·ηLM + 8·ηL² for an area,
    /// and 27·ηLM + 34·ηL² for the third area, which is the difference of the others. All are below
    /// e = 36·ηL(M + L). If rounding changes the sign of the whole area, a point inside may
    /// get −2e, hence `doubt` = 2e. The weights of two corners err by 2e/area each, and the
    /// inverse depths by a few η.
    ///
    /// A ray counts as parallel to a facet, and misses it, if |d·n| ≤ 10⁻¹⁰·|ab|·|ac| (`facet.rs`). For depths from
    /// z to Z, |d·n| ≥ z³/Z·area/(1 + 2M), and an edge is at most 1.5·ZL + (Z − z)(1 + 2M) long.
    #[inline(always)]
    pub fn forms(&self, grid: &Grid) -> Forms {
        let Patches { corners: [a, b, c], low, high, .. } = self;
        let mut forms = Forms {
            at: [a[0], a[1]],
            ab: [[0.0; LANES]; 2],
            ca: [[0.0; LANES]; 2],
            area: [0.0; LANES],
            doubt: [0.0; LANES],
            w: [[0.0; LANES]; 3],
            w_doubt: [0.0; LANES],
            has_area: [0; LANES],
        };
        for lane in 0..LANES {
            let side = |axis: usize| high[axis][lane] - low[axis][lane] + 2.0 * grid.cell[axis];
            let length = most(side(0), side(1));
            let reach = |axis: usize| most(low[axis][lane].abs(), high[axis][lane].abs());
            let reach = most(most(reach(0), reach(1)), grid.reach);
            let doubt = 72.0 * ROUNDING * length * (reach + length);
            let ab = [b[0][lane] - a[0][lane], b[1][lane] - a[1][lane]];
            let ca = [a[0][lane] - c[0][lane], a[1][lane] - c[1][lane]];
            let area = ab[1] * ca[0] - ab[0] * ca[1];
            // A facet that runs clockwise is reversed.
            let sign = if area < 0.0 { -1.0 } else { 1.0 };
            let area = sign * area;
            for axis in 0..2 {
                forms.ab[axis][lane] = sign * ab[axis];
                forms.ca[axis][lane] = sign * ca[axis];
            }
            let (near, far) = (high[2][lane], low[2][lane]);
            let (depth, wide) = (far / near, 1.0 + 2.0 * reach);
            let edge = 1.5 * length + (1.0 - depth) * wide;
            let runs_along = depth * depth * depth * area <= ALONG * wide * edge * edge;
            let has_size = area > 3.0 * doubt;
            let is_sure = has_size & !runs_along;
            let per_area = 1.0 / area;
            let rounding = 8.0 * ROUNDING * near;
            let spread = 3.0 * doubt * per_area * (near - far);
            let at = a[2][lane];
            let w = [at, (b[2][lane] - at) * per_area, (c[2][lane] - at) * per_area];
            // For a facet seen edge-on it is certain only that it is no nearer than its nearest corner; for one
            // that may be parallel to the ray, not even that.
            forms.w[0][lane] = if is_sure { w[0] } else { near };
            forms.w[1][lane] = if is_sure { w[1] } else { 0.0 };
            forms.w[2][lane] = if is_sure { w[2] } else { 0.0 };
            let unsure = if has_size { f32::INFINITY } else { rounding };
            forms.w_doubt[lane] = if is_sure { spread + rounding } else { unsure };
            forms.has_area[lane] = u32::from(is_sure & (near < 64.0 * far));
            (forms.area[lane], forms.doubt[lane]) = (area, doubt);
        }
        forms
    }
}

impl Forms {
    /// The forms of one facet.
    #[inline(always)]
    pub fn of(&self, lane: usize) -> Form {
        Form {
            at: [self.at[0][lane], self.at[1][lane]],
            ab: [self.ab[0][lane], self.ab[1][lane]],
            ca: [self.ca[0][lane], self.ca[1][lane]],
            area: self.area[lane],
            doubt: self.doubt[lane],
            w: self.w[0][lane],
            w_b: self.w[1][lane],
            w_c: self.w[2][lane],
            w_doubt: self.w_doubt[lane],
        }
    }

    /// Whether the facet certainly has an area: it is not seen edge-on, and its corners have similar depths.
    ///
    /// The corners of a facet without area are collinear to 10⁻¹² of its length, which is at most 200 depths of the
    /// farthest corner. Its projection can then be wide enough only if one corner is 300 times as near as another.
    #[inline(always)]
    pub fn has_area(&self, lane: usize) -> bool {
        self.has_area[lane] == 1
    }
}

/// Splits a list of facets into blocks; the last one is filled with [`NONE`].
#[inline(always)]
pub(super) fn blocks(mut facets: impl Iterator<Item = u32>) -> impl Iterator<Item = [u32; LANES]> {
    std::iter::from_fn(move || {
        let mut block = [NONE; LANES];
        for (place, facet) in block.iter_mut().zip(&mut facets) {
            *place = facet;
        }
        (block[0] != NONE).then_some(block)
    })
}
