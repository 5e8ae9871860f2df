//! A measured curve into a material, with where it comes from.

use clap::ValueEnum;

use crate::error::Error;
use crate::material::{Citation, Curve, Material, Source, SourceKind};
use crate::measure;

/// How a curve came to be, as flags say it.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(super) enum Kind {
    Measured,
    Synthetic,
}

impl From<Kind> for SourceKind {
    fn from(kind: Kind) -> SourceKind {
        match kind {
            Kind::Measured => SourceKind::Measured,
            Kind::Synthetic => SourceKind::Synthetic,
        }
    }
}

/// Puts a curve into a material, unless the very same is there; the key of its source.
pub(super) fn put(
    material: &mut Material,
    name: &str,
    curve: &measure::Curve,
    kind: SourceKind,
    title: &str,
) -> Result<String, Error> {
    let observations = curve.observations();
    let source = source(material, kind, title, name);
    let taken = material.curves.iter().find(|known| known.name == name);
    match taken.map(|known| known.observations == observations && known.source == source) {
        Some(true) => Ok(source),
        None if !material.fits.iter().any(|fit| fit.name == name) => {
            let (name, source_key) = (name.to_owned(), source.clone());
            material.curves.push(Curve {
                name,
                source: source_key,
                instrument: None,
                session: None,
                observations,
            });
            Ok(source)
        }
        _ => Err(Error::Usage {
            problem: format!("`{}` has something else of the name `{name}`", material.slug),
            way_out: "give the curve another name with --curve".to_owned(),
        }),
    }
}

/// The key of a source of this kind and title, added under a free key when it is not there.
pub(super) fn source(material: &mut Material, kind: SourceKind, title: &str, key: &str) -> String {
    let same = |source: &&Source| source.kind == kind && source.title == title;
    if let Some(known) = material.sources.iter().find(same) {
        return known.key.clone();
    }
    let is_free = |key: &String| material.sources.iter().all(|source| source.key != *key);
    let numbered = (2u32..).map(|number| format!("{key}-{number}"));
    let key = std::iter::once(key.to_owned()).chain(numbered).find(is_free);
    let key = key.unwrap_or_default();
    material.sources.push(Source {
        key: key.clone(),
        kind,
        title: title.to_owned(),
        doi: None,
        url: None,
        licence: None,
        note: None,
        citation: Citation::default(),
        making: None,
    });
    key
}
