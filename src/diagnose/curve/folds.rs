//! The angles that are held out together: runs of neighbours, never single angles.

use super::points::Points;
use super::settings::LEAST_BLOCKS;
use crate::diagnose::folds::sum_by_cell;
use crate::radar::random::{Key, Purpose};

/// Least points of a run: a smooth curve bridges a shorter gap.
const LEAST_POINTS: f64 = 3.0;
/// Correlation lengths in a run.
const LENGTHS: f64 = 3.0;

/// A curve in runs of angles, and the runs in folds.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Folds {
    pub block: Vec<usize>,
    pub fold: Vec<usize>,
    pub blocks: usize,
    pub folds: usize,
    /// Width of a run, rad.
    pub width_rad: f64,
    /// Distance at which the autocorrelation of the residual of smooth curves is below 1/e, rad.
    pub correlation_rad: f64,
}

impl Folds {
    /// Runs of three correlation lengths of the residual, shorter where there would be too few, and
    /// of at least three points, dealt out in a drawn order.
    pub fn new(points: &Points, residual_db: &[f64], folds: usize, seed: u64) -> Folds {
        let step_rad = step_rad(points);
        let correlation_rad = correlation_rad(points, residual_db, step_rad);
        let narrowest_rad = (LEAST_POINTS * step_rad).max(1e-9);
        let mut width_rad = (LENGTHS * correlation_rad).max(narrowest_rad);
        let (mut block, mut blocks) = runs(points, width_rad);
        while blocks < LEAST_BLOCKS && width_rad > narrowest_rad {
            width_rad = (0.9 * width_rad).max(narrowest_rad);
            (block, blocks) = runs(points, width_rad);
        }
        let mut order: Vec<(f64, usize)> = (0..blocks)
            .map(|run| {
                let key = Key { seed, chirp: run as u64, sub_ray: 1, purpose: Purpose::Fit };
                (key.draws().uniform(), run)
            })
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let folds = folds.max(2);
        let mut fold_of_run = vec![0; blocks];
        for (place, (_, run)) in order.iter().enumerate() {
            fold_of_run[*run] = place % folds;
        }
        let fold = block.iter().map(|&run| fold_of_run[run]).collect();
        Folds { block, fold, blocks, folds, width_rad, correlation_rad }
    }

    /// The runs and folds of the points for which `used` is true.
    pub fn only(&self, used: &[bool]) -> Folds {
        let of = |all: &[usize]| {
            all.iter().zip(used).filter(|(_, used)| **used).map(|(n, _)| *n).collect()
        };
        Folds { block: of(&self.block), fold: of(&self.fold), ..self.clone() }
    }

    /// Sum and its standard error over runs of one number for each point.
    pub fn sum(&self, values: &[f64]) -> [f64; 2] {
        sum_by_cell(values, &self.block, self.blocks)
    }
}

/// Runs of about equal width within every scan, by number.
fn runs(points: &Points, width_rad: f64) -> (Vec<usize>, usize) {
    let mut block = Vec::with_capacity(points.points.len());
    let mut first = 0;
    for scan in points.points.chunk_by(|a, b| a.scan == b.scan) {
        let ends = [scan.first(), scan.last()].map(|p| p.map_or(0.0, |p| points.angle_rad(p)));
        // Equal steps differ by rounding.
        let count = ((ends[1] - ends[0]) / width_rad + 1e-6).floor().max(1.0);
        let span = (ends[1] - ends[0]).max(f64::MIN_POSITIVE);
        block.extend(scan.iter().map(|point| {
            let share = (points.angle_rad(point) - ends[0]) / span;
            first + (share * count).floor().min(count - 1.0) as usize
        }));
        first += count as usize;
    }
    // A gap of the scan leaves a run empty.
    let mut used = block.clone();
    used.dedup();
    (block.iter().map(|run| used.binary_search(run).unwrap_or(0)).collect(), used.len())
}

/// Median distance of neighbours, rad; repeats do not count.
fn step_rad(points: &Points) -> f64 {
    const SAME_RAD: f64 = 1e-6;
    let mut steps: Vec<f64> = points
        .neighbours()
        .map(|[a, b]| points.angle_rad(b) - points.angle_rad(a))
        .filter(|step| *step > SAME_RAD)
        .collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(0.0)
}

