//! A measured curve σ⁰(θ), used as it is: f = σ⁰/(4π cos²θ), equation (10) solved for f.
//!
//! Between the points σ⁰ is interpolated in dB over θ by a monotone cubic, which never overshoots the data. Its
//! slopes are the weighted harmonic means of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5 (1984) 300),
//! at the ends those of the end intervals. Outside the points the
//! end values are held, but from `silent_from_deg` on, where the data lie below the threshold, nothing
//! comes back. f·cos²θ then stays finite, but f itself grows without bound towards grazing incidence
//! and can exceed what energy allows there. A monostatic curve says nothing of other directions; away from backscatter
//! the curve is read at the angle of the half vector, which is reciprocal and agrees with the data.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::brdf::kind::{Key, Kind};
use crate::brdf::parameter::Visitor;
use crate::brdf::scattering::{Scattering, ScatteringModel, half_vector};
use crate::frames::{Direction, Surface};
use crate::units::{db_from_ratio, ratio_from_db};

pub(super) const KIND: Kind = Kind {
    name: "tabulated",
    keys: &[
        Key::new("theta_deg", NUMBERS),
        Key::new("sigma0_db", NUMBERS),
        Key::number("silent_from_deg").optional(),
    ],
    starts: &[],
};

const NUMBERS: &str = r#"{"type": "array", "items": {"type": "number"}}"#;

/// A monostatic curve.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Columns", into = "Columns")]
pub struct Tabulated {
    /// As given: degrees to radians and back is not exact, and a curve must be written as it was read.
    columns: Columns,
    theta_rad: Vec<f64>,
    /// dB per rad at each point.
    slope_db_per_rad: Vec<f64>,
}

/// The curve as files have it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Columns {
    theta_deg: Vec<f64>,
    sigma0_db: Vec<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    silent_from_deg: Option<f64>,
}

/// Nearer angles would make the slope between them meaningless.
const LEAST_STEP_RAD: f64 = 1e-12;

/// Why points do not make a curve.
#[derive(Debug, Error, PartialEq)]
pub enum TabulatedError {
    /// Nothing to interpolate between.
    #[error("a curve needs at least two backscatter angles, but has {points}")]
    TooFewPoints {
        /// How many there are.
        points: usize,
    },
    /// The columns do not pair up.
    #[error("theta_deg has {theta} values and sigma0_db has {sigma0}; give as many of each")]
    Unequal {
        /// Number of angles.
        theta: usize,
        /// Number of levels.
        sigma0: usize,
    },
    /// What is known to be silent starts within the points.
    #[error("silent_from_deg = {silent_from_deg} must lie beyond the last angle, up to 90")]
    Silent {
        /// The angle, degrees.
        silent_from_deg: f64,
    },
    /// Angles must ascend within a quarter turn.
    #[error("point {point}: {theta_deg}° must be above the angle before it and lie in 0–90°")]
    Angle {
        /// Point number, from 0.
        point: usize,
        /// Its angle, degrees.
        theta_deg: f64,
    },
    /// σ⁰ must be positive and finite to have a level in dB.
    #[error("point {point}: σ⁰ = {sigma0} has no level in dB; leave the point out or censor it")]
    Level {
        /// Point number, from 0.
        point: usize,
        /// Its σ⁰.
        sigma0: f64,
    },
}

impl Tabulated {
    /// A curve from (θ in rad, σ⁰ as a ratio) pairs with ascending θ within 0 to π/2.
    pub fn new(points: &[(f64, f64)]) -> Result<Tabulated, TabulatedError> {
        Tabulated::try_from(Columns {
            theta_deg: points.iter().map(|p| p.0.to_degrees()).collect(),
            sigma0_db: points.iter().map(|p| db_from_ratio(p.1)).collect(),
            silent_from_deg: None,
        })
    }

    /// The same curve, of which nothing comes back from `theta_rad` on.
    ///
    /// # Errors
    /// When the angle does not lie beyond the last point, up to π/2.
    pub fn silent_from(self, theta_rad: f64) -> Result<Tabulated, TabulatedError> {
        let silent_from_deg = Some(theta_rad.to_degrees());
        Tabulated::try_from(Columns { silent_from_deg, ..self.columns })
    }

