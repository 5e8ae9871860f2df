//! The output of a receiver that saturates before it averages looks.
//!
//! The average of h(u₁) … h(u_K) of K looks has the density of one look's output K times convolved with itself, here by
//! the discrete Fourier transform. It is tabulated as the output that has the rank of a power P = x·P̄ of the Gamma
//! distribution of L looks.

use std::sync::{Arc, LazyLock, Mutex, OnceLock, PoisonError};

use num_complex::Complex64;
use rustfft::FftPlanner;
use statrs::function::gamma::{gamma_lr, gamma_ur};

use super::onset::{Onset, cubic};

/// Looks from which on several form one.
const MOST_SINGLE: f64 = 256.0;
/// Cells of all looks together, and least of one.
const CELLS: usize = 4096;
const LEAST_CELLS: usize = 128;
/// Probability of a look beyond the last cell.
const BEYOND: f64 = 1e-8;
/// Probabilities of powers below the first node and above the last one. Beyond them the output goes on in a straight line.
const TAILS: [f64; 2] = [3e-4, 1e-5];
/// Intervals between nodes in ln(P/P̄).
const INTERVALS: usize = 48;
/// ln(P̄/P_sat) of the first and the last table, and the step. Below the first, a look is too weak to be held; above the
/// last, the output is constant.
const FIRST: f64 = -7.0;
const LAST: f64 = 5.0;
const STEP: f64 = 0.25;

/// Outputs by the rank of the power.
#[derive(Debug)]
pub(super) struct Ranked {
    onset: Onset,
    looks: Looks,
    /// First ln(P/P̄), and step.
    first: f64,
    step: f64,
    /// Probability that a power stays below each node.
    shares: Vec<f64>,
    /// ln of the output in units of P_sat and its slope by ln(P/P̄), for each mean. Computed on first use.
    rows: Vec<OnceLock<Box<Row>>>,
}

type Row = [[f64; 2]; INTERVALS + 1];

/// The latest tables: a search asks for the same ones over and over.
static LATEST: Mutex<Vec<Arc<Ranked>>> = Mutex::new(Vec::new());
/// The plans of the transforms, which all rows share.
static PLANNER: LazyLock<Mutex<FftPlanner<f64>>> = LazyLock::new(|| Mutex::new(FftPlanner::new()));
/// How many tables are kept.
const MOST_KEPT: usize = 16;

impl Ranked {
    /// The outputs of a receiver; `None` where one look is all.
    pub fn of(onset: Onset, looks: f64) -> Option<Arc<Ranked>> {
        if looks.round() < 2.0 {
            return None;
        }
        let mut latest = LATEST.lock().unwrap_or_else(PoisonError::into_inner);
        let is_it = |ranked: &&Arc<Ranked>| (ranked.onset, ranked.looks.all) == (onset, looks);
        if let Some(found) = latest.iter().find(is_it) {
            return Some(Arc::clone(found));
        }
        let made = Arc::new(Ranked::new(onset, looks));
        latest.truncate(MOST_KEPT - 1);
        latest.insert(0, Arc::clone(&made));
        Some(made)
    }

    fn new(onset: Onset, looks: f64) -> Ranked {
        let below = |x: f64| gamma_lr(looks, looks * x.exp());
        let first = crossing(|x| below(x) > TAILS[0]);
        let last = crossing(|x| gamma_ur(looks, looks * x.exp()) < TAILS[1]);
        let step = (last - first) / INTERVALS as f64;
        let shares = (0..=INTERVALS).map(|node| below(first + step * node as f64)).collect();
        let rows = vec![OnceLock::new(); ((LAST - FIRST) / STEP).round() as usize + 1];
        Ranked { onset, looks: Looks::new(looks), first, step, shares, rows }
    }

    fn row(&self, number: usize) -> &Row {
        self.rows[number].get_or_init(|| {
            let ln_mean = FIRST + STEP * number as f64;
            let ln_outputs = self.looks.ln_outputs(self.onset, ln_mean, &self.shares);
            let slope = |node: usize| {
                let [a, b] = [node.saturating_sub(1), (node + 1).min(INTERVALS)];
                (ln_outputs[b] - ln_outputs[a]) / (self.step * (b - a) as f64)
            };
            Box::new(std::array::from_fn(|node| [ln_outputs[node], slope(node)]))
        })
    }

