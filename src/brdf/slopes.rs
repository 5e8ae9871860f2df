//! Laws of the slopes of facets and Smith's shadowing for them: D and G1 of Walter et al. (EGSR 2007).

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use crate::frames::{Direction, Surface};

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

    /// D(h) with a roughness along x and one along y, normalised alike.
    pub fn d_anisotropic_per_sr(self, h: Direction<Surface>, [m_x, m_y]: [f64; 2]) -> f64 {
        if h.cos_theta() <= 0.0 {
            return 0.0;
        }
        let h = h.xyz();
        let slope2 = ((h.x / m_x).powi(2) + (h.y / m_y).powi(2)) / (h.z * h.z);
        let law = match self {
            Distribution::Beckmann => (-slope2).exp(),
            Distribution::Ggx => (1.0 + slope2).powi(-2),
        };
        law / (PI * m_x * m_y * h.z.powi(4))
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
