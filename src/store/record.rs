//! The record of a revision: what the hash of its content does not cover. It has four parts with a hash each, so that
//! damage of one part leaves the others.

use rusqlite::{Connection, Error, OptionalExtension, Result, Row, Transaction, params};
use serde::Serialize;

use super::error::is_damage;
use super::read::{command, damaged, origin};
use super::rows::rows;
use crate::material::Slug;

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
        let hash = match self {
            Part::Number => {
                let sql = "SELECT slug, number, content_hash
                           FROM revision JOIN material ON material.id = material_id
                           WHERE revision.id = ?1";
                let read = |row: &Row| -> Result<(String, u32, String)> {
                    Ok((row.get(0)?, row.get(1)?, row.get(2)?))
                };
                conn.prepare_cached(sql)?.query_row([revision_id], read).map(|row| hash_of(&row))
            }
            Part::Date => {
                let sql = "SELECT added_at, program_version FROM revision WHERE id = ?1";
                let read =
                    |row: &Row| -> Result<(String, String)> { Ok((row.get(0)?, row.get(1)?)) };
                conn.prepare_cached(sql)?.query_row([revision_id], read).map(|row| hash_of(&row))
            }
            Part::Command => command(conn, revision_id).map(|made| hash_of(&made)),
            Part::Origin => origin(conn, revision_id).map(|made| hash_of(&made)),
        };
        hash.map_err(|error| match error {
            // An index has a revision that is not there.
            Error::QueryReturnedNoRows => damaged("the row of a revision is not there".to_owned()),
            error => error,
        })
    }
}

/// BLAKE3 of a value's JSON.
fn hash_of(value: &impl Serialize) -> String {
    // Serialising plain values into memory has no way to fail.
    blake3::hash(&serde_json::to_vec(value).unwrap_or_default()).to_hex().to_string()
}

/// The parts that are not as they were stored, of what is called this revision of this material.
pub(super) fn changed(
    conn: &Connection,
    revision_id: i64,
    slug: &Slug,
    number: u32,
) -> Result<Vec<Part>> {
    let sql = "SELECT number_hash, date_hash, command_hash, origin_hash FROM record
               WHERE revision_id = ?1";
    let read = |row: &Row| -> Result<[Option<String>; 4]> {
        Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?])
    };
    let stored = conn.prepare_cached(sql)?.query_row([revision_id], read).optional()?;
    let mut changed = Vec::new();
    for (part, stored) in PARTS.into_iter().zip(stored.unwrap_or_default()) {
        let now = part.hash(conn, revision_id);
        match now {
            Ok(now) if stored.as_ref() == Some(&now) => {}
            Err(error) if !is_damage(&error) => return Err(error),
            _ => changed.push(part),
        }
    }
    // An index may have this name and number for the row of another revision.
    let sql =
        "SELECT slug = ?2 AND number = ?3 FROM revision JOIN material ON material.id = material_id
               WHERE revision.id = ?1";
    let values = params![revision_id, slug.as_str(), number];
    let is_named = conn.prepare_cached(sql)?.query_row(values, |row| row.get(0)).optional()?;
    if is_named != Some(true) && !changed.contains(&Part::Number) {
        changed.insert(0, Part::Number);
    }
    Ok(changed)
}

/// Whether a revision has the name, number and content hash with which it was stored.
pub(super) fn has_its_number(
    conn: &Connection,
    revision_id: i64,
    slug: &Slug,
    number: u32,
) -> Result<bool> {
    Ok(!changed(conn, revision_id, slug, number)?.contains(&Part::Number))
}

/// Fails where the record of a revision is not what was stored.
pub(super) fn check(conn: &Connection, revision_id: i64, slug: &Slug, number: u32) -> Result<()> {
    match changed(conn, revision_id, slug, number)?.as_slice() {
        [] => Ok(()),
        [Part::Number, ..] if !has_record(conn, revision_id)? => Err(damaged(format!(
            "the record of revision {number} of `{slug}` is lost, and with it the proof of its name and number"
        ))),
        changed => Err(damaged(format!(
            "revision {number} of `{slug}` has another {} than was stored",
            listed(changed)
        ))),
    }
}

fn has_record(conn: &Connection, revision_id: i64) -> Result<bool> {
    let sql = "SELECT EXISTS (SELECT 1 FROM record WHERE revision_id = ?1)";
    conn.query_row(sql, [revision_id], |row| row.get(0))
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

/// Stores the hashes of all records, for a file from an older program. Numbers get one where nothing contradicts them:
/// they are not above that of the current revision, and rise from one revision of the material to the next. Of revisions
/// on damaged pages, `torn`, nothing but the number is read.
pub(super) fn fill(tx: &Transaction, torn: &[i64]) -> Result<()> {
    // Without an index: a damaged one hides revisions, or has some that are not there.
    let sql = "SELECT material_id, revision.id, number, current_revision
               FROM revision NOT INDEXED JOIN material ON material.id = material_id
               WHERE revision.id NOT IN (SELECT revision_id FROM record)
               ORDER BY material_id, revision.id";
    let revisions: Vec<(i64, i64, u32, u32)> =
        rows(tx, sql, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)))?;
    for of_one in revisions.chunk_by(|a, b| a.0 == b.0) {
        let numbers = of_one.iter().filter(|(_, _, number, current)| number <= current);
        let is_rising = numbers.is_sorted_by(|(_, _, a, _), (_, _, b, _)| a < b);
        for (_, revision_id, number, current) in of_one {
            let first = usize::from(!(is_rising && number <= current));
            let end = if torn.contains(revision_id) { 1 } else { PARTS.len() };
            write_parts(tx, *revision_id, PARTS.get(first..end).unwrap_or_default())?;
        }
    }
    Ok(())
}
