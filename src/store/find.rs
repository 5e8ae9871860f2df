//! Finds materials: filters, full-text search, and the rows of lists.

mod filter;
pub(super) mod outline;
pub(super) mod stale;
mod words;

use std::collections::BTreeMap;

use rusqlite::{Connection, OptionalExtension, Transaction, TransactionBehavior};

use super::database::Store;
use super::error::{InFile, StoreError, is_damage};
use super::read::{current_revision, damaged};
use super::results::Summary;
use super::rows::rows;
use crate::material::{Fit, Slug, SourceKind};
use filter::summary;

pub use filter::Filter;
pub use outline::OutlineEntry;
pub use words::Match;

impl Store {
    /// The current revisions of the materials that match a filter, sorted by name.
    ///
    /// Up to 8 MiB, the lists of a database are compared with its materials first. Without a filter, a line that says
    /// something else is marked as damaged; with one, it is an error, since the line may belong to other materials.
    /// [`Store::damage`] compares databases of any size.
    ///
    /// # Errors
    /// When the file cannot be read, or a list leaves out a material.
    pub fn find(&self, filter: &Filter) -> Result<Vec<Summary>, StoreError> {
        self.marked(filter, |conn| filter::all(conn, filter))
    }

    /// The first `most` materials that match a filter, sorted by name, as [`Store::find`] gives them. Does not read
    /// the others.
    ///
    /// # Errors
    /// As [`Store::find`].
    pub fn page(&self, filter: &Filter, most: u32) -> Result<Vec<Summary>, StoreError> {
        self.marked(filter, |conn| filter::page(conn, filter, most))
    }

    /// Lines of the list of a filter; those that are not what is stored are marked.
    fn marked(
        &self,
        filter: &Filter,
        read: impl FnOnce(&Connection) -> rusqlite::Result<Vec<Summary>>,
    ) -> Result<Vec<Summary>, StoreError> {
        let marked = || {
            let tx = moment(&self.conn)?;
            let stale = stale::stale_lines(&tx, filter)?;
            let mut lines = read(&tx)?;
            for line in &mut lines {
                line.is_damaged = stale.iter().any(|slug| slug == line.slug.as_str());
            }
            Ok(lines)
        };
        marked().in_file(&self.path)
    }

    /// Every line of the lists as it is.
    pub(crate) fn lines(&self) -> Result<Vec<Summary>, StoreError> {
        filter::all(&self.conn, &Filter::default()).in_file(&self.path)
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

    /// Kinds of the rendered models of materials in words, as
    /// [`Material::rendered_words`](crate::material::Material::rendered_words) gives them; `None` of a damaged material.
    /// Does not read the rest of the materials. Those without such words are left out.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn rendered_words(
        &self,
        slugs: &[Slug],
    ) -> Result<BTreeMap<Slug, Option<String>>, StoreError> {
        let mut words = match words_of(&self.conn, slugs) {
            Err(error) if is_damage(&error) => BTreeMap::new(),
            words => return words.in_file(&self.path),
        };
        // A list shows the other materials, so that each is read by itself.
        for slug in slugs {
            match words_of(&self.conn, std::slice::from_ref(slug)) {
                Err(error) if is_damage(&error) => {
                    words.insert(slug.clone(), None);
                }
                found => words.extend(found.in_file(&self.path)?),
            }
        }
        Ok(words)
    }

    /// The `most` materials that all these words are found in, the best first; the last word may be the
    /// beginning of one. Names count most, then tags and class, then all else. Words are only words,
    /// whatever signs are in them; without a letter or digit nothing is found.
    ///
    /// Where a word is in more than 500 materials, to rank would be to read them all. Then those whose
    /// short name begins with the words come first, the others in the order in which they were added.
    ///
    /// # Errors
    /// When the file cannot be read; where the index of texts is not that of what is stored, which is compared up to
    /// 8 MiB.
    pub fn search(&self, words: &str, most: u32) -> Result<Vec<Match>, StoreError> {
        let found = || {
            let tx = moment(&self.conn)?;
            stale::check_texts(&tx)?;
            words::search(&tx, words, most)
        };
        found().in_file(&self.path)
    }
}

/// A transaction in which another program's writes are not seen.
pub(super) fn moment(conn: &Connection) -> rusqlite::Result<Transaction<'_>> {
    Transaction::new_unchecked(conn, TransactionBehavior::Deferred)
}

fn one(conn: &Connection, slug: &Slug) -> rusqlite::Result<Option<Summary>> {
    let sql = "SELECT slug, name, class, revision, kind, status, curves, observations, fits
               FROM entry WHERE slug = ?1";
    let tx = moment(conn)?;
    let found = tx.prepare_cached(sql)?.query_row([slug.as_str()], summary).optional()?;
    if found.is_none() && current_revision(&tx, slug)?.is_some() {
        return Err(damaged(format!("`{slug}` is there, but no list knows it")));
    }
    Ok(found)
}

fn words_of(conn: &Connection, slugs: &[Slug]) -> rusqlite::Result<BTreeMap<Slug, Option<String>>> {
    let wanted = serde_json::json!(slugs).to_string();
    let sql = "SELECT slug, fit.estimator, source.kind, fit.curve,
                   EXISTS (SELECT 1 FROM curve AS own
                           WHERE own.revision_id = revision.id AND own.name = render)
               FROM json_each(?1) CROSS JOIN material ON slug = json_each.value
               LEFT JOIN revision ON material_id = material.id AND number = current_revision
               LEFT JOIN fit ON fit.revision_id = revision.id AND fit.name = render
               LEFT JOIN curve ON curve.revision_id = revision.id AND curve.name = fit.curve
               LEFT JOIN source ON source.revision_id = revision.id AND source.key = curve.source";
    let found = rows(conn, sql, [wanted], |row| {
        let slug: Slug = row.get(0)?;
        let estimator: Option<String> = row.get(1)?;
        let (kind, curve): (Option<SourceKind>, Option<String>) = (row.get(2)?, row.get(3)?);
        let renders_a_curve: bool = row.get(4)?;
        let words = match (&estimator, &curve, kind) {
            (Some(estimator), Some(_), Some(kind)) => {
                Some(kind.words_beside(estimator != Fit::STATED))
            }
            // A fit of no curve, or a curve.
            (Some(_), None, _) => None,
            (None, ..) if renders_a_curve => None,
            _ => return Err(damaged(format!("what scenes render of `{slug}` is not there"))),
        };
        Ok(words.map(|words| (slug, Some(words))))
    })?;
    Ok(found.into_iter().flatten().collect())
}
