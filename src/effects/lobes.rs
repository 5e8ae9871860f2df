//! Replaces the specular lobes of a scattering model, for effects that act on the lobes alone.

use crate::brdf::{Brdf, CookTorrance, Scattering};
use crate::frames::{Direction, Surface};

/// `f_per_sr` times the ratio of the scattering model with other lobes to the model itself, in backscatter. `lobe` gives
/// f of each replaced Cook–Torrance lobe, 1/sr.
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
    // On the far flank of a Gaussian lobe f underflows, and there is no ratio.
    if without > f64::MIN_POSITIVE { (f_per_sr / without) * with } else { f_per_sr + with }
}
