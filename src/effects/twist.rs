//! A target that is turned about the middle of the shots and then shifted, and small changes of that.

use glam::{DMat3, DVec3};

use super::intersection::motion;
use crate::frames::{Global, Pose};

/// A small motion of the target: a shift along the global x, y and z, m, and a turn about axes of these directions through
/// the middle of the shots, deg.
pub type Twist = [f64; 6];

/// The motion by a shift and by a turn of roll, pitch and yaw about the fixed axes x, y, z through `middle`.
pub(super) fn placed(middle: DVec3, shift_m: DVec3, turn_deg: DVec3) -> Pose<Global, Global> {
    motion(rotation(turn_deg), middle, shift_m)
}

/// The small motion by a twist.
pub(super) fn twisted(middle: DVec3, &[x, y, z, roll, pitch, yaw]: &Twist) -> Pose<Global, Global> {
    placed(middle, DVec3::new(x, y, z), DVec3::new(roll, pitch, yaw))
}

fn rotation(turn_deg: DVec3) -> DMat3 {
    let turn_rad = turn_deg.map(f64::to_radians);
    Pose::<Global, Global>::from_euler_xyz(turn_rad, DVec3::ZERO).rotation()
}

/// Change of [`placed`] per m of the shift along x, y and z and per deg of roll, pitch and yaw.
pub(super) fn twists(shift_m: DVec3, turn_deg: DVec3) -> [Twist; 6] {
    let shifts = DMat3::IDENTITY.to_cols_array_2d().map(|axis| joined(axis.into(), DVec3::ZERO));
    // A roll comes first, so that pitch and yaw turn its axis.
    let yaw = rotation(DVec3::new(0.0, 0.0, turn_deg.z));
    let pitch_and_yaw = yaw * rotation(DVec3::new(0.0, turn_deg.y, 0.0));
    let axes = [pitch_and_yaw.x_axis, yaw.y_axis, DVec3::Z];
    // ω × (x − middle − shift) = ω × (x − middle) + shift × ω.
    let turns = axes.map(|axis| joined(shift_m.cross(axis) * 1f64.to_radians(), axis));
    let [[a, b, c], [d, e, f]] = [shifts, turns];
    [a, b, c, d, e, f]
}

fn joined(shift_m: DVec3, turn_deg: DVec3) -> Twist {
    let ([x, y, z], [roll, pitch, yaw]) = (shift_m.to_array(), turn_deg.to_array());
    [x, y, z, roll, pitch, yaw]
}

/// Way of a point of the target by a small motion, m.
pub(crate) fn way_m(twist: &Twist, middle: DVec3, point: DVec3) -> DVec3 {
    let [x, y, z, roll, pitch, yaw] = *twist;
    let turn_rad = DVec3::new(roll, pitch, yaw).map(f64::to_radians);
    DVec3::new(x, y, z) + turn_rad.cross(point - middle)
}
