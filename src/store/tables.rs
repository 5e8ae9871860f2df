//! The database as plain tables, for exports of any schema.

use rusqlite::types::ValueRef;
use rusqlite::{Connection, Result};

use super::database::Store;
use super::error::{InFile, StoreError};
use super::latest::LATEST_SCHEMA;
use super::law;
use super::rows::rows;

/// A table of the database.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// Its name.
    pub name: String,
    /// Its columns, in order.
    pub columns: Vec<Column>,
    /// Names of the key columns, by which rows are sorted.
    pub key: Vec<String>,
    /// References to other tables.
    pub references: Vec<Reference>,
}

/// A column of a [`Table`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name, which ends in the unit where there is one.
    pub name: String,
    /// What it holds.
    pub kind: ColumnKind,
    /// Whether every row has a value.
    pub required: bool,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ColumnKind {
    /// Whole numbers.
    Integer,
    /// Numbers.
    Real,
    /// Text.
    Text,
}

/// Columns that name a row of another table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reference {
    /// The columns here.
    pub columns: Vec<String>,
    /// The other table.
    pub table: String,
    /// The columns there.
    pub keys: Vec<String>,
}

/// A cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Cell<'a> {
    /// No value.
    Null,
    /// A whole number.
    Integer(i64),
    /// A number.
    Real(f64),
    /// A text.
    Text(&'a str),
}

impl Store {
    /// Every table that holds materials, sorted by name. Indexes are left out, both those of SQLite and those of
    /// the program, such as [`Store::outlines`]. The view `fit_estimate` replaces the table that it is made of.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn tables(&self) -> Result<Vec<Table>, StoreError> {
        readable_tables(&self.conn).in_file(&self.path)
    }

    /// Gives every row of a table to `take`, in the order of the table's key, one at a time. The model of a fit
    /// comes with the values of its parameters.
    ///
    /// # Errors
    /// When the file cannot be read, and the first of `take`.
    pub fn rows<E: From<StoreError>>(
        &self,
        table: &Table,
        mut take: impl FnMut(&[Cell]) -> Result<(), E>,
    ) -> Result<(), E> {
        let sql = select(table);
        let mut statement = self.conn.prepare(&sql).in_file(&self.path)?;
        let mut rows = statement.query([]).in_file(&self.path)?;
        while let Some(row) = rows.next().in_file(&self.path)? {
            let cells: Result<Vec<Cell>> =
                (0..table.columns.len()).map(|index| cell(row.get_ref(index)?)).collect();
            let mut cells = cells.in_file(&self.path)?;
            let model = model(&self.conn, table, &cells).in_file(&self.path)?;
            if let Some((place, model)) = &model {
                cells[*place] = Cell::Text(model);
            }
            take(&cells)?;
        }
        Ok(())
    }
}

/// Kind, name, table and statement of everything in the file.
pub(super) fn schema(conn: &Connection) -> Result<Vec<[Option<String>; 4]>> {
    // Tables of ANALYZE help to find rows and have no content; that of AUTOINCREMENT is of a table of others.
    let sql = "SELECT type, name, tbl_name, sql FROM sqlite_schema
               WHERE name NOT LIKE 'sqlite\\_stat%' ESCAPE '\\' AND name <> 'sqlite_sequence'
               ORDER BY type, name";
    conn.prepare(sql)?
        .query_map([], |row| Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?]))?
        .collect()
}

pub(super) fn tables(conn: &Connection) -> Result<Vec<Table>> {
    let sql = "SELECT name FROM pragma_table_list
               WHERE schema = 'main' AND type = 'table' AND name NOT LIKE 'sqlite\\_%' ESCAPE '\\'
               AND name <> 'outline' ORDER BY name";
    let names: Vec<String> =
        conn.prepare(sql)?.query_map([], |row| row.get(0))?.collect::<Result<_>>()?;
    names.into_iter().map(|name| table(conn, name)).collect()
}

/// The tables with `fit_estimate` in the place of `fit_number`.
fn readable_tables(conn: &Connection) -> Result<Vec<Table>> {
    let mut tables = tables(conn)?;
    for numbers in tables.iter_mut().filter(|table| table.name == "fit_number") {
        let mut estimates = table(conn, "fit_estimate".to_owned())?;
        for column in &mut estimates.columns {
            column.required = !["sd", "low_95", "high_95"].contains(&column.name.as_str());
        }
        // SQLite does not say this of a view.
        estimates.key.clone_from(&numbers.key);
        estimates.references.clone_from(&numbers.references);
        *numbers = estimates;
    }
    Ok(tables)
}

