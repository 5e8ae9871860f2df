//! Whether a file has exactly the schema of this program.

use super::connect;
use super::database::Store;
use super::error::{InFile, StoreError};
use super::tables::schema;

impl Store {
    /// Whether tables, indexes and views are exactly those that this program makes. A file from
    /// elsewhere could have others of the same names that answer what they like.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn has_own_schema(&self) -> Result<bool, StoreError> {
        let [own, there] = self.schemas()?;
        Ok(own == there)
    }

    /// Every table, index, trigger or view that is not as this program makes it, a clause each: what is missing or
    /// another one, and what somebody has added.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn changed_schema(&self) -> Result<Vec<String>, StoreError> {
        let [own, there] = self.schemas()?;
        let mut changed = Vec::new();
        for one in own.iter().filter(|one| !there.contains(one)) {
            changed.push(format!("{} is not the one that matdb makes", named(one)));
        }
        for one in there.iter().filter(|one| !own.iter().any(|own| own[..2] == one[..2])) {
            changed.push(format!("{} is none that matdb makes", named(one)));
        }
        Ok(changed)
    }

    /// What this program makes, and what is in the file.
    fn schemas(&self) -> Result<[Vec<[Option<String>; 4]>; 2], StoreError> {
        let own = connect::in_memory()?;
        Ok([schema(&own).in_file(&self.path)?, schema(&self.conn).in_file(&self.path)?])
    }
}

/// Kind and name of an object of a schema.
fn named([kind, name, ..]: &[Option<String>; 4]) -> String {
    format!("{} {}", kind.as_deref().unwrap_or_default(), name.as_deref().unwrap_or_default())
}
