//! The record of a revision: what the hash of its content does not cover. It has four parts with a hash each, so that
//! damage of one part leaves the others.

use rusqlite::{Connection, OptionalExtension, Result, Transaction, params};
use serde::Serialize;

use super::error::is_damage;
use super::read::{command, damaged, origin};
use super::rows::rows;
use super::tables::MAKING;
use super::write::Rows;
use crate::material::{Activity, Slug};

/// A part of a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Name of the material, number and content hash.
    Number,
    /// Date and program version.
    Date,
    /// Command and its inputs.
    Command,
    /// The catalogue from which it was imported.
    Origin,
}

/// All parts, in the order of their columns.
const PARTS: [Part; 4] = [Part::Number, Part::Date, Part::Command, Part::Origin];

impl Part {
    pub fn words(self) -> &'static str {
        match self {
            Part::Number => "name or number",
            Part::Date => "date or program",
            Part::Command => "command or input",
            Part::Origin => "origin",
        }
    }

    /// Hash of the part as it is. New fields must leave the JSON of older values as it is: files have its hash.
    fn hash(self, conn: &Connection, revision_id: i64) -> Result<String> {
        match self {
            Part::Number => {
                let sql = "SELECT slug, number, content_hash
                           FROM revision JOIN material ON material.id = material_id
                           WHERE revision.id = ?1";
                let read = |row: &rusqlite::Row| -> Result<(String, u32, String)> {
                    Ok((row.get(0)?, row.get(1)?, row.get(2)?))
                };
                Ok(hash_of(&conn.prepare_cached(sql)?.query_row([revision_id], read)?))
            }
            Part::Date => {
                let sql = "SELECT added_at, program_version FROM revision WHERE id = ?1";
                let read = |row: &rusqlite::Row| -> Result<(String, String)> {
                    Ok((row.get(0)?, row.get(1)?))
                };
                Ok(hash_of(&conn.prepare_cached(sql)?.query_row([revision_id], read)?))
            }
            Part::Command => command(conn, revision_id).map(|made| hash_of(&made)),
            Part::Origin => origin(conn, revision_id).map(|made| hash_of(&made)),
        }
    }
}

/// BLAKE3 of a value's JSON.
fn hash_of(value: &impl Serialize) -> String {
    // Serialising plain values into memory has no way to fail.
    blake3::hash(&serde_json::to_vec(value).unwrap_or_default()).to_hex().to_string()
}

/// The parts that are not as they were stored.
pub(super) fn changed(conn: &Connection, revision_id: i64) -> Result<Vec<Part>> {
    let sql = "SELECT number_hash, date_hash, command_hash, origin_hash FROM record
               WHERE revision_id = ?1";
    let read = |row: &rusqlite::Row| -> Result<[Option<String>; 4]> {
        Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?])
    };
    let stored = conn.prepare_cached(sql)?.query_row([revision_id], read).optional()?;
    let mut changed = Vec::new();
    for (part, stored) in PARTS.into_iter().zip(stored.unwrap_or_default()) {
        match part.hash(conn, revision_id) {
            Ok(now) if stored.as_ref() == Some(&now) => {}
            Err(error) if !is_damage(&error) => return Err(error),
            _ => changed.push(part),
        }
    }
    Ok(changed)
}

/// Whether a revision has the name, number and content hash with which it was stored.
pub(super) fn has_its_number(conn: &Connection, revision_id: i64) -> Result<bool> {
    Ok(!changed(conn, revision_id)?.contains(&Part::Number))
}

/// Fails where the record of a revision is not what was stored.
pub(super) fn check(conn: &Connection, revision_id: i64, slug: &Slug, number: u32) -> Result<()> {
    match changed(conn, revision_id)?.as_slice() {
        [] => Ok(()),
        changed => Err(damaged(format!(
            "revision {number} of `{slug}` has another {} than was stored",
            listed(changed)
        ))),
    }
}

/// Parts in words.
pub(super) fn listed(parts: &[Part]) -> String {
    parts.iter().map(|part| part.words()).collect::<Vec<_>>().join(", ")
}