/// The model of a row of `fit` as JSON with the values of its parameters, and the place of its column; `None` for
/// other tables.
fn model(conn: &Connection, table: &Table, cells: &[Cell]) -> Result<Option<(usize, String)>> {
    if table.name != "fit" {
        return Ok(None);
    }
    let places = ["revision_id", "name", "model"]
        .map(|name| table.columns.iter().position(|column| column.name == name));
    let [Some(revision_id), Some(name), Some(model)] = places else { return Ok(None) };
    match (cells[revision_id], cells[name], cells[model]) {
        (Cell::Integer(revision_id), Cell::Text(fit), Cell::Text(structure)) => {
            let (law, _) = law::read(conn, revision_id, fit, structure)?;
            Ok(Some((model, law::text(&law)?)))
        }
        _ => Ok(None),
    }
}

fn table(conn: &Connection, name: String) -> Result<Table> {
    let sql =
        "SELECT name, type, \"notnull\" OR pk > 0, pk FROM pragma_table_info(?1) ORDER BY cid";
    let columns: Vec<(Column, i64)> = conn
        .prepare(sql)?
        .query_map([&name], |row| {
            let kind = match row.get::<_, String>(1)?.as_str() {
                "INTEGER" | "INT" => ColumnKind::Integer,
                "REAL" => ColumnKind::Real,
                _ => ColumnKind::Text,
            };
            Ok((Column { name: row.get(0)?, kind, required: row.get(2)? }, row.get(3)?))
        })?
        .collect::<Result<_>>()?;
    let mut key: Vec<(i64, String)> =
        columns.iter().filter(|(_, pk)| *pk > 0).map(|(c, pk)| (*pk, c.name.clone())).collect();
    key.sort();
    let references = references(conn, &name)?;
    let columns = columns.into_iter().map(|(column, _)| column).collect();
    Ok(Table { name, columns, key: key.into_iter().map(|(_, name)| name).collect(), references })
}

fn references(conn: &Connection, table: &str) -> Result<Vec<Reference>> {
    // A reference without a column means the key of that table.
    let sql = "SELECT id, \"table\", \"from\", coalesce(\"to\", 'id')
               FROM pragma_foreign_key_list(?1) ORDER BY id DESC, seq";
    let mut statement = conn.prepare(sql)?;
    let mut rows = statement.query([table])?;
    let mut found: Vec<(i64, Reference)> = Vec::new();
    while let Some(row) = rows.next()? {
        let (id, table, from, to): (i64, String, String, String) =
            (row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?);
        match found.last_mut() {
            Some((last, reference)) if *last == id => {
                reference.columns.push(from);
                reference.keys.push(to);
            }
            _ => found.push((id, Reference { columns: vec![from], table, keys: vec![to] })),
        }
    }
    Ok(found.into_iter().map(|(_, reference)| reference).collect())
}

fn select(table: &Table) -> String {
    let columns = listed(table.columns.iter().map(|column| &column.name));
    let order = if table.key.is_empty() { "rowid".to_owned() } else { listed(&table.key) };
    format!("SELECT {columns} FROM {} ORDER BY {order}", quoted(&table.name))
}

/// Names in a statement, in quotes and with commas between.
pub(super) fn listed<'a>(names: impl IntoIterator<Item = &'a String>) -> String {
    names.into_iter().map(|name| quoted(name)).collect::<Vec<_>>().join(", ")
}

/// A name in a statement.
pub(super) fn quoted(name: &str) -> String {
    format!("\"{}\"", name.replace('"', "\"\""))
}

/// Tables of a revision that do not follow from its content: what made it, and the hashes of that.
pub(super) const MAKING: [&str; 5] =
    ["record", "activity", "activity_input", "origin", "origin_author"];

/// The tables that this program makes. Those of others are left alone.
pub(super) fn own_tables(conn: &Connection) -> Result<Vec<Table>> {
    let mut tables = tables(conn)?;
    tables.retain(|table| LATEST_SCHEMA.contains(&format!("CREATE TABLE {} (", table.name)));
    Ok(tables)
}

/// Whether every row of a table follows from the content of a revision.
pub(super) fn follows_from_content(table: &Table) -> bool {
    table.columns.iter().any(|column| column.name == "revision_id")
        && !MAKING.contains(&table.name.as_str())
}

/// Column, UCUM code and meaning of every unit.
pub(super) fn unit_rows(conn: &Connection) -> Result<Vec<[Option<String>; 3]>> {
    let sql = "SELECT column_name, ucum, meaning FROM unit ORDER BY column_name";
    rows(conn, sql, [], |row| Ok([row.get(0)?, row.get(1)?, row.get(2)?]))
}

