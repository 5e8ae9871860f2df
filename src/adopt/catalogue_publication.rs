//! The database as a catalogue for others, with its page in three dimensions.

use std::path::Path;

use crate::catalogue::{
    About, CatalogueError, PublishSummary, Verification, publish_with, verify_with,
};
use crate::report::CATALOGUE_VIEW;
use crate::store::Store;

/// Writes every material of a database as a catalogue into a folder, all of it or nothing.
///
/// An earlier publication there is replaced. `progress` gets the number of materials done.
///
/// # Errors
/// Those of [`publish_with`].
pub fn publish(
    store: &Store,
    about: &About,
    target: &Path,
    progress: impl FnMut(usize),
) -> Result<PublishSummary, CatalogueError> {
    publish_with(store, about, target, CATALOGUE_VIEW, progress)
}

/// Checks a published folder, or a database by itself.
///
/// # Errors
/// When `bundle` is neither. Whatever is wrong inside is in [`Verification::problems`].
pub fn verify(bundle: &Path) -> Result<Verification, CatalogueError> {
    verify_with(bundle, CATALOGUE_VIEW)
}
