//! Materials out of the database, with all their revisions.

use serde::Serialize;

use crate::error::Error;
use crate::formats::text::nearest;
use crate::setup::Database;
use crate::store::{self, Store};

/// A material that was removed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Removal {
    /// Number of its revisions.
    pub revisions: u32,
    /// Its name.
    pub slug: String,
}

/// Removes the materials of these names, all of them or none.
///
/// # Errors
/// A name that is there twice, or that the database does not have; a database that cannot be written.
pub fn remove_materials(names: &[String], database: &Database) -> Result<Vec<Removal>, Error> {
    // Opening for reading first: removing from a database that is not there must not create it.
    let known = database.read()?;
    let mut slugs = Vec::new();
    for name in names {
        if names.iter().filter(|other| *other == name).count() > 1 {
            return Err(Error::usage(
                format!("`{name}` is named twice"),
                "name each material once",
            ));
        }
        let slug = name.parse().ok();
        match (slug, &known) {
            (Some(slug), Some(store)) if store.holds(&slug)? => slugs.push(slug),
            _ => return Err(absent(name, known.as_ref(), database)?),
        }
    }
    drop(known);
    let mut removals = Vec::new();
    for (slug, removed) in std::iter::zip(names, database.write()?.remove(&slugs)?) {
        let revisions = removed.map_or(0, |store::Removal { revisions }| revisions);
        removals.push(Removal { revisions, slug: slug.clone() });
    }
    Ok(removals)
}

fn absent(name: &str, store: Option<&Store>, database: &Database) -> Result<Error, Error> {
    let stored = store.map_or(Ok(Vec::new()), Store::list)?;
    let near = nearest(name, stored.iter().map(|summary| summary.slug.as_str()));
    let way_out = match (name.split_once('@'), near) {
        (Some((slug, _)), _) => format!("all revisions go together: `matdb rm {slug}`"),
        (None, Some(near)) => format!("did you mean `{near}`?"),
        (None, None) => "`matdb list` shows what it holds".to_owned(),
    };
    let problem = format!("{} holds no material `{name}`", database.path().display());
    Ok(Error::usage(problem, way_out))
}
