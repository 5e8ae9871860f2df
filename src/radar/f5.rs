//! Equation (1): (x_t, y_t) = f5(γ, φ, R), the fast stand-in for the optics.
//!
//! The paper's coefficients are not published. Ours are fitted to the exact [`Mirror`]. φ enters as
//! cos φ and sin φ, because a polynomial in φ itself would not close after a turn; cos²φ is
//! 1 − sin²φ, so that every term of total degree five or less is γ^a · sin^b φ · R^c, or that times
//! cos φ.

use nalgebra::{DMatrix, DVector};
use serde::{Deserialize, Serialize};

use super::error::F5Error;
use super::mirror::{Mirror, MirrorAngles};

/// Total degree of the polynomial.
const DEGREE: usize = 5;

/// Exponents of one term.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Term {
    /// Exponent of γ over its scale.
    pub gamma: usize,
    /// Exponent of cos φ, 0 or 1.
    pub cos_phi: usize,
    /// Exponent of sin φ.
    pub sin_phi: usize,
    /// Exponent of R over its scale.
    pub range: usize,
}

/// The polynomial of equation (1).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct F5 {
    /// γ is divided by this, rad.
    pub gamma_scale_rad: f64,
    /// R is reduced by this, m …
    pub range_centre_m: f64,
    /// … and divided by this, m.
    pub range_scale_m: f64,
    /// The terms.
    pub terms: Vec<Term>,
    /// Coefficient of x_t for each term, m.
    pub x_m: Vec<f64>,
    /// Coefficient of y_t for each term, m.
    pub y_m: Vec<f64>,
}

/// Angles and ranges over which a polynomial is fitted and judged.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Domain {
    /// Largest |γ|, rad.
    pub gamma_rad: f64,
    /// Smallest and largest R, m.
    pub range_m: [f64; 2],
}

/// Distance between the polynomial and the exact optics in the target plane.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct F5Deviation {
    /// Largest, mm.
    pub worst_mm: f64,
    /// Root of the mean square, mm.
    pub rms_mm: f64,
}

impl F5 {
    /// Fits the polynomial to exact optics by least squares.
    ///
    /// # Errors
    /// When the beam leaves the optics backwards somewhere in the domain.
    pub fn fit(mirror: &Mirror, domain: Domain) -> Result<F5, F5Error> {
        let [near_m, far_m] = domain.range_m;
        let mut f5 = F5 {
            gamma_scale_rad: domain.gamma_rad.max(f64::MIN_POSITIVE),
            range_centre_m: 0.5 * (near_m + far_m),
            range_scale_m: (0.5 * (far_m - near_m)).max(f64::MIN_POSITIVE),
            terms: terms(),
            x_m: Vec::new(),
            y_m: Vec::new(),
        };
        let samples = domain.samples(7, 14, 7);
        let exact = exact_points(mirror, &samples)?;
        let values: Vec<f64> =
            samples.iter().flat_map(|&(angles, range_m)| f5.term_values(angles, range_m)).collect();
        let matrix = DMatrix::from_row_slice(samples.len(), f5.terms.len(), &values);
        let solver = matrix.qr();
        let solve = |axis: usize| {
            let mut right = DVector::from_iterator(exact.len(), exact.iter().map(|p| p[axis]));
            solver.q_tr_mul(&mut right);
            let right = right.rows(0, f5.terms.len());
            let solution = solver.r().solve_upper_triangular(&right).ok_or(F5Error::Singular)?;
            Ok(solution.as_slice().to_vec())
        };
        (f5.x_m, f5.y_m) = (solve(0)?, solve(1)?);
        Ok(f5)
    }

    /// Checks coefficients that came from a file.
    pub(super) fn validate(&self) -> Result<(), F5Error> {
        let refuse = |problem| Err(F5Error::Own { problem });
        if self.terms.is_empty()
            || [&self.x_m, &self.y_m].iter().any(|c| c.len() != self.terms.len())
        {
            return refuse("x_m and y_m need one coefficient for each of one or more terms");
        }
        let exponents = |t: &Term| [t.gamma, t.cos_phi, t.sin_phi, t.range];
        if self.terms.iter().any(|t| exponents(t).iter().any(|&e| e > DEGREE)) {
            return refuse("an exponent is above 5");
        }
        let scales = [self.gamma_scale_rad, self.range_scale_m];
        let numbers = scales.iter().chain([&self.range_centre_m]).chain(&self.x_m).chain(&self.y_m);
        if scales.contains(&0.0) || !numbers.into_iter().all(|x| x.is_finite()) {
            return refuse("a scale is zero or a number is not finite");
        }
        Ok(())
    }

