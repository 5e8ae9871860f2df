//! Laws in exact backscatter as sums of one closed form, for those who cannot call a model, such as a
//! graphics processor, or who ask it millions of times.
//!
//! With i = o the half vector is the direction itself and every facet that answers is met at normal
//! incidence, so that of a law without a grain only θ is left:
//! f(θ) = Σ level·cosᵃθ·P(tan²θ/m²)·G1(θ)ˢ, where P is exp(−x) for Beckmann's slopes and (1 + x)⁻² for
//! GGX's, and a diffuse term has neither P nor G1.

use std::f64::consts::PI;

use super::{Brdf, Distribution, Scattering};
use crate::frames::{Direction, Surface};

/// One term of the sum.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Term {
    /// Its level, 1/sr.
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
    pub(super) fn diffuse(level_per_sr: f64, cosines: f64) -> Term {
        Term { level_per_sr, cosines, facets: None }
    }

    /// R·D·G/(4·cos²θ), for the reflectance R at normal incidence. In D and in front of it are cos⁻⁶θ.
    pub(super) fn mirrors(reflectance: f64, facets: Facets) -> Term {
        let level_per_sr = reflectance / (4.0 * PI * facets.m * facets.m);
        Term { level_per_sr, cosines: -6.0, facets: Some(facets) }
    }

    /// Its part of f, 1/sr; nothing from where the light grazes.
    pub(crate) fn per_sr(&self, cos_theta: f64) -> f64 {
        if cos_theta <= GRAZING {
            return 0.0;
        }
        let facets = self.facets.map_or(1.0, |Facets { m, distribution, shadowed }| {
            let x = (1.0 / (cos_theta * cos_theta) - 1.0) / (m * m);
            let law = match distribution {
                Distribution::Beckmann => (-x).exp(),
                Distribution::Ggx => (1.0 + x).powi(-2),
            };
            law * distribution.g1(cos_theta, m).powi(shadowed.cast_signed())
        });
        let whole = self.cosines as i32;
        let cosines = match f64::from(whole) == self.cosines {
            true => cos_theta.powi(whole),
            false => cos_theta.powf(self.cosines),
        };
        self.level_per_sr * cosines * facets
    }
}

/// A law that is asked for backscatter only, by its closed form where it has one.
pub(crate) struct Retro<'a> {
    law: &'a Brdf,
    terms: Option<Vec<Term>>,
}

impl<'a> Retro<'a> {
    pub(crate) fn new(law: &'a Brdf) -> Retro<'a> {
        Retro { law, terms: law.backscatter() }
    }

    /// f back to where the light comes from, 1/sr.
    pub(crate) fn per_sr(&self, to_radar: Direction<Surface>) -> f64 {
        let cos_theta = to_radar.cos_theta();
        match &self.terms {
            Some(terms) if cos_theta > GRAZING => {
                terms.iter().map(|term| term.per_sr(cos_theta)).sum()
            }
            _ => self.law.f_per_sr(to_radar, to_radar),
        }
    }
}

/// Cosine of the angle from the normal below which powers of it overflow.
const GRAZING: f64 = 1e-6;

/// The terms of weighted parts that add up in power; none when one of them has none.
pub(super) fn together<'a>(parts: impl Iterator<Item = (f64, &'a Brdf)>) -> Option<Vec<Term>> {
    let mut all = Vec::new();
    for (weight, part) in parts {
        let weighed = |term: Term| Term { level_per_sr: weight * term.level_per_sr, ..term };
        all.extend(part.backscatter()?.into_iter().map(weighed));
    }
    Some(all)
}

#[cfg(test)]
mod tests {
    use super::super::tests::every_model;
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    #[test]
    fn the_sum_is_the_law() {
        let mut told = 0;
        for model in every_model() {
            let retro = Retro::new(&model);
            told += usize::from(retro.terms.is_some());
            for theta_rad in [0.0f64, 0.02, 0.1, 0.4, 0.9, 1.3, 1.55, FRAC_PI_2, 2.0] {
                let direction = Direction::from_angles(theta_rad, 0.7);
                let found = retro.per_sr(direction);
                let expected = model.f_per_sr(direction, direction);
                let error = (found - expected).abs();
                assert!(error <= 1e-9 * expected, "{model:?} at {theta_rad}: {found} {expected}");
            }
        }
        assert!(told >= 10, "{told}");
    }

    #[test]
    fn what_has_a_grain_or_no_closed_form_has_no_terms() {
        let without = every_model().into_iter().filter(|model| model.backscatter().is_none());
        for model in without {
            let known = match &model {
                Brdf::CookTorrance(model) => model.m_across.is_some(),
                // It holds a table.
                Brdf::Sum(_) => true,
                Brdf::Tabulated(_) | Brdf::Kirchhoff(_) | Brdf::Directive(_) => true,
                _ => false,
            };
            assert!(known, "{model:?}");
        }
        let own = |_: Direction<Surface>, _: Direction<Surface>| 1.0;
        assert!(own.backscatter().is_none());
    }
}
