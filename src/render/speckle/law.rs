//! Speckle by its law: a lattice of noise for each number of sheets in front of what is seen.

use num_complex::Complex;

use super::aims::aims;
use super::identity::Identity;
use super::lattice::{Aim, Lattice};
use crate::frames::{Global, Pose};
use crate::render::error::RenderError;
use crate::render::observer::Observer;
use crate::render::setup::Setup;

/// The law's field for the chirps of a scan. Antennas have independent fields, as if they stood far apart.
pub(in crate::render) struct Law {
    aims: Vec<Aim>,
    layers: Vec<Lattice>,
}

impl Law {
    /// The field over so many layers, one behind the other, of a target in a pose.
    ///
    /// # Errors
    /// When the scan needs more values than memory should hold.
    pub fn new(
        setup: &Setup,
        observer: Observer,
        layers: usize,
        target: Pose<Global, Global>,
        looks: usize,
    ) -> Result<Law, RenderError> {
        let radar = setup.geometry.radar;
        let aims = aims(radar, setup.geometry.chirps);
        if !Lattice::fits(&aims, looks, layers) {
            return Err(RenderError::SpeckleField);
        }
        // The field lies across the beams and not on the mesh: it must be another one as soon as either moves.
        let target_from_global = radar.frames().global_from_target.inverse();
        let seen = |vertex| target_from_global * (target * vertex);
        let layers = (0..layers as u64).map(|layer| {
            let identity = Identity::of(setup, seen, [observer.number(), layer]);
            Lattice::new(&aims, identity, looks).ok_or(RenderError::SpeckleField)
        });
        let layers = layers.collect::<Result<_, _>>()?;
        Ok(Law { aims, layers })
    }

    /// Replaces `amplitudes` by those of a chirp behind a number of sheets, one per look.
    pub fn amplitudes(&self, chirp: usize, sheets: u8, amplitudes: &mut Vec<Complex<f64>>) {
        let layer = usize::from(sheets).min(self.layers.len() - 1);
        self.layers[layer].amplitudes(&self.aims[chirp], amplitudes);
    }
}
