//! Speckle that neighbouring chirps share.
//!
//! Beams that overlap see the same scatterers, so that chirps are fewer observations than they are chirps. How much they
//! share is read from the residuals of the fitted model, whatever the radar declares: their correlation ρ over distance
//! in the target plane, less that at two to three spots, which a missing effect leaves and speckle does not. A
//! chirp then counts in the likelihood as 1/Σρ over itself and its neighbours. The score of a mean that changes slowly
//! over a spot has the variance Σᵢ wᵢ·Σⱼ wⱼρᵢⱼ ≈ Σ wᵢ, as much as its curvature says, so that gains and standard
//! deviations keep their meaning (Varin, Reid & Firth 2011, "An overview of composite likelihood methods").
//! Ranges do not share their errors and count in full.

use std::collections::HashMap;

use rayon::prelude::*;

use super::folds::square;
use super::observation::Observation;
use crate::effects::Shot;

/// Distances over which the correlation is averaged, per spot.
const PER_SPOT: f64 = 4.0;
/// Farthest neighbours, in spots.
const FARTHEST: f64 = 3.0;
/// From here on, in spots, what neighbours share is not speckle.
const BEYOND: f64 = 2.0;
/// Correlation below which neighbours share nothing.
const LEAST: f64 = 0.02;
/// Mean correlation within half a spot from which on neighbours count as sharing at all. A missing effect that is as
/// small as a spot leaves less.
const SHARED: f64 = 0.1;
/// Largest residual that counts, in standard deviations: a small bright place is not speckle.
const MOST: f64 = 2.5;

/// How much each shot counts.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct SharedSpeckle {
    /// Share of an independent observation in every shot, above 0 and at most 1; empty where each is one.
    weights: Vec<f64>,
    /// Distance up to which shots share speckle, m.
    pub reach_m: f64,
}

/// Shots that share nothing.
pub(super) static ALONE: SharedSpeckle = SharedSpeckle { weights: Vec::new(), reach_m: 0.0 };

/// Shots in squares as wide as the farthest neighbours.
struct Neighbours<'a> {
    shots: &'a [Shot],
    farthest_m: f64,
    members: HashMap<[i64; 2], Vec<usize>>,
}

impl Neighbours<'_> {
    fn new(shots: &[Shot], farthest_m: f64) -> Neighbours<'_> {
        let mut members: HashMap<[i64; 2], Vec<usize>> = HashMap::new();
        for (index, shot) in shots.iter().enumerate() {
            members.entry(square(shot, farthest_m)).or_default().push(index);
        }
        Neighbours { shots, farthest_m, members }
    }

    /// The other shots within reach of one, with their distances, m.
    fn of(&self, index: usize) -> impl Iterator<Item = (usize, f64)> {
        let shot = &self.shots[index];
        let [i, j] = square(shot, self.farthest_m);
        let squares = (-1..=1).flat_map(move |di| (-1..=1).map(move |dj| [i + di, j + dj]));
        squares
            .flat_map(|square| self.members.get(&square).into_iter().flatten())
            .filter(move |&&other| other != index)
            .map(|&other| (other, distance_m(shot, &self.shots[other])))
            .filter(|(_, apart_m)| *apart_m < self.farthest_m)
    }
}

fn distance_m(a: &Shot, b: &Shot) -> f64 {
    (a.xt_m - b.xt_m).hypot(a.yt_m - b.yt_m)
}

impl SharedSpeckle {
    /// What the residuals `z` of a model say; no shares where shots are independent. `spot_m`: diameter of the spot.
    pub fn of(
        z: &[f64],
        observations: &[Observation],
        shots: &[Shot],
        spot_m: f64,
    ) -> SharedSpeckle {
        let lag_m = spot_m / PER_SPOT;
        let neighbours = Neighbours::new(shots, FARTHEST * spot_m);
        let shares = correlations(&residuals(z, observations), &neighbours, lag_m);
        let reach = shares.len();
        if reach == 0 {
            return SharedSpeckle::default();
        }
        let weight = |index: usize| {
            let lags = neighbours.of(index).map(|(_, apart_m)| (apart_m / lag_m) as usize);
            1.0 / (1.0 + lags.filter_map(|lag| shares.get(lag)).sum::<f64>())
        };
        let weights = (0..shots.len()).into_par_iter().map(weight).collect();
        SharedSpeckle { weights, reach_m: reach as f64 * lag_m }
    }

