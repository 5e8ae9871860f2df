//! Rays and meshes for the tests of the tracers.

use glam::DVec3;
use proptest::prelude::*;

use crate::frames::{Global, Point, Ray};
use crate::geometry::Mesh;

/// The ray from a point through another.
pub(super) fn ray(origin: DVec3, through: DVec3) -> Ray<Global> {
    let origin = Point::from(origin);
    Ray { origin, direction: origin.towards(through.into()).unwrap() }
}

/// A mesh of these corners and facets.
pub(super) fn mesh(corners: &[[f64; 3]], facets: &[[u32; 3]]) -> Mesh {
    let vertices = corners.iter().copied().map(DVec3::from).collect();
    Mesh { vertices, facets: facets.to_vec(), labels: vec![] }
}

prop_compose! {
    /// Any facets between random corners in the cube of ±1 m.
    pub(super) fn soup()(
        corners in prop::collection::vec(prop::array::uniform3(-1.0f64..1.0), 3..90),
        picks in prop::collection::vec(prop::array::uniform3(0u32..90), 1..60),
    ) -> Mesh {
        let n = corners.len() as u32;
        let facets: Vec<[u32; 3]> = picks.into_iter().map(|pick| pick.map(|i| i % n)).collect();
        mesh(&corners, &facets)
    }
}
