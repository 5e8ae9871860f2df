//! A target that moves during the scan: a shift Σ a_k·cos(kπp) along each axis, with k = 1 to 3 and p the
//! share of the scan that is over. Few cosines make any smooth path; the mean belongs to the pose.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::meeting::motion;
use super::{Effect, Knob, Level, Look, Stage};
use crate::frames::{Global, Pose};

/// The effect `motion`.
pub(super) struct Motion;

const SHIFT_M: [f64; 2] = [-0.1, 0.1];
const KNOBS: [Knob; 9] = [
    Knob::new("x1_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("y1_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("z1_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("x2_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("y2_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("z2_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("x3_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("y3_m", "m", SHIFT_M, 0.0, 2e-3),
    Knob::new("z3_m", "m", SHIFT_M, 0.0, 2e-3),
];

/// How far a target has moved, m.
fn shift_m(values: &[f64], progress: f64) -> DVec3 {
    let term = |(k, axes): (usize, &[f64])| match axes {
        &[x, y, z] => DVec3::new(x, y, z) * ((k + 1) as f64 * PI * progress).cos(),
        _ => DVec3::ZERO,
    };
    values.chunks(3).enumerate().map(term).sum()
}

impl Effect for Motion {
    fn name(&self) -> &'static str {
        "motion"
    }

    fn level(&self) -> Level {
        Level::Scene
    }

    fn knobs(&self) -> &'static [Knob] {
        &KNOBS
    }

    fn is(&self) -> &'static str {
        "The target moves slowly while the scan runs, as a person who sways or breathes."
    }

    fn shows(&self) -> &'static str {
        "The ranges are off by an amount that changes smoothly along the scan, and places that the \
         mirror passes twice disagree. A wrong pose is off alike from the first chirp to the last; a \
         drift of the gain leaves the ranges as they are."
    }

    /// At rest: ranges say at once where to.
    fn starts(&self, _stage: &Stage, _looks: &[Look]) -> Vec<Vec<f64>> {
        vec![vec![0.0; KNOBS.len()]]
    }

    fn goes_with_time(&self) -> bool {
        true
    }

    fn moves(&self) -> bool {
        true
    }

    fn motion(&self, values: &[f64], _: &Stage, look: &Look) -> Option<Pose<Global, Global>> {
        let moves = values.iter().any(|&value| value != 0.0);
        let shift_m = shift_m(values, look.progress);
        moves.then(|| motion(DMat3::IDENTITY, DVec3::ZERO, shift_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::Bench;

    #[test]
    fn the_range_follows_the_path() {
        let bench = Bench::plate();
        let mut values = [0.0; 9];
        values[5] = 4e-3;
        for (progress, expected_m) in [(0.0, 4e-3), (0.25, 0.0), (0.5, -4e-3), (1.0, 4e-3)] {
            let look = Look { progress, ..bench.looks[7] };
            let found = bench.moved(&Motion, &values, &look).unwrap();
            let nearer_m = (look.hit.range_m - found.hit.range_m) * look.hit.cos_theta;
            assert!((nearer_m - expected_m).abs() < 1e-9, "{progress}: {nearer_m}");
        }
    }
}
