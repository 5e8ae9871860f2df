//! Physical effects beyond the paper's model: one file each, one interface, the same object in a
//! diagnosis and in a prediction.
//!
//! A prediction starts from what the scene knows of every chirp, a [`Shot`], and asks every effect in
//! turn for each of four things; an effect answers those that it changes:
//!
//! 1. where and how the chirp hits the target ([`Effect::motion`]): pose, motion;
//! 2. how the surface scatters ([`Effect::scatter`]): subsurface, thin film, anisotropy, shadowing;
//! 3. how much power arrives ([`Effect::gain`], [`Effect::arrive`]): layers, patches, gains, bounces;
//! 4. what the receiver reports of it ([`Effect::receive`]): compression, speckle, noise, tilts that vary
//!    at random.
//!
//! An effect whose parameters are at their [`absent`](EffectParameter::absent) values changes nothing,
//! exactly. [`library`] has all effects; another one is a file and a line of its list.

mod cache;
mod ceiling;
mod declared;
mod echo;
mod effect;
mod entry;
mod intersection;
mod library;
mod lobes;
mod model;
mod place;
mod receiver;
mod shot;
mod spread;
#[cfg(test)]
mod testing;
mod tilt;

pub use ceiling::{Ceiling, Output, SaturationCurve};
pub use declared::SceneEffects;
pub use echo::MeanEcho;
pub use effect::{About, Conflict, Effect, EffectParameter, Level, Setting, Survey};
pub use entry::{EffectError, EffectList, entry, resolve};
pub(crate) use intersection::shot_at;
pub(crate) use library::rank;
pub use library::{find, library};
pub use model::{Model, Prediction, PredictionCache, Tilts};
pub use place::Place;
pub use receiver::Receiver;
pub use shot::{Shot, Stage, middle};
pub use tilt::tilted_cos_theta;
