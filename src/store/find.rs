//! Finds materials: filters, full-text search, and the rows of lists.

mod filter;
pub(super) mod outline;
pub(super) mod stale;
mod words;

use std::collections::BTreeMap;

use rusqlite::{Connection, OptionalExtension};

use super::database::Store;
use super::error::{InFile, StoreError, is_damage};
use super::read::{current_revision, damaged};
use super::results::Summary;
use super::rows::{moment, rows};
use crate::material::{Fit, Slug, SourceKind};
use filter::summary;

pub use filter::Filter;
pub use outline::OutlineEntry;
pub use words::Match;

impl Store {
    /// The current revisions of the materials that match a filter, sorted by name.
    ///
    /// Up to 8 MiB, the lists of a database are compared with its materials first, and a line that says something else is
    /// marked as damaged. [`Store::damage`] compares databases of any size.
    ///
    /// # Errors
    /// When the file cannot be read, a list leaves out a material, or a list with a filter says something else of a
    /// sound one: then the filter may be wrong about others, and [`Store::repair`] mends that.
    pub fn find(&self, filter: &Filter) -> Result<Vec<Summary>, StoreError> {
        marked(&self.conn, filter, |conn| filter::all(conn, filter)).in_file(&self.path)
    }

    /// The first `most` materials that match a filter, sorted by name, as [`Store::find`] gives them. Does not read
    /// the others.
    ///
    /// # Errors
    /// As [`Store::find`].
    pub fn page(&self, filter: &Filter, most: u32) -> Result<Vec<Summary>, StoreError> {
        marked(&self.conn, filter, |conn| filter::page(conn, filter, most)).in_file(&self.path)
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

    /// Outlines of the materials that match a filter, sorted by name.
    ///
    /// # Errors
    /// When the file cannot be read; where a list or an outline is not that of what is stored, which is compared up to
    /// 8 MiB.
    pub fn outlines(&self, filter: &Filter) -> Result<Vec<OutlineEntry>, StoreError> {
        outlined(&self.conn, filter).in_file(&self.path)
    }

    /// The `most` materials of a filter that all these words are found in, the best first; the last word may be the
    /// beginning of one. Names count most, then tags and class, then all else. Words are only words,
    /// whatever signs are in them; without a letter or digit nothing is found.
    ///
    /// Where a word is in more than 500 materials, to rank would be to read them all. Then those whose
    /// short name begins with the words come first, the others in the order in which they were added.
    ///
    /// # Errors
    /// When the file cannot be read; where the index of texts is not that of what is stored, which is compared up to
    /// 8 MiB.
    pub fn search(
        &self,
        words: &str,
        filter: &Filter,
        most: u32,
    ) -> Result<Vec<Match>, StoreError> {
        searched(&self.conn, words, filter, most).in_file(&self.path)
    }
}

/// Lines of the list of a filter; those that are not what is stored are marked.
fn marked(
    conn: &Connection,
    filter: &Filter,
    read: impl FnOnce(&Connection) -> rusqlite::Result<Vec<Summary>>,
) -> rusqlite::Result<Vec<Summary>> {
    let _moment = moment(conn)?;
    let stale = stale::stale_lines(conn, filter)?;
    let mut lines = read(conn)?;
    for line in &mut lines {
        line.is_damaged = stale.iter().any(|slug| slug == line.slug.as_str());
    }
    Ok(lines)
}

/// Materials of a filter with all these words; damaged ones are marked.
fn searched(
    conn: &Connection,
    words: &str,
    filter: &Filter,
    most: u32,
) -> rusqlite::Result<Vec<Match>> {
    let _moment = moment(conn)?;
    let stale = stale::stale_texts(conn)?;
    let mut hits = words::search(conn, words, filter, most)?;
    for hit in &mut hits {
        hit.is_damaged = stale.iter().any(|slug| slug == hit.slug.as_str());
    }
    Ok(hits)
}

/// Outlines of the materials of a filter; damaged ones are marked.
fn outlined(conn: &Connection, filter: &Filter) -> rusqlite::Result<Vec<OutlineEntry>> {
    let _moment = moment(conn)?;
    let stale = stale::stale_outlines(conn, filter)?;
    let mut lines = outline::all(conn, filter)?;
    for line in &mut lines {
        line.is_damaged = stale.contains(&line.slug);
    }
    Ok(lines)
}

fn one(conn: &Connection, slug: &Slug) -> rusqlite::Result<Option<Summary>> {
    let sql = "SELECT slug, name, class, revision, kind, status, curves, observations, fits
               FROM entry WHERE slug = ?1";
    let _moment = moment(conn)?;
    let found = conn.prepare_cached(sql)?.query_row([slug.as_str()], summary).optional()?;
    if found.is_none() && current_revision(conn, slug)?.is_some() {
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
