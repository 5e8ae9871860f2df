//! `matdb`: a material database and renderer for 300 GHz imaging radar.

#![warn(missing_docs)]

// The order of these lines is the law: a module uses only modules declared above it
// (`tests/floors.rs` checks it).
pub mod units;
pub mod frames;
pub mod geometry;
pub mod brdf;
pub mod radar;
pub mod formats;
pub mod material;
pub mod scene;
pub mod trace;
pub mod render;
pub mod store;
pub mod error;
pub mod cli;