    /// ln of the output and its slope by ln(P/P̄), all in units of P_sat; `None` where the mean is too weak to be held.
    pub fn output(&self, ln_mean: f64, ln_ratio: f64) -> Option<[f64; 2]> {
        let place = (ln_mean - FIRST) / STEP;
        if place <= 0.0 {
            return None;
        }
        let place = place.min((self.rows.len() - 1) as f64);
        let cell = (place as usize).min(self.rows.len() - 2);
        let t = place - cell as f64;
        let [a, b] = [cell, cell + 1].map(|row| self.along(self.row(row), ln_ratio));
        Some([0, 1].map(|k| (1.0 - t) * a[k] + t * b[k]))
    }

    /// Value and slope of a row, by cubics between its nodes.
    fn along(&self, row: &Row, ln_ratio: f64) -> [f64; 2] {
        let place = (ln_ratio - self.first) / self.step;
        let beyond = place - place.clamp(0.0, INTERVALS as f64);
        if beyond != 0.0 {
            let [value, slope] = row[if beyond < 0.0 { 0 } else { INTERVALS }];
            return [value + slope * self.step * beyond, slope];
        }
        cubic(row, self.step, place)
    }
}

/// Looks that are averaged.
#[derive(Debug)]
struct Looks {
    /// All of them, not necessarily whole.
    all: f64,
    /// How many averages, and of how many looks each of them is.
    count: usize,
    of_each: f64,
    /// Cells of one.
    cells: usize,
    /// Largest power over its mean.
    most: f64,
}

impl Looks {
    fn new(looks: f64) -> Looks {
        let count = looks.round().clamp(1.0, MOST_SINGLE);
        let of_each = looks / count;
        let count = count as usize;
        let cells = (CELLS / count).max(LEAST_CELLS);
        let most = crossing(|x| gamma_ur(of_each, of_each * x.exp()) < BEYOND).exp();
        Looks { all: looks, count, of_each, cells, most }
    }

    /// ln of the outputs, in units of P_sat, that stay below themselves with given probabilities.
    fn ln_outputs(&self, onset: Onset, ln_mean: f64, shares: &[f64]) -> Vec<f64> {
        let Looks { count, cells, .. } = *self;
        let width = onset.held(ln_mean + self.most.ln())[0].exp() / cells as f64;
        // Probability of each cell of one look.
        let below = |edge: usize| {
            let power = onset.entered(width * edge as f64);
            let ratio = (power / ln_mean.exp()).min(self.most);
            if self.of_each == 1.0 {
                -(-ratio).exp_m1()
            } else {
                gamma_lr(self.of_each, self.of_each * ratio)
            }
        };
        let size = (count * cells).next_power_of_two();
        let mut wave = vec![Complex64::ZERO; size];
        let mut last = 0.0;
        for (cell, value) in wave.iter_mut().take(cells).enumerate() {
            let next = below(cell + 1);
            value.re = next - last;
            last = next;
        }
        let [forward, inverse] = {
            let mut planner = PLANNER.lock().unwrap_or_else(PoisonError::into_inner);
            [planner.plan_fft_forward(size), planner.plan_fft_inverse(size)]
        };
        forward.process(&mut wave);
        wave.iter_mut().for_each(|value| *value = value.powu(count as u32));
        inverse.process(&mut wave);
        // Ranks among their averages. A look in cell i is i + ½ cells on average.
        let whole = last.powi(count as i32);
        let (mut cell, mut sum, mut of_cell) = (0, 0.0, 0.0);
        let mut outputs = Vec::with_capacity(shares.len());
        for share in shares {
            while sum + of_cell < *share && cell < size {
                sum += of_cell;
                of_cell = (wave[cell].re / size as f64 / whole).max(0.0);
                cell += 1;
            }
            // ln of the output is nearly straight over the logit of the share.
            let right = cell as f64 - 0.5 + 0.5 * count as f64;
            let [ln_left, ln_right] =
                [right - 1.0, right].map(|place| (width * place.max(0.5) / count as f64).ln());
            let [at, left, right] = [*share, sum, sum + of_cell].map(logit);
            let part = (at - left) / (right - left);
            let part = if part.is_finite() { part.clamp(0.0, 1.0) } else { 1.0 };
            outputs.push(ln_left + part * (ln_right - ln_left));
        }
        outputs
    }
}

/// ln of the odds of a share, of 0 as of one that is negligible.
fn logit(share: f64) -> f64 {
    (share.max(1e-12) / (1.0 - share).max(1e-12)).ln()
}

/// Where something that holds of large numbers begins to hold.
fn crossing(holds: impl Fn(f64) -> bool) -> f64 {
    let (mut low, mut high) = (-60.0, 10.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if holds(middle) { high = middle } else { low = middle }
    }
    high
}
