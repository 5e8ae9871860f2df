//! A test of waves over the target plane: structure too fine for a field that repeats, such as stripes or checkers of
//! any direction.
//!
//! Residuals on a raster have a spectrum in two directions. Under a correct model each of its lines over their level follows
//! an exponential law. The level is flat, plus that of speckle which neighbours share: the transform of what pairs of shots
//! share by the vector between them, exp(−2d²/w²), with the likeliest w and both weights (Whittle). Where residuals are
//! compared by their distance alone, the signs of checkers cancel. Lines lie twice as close as the extent of the target
//! asks for: a wave between two of them would lose up to three fifths of its power in each direction.

use std::collections::BTreeMap;

use num_complex::Complex;
use rayon::prelude::*;

use super::residual::ResidualStructure;
use super::spectrum::{level, transform_map, weights};
use crate::effects::Shot;

/// Cells of the raster per spot.
const PER_SPOT: f64 = 4.0;
/// Most cells of the raster, before it is padded.
const MOST_CELLS: f64 = 262_144.0;
/// Factor by which it is padded in each direction.
const PADDING: usize = 2;
/// Least number of shots that have a spectrum.
const LEAST_SHOTS: usize = 200;
/// Shortest wave that is tested, and shortest that the levels are taken from, in spots.
const SHORTEST: f64 = 2.0;
const SHORTEST_OF_LEVELS: f64 = 1.0;
/// Widths w of the kernel that are tried, in spots.
const WIDTHS: std::ops::RangeInclusive<u32> = 4..=16;
const WIDTH_STEP: f64 = 0.1;
/// Independent lines per line of a raster without padding: the strongest of closer ones is found. On scans with nothing
/// missing the strongest line then has a chance that is uniform from 0 to 1.
const INDEPENDENT: f64 = 2.0;
/// Lines on either side of one that belong to the same wave.
const SAME_WAVE: i64 = 3;
/// Chance of the strongest of all lines below which it is reported.
const CHANCE: f64 = 1e-5;
/// Chance of further waves that are counted in its strength, and their number.
const CHANCE_OF_FURTHER: f64 = 0.05;
const MOST_WAVES: usize = 4;
/// Largest residual that counts, in standard deviations.
const MOST: f64 = 3.5;
/// Least level of shared speckle, as a share of the mean: a transform may be below 0 by rounding.
const LEAST: f64 = 1e-3;

/// The waves of the residuals `z`, if chance does not explain them. `sd_db`: scatter of a correct model, dB.
pub(super) fn waves(
    z: &[f64],
    shots: &[Shot],
    spot_m: f64,
    sd_db: f64,
) -> Option<ResidualStructure> {
    // Behind other sheets, and in another scan, speckle is another one.
    let mut fields: BTreeMap<(u16, u8), Vec<usize>> = BTreeMap::new();
    for (index, shot) in shots.iter().enumerate() {
        fields.entry((shot.scan, shot.sheets)).or_default().push(index);
    }
    fields.retain(|_, members| members.len() >= LEAST_SHOTS);
    let tests = fields.len() as f64;
    let found = fields.values().filter_map(|members| {
        let places = members.iter().map(|&index| [shots[index].xt_m, shots[index].yt_m]).collect();
        let raster = Raster::new(places, spot_m);
        let z: Vec<f64> = members.iter().map(|&index| z[index].clamp(-MOST, MOST)).collect();
        let Waves { amplitude, chance } = raster.waves(&z);
        let share = members.len() as f64 / shots.len() as f64;
        // A wave of amplitude a has the root mean square a/√2.
        let strength_db = sd_db * amplitude * (0.5 * share).sqrt();
        let p_value = (tests * chance).min(1.0);
        let covariate = "waves over the target".to_owned();
        (p_value < CHANCE).then_some(ResidualStructure { covariate, strength_db, p_value })
    });
    found.max_by(|a, b| a.strength_db.total_cmp(&b.strength_db))
}

/// Shots on a raster, padded with empty cells.
struct Raster {
    /// Cell of every shot.
    cells: Vec<usize>,
    wide: usize,
    high: usize,
    cell_m: f64,
    spot_m: f64,
}

/// What stands out of a spectrum.
struct Waves {
    /// Amplitude of all waves together, in standard deviations of a residual.
    amplitude: f64,
    /// Probability of the strongest by chance.
    chance: f64,
}

/// A line of a spectrum and its level by chance.
#[derive(Clone, Copy)]
struct Line {
    place: usize,
    power: f64,
    level: f64,
}

impl Line {
    fn ratio(&self) -> f64 {
        self.power / self.level
    }
}

