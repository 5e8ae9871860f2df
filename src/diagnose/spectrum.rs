//! Spectra of residuals: their lines, and the level that lines have by chance.

use num_complex::Complex;
use rustfft::FftPlanner;

/// Steps of the search for the levels of two spectra.
const STEPS: usize = 200;

/// The transform of a signal.
pub(super) fn transform(signal: &[f64]) -> Vec<Complex<f64>> {
    let mut lines: Vec<Complex<f64>> = signal.iter().map(|value| Complex::from(*value)).collect();
    FftPlanner::new().plan_fft_forward(lines.len()).process(&mut lines);
    lines
}

/// The transform of a map of `wide` columns, row by row; line j·wide + i turns i times over its width and j times over
/// its height.
pub(super) fn transform_map(map: &[f64], wide: usize) -> Vec<Complex<f64>> {
    let high = map.len() / wide;
    let mut planner = FftPlanner::new();
    let mut rows: Vec<Complex<f64>> = map.iter().map(|value| Complex::from(*value)).collect();
    planner.plan_fft_forward(wide).process(&mut rows);
    let mut columns = transposed(&rows, wide);
    planner.plan_fft_forward(high).process(&mut columns);
    transposed(&columns, high)
}

/// The columns of a map of so many columns as its rows.
fn transposed(map: &[Complex<f64>], wide: usize) -> Vec<Complex<f64>> {
    (0..wide).flat_map(|column| map.iter().skip(column).step_by(wide).copied()).collect()
}

/// How a flat spectrum and another one share in the lines of a sum of both: the likeliest weights, by multiplicative
/// steps (Whittle; Févotte, Bertin & Durrieu 2009, DOI 10.1162/neco.2008.04-08-771).
pub(super) fn weights(lines: &[f64], of_shared: &[f64]) -> [f64; 2] {
    let mut weights = [0.5; 2];
    for _ in 0..STEPS {
        let [mut more, mut less] = [[0.0; 2]; 2];
        for (line, shared) in lines.iter().zip(of_shared) {
            let level = level(weights, *shared);
            for (part, share) in [1.0, *shared].into_iter().enumerate() {
                more[part] += share * line / (level * level);
                less[part] += share / level;
            }
        }
        for part in 0..2 {
            weights[part] *= more[part] / less[part];
        }
    }
    weights
}

/// Level of a line from those of a flat spectrum and of the shared one.
pub(super) fn level([flat, of_shared]: [f64; 2], shared: f64) -> f64 {
    (flat + of_shared * shared).max(f64::MIN_POSITIVE)
}
