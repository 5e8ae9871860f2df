//! The parts of a joint diagnosis that belong to each of several clouds.

use std::ops::Range;

use super::evidence::CloudGain;
use super::scorer::{HeldOut, Scorer};
use crate::effects::Shot;

/// The scan and the shots of each cloud.
pub(super) fn parts(shots: &[Shot]) -> Vec<(u16, Range<usize>)> {
    let mut parts: Vec<(u16, Range<usize>)> = Vec::new();
    for shots in shots.chunk_by(|a, b| a.scan == b.scan) {
        let from = parts.last().map_or(0, |(_, last)| last.end);
        parts.push((shots[0].scan, from..from + shots.len()));
    }
    parts
}

/// Gain of one model over another on the held-out patches of each cloud; empty for one cloud.
pub(super) fn gains(scorer: &Scorer, a: &HeldOut, b: &HeldOut) -> Vec<CloudGain> {
    let parts = parts(scorer.problem.shots);
    if parts.len() < 2 {
        return Vec::new();
    }
    let gain = |(scan, range): (u16, Range<usize>)| {
        let mut gains = vec![0.0; a.shots.len()];
        for shot in range {
            gains[shot] = a.shots[shot].ln_p - b.shots[shot].ln_p;
        }
        let [gain, se] = scorer.folds.sum(&gains);
        CloudGain { cloud: usize::from(scan) + 1, gain, se }
    };
    parts.into_iter().map(gain).collect()
}
