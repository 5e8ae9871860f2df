//! What a material must have to be admitted to the database: numbers without their circumstances cannot be used
//! by anybody else, and those who measured them know them best on the day.

mod doubts;
mod missing;
mod slips;

use std::path::Path;

use crate::error::Error;
use crate::material::Material;

pub use doubts::doubts;
pub(super) use missing::{clauses, missing};

/// Checks that a material of a file may be added.
///
/// # Errors
/// Measured numbers without curve, licence, instrument or threshold, with the lines of a material.toml that are
/// to be filled in; values that only a slip can give.
pub fn check(material: &Material, file: &Path) -> Result<(), Error> {
    let gaps = missing::all(material);
    if !gaps.is_empty() {
        return Err(Error::usage(
            format!("{}: what was measured needs more: {}", file.display(), clauses(&gaps)),
            missing::way_out(&gaps),
        ));
    }
    match slips::slips(material).into_iter().next() {
        None => Ok(()),
        Some((problem, way_out)) => {
            Err(Error::usage(format!("{}: {problem}", file.display()), way_out))
        }
    }
}
