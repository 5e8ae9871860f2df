//! Starts that cover the shapes which a law can have.
//!
//! Given the shapes of its lobes a law is linear in their levels, so that the search over the levels alone is easy and
//! ends in one place (Golub & Pereyra 1973, DOI 10.1137/0710036). The shapes have many local optima. They are tried at places
//! that cover their ranges evenly, each with the levels that fit best there, on a sample of the rows. From the best of
//! them short searches of all numbers follow, and searches on all rows start where these end best.

use nalgebra::DVector;
use rayon::prelude::*;

use super::coordinates::{Coordinate, Coordinates, LOOKS};
use super::minimise::{Local, Minimise, Minimum};
use crate::brdf::Scattering;
use crate::material::Observation;

/// Rows of the sample.
const ROWS: usize = 250;
/// Places that are tried for each shape, and in all.
const PER_SHAPE: usize = 12;
const MOST: usize = 144;
/// Search of the levels at one place; it only has to rank the places.
const LEVELS: Minimise = Minimise { iterations: 6, tolerance: 1.0, patience: 3 };
/// Places from which a short search follows, for each start that is wanted.
const FOLLOWED: usize = 8;
/// That search: it only has to rank their optima.
const SHORT: Minimise = Minimise { iterations: 10, tolerance: 0.1, patience: 4 };
/// Share of the range of a shape within which two places lead to the same optimum.
const NEAR: f64 = 0.1;
/// Incidences at which a number is tested for being a level, rad.
const ANGLES_RAD: [f64; 4] = [0.0, 0.05, 0.3, 1.0];

/// Every n-th row by the tilt of the facets that it sees, in backscatter the incidence.
pub(super) fn sample(rows: &[Observation]) -> Vec<Observation> {
    let mut sorted = rows.to_vec();
    sorted.sort_by(|a, b| a.aspect().half_angle_rad().total_cmp(&b.aspect().half_angle_rad()));
    sorted.into_iter().step_by(rows.len().div_ceil(ROWS).max(1)).collect()
}

/// Up to `count` starts, the best first; none of a law without shapes. `cost` is that of the sample.
pub(crate) fn starts(
    coordinates: &Coordinates,
    count: usize,
    cost: impl Fn(&DVector<f64>) -> Local + Sync,
) -> Vec<DVector<f64>> {
    let shapes = shapes(coordinates);
    if shapes.is_empty() || count == 0 {
        return Vec::new();
    }
    let (lower, upper) = (coordinates.lower(), coordinates.upper());
    let usual: Vec<[f64; 2]> = coordinates.list.iter().map(Coordinate::usual_ends).collect();
    let places = MOST.min(PER_SHAPE.saturating_pow(shapes.len() as u32));
    let tried = (0..places).into_par_iter().map(|place| {
        let mut start = coordinates.start();
        for (&index, share) in shapes.iter().zip(evenly(place, shapes.len())) {
            let [low, high] = usual[index];
            start[index] = low + share * (high - low);
        }
        let [mut low, mut high] = coordinates.holding_looks(&start);
        for &index in &shapes {
            (low[index], high[index]) = (start[index], start[index]);
        }
        LEVELS.run(&start, [&low, &high], &cost)
    });
    let mut best = best_apart(tried.collect(), &shapes, &usual);
    best.truncate(FOLLOWED * count);
    let followed = best.into_par_iter().map(|at| SHORT.run(&at, [&lower, &upper], &cost));
    let mut starts = best_apart(followed.collect(), &shapes, &usual);
    starts.truncate(count);
    starts
}

/// The ends of some searches, best first, without those whose shapes are near a better one's.
fn best_apart(found: Vec<Minimum>, shapes: &[usize], usual: &[[f64; 2]]) -> Vec<DVector<f64>> {
    let ends = found.into_iter().map(|one| (one.local.value, one.at)).collect();
    apart(ends, shapes, usual, usize::MAX)
}

/// Up to `most` points by their cost, best first, without those whose shapes are near a better one's and those
/// without a cost.
pub(super) fn apart(
    mut found: Vec<(f64, DVector<f64>)>,
    shapes: &[usize],
    usual: &[[f64; 2]],
    most: usize,
) -> Vec<DVector<f64>> {
    found.retain(|(cost, _)| cost.is_finite());
    found.sort_by(|(a, _), (b, _)| a.total_cmp(b));
    let mut apart: Vec<DVector<f64>> = Vec::new();
    for (_, at) in found {
        if apart.len() == most {
            break;
        }
        let is_near = |&i: &usize, other: &DVector<f64>| {
            (at[i] - other[i]).abs() < NEAR * (usual[i][1] - usual[i][0])
        };
        if !apart.iter().any(|other| shapes.iter().all(|i| is_near(i, other))) {
            apart.push(at);
        }
    }
    apart
}

/// The numbers in which a law is not linear.
pub(crate) fn shapes(coordinates: &Coordinates) -> Vec<usize> {
    let is_shape =
        |&index: &usize| coordinates.list[index].name != LOOKS && !is_level(coordinates, index);
    (0..coordinates.len()).filter(is_shape).collect()
}

