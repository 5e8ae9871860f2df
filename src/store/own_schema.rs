//! Compares the schema of a file with that of this program.

use super::connect;
use super::database::Store;
use super::error::{InFile, StoreError};
use super::rows::rows;
use super::tables::{quoted, schema};

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
        let sql = "SELECT name FROM pragma_table_list WHERE type = 'shadow'";
        let shadows: Vec<Option<String>> =
            rows(&self.conn, sql, [], |row| row.get(0)).in_file(&self.path)?;
        let is_added = |one: &&[Option<String>; 4]| {
            // What has no statement, and what belongs to a full-text index, goes with its table.
            !own.iter().any(|own| own[..2] == one[..2])
                && one[3].is_some()
                && !shadows.contains(&one[1])
        };
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
    let name = name.as_deref().unwrap_or_default();
    let is_plain = name.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
    let name = if is_plain { name.to_owned() } else { quoted(name) };
    format!("{} {name}", kind.as_deref().unwrap_or_default())
}
