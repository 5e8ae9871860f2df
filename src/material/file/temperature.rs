//! Temperatures in degrees Celsius, as people write them.

/// 0 °C, K.
const FREEZING_K: f64 = 273.15;

pub(super) fn kelvin(temperature_c: f64) -> f64 {
    temperature_c + FREEZING_K
}

pub(super) fn celsius(temperature_k: f64) -> f64 {
    temperature_k - FREEZING_K
}
