//! Streams of draws, one for each entry of a specification and each target.

use crate::radar::random::{Draws, Key, Purpose};

/// The kinds of draws of a scan, which share no stream.
#[derive(Clone, Copy)]
#[repr(u64)]
pub(super) enum Kind {
    Choice = 1,
    Variation = 2,
    Place = 3,
    Posterior = 4,
    Effect = 5,
    Seed = 6,
    Noise = 7,
    Split = 8,
}

/// The stream of draws of one entry of the specification for one target, or scan.
pub(super) fn stream(seed: u64, number: u64, kind: Kind, entry: usize) -> Draws {
    let sub_ray = ((kind as u64) << 32) | entry as u64;
    Key { seed, chirp: number, sub_ray, purpose: Purpose::DataSet }.draws()
}

/// A draw of a normal law between two ends: those outside are drawn again. Where hardly any is inside it is the nearer end.
pub(super) fn within(mean: f64, sd: f64, [low, high]: [f64; 2], draws: &mut Draws) -> f64 {
    const MOST_TRIES: usize = 1000;
    let drawn = (0..MOST_TRIES).map(|_| mean + sd * draws.gaussian());
    let inside = drawn.into_iter().find(|drawn| (low..=high).contains(drawn));
    inside.unwrap_or(mean.clamp(low, high))
}
