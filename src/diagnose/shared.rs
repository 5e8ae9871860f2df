//! Speckle that neighbouring chirps share.
//!
//! Beams that overlap see the same scatterers, so that the effective number of observations is below that of the chirps. How much
//! they share is read from the residuals of the fitted model, whatever the radar declares: their correlation ρ over distance
//! in the target plane, less that at two to three spots, which a missing effect leaves and speckle does not. Ever nearer
//! places must share nearly all, as speckle does: a missing effect is a part of the scatter only. A
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
/// Correlation of places that lie ever closer from which on it is one of speckle. Beams on one place share all of it, and
/// a missing effect is a part of the scatter only.
const AT_ONE_PLACE: f64 = 0.55;
/// Widths of the correlation that are tried, in spots.
const WIDTHS: std::ops::RangeInclusive<u32> = 2..=16;
const WIDTH_STEP: f64 = 0.1;
/// Distance, in widths, at which the kernel has fallen to 3·10⁻⁴.
const KERNEL_REACH: f64 = 2.0;
/// Distance, in widths, at which it has fallen to [`LEAST`].
const KERNEL_END: f64 = 1.4;
/// Share of a determinant below which it is rounding.
const SINGULAR: f64 = 1e-12;
/// Largest residual that counts, in standard deviations: a small bright place is not speckle.
const MOST: f64 = 2.5;

/// How much each shot counts.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SharedSpeckle {
    /// Share of an independent observation in every shot, above 0 and at most 1; empty where each is one.
    weights: Vec<f64>,
    /// Σρ/Σρ³ over all pairs: by so much the third powers of residuals are more independent than the residuals.
    cubes: f64,
    /// Distance up to which shots share speckle, m.
    pub reach_m: f64,
    /// Width w of the kernel exp(−2d²/w²) by which places d apart share, m.
    width_m: f64,
}

/// Shots that share nothing.
pub(super) static ALONE: SharedSpeckle =
    SharedSpeckle { weights: Vec::new(), cubes: 1.0, reach_m: 0.0, width_m: 0.0 };

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
            .filter(move |&&other| other != index && is_one_field(&self.shots[other], shot))
            .map(|&other| (other, distance_m(shot, &self.shots[other])))
            .filter(|(_, apart_m)| *apart_m < self.farthest_m)
    }
}

