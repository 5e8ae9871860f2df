//! A law that is asked for backscatter only: by its closed form in vector instructions, where it has one.

use super::backscatter::{GRAZING, Look, Sum, Term};
use super::scattering::{Scattering, Seen};
use crate::frames::{Direction, Surface};
use crate::lanes::{Wide, widest};

/// A law and the terms of its backscatter.
pub(crate) struct Retro<'a> {
    law: &'a dyn Scattering,
    terms: Option<Vec<Term>>,
}

impl<'a> Retro<'a> {
    pub(crate) fn new(law: &'a dyn Scattering) -> Retro<'a> {
        Retro { law, terms: law.backscatter() }
    }

    /// f in exact backscatter, 1/sr, of each direction to the radar with the divergence, rad, of the beam along it.
    pub(crate) fn per_sr(&self, to_radar: &[(f64, Direction<Surface>)]) -> Vec<f64> {
        let Some(terms) = &self.terms else {
            return to_radar.iter().map(|look| self.alone(look).f_per_sr).collect();
        };
        let looks = looks(to_radar);
        let mut f_per_sr = vec![0.0; looks.len()];
        widest(Sum { terms, looks: &looks, f_per_sr: &mut f_per_sr });
        for (f_per_sr, look) in f_per_sr.iter_mut().zip(to_radar) {
            if look.1.cos_theta() <= GRAZING {
                *f_per_sr = self.alone(look).f_per_sr;
            }
        }
        f_per_sr
    }

    /// What a beam sees in exact backscatter, of each direction to the radar with the divergence, rad, of the beam along it.
    pub(crate) fn seen(&self, to_radar: &[(f64, Direction<Surface>)]) -> Vec<Seen> {
        let Some(terms) = &self.terms else {
            return to_radar.iter().map(|look| self.alone(look)).collect();
        };
        let looks = looks(to_radar);
        let mut parts = Parts::of(looks.len());
        widest(Split { terms, looks: &looks, parts: &mut parts });
        let of_looks = to_radar.iter().enumerate().map(|(place, look)| {
            if look.1.cos_theta() > GRAZING { parts.seen(place) } else { self.alone(look) }
        });
        of_looks.collect()
    }

    /// What a beam sees in one direction, by the law itself.
    fn alone(&self, &(beam_rad, v): &(f64, Direction<Surface>)) -> Seen {
        self.law.seen_by(beam_rad, v, v)
    }
}

fn looks(to_radar: &[(f64, Direction<Surface>)]) -> Vec<Look> {
    let looks = to_radar.iter().map(|&(beam_rad, v)| Look { beam_rad, cos_theta: v.cos_theta() });
    looks.collect()
}

/// f of many looks, 1/sr, and the parts of it that are specular and coherent.
struct Parts {
    all: Vec<f64>,
    specular: Vec<f64>,
    coherent: Vec<f64>,
    /// One term's part.
    of_term: Vec<f64>,
}

impl Parts {
    fn of(looks: usize) -> Parts {
        let [all, specular, coherent, of_term] = [(); 4].map(|()| vec![0.0; looks]);
        Parts { all, specular, coherent, of_term }
    }

    fn seen(&self, place: usize) -> Seen {
        let f_per_sr = self.all[place];
        let [specular_share, coherent_share] = [&self.specular, &self.coherent]
            .map(|parts| if f_per_sr > 0.0 { parts[place] / f_per_sr } else { 0.0 });
        Seen { f_per_sr, specular_share, coherent_share }
    }
}

/// The sums of terms for many looks.
struct Split<'a> {
    terms: &'a [Term],
    looks: &'a [Look],
    parts: &'a mut Parts,
}

impl Wide for Split<'_> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        let Parts { all, specular, coherent, of_term } = self.parts;
        for term in self.terms {
            of_term.fill(0.0);
            term.add_per_sr(self.looks, of_term);
            add(all, of_term);
            if term.facets.is_some() {
                add(specular, of_term);
                for ((sum, part), look) in coherent.iter_mut().zip(&*of_term).zip(self.looks) {
                    *sum += part * term.coherent_share(look.beam_rad);
                }
            }
        }
    }
}

#[inline(always)]
fn add(sums: &mut [f64], parts: &[f64]) {
    for (sum, part) in sums.iter_mut().zip(parts) {
        *sum += part;
    }
}

