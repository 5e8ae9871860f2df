//! Laws of the slopes of facets and Smith's shadowing for them: D and G1 of Walter et al. (EGSR 2007); and how a
//! beam sees their lobe.
//!
//! A beam of the divergence δ meets every slope with the weight K(s) = exp(−s²/δ²)/(π·δ²) about its own, so that it
//! sees the law convolved with K. Beckmann's law of the roughness m becomes that of √(m² + δ²). GGX's has no
//! variance that δ² could be added to; but it is a mixture of Beckmann's laws,
//! P_GGX(s) = ∫₀^∞ e^{−t}·P_Beckmann(s; m²/t) dt, and each of them widens by itself:
//! ∫₀^∞ e^{−t}·P_Beckmann(s; m²/t + δ²) dt. Shadowing depends on the surface alone and keeps m.

use std::f64::consts::PI;
use std::sync::LazyLock;

use glam::DVec2;
use serde::{Deserialize, Serialize};

use crate::frames::{Direction, Surface};
use crate::lanes::exp;

/// Width at which a smooth mirror, a delta in direction, is drawn where no radar looks at it: the divergence δ₀, rad,
/// of the default radar's beam, 0.0117 rad.
pub const VIEWING_RAD: f64 = 0.0117;

/// Law of the facet slopes, D(h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// Gaussian slopes: D = exp(−tan²θ/m²) / (π m² cos⁴θ).
    #[default]
    Beckmann,
    /// Longer tails: D = m² / (π cos⁴θ (m² + tan²θ)²).
    Ggx,
}

impl Distribution {
    /// D(h), facet normals per steradian, normalised so that ∫ D cos θ_h dω_h = 1.
    pub fn d_per_sr(self, cos_theta: f64, m: f64) -> f64 {
        if cos_theta <= 0.0 {
            return 0.0;
        }
        let cos2 = cos_theta * cos_theta;
        self.density((1.0 - cos2).max(0.0) / cos2, m * m, 0.0) / (cos2 * cos2)
    }

    /// D(h) with a roughness along x and one along y, normalised alike.
    pub fn d_anisotropic_per_sr(self, h: Direction<Surface>, m: [f64; 2]) -> f64 {
        self.d_seen_per_sr(h, m, SlopeMatrix::default())
    }

    /// D(h) with a roughness along x and one along y, convolved with the slopes of a beam.
    pub(super) fn d_seen_per_sr(
        self,
        h: Direction<Surface>,
        [m_x, m_y]: [f64; 2],
        beam: SlopeMatrix,
    ) -> f64 {
        if h.cos_theta() <= 0.0 {
            return 0.0;
        }
        let slope = h.xyz().truncate() / h.cos_theta();
        let density = if m_x == m_y && beam.is_isotropic() {
            self.density(slope.length_squared(), m_x * m_x, beam.xx)
        } else {
            let surface = SlopeMatrix { xx: m_x * m_x, xy: 0.0, yy: m_y * m_y };
            match self {
                Distribution::Beckmann => beam.plus(surface, 1.0).gaussian(slope).density,
                Distribution::Ggx if beam == SlopeMatrix::default() => {
                    (1.0 + surface.gaussian(slope).exponent).powi(-2) / (PI * m_x * m_y)
                }
                Distribution::Ggx => mixture(|t| beam.plus(surface, 1.0 / t).gaussian(slope)),
            }
        };
        density / h.cos_theta().powi(4)
    }

    /// Density of slopes at a slope squared, for m² and a beam's δ²; its integral over all slopes is 1.
    #[inline(always)]
    pub(super) fn density(self, slope2: f64, m2: f64, beam2: f64) -> f64 {
        match self {
            Distribution::Beckmann => beckmann(slope2, m2, beam2),
            Distribution::Ggx => narrow_ggx(slope2, m2, beam2) + wide_ggx(slope2, m2, beam2),
        }
    }

