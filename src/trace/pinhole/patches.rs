//! Facets in the picture, a block of them side by side.

use super::fan::Grid;
use super::lanes::{Form, LANES, Lanes, ROUNDING};
use crate::trace::facet::GRAZING;
use crate::trace::wide::{least, most};

/// No facet.
pub(super) const NONE: u32 = u32::MAX;

/// Twice the bound below which a ray runs along a facet, for rounding.
const ALONG: f32 = 2.0 * GRAZING as f32;

/// A block of facets, and the cells that their boxes touch.
pub(super) struct Patches {
    /// u, v and 1/z of the three corners.
    corners: [[Lanes; 3]; 3],
    low: [Lanes; 3],
    high: [Lanes; 3],
    /// First and last column, first and last row.
    cells: [[[u32; LANES]; 2]; 2],
    /// 1 where rays may pass near the facet and it has its place in the picture.
    is_seen: [u32; LANES],
}

/// Cells of the grid: the first and the last of each.
#[derive(Clone, Copy)]
pub(super) struct Cells {
    pub columns: [usize; 2],
    pub rows: [usize; 2],
}

/// The forms of a block of facets.
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
    /// Facets with these corners (u, v, 1/z); one that is all 0 is not seen.
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
                // Both the corners and the rays are rounded.
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

    /// Where in the block rays may pass near the facet.
    #[inline(always)]
    pub fn seen(&self) -> impl Iterator<Item = usize> {
        let bits = (0..LANES).fold(0, |bits, lane| bits | self.is_seen[lane] << lane);
        std::iter::successors(Some(bits), |bits| Some(bits & bits.wrapping_sub(1)))
            .take_while(|&bits: &u32| bits != 0)
            .map(|bits| bits.trailing_zeros() as usize)
    }

    /// The cells that a facet's box touches.
    #[inline(always)]
    pub fn cells(&self, lane: usize) -> Cells {
        let [columns, rows] = &self.cells;
        let of = |[first, last]: &[[u32; LANES]; 2]| [first[lane] as usize, last[lane] as usize];
        Cells { columns: of(columns), rows: of(rows) }
    }

    /// The forms of the facets, for rays within their cells.
    ///
    /// Let M be the largest coordinate, L the longest side of the box and two cells more, and η = 2⁻²⁴.
    /// Coordinates err by 1.1·ηM, their differences by 2.2·ηM + ηL, an area by 8.8·ηLM + 8·ηL², and the
    /// third area, which is what the other two leave, by 27·ηLM + 34·ηL²: all by less than
    /// e = 36·ηL(M + L). Where rounding turned the sign of the whole area, a point inside may
    /// show −2e, hence a doubt of 2e. The shares of two corners err by 2e/area each and the
    /// inverse depths by a few η.
    ///
    /// A ray in the plane of a facet passes it by (`facet.rs`), if |d·n| ≤ 10⁻¹⁰·|ab|·|ac|. With depths from z to Z it
    /// is |d·n| ≥ z³/Z·area/(1 + 2M), and an edge is no longer than 1.5·ZL + (Z − z)(1 + 2M).
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
            // One that runs clockwise is turned around.
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
            // Seen edge-on: nothing is sure but that it is no nearer than its nearest corner, and for rays along it
            // not even that it is met.
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
    /// The form of one facet.
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

    /// Whether the facet surely has an area: one that is not seen edge-on and whose corners are not far apart in depth. The
    /// corners of one without area are collinear to 10⁻¹² of its length, at most 200 depths of the farthest,
    /// and its picture can only be wide enough if one corner is 300 times as near as another.
    #[inline(always)]
    pub fn has_area(&self, lane: usize) -> bool {
        self.has_area[lane] == 1
    }
}

/// Cuts numbers into blocks, the last filled up with [`NONE`].
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
