//! Statistics of a curve by angle, in linear power, with censored points.
//!
//! A point below its threshold shares its weight among all lower detections (the estimate of Kaplan
//! and Meier, 1958, mirrored for left-censored data as in Helsel, "Statistics for Censored
//! Environmental Data", 2012). Weight below which there is no detection lies anywhere from 0 to the
//! threshold: the mean has a least and a greatest value, and a quantile in it is only a bound.

use std::f64::consts::FRAC_PI_2;

use crate::material::{Censor, Observation};
use crate::radar::random::{Key, Purpose};

/// Statistics of the points in one range of angles.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct AngleStatistics {
    /// Least and greatest angle of incidence, rad; equal where points were taken at one angle.
    pub theta_rad: [f64; 2],
    /// Number of points, the censored ones included.
    pub points: u32,
    /// Number of points below their threshold.
    pub censored_points: u32,
    /// The highest threshold below which there is no detection, σ⁰; none where a detection is lowest.
    pub threshold_sigma0: Option<f64>,
    /// Least and greatest mean σ⁰ that the points allow; equal where none is censored.
    pub mean: [f64; 2],
    /// 5, 50 and 95 % quantiles of σ⁰; none where it is only known to be below the threshold.
    pub quantiles: [Option<f64>; 3],
    /// 95 % interval of the mean by a bootstrap of blocks; none for few points.
    pub interval_95: Option<[f64; 2]>,
}

/// Seed of the bootstrap, fixed so that stored statistics can be reproduced.
const SEED: u64 = 0;
const RESAMPLES: u64 = 400;
/// Fewer points than this give no interval.
const LEAST_POINTS: usize = 8;
/// Angles nearer than this, rad, differ by rounding only.
const SAME_ANGLE_RAD: f64 = 1e-12;
/// Points in a bin of one degree from which on bins are worth more than angles.
const POINTS_PER_BIN: usize = 5;

/// The statistics of a curve's backscatter, by rising angle: of each angle where angles repeat, else of
/// each degree, if there are points enough for that. None where a point is above the instrument's
/// range.
pub fn by_angle(observations: &[Observation]) -> Vec<AngleStatistics> {
    if observations.iter().any(|o| o.is_retro() && o.censor == Censor::Right) {
        return Vec::new();
    }
    let mut points = points(observations.iter());
    points.sort_by(|a, b| a.theta_rad.total_cmp(&b.theta_rad));
    let angles = points.chunk_by(|a, b| b.theta_rad - a.theta_rad < SAME_ANGLE_RAD);
    let degrees = points.chunk_by(|a, b| a.degree() == b.degree());
    let are_scattered = angles.clone().count() * 2 > points.len();
    if are_scattered && degrees.clone().count() * POINTS_PER_BIN <= points.len() {
        degrees.zip(0..).filter_map(|(bin, number)| of_degree(bin, number)).collect()
    } else {
        angles.zip(0..).filter_map(|(bin, number)| of_angle(bin, number)).collect()
    }
}

/// Median σ⁰ of backscatter taken together whatever its angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Median {
    /// It is this.
    At(f64),
    /// It is below this.
    Below(f64),
    /// Without points, or with one above the instrument's range.
    Unknown,
}

/// The median of points taken together, as [`by_angle`] gives it for each angle.
pub fn median<'a>(observations: impl Iterator<Item = &'a Observation> + Clone) -> Median {
    if observations.clone().any(|o| o.is_retro() && o.censor == Censor::Right) {
        return Median::Unknown;
    }
    let points = points(observations);
    let spread = Sample::new(&points).spread(&vec![1; points.len()]);
    match (spread.quantile(0.5), spread.threshold()) {
        (Some(sigma0), _) => Median::At(sigma0),
        (None, Some(threshold)) => Median::Below(threshold),
        (None, None) => Median::Unknown,
    }
}

