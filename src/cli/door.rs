//! What a measured curve must say before it is let in: numbers without their circumstances cannot be
//! used by anybody else, and who measured them knows them best on the day.

use std::path::Path;

use crate::error::Error;
use crate::material::{Curve, Material, SourceKind};

/// Refuses a material with measured curves that lack licence, instrument or threshold.
pub(super) fn check(material: &Material, file: &Path) -> Result<(), Error> {
    let missing: Vec<String> =
        material.curves.iter().flat_map(|curve| missing(material, curve)).collect();
    if missing.is_empty() {
        return Ok(());
    }
    Err(Error::Usage {
        problem: format!("{}: a measured curve needs more: {}", file.display(), missing.join("; ")),
        way_out: "`matdb add --template` prints a complete entry".to_owned(),
    })
}

/// What a curve lacks, a clause each. That there is a source at all was checked before.
fn missing(material: &Material, curve: &Curve) -> Vec<String> {
    let source = material.sources.iter().find(|source| source.key == curve.source);
    let Some(source) = source.filter(|source| source.kind == SourceKind::Measured) else {
        return Vec::new();
    };
    let mut missing = Vec::new();
    if source.licence.as_ref().is_none_or(|licence| licence.trim().is_empty()) {
        missing.push(format!("source `{}` has no licence", source.key));
    }
    let key = curve.instrument.as_ref();
    let instrument = key.and_then(|key| material.instruments.iter().find(|i| i.key == *key));
    if instrument.is_none() {
        missing.push(format!("curve `{}` names no instrument", curve.name));
    }
    let in_rows = curve.observations.iter().all(|row| row.threshold_sigma0.is_some());
    if !in_rows && instrument.is_none_or(|instrument| instrument.threshold_w.is_none()) {
        missing.push(match instrument {
            Some(instrument) => format!(
                "instrument `{}` has no threshold_dbm and not every row of curve `{}` a threshold_db",
                instrument.key, curve.name
            ),
            None => format!("not every row of curve `{}` has a threshold_db", curve.name),
        });
    }
    missing
}
