//! Effects of where the target is and of how the beam meets it.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec2, DVec3};
use matdb::radar::random::Draws;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::base::Base;
use super::physics::{Displacement, Effect, Report};
use super::scan::{Shot, Sight, Stream, World, draws, look, ray};

/// A random unit vector.
pub fn direction(random: &mut Draws) -> DVec3 {
    let z = 2.0 * random.uniform() - 1.0;
    let (sin, cos) = (TAU * random.uniform()).sin_cos();
    let across = (1.0 - z * z).sqrt();
    DVec3::new(across * cos, across * sin, z)
}

/// The mesh stands elsewhere: v ↦ R·(v − pivot) + pivot + t.
pub struct Pose {
    along: DVec3,
    axis: DVec3,
    deg_per_m: f64,
    pivot: DVec3,
}

impl Pose {
    pub fn new(random: &mut Draws, world: &World) -> Pose {
        let (along, axis) = (direction(random), direction(random));
        Pose { along, axis, deg_per_m: 20.0 + 60.0 * random.uniform(), pivot: world.middle }
    }
}

impl Effect for Pose {
    fn name(&self) -> &'static str {
        "pose"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e-5, 0.06]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "translation_m": (size * self.along).to_array(),
            "rotation_deg": (size * self.deg_per_m * self.axis).to_array(),
            "pivot_m": self.pivot.to_array(),
        })
    }
    fn displacement(&self, size: f64, _: &Sight) -> Option<Displacement> {
        let angle_rad = (size * self.deg_per_m).to_radians();
        let rotation = DMat3::from_quat(DQuat::from_axis_angle(self.axis, angle_rad));
        Some(Displacement { rotation, translation_m: size * self.along, pivot: self.pivot })
    }
}

/// The target sways: two slow sines in two directions.
pub struct Motion {
    along: [DVec3; 2],
    cycles: [f64; 2],
    phase_rad: [f64; 2],
}

impl Motion {
    pub fn new(random: &mut Draws) -> Motion {
        Motion {
            along: [direction(random), 0.4 * direction(random)],
            cycles: [0.7 + 0.8 * random.uniform(), 1.5 + 1.5 * random.uniform()],
            phase_rad: [TAU * random.uniform(), TAU * random.uniform()],
        }
    }
}

impl Effect for Motion {
    fn name(&self) -> &'static str {
        "motion"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e-5, 0.06]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "amplitude_m": self.along.map(|along| (size * along).to_array()),
            "cycles_per_scan": self.cycles,
            "phase_rad": self.phase_rad,
        })
    }
    fn displacement(&self, size: f64, sight: &Sight) -> Option<Displacement> {
        let sway = |n: usize| {
            let turn = TAU * self.cycles[n] * sight.share + self.phase_rad[n];
            size * turn.sin() * self.along[n]
        };
        let (rotation, pivot) = (DMat3::IDENTITY, DVec3::ZERO);
        Some(Displacement { rotation, translation_m: sway(0) + sway(1), pivot })
    }
}

/// A Gaussian spot instead of one ray.
pub struct FiniteSpot;

impl Effect for FiniteSpot {
    fn name(&self) -> &'static str {
        "finite-spot"
    }
    fn sizes(&self) -> [f64; 2] {
        [5e-4, 0.1]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "diameter_m": size, "meaning": "at half the intensity, the same over the whole field" })
    }
    fn spot_diameter_m(&self, size: f64) -> Option<f64> {
        Some(size)
    }
}

/// Every chirp sees its facet under another tilt, Gaussian in two directions.
pub struct AngleError {
    pub seed: u64,
}

impl Effect for AngleError {
    fn name(&self) -> &'static str {
        "angle-error"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e-4, 0.15]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "sd_deg": size.atan().to_degrees(), "meaning": "in each of two directions" })
    }
    fn tilt(&self, size: f64, chirp: usize, _: &Shot) -> DVec2 {
        let mut random = draws(self.seed, chirp, Stream::Tilt);
        size * DVec2::new(random.gaussian(), random.gaussian())
    }
}

/// Second segments, radar → A → B → antenna, for a coupling of 1.
pub struct MultiBounce {
    second: Vec<Option<Report>>,
}

/// Directions that are followed from each lit point.
pub const ONWARD: usize = 512;

impl MultiBounce {
    pub fn new(world: &World, seed: u64, base: &Base) -> MultiBounce {
        let second = |sight: &Sight| {
            let mut random = draws(seed, sight.chirp, Stream::Bounce);
            second_segment(world, base, sight, &mut random)
        };
        MultiBounce { second: world.sights.par_iter().map(second).collect() }
    }
}

impl Effect for MultiBounce {
    fn name(&self) -> &'static str {
        "multi-bounce"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e-3, 1e3]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({ "coupling_db": 10.0 * size.log10() })
    }
    fn detour(&self, size: f64, chirp: usize) -> Option<Report> {
        let Report { range_m, power_w } = (*self.second.get(chirp)?)?;
        Some(Report { range_m, power_w: size * power_w })
    }
}

