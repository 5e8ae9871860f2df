//! The instrument: its constants, where its rays go, and how much power comes back.

pub mod link;
pub mod preset;
pub mod scan;

pub use link::{Footprint, Link};
pub use preset::{Radar, RadarError, RadarFrames};
pub use scan::{Elliptical, Pattern};
