//! What a publication is made of, in order: everything that follows from its database.

use std::collections::BTreeMap;
use std::path::Path;

use super::about::About;
use super::api::{Entry, Index};
use super::error::CatalogueError;
use super::folder::{Folder, Sum};
use super::layout::{ABOUT, DATABASE};
use super::site::Site;
use super::{api, records, tables};
use crate::material::form::is_licence;
use crate::store::Store;

/// Licences that a sentence names one by one.
const MOST_NAMED: usize = 5;

/// The hash of every file that publishing `store` over `published` would write beside its database, of
/// which `database` is that: a copy of a copy counts one more change in its header.
pub(super) fn rebuilt(
    store: &Store,
    about: &About,
    published: &Path,
    database: Sum,
) -> Result<BTreeMap<String, Sum>, CatalogueError> {
    let mut folder = Folder::hashed(published, BTreeMap::from([(DATABASE.to_owned(), database)]))?;
    write_contents(&mut folder, store, about, |_| ())?;
    Ok(folder.sums().clone())
}

/// Writes everything but the database and the list of hashes; the number of materials, and whether other data had
/// the same version there.
pub(super) fn write_contents(
    folder: &mut Folder,
    store: &Store,
    about: &About,
    mut progress: impl FnMut(usize),
) -> Result<(usize, bool), CatalogueError> {
    folder.write(ABOUT, format!("{}\n", serde_json::json!(about)).as_bytes())?;
    // What nobody declared is not written as if they had: the next publication asks its own materials.
    let about = &About { licence: licence(store, about)?, ..about.clone() };
    let (mut entries, mut site) = (Vec::new(), Site::new(about)?);
    for (number, summary) in store.list()?.iter().enumerate() {
        let Some(stored) = store.get(&summary.slug, None)? else {
            let problem = format!("lists name `{}`, which is not there", summary.slug);
            return Err(CatalogueError::damaged(store, problem));
        };
        api::write(folder, &stored)?;
        site.add(folder, &stored, &store.history(&summary.slug)?)?;
        entries.push(Entry::new(summary, &stored));
        progress(number + 1);
    }
    site.finish(folder)?;
    let index = Index::new(about, entries);
    index.write(folder)?;
    let tables = tables::write(folder, store)?;
    let is_version_reused = records::write(folder, about, &index, &tables)?;
    Ok((index.materials.len(), is_version_reused))
}

/// The licence of the catalogue as a whole: the declared one, or else that of all its materials; none where there
/// are none.
fn licence(store: &Store, about: &About) -> Result<Option<String>, CatalogueError> {
    if about.licence.is_some() {
        return Ok(about.licence.clone());
    }
    match store.licences()?.as_slice() {
        [] => Ok(None),
        [only] if is_licence(only) => Ok(Some(only.clone())),
        several => Err(no_licence(several)),
    }
}

/// Some licences for a sentence.
pub fn named_licences(licences: &[String]) -> String {
    /// Letters of a licence that is none.
    const MOST_LETTERS: usize = 40;
    let named = licences.iter().take(MOST_NAMED);
    let named: Vec<String> = named.map(|l| l.chars().take(MOST_LETTERS).collect()).collect();
    match licences.len().saturating_sub(MOST_NAMED) {
        0 => named.join(", "),
        more => format!("{} and {more} more", named.join(", ")),
    }
}

/// That these licences give none for the whole, and what could be declared.
fn no_licence(licences: &[String]) -> CatalogueError {
    let found = named_licences(licences);
    let part = |licence: &String| match licence.contains(' ') {
        true => format!("({licence})"),
        false => licence.clone(),
    };
    let all_of_them = licences.iter().map(part).collect::<Vec<_>>().join(" AND ");
    let is_example = licences.len() <= MOST_NAMED && is_licence(&all_of_them);
    let example = if is_example { all_of_them } else { "CC-BY-4.0".to_owned() };
    CatalogueError::NoLicence { found, example }
}
