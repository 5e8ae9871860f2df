//! The files of a publication, in the order in which they are written.

use std::collections::BTreeMap;
use std::path::Path;

use super::about::About;
use super::api::{Entry, Index};
use super::error::CatalogueError;
use super::folder::{Checksum, Folder};
use super::layout::{ABOUT, DATABASE, VIEW};
use super::licence::licence_of_all;
use super::site::Site;
use super::view::CatalogueView;
use super::{api, records, tables};
use crate::store::Store;

/// The hash of every file that publishing `store` over `published` would write. Those of the database and of
/// `view.html` are `taken`: a copy of a copy would count one more change in its header, and the last digits of rendered powers are
/// those of a machine.
pub(super) fn rebuilt(
    store: &Store,
    about: &About,
    published: &Path,
    taken: [Checksum; 2],
    view: CatalogueView,
) -> Result<BTreeMap<String, Checksum>, CatalogueError> {
    let taken = [DATABASE, VIEW].map(str::to_owned).into_iter().zip(taken);
    let mut folder = Folder::hashed(published, taken.collect())?;
    write_contents(&mut folder, store, about, view, |_| ())?;
    Ok(folder.sums().clone())
}

/// Writes everything but the database and the list of hashes. Returns the number of materials, and whether other data
/// had the same version in this folder.
pub(super) fn write_contents(
    folder: &mut Folder,
    store: &Store,
    about: &About,
    view: CatalogueView,
    mut progress: impl FnMut(usize),
) -> Result<(usize, bool), CatalogueError> {
    folder.write(ABOUT, format!("{}\n", serde_json::json!(about)).as_bytes())?;
    // A licence that nobody declared is not recorded as declared: the next publication derives its own.
    let about = &About { licence: licence_of_all(store, about)?, ..about.clone() };
    if !folder.sums().contains_key(VIEW) {
        folder.write(VIEW, &(view.draw)(store, about)?)?;
    }
    let places = (view.places)(store)?;
    let (mut entries, mut site) = (Vec::new(), Site::new(about)?);
    for (number, summary) in store.list()?.iter().enumerate() {
        let Some(stored) = store.get(&summary.slug, None)? else {
            return Err(CatalogueError::damaged(
                store,
                format!("lists name `{}`, which is not there", summary.slug),
            ));
        };
        api::write(folder, &stored)?;
        let place = places.get(&summary.slug).map(String::as_str);
        site.add(folder, &stored, &store.history(&summary.slug)?, place)?;
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
