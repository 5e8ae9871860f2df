//! Finds materials: filters, full-text search, and the rows of lists.

mod filter;
pub(super) mod outline;
mod words;

use rusqlite::{Connection, OptionalExtension, Result, Transaction, TransactionBehavior};

use super::database::Store;
use super::error::{InFile, StoreError, is_damage};
use super::read::{current_revision, damaged};
use super::record::Summary;
use super::rows::rows;
use crate::material::{Fit, Slug, SourceKind};
use filter::summary;

pub use filter::Filter;
pub use outline::OutlineEntry;
pub use words::Match;

impl Store {
    /// The current revisions of the materials that match a filter, sorted by name.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn find(&self, filter: &Filter) -> Result<Vec<Summary>, StoreError> {
        filter::all(&self.conn, filter).in_file(&self.path)
    }

    /// The first `most` materials that match a filter, sorted by name. Does not read the others.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn page(&self, filter: &Filter, most: u32) -> Result<Vec<Summary>, StoreError> {
        filter::page(&self.conn, filter, most).in_file(&self.path)
    }

    /// Number of materials that match a filter, at most `most`. Does not count the others.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn count(&self, filter: &Filter, most: u32) -> Result<usize, StoreError> {
        let counted = filter::count(&self.conn, filter, most);
        counted.in_file(&self.path)
    }

    /// The classes of all current revisions, each once, sorted.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn classes(&self) -> Result<Vec<String>, StoreError> {
        filter::classes(&self.conn).in_file(&self.path)
    }

    /// The first `most` tags of all materials, sorted.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn tags(&self, most: usize) -> Result<Vec<String>, StoreError> {
        filter::tags(&self.conn, most).in_file(&self.path)
    }

    /// The list entry of one material; `None` when it does not exist.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn summary(&self, slug: &Slug) -> Result<Option<Summary>, StoreError> {
        one(&self.conn, slug).in_file(&self.path)
    }

    /// Kind of the rendered model in words, as [`Material::rendered_words`](crate::material::Material::rendered_words)
    /// gives it, or that it is damaged. Does not read the rest of the material.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn rendered_words(&self, slug: &Slug) -> Result<Option<String>, StoreError> {
        match words_of(&self.conn, slug) {
            // A list shows the other materials.
            Err(error) if is_damage(&error) => Ok(Some("damaged".to_owned())),
            words => words.in_file(&self.path),
        }
    }

    /// The `most` materials that all these words are found in, the best first; the last word may be the
    /// beginning of one. Names count most, then tags and class, then all else. Words are only words,
    /// whatever signs are in them; without a letter or digit nothing is found.
    ///
    /// Where a word is in more than 500 materials, to rank would be to read them all. Then those whose
    /// short name begins with the words come first, the others in the order in which they were added.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn search(&self, words: &str, most: u32) -> Result<Vec<Match>, StoreError> {
        words::search(&self.conn, words, most).in_file(&self.path)
    }
}

fn one(conn: &Connection, slug: &Slug) -> Result<Option<Summary>> {
    let sql = "SELECT slug, name, class, revision, kind, status, curves, observations, fits
               FROM entry WHERE slug = ?1";
    let tx = Transaction::new_unchecked(conn, TransactionBehavior::Deferred)?;
    let found = tx.prepare_cached(sql)?.query_row([slug.as_str()], summary).optional()?;
    if found.is_none() && current_revision(&tx, slug)?.is_some() {
        return Err(damaged(format!("`{slug}` is there, but no list knows it")));
    }
    Ok(found)
}

fn words_of(conn: &Connection, slug: &Slug) -> Result<Option<String>> {
    let sql = "SELECT fit.estimator, source.kind
               FROM material
               JOIN revision ON material_id = material.id AND number = current_revision
               JOIN fit ON fit.revision_id = revision.id AND fit.name = render
               JOIN curve ON curve.revision_id = revision.id AND curve.name = fit.curve
               JOIN source ON source.revision_id = revision.id AND source.key = curve.source
               WHERE slug = ?1";
    let found = conn.prepare_cached(sql)?.query_row([slug.as_str()], |row| {
        let (estimator, kind): (String, SourceKind) = (row.get(0)?, row.get(1)?);
        Ok(kind.words_beside(estimator != Fit::STATED))
    });
    found.optional()
}

/// Materials whose rows in lists, searches or outlines differ from their current revision.
pub(super) fn stale(conn: &Connection) -> Result<Vec<String>> {
    let sql = "
        SELECT slug FROM (
            SELECT slug, material_id, revision, name, class, status, kind, frequency_min_hz,
                frequency_max_hz, curves, observations, fits, fitted FROM entry_made
            EXCEPT SELECT * FROM entry)
        UNION SELECT slug FROM entry WHERE material_id NOT IN (SELECT id FROM material)
        UNION SELECT slug FROM (SELECT * FROM entry_tag_made EXCEPT SELECT * FROM entry_tag)
        UNION SELECT slug FROM (SELECT * FROM entry_tag EXCEPT SELECT * FROM entry_tag_made)
        UNION SELECT slug FROM (SELECT * FROM search_made EXCEPT SELECT rowid, * FROM search)
        UNION SELECT slug FROM search WHERE rowid NOT IN (SELECT id FROM material)";
    let mut stale: Vec<String> = rows(conn, sql, [], |row| row.get(0))?;
    stale.extend(outline::stale(conn)?);
    stale.sort();
    stale.dedup();
    Ok(stale)
}
