//! Closest hits of rays on a mesh.
//!
//! [`Bvh`] finds facets with boxes in f32 and decides and measures in f64; [`brute`] is the naive
//! loop that judges it. Both take any mesh that passes [`Mesh::validate`](crate::geometry::Mesh::validate) and lies within 100 km, where
//! f32 does its work; facets without area are never hit.

pub mod brute;
mod bvh;
mod facet;
mod inside;

use crate::frames::{Global, Point};

pub use bvh::Bvh;
pub use inside::winding_number;

/// Where a ray meets a facet, in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Facet number in the mesh.
    pub facet: u32,
    /// Distance from the ray's origin R, m.
    pub range_m: f64,
    /// Where it is.
    pub point: Point<Global>,
    /// Cosine of the angle between the reversed ray and the facet's normal turned to the radar.
    pub cos_theta: f64,
}

impl Hit {
    /// Incidence angle θ, rad.
    pub fn theta_rad(&self) -> f64 {
        self.cos_theta.min(1.0).acos()
    }
}
