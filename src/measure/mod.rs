//! A measured cloud → pose → angles of incidence → a curve that belongs to a material.

pub mod curve;

pub use curve::{Curve, Row};
