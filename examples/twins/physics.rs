//! From the base law to the mean power of every chirp, with whatever effects act on the way.

use std::f64::consts::TAU;

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use serde_json::Value;

use super::base::{Base, Local};
use super::scan::{Shot, Sight, Stream, World, draws, look, ray};

/// How strong an effect is to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Class {
    Weak,
    Moderate,
    Strong,
}

impl Class {
    pub const ALL: [Class; 3] = [Class::Weak, Class::Moderate, Class::Strong];

    /// What the refitted base law leaves, dB rms.
    pub fn rms_db(self) -> f64 {
        match self {
            Class::Weak => 0.35,
            Class::Moderate => 0.9,
            Class::Strong => 2.2,
        }
    }
}

/// Law of the fluctuation about the mean.
#[derive(Clone, Copy, Debug)]
pub enum Fluctuation {
    /// Gamma of this many looks, not necessarily whole.
    Looks(f64),
    /// Gaussian in decibels.
    LogNormal { sd_db: f64 },
}

/// What a detection says.
#[derive(Clone, Copy, Debug)]
pub struct Report {
    pub range_m: f64,
    pub power_w: f64,
}

/// A rigid displacement of the target: v becomes R·(v − pivot) + pivot + t.
#[derive(Clone, Copy, Debug)]
pub struct Displacement {
    pub rotation: DMat3,
    pub translation_m: DVec3,
    pub pivot: DVec3,
}

/// Something the base law does not know. Each hook is a place where physics can act; `size` is the
/// number that the calibration turns, and more of it means more effect.
pub trait Effect: Sync {
    fn name(&self) -> &'static str;
    /// Least and largest size that make sense.
    fn sizes(&self) -> [f64; 2];
    /// What the label says, with units in the keys.
    fn parameters(&self, size: f64) -> Value;
    /// The size of a class, for effects whose strength is no residual of the mean.
    fn size_of(&self, _class: Class, _world: &World) -> Option<f64> {
        None
    }
    /// The material that such a case needs.
    fn material(&self, _size: f64, _base: &mut Base) {}
    fn displacement(&self, _size: f64, _sight: &Sight) -> Option<Displacement> {
        None
    }
    /// Diameter at half the intensity over which a chirp averages, m.
    fn spot_diameter_m(&self, _size: f64) -> Option<f64> {
        None
    }
    /// Tilt of the true normal in two directions along the surface, as tangents.
    fn tilt(&self, _size: f64, _chirp: usize) -> DVec2 {
        DVec2::ZERO
    }
    fn surface(&self, _size: f64, _look: &Shot, _law: &mut Local) {}
    /// Power and range that arrive by other ways, W and m.
    fn detour(&self, _size: f64, _chirp: usize) -> Option<Report> {
        None
    }
    fn receive_w(&self, _size: f64, _sight: &Sight, report: Report) -> f64 {
        report.power_w
    }
    fn thermal_w(&self, _size: f64) -> Option<f64> {
        None
    }
    fn fluctuation(&self, _size: f64) -> Option<Fluctuation> {
        None
    }
    /// What becomes of a detection; `None` when it is lost.
    fn reported(&self, _size: f64, _chirp: usize, report: Report) -> Option<Report> {
        Some(report)
    }
}

/// An effect and its size.
pub type Acting<'a> = (&'a dyn Effect, f64);

/// Rays that stand for a spot: one at a random place of every cell of equal power, so many by radius and by
/// angle. Placed freely, so few would scatter by more than a weak effect changes.
const SPOT_CELLS: usize = 16;

/// Mean power without thermal noise, and range, of every `stride`-th chirp; `None` where nothing is
/// met.
pub fn means(
    world: &World,
    seed: u64,
    base: &Base,
    acting: &[Acting],
    stride: usize,
) -> Vec<Option<Report>> {
    let chirps: Vec<&Sight> = world.sights.iter().step_by(stride).collect();
    chirps.into_par_iter().map(|sight| mean(world, seed, base, acting, sight)).collect()
}

