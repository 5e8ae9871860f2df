//! Equation (13), Cook–Torrance with the constant of Walter et al. (EGSR 2007):
//! f_s = F·D·G / (4·|n·i|·|n·o|).
//!
//! F is Schlick's approximation, equation (14); D and G1 are Walter's for Beckmann and GGX. f_λ is
//! the reflectivity at normal incidence (0.998 for aluminium, 0.16 for skin, 0.03 for PTFE near
//! 300 GHz) and m the roughness: 0.01 is a mirror, 0.1 a lobe whose backscatter falls to half at 5°
//! from the normal. Single scattering loses energy on rough surfaces: at normal incidence more than a
//! tenth from m = 0.6 with Beckmann and from m = 0.3 with GGX.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::parameter::{Visitor, visit_number};
use super::{Scattering, half_vector};
use crate::frames::{Direction, Surface};

/// The paper's specular term.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CookTorrance {
    /// Reflectivity at normal incidence f_λ, 0 to 1.
    pub f_lambda: f64,
    /// Roughness m, 0.001 to 2; for Beckmann √2 times the rms slope along one direction.
    pub m: f64,
    /// Law of the facet slopes.
    #[serde(default)]
    pub distribution: Distribution,
    /// How shadowing and masking combine.
    #[serde(default)]
    pub shadowing: Shadowing,
}

/// Law of the facet slopes, D(h).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Distribution {
    /// Gaussian slopes: D = exp(−tan²θ/m²) / (π m² cos⁴θ).
    #[default]
    Beckmann,
    /// Longer tails: D = m² / (π cos⁴θ (m² + tan²θ)²).
    Ggx,
}

/// How the shadowing of i and the masking of o combine into G(i, o).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shadowing {
    /// The paper's: G = G1(i)·G1(o), as if the two were independent.
    #[default]
    Separable,
    /// Directions that see the same facets shadow them together: in exact backscatter G = G1 once.
    Correlated,
}

impl CookTorrance {
    pub(super) fn visit(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "f_lambda", (0.0, 1.0), &mut self.f_lambda);
        visit_number(visitor, prefix, "m", (0.001, 2.0), &mut self.m);
    }

    /// Equation (14), Schlick: F = f_λ + (1 − f_λ)(1 − |o·h|)⁵.
    fn fresnel(&self, o_h: f64) -> f64 {
        self.f_lambda + (1.0 - self.f_lambda) * (1.0 - o_h.abs()).powi(5)
    }

    /// G(i, o); the correlated form interpolates with van Ginneken et al., Appl. Opt. 37 (1998) 130.
    fn shadowing(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        let g1_i = self.distribution.g1(i.cos_theta(), self.m);
        let g1_o = self.distribution.g1(o.cos_theta(), self.m);
        match self.shadowing {
            Shadowing::Separable => g1_i * g1_o,
            Shadowing::Correlated => {
                let apart = 4.41 * azimuth_between_rad(i, o);
                let independent = apart / (apart + 1.0);
                independent * g1_i * g1_o + (1.0 - independent) * g1_i.min(g1_o)
            }
        }
    }
}

impl Scattering for CookTorrance {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        let h = half_vector(i, o);
        let d = self.distribution.d_per_sr(h.cos_theta(), self.m);
        let f = self.fresnel(o.xyz().dot(h.xyz()));
        f * d * self.shadowing(i, o) / (4.0 * i.cos_theta() * o.cos_theta())
    }
}

impl Distribution {
    /// D(h), facet normals per steradian, normalised so that ∫ D cos θ_h dω_h = 1.
    pub fn d_per_sr(self, cos_theta: f64, m: f64) -> f64 {
        if cos_theta <= 0.0 {
            return 0.0;
        }
        let cos2 = cos_theta * cos_theta;
        let (m2, tan2) = (m * m, (1.0 - cos2).max(0.0) / cos2);
        match self {
            Distribution::Beckmann => (-tan2 / m2).exp() / (PI * m2 * cos2 * cos2),
            Distribution::Ggx => m2 / (PI * cos2 * cos2 * (m2 + tan2).powi(2)),
        }
    }

    /// Smith's G1: the share of facets that a direction sees, 0 to 1.
    ///
    /// Beckmann uses Walter's rational approximation (relative error below 0.35 %).
    pub fn g1(self, cos_theta: f64, m: f64) -> f64 {
        if cos_theta <= 0.0 {
            return 0.0;
        }
        let tan = (1.0 - cos_theta * cos_theta).max(0.0).sqrt() / cos_theta;
        match self {
            Distribution::Beckmann => {
                let a = 1.0 / (m * tan);
                if a >= 1.6 {
                    return 1.0;
                }
                (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a)
            }
            Distribution::Ggx => 2.0 / (1.0 + (1.0 + (m * tan).powi(2)).sqrt()),
        }
    }
}

/// Angle between the projections of two directions onto the surface, rad; 0 when either is normal.
fn azimuth_between_rad(i: Direction<Surface>, o: Direction<Surface>) -> f64 {
    let (a, b) = (i.xyz().truncate(), o.xyz().truncate());
    a.perp_dot(b).abs().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paint(distribution: Distribution, shadowing: Shadowing) -> CookTorrance {
        CookTorrance { f_lambda: 0.2, m: 0.1, distribution, shadowing }
    }

    /// ∫ D cos θ dω over the hemisphere by the midpoint rule in θ.
    fn projected_area(distribution: Distribution, m: f64) -> f64 {
        let steps = 200_000;
        let width = std::f64::consts::FRAC_PI_2 / f64::from(steps);
        let term = |step: i32| {
            let theta = (f64::from(step) + 0.5) * width;
            distribution.d_per_sr(theta.cos(), m) * theta.cos() * 2.0 * PI * theta.sin() * width
        };
        (0..steps).map(term).sum()
    }

    #[test]
    fn the_slope_laws_are_normalised() {
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for m in [0.02, 0.1, 0.5, 1.0] {
                let area = projected_area(distribution, m);
                assert!((area - 1.0).abs() < 1e-6, "{distribution:?} m = {m}: {area}");
            }
        }
    }

    #[test]
    fn the_peak_is_the_closed_form() {
        // At normal incidence F = f_λ, G = 1, D = 1/(π m²): f = f_λ/(4π m²).
        let expected = 0.2 / (4.0 * PI * 0.01);
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            let f = paint(distribution, Shadowing::Separable).retro_per_sr(0.0);
            assert!((f - expected).abs() < 1e-12 * expected);
        }
    }

    #[test]
    fn correlated_shadowing_counts_backscatter_once() {
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            let theta_rad = 75f64.to_radians();
            let rough = |shadowing| CookTorrance { m: 0.5, ..paint(distribution, shadowing) };
            let once = rough(Shadowing::Correlated).retro_per_sr(theta_rad);
            let twice = rough(Shadowing::Separable).retro_per_sr(theta_rad);
            let g1 = distribution.g1(theta_rad.cos(), 0.5);
            assert!(g1 < 0.999);
            assert!((twice / once - g1).abs() < 1e-9);
        }
    }

    #[test]
    fn a_smoother_surface_is_narrower_and_higher() {
        let smooth =
            CookTorrance { m: 0.05, ..paint(Distribution::Beckmann, Shadowing::Separable) };
        let rough = paint(Distribution::Beckmann, Shadowing::Separable);
        assert!(smooth.retro_per_sr(0.0) > rough.retro_per_sr(0.0));
        assert!(smooth.retro_per_sr(0.3) < rough.retro_per_sr(0.3));
    }
}