/// Quantiles of the backscatter of points taken together, σ⁰, one for each share, 0 to 1; none where one is only known to
/// be below a threshold, and of points of which one is above the instrument's range.
pub fn quantiles<const N: usize>(
    observations: &[Observation],
    shares: [f64; N],
) -> [Option<f64>; N] {
    if observations.iter().any(|o| o.is_retro() && o.censor == Censor::Right) {
        return [None; N];
    }
    let points = points(observations.iter());
    let spread = Sample::new(&points).spread(&vec![1; points.len()]);
    shares.map(|share| spread.quantile(share))
}

/// A point of a bin.
#[derive(Clone, Copy)]
struct Point {
    theta_rad: f64,
    /// σ⁰, or the threshold that it is below.
    level: f64,
    is_censored: bool,
    /// Order in time.
    order: (Option<u32>, usize),
}

/// The points of backscatter that have a level or a limit.
fn points<'a>(observations: impl Iterator<Item = &'a Observation>) -> Vec<Point> {
    observations.enumerate().filter_map(|(place, o)| Point::new(o, place)).collect()
}

impl Point {
    fn new(o: &Observation, place: usize) -> Option<Point> {
        let (theta_rad, level, is_censored) = (o.theta_i_rad, o.level_sigma0()?, o.is_censored());
        o.is_retro().then_some(Point { theta_rad, level, is_censored, order: (o.chirp, place) })
    }

    fn degree(&self) -> u32 {
        self.theta_rad.to_degrees() as u32
    }
}

fn of_degree(bin: &[Point], number: u64) -> Option<AngleStatistics> {
    let degree = f64::from(bin.first()?.degree());
    let theta_rad = [degree, degree + 1.0].map(|edge| edge.to_radians().min(FRAC_PI_2));
    Some(statistics(bin, theta_rad, number))
}

fn of_angle(bin: &[Point], number: u64) -> Option<AngleStatistics> {
    let theta_rad = [bin.first()?.theta_rad, bin.last()?.theta_rad];
    Some(statistics(bin, theta_rad, number))
}

fn statistics(bin: &[Point], theta_rad: [f64; 2], number: u64) -> AngleStatistics {
    let mut points = bin.to_vec();
    points.sort_by_key(|point| point.order);
    let sample = Sample::new(&points);
    let spread = sample.spread(&vec![1; points.len()]);
    let censored = points.iter().filter(|point| point.is_censored).count();
    AngleStatistics {
        theta_rad,
        points: u32::try_from(points.len()).unwrap_or(u32::MAX),
        censored_points: u32::try_from(censored).unwrap_or(u32::MAX),
        threshold_sigma0: spread.threshold(),
        mean: spread.mean(),
        quantiles: [0.05, 0.5, 0.95].map(|share| spread.quantile(share)),
        interval_95: (points.len() >= LEAST_POINTS).then(|| sample.interval(number)),
    }
}

/// Points in the order of time, and how to go through them from the highest level.
struct Sample<'a> {
    points: &'a [Point],
    /// Places of the points; of equal levels the detection first, since it is not below.
    descending: Vec<usize>,
}

