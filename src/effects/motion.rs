//! A target that moves during the scan: a shift Σ a_k·cos(kπp) along each axis, with k = 0 to 8 and p the
//! share of the scan that is over. Few cosines make any smooth path.

use std::f64::consts::PI;

use glam::{DMat3, DVec3};

use super::meeting::motion;
use super::{Effect, Knob, Level, Look, Stage};
use crate::frames::{Global, Pose};

/// The effect `motion`.
pub(super) struct Motion;

/// Cosines of a path, the constant among them: up to four cycles a scan.
const TERMS: usize = 9;
const KNOBS: [Knob; 3 * TERMS] = [
    along("x0_m"),
    along("y0_m"),
    along("z0_m"),
    along("x1_m"),
    along("y1_m"),
    along("z1_m"),
    along("x2_m"),
    along("y2_m"),
    along("z2_m"),
    along("x3_m"),
    along("y3_m"),
    along("z3_m"),
    along("x4_m"),
    along("y4_m"),
    along("z4_m"),
    along("x5_m"),
    along("y5_m"),
    along("z5_m"),
    along("x6_m"),
    along("y6_m"),
    along("z6_m"),
    along("x7_m"),
    along("y7_m"),
    along("z7_m"),
    along("x8_m"),
    along("y8_m"),
    along("z8_m"),
];

const fn along(axis: &'static str) -> Knob {
    Knob::new(axis, "m", [-0.1, 0.1], 0.0, 2e-3)
}

/// The axis of a number, and the share of it by which the target has moved.
fn along_axis(knob: usize, progress: f64) -> (usize, f64) {
    (knob % 3, ((knob / 3) as f64 * PI * progress).cos())
}

/// How far a target has moved, m.
fn shift_m(values: &[f64], progress: f64) -> DVec3 {
    let mut shift_m = DVec3::ZERO;
    for (knob, value) in values.iter().enumerate() {
        let (axis, share) = along_axis(knob, progress);
        shift_m[axis] += share * value;
    }
    shift_m
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

    fn shifts(&self, knob: usize, look: &Look) -> Option<(usize, f64)> {
        Some(along_axis(knob, look.progress))
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
        let mut values = [0.0; KNOBS.len()];
        values[8] = 4e-3;
        for (progress, expected_m) in [(0.0, 4e-3), (0.25, 0.0), (0.5, -4e-3), (1.0, 4e-3)] {
            let look = Look { progress, ..bench.looks[7] };
            let found = bench.moved(&Motion, &values, &look).unwrap();
            let nearer_m = (look.hit.range_m - found.hit.range_m) * look.hit.cos_theta;
            assert!((nearer_m - expected_m).abs() < 1e-9, "{progress}: {nearer_m}");
        }
    }
}
