//! Small databases are looked at before they are used.

use rusqlite::{Connection, Result};

use super::read::damaged;
use super::rows::rows;

/// Largest database that is looked at, bytes. The look takes as long as reading every row.
const MOST_LOOKED_AT_BYTES: i64 = 8 << 20;

/// Whether a database is looked at before it is used.
pub(super) fn is_small(conn: &Connection) -> Result<bool> {
    let sql = "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size";
    conn.query_row(sql, [], |row| row.get::<_, i64>(0)).map(|bytes| bytes <= MOST_LOOKED_AT_BYTES)
}

/// Fails where pages of a database contradict each other, such as cells that overlap: whoever writes one of them would
/// damage what is stored beside. Databases above 8 MiB are not looked at.
pub(super) fn check_pages(conn: &Connection) -> Result<()> {
    if !is_small(conn)? {
        return Ok(());
    }
    let found = rows(conn, "PRAGMA quick_check", [], |row| row.get::<_, String>(0))?;
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