impl<'a> Sample<'a> {
    fn new(points: &'a [Point]) -> Sample<'a> {
        let mut by_level: Vec<(usize, &Point)> = points.iter().enumerate().collect();
        by_level.sort_by(|(_, a), (_, b)| {
            b.level.total_cmp(&a.level).then(a.is_censored.cmp(&b.is_censored))
        });
        Sample { points, descending: by_level.into_iter().map(|(place, _)| place).collect() }
    }

    /// Shares of the levels when point i occurs `times[i]` times.
    fn spread(&self, times: &[u32]) -> Spread {
        let mut left: f64 = times.iter().map(|&n| f64::from(n)).sum();
        let mut weight = 1.0;
        let (mut detected, mut below) = (Vec::new(), Vec::new());
        for &place in &self.descending {
            let (Some(point), Some(&n)) = (self.points.get(place), times.get(place)) else {
                continue;
            };
            let n = f64::from(n);
            if n == 0.0 {
                continue;
            }
            if point.is_censored {
                below.push((point.level, n));
            } else {
                // Earlier censored points share their weight with this one.
                below.clear();
                let share = weight * n / left;
                detected.push((point.level, share));
                weight -= share;
            }
            left -= n;
        }
        let total: f64 = below.iter().map(|(_, n)| n).sum();
        let below = below.into_iter().map(|(level, n)| (level, weight * n / total)).collect();
        Spread { detected, below }
    }

    /// 95 % interval of the mean, from resamples of blocks: neighbours in time illuminate nearly the same
    /// place, so that they are drawn together.
    fn interval(&self, number: u64) -> [f64; 2] {
        let (mut least, mut greatest) = (Vec::new(), Vec::new());
        for resample in 0..RESAMPLES {
            let purpose = Purpose::Bootstrap;
            let key = Key { seed: SEED, chirp: number, sub_ray: resample, purpose };
            let [low, high] = self.spread(&self.drawn(&key)).mean();
            least.push(low);
            greatest.push(high);
        }
        [end(&mut least, 0.025), end(&mut greatest, 0.975)]
    }

    /// How often each point is in a resample: blocks of ∛n neighbours from drawn starts.
    fn drawn(&self, key: &Key) -> Vec<u32> {
        let n = self.points.len();
        let block = (n as f64).cbrt().ceil() as usize;
        let mut draws = key.draws();
        let mut times = vec![0; n];
        for _ in 0..n.div_ceil(block) {
            let start = (draws.uniform() * n as f64) as usize;
            for step in 0..block {
                if let Some(count) = times.get_mut((start + step) % n) {
                    *count += 1;
                }
            }
        }
        times
    }
}

/// The value below which this share of the values lies.
fn end(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let place = (share * (values.len() as f64 - 1.0)).round() as usize;
    values.get(place).copied().unwrap_or_default()
}

/// Levels with their shares, from the highest.
struct Spread {
    detected: Vec<(f64, f64)>,
    /// Thresholds that no detection lies below.
    below: Vec<(f64, f64)>,
}

impl Spread {
    fn mean(&self) -> [f64; 2] {
        let [least, undetected] = [&self.detected, &self.below]
            .map(|levels| levels.iter().map(|(level, share)| level * share).sum::<f64>());
        [least, least + undetected]
    }

    fn threshold(&self) -> Option<f64> {
        self.below.first().map(|(level, _)| *level)
    }

