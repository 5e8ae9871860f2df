//! The database as plain tables: CSV and, where the program was built with it, Parquet. Tables and
//! columns are those of the database.

mod csv;
#[cfg(feature = "parquet")]
mod parquet;

use super::error::CatalogueError;
use super::folder::Folder;
use super::layout::csv_path;
use crate::store::{Store, Table};

#[cfg(feature = "parquet")]
pub(super) use parquet::parquet_of;

/// Whether this program writes Parquet.
pub const HAS_PARQUET: bool = cfg!(feature = "parquet");

/// A table that was written, and its number of rows.
pub(super) struct WrittenTable {
    pub table: Table,
    pub rows: u64,
}

/// Writes every table, and `tables/units.csv` with the unit of every numeric column.
pub(super) fn write(
    folder: &mut Folder,
    store: &Store,
) -> Result<Vec<WrittenTable>, CatalogueError> {
    let tables = store.tables()?;
    folder.write("tables/units.csv", &csv::units(&tables))?;
    let mut written = Vec::new();
    for table in tables {
        let rows = csv::write(folder, store, &table, &csv_path(&table.name))?;
        #[cfg(feature = "parquet")]
        parquet::write(folder, store, &table)?;
        written.push(WrittenTable { table, rows });
    }
    Ok(written)
}
