//! Meshes that are hard to trace, and rays at them.

use glam::DVec3;
use matdb::frames::{Global, Point, Ray};
use matdb::geometry::Mesh;

pub fn mesh(corners: &[[f64; 3]], facets: &[[u32; 3]]) -> Mesh {
    let vertices = corners.iter().copied().map(DVec3::from).collect();
    Mesh { vertices, facets: facets.to_vec(), labels: vec![] }
}

pub fn ray(from: DVec3, to: DVec3) -> Ray<Global> {
    let origin = Point::from(from);
    Ray { origin, direction: origin.towards(to.into()).unwrap() }
}

/// Points of a square in the plane z = 0.
pub fn square(side: usize, half_m: f64) -> impl Iterator<Item = DVec3> {
    let at = move |i: usize| half_m * (2.0 * (i as f64 + 0.5) / side as f64 - 1.0);
    (0..side * side).map(move |i| DVec3::new(at(i % side), at(i / side), 0.0))
}

/// Every corner, the middle of every edge, and two more of its points.
pub fn edges(mesh: &Mesh) -> Vec<DVec3> {
    let of_facet = |facet: usize| {
        let [a, b, c] = mesh.corners(facet);
        [a, 0.5 * (a + b), b + (c - b) / 3.0, a.lerp(c, 0.618)]
    };
    (0..mesh.facets.len()).flat_map(of_facet).collect()
}

/// For an eye at (0, 0, 3): 0 and 1 are the same, 2 is that turned around, 3 lies beside it and in part behind, 4 has no
/// area, 5 is behind the eye, 6 goes through its plane, and 7 is a needle that begins there.
pub fn pile() -> Mesh {
    let corners = [
        [-1.0, -1.0, 0.3],
        [1.0, -1.0, -0.2],
        [0.9, 1.0, 0.1],
        [-1.0, 1.0, 0.0],
        [-1.0, -1.0, 5.0],
        [1.0, -1.0, 5.0],
        [0.0, 1.0, 5.0],
        [-9.0, -0.2, -20.0],
        [9.0, -0.2, -20.0],
        [0.0, -0.2, 30.0],
        [0.0, 0.0, 3.0],
        [0.01, 0.01, -4.0],
        [0.03, 0.0, -4.0],
    ];
    let facets =
        [[0, 1, 2], [1, 2, 0], [0, 2, 1], [0, 2, 3], [0, 0, 2], [4, 5, 6], [7, 8, 9], [10, 11, 12]];
    mesh(&corners, &facets)
}

/// A fan of needles 1 m long and 1 µm wide, and slivers that are seen almost edge-on from afar along z.
pub fn needles() -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..400u32 {
        let (x, n) = (1e-6 * f64::from(i), mesh.vertices.len() as u32);
        mesh.vertices.extend([
            DVec3::new(x, -0.5, 0.0),
            DVec3::new(x + 1e-6, -0.5, 0.0),
            DVec3::new(x, 0.5, 0.1),
            DVec3::new(0.1 + x, 0.0, 0.0),
            DVec3::new(0.1 + x * 1.1, 0.2, 0.3),
            DVec3::new(0.1 + x, 0.1, -3.0),
        ]);
        mesh.facets.extend([[n, n + 1, n + 2], [n + 3, n + 4, n + 5]]);
    }
    mesh
}

/// One facet in the plane z = 0.
pub fn one_facet() -> Mesh {
    mesh(&[[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]], &[[0, 1, 2]])
}