    /// Smith's G1: the share of facets that a direction sees, 0 to 1; 1 without roughness.
    ///
    /// Beckmann uses Walter's rational approximation (relative error below 0.35 %).
    #[inline(always)]
    pub fn g1(self, cos_theta: f64, m: f64) -> f64 {
        let sin2 = 1.0 - cos_theta * cos_theta;
        let tan = (if sin2 > 0.0 { sin2 } else { 0.0 }).sqrt() / cos_theta;
        let seen = match self {
            Distribution::Beckmann => {
                let a = 1.0 / (m * tan);
                let shadowed = (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a);
                if a >= 1.6 { 1.0 } else { shadowed }
            }
            Distribution::Ggx => 2.0 / (1.0 + (1.0 + (m * tan) * (m * tan)).sqrt()),
        };
        if cos_theta > 0.0 { seen } else { 0.0 }
    }
}

/// A symmetric matrix M of slopes squared: a Gaussian lobe falls as exp(−sᵀM⁻¹s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SlopeMatrix {
    xx: f64,
    xy: f64,
    yy: f64,
}

impl SlopeMatrix {
    /// What a beam of the divergence δ adds to the lobe about the half vector of i and o. In their plane it is δ²: half
    /// of an angle between directions is that between half vectors. Across the plane it is δ²/cos²ψ, for a facet
    /// that the wave meets at ψ. In backscatter both are δ².
    pub(super) fn of_beam(
        beam_rad: f64,
        i: Direction<Surface>,
        o: Direction<Surface>,
    ) -> SlopeMatrix {
        let along2 = beam_rad * beam_rad;
        let plane = (o.xyz() - i.xyz()).truncate().try_normalize();
        let Some(plane) = plane.filter(|_| along2 > 0.0) else {
            return SlopeMatrix { xx: along2, xy: 0.0, yy: along2 };
        };
        let cos2_psi = 0.5 * (1.0 + i.xyz().dot(o.xyz())).max(f64::EPSILON);
        let across2 = along2 / cos2_psi;
        let more = along2 - across2;
        SlopeMatrix {
            xx: across2 + more * plane.x * plane.x,
            xy: more * plane.x * plane.y,
            yy: across2 + more * plane.y * plane.y,
        }
    }

    fn is_isotropic(self) -> bool {
        self.xx == self.yy && self.xy == 0.0
    }

    fn plus(self, other: SlopeMatrix, times: f64) -> SlopeMatrix {
        SlopeMatrix {
            xx: self.xx + times * other.xx,
            xy: self.xy + times * other.xy,
            yy: self.yy + times * other.yy,
        }
    }

    fn gaussian(self, slope: DVec2) -> Gaussian {
        let determinant = self.xx * self.yy - self.xy * self.xy;
        let adjugate = self.yy * slope.x * slope.x + self.xx * slope.y * slope.y
            - 2.0 * self.xy * slope.x * slope.y;
        Gaussian::new(adjugate / determinant, determinant.sqrt())
    }
}

/// A Gaussian law of slopes at one slope.
struct Gaussian {
    /// sᵀM⁻¹s.
    exponent: f64,
    /// exp(−sᵀM⁻¹s)/(π·√det M).
    density: f64,
}

impl Gaussian {
    #[inline(always)]
    fn new(exponent: f64, root_determinant: f64) -> Gaussian {
        Gaussian { exponent, density: exp(-exponent) / (PI * root_determinant) }
    }
}

/// The density of Beckmann's slopes, for s², m² and a beam's δ².
#[inline(always)]
pub(super) fn beckmann(slope2: f64, m2: f64, beam2: f64) -> f64 {
    isotropic(slope2, m2 + beam2).density
}

/// The density of GGX's slopes seen by a beam so narrow that a series is good; 0 seen by another.
#[inline(always)]
pub(super) fn narrow_ggx(slope2: f64, m2: f64, beam2: f64) -> f64 {
    let inverse = 1.0 / (m2 + slope2);
    let (plain, small) = (m2 * inverse * inverse / PI, beam2 * inverse);
    if small <= MOST_OF_SERIES { plain * ggx_series(small, slope2 * inverse) } else { 0.0 }
}

