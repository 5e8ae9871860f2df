//! What a publication is made of, in order.

use std::collections::BTreeMap;
use std::path::Path;

use super::about::About;
use super::api::{Entry, Index};
use super::error::CatalogueError;
use super::folder::{Folder, Sum};
use super::layout::{ABOUT, DATABASE, ZENODO};
use super::site::Site;
use super::verify::check_staged;
use super::{api, records, tables};
use crate::material::form::{alternative_licences, is_licence, licence_names};
use crate::store::Store;

/// Licences that a sentence names one by one.
const MOST_NAMED: usize = 5;

/// What was published.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Published {
    /// Number of materials.
    pub materials: usize,
    /// Number of files.
    pub files: usize,
    /// Whether other data had the same version in this folder before.
    pub is_version_reused: bool,
    /// Whether there is no `.zenodo.json`, as Zenodo could not be told the licence.
    pub is_without_zenodo: bool,
    /// Licences of materials that the declared one does not name; none where none is declared.
    pub undeclared_licences: Vec<String>,
}

/// Writes every material of a database as a catalogue into a folder, all of it or nothing.
///
/// An earlier publication there is replaced. `progress` hears of every material done.
///
/// # Errors
/// When the database cannot be read or is damaged, its materials share no licence and `about` declares none, the folder holds
/// anything else, or something cannot be written.
pub fn publish(
    store: &Store,
    about: &About,
    target: &Path,
    progress: impl FnMut(usize),
) -> Result<Published, CatalogueError> {
    // A copy would be packed anew, and with it damage that shows in the original alone.
    check_sound(store)?;
    let mut folder = Folder::new(target)?;
    // Everything else is read from the copy: one moment, whoever writes meanwhile.
    let copy = folder.place(DATABASE, |place| Ok::<(), CatalogueError>(store.copy_to(place)?))?;
    let copy = Store::open_existing(copy)?.map(|copy| copy.known_as(store));
    let store = copy.as_ref().unwrap_or(store);
    let (materials, is_version_reused) = fill(&mut folder, store, about, progress)?;
    let published = Published {
        materials,
        files: folder.sums().len() + 1,
        is_version_reused,
        is_without_zenodo: !folder.sums().contains_key(ZENODO),
        undeclared_licences: undeclared(&store.licences()?, about),
    };
    folder.keep_if(|staged| match check_staged(staged, store)?.into_iter().next() {
        None => Ok(()),
        Some(found) => Err(damaged(store, found.to_string())),
    })?;
    Ok(published)
}

/// Refuses a database that is damaged, or has tables, triggers, indexes or views of somebody else.
fn check_sound(store: &Store) -> Result<(), CatalogueError> {
    let mut problems = store.damage()?;
    problems.extend(store.changed_schema()?);
    match problems.into_iter().next() {
        None => Ok(()),
        Some(problem) => Err(damaged(store, problem)),
    }
}

fn damaged(store: &Store, problem: String) -> CatalogueError {
    CatalogueError::Damaged { database: store.path().to_owned(), problem }
}

/// The hash of every file that publishing `store` over `published` would write beside its database, of
/// which `database` is that: a copy of a copy counts one more change in its header.
pub(super) fn rebuilt(
    store: &Store,
    about: &About,
    published: &Path,
    database: Sum,
) -> Result<BTreeMap<String, Sum>, CatalogueError> {
    let mut folder = Folder::hashed(published, BTreeMap::from([(DATABASE.to_owned(), database)]))?;
    fill(&mut folder, store, about, |_| ())?;
    Ok(folder.sums().clone())
}

/// Writes everything but the database and the list of hashes; the number of materials, and whether other data had
/// the same version there.
fn fill(
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
            return Err(damaged(
                store,
                format!("lists name `{}`, which is not there", summary.slug),
            ));
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

/// Those of the materials' licences that the declared one does not name.
fn undeclared(licences: &[String], about: &About) -> Vec<String> {
    let Some(declared) = &about.licence else { return Vec::new() };
    let is_named = |name: &str| licence_names(declared).any(|declared| declared == name);
    let is_said = |licence: &&String| match alternative_licences(licence) {
        Some(alternatives) => alternatives.into_iter().any(is_named),
        None => licence_names(licence).all(is_named),
    };
    licences.iter().filter(|licence| !is_said(licence)).cloned().collect()
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