fn cell(value: ValueRef) -> Result<Cell> {
    Ok(match value {
        ValueRef::Null => Cell::Null,
        ValueRef::Integer(number) => Cell::Integer(number),
        // A table has no −0, but JSON may.
        ValueRef::Real(number) => Cell::Real(number + 0.0),
        ValueRef::Text(_) => Cell::Text(value.as_str()?),
        ValueRef::Blob(_) => {
            return Err(rusqlite::Error::InvalidColumnType(
                0,
                "cell".to_owned(),
                value.data_type(),
            ));
        }
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::material::builtin;

    fn filled(path: &Path) -> Store {
        let mut store = Store::open(path).unwrap();
        let materials: Vec<_> =
            builtin::names().map(|name| builtin::get(name).unwrap().unwrap()).collect();
        store.add(&materials).unwrap();
        store
    }

    #[test]
    fn every_table_is_listed_with_its_columns_and_gives_its_rows_in_order() {
        let folder = tempfile::tempdir().unwrap();
        let store = filled(&folder.path().join("a.sqlite"));
        let tables = store.tables().unwrap();
        let observation = tables.iter().find(|table| table.name == "observation").unwrap();
        assert_eq!(observation.key, ["revision_id", "curve", "position"]);
        let sigma0 = observation.columns.iter().find(|c| c.name == "sigma0").unwrap();
        assert_eq!((sigma0.kind, sigma0.required), (ColumnKind::Real, false));
        assert_eq!(observation.references[0].keys, ["revision_id", "name"]);
        let material = tables.iter().find(|table| table.name == "material").unwrap();
        let mut ids = Vec::new();
        let mut take = |cells: &[Cell]| -> Result<(), StoreError> {
            assert_eq!(cells.len(), material.columns.len());
            ids.push(match cells[0] {
                Cell::Integer(id) => id,
                _ => panic!("{cells:?}"),
            });
            Ok(())
        };
        store.rows(material, &mut take).unwrap();
        assert_eq!(ids, (1..=builtin::names().count() as i64).collect::<Vec<_>>());
    }

    #[test]
    fn the_model_of_a_fit_has_its_values_in_whatever_order_the_columns_are() {
        let folder = tempfile::tempdir().unwrap();
        let store = filled(&folder.path().join("a.sqlite"));
        let mut table = table(&store.conn, "fit".to_owned()).unwrap();
        table.columns.reverse();
        let model = table.columns.iter().position(|column| column.name == "model").unwrap();
        let take = |cells: &[Cell]| -> Result<(), StoreError> {
            let Cell::Text(text) = cells[model] else { panic!("{cells:?}") };
            serde_json::from_str::<crate::brdf::Brdf>(text).unwrap();
            Ok(())
        };
        store.rows(&table, take).unwrap();
    }

    #[test]
    fn a_copy_has_no_log_holds_the_same_and_is_the_same_again() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sqlite");
        let copies = ["b", "c", "d"].map(|name| folder.path().join(name));
        let store = filled(&path);
        store.copy_to(&copies[0]).unwrap();
        drop(store);
        let reader = Store::open_existing(&path).unwrap().unwrap();
        reader.copy_to(&copies[1]).unwrap();
        assert!(reader.copy_to(&copies[1]).is_err(), "nothing is written over");
        let copy = Store::open_existing(&copies[1]).unwrap().unwrap();
        assert_eq!(copy.list().unwrap(), reader.list().unwrap());
        copy.copy_to(&copies[2]).unwrap();
        let bytes = copies.map(|path| std::fs::read(path).unwrap());
        assert_eq!(bytes[0], bytes[1]);
        let log_version = [bytes[0][18], bytes[0][19]];
        assert_eq!(log_version, [1, 1], "the file format without a log");
        assert!(!folder.path().join("c-wal").exists());
    }

    #[test]
    fn a_stranger_among_the_tables_is_seen() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.sqlite");
        let store = filled(&path);
        store.conn.execute_batch("ANALYZE").unwrap();
        assert!(store.has_own_schema().unwrap());
        store.conn.execute_batch("CREATE VIEW more AS SELECT 1").unwrap();
        assert!(!store.has_own_schema().unwrap());
        assert_eq!(store.changed_schema().unwrap(), Vec::<String>::new());
        let added = "view more was not made by matdb: DROP view more removes it";
        assert_eq!(store.added_objects().unwrap(), [added]);
    }
}
