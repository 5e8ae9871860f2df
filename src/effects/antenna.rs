//! An antenna apart from the radar's.

use crate::frames::{Global, Point};

/// An antenna apart from the radar's, with the same gain for all directions to the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Antenna {
    /// Its position.
    pub position: Point<Global>,
    /// Equivalent area A_eq, m²; none for an antenna like the radar's, focused on the same spot.
    pub aperture_m2: Option<f64>,
}

impl Antenna {
    /// Half of the way from the radar by way of a point to the antenna, m.
    pub(crate) fn half_way_m(&self, radar: Point<Global>, point: Point<Global>) -> f64 {
        0.5 * (radar.distance_m(point) + point.distance_m(self.position))
    }
}
