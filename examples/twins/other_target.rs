//! Effects of where the target is and of how the beam meets it in their other forms.

use std::f64::consts::{PI, TAU};

use glam::{DMat3, DQuat, DVec2, DVec3};
use matdb::radar::random::Draws;
use rayon::prelude::*;
use serde_json::{Value, json};

use super::base::Base;
use super::other_instrument::smooth_step;
use super::physics::{Displacement, Effect, Report};
use super::scan::{Shot, Sight, Stream, World, draws};
use super::target::{
    ONWARD, direction, next, onward, onward_per_sr, received_sr, seen_from_antenna,
};
use super::waves::Waves;

/// A body that stands unquietly: it sways with a pause, shifts its weight once, and breathes. It turns with the
/// sway, a quarter of a period later, and with the shift: six degrees of freedom.
pub struct Motion {
    sway: DVec3,
    cycles: f64,
    phase_rad: f64,
    pause: [f64; 2],
    shift: DVec3,
    shift_at: f64,
    breaths: f64,
    turn_axes: [DVec3; 2],
    deg_per_m: f64,
    pivot: DVec3,
}

/// Amplitude of the shift of weight, of the breathing and of the sway's turn, over that of the sway.
const SHIFT: f64 = 0.8;
const BREATH: f64 = 0.25;
const TURN: f64 = 0.6;
/// Share of the scan that a shift of weight takes.
const SHIFTING: f64 = 0.03;

impl Motion {
    pub fn new(random: &mut Draws, world: &World) -> Motion {
        let paused_at = 0.2 + 0.4 * random.uniform();
        Motion {
            sway: direction(random),
            cycles: 1.0 + 1.5 * random.uniform(),
            phase_rad: TAU * random.uniform(),
            pause: [paused_at, paused_at + 0.15 + 0.15 * random.uniform()],
            shift: direction(random),
            shift_at: 0.2 + 0.6 * random.uniform(),
            breaths: 3.0 + 3.0 * random.uniform(),
            turn_axes: [direction(random), direction(random)],
            deg_per_m: 20.0 + 40.0 * random.uniform(),
            pivot: world.middle,
        }
    }

    /// Phase of the sway, rad, which stands still during the pause.
    fn sway_rad(&self, share: f64) -> f64 {
        let [from, to] = self.pause;
        let paused = (share.min(to) - from).max(0.0);
        TAU * self.cycles * (share - paused) + self.phase_rad
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
            "form": "a sway with a pause, a shift of weight, breathing, and turns",
            "sway_m": (size * self.sway).to_array(),
            "cycles_per_scan": self.cycles,
            "phase_rad": self.phase_rad,
            "pause_shares": self.pause,
            "shift_m": (size * SHIFT * self.shift).to_array(),
            "shift_at_share": self.shift_at,
            "breathing_m": size * BREATH,
            "breaths_per_scan": self.breaths,
            "turn_deg": [size * TURN * self.deg_per_m, size * SHIFT * self.deg_per_m],
            "turn_axes": self.turn_axes.map(|axis| axis.to_array()),
            "pivot_m": self.pivot.to_array(),
        })
    }
    fn displacement(&self, size: f64, sight: &Sight) -> Option<Displacement> {
        let sway_rad = self.sway_rad(sight.share);
        let shifted = SHIFT * smooth_step((sight.share - self.shift_at) / SHIFTING);
        let breath = BREATH * (TAU * self.breaths * sight.share).sin();
        let translation_m =
            size * (sway_rad.sin() * self.sway + shifted * self.shift + breath * DVec3::Z);
        let turn = -TURN * sway_rad.cos() * self.turn_axes[0] + shifted * self.turn_axes[1];
        let turn_rad = (size * self.deg_per_m).to_radians() * turn;
        let rotation = DMat3::from_quat(DQuat::from_scaled_axis(turn_rad));
        Some(Displacement { rotation, translation_m, pivot: self.pivot })
    }
}

/// The spot of an antenna out of focus: the evenly lit image of its aperture, an ellipse with a sharp border. What
/// is sent and received alike is as even.
pub struct FiniteSpot {
    elongation: f64,
    turn_rad: f64,
}

impl FiniteSpot {
    pub fn new(random: &mut Draws) -> FiniteSpot {
        FiniteSpot { elongation: 2.0 + 1.5 * random.uniform(), turn_rad: PI * random.uniform() }
    }
}

impl Effect for FiniteSpot {
    fn name(&self) -> &'static str {
        "finite-spot"
    }
    fn sizes(&self) -> [f64; 2] {
        [5e-4, 0.1]
    }
    fn parameters(&self, size: f64) -> Value {
        let root = self.elongation.sqrt();
        json!({
            "form": "an evenly lit ellipse",
            "diameters_m": [size * root, size / root],
            "turn_rad": self.turn_rad,
        })
    }
    fn spot_diameter_m(&self, size: f64) -> Option<f64> {
        Some(size)
    }
    fn spot_place_m(&self, diameter_m: f64, [inside, turn]: [f64; 2]) -> DVec2 {
        let round_m = 0.5 * diameter_m * inside.sqrt() * DVec2::from_angle(TAU * turn);
        let root = self.elongation.sqrt();
        DVec2::from_angle(self.turn_rad).rotate(round_m * DVec2::new(root, 1.0 / root))
    }
}

