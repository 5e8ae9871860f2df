//! Equation (12): f = k·f_d + (1 − k)·f_s.
//!
//! In a monostatic measurement k cannot be told from the levels of its two parts: only the products
//! k·r_s and (1 − k)·f_λ show.

use serde::{Deserialize, Serialize};

use super::backscatter::{Term, together};
use super::parameter::{Visitor, visit_number};
use super::{Brdf, Scattering, f_and_specular_share};
use crate::frames::{Direction, Surface};

/// A diffuse and a specular part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Mixture {
    /// Share of the diffuse part k, 0 to 1.
    pub k: f64,
    /// f_d.
    pub diffuse: Box<Brdf>,
    /// f_s.
    pub specular: Box<Brdf>,
}

impl Mixture {
    pub(super) fn visit(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "k", (0.0, 1.0), &mut self.k);
        self.diffuse.visit(&format!("{prefix}diffuse."), visitor);
        self.specular.visit(&format!("{prefix}specular."), visitor);
    }
}

impl Scattering for Mixture {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.k * self.diffuse.f_per_sr(i, o) + (1.0 - self.k) * self.specular.f_per_sr(i, o)
    }

    fn f_and_specular_share(&self, i: Direction<Surface>, o: Direction<Surface>) -> (f64, f64) {
        let parts = [(self.k, &*self.diffuse), (1.0 - self.k, &*self.specular)];
        f_and_specular_share(parts.into_iter(), i, o)
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        together([(self.k, &*self.diffuse), (1.0 - self.k, &*self.specular)].into_iter())
    }
}
