//! Return from inside the material: σ⁰ + σ_v·cosᑫθ, that is f + σ_v·cosᑫθ/(4π·cos²θ).
//!
//! q = 0 is alike at every angle, q = 2 a Lambert surface; what must cross the surface twice falls
//! faster.

use std::f64::consts::PI;

use crate::brdf::Brdf;
use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};

pub(crate) struct Subsurface;

/// At grazing incidence nothing gets in.
const LEAST_COS_THETA: f64 = 1e-3;

const ABOUT: About = About {
    name: "subsurface",
    level: Level::Material,
    description: "Part of the wave enters the material, scatters inside and comes back with the same strength \
         at every angle, or falling with a power of its cosine, added to what the surface returns.",
    signature: "The curve of power over angle flattens at large angles, at a level that is well above the \
         threshold. A noise floor flattens it in watts, whatever the range, and only near the \
         threshold; too small an exponent of the diffuse lobe lifts all angles smoothly.",
    parameters: &[
        EffectParameter::new("sigma_v", "1", [0.0, 1.0], 0.0, 5e-4),
        EffectParameter::new("cosine_power", "1", [0.0, 4.0], 0.0, 0.5),
    ],
    conflicts: &[Conflict::OF_BACKSCATTER],
    has_one_form: false,
};

impl Effect for Subsurface {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        [5e-4, 5e-3].into_iter().flat_map(|sigma_v| [0.0, 2.0].map(|q| vec![sigma_v, q])).collect()
    }

    fn scatter(&self, values: &[f64], _: &Stage, _: &Brdf, shot: &Shot, f_per_sr: f64) -> f64 {
        let &[sigma_v, cosine_power] = values else { return f_per_sr };
        let cos_theta = shot.hit.cos_theta.max(LEAST_COS_THETA);
        f_per_sr + sigma_v * cos_theta.powf(cosine_power - 2.0) / (4.0 * PI)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    #[test]
    fn it_adds_the_same_sigma0_at_every_angle_or_one_that_falls_with_the_cosine() {
        let bench = Bench::sphere();
        for cosine_power in [0.0, 1.5] {
            let (bare, with) = (bench.bare(), bench.with(&Subsurface, &[0.01, cosine_power]));
            for ((shot, bare), with) in bench.shots.iter().zip(&bare).zip(&with) {
                let f_per_sr = 0.01 * shot.hit.cos_theta.powf(cosine_power) / (4.0 * PI);
                let link = bench.stage().link;
                let one = link.power_w(&bench.stage().beam(shot), shot.hit.range_m, 1.0, f_per_sr);
                assert!(db((with.power_w - bare.power_w) / one).abs() < 1e-6);
            }
        }
    }
}
