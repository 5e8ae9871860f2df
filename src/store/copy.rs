//! Copies a database.

use std::path::Path;

use rusqlite::{Connection, Result, params};

use super::connect::literal_path;
use super::database::Store;
use super::error::StoreError;

impl Store {
    /// Writes a copy of the database, as of one moment, to a new file. The copy is compact and has no log. As long as
    /// the database does not change, every copy has the same bytes.
    ///
    /// # Errors
    /// When `path` exists already or cannot be written.
    pub fn copy_to(&self, path: &Path) -> std::result::Result<(), StoreError> {
        let literal = literal_path(path);
        let text = literal.to_str().ok_or_else(|| StoreError::Open {
            file: path.to_owned(),
            reason: std::io::Error::other("its name is not UTF-8"),
        })?;
        copy(&self.conn, text).map_err(|error| match StoreError::new(path, error) {
            // The original is damaged, not the copy.
            StoreError::Corrupt { problem, .. } => {
                StoreError::Corrupt { file: self.path.clone(), problem }
            }
            other => other,
        })
    }
}

fn copy(conn: &Connection, path: &str) -> Result<()> {
    let query_only: bool = conn.pragma_query_value(None, "query_only", |row| row.get(0))?;
    // `query_only` would also forbid writing the other file.
    conn.pragma_update(None, "query_only", false)?;
    let done = conn.execute("VACUUM INTO ?1", params![path]);
    conn.pragma_update(None, "query_only", query_only)?;
    done.map(|_| ())
}
