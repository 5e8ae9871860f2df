//! Effects of the instrument in their other forms.

use std::f64::consts::TAU;

use glam::DVec2;
use matdb::radar::random::Draws;
use serde_json::{Value, json};

use super::physics::{Effect, Report, ratio};
use super::scan::Sight;

/// Draws −1 or 1.
fn sign(random: &mut Draws) -> f64 {
    if random.uniform() < 0.5 { -1.0 } else { 1.0 }
}

/// From 0 to 1 with level ends.
pub fn smooth_step(x: f64) -> f64 {
    let x = x.clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// The gain of electronics that warm up and wander, with a jump where the scan was interrupted.
pub struct Drift {
    warming: f64,
    settling: f64,
    jump: f64,
    jump_at: f64,
    /// A random walk, at even times from the first chirp to the last.
    walk: Vec<f64>,
}

/// Steps of the walk.
const WALK: usize = 12;

impl Drift {
    pub fn new(random: &mut Draws) -> Drift {
        let (warming, jump) = (sign(random), sign(random));
        let mut walk = vec![0.0];
        for step in 0..WALK {
            walk.push(walk[step] + 0.35 * random.gaussian());
        }
        Drift {
            warming: warming * (1.0 + 0.6 * random.uniform()),
            settling: 0.08 + 0.2 * random.uniform(),
            jump: jump * (0.4 + 0.6 * random.uniform()),
            jump_at: 0.3 + 0.5 * random.uniform(),
            walk,
        }
    }

    fn walked(&self, share: f64) -> f64 {
        let at = share.clamp(0.0, 1.0) * WALK as f64;
        let from = (at as usize).min(WALK - 1);
        let step = self.walk[from + 1] - self.walk[from];
        self.walk[from] + step * smooth_step(at - from as f64)
    }
}

impl Effect for Drift {
    fn name(&self) -> &'static str {
        "drift"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.01, 20.0]
    }
    fn parameters(&self, size: f64) -> Value {
        let walk_db: Vec<f64> = self.walk.iter().map(|at| size * at).collect();
        json!({
            "form": "warming up, a jump, and a smoothed random walk",
            "warming_db": size * self.warming,
            "settling_scans": self.settling,
            "jump_db": size * self.jump,
            "jump_at_share": self.jump_at,
            "walk_db": walk_db,
        })
    }
    fn receive_w(&self, size: f64, sight: &Sight, report: Report) -> f64 {
        let warm = self.warming * (-sight.share / self.settling).exp();
        let jumped = if sight.share > self.jump_at { self.jump } else { 0.0 };
        report.power_w * ratio(size * (warm + jumped + self.walked(sight.share)))
    }
}

/// A loss that grows with the fourth power about a centre beside the field's, along two unequal axes, with
/// a tilt, and the shadow of a frame on one side.
pub struct FovGain {
    centre_m: DVec2,
    half_axes_m: DVec2,
    turn_rad: f64,
    tilt_rad: f64,
    shadow_rad: f64,
    shadow_at_m: f64,
}

/// Half the width and half the height of the field, m.
const FIELD_M: DVec2 = DVec2::new(0.25, 0.45);
/// The shadow grows over this much to both sides of its border, m: the beam is 16 mm wide in the target
/// plane, and wider where the frame stands.
const SHADOW_SOFT_M: f64 = 0.025;

impl FovGain {
    pub fn new(random: &mut Draws) -> FovGain {
        let mut within = |half: f64| half * (2.0 * random.uniform() - 1.0);
        let centre_m = DVec2::new(within(0.08), within(0.14));
        let half_axes_m = DVec2::new(0.3 + within(0.05), 0.45 + within(0.08));
        let (turn_rad, tilt_rad) = (within(0.5), within(0.5 * TAU));
        let shadow_rad = within(0.5 * TAU);
        // Where an ellipse of the field's size ends in that direction.
        let end_m = (FIELD_M * DVec2::from_angle(shadow_rad)).length();
        let shadow_at_m = (0.6 + within(0.15)) * end_m;
        FovGain { centre_m, half_axes_m, turn_rad, tilt_rad, shadow_rad, shadow_at_m }
    }

    /// Gain for a size of 1, dB.
    fn gain_db(&self, at_m: DVec2) -> f64 {
        let turned = DVec2::from_angle(-self.turn_rad).rotate(at_m - self.centre_m);
        let off2 = (turned / self.half_axes_m).length_squared();
        let tilt = DVec2::from_angle(self.tilt_rad).dot(at_m) / FIELD_M.y;
        let beyond_m = DVec2::from_angle(self.shadow_rad).dot(at_m) - self.shadow_at_m;
        let shadow = 1.0 / (1.0 + (-2.0 * beyond_m / SHADOW_SOFT_M).exp());
        0.4 * tilt - 0.5 * off2 * off2 - 0.8 * shadow
    }
}

impl Effect for FovGain {
    fn name(&self) -> &'static str {
        "fov-gain"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.01, 30.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "a quartic loss about another centre, a tilt, and a shadow on one side",
            "quartic_db": 0.5 * size,
            "centre_off_field_m": self.centre_m.to_array(),
            "half_axes_m": self.half_axes_m.to_array(),
            "turn_rad": self.turn_rad,
            "tilt_db_at_0.45_m": 0.4 * size,
            "tilt_rad": self.tilt_rad,
            "shadow_db": 0.8 * size,
            "shadow_rad": self.shadow_rad,
            "shadow_at_m": self.shadow_at_m,
        })
    }
    fn receive_w(&self, size: f64, sight: &Sight, report: Report) -> f64 {
        report.power_w * ratio(size * self.gain_db(sight.off_centre_m))
    }
}

/// A gain control: above a threshold, decibels count less. Between the two slopes lies a parabola, the knee.
/// The size is the inverse of the threshold, in 1/W.
pub struct Compression {
    ratio: f64,
    knee_db: f64,
}

impl Compression {
    pub fn new(random: &mut Draws) -> Compression {
        Compression { ratio: 3.0 + 3.0 * random.uniform(), knee_db: 4.0 + 6.0 * random.uniform() }
    }
}

impl Effect for Compression {
    fn name(&self) -> &'static str {
        "compression"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e3, 3e10]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "a gain control with a parabolic knee in dB; no ceiling",
            "threshold_dbm": 10.0 * (1e3 / size).log10(),
            "db_in_per_db_out": self.ratio,
            "knee_db": self.knee_db,
        })
    }
    fn receive_w(&self, size: f64, _: &Sight, report: Report) -> f64 {
        let above_db = 10.0 * (size * report.power_w).log10();
        let into_db = (above_db + 0.5 * self.knee_db).max(0.0);
        let excess_db =
            if into_db < self.knee_db { 0.5 * into_db * into_db / self.knee_db } else { above_db };
        report.power_w * ratio(-(1.0 - 1.0 / self.ratio) * excess_db)
    }
}
