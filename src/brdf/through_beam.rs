//! A law as a beam sees it.

use super::scattering::Scattering;
use crate::frames::{Direction, Surface};

/// A law as a beam of some divergence sees it: its lobes are wider, since the beam has many directions.
#[derive(Clone, Copy)]
pub struct ThroughBeam<'a> {
    /// The law.
    pub law: &'a dyn Scattering,
    /// Divergence of the beam δ, rad, 0 or more.
    pub beam_rad: f64,
}

impl Scattering for ThroughBeam<'_> {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        if self.beam_rad == 0.0 {
            return self.law.f_per_sr(i, o);
        }
        self.law.seen_by(self.beam_rad, i, o).f_per_sr
    }
}

/// How far a beam of a divergence δ, rad, widens lobes, rad. Lobes that include the beam that saw them,
/// with the narrowest of this width, are not widened again, and are only never narrower than the beam.
pub(crate) fn widening_rad(seen_lobe_rad: Option<f64>, divergence_rad: f64) -> f64 {
    match seen_lobe_rad {
        None => divergence_rad,
        Some(lobe_rad) => (divergence_rad * divergence_rad - lobe_rad * lobe_rad).max(0.0).sqrt(),
    }
}
