//! How strong an effect is, and the size that makes it weak, moderate or strong.
//!
//! The measure is what the base law leaves, in dB rms over chirps whose mean lies above the
//! threshold, once all four identified parameters are refitted to the noise-free means.

use super::base::Base;
use super::physics::{Acting, Class, Echo, Effect, means};
use super::refit::{Floor, Point, rms_left_db};
use super::scan::World;

/// Chirps that a calibration looks at.
const CALIBRATED: usize = 4600;
const HALVINGS: usize = 16;
/// A strength this near to the class, as a share, is the class.
const NEAR: f64 = 0.02;
/// How far a calibration on some chirps may be off over all, as a share.
const CLOSE: f64 = 0.08;
/// A second calibration looks this factor about the first.
const AROUND: f64 = 1.5;
/// Farther from the class than this, as a share, is another class: the strength jumps there.
const FAR: f64 = 0.15;
/// Fewer detections than this measure nothing.
const FEWEST: usize = 40;

/// Thermal power that is really there, W.
pub fn thermal_w(world: &World, acting: &[Acting]) -> f64 {
    acting.iter().find_map(|(effect, size)| effect.thermal_w(*size)).unwrap_or(world.noise_w)
}

/// The base law with what the effects ask of the material.
pub fn material(base: &Base, acting: &[Acting]) -> Base {
    let mut base = *base;
    acting.iter().for_each(|(effect, size)| effect.material(*size, &mut base));
    base
}

/// What the refitted base law leaves of the means of every `stride`-th chirp, dB rms.
pub fn rms_db(world: &World, seed: u64, base: &Base, acting: &[Acting], stride: usize) -> f64 {
    let base = material(base, acting);
    let means = means(world, seed, &base, acting, stride);
    let points: Vec<Point> =
        points(world, &means, thermal_w(world, acting), stride).into_iter().flatten().collect();
    if points.len() < FEWEST { 0.0 } else { rms_left_db(&points, &base, floor(world)) }
}

/// What the instrument is declared to be.
pub fn floor(world: &World) -> Floor {
    Floor { noise_w: world.noise_w, threshold_w: world.threshold_w }
}

/// The means of every `stride`-th chirp with thermal noise, at the declared geometry; `None` for what lies below
/// the threshold.
pub fn points(
    world: &World,
    means: &[Option<Echo>],
    noise_w: f64,
    stride: usize,
) -> Vec<Option<Point>> {
    std::iter::zip(world.sights.iter().step_by(stride), means)
        .map(|(sight, mean)| {
            let (look, Echo { report, .. }) = (sight.look?, (*mean)?);
            let (power_w, cos_theta) = (report.power_w + noise_w, look.cos_theta());
            let received_sr = world.waist.received_sr(sight.place_m, look.range_m);
            let watts_per_f = world.sent_w * received_sr * cos_theta * cos_theta;
            let power_db = 10.0 * power_w.log10();
            let beam_slope = world.waist.slope(sight.place_m);
            let point = Point { cos_theta, watts_per_f, power_db, beam_slope };
            (power_w >= world.threshold_w).then_some(point)
        })
        .collect()
}

/// The size at which an effect is of a class.
///
/// # Errors
/// The strength that the largest (or smallest) sensible size reaches, dB, when that is not enough
/// (or too much).
pub fn size_of(
    world: &World,
    seed: u64,
    base: &Base,
    effect: &dyn Effect,
    class: Class,
) -> Result<f64, f64> {
    if let Some(size) = effect.size_of(class, world) {
        return Ok(size);
    }
    let stride = (world.sights.len() / CALIBRATED).max(1);
    let wanted = class.rms_db();
    let at = |stride: usize| move |size: f64| rms_db(world, seed, base, &[(effect, size)], stride);
    let [low, high] = bracket(at(stride), effect.sizes(), wanted)?;
    let size = bisect(at(stride), [low, high], wanted, HALVINGS);
    if near(at(1)(size), wanted, CLOSE) {
        return Ok(size);
    }
    // The few chirps were not like all.
    let size = bisect(at(1), [size / AROUND, size * AROUND], wanted, HALVINGS / 2);
    let rms = at(1)(size);
    if near(rms, wanted, FAR) { Ok(size) } else { Err(rms) }
}

fn near(rms: f64, wanted: f64, share: f64) -> bool {
    (rms / wanted - 1.0).abs() < share
}

/// The first of a few sizes that is strong enough, and the one before; else the strongest reached.
/// The largest may hide nearly everything below the threshold.
fn bracket(
    strength: impl Fn(f64) -> f64,
    [least, most]: [f64; 2],
    wanted: f64,
) -> Result<[f64; 2], f64> {
    const STEPS: i32 = 6;
    let size = |step: i32| least * (most / least).powf(f64::from(step) / f64::from(STEPS));
    let mut reached = 0.0;
    for step in 0..=STEPS {
        let rms = strength(size(step));
        if rms >= wanted {
            return if step == 0 { Err(rms) } else { Ok([size(step - 1), size(step)]) };
        }
        reached = f64::max(reached, rms);
    }
    Err(reached)
}

fn bisect(
    strength: impl Fn(f64) -> f64,
    [mut low, mut high]: [f64; 2],
    wanted: f64,
    halvings: usize,
) -> f64 {
    for _ in 0..halvings {
        let size = (low * high).sqrt();
        let rms = strength(size);
        if near(rms, wanted, NEAR) {
            return size;
        }
        if rms > wanted { high = size } else { low = size }
    }
    (low * high).sqrt()
}
