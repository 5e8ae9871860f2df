//! Shadowing and masking as one event: in backscatter G1 where the law has G1².
//!
//! Between the two G is a mean of both, weighted by the share. Nothing says which mean: the effect has the geometric one,
//! which lies between the arithmetic (surfaces of two kinds) and the harmonic.

use crate::brdf::{Brdf, CookTorrance, Scattering, Shadowing};
use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::lobes::rescaled;
use crate::effects::shot::{Shot, Stage};

pub(crate) struct CorrelatedShadowing;

/// Where shadowing counts, and the lobe can still be seen.
const TYPICAL_G1: f64 = 0.5;

const ABOUT: About = About {
    name: "correlated-shadowing",
    level: Level::Material,
    description: "The facets that the wave cannot reach are those that the radar cannot see, so that \
         shadowing counts once and not twice: 1 is once, 0 the law as it is.",
    signature: "The specular part is too strong at large angles, the more the rougher the surface; nothing \
         happens on smooth ones. Return from below the surface has one level in σ⁰ instead of a \
         factor that grows with angle, and needs no rough lobe.",
    parameters: &[EffectParameter::new("share", "1", [0.0, 1.0], 0.0, 0.25)],
    conflicts: &[Conflict::OF_BACKSCATTER],
    has_one_form: false,
};

impl Effect for CorrelatedShadowing {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![0.5], vec![1.0]]
    }

    fn scatter(&self, values: &[f64], _: &Stage, law: &Brdf, shot: &Shot, f_per_sr: f64) -> f64 {
        let &[share] = values else { return f_per_sr };
        if share == 0.0 {
            return f_per_sr;
        }
        let retro = shot.to_radar();
        rescaled(law, retro, f_per_sr, &|lobe| {
            let once = CookTorrance { shadowing: Shadowing::Correlated, ..*lobe };
            let twice_per_sr = lobe.f_per_sr(retro, retro);
            if twice_per_sr < f64::MIN_POSITIVE {
                return twice_per_sr;
            }
            twice_per_sr * (once.f_per_sr(retro, retro) / twice_per_sr).powf(share)
        })
    }

    /// Half the distance between the shares with which the arithmetic and the harmonic mean come to the same G, at
    /// [`TYPICAL_G1`].
    fn form_error(&self, parameter: usize, values: &[f64]) -> f64 {
        let factor = TYPICAL_G1.powf(-values[parameter]);
        let arithmetic = (factor - 1.0) / (TYPICAL_G1.recip() - 1.0);
        let harmonic = (1.0 - factor.recip()) / (1.0 - TYPICAL_G1);
        0.5 * (harmonic - arithmetic)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Distribution;
    use crate::effects::testing::{Bench, lobe};

    #[test]
    fn it_raises_a_rough_lobe_by_one_over_g1() {
        let bench = Bench::plate();
        let rough = CookTorrance { m: 0.6, ..lobe() };
        let law = Brdf::CookTorrance(rough);
        let mut shot = bench.shots[0];
        shot.hit.cos_theta = 70f64.to_radians().cos();
        let f = law.retro_per_sr(shot.hit.theta_rad());
        let found = CorrelatedShadowing.scatter(&[1.0], &bench.stage(), &law, &shot, f) / f;
        let g1 = Distribution::Beckmann.g1(shot.hit.cos_theta, 0.6);
        assert!(g1 < 0.9);
        assert!((found * g1 - 1.0).abs() < 1e-9, "{found} {g1}");
        let half = CorrelatedShadowing.scatter(&[0.5], &bench.stage(), &law, &shot, f) / f;
        assert!((half * g1.sqrt() - 1.0).abs() < 1e-9, "{half} {g1}");
    }

    #[test]
    fn at_its_ends_the_form_is_certain() {
        let error = |share: f64| CorrelatedShadowing.form_error(0, &[share]);
        assert!(error(0.0).abs() < 1e-12 && error(1.0).abs() < 1e-12);
        assert!((error(0.5) - 0.086).abs() < 1e-3, "{}", error(0.5));
    }
}
