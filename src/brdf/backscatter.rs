//! Laws in exact backscatter as sums of one closed form, for a caller that cannot call a model, such as a
//! graphics processor, or that needs f millions of times.
//!
//! With i = o the half vector is the direction itself, and the wave falls on every facet that answers at
//! normal incidence. The f of a law without a grain then depends on θ alone:
//! f(θ) = Σ level·cosᵃθ·P(tan²θ/m²)/m²·G1(θ)ˢ, where P is exp(−x) for Beckmann's slopes and (1 + x)⁻² for
//! GGX's, and a diffuse term has neither P nor m nor G1. A beam sees the law of the slopes convolved with its own
//! (`slopes.rs`), and so a lobe cosᵃθ with the variance of its own slopes, 1/a, larger by δ²/2.

use std::f64::consts::PI;

use super::slopes::{Distribution, VIEWING_RAD, beckmann, narrow_ggx, wide_ggx};
use crate::lanes::{Wide, exp, ln, widest};

/// A look straight back at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Look {
    /// Divergence of the beam, rad; 0 for none.
    pub beam_rad: f64,
    /// Cosine of the incidence angle.
    pub cos_theta: f64,
}

/// One term of the sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Its level, 1/sr; for facets that of f·m².
    pub level_per_sr: f64,
    /// Exponent a of cos θ.
    pub cosines: f64,
    /// Facets that reflect like mirrors; none for a diffuse term.
    pub facets: Option<Facets>,
}

/// Slopes of facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Facets {
    /// Roughness m; 0 for a smooth mirror, which without a beam is drawn as [`VIEWING_RAD`] wide.
    pub m: f64,
    /// Law of the slopes.
    pub distribution: Distribution,
    /// How often shadowing counts, the exponent s of Smith's G1: 0, 1 or 2.
    pub shadowed: u32,
    /// Whether m is that of the beam and the surface together: the lobe is then not widened again, and is only never
    /// narrower than the beam.
    pub includes_beam: bool,
}

impl Facets {
    /// Roughness of the surface, without the beam of a divergence δ, rad.
    #[inline(always)]
    pub(crate) fn m_without_beam(&self, beam_rad: f64) -> f64 {
        if self.includes_beam {
            let own2 = self.m * self.m - beam_rad * beam_rad;
            if own2 > 0.0 { own2.sqrt() } else { 0.0 }
        } else {
            self.shadowing_m(beam_rad)
        }
    }

    /// Roughness for shadowing.
    #[inline(always)]
    pub(crate) fn shadowing_m(&self, beam_rad: f64) -> f64 {
        if self.m == 0.0 && beam_rad == 0.0 { VIEWING_RAD } else { self.m }
    }
}

impl Term {
    /// level·cosᵃθ.
    pub(super) fn diffuse(level_per_sr: f64, cosines: f64) -> Term {
        Term { level_per_sr, cosines, facets: None }
    }

    /// R·D·G/(4·cos²θ), for the reflectance R at normal incidence. In D and in front of it are cos⁻⁶θ.
    pub(super) fn mirrors(reflectance: f64, facets: Facets) -> Term {
        Term { level_per_sr: reflectance / (4.0 * PI), cosines: -6.0, facets: Some(facets) }
    }

    /// Share of it, 0 to 1, that comes back in one phase to a beam of a divergence, rad: all of a mirror, whose lobe is the
    /// beam's.
    #[inline(always)]
    pub(crate) fn coherent_share(&self, beam_rad: f64) -> f64 {
        match self.facets {
            None => 0.0,
            Some(facets) if facets.includes_beam || facets.m == 0.0 => 1.0,
            Some(facets) => {
                let [beam2, m2] = [beam_rad, facets.m].map(|width_rad| width_rad * width_rad);
                beam2 / (m2 + beam2)
            }
        }
    }

    /// Its part of f, 1/sr; zero at grazing incidence.
    pub(crate) fn per_sr(&self, look: Look) -> f64 {
        let mut f_per_sr = [0.0];
        self.add_per_sr(&[look], &mut f_per_sr);
        f_per_sr[0]
    }

    /// As [`per_sr`](Self::per_sr), of each look, in vector instructions.
    pub(crate) fn per_sr_of_each(&self, looks: &[Look]) -> Vec<f64> {
        let mut f_per_sr = vec![0.0; looks.len()];
        widest(Sum { terms: std::slice::from_ref(self), looks, f_per_sr: &mut f_per_sr });
        f_per_sr
    }