#[cfg(test)]
mod tests {
    use crate::brdf::models::Brdf;
    use crate::brdf::models::tests::every_model;
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use crate::lanes::at_most;
    use crate::units::db_from_ratio;

    /// Angles and beams over the whole range, from the normal to below the horizon.
    fn looks() -> Vec<(f64, Direction<Surface>)> {
        let dense = (0..800).map(|step| FRAC_PI_2 * (f64::from(step) / 799.0).powi(2));
        let angles = dense.chain([1e-9, 1.55, FRAC_PI_2 - 1e-7, 2.0]);
        let beams = [0.0, 1e-3, 0.0058, 0.0117, 0.3];
        let all = angles
            .flat_map(|theta| beams.map(|beam_rad| (beam_rad, Direction::from_angles(theta, 0.7))));
        all.collect()
    }

    /// f of a model by itself, the oracle.
    fn expected(model: &Brdf) -> Vec<f64> {
        let seen = |(beam_rad, v): (f64, _)| model.seen_by(beam_rad, v, v).f_per_sr;
        looks().into_iter().map(seen).collect()
    }

    #[test]
    fn the_parts_are_those_of_the_law() {
        let mut compared = 0;
        for model in every_model().into_iter().filter(|model| model.backscatter().is_some()) {
            for (found, (beam_rad, v)) in Retro::new(&model).seen(&looks()).iter().zip(looks()) {
                let expected = model.seen_by(beam_rad, v, v);
                let near = (found.f_per_sr - expected.f_per_sr).abs() <= 1e-9 * expected.f_per_sr;
                if expected.f_per_sr < NOTHING {
                    continue;
                }
                let apart = [
                    found.specular_share - expected.specular_share,
                    found.coherent_share - expected.coherent_share,
                ];
                assert!(
                    near && apart.iter().all(|apart| apart.abs() < 1e-9),
                    "{model:?} at {beam_rad} {v:?}: {found:?} {expected:?}"
                );
                compared += 1;
            }
        }
        assert!(compared > 10_000, "{compared}");
    }

    /// Levels below any receiver's, where f of a narrow lobe underflows.
    const NOTHING: f64 = 1e-200;

    #[test]
    fn the_sum_is_the_law() {
        let mut told = 0;
        for model in every_model() {
            let retro = Retro::new(&model);
            told += usize::from(retro.terms.is_some());
            let found = retro.per_sr(&looks());
            for ((found, expected), look) in found.iter().zip(expected(&model)).zip(looks()) {
                let error = (found - expected).abs();
                let near = error <= 1e-9 * expected || error < NOTHING;
                assert!(near, "{model:?} at {look:?}: {found} {expected}");
            }
        }
        assert!(told >= 10, "{told}");
    }

    /// 1e-4 dB is what a caller is promised; the sum of closed forms is far nearer.
    #[test]
    fn a_law_of_any_parameters_is_within_a_ten_thousandth_of_a_decibel() {
        let (mut worst_db, mut compared) = (0.0f64, 0);
        for mut model in every_model() {
            for share in [0.0, 0.07, 0.5, 0.93, 1.0] {
                for parameter in model.parameters() {
                    let value = parameter.min + share * (parameter.max - parameter.min);
                    model.set_parameter(&parameter.path, value);
                }
                let found = Retro::new(&model).per_sr(&looks());
                for (found, expected) in found.iter().zip(expected(&model)) {
                    if expected > NOTHING && expected.is_finite() {
                        worst_db = worst_db.max(db_from_ratio(found / expected).abs());
                        compared += 1;
                    }
                }
            }
        }
        assert!(worst_db < 1e-6 && compared > 50_000, "{worst_db} dB, {compared}");
    }

    #[test]
    fn every_width_gives_the_same_bits() {
        for model in every_model() {
            let retro = Retro::new(&model);
            let bits = |width| {
                let (f_per_sr, seen) =
                    at_most(width, || (retro.per_sr(&looks()), retro.seen(&looks())));
                let parts = seen
                    .iter()
                    .flat_map(|seen| [seen.f_per_sr, seen.specular_share, seen.coherent_share]);
                f_per_sr.into_iter().chain(parts).map(f64::to_bits).collect::<Vec<u64>>()
            };
            let [plain, of_256, of_512] = [128, 256, 512].map(bits);
            assert!(plain == of_256 && plain == of_512, "{model:?}");
        }
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