/// Whether two shots see one field of speckle: that behind other sheets is another one.
fn is_one_field(a: &Shot, b: &Shot) -> bool {
    (a.scan, a.sheets) == (b.scan, b.sheets)
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
        let (shares, width) = correlations(&residuals(z, observations), &neighbours, lag_m);
        let reach = shares.len();
        if reach == 0 {
            return ALONE.clone();
        }
        // Σρ and Σρ³ of each shot with all, itself included.
        let sums: Vec<[f64; 2]> = (0..shots.len())
            .into_par_iter()
            .map(|index| {
                let lags = neighbours.of(index).map(|(_, apart_m)| (apart_m / lag_m) as usize);
                let found = lags.filter_map(|lag| shares.get(lag));
                found.fold([1.0; 2], |[sum, cubes], share| [sum + share, cubes + share.powi(3)])
            })
            .collect();
        let all = |power: usize| sums.iter().map(|sums| sums[power]).sum::<f64>();
        let (cubes, weights) = (all(0) / all(1), sums.iter().map(|sums| 1.0 / sums[0]).collect());
        // The correlation of few independent places may fall short of its kernel by chance.
        let reach_m = (reach as f64 * lag_m).max(KERNEL_END * width * spot_m);
        SharedSpeckle { weights, cubes, reach_m, width_m: width * spot_m }
    }

    /// What shots share with those of so many chirps later, summed over all of a scan with so many `places` for chirps, as if it
    /// began again at its end.
    pub fn by_lag(&self, shots: &[Shot], places: usize) -> Vec<f64> {
        let mut sums = vec![0.0; places];
        let neighbours = Neighbours::new(shots, KERNEL_REACH * self.width_m);
        for (index, shot) in shots.iter().enumerate() {
            sums[0] += 1.0;
            for (other, apart_m) in neighbours.of(index) {
                let later = i64::from(shots[other].chirp) - i64::from(shot.chirp);
                let share = (-2.0 * (apart_m / self.width_m).powi(2)).exp();
                sums[later.rem_euclid(places as i64) as usize] += share;
            }
        }
        sums
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

    /// As many independent shots scatter as much in the third powers of their residuals.
    pub fn count_of_cubes(&self, shots: usize) -> f64 {
        self.cubes * self.count(shots)
    }

    /// The weights of some of the shots.
    pub fn part(&self, shots: std::ops::Range<usize>) -> SharedSpeckle {
        let weights = self.weights.get(shots).unwrap_or_default().to_vec();
        SharedSpeckle { weights, ..*self }
    }

    /// The weights of every n-th shot.
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

/// Correlation of residuals at every lag, up to where none is left, and the width of its kernel, in spots; empty where
/// neighbours share nothing.
fn correlations(z: &[Option<f64>], neighbours: &Neighbours, lag_m: f64) -> (Vec<f64>, f64) {
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
    let measured: Vec<[f64; 3]> = (0..lags)
        .filter_map(|lag| {
            Some([(lag as f64 + 0.5) / PER_SPOT, share(mean(lag, lag + 1)?), counts[lag]])
        })
        .collect();
    let [at_one_place, width] = kernel(&measured);
    if at_one_place < AT_ONE_PLACE {
        return (Vec::new(), 0.0);
    }
    // Within half a spot, or where a coarse scan has its nearest neighbours.
    let nearest = (1..=PER_SPOT as usize).find_map(|end| mean(0, end));
    let near = mean(0, (0.5 * PER_SPOT) as usize).or(nearest);
    if near.is_none_or(|near| share(near) < SHARED) {
        return (Vec::new(), 0.0);
    }
    // A distance at which there are no neighbours ends nothing.
    let shares = (0..lags).map(|lag| mean(lag, lag + 1).map(share));
    let shares = shares.take_while(|share| share.is_none_or(|share| share >= LEAST));
    (shares.map(|share| share.unwrap_or(0.0)).collect(), width)
}

/// The correlation a of places that lie ever closer and the width w, in spots, of the kernel a·exp(−2d²/w²) + b that fits
/// best. `measured`: distance in spots, correlation and number of pairs, from the nearest on.
fn kernel(measured: &[[f64; 3]]) -> [f64; 2] {
    let mut best = (f64::INFINITY, [0.0; 2]);
    // A kernel narrower than the nearest neighbours are apart would tell nothing.
    let nearest = measured.first().map_or(0.0, |[apart, ..]| *apart);
    let widths = WIDTHS.map(|width| WIDTH_STEP * f64::from(width));
    for width in widths.filter(|width| *width >= nearest) {
        let kernel = |apart: f64| (-2.0 * (apart / width).powi(2)).exp();
        // Least squares of a and b.
        let mut sums = [0.0; 6];
        for &[apart, share, pairs] in measured {
            let k = kernel(apart);
            let products = [1.0, k, k * k, share, k * share, share * share];
            sums.iter_mut().zip(products).for_each(|(sum, product)| *sum += pairs * product);
        }
        let [n, k, kk, s, ks, ss] = sums;
        let determinant = n * kk - k * k;
        if determinant <= SINGULAR * n * kk {
            continue;
        }
        let a = (n * ks - k * s) / determinant;
        let b = (s - a * k) / n;
        let left = ss - a * ks - b * s;
        if left < best.0 {
            best = (left, [a, width]);
        }
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::testing::{SIDE, SPOT_M, STEP_M, field, shots};

    fn found(z: &[f64]) -> SharedSpeckle {
        let seen = Observation::detected(1e-9, None);
        SharedSpeckle::of(z, &vec![seen; z.len()], &shots(), SPOT_M)
    }

    #[test]
    fn shots_count_as_much_as_they_have_to_themselves() {
        for width_m in [0.0136, 0.0192] {
            let found = found(&field(width_m, 1));
            // Σρ over the square lattice.
            let lattice = |i: i64| (-2.0 * (i as f64 * STEP_M / width_m).powi(2)).exp();
            let side: f64 = (-20..=20).map(lattice).sum();
            let weight = found.weight(SIDE * SIDE / 2 + SIDE / 2);
            assert!((weight * side * side - 1.0).abs() < 0.2, "{width_m}: {weight} {side}");
            // At the edge there are fewer neighbours.
            assert!(found.weight(0) > 1.5 * weight);
            assert!(found.reach_m > width_m && found.reach_m < 2.2 * width_m, "{}", found.reach_m);
        }
    }

    #[test]
    fn shared_speckle_is_no_swing_and_hides_none() {
        for seed in 0..20 {
            // A tenth of the scatter is that of each chirp.
            let (speckle, own) = (field(0.0136, seed), field(0.0, seed + 100));
            for (amplitude, is_found) in [(0.0, false), (0.5, true)] {
                let z: Vec<f64> = (0..SIDE * SIDE)
                    .map(|index| {
                        let swing = (std::f64::consts::TAU * index as f64 / 310.0).sin();
                        0.91f64.sqrt() * speckle[index] + 0.3 * own[index] + amplitude * swing
                    })
                    .collect();
                let swing = crate::diagnose::order::swing(&z, &shots(), &found(&z), 2.3);
                assert_eq!(swing.is_some(), is_found, "{seed}: {swing:?}");
            }
        }
    }

    #[test]
    fn independent_shots_and_what_is_missing_share_no_speckle() {
        assert_eq!(found(&field(0.0, 2)), ALONE);
        // A slope of one and a half standard deviations over the target.
        let slope = |index: usize| 3.0 * ((index % SIDE) as f64 / SIDE as f64 - 0.5);
        let leaning: Vec<f64> =
            field(0.0, 3).iter().enumerate().map(|(index, z)| z + slope(index)).collect();
        assert_eq!(found(&leaning), ALONE);
        // What is missing is a third of the scatter, or shared speckle is most of it.
        let [third, most] = [(0.3f64, 0.7f64), (0.8, 0.2)].map(|(shared, own)| {
            let both = field(0.0136, 5).into_iter().zip(field(0.0, 6));
            let z: Vec<f64> = both.map(|(a, b)| shared.sqrt() * a + own.sqrt() * b).collect();
            found(&z)
        });
        assert!(third == ALONE && most.is_any());
        // A patch of 5 cm that is four standard deviations brighter.
        let bright = |index: usize| index % SIDE < 8 && index / SIDE < 8;
        let patched: Vec<f64> = (field(0.0, 4).iter().enumerate())
            .map(|(index, z)| if bright(index) { z + 4.0 } else { *z })
            .collect();
        assert_eq!(found(&patched), ALONE);
    }
}
