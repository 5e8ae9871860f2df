//! `report.json`: the answer of a diagnosis for scripts.

use serde::Serialize;

use super::choice::UntriedEffect;
use crate::error::Error;

/// A diagnosis of a cloud or of a curve, and the effects that it did not try.
#[derive(Serialize)]
pub struct Record<'a, Report> {
    /// The diagnosis.
    #[serde(flatten)]
    pub report: &'a Report,
    /// Effects that were left out, with the reason.
    pub not_tried: &'a [UntriedEffect],
}

/// A value as the bytes of a JSON file.
///
/// # Errors
/// A value that JSON cannot hold.
pub fn json_file(value: &impl Serialize) -> Result<Vec<u8>, Error> {
    let mut json = serde_json::to_vec_pretty(value)?;
    json.push(b'\n');
    Ok(json)
}
