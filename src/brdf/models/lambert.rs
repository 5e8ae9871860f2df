//! Lambert's law: f = ρ/π, the same from every side.
//!
//! Diffuse albedo ρ runs from 0 to 1; chalk or sintered PTFE reach 0.99 in the visible, while at
//! 300 GHz most surfaces are too smooth to be Lambertian at all.

use serde::{Deserialize, Serialize};

use crate::brdf::backscatter::Term;
use crate::brdf::kind::{Key, Kind};
use crate::brdf::lobe::Lobe;
use crate::brdf::parameter::{Visitor, visit_number};
use crate::brdf::scattering::{Scattering, ScatteringModel};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "lambert",
    keys: &[Key::number("albedo")],
    starts: &[("lambert", r#"{"model": "lambert", "albedo": 0.1}"#)],
};

/// A perfectly diffuse surface.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lambert {
    /// Diffuse albedo ρ, 0 to 1.
    pub albedo: f64,
}

impl Scattering for Lambert {
    fn f_per_sr(&self, _i: Direction<Surface>, _o: Direction<Surface>) -> f64 {
        self.albedo / std::f64::consts::PI
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        Some(vec![Term::diffuse(self.albedo / std::f64::consts::PI, 0.0)])
    }

    fn lobes(&self) -> Option<Vec<Lobe>> {
        let level_per_sr = self.albedo / std::f64::consts::PI;
        Some(vec![Lobe::Cosines { level_per_sr, alpha: 0.0 }])
    }
}

impl ScatteringModel for Lambert {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "albedo", (0.0, 1.0), &mut self.albedo);
    }
}
