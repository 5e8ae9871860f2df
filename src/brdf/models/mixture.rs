//! Equation (12): f = k·f_d + (1 − k)·f_s.
//!
//! A monostatic measurement does not determine k apart from the levels of the two parts: it determines
//! only the products k·r_s and (1 − k)·f_λ.

use num_complex::Complex;
use serde::{Deserialize, Serialize};

use super::weighted;
use crate::brdf::backscatter::Term;
use crate::brdf::kind::{Key, Kind};
use crate::brdf::lobe::Lobe;
use crate::brdf::parameter::{Visitor, visit_number};
use crate::brdf::scattering::{NarrowLobe, Scattering, ScatteringModel, Seen};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "mixture",
    keys: &[
        Key::number("k"),
        Key::new("diffuse", weighted::PART_SCHEMA),
        Key::new("specular", weighted::PART_SCHEMA),
    ],
    starts: &[
        (
            "mixture",
            r#"{"model": "mixture", "k": 0.1,
            "specular": {"model": "cook-torrance", "f_lambda": 0.05, "m": 0.1},
            "diffuse": {"model": "blinn-phong", "r_s": 0.04, "alpha": 3}}"#,
        ),
        (
            "mixture-ggx",
            r#"{"model": "mixture", "k": 0.1,
            "specular": {"model": "cook-torrance", "distribution": "ggx", "f_lambda": 0.05, "m": 0.1},
            "diffuse": {"model": "blinn-phong", "r_s": 0.04, "alpha": 3}}"#,
        ),
    ],
};

/// A diffuse and a specular part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mixture<P> {
    /// Share of the diffuse part k, 0 to 1.
    pub k: f64,
    /// f_d.
    pub diffuse: Box<P>,
    /// f_s.
    pub specular: Box<P>,
}

impl<P> Mixture<P> {
    /// Its parts with their weights.
    pub fn weighted(&self) -> impl Iterator<Item = (f64, &P)> {
        [(self.k, &*self.diffuse), (1.0 - self.k, &*self.specular)].into_iter()
    }
}

impl<P: ScatteringModel> Scattering for Mixture<P> {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.k * self.diffuse.f_per_sr(i, o) + (1.0 - self.k) * self.specular.f_per_sr(i, o)
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

impl<P: ScatteringModel> ScatteringModel for Mixture<P> {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "k", (0.0, 1.0), &mut self.k);
        self.diffuse.visit_parameters(&format!("{prefix}diffuse."), visitor);
        self.specular.visit_parameters(&format!("{prefix}specular."), visitor);
    }

    fn permittivity(&self) -> Option<[f64; 2]> {
        self.specular.permittivity().or_else(|| self.diffuse.permittivity())
    }

    fn f_lambda(&self) -> Option<f64> {
        self.specular.f_lambda().or_else(|| self.diffuse.f_lambda())
    }

    fn has_smooth_mirror(&self) -> bool {
        self.weighted().any(|(weight, part)| weight > 0.0 && part.has_smooth_mirror())
    }

    fn has_curve(&self) -> bool {
        self.diffuse.has_curve() || self.specular.has_curve()
    }
}
