//! The diagnosis of a curve with what was asked.

use crate::diagnose::curve::CurveReport;
use crate::report::choice::UntriedEffect;

/// A diagnosis of a curve and what a reader needs besides it.
#[derive(Clone, Copy)]
pub struct CurveAnswer<'a> {
    /// What was found.
    pub report: &'a CurveReport,
    /// The curve's file.
    pub name: &'a str,
    /// The law that the curve was compared with, where one was named.
    pub model: Option<&'a str>,
    /// Seed of everything random.
    pub seed: u64,
    /// Effects that were left out.
    pub not_tried: &'a [UntriedEffect],
}
