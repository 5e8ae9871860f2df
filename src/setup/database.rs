//! The database of a program that can do without one.

use std::path::{Path, PathBuf};

use crate::error::Error;
use crate::store::Store;

/// The database that is used when nobody names one, in the working directory.
pub const USUAL_DATABASE: &str = "matdb.sqlite";

/// The path of the database, and whether somebody named it.
#[derive(Clone, Debug)]
pub struct Database {
    path: PathBuf,
    asked_for: bool,
}

impl Database {
    /// The database that was named, or the [usual](USUAL_DATABASE) one.
    pub fn new(asked: Option<&Path>) -> Database {
        let path = asked.unwrap_or(Path::new(USUAL_DATABASE)).to_owned();
        Database { path, asked_for: asked.is_some() }
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Opens it for reading; `None` when nobody has made one in the working directory.
    ///
    /// One that was asked for by name and is not there is an error: it may be a slip, and built-in
    /// materials must not silently stand in for somebody's own.
    ///
    /// # Errors
    /// A named database that is not there, or a file that is not a database.
    pub fn read(&self) -> Result<Option<Store>, Error> {
        let store = Store::open_existing(&self.path)?;
        if store.is_none() && self.asked_for {
            return Err(Error::NoDatabase { path: self.path.clone() });
        }
        Ok(store)
    }

    /// Opens it for writing and makes it when it is not there.
    ///
    /// # Errors
    /// A file that is not a database or cannot be written.
    pub fn write(&self) -> Result<Store, Error> {
        Ok(Store::open(&self.path)?)
    }
}
