//! A target that moves during the scan: along each axis a shift Σ a_k·φ_k(p) with p the share of the scan that is
//! over. φ_0 to φ_7 are cos(kπp). φ_8 and φ_9 are a line and a parabola without their part in such cosines,
//! so that paths with a slope at their ends converge as 1/k⁴ and not as 1/k² (Lanczos, Discourse on Fourier Series, 1966).

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::intersection::motion;
use crate::effects::shot::{Shot, Stage};
use crate::frames::{Global, Pose};

pub(crate) struct Motion;

/// The parameters `x0_m`, `y0_m`, `z0_m`, `x1_m` and so on of the terms with these numbers.
macro_rules! along_axes {
    ($($term:literal)+) => {
        [$(
            along(concat!("x", $term, "_m")),
            along(concat!("y", $term, "_m")),
            along(concat!("z", $term, "_m")),
        )+]
    };
}

/// Cosines of a path, the constant among them, and all its terms: up to about two and a half cycles a scan.
const COSINES: usize = 8;
const TERMS: usize = COSINES + 2;
const PARAMETERS: [EffectParameter; 3 * TERMS] = along_axes!(0 1 2 3 4 5 6 7 8 9);

const fn along(axis: &'static str) -> EffectParameter {
    EffectParameter::new(axis, "m", [-0.1, 0.1], 0.0, 2e-3)
}

/// The terms of a path where a share of the scan is over; all are 1 at its beginning.
fn terms(progress: f64) -> [f64; TERMS] {
    let mut cosines = [1.0; COSINES];
    cosines[1] = (PI * progress).cos();
    for k in 2..COSINES {
        cosines[k] = 2.0 * cosines[1] * cosines[k - 1] - cosines[k - 2];
    }
    let along = 1.0 - 2.0 * progress;
    let begin = [1.0; COSINES];
    let line = without_cosines(along, 1, &cosines) / without_cosines(1.0, 1, &begin);
    let parabola = without_cosines(0.5 * along * along - 1.0 / 6.0, 2, &cosines)
        / without_cosines(1.0 / 3.0, 2, &begin);
    let mut terms = [line; TERMS];
    terms[..COSINES].copy_from_slice(&cosines);
    terms[COSINES + 1] = parabola;
    terms
}

/// A function without its cosines, of which that with k half waves has the coefficient 8/(πk)², for
/// k = first, first + 2, ...
fn without_cosines(function: f64, first: usize, cosines: &[f64; COSINES]) -> f64 {
    let parts = (first..COSINES).step_by(2).map(|k| 8.0 / (PI * k as f64).powi(2) * cosines[k]);
    function - parts.sum::<f64>()
}

/// How far a target has moved, m.
fn shift_m(values: &[f64], progress: f64) -> DVec3 {
    let axes = values.chunks_exact(3).zip(terms(progress));
    axes.map(|(values, share)| share * DVec3::from_slice(values)).sum()
}

const ABOUT: About = About {
    name: "motion",
    level: Level::Scene,
    description: "The target moves slowly while the scan runs, as a person who sways or breathes: along each axis of the \
         scene by the sum of ten terms that all are 1 as the scan begins, with p for the share of it that is over. 0 to 7 are \
         cos(kπp), 8 and 9 what these leave of a line and of a parabola.",
    signature: "The ranges are off by an amount that changes smoothly along the scan, and places that the \
         mirror passes twice disagree. A wrong pose is off alike from the first chirp to the last; a \
         drift of the gain leaves the ranges as they are.",
    parameters: &PARAMETERS,
    conflicts: &[Conflict::OF_MOTION],
};

impl Effect for Motion {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn summary(&self, values: &[f64]) -> Option<String> {
        const STEPS: u32 = 500;
        let path_m = (0..=STEPS).map(|step| shift_m(values, f64::from(step) / f64::from(STEPS)));
        let span_m = path_m.clone().reduce(DVec3::max)? - path_m.reduce(DVec3::min)?;
        let [x_mm, y_mm, z_mm] = (1e3 * span_m).to_array();
        Some(format!(
            "a path that spans {x_mm:.1} mm along x, {y_mm:.1} mm along y and {z_mm:.1} mm along z"
        ))
    }

    /// At rest: the ranges lead a search from there.
    fn starts(&self, _stage: &Stage, _shots: &[Shot]) -> Vec<Vec<f64>> {
        vec![vec![0.0; PARAMETERS.len()]]
    }

    fn depends_on_time(&self) -> bool {
        true
    }

    fn moves(&self) -> bool {
        true
    }

    fn shifts(&self, parameter: usize, shot: &Shot) -> Option<(usize, f64)> {
        Some((parameter % 3, *terms(shot.progress).get(parameter / 3)?))
    }

    fn motion(&self, values: &[f64], _: &Stage, shot: &Shot) -> Option<Pose<Global, Global>> {
        let moves = values.iter().any(|&value| value != 0.0);
        let shift_m = shift_m(values, shot.progress);
        moves.then(|| motion(DMat3::IDENTITY, DVec3::ZERO, shift_m))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn the_last_terms_are_what_cosines_leave_at_the_ends() {
        const STEPS: usize = 2_000;
        let middles = (0..STEPS).map(|step| terms((step as f64 + 0.5) / STEPS as f64));
        let mut sums = [[0.0; TERMS]; TERMS];
        for terms in middles {
            for (row, a) in sums.iter_mut().zip(terms) {
                row.iter_mut().zip(terms).for_each(|(sum, b)| *sum += a * b / STEPS as f64);
            }
        }
        for (i, row) in sums.iter().enumerate() {
            for (j, sum) in row.iter().enumerate().filter(|(j, _)| *j != i) {
                assert!(sum.abs() < 1e-5, "{i}, {j}: {sum}");
            }
        }
        assert!(terms(0.0).iter().all(|term| (term - 1.0).abs() < 1e-12));
    }

    /// A path of two cycles that slopes at both ends, of which as many cosines leave 12 mm.
    #[test]
    fn few_terms_make_any_smooth_path() {
        let path_m = |row: usize| 0.05 * (4.0 * PI * row as f64 / 400.0 + 0.4).sin();
        let rows: Vec<[f64; TERMS]> = (0..=400).map(|row| terms(f64::from(row) / 400.0)).collect();
        let matrix = DMatrix::from_fn(rows.len(), TERMS, |row, term| rows[row][term]);
        let path = DVector::from_fn(rows.len(), |row, _| path_m(row));
        let values = matrix.clone().svd(true, true).solve(&path, 1e-12).unwrap();
        let off_m = (matrix * values - path).amax();
        assert!(off_m < 2e-3, "{off_m}");
    }

    #[test]
    fn the_range_follows_the_path() {
        let bench = Bench::plate();
        let mut values = [0.0; PARAMETERS.len()];
        values[8] = 4e-3;
        for (progress, expected_m) in [(0.0, 4e-3), (0.25, 0.0), (0.5, -4e-3), (1.0, 4e-3)] {
            let shot = Shot { progress, ..bench.shots[7] };
            let found = bench.moved(&Motion, &values, &shot).unwrap();
            let nearer_m = (shot.hit.range_m - found.hit.range_m) * shot.hit.cos_theta;
            assert!((nearer_m - expected_m).abs() < 1e-9, "{progress}: {nearer_m}");
        }
        let told = Motion.summary(&values).unwrap();
        assert!(told.ends_with("0.0 mm along x, 0.0 mm along y and 8.0 mm along z"), "{told}");
    }
}