    /// (x_t, y_t), m.
    pub fn target_point_m(&self, angles: MirrorAngles, range_m: f64) -> [f64; 2] {
        let values = self.term_values(angles, range_m);
        [&self.x_m, &self.y_m].map(|c| std::iter::zip(c, &values).map(|(c, v)| c * v).sum())
    }

    /// Distance to the exact optics over a domain, on a grid finer than the one of the fit.
    ///
    /// # Errors
    /// When the beam leaves the optics backwards somewhere in the domain.
    pub fn error(&self, mirror: &Mirror, domain: Domain) -> Result<F5Deviation, F5Error> {
        let samples = domain.samples(20, 90, 12);
        let exact = exact_points(mirror, &samples)?;
        let squares_mm2: Vec<f64> = std::iter::zip(&samples, &exact)
            .map(|(&(angles, range_m), exact)| {
                let [x, y] = self.target_point_m(angles, range_m);
                1e6 * ((x - exact[0]).powi(2) + (y - exact[1]).powi(2))
            })
            .collect();
        Ok(F5Deviation {
            worst_mm: squares_mm2.iter().copied().fold(0.0, f64::max).sqrt(),
            rms_mm: (squares_mm2.iter().sum::<f64>() / squares_mm2.len() as f64).sqrt(),
        })
    }

    fn term_values(&self, angles: MirrorAngles, range_m: f64) -> Vec<f64> {
        let gamma = angles.gamma_rad / self.gamma_scale_rad;
        let (sin, cos) = angles.phi_rad.sin_cos();
        let range = (range_m - self.range_centre_m) / self.range_scale_m;
        let bases = [gamma, cos, sin, range];
        let powers = bases.map(|base| [0, 1, 2, 3, 4, 5].map(|exponent| base.powi(exponent)));
        let power = |base: usize, exponent: usize| match powers[base].get(exponent) {
            Some(&power) => power,
            None => bases[base].powi(exponent as i32),
        };
        let value = |t: &Term| {
            power(0, t.gamma) * power(1, t.cos_phi) * power(2, t.sin_phi) * power(3, t.range)
        };
        self.terms.iter().map(value).collect()
    }
}

impl Domain {
    /// A grid over γ, φ and R: Chebyshev points in γ and R, equal steps in φ.
    fn samples(&self, gammas: usize, phis: usize, ranges: usize) -> Vec<(MirrorAngles, f64)> {
        let chebyshev = |count: usize, low: f64, high: f64| {
            (0..count).map(move |i| {
                let x = (std::f64::consts::PI * (i as f64 + 0.5) / count as f64).cos();
                0.5 * (low + high) + 0.5 * (high - low) * x
            })
        };
        let [near_m, far_m] = self.range_m;
        let mut samples = Vec::with_capacity(gammas * phis * ranges);
        for gamma_rad in chebyshev(gammas, -self.gamma_rad, self.gamma_rad) {
            for phi in 0..phis {
                let phi_rad = std::f64::consts::TAU * phi as f64 / phis as f64;
                for range_m in chebyshev(ranges, near_m, far_m) {
                    samples.push((MirrorAngles { gamma_rad, phi_rad }, range_m));
                }
            }
        }
        samples
    }
}

/// Every term of total degree [`DEGREE`] or less.
fn terms() -> Vec<Term> {
    let mut terms = Vec::new();
    for cos_phi in 0..=1 {
        for gamma in 0..=DEGREE - cos_phi {
            for sin_phi in 0..=DEGREE - cos_phi - gamma {
                for range in 0..=DEGREE - cos_phi - gamma - sin_phi {
                    terms.push(Term { gamma, cos_phi, sin_phi, range });
                }
            }
        }
    }
    terms
}

fn exact_points(
    mirror: &Mirror,
    samples: &[(MirrorAngles, f64)],
) -> Result<Vec<[f64; 2]>, F5Error> {
    let point = |&(angles, range_m): &(MirrorAngles, f64)| {
        let MirrorAngles { gamma_rad, phi_rad } = angles;
        mirror.target_point_m(angles, range_m).ok_or(F5Error::NoBeam { gamma_rad, phi_rad })
    };
    samples.iter().map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::radar::mirror::Optics;

    #[test]
    fn the_polynomial_stands_in_for_the_optics_far_below_the_spot() {
        // The spot is 16 mm wide.
        const GOAL_MM: f64 = 0.2;
        let mirror = Mirror::new(Optics::default(), Point::new(0.0, 0.0, 8.0));
        let gamma_rad = mirror.tilt_for_height_rad(0.25);
        let domain = Domain { gamma_rad, range_m: [7.0, 9.0] };
        let f5 = F5::fit(&mirror, domain).unwrap();
        assert_eq!(f5.terms.len(), 91);
        let error = f5.error(&mirror, domain).unwrap();
        assert!(error.worst_mm < GOAL_MM, "{error:?}");
        assert!(error.rms_mm < error.worst_mm);
    }
}
