//! The instrument's frames, placed in the global one by equations (3) and (4), or by a place and what it looks at.

use glam::{DMat3, DVec3};

use super::error::RadarError;
use super::settings::Radar;
use crate::frames::{
    Antenna, Global, Point, Pose, Target, antenna_from_target, global_from_antenna,
};

/// Range at which a pattern is drawn in the target plane of the paper's radar, m (Sec. III-B).
pub const PATTERN_RANGE_M: f64 = 8.0;

/// The instrument's frames, placed in the global one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadarFrames {
    /// Equation (4) after equation (3); or the pose of a plane across the line of sight.
    pub global_from_target: Pose<Global, Target>,
    /// O_c in the target frame.
    pub reflector_centre: Point<Target>,
    /// Range at which a pattern has its sizes, m: 8, as in the paper's Sec. III-B, or as far as the radar looks.
    pub pattern_range_m: f64,
}

/// The place of a radar without the paper's frames.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    position: DVec3,
    look_at: DVec3,
    up: DVec3,
}

impl Radar {
    /// The typed poses of equations (3) and (4), or those of `position_m` and `look_at_m`.
    pub fn frames(&self) -> RadarFrames {
        if let Some(frames) = self.place().and_then(|place| place.frames()) {
            return frames;
        }
        let [centre, secondary, primary] =
            [self.reflector_centre_m, self.secondary_focus_m, self.primary_focus_m]
                .map(DVec3::from_array);
        RadarFrames {
            global_from_target: global_from_antenna(
                self.alpha_deg.to_radians(),
                Point::from(primary),
            ) * antenna_from_target(
                self.tau_deg.to_radians(),
                Point::<Antenna>::from(secondary),
            ),
            reflector_centre: Point::from(centre),
            pattern_range_m: PATTERN_RANGE_M,
        }
    }

    fn place(&self) -> Option<Place> {
        let [position, look_at] = [self.position_m?, self.look_at_m?].map(DVec3::from_array);
        Some(Place { position, look_at, up: self.up.map_or(DVec3::Y, DVec3::from_array) })
    }

    /// Refuses half a place, one that is no place, and two.
    pub(super) fn validate_place(&self) -> Result<(), RadarError> {
        let (name, way_out) = match (self.position_m, self.look_at_m, self.up) {
            (None, None, None) => return Ok(()),
            (None, ..) => ("position_m", "say where the rays start"),
            (_, None, _) => ("look_at_m", "say what the radar looks at"),
            _ if !self.has_papers_frames_of_preset() => {
                return Err(RadarError::TwoPlaces);
            }
            _ if self.place().and_then(|place| place.frames()).is_none() => {
                return Err(RadarError::NoPlace);
            }
            _ => return Ok(()),
        };
        Err(RadarError::HalfAPlace { name, way_out })
    }

    /// Whether the keys of the paper's frames are as the preset has them.
    fn has_papers_frames_of_preset(&self) -> bool {
        let preset = Radar::default();
        let own = Radar {
            reflector_centre_m: self.reflector_centre_m,
            secondary_focus_m: self.secondary_focus_m,
            primary_focus_m: self.primary_focus_m,
            tau_deg: self.tau_deg,
            alpha_deg: self.alpha_deg,
            ..preset.clone()
        };
        own == preset
    }
}

impl Place {
    /// The target plane goes through what the radar looks at, across the line of sight; y_t is as near to up as it can
    /// be. None where that is no frame.
    fn frames(&self) -> Option<RadarFrames> {
        /// Directions nearer to each other span no plane, rad.
        const PARALLEL_RAD: f64 = 1e-6;
        const FARTHEST_M: f64 = 1e4;
        let range_m = self.position.distance(self.look_at);
        let z = (self.position - self.look_at).try_normalize()?;
        let x = self.up.try_normalize()?.cross(z);
        let is_near = self.position.abs().max(self.look_at.abs()).max_element() <= FARTHEST_M;
        let is_frame =
            is_near && x.length() > PARALLEL_RAD && (1e-3..=FARTHEST_M).contains(&range_m);
        let x = x.try_normalize().filter(|_| is_frame)?;
        Some(RadarFrames {
            global_from_target: Pose::new(DMat3::from_cols(x, z.cross(x), z), self.look_at),
            reflector_centre: Point::new(0.0, 0.0, range_m),
            pattern_range_m: range_m,
        })
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

    #[test]
    fn a_place_that_is_the_presets_gives_its_frames() {
        let placed = Radar {
            position_m: Some([0.0, 1.1, 8.0]),
            look_at_m: Some([0.0, 1.1, 0.0]),
            ..Radar::default()
        };
        placed.validate().unwrap();
        let (placed, preset) = (placed.frames(), Radar::default().frames());
        for point in [Point::new(0.0, 0.0, 0.0), Point::new(0.3, -0.2, 1.0)] {
            let [a, b] = [placed, preset].map(|frames| frames.global_from_target * point);
            assert!(a.distance_m(b) < 1e-12);
        }
        assert!((placed.pattern_range_m - preset.pattern_range_m).abs() < 1e-12);
    }

    #[test]
    fn a_radar_looks_where_it_is_told_with_up_upwards() {
        let up = [0.0, 0.0, 2.0];
        let placed = Radar {
            position_m: Some([3.0, -4.0, 1.0]),
            look_at_m: Some([0.0, 0.0, 1.0]),
            up: Some(up),
            ..Radar::default()
        };
        placed.validate().unwrap();
        let frames = placed.frames();
        assert!(frames.origin().distance_m(Point::new(3.0, -4.0, 1.0)) < 1e-12);
        assert!((frames.pattern_range_m - 5.0).abs() < 1e-12);
        let axes = frames.global_from_target.rotation();
        assert!((axes.y_axis - DVec3::Z).length() < 1e-12);
        // Seen from the radar, x_t goes to the right.
        let ahead = -axes.z_axis;
        assert!((ahead.cross(axes.y_axis) - axes.x_axis).length() < 1e-12);
    }

    #[test]
    fn what_is_no_place_is_refused() {
        let placed = Radar {
            position_m: Some([0.0, 1.0, 2.0]),
            look_at_m: Some([0.0, 1.0, 0.0]),
            ..Radar::default()
        };
        for (radar, said) in [
            (Radar { look_at_m: None, ..placed.clone() }, "radar.look_at_m is missing"),
            (Radar { position_m: None, ..placed.clone() }, "radar.position_m is missing"),
            (Radar { up: Some([0.0; 3]), ..placed.clone() }, "no place"),
            (Radar { up: Some([0.0, 0.0, 1.0]), ..placed.clone() }, "no place"),
            (Radar { look_at_m: placed.position_m, ..placed.clone() }, "no place"),
            (Radar { position_m: Some([f64::NAN; 3]), ..placed.clone() }, "no place"),
            (Radar { alpha_deg: 0.0, ..placed.clone() }, "two places"),
        ] {
            let error = radar.validate().unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
