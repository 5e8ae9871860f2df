//! The models that a picture shows: where nothing was added there is no model after.

use crate::diagnose::Report;

/// The values of the models that a picture shows, of those before and after.
pub(super) fn shown<T>(report: &Report, [before, after]: [T; 2]) -> Vec<T> {
    if report.effects.is_empty() { vec![before] } else { vec![before, after] }
}

/// Names of the models in a legend.
pub(super) fn names(report: &Report) -> [&'static str; 2] {
    if report.effects.is_empty() { ["base model", ""] } else { ["before", "after"] }
}
