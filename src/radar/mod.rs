//! The instrument: its constants, where its rays go, and how much power comes back.

pub mod beam;
mod check;
pub mod chirp;
mod error;
pub mod f5;
mod frames;
pub(crate) mod jones;
pub mod link;
pub mod mirror;
pub mod noise;
pub mod polarisation;
mod preset;
pub mod random;
pub mod receiver;
pub mod reference;
pub mod scan;
mod settings;
pub mod speckle;
pub mod transmitter;
pub mod window;

pub use beam::{Beam, GaussianBeam, Section};
pub use chirp::{AliasError, Chirp, ChirpEntry, Return};
pub use error::{F5Error, RadarError};
pub use f5::F5;
pub use frames::RadarFrames;
pub use link::{Link, SolidAngle};
pub use mirror::{Mirror, MirrorAngles, Optics};
pub use noise::Noise;
pub use polarisation::{Channel, Polarisation};
pub use preset::PRESETS;
pub use receiver::{Detection, RangeProcessor, Receiver};
pub use scan::{Chirps, Field, Pattern};
pub use settings::{BeamEntry, Footprint, Radar, Returns, SpotDiameter};
pub use speckle::{EarlierSpeckle, IndependentSpeckle, Speckle, SpeckleForm};
pub use transmitter::{Leakage, PhaseNoise, SweepRipple};
pub use window::Window;
