//! Return from inside the material: σ⁰ + σ_v, that is f + σ_v/(4π·cos²θ).

use std::f64::consts::PI;

use super::{Effect, Knob, Level, Look, Stage};
use crate::brdf::Brdf;

/// The effect `subsurface`.
pub(super) struct Subsurface;

/// At grazing incidence nothing gets in.
const LEAST_COS_THETA: f64 = 1e-3;

impl Effect for Subsurface {
    fn name(&self) -> &'static str {
        "subsurface"
    }

    fn level(&self) -> Level {
        Level::Material
    }

    fn knobs(&self) -> &'static [Knob] {
        const KNOBS: [Knob; 1] = [Knob::new("sigma_v", "1", [0.0, 1.0], 0.0, 5e-4)];
        &KNOBS
    }

    fn is(&self) -> &'static str {
        "Part of the wave enters the material, scatters inside and comes back with the same strength \
         at every angle, added to what the surface returns."
    }

    fn shows(&self) -> &'static str {
        "The curve of power over angle flattens at large angles, at a level that is well above the \
         threshold. A noise floor flattens it in watts, whatever the range, and only near the \
         threshold; too small an exponent of the diffuse lobe lifts all angles smoothly."
    }

    fn starts(&self, _stage: &Stage, _looks: &[Look]) -> Vec<Vec<f64>> {
        vec![vec![5e-4], vec![5e-3]]
    }

    fn scatter(&self, values: &[f64], _: &Stage, _: &Brdf, look: &Look, f_per_sr: f64) -> f64 {
        let &[sigma_v] = values else { return f_per_sr };
        f_per_sr + sigma_v / (4.0 * PI * look.hit.cos_theta.max(LEAST_COS_THETA).powi(2))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{Bench, db};

    #[test]
    fn it_adds_the_same_sigma0_at_every_angle() {
        let bench = Bench::sphere();
        let (bare, with) = (bench.bare(), bench.with(&Subsurface, &[0.01]));
        for ((look, bare), with) in bench.looks.iter().zip(&bare).zip(&with) {
            let one = bench.stage().link.power_w(look.hit.range_m, 1.0, 0.01 / (4.0 * PI));
            assert!(db((with.power_w - bare.power_w) / one).abs() < 1e-6);
        }
    }
}
