//! A quantity in words.

use crate::formats::words::digits;

/// What a quantity is, its value and its unit; none where it has no value.
pub(super) fn quantity(what: &str, value: Option<f64>, unit: &str) -> Option<String> {
    value.map(|value| format!("{what} {} {unit}", digits(value)))
}
