//! A model that is asked for backscatter only: by its closed form where it has one.

use super::backscatter::{GRAZING, Term};
use super::models::Brdf;
use super::scattering::Scattering;
use crate::frames::{Direction, Surface};

/// A model and the terms of its backscatter.
pub(crate) struct Retro<'a> {
    law: &'a Brdf,
    terms: Option<Vec<Term>>,
}

impl<'a> Retro<'a> {
    pub(crate) fn new(law: &'a Brdf) -> Retro<'a> {
        Retro { law, terms: law.backscatter() }
    }

    /// f in exact backscatter towards the radar, 1/sr, as a beam of the divergence `beam_rad` sees it.
    pub(crate) fn per_sr(&self, beam_rad: f64, to_radar: Direction<Surface>) -> f64 {
        let cos_theta = to_radar.cos_theta();
        match &self.terms {
            Some(terms) if cos_theta > GRAZING => {
                terms.iter().map(|term| term.per_sr(beam_rad, cos_theta)).sum()
            }
            _ => self.law.seen_by(beam_rad, to_radar, to_radar).f_per_sr,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::brdf::models::tests::every_model;
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
                let own = model.f_per_sr(direction, direction);
                for beam_rad in [0.0, 0.012, 0.3] {
                    let found = retro.per_sr(beam_rad, direction);
                    let expected = model.seen_by(beam_rad, direction, direction).f_per_sr;
                    let error = (found - expected).abs();
                    assert!(
                        error <= 1e-9 * expected,
                        "{model:?} at {theta_rad}: {found} {expected}"
                    );
                    assert!(beam_rad > 0.0 || (own - expected).abs() <= 1e-12 * own, "{model:?}");
                }
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
