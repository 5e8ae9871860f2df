//! Why a curve cannot be fitted.

use thiserror::Error;

use crate::brdf::ParameterError;
use crate::measure::curve::ObservationError;
use crate::units::shown;

/// Why a curve cannot be fitted.
#[derive(Debug, Error, PartialEq)]
pub enum FitError {
    /// The curve has no rows.
    #[error("the curve has no rows; give it at least one for each free parameter")]
    Empty,
    /// All rows are censored.
    #[error(
        "all {rows} rows are censored and give only upper limits; measure nearer or add detections"
    )]
    AllCensored {
        /// Number of rows.
        rows: usize,
    },
    /// There are no more detections than unknowns.
    #[error(
        "{detected} detections cannot give {unknowns} unknowns and their errors; fix parameters or add rows"
    )]
    TooFewRows {
        /// Number of detections.
        detected: usize,
        /// Number of unknowns.
        unknowns: usize,
    },
    /// A row without a level.
    #[error(transparent)]
    Observation(#[from] ObservationError),
    /// A row whose source and receiver were in two directions, for a method that knows backscatter alone.
    #[error(
        "in row {row} (from 0) source and receiver were in two directions, and mse and tls know backscatter alone; use \
         --method censored"
    )]
    Bistatic {
        /// Row, from 0.
        row: usize,
    },
    /// A row whose source and receiver were in two directions, for a law of the angle of incidence alone.
    #[error(
        "in row {row} (from 0) source and receiver were in two directions, and a function of the angle of incidence knows \
         backscatter alone; fit a model"
    )]
    OwnPairs {
        /// Row, from 0.
        row: usize,
    },
    /// A value of a row is out of range.
    #[error("row {row} (from 0) has {name} = {}, {wanted}; correct or remove it", shown(*value))]
    Row {
        /// Row, from 0.
        row: usize,
        /// Name of the field.
        name: &'static str,
        /// The value.
        value: f64,
        /// The requirement, as the end of the sentence.
        wanted: &'static str,
    },
    /// The model has no parameter of this name.
    #[error(
        "the model has no free `{name}`; `fixed` takes the model's paths, `bounds` what is fitted"
    )]
    UnknownParameter {
        /// The unknown name.
        name: String,
    },
    /// Bounds are outside the range of the parameter, or in the wrong order.
    #[error(
        "bounds of {name} are {} and {}; give the smaller first, both from {} to {}",
        shown(*min), shown(*max), shown(range[0]), shown(range[1])
    )]
    Bounds {
        /// Name of the parameter.
        name: String,
        /// Lower bound.
        min: f64,
        /// Upper bound.
        max: f64,
        /// Range of the parameter.
        range: [f64; 2],
    },
    /// A setting is out of range.
    #[error("fit.{name} = {} is out of range; give a value from {} to {}", shown(*value), shown(*min), shown(*max))]
    Setting {
        /// Its name.
        name: &'static str,
        /// The value.
        value: f64,
        /// Least value allowed.
        min: f64,
        /// Largest value allowed.
        max: f64,
    },
    /// A start or fixed value is out of range.
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    /// Relative levels that are above or below those of any law.
    #[error(
        "the levels are relative and not those that any law has: {name} stopped at the end of its range, and the other \
         numbers follow it; {change} all levels by as much as it takes, 20 dB at a time: nothing else changes"
    )]
    RelativeLevels {
        /// The level that stopped.
        name: String,
        /// What to do with the levels.
        change: &'static str,
    },
    /// Relative levels in two directions.
    #[error(
        "the levels are relative, and how a law changes between two directions depends on how much it reflects; give \
         levels in 1/sr, or the backscatter alone"
    )]
    RelativePairs,
    /// The model has no free parameter.
    #[error("nothing is left to fit; free a parameter or choose a model that has some")]
    NothingFree,
}
