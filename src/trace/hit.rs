//! The intersection of a ray with a facet.

use rayon::prelude::*;

use crate::frames::{Global, Point};

/// The intersection of a ray with a facet, computed in f64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Facet number in the mesh.
    pub facet: u32,
    /// Distance R from the ray's origin, m.
    pub range_m: f64,
    /// The intersection point.
    pub point: Point<Global>,
    /// Cosine of the incidence angle, between the reversed ray and the facet's normal on the ray's side; 0 to 1.
    pub cos_theta: f64,
}

/// Allocates the hits of this number of rays, all `None`, on all threads: the first access to fresh memory is a
/// large part of the time that tracing many rays takes.
pub(super) fn allocate_hits(rays: usize) -> Vec<Option<Hit>> {
    (0..rays).into_par_iter().with_min_len(1 << 14).map(|_| None).collect()
}

impl Hit {
    /// Incidence angle θ, rad.
    pub fn theta_rad(&self) -> f64 {
        self.cos_theta.min(1.0).acos()
    }
}
