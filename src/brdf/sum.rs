//! f = Σ f_p: echoes of independent origin add in power.
//!
//! Nothing weighs the parts, so that each must carry its own level, and the energy of the sum is the
//! sum of the energies: parts that reflect more than 1 together are the caller's to avoid.

use serde::{Deserialize, Deserializer, Serialize, de::Error};

use super::backscatter::{Term, together};
use super::parameter::Visitor;
use super::{Brdf, Scattering, f_and_specular_share};
use crate::frames::{Direction, Surface};

/// Several models at once, at least one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Sum {
    /// The models, addressed by position from 0: `0.m`, `1.albedo`.
    #[serde(deserialize_with = "at_least_one")]
    pub parts: Vec<Brdf>,
}

impl Sum {
    pub(super) fn visit(&mut self, prefix: &str, visitor: &mut Visitor) {
        for (position, part) in self.parts.iter_mut().enumerate() {
            part.visit(&format!("{prefix}{position}."), visitor);
        }
    }
}

impl Scattering for Sum {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.parts.iter().map(|part| part.f_per_sr(i, o)).sum()
    }

    fn f_and_specular_share(&self, i: Direction<Surface>, o: Direction<Surface>) -> (f64, f64) {
        f_and_specular_share(self.parts.iter().map(|part| (1.0, part)), i, o)
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        together(self.parts.iter().map(|part| (1.0, part)))
    }
}

fn at_least_one<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Brdf>, D::Error> {
    let parts = Vec::<Brdf>::deserialize(deserializer)?;
    if parts.is_empty() {
        return Err(D::Error::custom("a sum has no part; give it at least one"));
    }
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{BlinnPhong, Lambert};

    #[test]
    fn levels_add_and_paths_count_the_parts() {
        let lambert = Lambert { albedo: 0.3 };
        let blinn_phong = BlinnPhong { r_s: 0.1, alpha: 2.0 };
        let sum = Sum { parts: vec![Brdf::Lambert(lambert), Brdf::BlinnPhong(blinn_phong)] };
        let apart = lambert.retro_per_sr(0.4) + blinn_phong.retro_per_sr(0.4);
        assert!((sum.retro_per_sr(0.4) - apart).abs() < 1e-15);
        let mut model = Brdf::Sum(sum);
        let paths: Vec<_> = model.parameters().into_iter().map(|p| p.path).collect();
        assert_eq!(paths, ["0.albedo", "1.r_s", "1.alpha"]);
        assert!(model.set_parameter("1.alpha", 3.0) && !model.set_parameter("2.alpha", 3.0));
    }

    #[test]
    fn a_sum_of_nothing_is_refused() {
        let message = serde_json::from_str::<Brdf>(r#"{"model": "sum", "parts": []}"#).unwrap_err();
        assert!(message.to_string().contains("at least one"), "{message}");
    }
}
