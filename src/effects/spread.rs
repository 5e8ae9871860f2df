//! Points spread evenly without chance: the sunflower's, by the golden angle (Vogel, Math. Biosci. 44
//! (1979) 179).

use std::f64::consts::PI;

/// `count` pairs of a share, 0 to 1, and an angle, rad: even on a disc whose area the share measures.
pub(super) fn sunflower(count: usize) -> impl Iterator<Item = (f64, f64)> {
    let golden_rad = PI * (3.0 - 5f64.sqrt());
    (0..count).map(move |k| ((k as f64 + 0.5) / count as f64, k as f64 * golden_rad))
}