    /// Whether shots share speckle.
    pub fn is_any(&self) -> bool {
        !self.weights.is_empty()
    }

    /// Share of an independent observation in a shot.
    pub fn weight(&self, shot: usize) -> f64 {
        self.weights.get(shot).copied().unwrap_or(1.0)
    }

    /// Independent observations in so many shots.
    pub fn count(&self, shots: usize) -> f64 {
        (0..shots).map(|shot| self.weight(shot)).sum()
    }

    /// The weights of every so manieth shot.
    pub fn step_by(&self, every: usize) -> SharedSpeckle {
        let weights = self.weights.iter().step_by(every).copied().collect();
        SharedSpeckle { weights, ..*self }
    }
}

/// Residuals about their mean; none of a shot without a detection, of which a part is drawn.
fn residuals(z: &[f64], observations: &[Observation]) -> Vec<Option<f64>> {
    let detected =
        |(z, seen): (&f64, &Observation)| seen.power_w.is_some().then_some(z.clamp(-MOST, MOST));
    let found: Vec<Option<f64>> = z.iter().zip(observations).map(detected).collect();
    let count = found.iter().flatten().count().max(1) as f64;
    let mean = found.iter().flatten().sum::<f64>() / count;
    found.into_iter().map(|z| z.map(|z| z - mean)).collect()
}

/// Correlation of residuals at every lag, up to where none is left; empty where neighbours share nothing.
fn correlations(z: &[Option<f64>], neighbours: &Neighbours, lag_m: f64) -> Vec<f64> {
    let lags = (FARTHEST * PER_SPOT) as usize;
    let none = || (vec![0.0; lags], vec![0.0; lags]);
    let of_shot = |(mut sums, mut counts): (Vec<f64>, Vec<f64>), index: usize| {
        if let Some(here) = z[index] {
            for (other, apart_m) in neighbours.of(index) {
                let lag = ((apart_m / lag_m) as usize).min(lags - 1);
                if let Some(there) = z[other] {
                    sums[lag] += here * there;
                    counts[lag] += 1.0;
                }
            }
        }
        (sums, counts)
    };
    // In one order, whatever the number of threads.
    let parts: Vec<(Vec<f64>, Vec<f64>)> = (0..z.len())
        .into_par_iter()
        .chunks(1024)
        .map(|indices| indices.into_iter().fold(none(), of_shot))
        .collect();
    let (mut sums, mut counts) = none();
    for (part, count) in parts {
        sums.iter_mut().zip(part).for_each(|(sum, part)| *sum += part);
        counts.iter_mut().zip(count).for_each(|(sum, part)| *sum += part);
    }
    let mean = |from: usize, to: usize| {
        let count: f64 = counts[from..to].iter().sum();
        (count > 0.0).then(|| sums[from..to].iter().sum::<f64>() / count)
    };
    let beyond = mean((BEYOND * PER_SPOT) as usize, lags).unwrap_or(0.0).max(0.0);
    let detected = z.iter().flatten().count().max(1) as f64;
    let variance = z.iter().flatten().map(|z| z * z).sum::<f64>() / detected - beyond;
    let share = |mean: f64| ((mean - beyond) / variance.max(f64::MIN_POSITIVE)).min(1.0);
    if mean(0, (0.5 * PER_SPOT) as usize).is_none_or(|near| share(near) < SHARED) {
        return Vec::new();
    }
    // A distance at which there are no neighbours ends nothing.
    let shares = (0..lags).map(|lag| mean(lag, lag + 1).map(share));
    shares
        .take_while(|share| share.is_none_or(|share| share >= LEAST))
        .map(|s| s.unwrap_or(0.0))
        .collect()
}
