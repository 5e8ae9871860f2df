//! Damaged pages: found before a database is used or brought up to date.

use rusqlite::Error::SqliteFailure;
use rusqlite::{Connection, ErrorCode, Result, Rows};

use super::error::is_damage;
use super::read::damaged;
use super::rows::{moment, rows};
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

/// Makes the full-text index forget what it has read before: within a check of pages it would compare that with what
/// another program has written since.
pub(super) fn renew_search(conn: &Connection) {
    // An error here is one of the check, too.
    let _ = conn.prepare("SELECT rowid FROM search LIMIT 1").and_then(|mut first| first.exists([]));
}

/// Fails where pages of a small database contradict each other, such as cells that overlap: whoever writes one of them
/// would damage what is stored next to it.
pub(super) fn check_pages(conn: &Connection) -> Result<()> {
    if !is_small(conn)? {
        return Ok(());
    }
    let _moment = moment(conn)?;
    renew_search(conn);
    // A text that is not JSON in a row ends a check of rows.
    conn.pragma_update(None, "ignore_check_constraints", true)?;
    let found = rows(conn, "PRAGMA quick_check", [], |row| row.get::<_, String>(0));
    conn.pragma_update(None, "ignore_check_constraints", false)?;
    let found = match found {
        // Something of others that only their program can read.
        Err(SqliteFailure(failure, _)) if failure.code == ErrorCode::Unknown => return Ok(()),
        found => found?,
    };
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
    let mut torn = Vec::new();
    for (rows_of, key) in trees(conn)? {
        let all = conn.prepare(&rows_of)?.query([]).and_then(read);
        if !matches!(&all, Err(error) if is_damage(error)) {
            all?;
            continue;
        }
        let mut one = conn.prepare(&format!("{rows_of} WHERE {key} = ?1"))?;
        let all = "SELECT id FROM revision NOT INDEXED";
        for revision_id in rows(conn, all, [], |row| row.get::<_, i64>(0))? {
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

/// Queries that read the tables of revisions and their indexes from end to end, each with the column of a revision's row
/// number.
fn trees(conn: &Connection) -> Result<Vec<(String, &'static str)>> {
    let mut trees = Vec::new();
    for table in own_tables(conn)? {
        let key = if table.name == "revision" { "id" } else { "revision_id" };
        if !table.columns.iter().any(|column| column.name == key) {
            continue;
        }
        let name = quoted(&table.name);
        trees.push((format!("SELECT * FROM {name} NOT INDEXED"), key));
        let sql = "SELECT list.name FROM pragma_index_list(?1) AS list JOIN pragma_index_info(list.name) AS first
                   WHERE list.origin <> 'pk' AND seqno = 0 AND first.name = ?2";
        let indexes: Vec<String> = rows(conn, sql, [table.name.as_str(), key], |row| row.get(0))?;
        trees.extend(
            indexes.iter().map(|index| {
                (format!("SELECT {key} FROM {name} INDEXED BY {}", quoted(index)), key)
            }),
        );
    }
    Ok(trees)
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
