//! What a publication is made of, in order.

use std::collections::BTreeMap;
use std::path::Path;

use super::api::{Entry, Index};
use super::folder::Sum;
use super::site::Site;
use super::{About, CatalogueError, Folder, api, records, tables};
use crate::store::Store;

/// The database of a publication.
pub(super) const DATABASE: &str = "catalogue.sqlite";

/// What the catalogue says of itself.
pub(super) const ABOUT: &str = "about.json";

/// What was published.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Published {
    /// Number of materials.
    pub materials: usize,
    /// Number of files.
    pub files: usize,
    /// Whether other data had the same version in this folder before.
    pub is_version_reused: bool,
}

/// Writes every material of a database as a catalogue into a folder, all of it or nothing.
///
/// An earlier publication there is replaced. `progress` hears of every material done.
///
/// # Errors
/// When the database cannot be read, the folder holds anything else, or something cannot be written.
pub fn publish(
    store: &Store,
    about: &About,
    target: &Path,
    progress: impl FnMut(usize),
) -> Result<Published, CatalogueError> {
    let mut folder = Folder::new(target)?;
    // Everything else is read from the copy: one moment, whoever writes meanwhile.
    let copy = folder.place(DATABASE, |place| Ok::<(), CatalogueError>(store.copy_to(place)?))?;
    let copy = Store::open_existing(copy)?;
    let (materials, is_version_reused) =
        fill(&mut folder, copy.as_ref().unwrap_or(store), about, progress)?;
    let published = Published { materials, files: folder.sums().len() + 1, is_version_reused };
    folder.keep()?;
    Ok(published)
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
    let (mut entries, mut site) = (Vec::new(), Site::new(about)?);
    for (number, summary) in store.list()?.iter().enumerate() {
        let Some(stored) = store.get(&summary.slug, None)? else { continue };
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
