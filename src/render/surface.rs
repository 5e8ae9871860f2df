//! The surfaces of a target: scattering model and grain.

use glam::DVec3;

use super::sheet::Sheet;
use crate::brdf::{Bistatic, Pair, Retro, Scattering, Seen, widening_rad};
use crate::frames::{Direction, Surface as Local};

/// The surface of the facets of one region.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    /// Its scattering model.
    pub scattering: &'a dyn Scattering,
    /// Share of its diffuse return, 0 to 1/2, that comes back across the polarisation that was sent. The law is
    /// what comes back in that polarisation, so that this share adds to it.
    pub depolarised_share: f64,
    /// Width of its narrowest lobe, rad, where its lobes include the beam that saw them, so that no beam widens them again;
    /// none where they are its own. Infinite without a lobe.
    pub seen_lobe_rad: Option<f64>,
    /// Direction of its grain in the global frame, of any length. On a facet it is projected along the normal. Azimuths
    /// count from it, and `m` of an anisotropic model is the roughness along it.
    pub grain: DVec3,
    /// The sheet, where the surface lets a part of the wave through. It then is the scattering model, too.
    pub sheet: Option<&'a Sheet>,
}

impl<'a> Surface<'a> {
    /// A surface with its own lobes, whose grain is the y axis, upwards.
    pub fn new(scattering: &'a dyn Scattering) -> Surface<'a> {
        Surface {
            scattering,
            depolarised_share: 0.0,
            seen_lobe_rad: None,
            grain: DVec3::Y,
            sheet: None,
        }
    }

    /// A sheet whose grain is the y axis, upwards.
    pub fn of_sheet(sheet: &'a Sheet) -> Surface<'a> {
        Surface { sheet: Some(sheet), ..Surface::new(sheet) }
    }

    /// How far a beam of a divergence, rad, widens its lobes, rad.
    pub(super) fn widening_rad(&self, divergence_rad: f64) -> f64 {
        widening_rad(self.seen_lobe_rad, divergence_rad)
    }

    /// What a beam of a divergence, rad, sees of it.
    pub(super) fn seen_by(&self, beam_rad: f64, i: Direction<Local>, o: Direction<Local>) -> Seen {
        let seen = self.scattering.seen_by(beam_rad, i, o);
        if self.seen_lobe_rad.is_none() {
            return seen;
        }
        // The beam has its part in the lobe already, and that part is coherent.
        let widening_rad = self.widening_rad(beam_rad);
        Seen { f_per_sr: self.scattering.seen_by(widening_rad, i, o).f_per_sr, ..seen }
    }

    /// What beams of some divergences, rad, see of it straight back. `retro` is its scattering model.
    pub(super) fn seen_straight_back(
        &self,
        retro: &Retro,
        looks: impl Iterator<Item = (f64, Direction<Local>)>,
    ) -> Vec<Seen> {
        let mut looks: Vec<_> = looks.collect();
        let mut seen = retro.seen(&looks);
        if self.seen_lobe_rad.is_some() {
            looks.iter_mut().for_each(|(beam_rad, _)| *beam_rad = self.widening_rad(*beam_rad));
            for (seen, f_per_sr) in seen.iter_mut().zip(retro.per_sr(&looks)) {
                seen.f_per_sr = f_per_sr;
            }
        }
        seen
    }

    /// What each pair of directions sees of it. `law` is its scattering model.
    pub(super) fn seen_by_each(&self, law: &Bistatic, mut pairs: Vec<Pair>) -> Vec<Seen> {
        let mut seen = law.seen(&pairs);
        if self.seen_lobe_rad.is_some() {
            pairs.iter_mut().for_each(|pair| pair.beam_rad = self.widening_rad(pair.beam_rad));
            for (seen, widened) in seen.iter_mut().zip(law.seen(&pairs)) {
                seen.f_per_sr = widened.f_per_sr;
            }
        }
        seen
    }

    /// Whether it returns a part of an echo in one wave, to a beam of a divergence, rad.
    pub(super) fn has_wave(&self, beam_rad: f64) -> bool {
        let facing = Direction::from_angles(0.0, 0.0);
        self.seen_by(beam_rad, facing, facing).coherent_share > 0.0
    }
}

/// The orientation of the surface at a hit on a target that effects have moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Unit normal, towards the radar.
    pub normal: DVec3,
    /// Azimuth of the radar about it, from the grain of the region, rad.
    pub azimuth_rad: f64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Distribution, Shadowing};

    #[test]
    fn straight_back_many_looks_see_what_each_sees() {
        let rough = CookTorrance {
            f_lambda: 0.3,
            m: 0.05,
            m_across: None,
            distribution: Distribution::Ggx,
            shadowing: Shadowing::Separable,
        };
        let own = |i: Direction<Local>, _| 0.1 * i.cos_theta();
        let seen_before = Surface { seen_lobe_rad: Some(0.05), ..Surface::new(&rough) };
        for surface in [Surface::new(&rough), seen_before, Surface::new(&own)] {
            let looks = (0..40).map(|k| {
                let k = f64::from(k);
                (0.001 * k, Direction::from_angles(0.04 * k, 0.3 * k))
            });
            let seen = surface.seen_straight_back(&Retro::new(surface.scattering), looks.clone());
            assert_eq!(seen.len(), 40);
            for (found, (beam_rad, v)) in seen.into_iter().zip(looks) {
                let expected = surface.seen_by(beam_rad, v, v);
                let apart = [
                    found.f_per_sr / expected.f_per_sr - 1.0,
                    found.specular_share - expected.specular_share,
                    found.coherent_share - expected.coherent_share,
                ];
                assert!(
                    apart.iter().all(|x| x.abs() < 1e-9),
                    "{beam_rad} {v:?}: {found:?} {expected:?}"
                );
            }
        }
    }
}
