//! Whether a point lies inside a closed mesh.

use glam::DVec3;

use super::facet::crossing_m;
use crate::frames::{Direction, Global, Point, Ray};
use crate::geometry::Mesh;

/// Directions that no edge of a built solid runs along.
const DIRECTIONS: [[f64; 3]; 3] =
    [[0.531, 0.677, 0.509], [-0.611, 0.283, 0.739], [0.197, -0.859, -0.473]];

/// Whether rays from a point leave the mesh an odd number of times, in most of three directions.
///
/// Open meshes have no inside; there the answer is a guess.
pub fn encloses(mesh: &Mesh, point: Point<Global>) -> bool {
    let is_odd = |direction: &[f64; 3]| {
        let Some(direction) = Direction::new(DVec3::from_array(*direction)) else { return false };
        let ray = Ray { origin: point, direction };
        let crosses = |&facet: &usize| crossing_m(mesh, facet, &ray).is_some();
        (0..mesh.facets.len()).filter(crosses).count() % 2 == 1
    };
    DIRECTIONS.iter().filter(|direction| is_odd(direction)).count() >= 2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{mannequin, solids};

    #[test]
    fn a_sphere_and_a_body_have_an_inside() {
        let sphere = solids::icosphere(0.5, 3);
        assert!(encloses(&sphere, Point::new(0.1, 0.2, -0.3)));
        assert!(!encloses(&sphere, Point::new(0.1, 0.2, -0.6)));
        let body = mannequin::mannequin();
        assert!(encloses(&body, Point::new(0.0, 1.2, 0.0)));
        assert!(!encloses(&body, Point::new(0.0, 1.2, 1.0)));
    }
}
