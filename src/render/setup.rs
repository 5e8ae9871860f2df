//! What a scan is rendered from.

use super::bounce::Bounce;
use super::surface::Surface;
use crate::effects::Model;
use crate::radar::{Chirps, Radar};
use crate::trace::{Bvh, Tracer};

/// Everything a scan meets and how it is rendered.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The instrument.
    pub radar: &'a Radar,
    /// The rays of the scan.
    pub chirps: &'a Chirps,
    /// The target.
    pub bvh: &'a Bvh<'a>,
    /// How the rays of the scan find it; all others ask `bvh`.
    pub tracer: Tracer<'a>,
    /// Region of every facet, an index into `surfaces`.
    pub region_of_facet: &'a [u16],
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
    /// The paper's: single paths only.
    pub fn new(
        radar: &'a Radar,
        chirps: &'a Chirps,
        bvh: &'a Bvh<'a>,
        region_of_facet: &'a [u16],
        surfaces: &'a [Surface<'a>],
    ) -> Setup<'a> {
        let (tracer, bounce, effects, seed) = (Tracer::Automatic, None, None, 0);
        Setup { radar, chirps, bvh, tracer, region_of_facet, surfaces, bounce, effects, seed }
    }
}
