//! The instrument: its constants, where its rays go, and how much power comes back.

pub mod beam;
pub mod f5;
pub mod link;
pub mod mirror;
pub mod preset;
pub mod scan;

pub use beam::Beam;
pub use f5::F5;
pub use link::{Footprint, Link};
pub use mirror::{Mirror, MirrorAngles, Optics};
pub use preset::{Radar, RadarError, RadarFrames};
pub use scan::{Chirps, Field, Pattern};
