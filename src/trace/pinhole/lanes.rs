//! One facet against a block of rays, in f32 and side by side.
//!
//! Plain loops over arrays of fixed length, which become vector instructions ([`Wide`](crate::trace::wide::Wide)).

use crate::trace::wide::least;

/// Rays of a block.
pub(super) const LANES: usize = 16;

/// Unit roundoff of f32, 2⁻²⁴.
pub(super) const ROUNDING: f32 = f32::EPSILON / 2.0;

pub(super) type Lanes = [f32; LANES];

/// A facet as linear forms over (u, v).
///
/// Twice the areas that a point spans with the edges are b, c and `area` − b − c, all positive
/// inside; the inverse depth, 1/m, is `w` + `w_b`·b + `w_c`·c.
#[derive(Clone, Copy)]
pub(super) struct Form {
    /// The first corner.
    pub at: [f32; 2],
    /// The edges from the first corner to the second and from the third to it; both turned around
    /// when the facet runs clockwise.
    pub ab: [f32; 2],
    pub ca: [f32; 2],
    pub area: f32,
    /// An area nearer to zero than this may have either sign.
    pub doubt: f32,
    pub w: f32,
    pub w_b: f32,
    pub w_c: f32,
    /// The inverse depth is good to this, 1/m.
    pub w_doubt: f32,
}

/// What a block of rays sees of a facet.
pub(super) struct Seen {
    /// The least of the three areas.
    pub least: Lanes,
    /// Inverse depth, 1/m.
    pub w: Lanes,
}

/// The nearest so far of a block of rays.
pub(super) struct Nearest<'a> {
    /// Bounds of the inverse depth, 1/m.
    pub low: &'a mut Lanes,
    pub high: &'a mut Lanes,
    pub facet: &'a mut [u32; LANES],
}

impl Form {
    /// The least of the three areas that a point spans with the edges, and the inverse depth, 1/m.
    #[inline(always)]
    fn at(&self, [u, v]: [f32; 2]) -> (f32, f32) {
        let (x, y) = (u - self.at[0], v - self.at[1]);
        let c = self.ab[0] * y - self.ab[1] * x;
        let b = self.ca[0] * y - self.ca[1] * x;
        let a = self.area - b - c;
        (least(a, least(b, c)), self.w + b * self.w_b + c * self.w_c)
    }

    /// Whether a ray may meet the facet, and no nearer one: not with certainty the one or the other.
    #[inline(always)]
    pub fn may_meet(&self, at: [f32; 2], low: f32) -> bool {
        let (least, w) = self.at(at);
        (least >= -self.doubt) & (w + self.w_doubt >= low)
    }

    /// The first `count` rays of a block; none when all surely pass beside the facet or meet a nearer one.
    #[inline(always)]
    pub fn see(&self, u: &Lanes, v: &Lanes, low: &Lanes, count: f32) -> Option<Seen> {
        let mut seen = Seen { least: [0.0; LANES], w: [0.0; LANES] };
        let mut any = 0;
        for lane in 0..LANES {
            let (least, w) = self.at([u[lane], v[lane]]);
            seen.least[lane] = least;
            seen.w[lane] = w;
            let maybe = (least >= -self.doubt) & (w + self.w_doubt >= low[lane]);
            any |= u32::from(maybe & ((lane as f32) < count));
        }
        (any != 0).then_some(seen)
    }

    /// Notes where the facet is surely the nearest; true when f32 cannot tell of some rays.
    #[inline(always)]
    pub fn note(&self, facet: u32, seen: &Seen, nearest: Nearest, count: f32) -> bool {
        let mut any = 0;
        for lane in 0..LANES {
            let (low, high) = (seen.w[lane] - self.w_doubt, seen.w[lane] + self.w_doubt);
            let maybe = (seen.least[lane] >= -self.doubt)
                & (high >= nearest.low[lane])
                & ((lane as f32) < count);
            let surely = maybe & (seen.least[lane] > self.doubt) & (low > nearest.high[lane]);
            nearest.low[lane] = if surely { low } else { nearest.low[lane] };
            nearest.high[lane] = if surely { high } else { nearest.high[lane] };
            nearest.facet[lane] = if surely { facet } else { nearest.facet[lane] };
            any |= u32::from(maybe & !surely);
        }
        any != 0
    }
}
