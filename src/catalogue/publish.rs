//! What a publication is made of, in order.

use std::path::Path;

use super::api::{Entry, Index};
use super::site::Site;
use super::{About, CatalogueError, Folder, api, records, tables};
use crate::store::Store;

/// The database of a publication.
pub(super) const DATABASE: &str = "catalogue.sqlite";

/// What was published.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
pub struct Published {
    /// Number of materials.
    pub materials: usize,
    /// Number of files.
    pub files: usize,
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
    mut progress: impl FnMut(usize),
) -> Result<Published, CatalogueError> {
    let mut folder = Folder::new(target)?;
    // Everything else is read from the copy: one moment, whoever writes meanwhile.
    let copy = folder.place(DATABASE, |place| Ok::<(), CatalogueError>(store.copy_to(place)?))?;
    let copy = Store::open_existing(copy)?;
    let store = copy.as_ref().unwrap_or(store);
    folder.write("about.json", format!("{}\n", serde_json::json!(about)).as_bytes())?;
    let (mut entries, mut site) = (Vec::new(), Site::new(about)?);
    for (number, summary) in store.list()?.iter().enumerate() {
        let Some(stored) = store.get(&summary.slug, None)? else { continue };
        api::write(&mut folder, &stored)?;
        site.add(&mut folder, &stored, &store.history(&summary.slug)?)?;
        entries.push(Entry::new(summary, &stored));
        progress(number + 1);
    }
    site.finish(&mut folder)?;
    let index = Index::new(about, entries);
    index.write(&mut folder)?;
    let tables = tables::write(&mut folder, store)?;
    records::write(&mut folder, about, &index, &tables)?;
    let published = Published { materials: index.materials.len(), files: folder.sums().len() + 1 };
    folder.keep()?;
    Ok(published)
}