/// Whether σ⁰ is linear in a number.
fn is_level(coordinates: &Coordinates, index: usize) -> bool {
    let number = &coordinates.list[index];
    let sigma0 = |share: f64| {
        let mut at = coordinates.start();
        at[index] = number.searched(number.min + share * (number.max - number.min));
        let law = coordinates.model(&at);
        ANGLES_RAD.map(|theta_rad| law.sigma0(theta_rad))
    };
    let [low, middle, high] = [0.2, 0.4, 0.6].map(sigma0);
    (0..ANGLES_RAD.len()).all(|i| {
        let bend = low[i] + high[i] - 2.0 * middle[i];
        bend.abs() <= 1e-6 * middle[i].abs()
    })
}

/// Place `number` of a sequence that covers the unit cube evenly however far it is followed: multiples of the inverse powers of
/// the root of x^(d + 1) = x + 1 (Roberts 2018, "The unreasonable effectiveness of quasirandom sequences").
pub(super) fn evenly(number: usize, dimensions: usize) -> impl Iterator<Item = f64> {
    let root = (0..64).fold(2.0_f64, |x, _| (1.0 + x).powf(1.0 / (dimensions as f64 + 1.0)));
    (1..=dimensions).map(move |axis| (0.5 + (number + 1) as f64 / root.powi(axis as i32)).fract())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Brdf, Lambert};
    use crate::fit::settings::Fit;
    use crate::fit::twin::{Twin, mixture};
    use crate::radar::random::{Key, Purpose};

    fn names(law: &Brdf) -> Vec<String> {
        let coordinates = Coordinates::new(law, &[], &[], None).unwrap();
        shapes(&coordinates).into_iter().map(|i| coordinates.list[i].name.clone()).collect()
    }

    #[test]
    fn levels_are_told_from_shapes() {
        assert_eq!(names(&mixture(0.07, 6.0, 0.05, 0.002)), ["diffuse.alpha", "specular.m"]);
        assert!(names(&Brdf::Lambert(Lambert { albedo: 0.3 })).is_empty());
    }

    #[test]
    fn places_cover_the_square_evenly() {
        // In each of a hundred squares there are two of 200, give or take two.
        let mut counts = [0; 100];
        for number in 0..200 {
            let place: Vec<f64> = evenly(number, 2).map(|x| (10.0 * x).floor()).collect();
            counts[(10.0 * place[1] + place[0]) as usize] += 1;
        }
        assert!(counts.iter().all(|&count| (1..=4).contains(&count)), "{counts:?}");
    }

    #[test]
    fn a_start_with_the_lobes_in_each_other_s_place_ends_at_the_truth() {
        // A wide lobe where the narrow one is, and a steep tail: from here alone a search swaps the lobes.
        let twin = Twin { rows: 1000, ..Twin::default() };
        for (m, alpha) in [(0.9, 300.0), (0.5, 0.1), (0.01, 60.0)] {
            let start = mixture(m, alpha, 0.01, 0.05);
            let curve = twin.curve(5);
            let found = Fit::default().run(&start, &curve).unwrap();
            let near = Fit { starts: 1, ..Fit::default() }.run(&twin.model, &curve).unwrap();
            let [found, near] = [found, near].map(|fit| fit.objective);
            assert!(found > near - 0.01, "{m} {alpha}: {found} {near}");
        }
    }

    /// A law, and how it is measured, as a seed draws them.
    fn drawn(seed: u64) -> Twin {
        let mut draws = Key { seed, chirp: 0, sub_ray: 7, purpose: Purpose::Fit }.draws();
        let mut between = |low: f64, high: f64| low * (high / low).powf(draws.uniform());
        let (m, alpha) = (between(0.02, 0.6), between(1.0, 61.0) - 1.0);
        let (s, r) = (between(1e-3, 0.3), between(1e-4, 0.1));
        Twin {
            model: mixture(m, alpha, s, r),
            rows: between(300.0, 3000.0) as usize,
            looks: between(1.0, 8.0).round(),
            theta_sd_deg: between(0.3, 3.0),
            threshold_dbm: -70.0 - between(1.0, 30.0),
            theta_deg: [0.0, between(20.0, 80.0)],
        }
    }

    /// ln p by which a fit from the usual start falls short of the best of one from the truth.
    fn shortfall(seed: u64) -> Option<f64> {
        let twin = drawn(seed);
        let curve = twin.curve(seed);
        let found = Fit::default().run(&mixture(0.1, 3.0, 0.02, 0.004), &curve).ok()?;
        let near = Fit { starts: 1, ..Fit::default() }.run(&twin.model, &curve).ok()?;
        Some(near.objective - found.objective)
    }

    #[test]
    fn no_drawn_curve_ends_below_a_fit_from_the_truth() {
        for seed in 0..3 {
            assert!(shortfall(seed).is_none_or(|ln_p| ln_p < 0.5), "{seed}");
        }
    }

    #[test]
    #[ignore = "takes minutes"]
    fn of_many_drawn_curves_one_in_a_thousand_ends_below_a_fit_from_the_truth() {
        let short: Vec<(u64, f64)> = (0..1000u64)
            .into_par_iter()
            .filter_map(|seed| Some((seed, shortfall(seed)?)))
            .filter(|(_, ln_p)| *ln_p > 0.5)
            .collect();
        assert!(short.len() <= 1, "{short:?}");
    }
}
