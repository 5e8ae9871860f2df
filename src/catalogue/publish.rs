//! What a publication is made of, in order.

use std::path::Path;

use super::site::Site;
use super::{About, CatalogueError, Folder};
use crate::store::Store;

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
    folder.write("about.json", format!("{}\n", serde_json::json!(about)).as_bytes())?;
    let summaries = store.list()?;
    let mut site = Site::new(about)?;
    for (number, summary) in summaries.iter().enumerate() {
        let Some(stored) = store.get(&summary.slug, None)? else { continue };
        let record = serde_json::json!({
            "revision": stored.revision,
            "content_hash": stored.content_hash,
            "material": stored.material,
        });
        let path = format!("api/v1/materials/{}.json", summary.slug);
        folder.write(&path, format!("{record}\n").as_bytes())?;
        site.add(&mut folder, &stored, &store.history(&summary.slug)?)?;
        progress(number + 1);
    }
    site.finish(&mut folder)?;
    let published = Published { materials: summaries.len(), files: folder.sums().len() + 1 };
    folder.keep()?;
    Ok(published)
}