impl Raster {
    fn new(places: Vec<[f64; 2]>, spot_m: f64) -> Raster {
        let [low, high] = [f64::min, f64::max].map(|extreme| {
            let corner = places.iter().copied().reduce(|a, b| [0, 1].map(|i| extreme(a[i], b[i])));
            corner.unwrap_or_default()
        });
        let extent_m = [0, 1].map(|axis| high[axis] - low[axis]);
        let coarsest_m = (extent_m[0] * extent_m[1] / MOST_CELLS).sqrt();
        // A line of shots is long and narrow.
        let cell_m =
            (spot_m / PER_SPOT).max(coarsest_m).max(extent_m[0].max(extent_m[1]) / MOST_CELLS);
        let [wide, high] = extent_m.map(|m| PADDING * (steps(m, cell_m) + 1));
        let rows_and_columns =
            places.iter().map(|[x, y]| [y - low[1], x - low[0]].map(|m| steps(m, cell_m)));
        let cells = rows_and_columns.map(|[row, column]| row * wide + column).collect();
        Raster { cells, wide, high, cell_m, spot_m }
    }

    /// The waves of one number per shot.
    fn waves(&self, z: &[f64]) -> Waves {
        let mut lines = self.lines(z);
        lines.sort_by(|a, b| b.ratio().total_cmp(&a.ratio()));
        let independent = INDEPENDENT * lines.len() as f64 / (PADDING * PADDING) as f64;
        let mut waves: Vec<Line> = Vec::new();
        for line in lines {
            let chance = independent * (-line.ratio()).exp();
            if waves.len() == MOST_WAVES || !waves.is_empty() && chance > CHANCE_OF_FURTHER {
                break;
            }
            if !waves.iter().any(|other| self.are_one_wave(other.place, line.place)) {
                waves.push(line);
            }
        }
        let chance = waves.first().map_or(1.0, |first| independent * (-first.ratio()).exp());
        // A wave of amplitude a in z has a line of n·a²/4.
        let beyond: f64 = waves.iter().map(|wave| (wave.power - wave.level).max(0.0)).sum();
        Waves { amplitude: (4.0 * beyond / z.len() as f64).sqrt(), chance }
    }

    /// The lines of waves that are tested, with their levels.
    fn lines(&self, z: &[f64]) -> Vec<Line> {
        let count = z.len() as f64;
        let mean = z.iter().sum::<f64>() / count;
        let residuals: Vec<f64> = z.iter().map(|z| z - mean).collect();
        let spectrum = transform_map(&self.map(&residuals), self.wide);
        let powers: Vec<f64> = spectrum.iter().map(|line| line.norm_sqr() / count).collect();
        // Every second line in each direction says all that they do.
        let all = 0..powers.len();
        let apart = all.clone().filter(|place| {
            [place % self.wide, place / self.wide].iter().all(|steps| steps.is_multiple_of(PADDING))
        });
        let levels = self.levels(
            &apart
                .filter(|place| self.is_longer(*place, SHORTEST_OF_LEVELS))
                .collect::<Vec<usize>>(),
            &powers,
        );
        let tested = all.filter(|place| self.is_longer(*place, SHORTEST));
        tested.map(|place| Line { place, power: powers[place], level: levels[place] }).collect()
    }

    /// Whether the waves of a line are longer than so many spots. The mean is none, and of a line and its conjugate one is.
    fn is_longer(&self, place: usize, spots: f64) -> bool {
        let [x, y] = self.steps(place);
        let sides = [(x, self.wide), (y, self.high)];
        let [x_per_m, y_per_m] =
            sides.map(|(turns, all)| turns as f64 / (all as f64 * self.cell_m));
        [x, y] > [0, 0] && x_per_m.hypot(y_per_m) < 1.0 / (spots * self.spot_m)
    }

    /// The likeliest level of every line, by those at some places.
    fn levels(&self, places: &[usize], powers: &[f64]) -> Vec<f64> {
        let pairs = self.pairs();
        let powers: Vec<f64> = places.iter().map(|place| powers[*place]).collect();
        let widths: Vec<Option<u32>> = std::iter::once(None).chain(WIDTHS.map(Some)).collect();
        let fits = widths.into_par_iter().map(|width| {
            let shared = self.shared(&pairs, width);
            let of_places: Vec<f64> = places.iter().map(|place| shared[*place]).collect();
            let weights = weights(&powers, &of_places);
            let levels = of_places.iter().map(|shared| level(weights, *shared));
            let ln_p: f64 =
                powers.iter().zip(levels).map(|(power, level)| -level.ln() - power / level).sum();
            (ln_p, width, weights)
        });
        // The first of equal ones, whatever the number of threads.
        let fits: Vec<(f64, Option<u32>, [f64; 2])> = fits.collect();
        let best = fits.into_iter().reduce(|a, b| if b.0 > a.0 { b } else { a });
        let Some((_, width, weights)) = best else { return Vec::new() };
        self.shared(&pairs, width).iter().map(|shared| level(weights, *shared)).collect()
    }

    /// Number of pairs of shots by the vector between them.
    fn pairs(&self) -> Vec<f64> {
        let shots = transform_map(&self.map(&vec![1.0; self.cells.len()]), self.wide);
        let squares: Vec<f64> = shots.iter().map(Complex::norm_sqr).collect();
        // The transform of an even function is its inverse, but for the number of cells.
        let cells = squares.len() as f64;
        transform_map(&squares, self.wide).into_iter().map(|sum| sum.re / cells).collect()
    }

