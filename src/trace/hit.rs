//! Where a ray meets a facet.

use rayon::prelude::*;

use crate::frames::{Global, Point};

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
pub(super) fn no_hits(rays: usize) -> Vec<Option<Hit>> {
    (0..rays).into_par_iter().with_min_len(1 << 14).map(|_| None).collect()
}

impl Hit {
    /// Incidence angle θ, rad.
    pub fn theta_rad(&self) -> f64 {
        self.cos_theta.min(1.0).acos()
    }
}
