//! A target that moves during the scan: shifts along the three axes, and roll, pitch and yaw about the middle of the shots,
//! each of them Σ a_k·φ_k(p) with p the share of the scan that is over. φ_0 alone is a pose. φ_0 to φ_7 are cos(kπp). φ_8 and
//! φ_9 are a line and a parabola without their part in such cosines,
//! so that paths with a slope at their ends converge as 1/k⁴ and not as 1/k² (Lanczos, Discourse on Fourier Series, 1966).

use std::f64::consts::PI;

use glam::DVec3;

use crate::effects::effect::{About, Conflict, Effect, EffectParameter, Level};
use crate::effects::shot::{Shot, Stage};
use crate::effects::twist::{Twist, placed, twists};
use crate::frames::{Global, Pose};

pub(crate) struct Motion;

/// The parameters `x0_m`, `y0_m`, `z0_m`, `x1_m` and so on of the terms with these numbers, and then those of the turns:
/// `rotation_x0_deg` and so on.
macro_rules! along_axes {
    ($($term:literal)+) => {
        [
            $(
                along(concat!("x", $term, "_m")),
                along(concat!("y", $term, "_m")),
                along(concat!("z", $term, "_m")),
            )+
            $(
                about(concat!("rotation_x", $term, "_deg")),
                about(concat!("rotation_y", $term, "_deg")),
                about(concat!("rotation_z", $term, "_deg")),
            )+
        ]
    };
}

/// Cosines of a path, the constant among them, and all its terms: up to about two and a half cycles a scan.
const COSINES: usize = 8;
const TERMS: usize = COSINES + 2;
/// Parameters of the shifts; those of the turns come after them.
const SHIFTS: usize = 3 * TERMS;
const PARAMETERS: [EffectParameter; 2 * SHIFTS] = along_axes!(0 1 2 3 4 5 6 7 8 9);
/// Parameters of the shifts, or of the turns, of a slow path: terms 0 to 3, up to one and a half cycles a scan.
const SLOW: usize = 12;
const ALL: [usize; 2 * SHIFTS] = numbered([0, SHIFTS], SHIFTS);

const fn along(axis: &'static str) -> EffectParameter {
    EffectParameter::new(axis, "m", [-0.1, 0.1], 0.0, 2e-3)
}

const fn about(axis: &'static str) -> EffectParameter {
    EffectParameter::new(axis, "deg", [-20.0, 20.0], 0.0, 0.5)
}

