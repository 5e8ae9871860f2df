//! Physical effects beyond the paper's model. Each has a file; all share one interface, which diagnosis and
//! rendering use.
//!
//! A prediction starts from the [`Shot`] of every chirp. Each effect then overrides the steps that it changes:
//!
//! 1. intersection with the target ([`Effect::motion`]): pose, motion;
//! 2. scattering ([`Effect::scatter`]): subsurface, thin film, anisotropy, shadowing;
//! 3. received power ([`Effect::gain`], [`Effect::arrive`]): layers, patches, gains, bounces;
//! 4. detection by the receiver ([`Effect::receive`]): compression, speckle, noise, random tilts.
//!
//! An effect whose parameters are at their [`absent`](EffectParameter::absent) values changes nothing,
//! exactly. [`library`] lists all effects; a new one is a file and a line of the list.

mod antenna;
mod cache;
mod ceiling;
mod declared;
mod echo;
mod effect;
mod entry;
mod intersection;
mod library;
mod lobes;
mod member;
mod model;
mod onset;
mod place;
mod range_cell;
mod ranked;
mod receiver;
mod shot;
mod spread;
#[cfg(test)]
mod testing;
mod tilt;
mod twist;
mod way_back;

pub use antenna::Antenna;
pub use ceiling::{Ceiling, SaturationCurve};
pub use declared::SceneEffects;
pub use echo::MeanEcho;
pub use effect::{About, Conflict, Effect, EffectParameter, Level, Setting, Survey};
pub use entry::{EffectError, EffectList, entry, resolve};
pub(crate) use intersection::shot_at;
pub(crate) use library::finite_spot::BeamSpot;
pub(crate) use library::multi_bounce::SecondBounce;
pub(crate) use library::rank;
pub use library::{find, library};
pub(crate) use member::family;
pub use model::{Model, Prediction, PredictionCache, Tilts};
pub use place::Place;
pub(crate) use range_cell::RangeCell;
pub(crate) use receiver::MOST_LOOKS;
pub use receiver::Receiver;
pub(crate) use shot::mean;
pub use shot::{Shot, Stage, middle};
pub use tilt::tilted_cos_theta;
pub use twist::Twist;
pub(crate) use twist::way_m;
