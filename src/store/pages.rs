//! Damaged pages: found before a database is used or brought up to date.

use rusqlite::{Connection, Result, Rows};

use super::error::is_damage;
use super::read::damaged;
use super::rows::rows;
use super::tables::{own_tables, quoted};

/// Largest database that is compared before it is used, bytes. To compare it takes as long as to read every row.
const MOST_COMPARED_BYTES: i64 = 8 << 20;

/// Length that a database says it has, bytes.
pub(super) fn stated_bytes(conn: &Connection) -> Result<i64> {
    let sql = "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size";
    conn.query_row(sql, [], |row| row.get(0))
}

/// Whether a database is compared before it is used.
pub(super) fn is_small(conn: &Connection) -> Result<bool> {
    Ok(stated_bytes(conn)? <= MOST_COMPARED_BYTES)
}

/// Fails where pages of a small database contradict each other, such as cells that overlap: whoever writes one of them
/// would damage what is stored beside.
pub(super) fn check_pages(conn: &Connection) -> Result<()> {
    if !is_small(conn)? {
        return Ok(());
    }
    // A text that is not JSON in a row ends a check of rows.
    conn.pragma_update(None, "ignore_check_constraints", true)?;
    let found = rows(conn, "PRAGMA quick_check", [], |row| row.get::<_, String>(0));
    conn.pragma_update(None, "ignore_check_constraints", false)?;
    let found = found?;
    // Values that contradict their column leave the pages sound, and the material can still be replaced or removed.
    let of_pages = found.iter().flat_map(|row| row.lines()).find(|line| {
        ["Tree ", "Page ", "Freelist", "Fragmentation", "Outstanding", "Main freelist"]
            .iter()
            .any(|begin| line.starts_with(begin))
            || line.contains(" never used")
            || line.contains("reference to page")
    });
    match of_pages {
        None => Ok(()),
        Some(line) => Err(damaged(line.to_owned())),
    }
}

/// The revisions with rows on damaged pages. SQLite refuses to write within a transaction that has read such a page, so
/// a migration must know them before it begins.
pub(super) fn torn_revisions(conn: &Connection) -> Result<Vec<i64>> {
    let keys = own_tables(conn)?.into_iter().filter_map(|table| {
        let key = if table.name == "revision" { "id" } else { "revision_id" };
        let has_key = table.columns.iter().any(|column| column.name == key);
        has_key.then(|| (quoted(&table.name), key))
    });
    let mut torn = Vec::new();
    for (table, key) in keys {
        let all = conn.prepare(&format!("SELECT * FROM {table}"))?.query([]).and_then(read);
        if !matches!(&all, Err(error) if is_damage(error)) {
            all?;
            continue;
        }
        let mut one = conn.prepare(&format!("SELECT * FROM {table} WHERE {key} = ?1"))?;
        for revision_id in rows(conn, "SELECT id FROM revision", [], |row| row.get::<_, i64>(0))? {
            match one.query([revision_id]).and_then(read) {
                Err(error) if is_damage(&error) => torn.push(revision_id),
                read => read?,
            }
        }
    }
    torn.sort_unstable();
    torn.dedup();
    Ok(torn)
}

/// Reads rows to the end.
fn read(mut rows: Rows) -> Result<()> {
    let columns = rows.as_ref().map_or(0, rusqlite::Statement::column_count);
    while let Some(row) = rows.next()? {
        for column in 0..columns {
            row.get_ref(column)?;
        }
    }
    Ok(())
}
