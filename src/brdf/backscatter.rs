//! Laws in exact backscatter as sums of one closed form, for a caller that cannot call a model, such as a
//! graphics processor, or that needs f millions of times.
//!
//! With i = o the half vector is the direction itself, and the wave falls on every facet that answers at
//! normal incidence. The f of a law without a grain then depends on θ alone:
//! f(θ) = Σ level·cosᵃθ·P(tan²θ/m²)/m²·G1(θ)ˢ, where P is exp(−x) for Beckmann's slopes and (1 + x)⁻² for
//! GGX's, and a diffuse term has neither P nor m nor G1. A beam sees no lobe narrower than itself: its divergence δ
//! takes the place of a smaller m.

use std::f64::consts::PI;

use super::slopes::Distribution;

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
    /// Roughness m.
    pub m: f64,
    /// Law of the slopes.
    pub distribution: Distribution,
    /// How often shadowing counts, the exponent s of Smith's G1: 0, 1 or 2.
    pub shadowed: u32,
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

    /// Its part of f, 1/sr, as a beam of the divergence `beam_rad` sees it; zero at grazing incidence.
    pub(crate) fn per_sr(&self, beam_rad: f64, cos_theta: f64) -> f64 {
        if cos_theta <= GRAZING {
            return 0.0;
        }
        let facets = self.facets.map_or(1.0, |Facets { m, distribution, shadowed }| {
            let m = m.max(beam_rad);
            let x = (1.0 / (cos_theta * cos_theta) - 1.0) / (m * m);
            let law = match distribution {
                Distribution::Beckmann => (-x).exp(),
                Distribution::Ggx => (1.0 + x).powi(-2),
            };
            law / (m * m) * distribution.g1(cos_theta, m).powi(shadowed.cast_signed())
        });
        let whole = self.cosines as i32;
        let cosines = if f64::from(whole) == self.cosines {
            cos_theta.powi(whole)
        } else {
            cos_theta.powf(self.cosines)
        };
        self.level_per_sr * cosines * facets
    }
}

/// Cosine of the angle from the normal below which powers of it overflow.
pub(super) const GRAZING: f64 = 1e-6;
