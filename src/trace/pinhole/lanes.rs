//! Tests one facet against a block of rays in f32, by vector instructions ([`Wide`](crate::lanes::Wide)).

use crate::lanes::least;

/// Rays per block.
pub(super) const LANES: usize = 16;

/// Unit roundoff of f32, 2⁻²⁴.
pub(super) const ROUNDING: f32 = f32::EPSILON / 2.0;

pub(super) type Lanes = [f32; LANES];

/// The linear forms of a facet over (u, v).
///
/// b, c and `area` − b − c are twice the areas of the triangles that a point spans with the edges, all positive for a
/// point inside. The inverse depth, 1/m, is `w` + `w_b`·b + `w_c`·c.
#[derive(Clone, Copy)]
pub(super) struct Form {
    /// The first corner.
    pub at: [f32; 2],
    /// The edges from the first corner to the second, and from the third to the first. Both are reversed if the
    /// facet runs clockwise.
    pub ab: [f32; 2],
    pub ca: [f32; 2],
    /// Twice the area of the facet.
    pub area: f32,
    /// Bound of the rounding of twice an area: one nearer to zero may have either sign.
    pub doubt: f32,
    pub w: f32,
    pub w_b: f32,
    pub w_c: f32,
    /// Bound of the rounding of the inverse depth, 1/m.
    pub w_doubt: f32,
}

/// The forms of a facet at a block of rays.
pub(super) struct FormValues {
    /// The smallest of the three areas, doubled.
    pub least: Lanes,
    /// Inverse depth, 1/m.
    pub w: Lanes,
}

/// The nearest facets so far of a block of rays.
pub(super) struct Nearest<'a> {
    /// Bounds of their inverse depths, 1/m.
    pub low: &'a mut Lanes,
    pub high: &'a mut Lanes,
    pub facet: &'a mut [u32; LANES],
}

impl Form {
    /// Evaluates the forms at a point: the smallest of the three areas, doubled, and the inverse depth, 1/m.
    #[inline(always)]
    fn at(&self, [u, v]: [f32; 2]) -> (f32, f32) {
        let (x, y) = (u - self.at[0], v - self.at[1]);
        let c = self.ab[0] * y - self.ab[1] * x;
        let b = self.ca[0] * y - self.ca[1] * x;
        let a = self.area - b - c;
        (least(a, least(b, c)), self.w + b * self.w_b + c * self.w_c)
    }

    /// Whether the facet may be the nearest of a ray, whose nearest so far has at least the inverse depth `low`.
    #[inline(always)]
    pub fn may_meet(&self, at: [f32; 2], low: f32) -> bool {
        let (least, w) = self.at(at);
        (least >= -self.doubt) & (w + self.w_doubt >= low)
    }

    /// Evaluates the forms at a block, of which the first `count` rays count. `None` if each of these certainly misses
    /// the facet or has a nearer one.
    #[inline(always)]
    pub fn evaluate(&self, u: &Lanes, v: &Lanes, low: &Lanes, count: f32) -> Option<FormValues> {
        let mut values = FormValues { least: [0.0; LANES], w: [0.0; LANES] };
        let mut any = 0;
        for lane in 0..LANES {
            let (least, w) = self.at([u[lane], v[lane]]);
            values.least[lane] = least;
            values.w[lane] = w;
            let maybe = (least >= -self.doubt) & (w + self.w_doubt >= low[lane]);
            any |= u32::from(maybe & ((lane as f32) < count));
        }
        (any != 0).then_some(values)
    }

    /// Records the facet for the rays of which it is certainly the nearest. Returns whether f32 cannot decide others.
    #[inline(always)]
    pub fn record(&self, facet: u32, values: &FormValues, nearest: Nearest, count: f32) -> bool {
        let mut any = 0;
        for lane in 0..LANES {
            let (low, high) = (values.w[lane] - self.w_doubt, values.w[lane] + self.w_doubt);
            let maybe = (values.least[lane] >= -self.doubt)
                & (high >= nearest.low[lane])
                & ((lane as f32) < count);
            let surely = maybe & (values.least[lane] > self.doubt) & (low > nearest.high[lane]);
            nearest.low[lane] = if surely { low } else { nearest.low[lane] };
            nearest.high[lane] = if surely { high } else { nearest.high[lane] };
            nearest.facet[lane] = if surely { facet } else { nearest.facet[lane] };
            any |= u32::from(maybe & !surely);
        }
        any != 0
    }
}
