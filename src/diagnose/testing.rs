//! Speckle that neighbours share, for tests: a field on a square grid of chirps.

use crate::effects::Shot;
use crate::radar::random::{Key, Purpose};
use crate::radar::{Chirps, Radar};

/// Chirps on a square grid with this step, m.
pub(super) const STEP_M: f64 = 0.006;
/// Chirps on a side.
pub(super) const SIDE: usize = 100;
/// Diameter of the spot, m.
pub(super) const SPOT_M: f64 = 0.016;

/// The chirps, row by row.
pub(super) fn shots() -> Vec<Shot> {
    let radar = Radar::default();
    let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
    let at = |index: usize| STEP_M * index as f64;
    (0..SIDE * SIDE)
        .map(|index| {
            let [xt_m, yt_m] = [at(index % SIDE), at(index / SIDE)];
            Shot { xt_m, yt_m, ..Shot::missed(&chirps, index, 0.0) }
        })
        .collect()
}

/// White noise, convolved so that places d apart share exp(−2d²/w²); independent for w = 0.
pub(super) fn field(width_m: f64, seed: u64) -> Vec<f64> {
    let noise: Vec<f64> = (0..SIDE * SIDE)
        .map(|index| {
            let key = Key { seed, chirp: index as u64, sub_ray: 0, purpose: Purpose::Fit };
            key.draws().gaussian()
        })
        .collect();
    let reach = (2.0 * width_m / STEP_M).ceil() as i64;
    let weight = |i: i64| {
        let off = i as f64 * STEP_M / width_m.max(1e-9);
        (-4.0 * off * off).exp()
    };
    let along = |values: &[f64], stride: usize| -> Vec<f64> {
        let place = |index: usize| (index / stride % SIDE) as i64;
        let sum = |index: usize| {
            let near = (-reach..=reach).filter(|i| (0..SIDE as i64).contains(&(place(index) + i)));
            let pairs = near.map(|i| (weight(i), (index as i64 + i * stride as i64) as usize));
            let (sum, squares) = pairs.fold((0.0, 0.0), |(sum, squares), (weight, other)| {
                (sum + weight * values[other], squares + weight * weight)
            });
            sum / f64::sqrt(squares)
        };
        (0..values.len()).map(sum).collect()
    };
    along(&along(&noise, 1), SIDE)
}
