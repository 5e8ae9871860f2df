//! The lobes of laws that are sums of closed forms in any pair of directions.

use super::slopes::Distribution;

/// One lobe of a law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lobe {
    /// A diffuse one, level·(n·h)^α.
    Cosines {
        /// Its level, 1/sr.
        level_per_sr: f64,
        /// Exponent α.
        alpha: f64,
    },
    /// Facets that reflect like mirrors, weight·F·D·G1(i)·G1(o)/(4·cos θ_i·cos θ_o), with Schlick's F.
    Facets {
        /// Its weight in the law.
        weight: f64,
        /// Reflectivity at normal incidence.
        f_lambda: f64,
        /// Roughness m.
        m: f64,
        /// Law of the slopes.
        distribution: Distribution,
    },
}

impl Lobe {
    /// The lobe with this weight in a law.
    pub(super) fn weighted(self, by: f64) -> Lobe {
        match self {
            Lobe::Cosines { level_per_sr, alpha } => {
                Lobe::Cosines { level_per_sr: by * level_per_sr, alpha }
            }
            Lobe::Facets { weight, f_lambda, m, distribution } => {
                Lobe::Facets { weight: by * weight, f_lambda, m, distribution }
            }
        }
    }
}
