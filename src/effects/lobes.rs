//! A law with other specular lobes, for effects that act on the lobes alone.

use crate::brdf::{Brdf, CookTorrance, Scattering};
use crate::frames::{Direction, Surface};

/// `f_per_sr` times the ratio of the law with other lobes to the law as it is, in backscatter: each
/// Cook–Torrance lobe scatters as `lobe` says, 1/sr.
pub(super) fn rescaled(
    law: &Brdf,
    retro: Direction<Surface>,
    f_per_sr: f64,
    lobe: &dyn Fn(&CookTorrance) -> f64,
) -> f64 {
    let with = law.sum_over_parts(&|part| match part {
        Brdf::CookTorrance(specular) => lobe(specular),
        other => other.f_per_sr(retro, retro),
    });
    let without = law.f_per_sr(retro, retro);
    // Far down a Gaussian lobe there is nothing to scale.
    if without > f64::MIN_POSITIVE { (f_per_sr / without) * with } else { f_per_sr + with }
}
