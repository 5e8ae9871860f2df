//! Effects of the instrument.

use std::f64::consts::TAU;

use matdb::radar::random::Draws;
use matdb::radar::speckle::standard_deviation_db;
use serde_json::{Value, json};

use super::physics::{Class, Effect, Fluctuation, Report, ratio};
use super::scan::{Sight, World};

/// Fewer looks than declared.
pub struct Speckle;

impl Effect for Speckle {
    fn name(&self) -> &'static str {
        "speckle"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.0, 0.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "looks": size })
    }
    /// The spread in dB exceeds the declared one by the class, in quadrature.
    fn size_of(&self, class: Class, world: &World) -> Option<f64> {
        let wanted = standard_deviation_db(world.looks).hypot(class.rms_db());
        let (mut few, mut many) = (0.2, world.looks);
        for _ in 0..60 {
            let looks = 0.5 * (few + many);
            if standard_deviation_db(looks) > wanted { few = looks } else { many = looks }
        }
        Some(0.5 * (few + many))
    }
    fn fluctuation(&self, size: f64) -> Option<Fluctuation> {
        Some(Fluctuation::Looks(size))
    }
}

/// Power falls with the square of the distance from the field's centre.
pub struct FovGain;

/// Distance at which `edge_db` is meant, m.
const EDGE_M: f64 = 0.5;

impl Effect for FovGain {
    fn name(&self) -> &'static str {
        "fov-gain"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.01, 30.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "edge_db": -size, "edge_m": EDGE_M, "form": "dB proportional to the distance squared" })
    }
    fn receive_w(&self, size: f64, sight: &Sight, report: Report) -> f64 {
        report.power_w * ratio(-size * sight.off_centre_m.length_squared() / (EDGE_M * EDGE_M))
    }
}

/// More thermal noise than declared.
pub struct NoiseFloor;

impl Effect for NoiseFloor {
    fn name(&self) -> &'static str {
        "noise-floor"
    }
    fn sizes(&self) -> [f64; 2] {
        [5e-13, 3e-10]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "level_dbm": 10.0 * (1e3 * size).log10() })
    }
    fn thermal_w(&self, size: f64) -> Option<f64> {
        Some(size)
    }
}

/// A soft ceiling, P/(1 + (P/P_sat)^p)^(1/p), with the knee p of 1 or 2 (Rapp's amplifier); the size
/// is 1/P_sat in 1/W.
pub struct Compression {
    knee: f64,
}

impl Compression {
    pub fn new(random: &mut Draws) -> Compression {
        Compression { knee: if random.uniform() < 0.5 { 1.0 } else { 2.0 } }
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
        json!({ "saturation_dbm": 10.0 * (1e3 / size).log10(), "knee": self.knee })
    }
    fn receive_w(&self, size: f64, _: &Sight, report: Report) -> f64 {
        report.power_w / (1.0 + (size * report.power_w).powf(self.knee)).powf(1.0 / self.knee)
    }
}

/// The gain wanders: a slope and a slow wave along the scan.
pub struct Drift {
    slope: f64,
    wave: f64,
    cycles: f64,
    phase_rad: f64,
}

impl Drift {
    pub fn new(random: &mut Draws) -> Drift {
        let sign = if random.uniform() < 0.5 { -1.0 } else { 1.0 };
        Drift {
            slope: sign * (0.5 + random.uniform()),
            wave: random.uniform(),
            cycles: 0.5 + random.uniform(),
            phase_rad: TAU * random.uniform(),
        }
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
        json!({
            "slope_db_per_scan": size * self.slope,
            "wave_db": size * self.wave,
            "cycles_per_scan": self.cycles,
            "phase_rad": self.phase_rad,
        })
    }
    fn receive_w(&self, size: f64, sight: &Sight, report: Report) -> f64 {
        let wave = self.wave * (TAU * self.cycles * sight.share + self.phase_rad).sin();
        report.power_w * ratio(size * (self.slope * (sight.share - 0.5) + wave))
    }
}