/// Stores the hashes of the record that a revision has. A damaged part gets none.
pub(super) fn write(tx: &Transaction, revision_id: i64) -> Result<()> {
    write_parts(tx, revision_id, &PARTS)
}

fn write_parts(tx: &Transaction, revision_id: i64, parts: &[Part]) -> Result<()> {
    let mut hashes: [Option<String>; 4] = Default::default();
    for (part, hash) in PARTS.into_iter().zip(&mut hashes).filter(|(part, _)| parts.contains(part))
    {
        *hash = match part.hash(tx, revision_id) {
            Err(error) if is_damage(&error) => None,
            now => Some(now?),
        };
    }
    let [number, date, command, origin] = hashes;
    let sql = "INSERT OR REPLACE INTO record
               (revision_id, number_hash, date_hash, command_hash, origin_hash)
               VALUES (?1, ?2, ?3, ?4, ?5)";
    let values = params![revision_id, number, date, command, origin];
    tx.prepare_cached(sql)?.execute(values).map(|_| ())
}

/// Stores the hashes of all records, for a file from an older program. A number gets one where nothing contradicts it:
/// it is not above that of the current revision, and later revisions have greater numbers. Of revisions on damaged
/// pages, `torn`, nothing but the number is read.
pub(super) fn fill(tx: &Transaction, torn: &[i64]) -> Result<()> {
    let sql = "
        SELECT own.id, own.number <= current_revision AND NOT EXISTS (
            SELECT 1 FROM revision AS other
            WHERE other.material_id = own.material_id AND other.number <= current_revision
            AND (other.id < own.id) <> (other.number < own.number) AND other.id <> own.id)
        FROM revision AS own JOIN material ON material.id = own.material_id
        WHERE own.id NOT IN (SELECT revision_id FROM record)";
    let revisions: Vec<(i64, bool)> = rows(tx, sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
    for (revision_id, has_number) in revisions {
        let first = usize::from(!has_number);
        let end = if torn.contains(&revision_id) { 1 } else { PARTS.len() };
        write_parts(tx, revision_id, PARTS.get(first..end).unwrap_or_default())?;
    }
    Ok(())
}

/// Replaces the damaged parts of a record: the command and the origin by those of `by`, the date and the program by
/// today's. Returns the parts.
///
/// Fails where the revision has another name or number than was stored: then it must not be taken for what it is
/// called.
pub(super) fn restore(
    tx: &Transaction,
    revision_id: i64,
    by: Option<&Activity>,
) -> Result<Vec<Part>> {
    let changed = changed(tx, revision_id)?;
    if changed.contains(&Part::Number) {
        return Err(damaged("it has another name or number than was stored".to_owned()));
    }
    if changed.is_empty() {
        return Ok(changed);
    }
    let made = if changed.contains(&Part::Command) {
        by.map(|by| (by.command.clone(), by.inputs.clone()))
    } else {
        command(tx, revision_id)?
    };
    let from = if changed.contains(&Part::Origin) {
        by.and_then(|by| by.origin.clone())
    } else {
        origin(tx, revision_id)?
    };
    for table in MAKING.iter().rev() {
        tx.execute(&format!("DELETE FROM {table} WHERE revision_id = ?1"), [revision_id])?;
    }
    // An origin belongs to a command.
    let made = made.or_else(|| from.is_some().then(|| ("add".to_owned(), Vec::new())));
    if let Some((command, inputs)) = made {
        Rows { tx, revision_id }.activity(&Activity { command, inputs, origin: from })?;
    }
    if changed.contains(&Part::Date) {
        let sql = "UPDATE revision SET program_version = ?2,
                       added_at = coalesce(strftime('%Y-%m-%dT%H:%M:%SZ', 'now'), '9999-12-31T23:59:59Z')
                   WHERE id = ?1";
        tx.execute(sql, params![revision_id, env!("CARGO_PKG_VERSION")])?;
    }
    write(tx, revision_id)?;
    Ok(changed)
}
