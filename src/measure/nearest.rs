//! Nearest neighbours among points of space. The only file that knows which k-d tree is used.

use glam::DVec3;
use kiddo::{ImmutableKdTree, SquaredEuclidean};

/// A k-d tree over fixed points.
pub struct Nearest {
    tree: ImmutableKdTree<f64, 3>,
}

impl Nearest {
    /// The tree over all points; `None` when there are none or one is not finite.
    pub fn new(points: &[DVec3]) -> Option<Nearest> {
        if points.is_empty() || points.iter().any(|point| !point.is_finite()) {
            return None;
        }
        let points: Vec<[f64; 3]> = points.iter().map(DVec3::to_array).collect();
        Some(Nearest { tree: ImmutableKdTree::new_from_slice(&points).ok()? })
    }

    /// Number of the point nearest to `place` and its distance, in the points' unit.
    pub fn find(&self, place: DVec3) -> (usize, f64) {
        let query = place.to_array();
        let found = self.tree.query(&query).nearest_one::<SquaredEuclidean<f64>>().execute();
        (found.item as usize, found.distance.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn naive_m(points: &[DVec3], place: DVec3) -> f64 {
        points.iter().map(|p| p.distance(place)).fold(f64::INFINITY, f64::min)
    }

    proptest! {
        #[test]
        fn the_tree_agrees_with_the_naive_loop(
            points in prop::collection::vec(prop::array::uniform3(-3i8..3), 1..300),
            place in prop::array::uniform3(-4.0f64..4.0),
        ) {
            // Whole numbers: many points coincide.
            let points: Vec<DVec3> =
                points.into_iter().map(|p| DVec3::from_array(p.map(f64::from))).collect();
            let place = DVec3::from_array(place);
            let (number, distance) = Nearest::new(&points).unwrap().find(place);
            prop_assert!((points[number].distance(place) - distance).abs() < 1e-12);
            prop_assert!((naive_m(&points, place) - distance).abs() < 1e-12);
        }
    }

    #[test]
    fn a_thousand_equal_points_are_a_tree() {
        let tree = Nearest::new(&[DVec3::ONE; 1000]).unwrap();
        assert!((tree.find(DVec3::ZERO).1 - 3f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn nothing_and_nan_are_no_tree() {
        assert!(Nearest::new(&[]).is_none());
        assert!(Nearest::new(&[DVec3::NAN]).is_none());
    }
}
