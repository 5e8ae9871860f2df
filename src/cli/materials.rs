//! Materials by the names that scenes and commands use: `NAME` or `NAME@REVISION`.

use crate::error::Error;
use crate::formats::text::nearest;
use crate::material::{Material, Slug, builtin};
use crate::store::Store;

/// A material and where it was found.
pub(super) struct Found {
    pub material: Material,
    /// Its revision in the database; `None` for a built-in that is not in it.
    pub revision: Option<u32>,
}

/// Looks a material up in the database, then among the built-in ones.
///
/// `asked_by` opens the error message: who wants it, with a colon, or nothing.
pub(super) fn find(store: Option<&Store>, wanted: &str, asked_by: &str) -> Result<Found, Error> {
    let (name, revision) = split(wanted, asked_by)?;
    if let Some(store) = store
        && let Ok(slug) = name.parse()
        && let Some(stored) = store.get(&slug, revision)?
    {
        return Ok(Found { material: stored.material, revision: Some(stored.revision) });
    }
    match (builtin::get(name), revision) {
        (Some(material), None) => Ok(Found { material: material?, revision: None }),
        _ => Err(unknown(store, wanted, asked_by)?),
    }
}

fn split<'a>(wanted: &'a str, asked_by: &str) -> Result<(&'a str, Option<u32>), Error> {
    let Some((name, revision)) = wanted.split_once('@') else {
        return Ok((wanted, None));
    };
    let number = revision.parse().map_err(|_| Error::Usage {
        problem: format!(
            "{asked_by}`{wanted}` asks for revision `{revision}`, which is no whole number"
        ),
        way_out: format!("write {name}@1 or just {name}"),
    })?;
    Ok((name, Some(number)))
}

/// The built-in materials that the database does not have, sorted by name.
pub(super) fn not_added(store: Option<&Store>) -> Result<Vec<Material>, Error> {
    let mut missing = Vec::new();
    for name in builtin::names() {
        let Some(material) = builtin::get(name) else { continue };
        let material = material?;
        if store.map_or(Ok(None), |store| store.summary(&material.slug))?.is_none() {
            missing.push(material);
        }
    }
    Ok(missing)
}

/// The same as a database in memory, to be searched as others are.
pub(super) fn store_of_not_added(store: Option<&Store>) -> Result<Store, Error> {
    let mut built_in = Store::in_memory()?;
    built_in.add(&not_added(store)?)?;
    Ok(built_in)
}

/// A cell of a table with the status of its material, which goes without saying while it is active.
pub(super) fn with_status(cell: &str, status: &str) -> String {
    match status {
        "active" => cell.to_owned(),
        status => format!("{cell}, {status}"),
    }
}

/// That a material should not be used any more.
pub(super) fn not_to_be_used(material: &Material) -> Option<String> {
    Some(format!("`{}` is {}", material.slug, material.status.sentence()?))
}

/// That a later revision says so.
pub(super) fn not_to_be_used_since(
    store: Option<&Store>,
    slug: &Slug,
    revision: Option<u32>,
) -> Result<Option<String>, Error> {
    let current = store.map(|store| store.get(slug, None)).transpose()?.flatten();
    let later = current.filter(|current| revision.is_some_and(|own| own < current.revision));
    Ok(later.and_then(|later| {
        Some(format!("{}, says revision {}", not_to_be_used(&later.material)?, later.revision))
    }))
}

/// The error for a name that nobody knows, with the nearest known one.
pub(super) fn unknown(store: Option<&Store>, wanted: &str, asked_by: &str) -> Result<Error, Error> {
    let mut known: Vec<String> = builtin::names().map(str::to_owned).collect();
    if let Some(store) = store {
        known.extend(store.list()?.into_iter().map(|summary| summary.slug.into()));
    }
    let name = wanted.split('@').next().unwrap_or(wanted);
    let way_out = if known.iter().any(|k| k == name) && name != wanted {
        format!("`matdb show {name}` tells which revisions there are")
    } else if let Some(near) = nearest(name, known.iter().map(String::as_str)) {
        format!("did you mean `{near}`?")
    } else {
        "`matdb add --from FILE` adds one of your own, `matdb list` shows the known ones".to_owned()
    };
    Ok(Error::UnknownMaterial { asked_by: asked_by.to_owned(), name: wanted.to_owned(), way_out })
}
