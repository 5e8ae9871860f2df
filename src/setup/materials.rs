//! Materials by the names that scenes and commands use: `NAME` or `NAME@REVISION`.

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::formats::text::nearest;
use crate::material::{Material, Slug, builtin};
use crate::store::{Store, StoreError, StoredRevision};

/// A material and where it was found.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct MaterialRevision {
    /// The material.
    pub material: Material,
    /// Its revision in the database; `None` for a built-in one that is not in it.
    pub revision: Option<u32>,
}

impl MaterialRevision {
    /// The revision with the circumstances of its storage; `None` for a built-in material that is not in the database.
    ///
    /// # Errors
    /// A database that cannot be read.
    pub fn stored(&self, store: Option<&Store>) -> Result<Option<StoredRevision>, Error> {
        match (store, self.revision) {
            (Some(store), Some(_)) => Ok(store.get(&self.material.slug, self.revision)?),
            _ => Ok(None),
        }
    }
}

/// Finds a material in the database, else among those that are built in.
///
/// `asked_by` opens the error message: who asks, with a colon, or nothing.
///
/// # Errors
/// An unknown name, with the nearest known one; a revision that is not a whole number; a database
/// that cannot be read.
pub fn find_material(
    store: Option<&Store>,
    wanted: &str,
    asked_by: &str,
) -> Result<MaterialRevision, Error> {
    let (name, revision) = split(wanted, asked_by)?;
    if let Some(store) = store
        && let Ok(slug) = name.parse()
        && let Some(stored) = store.get(&slug, revision)?
    {
        let revision = Some(stored.revision);
        return Ok(MaterialRevision { material: stored.material, revision });
    }
    match (builtin::get(name), revision) {
        (Some(material), None) => Ok(MaterialRevision { material: material?, revision: None }),
        _ => Err(unknown_material(store, wanted, asked_by)?),
    }
}

/// The error for an unknown name, with the nearest known one; `asked_by` opens its message.
///
/// # Errors
/// A database that cannot be read.
pub fn unknown_material(
    store: Option<&Store>,
    wanted: &str,
    asked_by: &str,
) -> Result<Error, Error> {
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

/// The built-in materials that the database does not have, sorted by name.
///
/// # Errors
/// A database that cannot be read.
pub fn builtin_not_added(store: Option<&Store>) -> Result<Vec<Material>, Error> {
    let mut materials = builtin::all()?;
    if let Some(store) = store {
        let slugs: Vec<Slug> = materials.iter().map(|material| material.slug.clone()).collect();
        let present = store.present(&slugs)?;
        materials.retain(|material| !present.contains(&material.slug));
    }
    Ok(materials)
}

/// A database in memory of the built-in materials that `store` does not have, to be searched as `store` is.
///
/// # Errors
/// A database that cannot be read.
pub fn store_of_not_added(store: Option<&Store>) -> Result<Store, Error> {
    let mut built_in = Store::in_memory()?;
    built_in.add(&builtin_not_added(store)?)?;
    Ok(built_in)
}

/// A sentence on a material that is withdrawn or superseded.
pub fn status_warning(material: &Material) -> Option<String> {
    Some(format!("`{}` is {}", material.slug, material.status.sentence()?))
}

/// A sentence on a revision of a material that a later revision withdraws or supersedes, or of which the current
/// revision is damaged.
///
/// # Errors
/// A database that cannot be read.
pub fn later_status_warning(
    store: Option<&Store>,
    slug: &Slug,
    revision: Option<u32>,
) -> Result<Option<String>, Error> {
    let (Some(store), Some(revision)) = (store, revision) else { return Ok(None) };
    let current = match store.get(slug, None) {
        Err(StoreError::Corrupt { problem, .. }) => {
            return Ok(Some(format!("the current revision of `{slug}` is damaged: {problem}")));
        }
        current => current?,
    };
    let Some(current) = current.filter(|current| revision < current.revision) else {
        return Ok(None);
    };
    let warning = status_warning(&current.material);
    Ok(warning.map(|warning| format!("{warning}, says revision {}", current.revision)))
}

/// A name and the revision that stands behind its `@`.
fn split<'a>(wanted: &'a str, asked_by: &str) -> Result<(&'a str, Option<u32>), Error> {
    let Some((name, revision)) = wanted.split_once('@') else {
        return Ok((wanted, None));
    };
    let number = revision.parse().map_err(|_| {
        Error::usage(
            format!(
                "{asked_by}`{wanted}` asks for revision `{revision}`, which is not a whole number"
            ),
            format!("write {name}@1 or just {name}"),
        )
    })?;
    Ok((name, Some(number)))
}
