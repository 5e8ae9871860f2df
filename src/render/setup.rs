//! The input of a rendering.

use super::bounce::Bounce;
use super::sheet::Sheet;
use super::surface::Surface;
use crate::effects::Model;
use crate::radar::{Beam, Channel, SpeckleForm};
use crate::trace::ScanGeometry;

/// Sheets that a ray passes where nothing else is stated: two garments, front and back.
pub const MOST_SHEETS: usize = 4;

/// A scan, the materials of its target, and how it is rendered.
#[derive(Clone, Copy)]
pub struct Setup<'a> {
    /// The instrument, its chirps and the target.
    pub geometry: ScanGeometry<'a>,
    /// The surface of each region.
    pub surfaces: &'a [Surface<'a>],
    /// Second-order paths; `None`, as in the paper, for single paths only.
    pub bounce: Option<Bounce>,
    /// Physical effects on the echoes. The model must have the scattering models of `surfaces`, and the
    /// receiver that the radar [declares](crate::effects::Receiver::declared).
    pub effects: Option<&'a Model<'a>>,
    /// The polarisation that the antennas receive.
    pub channel: Channel,
    /// Largest number of sheets that a ray passes; it ends at the next one.
    pub most_sheets: usize,
    /// Whether several antennas see this target in one scan, so that they should see the same scatterers.
    pub several_antennas: bool,
    /// Seed of all that is fixed to the target: the scatterers of its surface, and the directions of second-order paths.
    pub seed: u64,
    /// Seed of what every scan draws anew: noise, errors of ranges, and speckle of the form `independent`; `seed` when `None`.
    pub noise_seed: Option<u64>,
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
            most_sheets: MOST_SHEETS,
            several_antennas: false,
            seed: 0,
            noise_seed: None,
        }
    }

    /// Whether a region lets a part of the wave through.
    pub(super) fn has_sheets(&self) -> bool {
        self.surfaces.iter().any(|surface| surface.sheet.is_some())
    }

    /// The form of its speckle, for so many rays per chirp.
    pub(super) fn speckle_form(&self, rays: usize) -> SpeckleForm {
        let several_paths = rays > 1 || self.bounce.is_some();
        self.geometry.radar.speckle_form(self.several_antennas, several_paths)
    }

    /// Whether a surface returns a part of its echo in one wave.
    pub(super) fn has_waves(&self) -> bool {
        let beam_rad = Beam::new(self.geometry.radar).towards(0.0, 0.0).divergence_rad();
        self.surfaces.iter().any(|surface| surface.has_wave(beam_rad))
    }

    /// The sheet that a facet belongs to; `None` where nothing passes.
    pub(super) fn sheet(&self, facet: u32) -> Option<&'a Sheet> {
        let region = self.geometry.region_of_facet[facet as usize];
        self.surfaces[usize::from(region)].sheet
    }
}
