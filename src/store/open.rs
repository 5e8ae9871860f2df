//! Opens databases.

use std::path::{Path, PathBuf};

use super::connect;
use super::database::Store;
use super::error::StoreError;

impl Store {
    /// Opens a database. Creates it when there is none, and migrates an older schema.
    ///
    /// # Errors
    /// When the file belongs to another program, is newer than this program, damaged or locked, or cannot be written.
    /// A file of another program or of a newer matdb stays as it is.
    pub fn open(path: impl AsRef<Path>) -> Result<Store, StoreError> {
        let path = path.as_ref().to_owned();
        let conn = connect::writable(&path)?;
        Ok(Store { conn, path, activity: None })
    }

    /// Opens a database for reading only; `None` when there is no file or nothing in it.
    ///
    /// Changes nothing, and works where nothing can be written: a file of an older schema is brought
    /// up to date in memory and stays as it is until somebody [opens](Store::open) it for writing.
    ///
    /// # Errors
    /// When the file belongs to another program, is newer than this program, damaged or locked, or cannot be read.
    pub fn open_existing(path: impl AsRef<Path>) -> Result<Option<Store>, StoreError> {
        let path = path.as_ref().to_owned();
        let conn = connect::readable(&path)?;
        Ok(conn.map(|conn| Store { conn, path, activity: None }))
    }

    /// Opens a file that nobody writes, such as somebody else's copy: what lies beside it is neither
    /// read nor changed. `None` when there is no file or nothing in it.
    ///
    /// # Errors
    /// When the file belongs to another program, is newer than this program, damaged, or cannot be read.
    pub fn open_frozen(path: impl AsRef<Path>) -> Result<Option<Store>, StoreError> {
        let path = path.as_ref().to_owned();
        let conn = connect::frozen(&path)?;
        Ok(conn.map(|conn| Store { conn, path, activity: None }))
    }

    /// The file, by the name under which it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// This database, with errors that name the file of which it is a copy.
    pub(crate) fn known_as(self, original: &Store) -> Store {
        Store { path: original.path.clone(), ..self }
    }

    /// Whether a file that was opened [frozen](Store::open_frozen) has an older schema: then what is read is
    /// a copy in memory, brought up to date.
    pub fn is_of_older_schema(&self) -> bool {
        self.conn.path().is_none_or(str::is_empty)
    }

    /// An empty database in memory, gone when it is dropped.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn in_memory() -> Result<Store, StoreError> {
        let conn = connect::in_memory()?;
        Ok(Store { conn, path: PathBuf::from(":memory:"), activity: None })
    }
}
