//! f = Σ f_p: echoes of independent origin add in power.
//!
//! The parts have no weights: each carries its own level. The energy of the sum is the sum of the
//! energies, so the caller must avoid parts that together reflect more than 1.

use num_complex::Complex;
use serde::{Deserialize, Deserializer, Serialize, de::Error};

use super::weighted;
use crate::brdf::backscatter::Term;
use crate::brdf::kind::{Key, Kind};
use crate::brdf::lobe::Lobe;
use crate::brdf::parameter::Visitor;
use crate::brdf::scattering::{NarrowLobe, Scattering, ScatteringModel, Seen};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "sum",
    keys: &[Key::new("parts", r##"{"type": "array", "items": {"$ref": "#/$defs/model"}}"##)],
    starts: &[],
};

/// Several models at once, at least one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, bound(deserialize = "P: Deserialize<'de>"))]
pub struct Sum<P> {
    /// The models, addressed by position from 0: `0.m`, `1.albedo`.
    #[serde(deserialize_with = "at_least_one")]
    pub parts: Vec<P>,
}

impl<P> Sum<P> {
    /// Its parts with their weights, which all are 1.
    pub fn weighted(&self) -> impl Iterator<Item = (f64, &P)> {
        self.parts.iter().map(|part| (1.0, part))
    }
}

impl<P: ScatteringModel> Scattering for Sum<P> {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.parts.iter().map(|part| part.f_per_sr(i, o)).sum()
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        weighted::combined(self.weighted(), |part| part.seen_by(beam_rad, i, o))
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        weighted::narrow_lobes(self.weighted(), i)
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        weighted::combined(self.weighted(), |part| part.apart_from_narrow_lobes(i, o))
    }

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        weighted::facet_amplitudes(self.weighted(), i, o)
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        weighted::backscatter(self.weighted())
    }

    fn lobes(&self) -> Option<Vec<Lobe>> {
        weighted::lobes(self.weighted())
    }
}

impl<P: ScatteringModel> ScatteringModel for Sum<P> {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        for (position, part) in self.parts.iter_mut().enumerate() {
            part.visit_parameters(&format!("{prefix}{position}."), visitor);
        }
    }

    fn f_lambda(&self) -> Option<f64> {
        self.parts.iter().find_map(P::f_lambda)
    }

    fn has_smooth_mirror(&self) -> bool {
        self.weighted().any(|(weight, part)| weight > 0.0 && part.has_smooth_mirror())
    }

    fn has_curve(&self) -> bool {
        self.parts.iter().any(P::has_curve)
    }
}

fn at_least_one<'de, P, D>(deserializer: D) -> Result<Vec<P>, D::Error>
where
    P: Deserialize<'de>,
    D: Deserializer<'de>,
{
    let parts = Vec::<P>::deserialize(deserializer)?;
    if parts.is_empty() {
        return Err(D::Error::custom("a sum has no part; give it at least one"));
    }
    Ok(parts)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{BlinnPhong, Brdf, Lambert};

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
