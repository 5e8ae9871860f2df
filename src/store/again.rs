//! Writing a revision again, into a scratch database: every row that follows from its content must equal the stored
//! one. The content itself is checked by its hash.

use rusqlite::types::{Value, ValueRef};
use rusqlite::{Connection, Result, Statement, params};

use super::database::Store;
use super::error::{InFile, StoreError};
use super::record::Stored;
use super::tables::{
    Table, follows_from_content, has_statistics, listed, quoted, tables, unit_rows,
};
use super::{connect, write};

/// The table of which an older program wrote nothing.
const STATISTICS: &str = "curve_statistic";
/// What a sum may differ by on another machine, relative.
const ROUNDING: f64 = 1e-9;

/// Writes revisions again, into a database of its own.
#[derive(Debug)]
pub struct Again {
    scratch: Connection,
    tables: Vec<Table>,
}

/// Rows of a revision that are not what its content gives.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The table.
    pub table: String,
    /// The curve, where the table has statistics of curves.
    pub curve: Option<String>,
}

impl Again {
    /// An empty database to write into.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn new() -> std::result::Result<Again, StoreError> {
        let scratch = connect::in_memory()?;
        let tables =
            tables(&scratch).map_err(|error| StoreError::new(":memory:".as_ref(), error))?;
        Ok(Again { scratch, tables })
    }

    /// Rows of a revision of `store` that differ from what its content gives, the first of each table.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn differences(
        &mut self,
        store: &Store,
        stored: &Stored,
    ) -> std::result::Result<Vec<Difference>, StoreError> {
        self.compare(&store.conn, stored).in_file(&store.path)
    }

    /// Whether the file has the units that the program would write.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn has_own_units(&self, store: &Store) -> std::result::Result<bool, StoreError> {
        Ok(unit_rows(&store.conn).in_file(&store.path)?
            == unit_rows(&self.scratch).in_file(&store.path)?)
    }

    /// The database that revisions are written into, empty between two of them.
    pub(super) fn scratch(&self) -> &Connection {
        &self.scratch
    }

    pub(super) fn compare(
        &mut self,
        conn: &Connection,
        stored: &Stored,
    ) -> Result<Vec<Difference>> {
        let tx = self.scratch.transaction()?;
        // What it would be found by is compared elsewhere, and is not made.
        write::write_alone(&tx, &stored.material)?;
        let new: i64 = tx.query_row("SELECT max(id) FROM revision", [], |row| row.get(0))?;
        let sql = "SELECT revision.id FROM revision JOIN material ON material.id = material_id
                   WHERE slug = ?1 AND number = ?2";
        let of = params![stored.material.slug.as_str(), stored.revision];
        let old: i64 = conn.query_row(sql, of, |row| row.get(0))?;
        let mut differences = Vec::new();
        for table in self.tables.iter().filter(|table| follows_from_content(table)) {
            if table.name == STATISTICS && !has_statistics(conn, old)? {
                continue;
            }
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

/// Everything but the number of the revision, that of a curve first.
fn select(table: &Table) -> String {
    let names = table.columns.iter().map(|column| &column.name);
    let mut names: Vec<&String> = names.filter(|name| *name != "revision_id").collect();
    names.sort_by_key(|name| *name != "curve");
    let (columns, order) = (listed(names), listed(&table.key));
    let table = quoted(&table.name);
    format!("SELECT {columns} FROM {table} WHERE revision_id = ?1 ORDER BY {order}")
}

/// The texts of the first row that differs.
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