/// The density of GGX's slopes seen by a beam that is not so narrow; 0 seen by one that is.
#[inline(always)]
pub(super) fn wide_ggx(slope2: f64, m2: f64, beam2: f64) -> f64 {
    if beam2 * (1.0 / (m2 + slope2)) <= MOST_OF_SERIES {
        return 0.0;
    }
    mixture(|t| isotropic(slope2, m2 / t + beam2))
}

#[inline(always)]
fn isotropic(slope2: f64, m2: f64) -> Gaussian {
    Gaussian::new(slope2 / m2, m2)
}

/// δ²/(m² + s²) up to which the series for GGX's law is good to 5e-4.
const MOST_OF_SERIES: f64 = 0.03;

/// GGX's law convolved over the law itself, where small = δ²/(m² + s²) is small and steep = s²/(m² + s²): the terms
/// (−small)ⁿ Σₖ (n choose k)·(−steep)ᵏ·(n + k + 1)!/k! up to n = 3, from Laguerre's generating function.
#[inline(always)]
fn ggx_series(small: f64, steep: f64) -> f64 {
    let first = 2.0 - 6.0 * steep;
    let second = 6.0 + steep * (60.0 * steep - 48.0);
    let third = 24.0 + steep * (steep * (1080.0 - 840.0 * steep) - 360.0);
    1.0 - small * (first - small * (second - small * third))
}

/// Step of ln t in the sum over GGX's mixture, which is then good to 5e-4.
const STEP_LN: f64 = 0.8;
/// Largest t: e^{−t}·t² is negligible beyond it.
const MOST_T: f64 = 14.0;
/// Smallest t: that of slopes of 100 over a roughness of 0.001.
const STEPS: usize = 32;

/// Every t of the sum with its weight e^{−t}·dt.
pub(super) static SLOPE_NODES: LazyLock<[(f64, f64); STEPS]> = LazyLock::new(|| {
    std::array::from_fn(|step| {
        let t = MOST_T * (-STEP_LN * step as f64).exp();
        (t, (-t).exp() * t * STEP_LN)
    })
});

/// ∫₀^∞ e^{−t}·P(t) dt by the trapezoidal rule in ln t, from large t down.
fn mixture(of_t: impl Fn(f64) -> Gaussian) -> f64 {
    let mut sum = 0.0;
    for (t, weight) in *SLOPE_NODES {
        let gaussian = of_t(t);
        let term = weight * gaussian.density;
        sum += term;
        if is_negligible(gaussian.exponent, term, sum) {
            break;
        }
    }
    sum
}

/// Whether what follows a term of the sum adds nothing to it. Once the exponential has become flat, every term is a fifth of
/// the one before.
#[inline(always)]
pub(super) fn is_negligible(exponent: f64, term: f64, sum: f64) -> bool {
    (exponent < 0.5) & (term < 1e-4 * sum)
}

