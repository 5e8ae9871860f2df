//! Finds damage of a database file.

use rusqlite::{Connection, Result};

use super::error::{is_damage, reason};
use super::find::stale;
use super::rows::rows;

/// Every problem of a file as a sentence: damaged pages, references to missing rows, and rows of lists and searches
/// that differ from their material.
pub(super) fn damage(conn: &Connection) -> Result<Vec<String>> {
    let found = match rows(conn, "PRAGMA integrity_check", [], |row| row.get::<_, String>(0)) {
        // It evaluates the CHECK of every row, and a text that is not JSON ends it.
        Err(error) if is_damage(&error) => {
            vec![format!("pages and rows cannot be checked to the end: {}", reason(&error))]
        }
        found => found?,
    };
    let dangling = rows(conn, "PRAGMA foreign_key_check", [], |row| {
        let (table, parent): (String, String) = (row.get(0)?, row.get(2)?);
        Ok(format!("a row of `{table}` refers to a row of `{parent}` that is not there"))
    });
    let dangling = match dangling {
        Err(error) if is_damage(&error) => {
            vec![format!("references cannot be checked to the end: {}", reason(&error))]
        }
        dangling => dangling?,
    };
    let problems: Vec<String> =
        found.into_iter().filter(|line| line != "ok").chain(dangling).collect();
    if !problems.is_empty() {
        return Ok(problems);
    }
    let stale = stale(conn)?.into_iter();
    Ok(stale
        .map(|slug| format!("what lists and searches say of `{slug}` is not what is stored"))
        .collect())
}
