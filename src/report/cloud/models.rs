//! The models that a picture shows: where nothing was added there is no model after.

use crate::diagnose::Report;
use crate::formats::figure::Ink;

/// The values of the models that a picture shows, of those before and after.
pub(super) fn shown<T>(report: &Report, [before, after]: [T; 2]) -> Vec<T> {
    if report.effects.is_empty() { vec![before] } else { vec![before, after] }
}

/// Names of the models in a legend, with their inks.
pub(super) fn names(report: &Report) -> [(&'static str, Ink); 2] {
    let base = if report.effects.is_empty() { "base model" } else { "before" };
    [(base, Ink::Before), ("after", Ink::After)]
}
