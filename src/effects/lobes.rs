//! A law with other specular lobes, for effects that act on the lobes alone.

use crate::brdf::{Brdf, CookTorrance, Scattering};
use crate::frames::{Direction, Surface};

/// f in backscatter, 1/sr, where every Cook–Torrance lobe of the law scatters as `lobe` says.
pub(super) fn retro_with(
    law: &Brdf,
    retro: Direction<Surface>,
    lobe: &dyn Fn(&CookTorrance) -> f64,
) -> f64 {
    match law {
        Brdf::CookTorrance(specular) => lobe(specular),
        Brdf::Mixture(mixture) => {
            mixture.k * retro_with(&mixture.diffuse, retro, lobe)
                + (1.0 - mixture.k) * retro_with(&mixture.specular, retro, lobe)
        }
        Brdf::Sum(sum) => sum.parts.iter().map(|part| retro_with(part, retro, lobe)).sum(),
        _ => law.f_per_sr(retro, retro),
    }
}

/// `f_per_sr` times the ratio of the law with other lobes to the law as it is.
pub(super) fn rescaled(
    law: &Brdf,
    retro: Direction<Surface>,
    f_per_sr: f64,
    lobe: &dyn Fn(&CookTorrance) -> f64,
) -> f64 {
    let (with, without) = (retro_with(law, retro, lobe), law.f_per_sr(retro, retro));
    // Far down a Gaussian lobe there is nothing to scale.
    if without > f64::MIN_POSITIVE { (f_per_sr / without) * with } else { f_per_sr + with }
}

/// The first Cook–Torrance lobe of a law.
pub(super) fn first_lobe(law: &Brdf) -> Option<&CookTorrance> {
    match law {
        Brdf::CookTorrance(specular) => Some(specular),
        Brdf::Mixture(mixture) => {
            first_lobe(&mixture.specular).or_else(|| first_lobe(&mixture.diffuse))
        }
        Brdf::Sum(sum) => sum.parts.iter().find_map(first_lobe),
        _ => None,
    }
}
