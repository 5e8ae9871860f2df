//! The surfaces of a target: scattering model and grain.

use glam::DVec3;

use crate::brdf::Scattering;

/// The surface of the facets of one region.
#[derive(Clone, Copy)]
pub struct Surface<'a> {
    /// Its scattering model.
    pub scattering: &'a dyn Scattering,
    /// Share of its diffuse return, 0 to 1/2, that comes back across the polarisation that was sent. The law is
    /// what comes back in that polarisation, so that this share adds to it.
    pub depolarised_share: f64,
    /// Direction of its grain in the global frame, of any length. On a facet it is projected along the normal. Azimuths
    /// count from it, and `m` of an anisotropic model is the roughness along it.
    pub grain: DVec3,
}

impl<'a> Surface<'a> {
    /// A surface whose grain is the y axis, upwards.
    pub fn new(scattering: &'a dyn Scattering) -> Surface<'a> {
        Surface { scattering, depolarised_share: 0.0, grain: DVec3::Y }
    }
}

/// The orientation of the surface at a hit on a target that effects have moved.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Unit normal, towards the radar.
    pub normal: DVec3,
    /// Azimuth of the radar about it, from the grain of the region, rad.
    pub azimuth_rad: f64,
}
