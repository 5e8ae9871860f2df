//! Effects that no library of sixteen names has.

use std::f64::consts::{PI, TAU};

use matdb::radar::random::Draws;
use matdb::radar::speckle::standard_deviation_db;
use serde_json::{Value, json};

use super::physics::{Class, Effect, Fluctuation, Report, ratio};
use super::scan::{Sight, Stream, World, draws};

/// A worn bearing: the gain repeats with the turn of the mirror.
pub struct MirrorRipple {
    per_turn: f64,
    phase_rad: f64,
}

impl MirrorRipple {
    pub fn new(random: &mut Draws) -> MirrorRipple {
        let per_turn = (3.0 + 3.0 * random.uniform()).floor();
        MirrorRipple { per_turn, phase_rad: TAU * random.uniform() }
    }
}

impl Effect for MirrorRipple {
    fn name(&self) -> &'static str {
        "mirror-ripple"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.01, 20.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "amplitude_db": size, "per_turn": self.per_turn, "phase_rad": self.phase_rad })
    }
    fn receive_w(&self, size: f64, sight: &Sight, report: Report) -> f64 {
        report.power_w * ratio(size * (self.per_turn * sight.mirror_rad + self.phase_rad).sin())
    }
}

/// A standing wave between antenna and target: the gain repeats with the range.
pub struct StandingWave {
    period_m: f64,
    phase_rad: f64,
}

impl StandingWave {
    pub fn new(random: &mut Draws) -> StandingWave {
        let period_m = 0.03 + 0.04 * random.uniform();
        StandingWave { period_m, phase_rad: TAU * random.uniform() }
    }
}

impl Effect for StandingWave {
    fn name(&self) -> &'static str {
        "standing-wave"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.01, 20.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "amplitude_db": size, "period_m": self.period_m, "phase_rad": self.phase_rad })
    }
    fn receive_w(&self, size: f64, _: &Sight, report: Report) -> f64 {
        let turn = TAU * report.range_m / self.period_m + self.phase_rad;
        report.power_w * ratio(size * turn.sin())
    }
}

/// A polariser in the optics: the gain depends on the azimuth of the ray in the image plane.
pub struct ImageAzimuth {
    axis_rad: f64,
}

impl ImageAzimuth {
    pub fn new(random: &mut Draws) -> ImageAzimuth {
        ImageAzimuth { axis_rad: PI * random.uniform() }
    }
}

impl Effect for ImageAzimuth {
    fn name(&self) -> &'static str {
        "image-azimuth"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.01, 20.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "amplitude_db": size, "axis_rad": self.axis_rad, "form": "cos of twice the azimuth" })
    }
    fn receive_w(&self, size: f64, sight: &Sight, report: Report) -> f64 {
        let azimuth = sight.off_centre_m.y.atan2(sight.off_centre_m.x);
        report.power_w * ratio(size * (2.0 * (azimuth - self.axis_rad)).cos())
    }
}

/// A rope in front of the target: a stripe of loss across the image.
pub struct Rope {
    angle_rad: f64,
    offset_m: f64,
    width_m: f64,
}

impl Rope {
    pub fn new(random: &mut Draws) -> Rope {
        Rope {
            angle_rad: PI * random.uniform(),
            offset_m: 0.1 * (2.0 * random.uniform() - 1.0),
            width_m: 0.02 + 0.02 * random.uniform(),
        }
    }
}

impl Effect for Rope {
    fn name(&self) -> &'static str {
        "rope-shadow"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.05, 40.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "loss_db": size,
            "angle_rad": self.angle_rad,
            "offset_m": self.offset_m,
            "sd_m": 0.5 * self.width_m,
        })
    }
    fn receive_w(&self, size: f64, sight: &Sight, report: Report) -> f64 {
        let (sin, cos) = self.angle_rad.sin_cos();
        let across_m = sight.off_centre_m.x * cos + sight.off_centre_m.y * sin - self.offset_m;
        let sds = across_m / (0.5 * self.width_m);
        report.power_w * ratio(-size * (-0.5 * sds * sds).exp())
    }
}

/// A coarse converter: decibels in steps.
pub struct CoarseSteps;

impl Effect for CoarseSteps {
    fn name(&self) -> &'static str {
        "coarse-steps"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.0, 0.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "step_db": size })
    }
    /// A step of q leaves q/√12.
    fn size_of(&self, class: Class, _: &World) -> Option<f64> {
        Some(12f64.sqrt() * class.rms_db())
    }
    fn reported(&self, size: f64, _: usize, report: Report) -> Option<Report> {
        let db = 10.0 * (1e3 * report.power_w).log10();
        let power_w = 1e-3 * ratio(size * (db / size).round());
        Some(Report { power_w, ..report })
    }
}

/// The share of chirps that effects without a mean level touch.
fn share(class: Class) -> f64 {
    match class {
        Class::Weak => 0.02,
        Class::Moderate => 0.06,
        Class::Strong => 0.15,
    }
}

/// Bursts of chirps are lost, strong or not.
pub struct Dropouts {
    pub seed: u64,
}

/// Chirps lost together.
const BURST: usize = 12;

impl Effect for Dropouts {
    fn name(&self) -> &'static str {
        "dropouts"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.0, 0.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "lost_share": size, "burst_chirps": BURST })
    }
    fn size_of(&self, class: Class, _: &World) -> Option<f64> {
        Some(share(class))
    }
    fn reported(&self, size: f64, chirp: usize, report: Report) -> Option<Report> {
        let lost = draws(self.seed, chirp / BURST, Stream::Report).uniform() < size;
        (!lost).then_some(report)
    }
}

/// A second reflection inside the instrument wins now and then: weaker, and at a longer range.
pub struct Ghost {
    seed: u64,
    offset_m: f64,
    weaker_db: f64,
}

impl Ghost {
    pub fn new(random: &mut Draws, seed: u64) -> Ghost {
        let offset_m = 0.04 + 0.08 * random.uniform();
        Ghost { seed, offset_m, weaker_db: 1.0 + 4.0 * random.uniform() }
    }
}

impl Effect for Ghost {
    fn name(&self) -> &'static str {
        "ghost-echo"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.0, 0.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "share": size, "offset_m": self.offset_m, "weaker_db": self.weaker_db })
    }
    fn size_of(&self, class: Class, _: &World) -> Option<f64> {
        Some(share(class))
    }
    fn reported(&self, size: f64, chirp: usize, report: Report) -> Option<Report> {
        if draws(self.seed, chirp, Stream::Report).uniform() >= size {
            return Some(report);
        }
        let power_w = report.power_w * ratio(-self.weaker_db);
        Some(Report { range_m: report.range_m + self.offset_m, power_w })
    }
}

/// Speckle with a log-normal law, wider than the declared Gamma.
pub struct LogNormalSpeckle;

impl Effect for LogNormalSpeckle {
    fn name(&self) -> &'static str {
        "log-normal-speckle"
    }
    fn sizes(&self) -> [f64; 2] {
        [0.0, 0.0]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "sd_db": size, "form": "Gaussian in dB, mean power unchanged" })
    }
    /// As for fewer looks: wider than declared by the class, in quadrature.
    fn size_of(&self, class: Class, world: &World) -> Option<f64> {
        Some(standard_deviation_db(world.looks).hypot(class.rms_db()))
    }
    fn fluctuation(&self, size: f64) -> Option<Fluctuation> {
        Some(Fluctuation::LogNormal { sd_db: size })
    }
}
