//! Whether a point lies inside a mesh: the winding number.

use std::f64::consts::PI;

use glam::DVec3;

use crate::frames::{Global, Point};
use crate::geometry::Mesh;

/// The winding number of a mesh about a point: 0 outside a closed mesh and ±1 inside (negative where its facets run
/// clockwise seen from outside). It is larger inside overlapping meshes, and a fraction near an open one.
///
/// It is the sum of the solid angles of all facets over 4π, each by Van Oosterom and Strackee 1983,
/// DOI 10.1109/TBME.1983.325207.
pub fn winding_number(mesh: &Mesh, point: Point<Global>) -> f64 {
    (0..mesh.facets.len()).map(|facet| solid_angle_sr(mesh, facet, point.xyz)).sum::<f64>()
        / (4.0 * PI)
}

/// Signed solid angle of a facet seen from a point, sr.
fn solid_angle_sr(mesh: &Mesh, facet: usize, from: DVec3) -> f64 {
    let [a, b, c] = mesh.corners(facet).map(|corner| corner - from);
    let [u, v, w] = [a.length(), b.length(), c.length()];
    let volume = a.dot(b.cross(c));
    2.0 * volume.atan2(u * v * w + a.dot(b) * w + b.dot(c) * u + c.dot(a) * v)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{mannequin, solids};

    fn wound(mesh: &Mesh, x: f64, y: f64, z: f64) -> f64 {
        winding_number(mesh, Point::new(x, y, z))
    }

    #[test]
    fn a_sphere_and_a_body_have_an_inside() {
        let sphere = solids::icosphere(0.5, 3);
        assert!((wound(&sphere, 0.1, 0.2, -0.3) - 1.0).abs() < 1e-9);
        assert!(wound(&sphere, 0.1, 0.2, -0.6).abs() < 1e-9);
        let body = mannequin::mannequin();
        assert!((wound(&body, 0.0, 1.2, 0.0).abs() - 1.0).abs() < 1e-6);
        assert!(wound(&body, 0.0, 1.2, 1.0).abs() < 1e-6);
    }

    #[test]
    fn overlapping_bodies_wind_twice_and_an_open_wall_at_most_half() {
        let mut two = solids::icosphere(0.5, 3);
        two.append(&solids::icosphere(0.5, 2)).unwrap();
        assert!((wound(&two, 0.1, 0.0, 0.0) - 2.0).abs() < 1e-9);
        let wall = solids::plate(40.0, 40.0);
        assert!(wound(&wall, 1.0, 1.1, -5.0).abs() < 0.5);
    }
}
