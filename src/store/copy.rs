//! Copying a database.

use std::path::Path;

use rusqlite::{Connection, Result, params};

use super::connect::literal;
use super::database::Store;
use super::error::StoreError;

impl Store {
    /// Writes a copy of the database, as of one moment, to a new file: packed, without a log beside
    /// it, and byte for byte the same as long as nothing is changed here.
    ///
    /// # Errors
    /// When `path` exists already or cannot be written.
    pub fn copy_to(&self, path: &Path) -> std::result::Result<(), StoreError> {
        let literal = literal(path);
        let text = literal.to_str().ok_or_else(|| StoreError::Open {
            file: path.to_owned(),
            reason: std::io::Error::other("its name is not UTF-8"),
        })?;
        copy(&self.conn, text).map_err(|error| match StoreError::new(path, error) {
            // What is damaged is what was to be copied.
            StoreError::Corrupt { problem, .. } => {
                StoreError::Corrupt { file: self.path.clone(), problem }
            }
            other => other,
        })
    }
}

fn copy(conn: &Connection, path: &str) -> Result<()> {
    let query_only: bool = conn.pragma_query_value(None, "query_only", |row| row.get(0))?;
    // SQLite counts writing to the other file as writing.
    conn.pragma_update(None, "query_only", false)?;
    let done = conn.execute("VACUUM INTO ?1", params![path]);
    conn.pragma_update(None, "query_only", query_only)?;
    done.map(|_| ())
}