    /// Smallest and largest tabulated angle, rad.
    pub fn range_rad(&self) -> (f64, f64) {
        (self.theta_rad[0], self.theta_rad[self.theta_rad.len() - 1])
    }

    /// The points: angles, rad, and σ⁰, dB.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        std::iter::zip(&self.theta_rad, &self.columns.sigma0_db)
            .map(|(theta, level)| (*theta, *level))
    }

    /// σ⁰ at an angle, dB; the end values are held outside [`Tabulated::range_rad`], and it is −∞
    /// where the curve is silent.
    pub fn sigma0_db(&self, theta_rad: f64) -> f64 {
        if self.columns.silent_from_deg.is_some_and(|from| theta_rad >= from.to_radians()) {
            return f64::NEG_INFINITY;
        }
        let last = self.theta_rad.len() - 1;
        let right = self.theta_rad.partition_point(|&t| t <= theta_rad);
        if right == 0 {
            return self.columns.sigma0_db[0];
        }
        if right > last {
            return self.columns.sigma0_db[last];
        }
        let left = right - 1;
        let width = self.theta_rad[right] - self.theta_rad[left];
        let t = (theta_rad - self.theta_rad[left]) / width;
        let (t2, t3) = (t * t, t * t * t);
        (2.0 * t3 - 3.0 * t2 + 1.0) * self.columns.sigma0_db[left]
            + (t3 - 2.0 * t2 + t) * width * self.slope_db_per_rad[left]
            + (3.0 * t2 - 2.0 * t3) * self.columns.sigma0_db[right]
            + (t3 - t2) * width * self.slope_db_per_rad[right]
    }
}

impl Scattering for Tabulated {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        let cos = half_vector(i, o).cos_theta().min(1.0);
        ratio_from_db(self.sigma0_db(cos.acos())) / (4.0 * std::f64::consts::PI * cos * cos)
    }
}

impl ScatteringModel for Tabulated {
    /// It has none.
    fn visit_parameters(&mut self, _prefix: &str, _visitor: &mut Visitor) {}

    fn has_curve(&self) -> bool {
        true
    }
}

impl TryFrom<Columns> for Tabulated {
    type Error = TabulatedError;
    fn try_from(columns: Columns) -> Result<Tabulated, TabulatedError> {
        columns.validate()?;
        let theta_rad: Vec<f64> = columns.theta_deg.iter().map(|t| t.to_radians()).collect();
        let slope_db_per_rad = monotone_slopes(&theta_rad, &columns.sigma0_db);
        Ok(Tabulated { columns, theta_rad, slope_db_per_rad })
    }
}

impl From<Tabulated> for Columns {
    fn from(curve: Tabulated) -> Columns {
        curve.columns
    }
}

impl Columns {
    fn validate(&self) -> Result<(), TabulatedError> {
        let (points, sigma0) = (self.theta_deg.len(), self.sigma0_db.len());
        if points != sigma0 {
            return Err(TabulatedError::Unequal { theta: points, sigma0 });
        }
        if points < 2 {
            return Err(TabulatedError::TooFewPoints { points });
        }
        let mut before_rad = -LEAST_STEP_RAD;
        let pairs = std::iter::zip(&self.theta_deg, &self.sigma0_db);
        for (point, (&theta_deg, &level_db)) in pairs.enumerate() {
            let (theta_rad, sigma0) = (theta_deg.to_radians(), ratio_from_db(level_db));
            // `!(a && b)` also refuses NaN.
            let ascends = theta_rad - before_rad >= LEAST_STEP_RAD;
            if !(ascends && theta_rad <= std::f64::consts::FRAC_PI_2) {
                return Err(TabulatedError::Angle { point, theta_deg });
            }
            if !(sigma0 > 0.0 && sigma0.is_finite()) {
                return Err(TabulatedError::Level { point, sigma0 });
            }
            before_rad = theta_rad;
        }
        match self.silent_from_deg {
            Some(from) if !(from.to_radians() > before_rad && from <= 90.0) => {
                Err(TabulatedError::Silent { silent_from_deg: from })
            }
            _ => Ok(()),
        }
    }
}