/// Lag at which the autocorrelation falls below 1/e, rad, at least one step.
fn correlation_rad(points: &Points, residual_db: &[f64], step_rad: f64) -> f64 {
    let longest = (residual_db.len() / 4).max(1);
    let lag = (1..longest)
        .find(|&lag| autocorrelation(points, residual_db, lag) < (-1f64).exp())
        .unwrap_or(longest);
    lag as f64 * step_rad
}

/// Correlation of points `lag` places apart in one scan; 0 without such pairs.
pub(super) fn autocorrelation(points: &Points, values: &[f64], lag: usize) -> f64 {
    let seen = |index: usize| points.points.get(index).filter(|point| !point.censored);
    let (mut products, mut pairs, mut squares, mut count) = (0.0, 0.0, 0.0, 0.0);
    for (index, value) in values.iter().enumerate() {
        let Some(here) = seen(index) else { continue };
        squares += value * value;
        count += 1.0;
        let there = seen(index + lag).filter(|there| there.scan == here.scan);
        if let (Some(_), Some(other)) = (there, values.get(index + lag)) {
            products += value * other;
            pairs += 1.0;
        }
    }
    if pairs > 0.0 && squares > 0.0 { (products / pairs) / (squares / count) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::curve::testing::{curve_of, noisy};

    #[test]
    fn repeats_of_an_angle_are_no_steps_between_angles() {
        let mut points = curve_of(&noisy(&[30.0], 1.0, 0.2, |_| 0.0), None);
        points.points = points.points.iter().flat_map(|point| [*point; 3]).collect();
        let key = |k| Key { seed: 5, chirp: k, sub_ray: 0, purpose: Purpose::Fit };
        let count = points.points.len() as u64;
        let white: Vec<f64> = (0..count).map(|k| key(k).draws().uniform() - 0.5).collect();
        let folds = Folds::new(&points, &white, 5, 0);
        assert!((folds.width_rad.to_degrees() - 3.0).abs() < 1e-6, "{folds:?}");
        assert!(folds.blocks < points.points.len() / 6, "{folds:?}");
    }

    #[test]
    fn twenty_five_equal_steps_are_eight_runs() {
        let all = curve_of(&noisy(&[30.0], 1.0, 0.0, |_| 0.0), None);
        for first_deg in [-60.0, -30.0, 0.0, 5.0, 10.0] {
            for step_deg in [0.5, 1.0, 2.0, 2.5] {
                let mut points = Points { points: all.points[..25].to_vec(), ..all.clone() };
                for (k, point) in points.points.iter_mut().enumerate() {
                    point.theta_s_rad = (first_deg + step_deg * k as f64).to_radians();
                }
                let white: Vec<f64> = (0..25).map(|k| [1.0, -1.0][k % 2]).collect();
                let folds = Folds::new(&points, &white, 5, 0);
                assert_eq!(folds.blocks, 8, "{first_deg} {step_deg}");
            }
        }
    }

    #[test]
    fn white_noise_is_held_out_in_short_runs_and_a_smooth_error_in_long_ones() {
        let points = curve_of(&noisy(&[10.0, 30.0, 50.0], 1.0, 0.2, |_| 0.0), None);
        let white: Vec<f64> = (0..points.points.len())
            .map(|k| {
                let key = Key { seed: 5, chirp: k as u64, sub_ray: 0, purpose: Purpose::Fit };
                key.draws().uniform() - 0.5
            })
            .collect();
        let short = Folds::new(&points, &white, 5, 0);
        assert!((short.width_rad.to_degrees() - 3.0).abs() < 1e-6, "{short:?}");
        let smooth: Vec<f64> =
            points.points.iter().map(|point| (10.0 * point.theta_s_rad).sin()).collect();
        let long = Folds::new(&points, &smooth, 5, 0);
        // cos of 10·lag is 1/e at 6.8°.
        assert!((long.width_rad.to_degrees() - 21.0).abs() < 1.1, "{}", long.width_rad);
        for folds in [short, long] {
            let pairs = folds.block.iter().zip(&folds.fold);
            let of_block = |run: usize| pairs.clone().filter(move |(b, _)| **b == run);
            for run in 0..folds.blocks {
                let mut members = of_block(run).map(|(_, fold)| fold);
                let first = members.next().unwrap();
                assert!(members.all(|fold| fold == first), "a run is in one fold");
            }
            assert!((0..5).all(|fold| folds.fold.contains(&fold)));
        }
    }
}