    fn quantile(&self, share: f64) -> Option<f64> {
        const ROUNDING: f64 = 1e-12;
        let mut above = 0.0;
        for (level, weight) in &self.detected {
            above += weight;
            if 1.0 - above < share - ROUNDING {
                return Some(*level);
            }
        }
        // Without weight below a threshold, the lowest detection is the quantile.
        self.detected.last().filter(|_| self.below.is_empty()).map(|(level, _)| *level)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(theta_deg: f64, sigma0: f64, censor: Censor) -> Observation {
        let theta_rad = theta_deg.to_radians();
        let is_detected = censor == Censor::None;
        let (level, limit) = (is_detected.then_some(sigma0), (!is_detected).then_some(sigma0));
        Observation { censor, ..Observation::backscatter(theta_rad, level, limit) }
    }

    fn detected(level: f64) -> Observation {
        at(10.0, level, Censor::None)
    }

    fn below(level: f64) -> Observation {
        at(10.0, level, Censor::Left)
    }

    fn one(observations: &[Observation]) -> AngleStatistics {
        let all = by_angle(observations);
        assert_eq!(all.len(), 1);
        all[0]
    }

    #[test]
    fn without_censoring_it_is_the_ordinary_mean_and_the_ordinary_quantile() {
        let found = one(&[1.0, 2.0, 3.0, 6.0].map(detected));
        assert!((found.mean[0] - 3.0).abs() < 1e-12 && found.mean[0] == found.mean[1]);
        assert_eq!(found.quantiles, [Some(1.0), Some(2.0), Some(6.0)]);
        assert_eq!((found.threshold_sigma0, found.interval_95), (None, None));
    }

    #[test]
    fn the_mean_is_bounded_by_what_censored_points_may_be() {
        let found = one(&[detected(4.0), detected(2.0), below(1.0), below(1.0)]);
        assert!((found.mean[0] - 1.5).abs() < 1e-12 && (found.mean[1] - 2.0).abs() < 1e-12);
        assert_eq!(found.quantiles, [None, None, Some(4.0)]);
        assert_eq!((found.points, found.censored_points), (4, 2));
        assert_eq!(found.threshold_sigma0, Some(1.0));
    }

    #[test]
    fn what_is_censored_above_a_detection_takes_its_place_below() {
        // By hand: 8 has 1/4; the rest, 3/4, is of the two below 4, each 3/8.
        let found = one(&[detected(8.0), below(4.0), detected(2.0), detected(1.0)]);
        let expected = 8.0 / 4.0 + 3.0 / 8.0 * 3.0;
        assert!((found.mean[0] - expected).abs() < 1e-12 && found.mean[0] == found.mean[1]);
        assert_eq!(found.threshold_sigma0, None);
    }

    #[test]
    fn nothing_detected_is_below_the_threshold_at_any_share() {
        let found = one(&[below(1.0), below(3.0)]);
        assert_eq!((found.mean[0], found.quantiles), (0.0, [None; 3]));
        assert!((found.mean[1] - 2.0).abs() < 1e-12 && found.threshold_sigma0 == Some(3.0));
    }

    /// Speckle of one look, cut at a threshold.
    fn speckled(mean: f64, threshold: f64, seed: u64) -> Vec<Observation> {
        (0..400)
            .map(|chirp| {
                let key = Key { seed, chirp, sub_ray: 0, purpose: Purpose::Speckle };
                let level = mean * key.draws().gamma(1.0);
                if level < threshold { below(threshold) } else { detected(level) }
            })
            .collect()
    }

    #[test]
    fn the_interval_covers_the_mean_of_speckle_that_was_cut() {
        let covered = (0..60).filter(|&seed| {
            let found = one(&speckled(2.0, 0.5, seed));
            let [low, high] = found.interval_95.unwrap();
            assert!(found.mean[0] < found.mean[1] && low < high);
            low < 2.0 && 2.0 < high
        });
        // Of 60, 95 % are 57, and chance leaves fewer than 52 once in a thousand times.
        assert!(covered.count() >= 52);
    }

    #[test]
    fn angles_that_repeat_stay_and_scattered_ones_are_gathered_by_degree() {
        let repeated: Vec<Observation> =
            (0..40).map(|k| at(f64::from(k % 4) * 0.3, 1.0, Censor::None)).collect();
        assert_eq!(by_angle(&repeated).len(), 4);
        let scattered: Vec<Observation> =
            (0..40).map(|k| at(f64::from(k) * 0.1, 1.0, Censor::None)).collect();
        let bins = by_angle(&scattered);
        assert_eq!(bins.iter().map(|bin| bin.points).collect::<Vec<_>>(), [10; 4]);
        assert_eq!(bins[1].theta_rad, [1f64.to_radians(), 2f64.to_radians()]);
        let few: Vec<Observation> =
            (0..5).map(|k| at(f64::from(k) * 10.0, 1.0, Censor::None)).collect();
        let single = by_angle(&few);
        assert_eq!(single.len(), 5);
        assert!(single.iter().all(|bin| bin.points == 1 && bin.interval_95.is_none()));
    }

    #[test]
    fn what_no_bound_would_tell_has_no_statistics() {
        assert!(by_angle(&[detected(1.0), at(10.0, 9.0, Censor::Right)]).is_empty());
        let bistatic = Observation { delta_phi_rad: 1.0, ..detected(1.0) };
        assert_eq!(one(&[detected(1.0), bistatic]).points, 1);
    }
}