/// All that comes back from one lit point by way of a second one.
fn second_segment(world: &World, base: &Base, sight: &Sight, random: &mut Draws) -> Option<Report> {
    let a = sight.look.as_ref()?;
    let mut sum = Report { range_m: 0.0, power_w: 0.0 };
    for sample in 0..ONWARD {
        let [to, facet] = onward(base, a, sample % 2 == 0, random);
        let cos = a.normal.dot(to);
        if cos <= 0.0 {
            continue;
        }
        let density = onward_per_sr(base, a, [to, facet]);
        let Some((b, range_m)) = returned(world, a, to) else { continue };
        // The antenna's width counts once per path, where it leaves the second surface.
        let f = base.bistatic_per_sr([a.normal, a.to_radar, to], 0.0);
        let beam_slope = world.waist.slope(sight.place_m);
        let g = base.bistatic_per_sr([b.normal, -to, b.to_radar], beam_slope);
        let received = received_sr(world, sight, a, &b) * b.cos_theta();
        let power_w =
            world.sent_w * a.cos_theta() * f * cos / density * g * received / ONWARD as f64;
        sum.power_w += power_w;
        sum.range_m += power_w * range_m;
    }
    let Report { range_m, power_w } = sum;
    (power_w > 0.0).then(|| Report { range_m: range_m / power_w, power_w })
}

/// Level of the antenna's side lobes, which see what lies outside the spot.
const SIDE_LOBES: f64 = 0.01;

/// λ²/(π·w²) for what reaches the antenna from another surface than the first, A, sr.
pub fn received_sr(world: &World, sight: &Sight, a: &Shot, b: &Shot) -> f64 {
    let across_m2 = (b.point - a.point).reject_from(sight.ray.direction.xyz()).length_squared();
    let spot_m2 = world.waist.towards(sight.place_m).radius_m2(b.range_m);
    overlap(across_m2, spot_m2) * world.waist.received_sr(sight.place_m, b.range_m)
}

/// How much a spot u overlaps with one that lies aside, ∫ u(r)·u(r + s) over ∫ u², with the side lobes.
pub fn overlap(aside_m2: f64, spot_m2: f64) -> f64 {
    (-aside_m2 / spot_m2).exp().max(SIDE_LOBES)
}

/// A direction away from A and the facet normal that would mirror the radar's ray into it.
pub fn onward(base: &Base, a: &Shot, diffuse: bool, random: &mut Draws) -> [DVec3; 2] {
    let (u, v) = a.normal.any_orthonormal_pair();
    let (sin, cos) = (TAU * random.uniform()).sin_cos();
    let uniform = random.uniform();
    if diffuse {
        let r = uniform.sqrt();
        let to = r * (cos * u + sin * v) + (1.0 - uniform).sqrt() * a.normal;
        return [to, (to + a.to_radar).normalize_or(a.normal)];
    }
    let tan = base.slopes.sampled_tan2(uniform, base.m).sqrt();
    let facet = (a.normal + tan * (cos * u + sin * v)).normalize();
    [2.0 * a.to_radar.dot(facet) * facet - a.to_radar, facet]
}

/// How densely `onward` draws a direction, 1/sr: two ways of drawing, each as often.
pub fn onward_per_sr(base: &Base, a: &Shot, [to, facet]: [DVec3; 2]) -> f64 {
    let lobe = base.slopes.d_per_sr(a.normal.dot(facet), base.m) * a.normal.dot(facet)
        / (4.0 * a.to_radar.dot(facet).max(1e-6));
    0.5 * (a.normal.dot(to) / PI + lobe)
}

/// So far above a surface a ray starts that leaves it.
const OFF_SURFACE_M: f64 = 1e-4;

/// The next surface that a ray from a point of one meets.
pub fn next(world: &World, from: &Shot, to: DVec3) -> Option<Shot> {
    look(&world.bvh, &ray(from.point + OFF_SURFACE_M * from.normal, to)?)
}

/// The second surface as the antenna sees it, and half the length of the whole way, m.
fn returned(world: &World, a: &Shot, to: DVec3) -> Option<(Shot, f64)> {
    let b = next(world, a, to)?;
    let seen = seen_from_antenna(world, &b)?;
    let half_m = 0.5 * (a.range_m + b.range_m + seen.range_m);
    Some((seen, half_m))
}

/// A surface as the antenna sees it, if it does, that another one lights.
pub fn seen_from_antenna(world: &World, b: &Shot) -> Option<Shot> {
    let back = world.origin - b.point;
    let (range_m, to_radar) = (back.length(), back.normalize());
    // The side that the first surface lights has to be the one that the antenna sees.
    if b.normal.dot(to_radar) <= 0.0 {
        return None;
    }
    let seen = look(&world.bvh, &ray(world.origin, -to_radar)?)?;
    let hidden = seen.range_m < range_m - 10.0 * OFF_SURFACE_M;
    (!hidden).then_some(Shot { to_radar, range_m, ..*b })
}
