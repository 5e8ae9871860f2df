//! The instrument: its constants, where its rays go, and how much power comes back.

pub mod beam;
pub mod chirp;
pub mod f5;
pub mod link;
pub mod mirror;
pub mod noise;
pub mod preset;
pub mod random;
pub mod receiver;
pub mod scan;
pub mod speckle;
pub mod window;

pub use beam::Beam;
pub use chirp::{Aliased, Chirp, ChirpEntry, Return};
pub use f5::F5;
pub use link::{Footprint, Link};
pub use mirror::{Mirror, MirrorAngles, Optics};
pub use noise::Noise;
pub use preset::{Radar, RadarError, RadarFrames};
pub use receiver::{Detection, RangeProcessor, Receiver};
pub use scan::{Chirps, Field, Pattern};
pub use speckle::Speckle;
pub use window::Window;
