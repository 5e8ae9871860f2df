//! Rows that belong to no material: a lost revision leaves them behind.

use rusqlite::{Connection, Result};

use super::tables::{own_tables, quoted};

/// Revisions of no material. Those of a material that is still in a list are not among them: its row can come back.
const REVISIONS: &str = "material_id NOT IN (SELECT id FROM material)
                         AND material_id NOT IN (SELECT material_id FROM entry)";

/// The condition of each table under which one of its rows belongs to no material.
fn conditions(conn: &Connection) -> Result<Vec<(String, String)>> {
    let of_lost = format!(
        "revision_id NOT IN (SELECT id FROM revision)
         OR revision_id IN (SELECT id FROM revision WHERE {REVISIONS})"
    );
    let tables = own_tables(conn)?.into_iter();
    let has_revision = |columns: &[super::Column]| columns.iter().any(|c| c.name == "revision_id");
    let conditions = tables
        .filter(|table| has_revision(&table.columns))
        .map(|table| (quoted(&table.name), of_lost.clone()));
    Ok(conditions.chain([("revision".to_owned(), REVISIONS.to_owned())]).collect())
}

/// Number of rows that belong to no material. No command reads them, and a new revision could take their number.
pub(super) fn count(conn: &Connection) -> Result<u64> {
    let mut rows = 0;
    for (table, condition) in conditions(conn)? {
        let sql = format!("SELECT count(*) FROM {table} WHERE {condition}");
        rows += conn.query_row(&sql, [], |row| row.get::<_, i64>(0))?.unsigned_abs();
    }
    Ok(rows)
}

/// Removes them. What they say is in no other row.
pub(super) fn remove(conn: &Connection) -> Result<()> {
    conn.pragma_update(None, "defer_foreign_keys", true)?;
    for (table, condition) in conditions(conn)? {
        conn.execute(&format!("DELETE FROM {table} WHERE {condition}"), [])?;
    }
    Ok(())
}
