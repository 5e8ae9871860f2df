//! Equation (15), Blinn–Phong: f_d = r_s·(α + 2)/(2π)·(n·h)^α.
//!
//! r_s sets the level, α the decay: 0 is Lambertian, larger values fall off faster. In backscatter
//! n·h = cos θ. The model does not keep energy: at normal incidence it reflects 1 to 4 times r_s as α
//! goes from 0 to infinity, less at grazing incidence, so that r_s up to 1/4 is safe for any α.
//!
//! A beam adds δ² to the lobe's width m² = 2/α: 0.3 dB at α = 1000 for δ = 0.0117 rad, and nothing for broad lobes.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::brdf::backscatter::{Term, seen_cosines};
use crate::brdf::kind::{Key, Kind};
use crate::brdf::lobe::Lobe;
use crate::brdf::parameter::{Visitor, visit_number};
use crate::brdf::scattering::{Scattering, ScatteringModel, Seen, half_vector};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "blinn-phong",
    keys: &[Key::number("r_s"), Key::number("alpha")],
    starts: &[("blinn-phong", r#"{"model": "blinn-phong", "r_s": 0.05, "alpha": 3}"#)],
};

/// The paper's diffuse term.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BlinnPhong {
    /// Level r_s, 0 to 1.
    pub r_s: f64,
    /// Decay α, 0 to 1000; larger is narrower and higher.
    pub alpha: f64,
}

impl BlinnPhong {
    /// f at n·h = 1, 1/sr.
    fn level_per_sr(&self) -> f64 {
        self.r_s * (self.alpha + 2.0) / TAU
    }
}

impl Scattering for BlinnPhong {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let n_h = half_vector(i, o).cos_theta();
        let (alpha, share) = seen_cosines(self.alpha, beam_rad);
        Seen::diffuse(self.level_per_sr() * share * n_h.powf(alpha))
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        Some(vec![Term::diffuse(self.level_per_sr(), self.alpha)])
    }

    fn lobes(&self) -> Option<Vec<Lobe>> {
        Some(vec![Lobe::Cosines { level_per_sr: self.level_per_sr(), alpha: self.alpha }])
    }
}

impl ScatteringModel for BlinnPhong {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "r_s", (0.0, 1.0), &mut self.r_s);
        visit_number(visitor, prefix, "alpha", (0.0, 1000.0), &mut self.alpha);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_backscatter_is_a_power_of_the_cosine() {
        let model = BlinnPhong { r_s: 0.01, alpha: 6.0 };
        // 0.01 · 8/(2π) · cos⁶ 60°, by hand.
        let expected = 0.01 * 8.0 / TAU / 64.0;
        assert!((model.retro_per_sr(60f64.to_radians()) - expected).abs() < 1e-15);
    }
}
