//! The level of a radar that nobody calibrated, and the scale of the materials it sees.
//!
//! The level is a constant factor on every echo. Data tell its product with the scale of each law, and neither alone. A law
//! is therefore held near the scale that is stored: ν/2·ln(1 + r²/ν) is added to −ln p for a scale r deviations of
//! [`SCALE_SD_DB`] away from it, as of Student's t of [`FREEDOM`] ν. Common to all laws, a change is the level's. The tails are
//! long, so that one wrong law among three or more does not draw the level along; two that disagree leave two optima, and a
//! search ends in one.

use std::f64::consts::FRAC_PI_2;

use nalgebra::DVector;

use super::observation::DB;
use crate::brdf::{Brdf, Scattering};
use crate::fit::coordinates::Coordinates;
use crate::fit::minimise::Local;
use crate::fit::shapes::shapes;

/// How far the scale of a stored law is trusted, dB: what careful measurements of one surface differ by.
const SCALE_SD_DB: f64 = 1.0;
/// Degrees of freedom of that trust: ten standard deviations cost 9.5 in ln p.
const FREEDOM: f64 = 7.0;
/// How far the widths and exponents of a stored law are trusted, as a share of their range in the search, which counts up
/// to this length: a factor of 1.6 for a width.
const SHAPE_SD: f64 = 0.1;
const SHAPES_REACH: f64 = 5.0;
/// How far off a level may be, dB.
pub(super) const MOST_OFF_DB: f64 = 60.0;
/// Step of a difference quotient by a coordinate of a law.
const STEP: f64 = 1e-4;
/// Angles of the sum over incidences.
const ANGLES: usize = 60;

/// ln of the scale of a law: of the sum of what it returns from all incidences, which hardly depends on the width of its lobes.
fn ln_scale(law: &Brdf) -> f64 {
    let mut sum = 0.0;
    for step in 0..ANGLES {
        // Dense near the normal, where lobes are narrow: θ = π/2·x³.
        let x = (step as f64 + 0.5) / ANGLES as f64;
        let theta_rad = FRAC_PI_2 * x.powi(3);
        sum += law.sigma0(theta_rad) * theta_rad.sin() * x * x;
    }
    sum.max(f64::MIN_POSITIVE).ln()
}

/// How far laws are from those stored in what data hardly tell apart with an effect: their widths and exponents, in ln p.
/// Of two models that predict alike the one with the nearer laws is the likelier.
pub(super) fn off_the_stored<'a>(
    laws: impl Iterator<Item = (usize, &'a Coordinates)>,
    at: &DVector<f64>,
) -> f64 {
    let mut sum = 0.0;
    for (first, coordinates) in laws {
        let (start, [lower, upper]) =
            (coordinates.start(), [coordinates.lower(), coordinates.upper()]);
        for index in shapes(coordinates) {
            // A logarithm, or a place in its range.
            let width = (upper[index] - lower[index]).min(SHAPES_REACH);
            let r = (at[first + index] - start[index]) / (SHAPE_SD * width);
            sum += 0.5 * FREEDOM * (r * r / FREEDOM).ln_1p();
        }
    }
    sum
}

/// What is added to −ln p for the scales of laws, each with its coordinates and their place among all unknowns.
pub(super) fn prior<'a>(
    laws: impl Iterator<Item = (usize, &'a Coordinates)>,
    at: &DVector<f64>,
) -> Local {
    let mut sum = Local::zero(at.len());
    for (first, coordinates) in laws {
        let stored = ln_scale(&coordinates.model(&coordinates.start()));
        let here = at.rows(first, coordinates.len()).into_owned();
        let off = |there: &DVector<f64>| {
            DB / SCALE_SD_DB * (ln_scale(&coordinates.model(there)) - stored)
        };
        let r = off(&here);
        let mut slopes = vec![0.0; at.len()];
        for index in 0..here.len() {
            let mut there = here.clone();
            there[index] += STEP;
            slopes[first + index] = (off(&there) - r) / STEP;
        }
        let weight = 1.0 / (1.0 + r * r / FREEDOM);
        sum.value += 0.5 * FREEDOM * (r * r / FREEDOM).ln_1p();
        sum.add(weight * r, weight, &slopes);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Lambert;
    use crate::fit::twin::mixture;

    #[test]
    fn the_scale_follows_levels_and_hardly_widths() {
        let [law, twice, wide] = [(0.05, 1.0), (0.05, 2.0), (0.07, 1.0)]
            .map(|(m, level)| ln_scale(&mixture(m, 6.0, 0.05 * level, 0.002 * level)));
        assert!((twice - law - 2f64.ln()).abs() < 1e-9, "{}", twice - law);
        assert!((wide - law).abs() < 0.03, "{}", wide - law);
    }

    #[test]
    fn lobes_in_each_other_s_place_are_far_from_the_stored_ones() {
        let coordinates =
            Coordinates::new(&mixture(0.1, 1.0, 0.05, 0.002), &[], &[], Some(4.0)).unwrap();
        let off = |law: &Brdf| {
            let there = Coordinates::new(law, &[], &[], Some(4.0)).unwrap().start();
            off_the_stored([(0, &coordinates)].into_iter(), &there)
        };
        assert_eq!(off(&mixture(0.1, 1.0, 0.5, 0.02)), 0.0);
        let [near, swapped] =
            [(0.12, 1.5), (0.85, 90.0)].map(|(m, alpha)| off(&mixture(m, alpha, 0.05, 0.002)));
        assert!(near < 1.0 && swapped > 8.0, "{near} {swapped}");
        // The level of a law that is no mixture is a level, too.
        let lambert = |albedo| Brdf::Lambert(Lambert { albedo });
        let flat = Coordinates::new(&lambert(0.3), &[], &[], Some(4.0)).unwrap();
        let there = Coordinates::new(&lambert(0.01), &[], &[], Some(4.0)).unwrap().start();
        assert_eq!(off_the_stored([(0, &flat)].into_iter(), &there), 0.0);
    }

    #[test]
    fn the_prior_is_least_at_the_stored_scale_and_its_gradient_is_its_slope() {
        let coordinates =
            Coordinates::new(&mixture(0.05, 6.0, 0.05, 0.002), &[], &[], Some(4.0)).unwrap();
        let prior = |at: &DVector<f64>| prior([(0, &coordinates)].into_iter(), at);
        let start = coordinates.start();
        assert!(prior(&start).value.abs() < 1e-12 && prior(&start).gradient.norm() < 1e-9);
        let mut there = start.clone();
        there.iter_mut().for_each(|u| *u += 0.3);
        let local = prior(&there);
        assert!(local.value > 0.5);
        for index in 0..there.len() {
            let [more, less] = [1e-5, -1e-5].map(|step| {
                let mut near = there.clone();
                near[index] += step;
                prior(&near).value
            });
            let slope = (more - less) / 2e-5;
            assert!((local.gradient[index] - slope).abs() < 1e-3, "{index}: {slope}");
        }
    }
}
