//! Closest hits of rays on a mesh.
//!
//! [`Fan`] finds what rays of one origin meet, as the rays of a scan are, and builds nothing for it. [`Bvh`]
//! takes any ray and finds facets with boxes; a [`Gpu`] does the same with many rays at once. All look in
//! f32 and decide and measure in f64; [`brute`] is the naive loop that judges them, and [`Tracer`] chooses.
//! All take any mesh that passes [`Mesh::validate`](crate::geometry::Mesh::validate) and lies within
//! 100 km, where f32 does its work; facets without area are never hit.

mod boxes;
pub mod brute;
mod bvh;
mod eightfold;
mod facet;
mod gpu;
mod inside;
mod pinhole;
mod tracer;
mod wide;

use rayon::prelude::*;

use crate::frames::{Global, Point};

pub use bvh::Bvh;
pub use gpu::{Answer, Gpu, GpuError, Held};
pub(crate) use gpu::{Cone, Lit, RAYS_PER_SHARE, Share};
pub use inside::winding_number;
pub use pinhole::{Fan, NoFan};
pub use tracer::{TraceError, Tracer, closest};

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

/// Room for the hits of so many rays, whose memory all threads touch first: to first touch it is much of the work of
/// many rays.
fn no_hits(rays: usize) -> Vec<Option<Hit>> {
    (0..rays).into_par_iter().with_min_len(1 << 14).map(|_| None).collect()
}

impl Hit {
    /// Incidence angle θ, rad.
    pub fn theta_rad(&self) -> f64 {
        self.cos_theta.min(1.0).acos()
    }
}
