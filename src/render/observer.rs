//! Where echoes are received: at the radar, or at a separate receiver.

use glam::DVec3;

use crate::effects::Antenna;
use crate::frames::{Global, Point, Ray};

/// The antenna that receives the echoes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Observer {
    /// The antenna with which the radar transmits.
    Radar,
    /// Another antenna, with the same gain for all directions to the target.
    Receiver {
        /// Its number, from 1. Every receiver has its own noise and speckle.
        number: u32,
        /// Its position.
        position: Point<Global>,
        /// Equivalent area A_eq, m²; none for an antenna like the radar's, focused on the same spot.
        aperture_m2: Option<f64>,
    },
}

impl Observer {
    /// Number of the observer, 0 for the radar.
    pub(super) fn number(&self) -> u64 {
        match self {
            Observer::Radar => 0,
            Observer::Receiver { number, .. } => (*number).into(),
        }
    }

    /// The antenna, where it is not the radar's own.
    pub(super) fn antenna(&self) -> Option<Antenna> {
        match *self {
            Observer::Radar => None,
            Observer::Receiver { position, aperture_m2, .. } => {
                Some(Antenna { position, aperture_m2 })
            }
        }
    }

    /// Its position, for a radar at `origin`.
    pub(super) fn position(&self, origin: DVec3) -> DVec3 {
        match self {
            Observer::Radar => origin,
            Observer::Receiver { position, .. } => position.xyz,
        }
    }

    /// The point on the beam's axis to which an echo of path length 2·`range_m` belongs; `None` if there is none.
    ///
    /// For the vector b from source to receiver, the unit vector d of the axis and the distance s along it,
    /// s + |s·d − b| = 2R gives s = (4R² − b²)/(4R − 2·b·d).
    pub(super) fn on_axis(&self, axis: &Ray<Global>, range_m: f64) -> Option<Point<Global>> {
        let (origin, direction) = (axis.origin.xyz, axis.direction.xyz());
        let base = self.position(origin) - origin;
        let path_m = 2.0 * range_m;
        let along_m = match self {
            Observer::Radar => range_m,
            // The path is shorter than the distance between the antennas.
            Observer::Receiver { .. } if path_m <= base.length() => return None,
            Observer::Receiver { .. } => {
                let left_m2 = path_m * path_m - base.length_squared();
                left_m2 / (2.0 * (path_m - base.dot(direction)))
            }
        };
        (along_m > 0.0 && along_m.is_finite()).then(|| Point::from(origin + along_m * direction))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bistatic_range_leads_back_to_its_point() {
        let origin = Point::new(0.0, 1.1, 8.0);
        let target = Point::new(0.1, 1.3, 0.2);
        let axis = Ray { origin, direction: origin.towards(target).unwrap() };
        let position = Point::new(2.0, 1.0, 5.0);
        let receiver = Observer::Receiver { number: 1, position, aperture_m2: Some(0.1) };
        let range_m = 0.5 * (origin.distance_m(target) + target.distance_m(position));
        let found = receiver.on_axis(&axis, range_m).unwrap();
        assert!(found.distance_m(target) < 1e-12);
        let direct = Observer::Radar.on_axis(&axis, origin.distance_m(target)).unwrap();
        assert!(direct.distance_m(target) < 1e-12);
        // The path is shorter than the distance between the antennas.
        assert!(receiver.on_axis(&axis, 1.0).is_none());
    }
}
