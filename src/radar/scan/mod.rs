//! A scan: one ray per chirp, and when.

mod chirps;
mod draw;
mod explicit;
pub(super) mod pattern;

pub use chirps::{Chirps, Field, PATTERN_RANGE_M};
pub use pattern::{Elliptical, Explicit, Lissajous, Pattern, Raster, Spiral};
