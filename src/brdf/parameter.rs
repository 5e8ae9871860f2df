//! A model's free numbers, each with the unit and range in which it has a meaning.

use thiserror::Error;

use crate::units::shown;

/// One free number of a scattering model.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameter {
    /// Where it sits in the model: `k`, `specular.m`.
    pub path: String,
    /// Unit as UCUM code; `1` for a pure number.
    pub unit: &'static str,
    /// Smallest value that has a meaning.
    pub min: f64,
    /// Largest value that has a meaning.
    pub max: f64,
    /// Its value.
    pub value: f64,
}

/// A parameter outside the range in which it has a meaning.
#[derive(Debug, Error, PartialEq)]
#[error("{path} = {} is out of range; give a value from {} to {}", shown(*value), shown(*min), shown(*max))]
pub struct ParameterError {
    /// The parameter's path.
    pub path: String,
    /// The refused value.
    pub value: f64,
    /// Smallest accepted value.
    pub min: f64,
    /// Largest accepted value.
    pub max: f64,
}

impl Parameter {
    /// Checks the value against the range; NaN is refused.
    pub fn validate(&self) -> Result<(), ParameterError> {
        if self.value >= self.min && self.value <= self.max {
            return Ok(());
        }
        let Parameter { path, min, max, value, .. } = self.clone();
        Err(ParameterError { path, value, min, max })
    }
}

/// Called for every parameter, with the slot that holds its value.
pub type Visitor<'a> = dyn FnMut(Parameter, &mut f64) + 'a;

/// Calls the visitor for one pure number of a model.
pub(super) fn visit_number(
    visitor: &mut Visitor,
    prefix: &str,
    name: &str,
    (min, max): (f64, f64),
    slot: &mut f64,
) {
    let path = format!("{prefix}{name}");
    visitor(Parameter { path, unit: "1", min, max, value: *slot }, slot);
}

/// Calls the visitor for one number of a model with a unit (UCUM).
pub(super) fn visit_quantity(
    visitor: &mut Visitor,
    prefix: &str,
    name: &str,
    unit: &'static str,
    (min, max): (f64, f64),
    slot: &mut f64,
) {
    let path = format!("{prefix}{name}");
    visitor(Parameter { path, unit, min, max, value: *slot }, slot);
}
