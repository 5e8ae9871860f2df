//! What can go wrong with a publication, in the words of its user.

use std::io;
use std::path::PathBuf;

use thiserror::Error;

use crate::store::StoreError;

/// Why a catalogue could not be published or taken over. Nothing has changed then.
#[derive(Debug, Error)]
pub enum CatalogueError {
    /// The database refused.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The folder holds something else than an earlier publication; it was not touched.
    #[error(
        "{} is not empty and holds no publication of matdb; name a new folder, or empty this one",
        folder.display()
    )]
    Occupied {
        /// The folder.
        folder: PathBuf,
    },
    /// A file or folder cannot be read or written.
    #[error("cannot {verb} {}: {reason}; make room or choose another folder", path.display())]
    Io {
        /// `read`, `write`, `create`.
        verb: &'static str,
        /// The file or folder.
        path: PathBuf,
        /// What the system says.
        reason: io::Error,
    },
    /// A page cannot be made.
    #[error("cannot make the page {name}: {reason}; please report this")]
    Page {
        /// Its template.
        name: String,
        /// What the template engine says.
        reason: String,
    },
}
