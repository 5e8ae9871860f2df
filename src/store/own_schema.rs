//! Compares the schema of a file with that of this program.

use super::connect;
use super::database::Store;
use super::error::{InFile, StoreError};
use super::tables::schema;

impl Store {
    /// Whether tables, indexes, views and triggers are exactly those of this program. A file from elsewhere could have
    /// others of the same names, with any content.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn has_own_schema(&self) -> Result<bool, StoreError> {
        let [own, there] = self.schemas()?;
        Ok(own == there)
    }

    /// Every table, index, trigger or view of this program that is missing or different, as a clause each.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn changed_schema(&self) -> Result<Vec<String>, StoreError> {
        let [own, there] = self.schemas()?;
        let changed = own.iter().filter(|one| !there.contains(one));
        Ok(changed.map(|one| format!("{} is not the one that matdb makes", named(one))).collect())
    }

    /// Every table, index, trigger or view that is not of this program, as a clause each with the way to remove it.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn added_objects(&self) -> Result<Vec<String>, StoreError> {
        let [own, there] = self.schemas()?;
        let is_added = |one: &&[Option<String>; 4]| !own.iter().any(|own| own[..2] == one[..2]);
        let added = there.iter().filter(is_added);
        Ok(added
            .map(|one| format!("{0} was not made by matdb: DROP {0} removes it", named(one)))
            .collect())
    }

    /// The schema of this program, and that of the file.
    fn schemas(&self) -> Result<[Vec<[Option<String>; 4]>; 2], StoreError> {
        let own = connect::in_memory()?;
        Ok([schema(&own).in_file(&self.path)?, schema(&self.conn).in_file(&self.path)?])
    }
}

/// Kind and name of an object of a schema.
fn named([kind, name, ..]: &[Option<String>; 4]) -> String {
    format!("{} {}", kind.as_deref().unwrap_or_default(), name.as_deref().unwrap_or_default())
}
