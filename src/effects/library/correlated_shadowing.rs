//! Shadowing and masking as one event: in backscatter G1 where the law has G1².

use crate::brdf::{Brdf, CookTorrance, Scattering, Shadowing};
use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::lobes::rescaled;
use crate::effects::shot::{Shot, Stage};

pub(crate) struct CorrelatedShadowing;

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
            (1.0 - share) * lobe.f_per_sr(retro, retro) + share * once.f_per_sr(retro, retro)
        })
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
    }
}
