//! What a scan is rendered from.

use super::bounce::Bounce;
use super::surface::Surface;
use crate::effects::Model;
use crate::trace::ScanGeometry;

/// A scan, what its target is made of, and how it is rendered.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The instrument, its chirps and the target.
    pub geometry: ScanGeometry<'a>,
    /// What each region is made of.
    pub surfaces: &'a [Surface<'a>],
    /// Second-order paths; none, the paper's, for single ones only.
    pub bounce: Option<Bounce>,
    /// Physical effects on the radar's own echoes. The model's laws are those of `surfaces`, its
    /// receiver is the one that the radar [declares](crate::effects::Receiver::declared).
    pub effects: Option<&'a Model<'a>>,
    /// Seed of everything random.
    pub seed: u64,
}

impl<'a> Setup<'a> {
    /// As in the paper: single paths only, no effects.
    pub fn new(geometry: ScanGeometry<'a>, surfaces: &'a [Surface<'a>]) -> Setup<'a> {
        Setup { geometry, surfaces, bounce: None, effects: None, seed: 0 }
    }
}
