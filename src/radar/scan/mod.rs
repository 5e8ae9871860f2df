//! A scan: one ray per chirp, and when.

mod chirps;
mod draw;
mod explicit;
pub(super) mod pattern;

pub use super::frames::PATTERN_RANGE_M;
pub use chirps::{Chirps, Field};
pub use pattern::{AngularRaster, Elliptical, Explicit, Lissajous, Pattern, Raster, Spiral};
