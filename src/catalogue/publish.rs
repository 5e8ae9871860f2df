//! Publishing a database as a catalogue.

use std::path::Path;

use super::about::About;
use super::contents::write_contents;
use super::error::CatalogueError;
use super::folder::Folder;
use super::layout::{DATABASE, ZENODO};
use super::licence::undeclared;
use super::verify::check_staged;
use super::view::CatalogueView;
use crate::store::Store;

/// What was published.
#[derive(Clone, Debug, PartialEq, Eq, serde::Serialize)]
pub struct PublishSummary {
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
/// An earlier publication there is replaced. `view` makes its `view.html`, and `progress` gets the number of materials
/// done. [`adopt::publish`](crate::adopt::publish) has this program's page.
///
/// # Errors
/// When the database cannot be read or is damaged, a current fit does not follow from its curve, its materials share no licence and `about` declares none, the
/// folder holds anything else, the page cannot be drawn, or something cannot be written.
pub fn publish_with(
    store: &Store,
    about: &About,
    target: &Path,
    view: CatalogueView,
    progress: impl FnMut(usize),
) -> Result<PublishSummary, CatalogueError> {
    // A copy would be packed anew, and with it damage that shows in the original alone.
    check_sound(store)?;
    let mut folder = Folder::new(target)?;
    // Everything else is read from the copy: one moment, whoever writes meanwhile.
    let copy = folder.place(DATABASE, |place| Ok::<(), CatalogueError>(store.copy_to(place)?))?;
    let copy = Store::open_existing(copy)?.map(|copy| copy.known_as(store));
    let store = copy.as_ref().unwrap_or(store);
    let (materials, is_version_reused) = write_contents(&mut folder, store, about, view, progress)?;
    let published = PublishSummary {
        materials,
        files: folder.sums().len() + 1,
        is_version_reused,
        is_without_zenodo: !folder.sums().contains_key(ZENODO),
        undeclared_licences: undeclared(&store.licences()?, about),
    };
    folder.keep_if(|staged| match check_staged(staged, store)?.into_iter().next() {
        None => Ok(()),
        Some(found) => Err(CatalogueError::NotVerifiable {
            database: store.path().to_owned(),
            problem: found.to_string(),
        }),
    })?;
    Ok(published)
}

/// Refuses a database that is damaged, or has tables, triggers, indexes or views of somebody else.
fn check_sound(store: &Store) -> Result<(), CatalogueError> {
    let mut problems = store.damage()?;
    problems.extend(store.changed_schema()?);
    if let Some(problem) = problems.into_iter().next() {
        return Err(CatalogueError::damaged(store, problem));
    }
    match store.added_objects()?.into_iter().next() {
        None => Ok(()),
        Some(added) => Err(CatalogueError::Added { database: store.path().to_owned(), added }),
    }
}