/// ∫₀^∞ e^{−t}·f(t) dt of a function that changes over factors of t.
pub(super) fn over_exponential(of_t: impl Fn(f64) -> f64) -> f64 {
    SLOPE_NODES.iter().map(|&(t, weight)| weight * of_t(t)).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::units::db_from_ratio;

    /// ∫ P(s′)·K(s − s′) d²s′ in polar coordinates about s by the midpoint rule.
    fn convolved(law: Distribution, slope: f64, m: f64, beam_rad: f64) -> f64 {
        let (rings, turns) = (1500, 720);
        let reach = 7.0 * beam_rad;
        let width = reach / f64::from(rings);
        let mut sum = 0.0;
        for ring in 0..rings {
            let r = (f64::from(ring) + 0.5) * width;
            let kernel = (-(r / beam_rad).powi(2)).exp() / (PI * beam_rad * beam_rad);
            for turn in 0..turns {
                let angle = (f64::from(turn) + 0.5) * TAU / f64::from(turns);
                let slope2 = r * r + slope * slope - 2.0 * r * slope * angle.cos();
                sum +=
                    kernel * law.density(slope2, m * m, 0.0) * r * width * TAU / f64::from(turns);
            }
        }
        sum
    }

    #[test]
    fn a_lobe_is_seen_convolved_with_the_beam() {
        for law in [Distribution::Beckmann, Distribution::Ggx] {
            for (m, beam_rad) in
                [(0.002f64, 0.0117), (0.01, 0.0117), (0.03, 0.0117), (0.08, 0.0117), (0.2, 0.05)]
            {
                for slope in [0.0, 0.5, 1.0, 2.0, 3.0, 6.0, 15.0].map(|s| s * m.max(beam_rad)) {
                    let expected = convolved(law, slope, m, beam_rad);
                    if expected < 1e-12 / (m * m) {
                        continue;
                    }
                    let found = law.density(slope * slope, m * m, beam_rad * beam_rad);
                    let error_db = db_from_ratio(found / expected);
                    assert!(error_db.abs() < 0.01, "{law:?} {m} {beam_rad} {slope}: {error_db} dB");
                }
            }
        }
    }

    /// The law by itself where the beam is far narrower, and the beam's Gaussian where it is far wider.
    #[test]
    fn the_mixture_has_both_limits() {
        for slope in [0.0, 0.05, 0.1, 0.3, 2.0, 50.0] {
            let plain = Distribution::Ggx.density(slope * slope, 0.01, 0.0);
            let mixed = mixture(|t| isotropic(slope * slope, 0.01 / t));
            assert!((mixed / plain - 1.0).abs() < 1e-3, "{slope}: {}", mixed / plain);
            let seen = Distribution::Ggx.density(slope * slope, 0.01, 1e-7);
            assert!((seen / plain - 1.0).abs() < 1e-4, "{slope}");
        }
        for slope in [0.0, 0.01, 0.02] {
            let beam = isotropic(slope * slope, 1e-4).density;
            let seen = Distribution::Ggx.density(slope * slope, 1e-10, 1e-4);
            assert!((seen / beam - 1.0).abs() < 1e-3, "{slope}: {}", seen / beam);
        }
    }

    /// ∫ D cos θ_h dω_h over slopes: what a beam widens stays a density, also with a grain and seen from the side.
    #[test]
    fn what_is_seen_stays_normalised() {
        let i = Direction::from_angles(0.9, 0.3);
        let o = Direction::from_angles(0.7, 2.9);
        for law in [Distribution::Beckmann, Distribution::Ggx] {
            for m in [[0.1, 0.1], [0.05, 0.2]] {
                let beam = SlopeMatrix::of_beam(0.1, i, o);
                let (rings, turns) = (4000, 90);
                let mut sum = 0.0;
                for ring in 0..rings {
                    // Slopes to 200 in equal steps of the logarithm.
                    let (low, high) = ((1e-4f64).ln(), 200f64.ln());
                    let step = (high - low) / f64::from(rings);
                    let s = (low + (f64::from(ring) + 0.5) * step).exp();
                    for turn in 0..turns {
                        let azimuth = (f64::from(turn) + 0.5) * TAU / f64::from(turns);
                        let h = Direction::from_angles(s.atan(), azimuth);
                        let density = law.d_seen_per_sr(h, m, beam) * h.cos_theta().powi(4);
                        sum += density * s * s * step * TAU / f64::from(turns);
                    }
                }
                assert!((sum - 1.0).abs() < 2e-3, "{law:?} {m:?}: {sum}");
            }
        }
    }

    /// The two forms of one law meet.
    #[test]
    fn the_matrix_of_equal_axes_is_the_isotropic_law() {
        let i = Direction::from_angles(0.3, 0.4);
        let nearly = [0.05, 0.05 * (1.0 + 1e-9)];
        for law in [Distribution::Beckmann, Distribution::Ggx] {
            let seen = |m| law.d_seen_per_sr(i, m, SlopeMatrix::of_beam(0.0117, i, i));
            assert!((seen(nearly) / seen([0.05; 2]) - 1.0).abs() < 2e-3, "{law:?}");
        }
    }
}
