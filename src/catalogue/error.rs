//! What can go wrong with a publication, in the words of its user.

use std::path::PathBuf;

use thiserror::Error;

use crate::files::FilesError;
use crate::formats::html::PageError;
use crate::store::{Store, StoreError};

/// Why a catalogue could not be published or taken over. Nothing has changed then.
#[derive(Debug, Error)]
pub enum CatalogueError {
    /// The database refused.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// The database or what was made of it is damaged.
    #[error(
        "{} is damaged: {problem}; nothing was published, a check lists all damage and a repair mends what can be",
        database.display()
    )]
    Damaged {
        /// The database.
        database: PathBuf,
        /// The first thing that is wrong.
        problem: String,
    },
    /// Something in the database would be refused in the publication by whoever verifies it.
    #[error(
        "{}: {problem}; nothing was published, as nobody could verify it: make that fit again, or add the \
         material without it",
        database.display()
    )]
    NotVerifiable {
        /// The database.
        database: PathBuf,
        /// The first thing that is wrong.
        problem: String,
    },
    /// The database has tables, indexes or views of somebody else, which a publication would pass on.
    #[error("in {} {added}; nothing was published, as a publication has no tables of others", database.display())]
    Added {
        /// The database.
        database: PathBuf,
        /// The first of them, and how to remove it.
        added: String,
    },
    /// The folder holds something else than an earlier publication; it was not touched.
    #[error(
        "{} holds `{stranger}`, which no publication of matdb has put there; name a new folder, or move \
         that away",
        folder.display()
    )]
    Occupied {
        /// The folder.
        folder: PathBuf,
        /// A file in it, by its path from there.
        stranger: String,
    },
    /// The folder cannot give way to a new one.
    #[error("cannot replace {}: {problem}; name a folder in it or beside it", folder.display())]
    Fixed {
        /// The folder.
        folder: PathBuf,
        /// Why.
        problem: &'static str,
    },
    /// The folder lies in a publication, which would not be sound any more.
    #[error(
        "{} lies in the publication {}, and nothing that is not its own may; name a folder beside it",
        folder.display(),
        publication.display()
    )]
    Within {
        /// The folder.
        folder: PathBuf,
        /// The publication.
        publication: PathBuf,
    },
    /// A material is larger than anybody who verifies a publication would read.
    #[error(
        "`{slug}` takes {} MiB as JSON and a publication takes {} at most; nothing was published, thin its \
         curves out or split it",
        bytes.div_ceil(1 << 20),
        limit >> 20
    )]
    TooLarge {
        /// The material.
        slug: String,
        /// Its size.
        bytes: u64,
        /// What is allowed.
        limit: u64,
    },
    /// The materials share no licence, and none was declared for the catalogue.
    #[error(
        "the materials are under {found}, and the catalogue states no licence of its own; nothing was published, \
         declare one for the catalogue, such as licence = \"{example}\""
    )]
    NoLicence {
        /// Their licences.
        found: String,
        /// What could be declared.
        example: String,
    },
    /// What stands there was published, but its record of changes cannot be continued.
    #[error(
        "cannot continue the change log of the earlier publication: {}: {problem}; publish into a new \
         folder, or put that file back as it was",
        file.display()
    )]
    Earlier {
        /// The file.
        file: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// A bundle that cannot be trusted.
    #[error("{}: {problem}; nothing was imported, ask whoever made it for a sound copy", bundle.display())]
    Unsound {
        /// The folder or database.
        bundle: PathBuf,
        /// The first thing that is wrong.
        problem: String,
    },
    /// A bundle in forms that this program does not know.
    #[error("a newer matdb has published {}; nothing was imported, install that", bundle.display())]
    Newer {
        /// The folder.
        bundle: PathBuf,
    },
    /// What was named is not a catalogue.
    #[error("{} is not a catalogue: {problem}; name a published folder or its catalogue.sqlite", path.display())]
    NoBundle {
        /// What was named.
        path: PathBuf,
        /// Why.
        problem: String,
    },
    /// A prefix that makes no name of a material.
    #[error("with the prefix `{prefix}`, {problem}")]
    Prefix {
        /// The prefix.
        prefix: String,
        /// Which name it would make.
        problem: String,
    },
    /// Somebody else has written to the database meanwhile; nothing was imported.
    #[error("`{slug}` was changed by another program meanwhile; nothing was imported, try again")]
    Overtaken {
        /// The material.
        slug: String,
    },
    /// A table cannot be written in its format.
    #[error("cannot write {}: {problem}; please report this", path.display())]
    Encoding {
        /// The file.
        path: PathBuf,
        /// What the writer says.
        problem: String,
    },
    /// A file or folder cannot be read or written.
    #[error(transparent)]
    Files(#[from] FilesError),
    /// The page of all materials in three dimensions could not be drawn.
    #[error("view.html: {0}")]
    View(Box<dyn std::error::Error + Send + Sync>),
    /// A page could not be made.
    #[error(transparent)]
    Page(#[from] PageError),
}

impl CatalogueError {
    /// A database that is damaged.
    pub(super) fn damaged(store: &Store, problem: String) -> CatalogueError {
        CatalogueError::Damaged { database: store.path().to_owned(), problem }
    }
}
