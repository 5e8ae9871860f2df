//! The instrument's frames, placed in the global one by equations (3) and (4).

use super::settings::Radar;
use crate::frames::{
    Antenna, Global, Point, Pose, Target, antenna_from_target, global_from_antenna,
};

/// The instrument's frames, placed in the global one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarFrames {
    /// Equation (4) after equation (3).
    pub global_from_target: Pose<Global, Target>,
    /// O_c in the target frame.
    pub reflector_centre: Point<Target>,
}

impl Radar {
    /// The typed poses of equations (3) and (4).
    pub fn frames(&self) -> RadarFrames {
        let point = glam::DVec3::from_array;
        RadarFrames {
            global_from_target: global_from_antenna(
                self.alpha_deg.to_radians(),
                Point::from(point(self.primary_focus_m)),
            ) * antenna_from_target(
                self.tau_deg.to_radians(),
                Point::<Antenna>::from(point(self.secondary_focus_m)),
            ),
            reflector_centre: Point::from(point(self.reflector_centre_m)),
        }
    }
}

impl RadarFrames {
    /// O_c in the global frame: where every ray starts and every range is measured from.
    pub fn origin(&self) -> Point<Global> {
        self.global_from_target * self.reflector_centre
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_stands_eight_metres_in_front_of_the_target() {
        let radar = Radar::default();
        radar.validate().unwrap();
        let frames = radar.frames();
        assert!(frames.origin().distance_m(Point::new(0.0, 1.1, 8.0)) < 1e-12);
        let focus = frames.global_from_target * Point::new(0.0, 0.0, 0.0);
        assert!(focus.distance_m(Point::new(0.0, 1.1, 0.0)) < 1e-12);
    }
}
