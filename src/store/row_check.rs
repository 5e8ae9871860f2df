//! Checks the rows of a revision: they must equal those of the same content in a scratch database. The hash checks the
//! content itself.

use rusqlite::types::{Value, ValueRef};
use rusqlite::{Connection, Result, Statement, params};

use super::database::Store;
use super::error::{InFile, StoreError};
use super::results::StoredRevision;
use super::tables::{Table, follows_from_content, listed, quoted, tables, unit_rows};
use super::{connect, write};

/// A table of which a problem names the curve.
const STATISTICS: &str = "curve_statistic";
/// Largest difference of a sum on another machine, relative.
const ROUNDING: f64 = 1e-9;

/// Compares stored revisions with the same content in a scratch database.
#[derive(Debug)]
pub struct RowCheck {
    scratch: Connection,
    tables: Vec<Table>,
}

/// A table in which a revision has other rows than its content gives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// Name of the table.
    pub table: String,
    /// Name of the curve; none unless the table has statistics of curves.
    pub curve: Option<String>,
}

impl RowCheck {
    /// An empty database to write into.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn new() -> std::result::Result<RowCheck, StoreError> {
        let scratch = connect::in_memory()?;
        let tables =
            tables(&scratch).map_err(|error| StoreError::new(":memory:".as_ref(), error))?;
        Ok(RowCheck { scratch, tables })
    }

    /// Every table in which a revision of `store` has other rows than its content gives.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn differences(
        &mut self,
        store: &Store,
        stored: &StoredRevision,
    ) -> std::result::Result<Vec<Difference>, StoreError> {
        self.compare(&store.conn, stored).in_file(&store.path)
    }

    /// Whether the table of units is the one that this program writes.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn has_own_units(&self, store: &Store) -> std::result::Result<bool, StoreError> {
        Ok(unit_rows(&store.conn).in_file(&store.path)?
            == unit_rows(&self.scratch).in_file(&store.path)?)
    }

    /// The scratch database, which has the latest schema and no rows but units.
    pub(super) fn scratch(&self) -> &Connection {
        &self.scratch
    }

    pub(super) fn compare(
        &mut self,
        conn: &Connection,
        stored: &StoredRevision,
    ) -> Result<Vec<Difference>> {
        let tx = self.scratch.transaction()?;
        // Lists and searches are not written: `find::stale` compares them.
        write::write_alone(&tx, &stored.material)?;
        let new: i64 = tx.query_row("SELECT max(id) FROM revision", [], |row| row.get(0))?;
        let sql = "SELECT revision.id FROM revision JOIN material ON material.id = material_id
                   WHERE slug = ?1 AND number = ?2";
        let of = params![stored.material.slug.as_str(), stored.revision];
        let old: i64 = conn.query_row(sql, of, |row| row.get(0))?;
        let mut differences = Vec::new();
        for table in self.tables.iter().filter(|table| follows_from_content(table)) {
            let sql = select(table);
            let (mut old_rows, mut new_rows) = (conn.prepare(&sql)?, tx.prepare(&sql)?);
            if let Some(row) = first_difference((&mut old_rows, old), (&mut new_rows, new))? {
                let curve = row.into_iter().next().filter(|_| table.name == STATISTICS);
                differences.push(Difference { table: table.name.clone(), curve });
            }
        }
        Ok(differences)
    }
}

/// Selects all columns but `revision_id`, `curve` first.
fn select(table: &Table) -> String {
    let names = table.columns.iter().map(|column| &column.name);
    let mut names: Vec<&String> = names.filter(|name| *name != "revision_id").collect();
    names.sort_by_key(|name| *name != "curve");
    let (columns, order) = (listed(names), listed(&table.key));
    let table = quoted(&table.name);
    format!("SELECT {columns} FROM {table} WHERE revision_id = ?1 ORDER BY {order}")
}

/// The texts in the first row that differs; `None` when all rows are equal.
fn first_difference(
    (old, old_id): (&mut Statement, i64),
    (new, new_id): (&mut Statement, i64),
) -> Result<Option<Vec<String>>> {
    let columns = new.column_count();
    let (mut old, mut new) = (old.query([old_id])?, new.query([new_id])?);
    loop {
        let (old, new) = (old.next()?, new.next()?);
        let same = match (old, new) {
            (None, None) => return Ok(None),
            (Some(old), Some(new)) => (0..columns).try_fold(true, |same, column| {
                Ok::<_, rusqlite::Error>(
                    same && is_same(old.get_ref(column)?, new.get_ref(column)?),
                )
            })?,
            _ => false,
        };
        if let (false, Some(row)) = (same, old.or(new)) {
            let mut texts = Vec::new();
            for column in 0..columns {
                if let Ok(Value::Text(text)) = row.get(column) {
                    texts.push(text);
                }
            }
            return Ok(Some(texts));
        }
    }
}

fn is_same(old: ValueRef, new: ValueRef) -> bool {
    match (old, new) {
        (ValueRef::Real(old), ValueRef::Real(new)) => {
            (old - new).abs() <= ROUNDING * old.abs().max(new.abs())
        }
        (old, new) => old == new,
    }
}
