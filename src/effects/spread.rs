//! Evenly spread deterministic points: the sunflower pattern, by the golden angle (Vogel, Math. Biosci. 44
//! (1979) 179).

use std::f64::consts::PI;

/// `count` points of a disc, evenly spread: the share of the area within their radius, 0 to 1, and their angle, rad.
pub(super) fn sunflower(count: usize) -> impl Iterator<Item = (f64, f64)> {
    let golden_rad = PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |k| ((k as f64 + 0.5) / count as f64, k as f64 * golden_rad))
}
