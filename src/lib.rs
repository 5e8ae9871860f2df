//! `matdb`: a material database and renderer for 300 GHz imaging radar.
//!
//! A chirp's ray leaves the centre of the main reflector, meets a facet of the target at range R and
//! incidence θ, and brings back, by equation (11) of the paper this crate implements
//! (DOI 10.1109/TTHZ.2017.2702590),
//!
//! P_r = P_t · (A_eq/R²) · f(θ) · cos²θ,
//!
//! where P_t and A_eq belong to the instrument ([`radar`]) and f, in 1/sr, to the surface ([`brdf`]).
//! A scan is 18 529 such chirps ([`render`]); what is known of a surface is a
//! [`Material`](material::Material), kept in a [`Store`](store::Store).
//!
//! ```
//! use matdb::brdf::Scattering;
//! use matdb::radar::{Link, Radar};
//! use matdb::units::dbm_from_watts;
//!
//! let paint = matdb::material::builtin::get("mannequin-paint").unwrap()?.scattering()?;
//! let link = Link::new(&Radar::default());
//! let theta_rad = 30f64.to_radians();
//! let beam = link.beam.towards(0.0, 0.0);
//! let power_w = link.power_w(&beam, 8.0, theta_rad.cos(), paint.retro_per_sr(theta_rad));
//! assert!((dbm_from_watts(power_w) + 65.2).abs() < 0.1);
//! # Ok::<(), matdb::error::Error>(())
//! ```
//!
//! # Floors
//!
//! A module uses only modules above it in this list.
//!
//! | | |
//! |---|---|
//! | [`units`], [`lanes`], [`frames`], [`geometry`] | numbers with units, loops in vector instructions, coordinate frames as types, plain meshes and rasters |
//! | [`files`], [`mod@formats`], [`brdf`], [`radar`] | all files or none; bytes to plain data and back; how surfaces scatter; the instrument |
//! | [`material`], [`scene`], [`trace`] | what is known of a surface; what is looked at; closest intersections |
//! | [`effects`] | physical effects beyond the paper's model, one file each |
//! | [`render`] | scan × target × materials → detections, image, cloud |
//! | [`measure`], [`fit`] | a measured cloud → pose → curve; a curve → parameters |
//! | [`diagnose`] | a measured cloud → the effect that the model lacks |
//! | [`store`] | the only SQL |
//! | [`catalogue`] | a database as a catalogue for others: site, tables, records |
//! | [`error`] | every error in one type |
//! | [`setup`], [`report`], [`adopt`], `dataset` | from names to a scene ready to render; what a person reads; what goes back into the database; many labelled scans |
//! | [`cli`] | one command per file |
//!
//! Inside are SI units, watts and radians; dB, dBm and degrees appear where people and files do, and
//! every name says which.

#![warn(missing_docs)]

// The order of these lines is the law: a module uses only modules declared above it
// (`tests/floors.rs` checks it).
pub mod units;
pub mod lanes;
pub mod frames;
pub mod geometry;
pub mod files;
pub mod formats;
pub mod brdf;
pub mod radar;
pub mod material;
pub mod scene;
pub mod trace;
pub mod effects;
pub mod render;
pub mod measure;
pub mod fit;
pub mod diagnose;
pub mod store;
pub mod catalogue;
pub mod error;
pub mod setup;
pub mod report;
pub mod adopt;
#[cfg(feature = "parquet")]
pub mod dataset;
pub mod cli;

/// Runs the examples of the book's page about the library.
#[cfg(doctest)]
#[doc = include_str!("../docs/rust-library.md")]
struct RustLibraryPage;
