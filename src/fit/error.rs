//! Why a curve cannot be fitted.

use thiserror::Error;

use crate::brdf::ParameterError;
use crate::measure::curve::ObservationError;
use crate::units::shown;

/// Why a curve cannot be fitted.
#[derive(Debug, Error, PartialEq)]
pub enum FitError {
    /// No rows.
    #[error("the curve has no rows; give it at least one for each free parameter")]
    Empty,
    /// Upper limits only.
    #[error(
        "all {rows} rows are censored and give only upper limits; measure nearer or add detections"
    )]
    AllCensored {
        /// How many.
        rows: usize,
    },
    /// As many unknowns as detections, or more.
    #[error(
        "{detected} detections cannot give {unknowns} unknowns and their errors; fix parameters or add rows"
    )]
    TooFewRows {
        /// Detections.
        detected: usize,
        /// Numbers to find.
        unknowns: usize,
    },
    /// A row that is not backscatter.
    #[error(transparent)]
    Observation(#[from] ObservationError),
    /// A row with a number that is out of range.
    #[error("row {row} (from 0) has {name} = {}, {wanted}; correct or remove it", shown(*value))]
    Row {
        /// Its number from 0.
        row: usize,
        /// Its field.
        name: &'static str,
        /// The value.
        value: f64,
        /// What it should be.
        wanted: &'static str,
    },
    /// A name that the model does not have.
    #[error(
        "the model has no free `{name}`; `fixed` takes the model's paths, `bounds` what is fitted"
    )]
    UnknownParameter {
        /// The name.
        name: String,
    },
    /// Bounds outside the range, or the greater one first.
    #[error(
        "bounds of {name} are {} and {}; give the smaller first, both from {} to {}",
        shown(*min), shown(*max), shown(range[0]), shown(range[1])
    )]
    Bounds {
        /// Whose.
        name: String,
        /// Lower.
        min: f64,
        /// Upper.
        max: f64,
        /// What is allowed.
        range: [f64; 2],
    },
    /// A setting out of range.
    #[error("fit.{name} = {} is out of range; give a value from {} to {}", shown(*value), shown(*min), shown(*max))]
    Setting {
        /// Its name.
        name: &'static str,
        /// The value.
        value: f64,
        /// Smallest.
        min: f64,
        /// Largest.
        max: f64,
    },
    /// A start or fixed value out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// A model without free parameters.
    #[error("nothing is left to fit; free a parameter or choose a model that has some")]
    NothingFree,
}
