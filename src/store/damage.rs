//! Finds damage of a database file.

use rusqlite::{Connection, Result};

use super::error::{is_damage, reason};
use super::find::stale::{problem, stale};
use super::pages::renew_search;
use super::read::not_latest;
use super::rows::{moment, rows};

/// Every problem of a file as a sentence: damaged pages, references to missing rows, current revisions that are not the
/// latest, and rows of lists and searches that differ from their material.
pub(super) fn damage(conn: &Connection) -> Result<Vec<String>> {
    let _moment = moment(conn)?;
    renew_search(conn);
    let found = match rows(conn, "PRAGMA integrity_check", [], |row| row.get::<_, String>(0)) {
        // It evaluates the CHECK of every row, and a text that is not JSON ends it.
        Err(error) if is_damage(&error) => {
            vec![format!("pages and rows cannot be checked to the end: {}", reason(&error))]
        }
        found => found?,
    };
    let dangling = match dangling(conn) {
        Err(error) if is_damage(&error) => {
            vec![format!("references cannot be checked to the end: {}", reason(&error))]
        }
        dangling => dangling?,
    };
    // One row may be several problems, below a line with the name of the database.
    let lines = found.iter().flat_map(|row| row.lines());
    let lines = lines.filter(|line| *line != "ok" && !line.starts_with("*** in database"));
    let problems: Vec<String> = lines.map(str::to_owned).chain(dangling).collect();
    if !problems.is_empty() {
        return Ok(problems);
    }
    let sql = "SELECT slug, current_revision, max(number)
               FROM material JOIN revision ON material_id = material.id GROUP BY material.id
               HAVING current_revision <> max(number) ORDER BY slug";
    let mut problems = rows(conn, sql, [], |row| {
        let (slug, current, latest): (String, u32, u32) = (row.get(0)?, row.get(1)?, row.get(2)?);
        Ok(not_latest(&slug, current, latest))
    })?;
    problems.extend(stale(conn)?.iter().map(|slug| problem(slug)));
    Ok(problems)
}

/// Rows that refer to others that are not there, a sentence for each pair of tables and for each material.
fn dangling(conn: &Connection) -> Result<Vec<String>> {
    let sql = "SELECT slug, current_revision FROM material AS own WHERE NOT EXISTS
                   (SELECT 1 FROM revision WHERE material_id = own.id AND number = current_revision)
               ORDER BY slug";
    let mut found = rows(conn, sql, [], |row| {
        let (slug, number): (String, u32) = (row.get(0)?, row.get(1)?);
        Ok(format!("`{slug}` is there, but its revision {number} is not"))
    })?;
    let pairs = rows(conn, "PRAGMA foreign_key_check", [], |row| {
        let (table, parent): (String, String) = (row.get(0)?, row.get(2)?);
        Ok(format!("rows of `{table}` refer to rows of `{parent}` that are not there"))
    })?;
    for pair in pairs {
        // Materials have been named.
        if !found.contains(&pair) && !pair.starts_with("rows of `material` refer") {
            found.push(pair);
        }
    }
    Ok(found)
}

/// Materials with fewer revisions than the greatest number says, as a sentence each.
pub(super) fn lost_revisions(conn: &Connection) -> Result<Vec<String>> {
    let sql = "SELECT slug, count(*), max(number)
               FROM material JOIN revision ON material_id = material.id GROUP BY material.id
               HAVING count(*) < max(number) ORDER BY slug";
    rows(conn, sql, [], |row| {
        let (slug, left, latest): (String, u32, u32) = (row.get(0)?, row.get(1)?, row.get(2)?);
        Ok(format!("`{slug}` has revisions up to {latest}, of which {left} are stored"))
    })
}