/// The positions of the first `each` parameters from each of two places on.
const fn numbered<const COUNT: usize>(from: [usize; 2], each: usize) -> [usize; COUNT] {
    let mut all = [0; COUNT];
    let mut k = 0;
    while k < COUNT {
        all[k] = from[k / each] + k % each;
        k += 1;
    }
    all
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

/// How far a target has shifted, m, and turned, deg.
fn shift_and_turn(values: &[f64], terms: &[f64; TERMS]) -> [DVec3; 2] {
    let (shifts, turns) = values.split_at(SHIFTS.min(values.len()));
    [shifts, turns].map(|values| {
        let axes = values.chunks_exact(3).zip(terms);
        axes.map(|(values, share)| *share * DVec3::from_slice(values)).sum()
    })
}

const ABOUT: About = About {
    name: "motion",
    level: Level::Scene,
    description: "The target moves slowly while the scan runs, as a person who sways or breathes: it shifts along each axis of the \
         scene, and turns about each axis through the middle of what the scan has hit. Each is \
         the sum of ten terms that all are 1 as the scan begins, with p for the share of it that is over. 0 to 7 are \
         cos(kπp), 8 and 9 what these leave of a line and of a parabola.",
    signature: "The ranges are off by an amount that changes smoothly along the scan, and places that the \
         mirror passes twice disagree. A wrong pose is off alike from the first chirp to the last; a \
         drift of the gain leaves the ranges as they are.",
    parameters: &PARAMETERS,
    conflicts: &[Conflict::OF_MOTION, Conflict::OF_SHEETS],
    has_one_form: true,
};

impl Effect for Motion {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn summary(&self, values: &[f64]) -> Option<String> {
        const STEPS: u32 = 500;
        let path = (0..=STEPS)
            .map(|step| shift_and_turn(values, &terms(f64::from(step) / f64::from(STEPS))));
        let [most, least] = [DVec3::max, DVec3::min].map(|outer| {
            path.clone().reduce(|[a, b], [c, d]| [outer(a, c), outer(b, d)]).unwrap_or_default()
        });
        let [x_mm, y_mm, z_mm] = (1e3 * (most[0] - least[0])).to_array();
        let [x_deg, y_deg, z_deg] = (most[1] - least[1]).to_array();
        let turns = if values.iter().skip(SHIFTS).any(|value| *value != 0.0) {
            format!(
                ", with turns that span {x_deg:.1}° about x, {y_deg:.1}° about y and {z_deg:.1}° about z"
            )
        } else {
            String::new()
        };
        Some(format!(
            "a path that spans {x_mm:.1} mm along x, {y_mm:.1} mm along y and {z_mm:.1} mm along z{turns}"
        ))
    }

    /// Slow shifts; slow shifts and turns; any shifts; any shifts and turns.
    fn members(&self) -> &'static [&'static [usize]] {
        const SLOW_SHIFTS: [usize; SLOW] = numbered([0, 0], SLOW);
        const SLOW_BOTH: [usize; 2 * SLOW] = numbered([0, SHIFTS], SLOW);
        const ALL_SHIFTS: [usize; SHIFTS] = numbered([0, 0], SHIFTS);
        &[&SLOW_SHIFTS, &SLOW_BOTH, &ALL_SHIFTS, &ALL]
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

    fn twists(&self, values: &[f64], _: &Stage, shot: &Shot) -> Vec<Twist> {
        let terms = terms(shot.progress);
        let [shift_m, turn_deg] = shift_and_turn(values, &terms);
        let [x, y, z, roll, pitch, yaw] = twists(shift_m, turn_deg);
        let mut all = Vec::with_capacity(PARAMETERS.len());
        for axes in [[x, y, z], [roll, pitch, yaw]] {
            for share in terms {
                all.extend(axes.map(|twist| twist.map(|by| share * by)));
            }
        }
        all
    }

    fn motion(&self, values: &[f64], stage: &Stage, shot: &Shot) -> Option<Pose<Global, Global>> {
        let moves = values.iter().any(|&value| value != 0.0);
        moves.then(|| {
            let [shift_m, turn_deg] = shift_and_turn(values, &terms(shot.progress));
            placed(stage.middle, shift_m, turn_deg)
        })
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::effects::library::pose::Pose;
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

    /// Term 0 alone is the constant case.
    #[test]
    fn a_motion_that_stays_is_a_pose() {
        let bench = Bench::sphere();
        let constant = [0.004, -0.01, 0.02, 3.0, -2.0, 1.0];
        let mut values = [0.0; PARAMETERS.len()];
        values[..3].copy_from_slice(&constant[..3]);
        values[SHIFTS..SHIFTS + 3].copy_from_slice(&constant[3..]);
        for progress in [0.0, 0.4, 1.0] {
            let shot = Shot { progress, ..bench.shots[7] };
            let [moved, posed] = [
                bench.moved(&Motion, &values, &shot).unwrap(),
                bench.moved(&Pose, &constant, &shot).unwrap(),
            ];
            assert!((moved.hit.range_m - posed.hit.range_m).abs() < 1e-12);
            assert!((moved.normal - posed.normal).length() < 1e-12);
        }
        assert_eq!(Motion.motion(&[0.0; PARAMETERS.len()], &bench.stage(), &bench.shots[7]), None);
    }

    /// A wave of 2° about x tilts a plate one way and then the other, about the middle.
    #[test]
    fn the_normal_follows_the_turns() {
        let bench = Bench::plate();
        let mut values = [0.0; PARAMETERS.len()];
        values[SHIFTS + 3] = 2.0;
        for (progress, expected_deg) in [(0.0f64, 2.0), (1.0 / 3.0, 1.0), (0.5, 0.0), (1.0, -2.0)] {
            let shot = Shot { progress, ..bench.shots[7] };
            let normal = bench.moved(&Motion, &values, &shot).unwrap().normal;
            let tilt_deg = (-normal.y).atan2(normal.z).to_degrees();
            assert!((tilt_deg - expected_deg).abs() < 1e-9, "{progress}: {tilt_deg}");
        }
        let told = Motion.summary(&values).unwrap();
        assert!(
            told.ends_with("turns that span 4.0° about x, 0.0° about y and 0.0° about z"),
            "{told}"
        );
    }
}
