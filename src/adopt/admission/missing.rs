//! The circumstances that measured numbers of a material lack.

use crate::material::{Curve, Instrument, Material, SourceKind};

/// What an entry lacks.
pub(in crate::adopt) struct Gap {
    /// A clause.
    pub what: String,
    /// Blocks of lines of a material.toml with places to fill in; none where others bring them.
    blocks: Vec<String>,
}

/// The lines that are to be filled in, each once.
pub(super) fn way_out(gaps: &[Gap]) -> String {
    const COMPLETE: &str = "`matdb add --template` prints a complete entry";
    let mut blocks: Vec<&str> = Vec::new();
    for block in gaps.iter().flat_map(|gap| &gap.blocks) {
        if !blocks.contains(&block.as_str()) {
            blocks.push(block);
        }
    }
    if blocks.is_empty() {
        return COMPLETE.to_owned();
    }
    format!("fill this in ({COMPLETE}):\n\n{}", blocks.join("\n\n"))
}

/// What is missing, in one clause.
pub(in crate::adopt) fn clauses(gaps: &[Gap]) -> String {
    gaps.iter().map(|gap| gap.what.as_str()).collect::<Vec<_>>().join("; ")
}

/// What the curves of a material lack, and fits that claim to be measured without a curve.
pub(super) fn all(material: &Material) -> Vec<Gap> {
    let mut gaps = Vec::new();
    for curve in &material.curves {
        gaps.extend(missing(material, curve));
    }
    for fit in material.fits.iter().filter(|fit| fit.curve.is_none()) {
        let source = material.sources.iter().find(|source| source.key == fit.source);
        if source.is_some_and(|source| source.kind == SourceKind::Measured) {
            gaps.push(Gap {
                what: format!(
                    "fit `{}` has the measured source `{}` and names no curve; numbers that others fitted are \
                     literature",
                    fit.name, fit.source
                ),
                blocks: Vec::new(),
            });
        }
    }
    gaps
}

/// What a curve lacks. That there is a source at all was checked before.
pub(in crate::adopt) fn missing(material: &Material, curve: &Curve) -> Vec<Gap> {
    let source = material.sources.iter().find(|source| source.key == curve.source);
    let Some(source) = source.filter(|source| source.kind == SourceKind::Measured) else {
        return Vec::new();
    };
    let mut missing = Vec::new();
    if source.licence.as_ref().is_none_or(|licence| licence.trim().is_empty()) {
        missing.push(Gap {
            what: format!("source `{}` has no licence", source.key),
            blocks: vec![format!(
                "# into the [[source]] `{}`:\n\
                 licence = \"…\"               # SPDX, such as CC-BY-4.0",
                source.key
            )],
        });
    }
    let key = curve.instrument.as_ref();
    let instrument = key.and_then(|key| material.instruments.iter().find(|i| i.key == *key));
    if instrument.is_none() {
        missing.push(Gap {
            what: format!("curve `{}` names no instrument", curve.name),
            blocks: instrument_lines(material, curve),
        });
    }
    let in_rows = curve.observations.iter().all(|row| row.threshold_sigma0.is_some());
    if !in_rows && instrument.is_none_or(|instrument| instrument.threshold_w.is_none()) {
        missing.push(match instrument {
            Some(Instrument { key, .. }) => Gap {
                what: format!(
                    "instrument `{key}` has no threshold_dbm and not every row of curve `{}` a threshold_db",
                    curve.name
                ),
                blocks: vec![format!("# into the [[instrument]] `{key}`:\n{THRESHOLD}")],
            },
            None => Gap {
                what: format!("not every row of curve `{}` has a threshold_db", curve.name),
                blocks: Vec::new(),
            },
        });
    }
    missing
}

const THRESHOLD: &str =
    "threshold_dbm = …             # the least power that counts as a detection, such as -77";

/// What names the instrument of a curve, and the instrument itself where there is none.
fn instrument_lines(material: &Material, curve: &Curve) -> Vec<String> {
    let known = material.instruments.first().map_or("radar", |instrument| &instrument.key);
    let named = format!("# into the [[curve]] `{}`:\ninstrument = \"{known}\"", curve.name);
    let itself = format!(
        "[[instrument]]\nkey = \"{known}\"\n\
         name = \"…\"                  # maker and model\n\
         centre_frequency_ghz = …      # such as 300\n{THRESHOLD}"
    );
    [named].into_iter().chain(material.instruments.is_empty().then_some(itself)).collect()
}