    /// Adds its part of f, 1/sr, of each look.
    #[inline(always)]
    pub(super) fn add_per_sr(&self, looks: &[Look], f_per_sr: &mut [f64]) {
        let all = looks.iter().zip(&mut *f_per_sr);
        match self.facets {
            None => all.for_each(|(look, f)| *f += self.of_cosines(look)),
            Some(facets) => match facets.distribution {
                Distribution::Beckmann => {
                    all.for_each(|(look, f)| *f += self.of_facets(&facets, look, beckmann));
                }
                // The two add up to the law: each is 0 where the other holds.
                Distribution::Ggx => {
                    all.for_each(|(look, f)| *f += self.of_facets(&facets, look, narrow_ggx));
                    for (look, f) in looks.iter().zip(f_per_sr) {
                        *f += self.of_facets(&facets, look, wide_ggx);
                    }
                }
            },
        }
    }

    #[inline(always)]
    fn of_cosines(&self, look: &Look) -> f64 {
        let (cosines, share) = seen_cosines(self.cosines, look.beam_rad);
        let lobe = self.level_per_sr * share * exp(cosines * ln(look.cos_theta));
        if look.cos_theta > GRAZING { lobe } else { 0.0 }
    }

    /// The part of facets whose slopes have a density, of s², m² and δ².
    #[inline(always)]
    fn of_facets(
        &self,
        facets: &Facets,
        look: &Look,
        density: impl Fn(f64, f64, f64) -> f64,
    ) -> f64 {
        let Look { beam_rad, cos_theta } = *look;
        let inverse2 = 1.0 / (cos_theta * cos_theta);
        let m = facets.m_without_beam(beam_rad);
        let density = density(inverse2 - 1.0, m * m, beam_rad * beam_rad);
        let power = if self.cosines == -6.0 {
            inverse2 * inverse2 * inverse2
        } else {
            exp(self.cosines * ln(cos_theta))
        };
        let g1 = facets.distribution.g1(cos_theta, facets.shadowing_m(beam_rad));
        let shadowing = match facets.shadowed {
            0 => 1.0,
            1 => g1,
            _ => g1 * g1,
        };
        let part = self.level_per_sr * PI * density * power * shadowing;
        if cos_theta > GRAZING { part } else { 0.0 }
    }
}

/// The sum of terms for many looks.
pub(super) struct Sum<'a> {
    pub terms: &'a [Term],
    pub looks: &'a [Look],
    pub f_per_sr: &'a mut [f64],
}

impl Wide for Sum<'_> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        for term in self.terms {
            term.add_per_sr(self.looks, self.f_per_sr);
        }
    }
}

/// The exponent of a lobe cosᵃ of the half vector as a beam sees it, and its level over that of the lobe. The lobe is
/// near a Gaussian of slopes with m² = 2/a, to which δ² is added. That is the convolution within 0.06 dB down to 37 dB below
/// the peak, for a beam up to a quarter as wide as the lobe. A lobe that is wider than the beam by a factor of 100 is
/// seen as it is.
#[inline(always)]
pub(super) fn seen_cosines(cosines: f64, beam_rad: f64) -> (f64, f64) {
    let widened = 0.5 * cosines * beam_rad * beam_rad;
    let share = if widened < UNSEEN { 1.0 } else { 1.0 / (1.0 + widened) };
    (cosines * share, share)
}

/// δ²/m² below which a beam changes f by less than this share.
pub(super) const UNSEEN: f64 = 1e-4;

/// Cosine of the angle from the normal below which powers of it overflow.
pub(super) const GRAZING: f64 = 1e-6;

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::units::db_from_ratio;

    /// ∫ cosᵃ(s′)·K(s − s′) d²s′ over slopes about s, in polar coordinates by the midpoint rule.
    fn convolved(cosines: f64, slope: f64, beam_rad: f64) -> f64 {
        let (rings, turns) = (400, 180);
        let width = 7.0 * beam_rad / f64::from(rings);
        let mut sum = 0.0;
        for ring in 0..rings {
            let r = (f64::from(ring) + 0.5) * width;
            let kernel = (-(r / beam_rad).powi(2)).exp() / (PI * beam_rad * beam_rad);
            for turn in 0..turns {
                let azimuth = (f64::from(turn) + 0.5) * TAU / f64::from(turns);
                let slope2 = r * r + slope * slope - 2.0 * r * slope * azimuth.cos();
                let lobe = (1.0 + slope2).powf(-0.5 * cosines);
                sum += kernel * lobe * r * width * TAU / f64::from(turns);
            }
        }
        sum
    }

    #[test]
    fn a_lobe_of_cosines_is_seen_nearly_as_its_convolution() {
        const BEAM_RAD: f64 = 0.0117;
        for cosines in [10.0, 100.0, 1000.0] {
            for widths in [0.0, 1.0, 2.0, 3.0] {
                let slope: f64 = widths * (2.0f64 / cosines).sqrt();
                let (seen, share) = seen_cosines(cosines, BEAM_RAD);
                let found = share * (1.0 + slope * slope).powf(-0.5 * seen);
                let error_db = db_from_ratio(found / convolved(cosines, slope, BEAM_RAD));
                assert!(error_db.abs() < 0.06, "{cosines} {widths}: {error_db} dB");
            }
        }
    }
}