fn mean(world: &World, seed: u64, base: &Base, acting: &[Acting], sight: &Sight) -> Option<Report> {
    let looks = looks(world, seed, acting, sight);
    let met = looks.iter().flatten().count();
    if met == 0 {
        return None;
    }
    let mut sum = Report { range_m: 0.0, power_w: 0.0 };
    for look in looks.iter().flatten() {
        let power_w = echo_w(world, base, acting, sight, look) / looks.len() as f64;
        sum.power_w += power_w;
        sum.range_m += power_w * look.range_m;
    }
    for (effect, size) in acting {
        if let Some(detour) = effect.detour(*size, sight.chirp) {
            sum.power_w += detour.power_w;
            sum.range_m += detour.power_w * detour.range_m;
        }
    }
    if sum.power_w <= 0.0 {
        return None;
    }
    sum.range_m /= sum.power_w;
    for (effect, size) in acting {
        sum.power_w = effect.receive_w(*size, sight, sum);
    }
    Some(sum)
}

/// Equation (11) at one place.
fn echo_w(world: &World, base: &Base, acting: &[Acting], sight: &Sight, look: &Shot) -> f64 {
    let tilt: DVec2 = acting.iter().map(|(effect, size)| effect.tilt(*size, sight.chirp)).sum();
    let mut look = *look;
    if tilt != DVec2::ZERO {
        let (u, v) = look.normal.any_orthonormal_pair();
        look.normal = (look.normal + tilt.x * u + tilt.y * v).normalize();
    }
    let mut law = base.local();
    acting.iter().for_each(|(effect, size)| effect.surface(*size, &look, &mut law));
    let cos = look.cos_theta().max(0.0);
    let received_sr = world.waist.received_sr(sight.place_m, look.range_m);
    world.sent_w * received_sr * cos * cos * law.f_per_sr(cos)
}

/// What the rays of one chirp meet on the target as it really stands.
fn looks(world: &World, seed: u64, acting: &[Acting], sight: &Sight) -> Vec<Option<Shot>> {
    let moved: Vec<Displacement> =
        acting.iter().filter_map(|(effect, size)| effect.displacement(*size, sight)).collect();
    let diameter_m = acting.iter().find_map(|(effect, size)| effect.spot_diameter_m(*size));
    if moved.is_empty() && diameter_m.is_none() {
        return vec![sight.look];
    }
    let forward = sight.ray.direction.xyz();
    let origin = sight.ray.origin.xyz;
    let traced = |origin: DVec3, along: DVec3| {
        // The target stands still in its own frame, and the ray moves the other way.
        let back = |v: DVec3, d: &Displacement| d.rotation.transpose() * v;
        let start =
            moved.iter().fold(origin, |o, d| back(o - d.pivot - d.translation_m, d) + d.pivot);
        look(&world.bvh, &ray(start, moved.iter().fold(along, back))?)
    };
    let Some(diameter_m) = diameter_m else { return vec![traced(origin, forward)] };
    let range_m = sight.look.map_or(8.0, |look| look.range_m);
    // What is sent and received alike, exp(−8 ln 2·r²/D²), is a Gaussian of this standard deviation in each
    // direction.
    let sd_m = diameter_m / (16.0 * std::f64::consts::LN_2).sqrt();
    let turn_per_m = world.waist.turn_per_m(sight.place_m, range_m);
    let (u, v) = forward.any_orthonormal_pair();
    let mut random = draws(seed, sight.chirp, Stream::Spot);
    let mut within = |cell: usize| (cell as f64 + random.uniform()) / SPOT_CELLS as f64;
    let aside = |cell: usize| {
        let radius_m = sd_m * (-2.0 * (1.0 - within(cell / SPOT_CELLS)).ln()).sqrt();
        let (across, along) = (TAU * within(cell % SPOT_CELLS)).sin_cos();
        radius_m * (along * u + across * v)
    };
    // The wave runs at right angles to its front, on which all rays have come equally far.
    let ray = |aside_m: DVec3| {
        let along = forward + turn_per_m * aside_m;
        let way_m = range_m + 0.5 * turn_per_m * aside_m.length_squared();
        (origin + range_m * forward + aside_m - way_m * along.normalize(), along)
    };
    (0..SPOT_CELLS * SPOT_CELLS).map(aside).map(ray).map(|(o, along)| traced(o, along)).collect()
}
