//! The input of a rendering.

use super::bounce::Bounce;
use super::surface::Surface;
use crate::effects::Model;
use crate::radar::Channel;
use crate::trace::ScanGeometry;

/// A scan, the materials of its target, and how it is rendered.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The instrument, its chirps and the target.
    pub geometry: ScanGeometry<'a>,
    /// The surface of each region.
    pub surfaces: &'a [Surface<'a>],
    /// Second-order paths; `None`, as in the paper, for single paths only.
    pub bounce: Option<Bounce>,
    /// Physical effects on the radar's own echoes. The model must have the scattering models of `surfaces`, and the
    /// receiver that the radar [declares](crate::effects::Receiver::declared).
    pub effects: Option<&'a Model<'a>>,
    /// The polarisation that the antennas receive.
    pub channel: Channel,
    /// Seed of everything random.
    pub seed: u64,
}

impl<'a> Setup<'a> {
    /// A rendering as in the paper: single paths, no effects, seed 0.
    pub fn new(geometry: ScanGeometry<'a>, surfaces: &'a [Surface<'a>]) -> Setup<'a> {
        Setup {
            geometry,
            surfaces,
            bounce: None,
            effects: None,
            channel: Channel::CoPolar,
            seed: 0,
        }
    }
}
