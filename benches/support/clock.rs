//! What benches take times with.

use std::hint::black_box;
use std::time::Instant;

/// Milliseconds of a call, and what it returned.
pub fn timed<T>(call: impl FnOnce() -> T) -> (f64, T) {
    let began = Instant::now();
    let answer = black_box(call());
    (began.elapsed().as_secs_f64() * 1e3, answer)
}

/// Lower quartile, median and upper quartile of one time or more.
pub fn quartiles(mut times_ms: Vec<f64>) -> [f64; 3] {
    times_ms.sort_by(f64::total_cmp);
    [1, 2, 3].map(|quarter| times_ms[quarter * (times_ms.len() - 1) / 4])
}