    /// The spectrum of speckle that is shared over a width, in steps of [`WIDTH_STEP`]; a flat one without.
    fn shared(&self, pairs: &[f64], width: Option<u32>) -> Vec<f64> {
        let Some(steps) = width else { return vec![1.0; pairs.len()] };
        let width_m = WIDTH_STEP * f64::from(steps) * self.spot_m;
        let count = self.cells.len() as f64;
        let products = pairs.iter().enumerate().map(|(place, pairs)| {
            let [x, y] = self.steps(place).map(|steps| steps as f64 * self.cell_m);
            pairs * (-2.0 * (x * x + y * y) / (width_m * width_m)).exp()
        });
        let products: Vec<f64> = products.collect();
        let spectrum = transform_map(&products, self.wide);
        spectrum.into_iter().map(|line| (line.re / count).max(LEAST)).collect()
    }

    /// The sum of one number per shot in each cell.
    fn map(&self, values: &[f64]) -> Vec<f64> {
        let mut map = vec![0.0; self.wide * self.high];
        for (cell, value) in self.cells.iter().zip(values) {
            map[*cell] += value;
        }
        map
    }

    /// Steps to a place from the first in both directions, the shorter way round.
    fn steps(&self, place: usize) -> [i64; 2] {
        let sides = [(place % self.wide, self.wide), (place / self.wide, self.high)];
        sides.map(|(steps, all)| steps as i64 - if 2 * steps > all { all as i64 } else { 0 })
    }

    /// Whether two lines belong to one wave.
    fn are_one_wave(&self, a: usize, b: usize) -> bool {
        let [a, b] = [a, b].map(|place| self.steps(place));
        let apart = [[a[0] - b[0], a[1] - b[1]], [a[0] + b[0], a[1] + b[1]]];
        apart.iter().any(|apart| apart.iter().all(|steps| steps.abs() <= SAME_WAVE))
    }
}

/// Whole cells in a length, m.
fn steps(m: f64, cell_m: f64) -> usize {
    (m / cell_m).round() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::testing::{SIDE, SPOT_M, STEP_M, field, shots};

    /// The waves in residuals of which speckle has a width, with a pattern by place that is added.
    fn found(
        width_m: f64,
        seed: u64,
        pattern: impl Fn(f64, f64) -> f64,
    ) -> Option<ResidualStructure> {
        let shots = shots();
        let speckle = field(width_m, seed);
        let z: Vec<f64> =
            shots.iter().zip(speckle).map(|(shot, z)| z + pattern(shot.xt_m, shot.yt_m)).collect();
        waves(&z, &shots, SPOT_M, 2.3)
    }

    #[test]
    fn checkers_and_stripes_are_found_with_their_strength_whatever_their_direction() {
        let checkers = |x: f64, y: f64| 0.6 * ((x / 0.02).sin() * (y / 0.026).sin()).signum();
        for width_m in [0.0, 0.0136, 0.0192] {
            let found = found(width_m, 1, checkers).unwrap();
            // The sines of a square wave have 8/π² of its power in each direction.
            let share = found.strength_db / (2.3 * 0.6 * 8.0 / std::f64::consts::PI.powi(2));
            assert!((0.7..1.2).contains(&share), "{width_m}: {found:?}");
        }
        for turn in [0.0f64, 0.4, 1.3, 2.2, 3.0] {
            let stripes = |x: f64, y: f64| 0.4 * ((x * turn.cos() + y * turn.sin()) / 0.015).sin();
            let found = found(0.0136, 2, stripes).unwrap();
            let share = found.strength_db / (2.3 * 0.4 / 2f64.sqrt());
            // Between two lines a wave loses up to a third of its power.
            assert!((0.7..1.2).contains(&share), "{turn}: {found:?}");
        }
    }

    #[test]
    fn speckle_is_no_wave() {
        for seed in 0..20 {
            for width_m in [0.0, 0.008, 0.0136, 0.0192] {
                assert_eq!(found(width_m, 10 + seed, |_, _| 0.0), None, "{seed} {width_m}");
            }
        }
    }

    /// The strongest line of independent speckle has the chance that it states.
    #[test]
    fn the_chance_of_the_strongest_line_is_uniform() {
        let places = (0..SIDE * SIDE).map(|i| [i % SIDE, i / SIDE].map(|i| STEP_M * i as f64));
        let raster = Raster::new(places.collect(), SPOT_M);
        let mut chances: Vec<f64> =
            (0..60).map(|seed| raster.waves(&field(0.0, 200 + seed)).chance.min(1.0)).collect();
        chances.sort_by(f64::total_cmp);
        let [low, middle] = [chances[5], chances[29]];
        assert!((0.01..0.3).contains(&low) && (0.25..0.85).contains(&middle), "{low} {middle}");
    }

    #[test]
    fn few_shots_and_shots_at_one_place_have_no_waves() {
        let shots = shots();
        assert_eq!(waves(&[1.0; 100], &shots[..100], SPOT_M, 2.3), None);
        let one = vec![shots[0]; 300];
        let z: Vec<f64> = (0..300).map(|i| if i / 4 % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(waves(&z, &one, SPOT_M, 2.3), None);
        assert!(waves(&z, &shots[..300], SPOT_M, 2.3).is_some());
    }
}
