//! Speckle as a field that is fixed to the surface: what the incoherent part of an echo is multiplied by.
//!
//! Chirps whose spots overlap see the same scatterers, so that their speckle is alike: in the paper's scan some 22 of them
//! share one. A repeated scan of the same target sees the same field, and another pose or frequency another one.

mod aims;
mod cell;
mod identity;
mod lattice;
mod law;
mod placement;
mod scatterers;

use num_complex::Complex;

use super::error::RenderError;
use super::observer::Observer;
use super::setup::Setup;
use super::spot::Footprints;
use crate::frames::Pose;
use crate::radar::SpeckleForm;
pub(super) use cell::{Cell, EVERYWHERE};
pub(super) use law::Law;
pub(super) use scatterers::Scatterers;

/// The field of a scan at one antenna.
pub(super) enum Field<'a> {
    /// A Gaussian field with the correlation of the beams.
    Law(Law),
    /// Scatterers on the facets.
    Scatterers(Box<Scatterers<'a>>),
}

/// What the incoherent part of an echo is multiplied by.
pub(super) enum Fluctuation<'a> {
    /// Nothing.
    None,
    /// Draws of their own for every echo, over this many looks.
    Independent(f64),
    /// The field of the scatterers.
    Field(Field<'a>),
}

impl<'a> Field<'a> {
    /// The field that the radar's speckle declares, for what the rays of a scan meet.
    ///
    /// # Errors
    /// When the scan needs more values than memory should hold, or scatterers are asked for and its rays start from several
    /// places.
    pub fn new(
        setup: &'a Setup<'a>,
        observer: Observer,
        footprints: &Footprints,
        looks: usize,
    ) -> Result<Field<'a>, RenderError> {
        match setup.speckle_form(footprints.rays_per_chirp) {
            SpeckleForm::Scatterers => {
                Ok(Field::Scatterers(Box::new(Scatterers::new(setup, observer, looks)?)))
            }
            SpeckleForm::Law | SpeckleForm::Independent => {
                let layers = 1 + footprints.behind.len();
                Ok(Field::Law(Law::new(setup, observer, layers, Pose::NONE, looks)?))
            }
        }
    }

    /// Replaces `amplitudes` by those of the incoherent part of an echo, one per look: of unit mean square, with the phase
    /// of a beat, which grows with the range, over that of an echo from the cell's range.
    pub fn amplitudes(&self, chirp: usize, cell: &Cell, amplitudes: &mut Vec<Complex<f64>>) {
        match self {
            Field::Law(law) => law.amplitudes(chirp, cell.sheets, amplitudes),
            Field::Scatterers(scatterers) => scatterers.amplitudes(chirp, cell, amplitudes),
        }
    }
}
