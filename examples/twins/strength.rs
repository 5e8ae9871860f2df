//! How strong an effect is, and the size that makes it weak, moderate or strong.
//!
//! The measure is what the base law leaves, in dB rms over chirps whose mean lies above the
//! threshold, once all four identified parameters are refitted to the noise-free means.

use super::base::Base;
use super::physics::{Acting, Class, Effect, Report, means};
use super::refit::{Floor, Point, rms_left_db};
use super::scan::World;

/// Chirps that a calibration looks at.
const CALIBRATED: usize = 4600;
const HALVINGS: usize = 16;
/// A strength this near to the class, as a share, is the class.
const NEAR: f64 = 0.02;
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
    let noise_w = thermal_w(world, acting);
    let points: Vec<Point> = std::iter::zip(world.sights.iter().step_by(stride), &means)
        .filter_map(|(sight, mean)| {
            let (look, Report { power_w, .. }) = (sight.look?, (*mean)?);
            let (power_w, cos_theta) = (power_w + noise_w, look.cos_theta());
            let range2 = look.range_m * look.range_m;
            let watts_per_f = world.sent_w * world.aperture_m2 / range2 * cos_theta * cos_theta;
            let power_db = 10.0 * power_w.log10();
            (power_w >= world.threshold_w).then_some(Point { cos_theta, watts_per_f, power_db })
        })
        .collect();
    let floor = Floor { noise_w: world.noise_w, threshold_w: world.threshold_w };
    if points.len() < FEWEST { 0.0 } else { rms_left_db(&points, &base, floor) }
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
    let strength = |size: f64| rms_db(world, seed, base, &[(effect, size)], stride);
    let wanted = class.rms_db();
    let [least, most] = effect.sizes();
    let mut low = least;
    // The largest size may hide nearly everything below the threshold; the strongest of a few is
    // what can be reached.
    let steps = 6;
    let sizes = (0..=steps).map(|n| least * (most / least).powf(f64::from(n) / f64::from(steps)));
    let mut reached = 0.0;
    let mut bracket = None;
    for size in sizes {
        let rms = strength(size);
        reached = f64::max(reached, rms);
        if rms >= wanted {
            bracket = Some(size);
            break;
        }
        low = size;
    }
    let Some(above) = bracket else { return Err(reached) };
    if above == least {
        return Err(reached);
    }
    let mut high = above;
    for _ in 0..HALVINGS {
        let size = (low * high).sqrt();
        let rms = strength(size);
        if (rms / wanted - 1.0).abs() < NEAR {
            return Ok(size);
        }
        if rms > wanted { high = size } else { low = size }
    }
    let size = (low * high).sqrt();
    let rms = strength(size);
    if (rms / wanted - 1.0).abs() < FAR { Ok(size) } else { Err(rms) }
}