/// Slopes at the points that keep the cubic monotone between them.
fn monotone_slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let secant: Vec<f64> = (1..x.len()).map(|i| (y[i] - y[i - 1]) / (x[i] - x[i - 1])).collect();
    let mut slopes = vec![secant[0]];
    for i in 1..secant.len() {
        let (before, after) = (secant[i - 1], secant[i]);
        if before * after <= 0.0 {
            slopes.push(0.0);
            continue;
        }
        // Fritsch and Butland's weighted harmonic mean for unequal steps; 0 at an extremum, above.
        let (left, right) = (x[i] - x[i - 1], x[i + 1] - x[i]);
        let (w1, w2) = (2.0 * right + left, right + 2.0 * left);
        slopes.push((w1 + w2) / (w1 / before + w2 / after));
    }
    slopes.push(secant[secant.len() - 1]);
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_points_are_met_and_the_ends_held() {
        let curve = Tabulated::new(&[(0.1, 10.0), (0.2, 1.0), (0.4, 0.5)]).unwrap();
        for (theta_rad, sigma0) in [(0.1, 10.0), (0.2, 1.0), (0.4, 0.5), (0.0, 10.0), (1.5, 0.5)] {
            assert!((curve.sigma0(theta_rad) - sigma0).abs() < 1e-12 * sigma0);
        }
    }

    #[test]
    fn a_straight_line_in_db_stays_straight() {
        let line = |theta: f64| ratio_from_db(3.0 - 20.0 * theta);
        let points: Vec<_> = [0.0, 0.1, 0.35, 1.0].map(|t| (t, line(t))).to_vec();
        let curve = Tabulated::new(&points).unwrap();
        for step in 0..100 {
            let theta_rad = f64::from(step) / 100.0;
            assert!((curve.sigma0_db(theta_rad) - (3.0 - 20.0 * theta_rad)).abs() < 1e-12);
        }
    }

    #[test]
    fn a_curve_is_silent_where_the_data_lie_below_the_threshold() {
        let curve = Tabulated::new(&[(0.1, 1.0), (0.2, 0.5)]).unwrap();
        assert!(curve.clone().silent_from(0.15).is_err());
        let curve = curve.silent_from(0.5).unwrap();
        assert!((curve.sigma0(0.4) - 0.5).abs() < 1e-12);
        assert_eq!(curve.sigma0(0.51), 0.0);
        let back: Tabulated =
            serde_json::from_str(&serde_json::to_string(&curve).unwrap()).unwrap();
        assert_eq!(back, curve);
    }

    #[test]
    fn curves_that_mean_nothing_are_refused() {
        assert!(matches!(Tabulated::new(&[(0.0, 1.0)]), Err(TabulatedError::TooFewPoints { .. })));
        for bad in [(0.0, 1.0), (1e-300, 1.0), (f64::NAN, 1.0), (2.0, 1.0)] {
            let refused = Tabulated::new(&[(0.0, 1.0), bad]);
            assert!(matches!(refused, Err(TabulatedError::Angle { point: 1, .. })));
        }
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let refused = Tabulated::new(&[(0.0, 1.0), (0.1, bad)]);
            assert!(matches!(refused, Err(TabulatedError::Level { point: 1, .. })));
        }
    }

    proptest! {
        #[test]
        fn a_curve_is_written_exactly_as_it_was_read(
            start in 0.0f64..0.5, step in 1e-3f64..0.5, levels in [1e-6f64..1e3, 1e-6f64..1e3],
        ) {
            let curve = Tabulated::new(&[(start, levels[0]), (start + step, levels[1])]).unwrap();
            let back = serde_json::from_str(&serde_json::to_string(&curve).unwrap()).unwrap();
            prop_assert_eq!(curve, back);
        }

        #[test]
        fn the_curve_never_leaves_its_neighbours(
            levels in prop::collection::vec(-60.0f64..10.0, 3..12), at in 0.0f64..1.0,
        ) {
            let step = 1.5 / levels.len() as f64;
            let points: Vec<_> =
                levels.iter().enumerate().map(|(i, &l)| (i as f64 * step, ratio_from_db(l))).collect();
            let curve = Tabulated::new(&points).unwrap();
            let theta_rad = at * (levels.len() - 1) as f64 * step;
            let left = ((theta_rad / step) as usize).min(levels.len() - 2);
            let (low, high) = (levels[left].min(levels[left + 1]), levels[left].max(levels[left + 1]));
            let level = curve.sigma0_db(theta_rad);
            prop_assert!(level >= low - 1e-9 && level <= high + 1e-9);
        }
    }
}
