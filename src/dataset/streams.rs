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