/// The surface is wavy where the mesh is smooth: neighbouring chirps see nearly the same wrong tilt.
pub struct AngleError {
    waves: Waves,
}

/// Wavelengths of the waviness, m.
const WAVY_M: [f64; 2] = [0.04, 0.12];

impl AngleError {
    pub fn new(random: &mut Draws) -> AngleError {
        AngleError { waves: Waves::new(random, WAVY_M) }
    }
}

impl Effect for AngleError {
    fn name(&self) -> &'static str {
        "angle-error"
    }
    fn sizes(&self) -> [f64; 2] {
        [1e-4, 0.3]
    }
    fn parameters(&self, size: f64) -> Value {
        json!({
            "form": "waviness of the surface",
            "sd_deg": size.atan().to_degrees(),
            "meaning": "in each of two directions",
            "wavelengths_m": WAVY_M,
        })
    }
    fn tilt(&self, size: f64, _: usize, look: &Shot) -> DVec2 {
        let slope = size * self.waves.slope(look.point);
        let (u, v) = look.normal.any_orthonormal_pair();
        -DVec2::new(slope.dot(u), slope.dot(v))
    }
}

/// Paths by a second and by a third surface, both of which scatter evenly, as the base law's diffuse part
/// does head on. The size is a gain per surface after the first.
pub struct MultiBounce {
    /// By way of one more surface, and of two.
    paths: Vec<[Report; 2]>,
}

const NOTHING: Report = Report { range_m: 0.0, power_w: 0.0 };

impl MultiBounce {
    pub fn new(world: &World, seed: u64, base: &Base) -> MultiBounce {
        MultiBounce {
            paths: world.sights.par_iter().map(|sight| paths(world, seed, base, sight)).collect(),
        }
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
        json!({
            "form": "two orders, even scattering by the second and third surface",
            "gain_per_surface_db": 10.0 * size.log10(),
        })
    }
    fn detour(&self, size: f64, chirp: usize) -> Option<Report> {
        let [second, third] = self.paths.get(chirp)?;
        let [second_w, third_w] = [size * second.power_w, size * size * third.power_w];
        let power_w = second_w + third_w;
        let range_m = (second_w * second.range_m + third_w * third.range_m) / power_w;
        (power_w > 0.0).then_some(Report { range_m, power_w })
    }
}

/// All that comes back from one lit point by way of one more surface, and of two: power and its mean range.
fn paths(world: &World, seed: u64, base: &Base, sight: &Sight) -> [Report; 2] {
    let mut sums = [NOTHING; 2];
    let Some(a) = sight.look.as_ref() else { return sums };
    let mut random = draws(seed, sight.chirp, Stream::Bounce);
    let even_per_sr = base.k * base.r_s * (base.alpha + 2.0) / TAU;
    for sample in 0..ONWARD {
        let drawn = onward(base, a, sample % 2 == 0, &mut random);
        let cos = a.normal.dot(drawn[0]);
        // Drawn by the cosine, all directions from B weigh the same, π.
        let further = [random.uniform(), random.uniform()];
        if cos <= 0.0 {
            continue;
        }
        let Some(b) = next(world, a, drawn[0]) else { continue };
        let f = base.bistatic_per_sr([a.normal, a.to_radar, drawn[0]], 0.0);
        let onward_w = world.sent_w * a.cos_theta() * f * cos / onward_per_sr(base, a, drawn);
        let way_m = a.range_m + b.range_m;
        add(&mut sums[0], world, sight, &b, [even_per_sr * onward_w, way_m]);
        if let Some(c) = next(world, &b, by_cosine(b.normal, further)) {
            let power_w = PI * even_per_sr * even_per_sr * onward_w;
            add(&mut sums[1], world, sight, &c, [power_w, way_m + c.range_m]);
        }
    }
    sums.map(
        |Report { range_m, power_w }| {
            if power_w > 0.0 { Report { range_m: range_m / power_w, power_w } } else { NOTHING }
        },
    )
}

/// Adds what the antenna receives from a last surface: power over f·cos θ·λ²/(πw²) of it, and the way to it, m.
fn add(sum: &mut Report, world: &World, sight: &Sight, last: &Shot, [power_w, way_m]: [f64; 2]) {
    let (Some(a), Some(seen)) = (sight.look.as_ref(), seen_from_antenna(world, last)) else {
        return;
    };
    let received = received_sr(world, sight, a, &seen) * seen.cos_theta();
    let power_w = power_w * received / ONWARD as f64;
    sum.power_w += power_w;
    sum.range_m += power_w * 0.5 * (way_m + seen.range_m);
}

/// A direction away from a surface, as often as its cosine says.
fn by_cosine(normal: DVec3, [radius2, turn]: [f64; 2]) -> DVec3 {
    let (u, v) = normal.any_orthonormal_pair();
    let place = radius2.sqrt() * DVec2::from_angle(TAU * turn);
    place.x * u + place.y * v + (1.0 - radius2).sqrt() * normal
}
