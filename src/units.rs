//! Conversions between the SI units used inside and the units people read.
//!
//! Inside the crate a power is in watts, a level is a ratio, an angle is in radians. Decibels and
//! degrees appear only where a person or a file does.

/// Speed of light in vacuum, m/s (exact, SI).
pub const SPEED_OF_LIGHT_M_PER_S: f64 = 299_792_458.0;

/// Power ratio for a level in decibels: `10^(x/10)`.
///
/// ```
/// assert!((matdb::units::ratio_from_db(3.0) - 1.995).abs() < 1e-3);
/// ```
pub fn ratio_from_db(level_db: f64) -> f64 {
    10f64.powf(level_db / 10.0)
}

/// Level in decibels of a power ratio; −∞ for zero, NaN for a negative ratio.
pub fn db_from_ratio(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

/// Power in watts for a level in dBm.
///
/// ```
/// assert!((matdb::units::watts_from_dbm(0.0) - 1e-3).abs() < 1e-18);
/// ```
pub fn watts_from_dbm(power_dbm: f64) -> f64 {
    1e-3 * ratio_from_db(power_dbm)
}

/// Level in dBm of a power in watts; −∞ for zero.
pub fn dbm_from_watts(power_w: f64) -> f64 {
    db_from_ratio(power_w / 1e-3)
}

/// A number as a person would write it: powers of ten for the very large and the very small.
///
/// ```
/// use matdb::units::shown;
/// assert_eq!([0.05, -77.0, 3e11].map(shown), ["0.05", "-77", "3e11"]);
/// ```
pub fn shown(value: f64) -> String {
    let size = value.abs();
    let plain = size == 0.0 || (1e-4..1e7).contains(&size) || !size.is_finite();
    if plain { value.to_string() } else { format!("{value:e}") }
}

/// Without what a change of unit leaves in the last digits: six places.
///
/// ```
/// assert_eq!(matdb::units::rounded(0.3e-3 * 1e3), 0.3);
/// ```
pub fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// A range as a person would write it: `90–270`, and `140` where both ends are one.
///
/// ```
/// assert_eq!([[90.0, 270.0], [140.0, 140.0]].map(matdb::units::range), ["90–270", "140"]);
/// ```
pub fn range(ends: [f64; 2]) -> String {
    let [low, high] = ends.map(|end| shown(rounded(end)));
    if low == high { low } else { format!("{low}–{high}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decibels_round_trip() {
        for level_db in [-120.0, -77.0, -3.0, 0.0, 0.1, 60.0] {
            assert!((db_from_ratio(ratio_from_db(level_db)) - level_db).abs() < 1e-12);
            assert!((dbm_from_watts(watts_from_dbm(level_db)) - level_db).abs() < 1e-12);
        }
    }

    #[test]
    fn no_power_is_minus_infinity() {
        assert_eq!(dbm_from_watts(0.0), f64::NEG_INFINITY);
    }
}
