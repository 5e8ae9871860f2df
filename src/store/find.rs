//! One material among many: filters, words, and the line that lists show.

use rusqlite::types::Value;
use rusqlite::{Connection, OptionalExtension, Result, Row, params, params_from_iter};

use super::read::rows;
use super::{Store, StoreError, Summary};
use crate::material::{Slug, SourceKind};

/// Which materials are wanted: those of which all holds that is said here.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Filter {
    /// A frequency within the range for which the numbers are claimed, Hz.
    pub frequency_hz: Option<f64>,
    /// One of its tags.
    pub tag: Option<String>,
    /// How the numbers that a scene renders came to be.
    pub kind: Option<SourceKind>,
    /// Kind of stuff.
    pub class: Option<String>,
    /// Whether it has a model that was fitted to a curve.
    pub fitted: Option<bool>,
    /// `active`, `superseded` or `withdrawn`.
    pub status: Option<String>,
}

/// A material that words were found in.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Hit {
    /// Short name.
    pub slug: Slug,
    /// Full name.
    pub name: String,
    /// Current revision, from 1.
    pub revision: u32,
    /// Some words around those that were found, which stand in brackets.
    pub snippet: String,
    /// How well it fits (BM25), less is better; comparable only within one database.
    pub rank: f64,
}

const COLUMNS: &str = "SELECT slug, name, class, revision, kind, status, curves, observations, fits
    FROM entry";

/// Words beyond these are not looked for: nobody types more.
const MOST_WORDS: usize = 32;

impl Store {
    /// The current revisions of the materials that a filter lets through, sorted by name.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn find(&self, filter: &Filter) -> Result<Vec<Summary>, StoreError> {
        find(&self.conn, filter).map_err(|error| StoreError::new(&self.path, error))
    }

    /// What a list says of one material; `None` when there is none of that name.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn summary(&self, slug: &Slug) -> Result<Option<Summary>, StoreError> {
        one(&self.conn, slug).map_err(|error| StoreError::new(&self.path, error))
    }

    /// The `most` materials that all these words are found in, the best first; the last word may be the
    /// beginning of one. Names count most, then tags and class, then all else. Words are only words,
    /// whatever signs are in them; without a letter or digit nothing is found.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn search(&self, words: &str, most: u32) -> Result<Vec<Hit>, StoreError> {
        match query(words) {
            Some(query) => {
                search(&self.conn, &query, most).map_err(|error| StoreError::new(&self.path, error))
            }
            None => Ok(Vec::new()),
        }
    }
}

fn find(conn: &Connection, filter: &Filter) -> Result<Vec<Summary>> {
    let Filter { frequency_hz, tag, kind, class, fitted, status } = filter;
    let text = |text: &Option<String>| text.clone().map(Value::Text);
    let wanted = [
        ("frequency_max_hz >= ?", frequency_hz.map(Value::Real)),
        ("frequency_min_hz <= ?", frequency_hz.map(Value::Real)),
        ("slug IN (SELECT slug FROM entry_tag WHERE tag = ?)", text(tag)),
        ("kind = ?", kind.map(|kind| Value::Text(kind.as_str().to_owned()))),
        ("class = ?", text(class)),
        ("fitted > ?", fitted.filter(|fitted| *fitted).map(|_| Value::Integer(0))),
        ("fitted = ?", fitted.filter(|fitted| !*fitted).map(|_| Value::Integer(0))),
        ("status = ?", text(status)),
    ];
    let (conditions, values): (Vec<&str>, Vec<Value>) =
        wanted.into_iter().filter_map(|(sql, value)| Some((sql, value?))).unzip();
    let condition = match conditions.as_slice() {
        [] => String::new(),
        conditions => format!(" WHERE {}", conditions.join(" AND ")),
    };
    let sql = format!("{COLUMNS}{condition}");
    let mut found = rows(conn, &sql, params_from_iter(values), summary)?;
    // Asked for the order, SQLite would go through all of them in it instead of using an index.
    found.sort_by(|a, b| a.slug.cmp(&b.slug));
    Ok(found)
}

fn one(conn: &Connection, slug: &Slug) -> Result<Option<Summary>> {
    conn.prepare_cached(&format!("{COLUMNS} WHERE slug = ?1"))?
        .query_row([slug.as_str()], summary)
        .optional()
}

fn summary(row: &Row) -> Result<Summary> {
    Ok(Summary {
        slug: row.get(0)?,
        name: row.get(1)?,
        class: row.get(2)?,
        revision: row.get(3)?,
        render_kind: row.get(4)?,
        status: row.get(5)?,
        curves: row.get(6)?,
        observations: row.get(7)?,
        fits: row.get(8)?,
    })
}

fn search(conn: &Connection, query: &str, most: u32) -> Result<Vec<Hit>> {
    let sql = "
        SELECT search.slug, search.name, current_revision,
            snippet(search, -1, '[', ']', '…', 12), rank
        FROM search JOIN material ON material.id = search.rowid
        WHERE search MATCH ?1 AND rank MATCH 'bm25(10, 10, 5, 5, 1, 2, 1, 1)'
        ORDER BY rank LIMIT ?2";
    rows(conn, sql, params![query, most], |row| {
        Ok(Hit {
            slug: row.get(0)?,
            name: row.get(1)?,
            revision: row.get(2)?,
            snippet: row.get(3)?,
            rank: row.get(4)?,
        })
    })
}

/// Words as the index takes them: each a phrase in quotes, the last also as the beginning of a word.
fn query(words: &str) -> Option<String> {
    let apart = |letter: char| letter.is_whitespace() || letter.is_control() || letter == '"';
    let says_something = |word: &&str| word.chars().any(char::is_alphanumeric);
    let phrases: Vec<String> = words
        .split(apart)
        .filter(says_something)
        .take(MOST_WORDS)
        .map(|word| format!("\"{word}\""))
        .collect();
    (!phrases.is_empty()).then(|| phrases.join(" ") + "*")
}

/// Materials whose line or words are not those of their current revision.
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
    rows(conn, sql, [], |row| row.get(0))
}

#[cfg(test)]
mod tests {
    use super::query;

    #[test]
    fn words_are_only_words() {
        assert_eq!(query("matt paint").as_deref(), Some("\"matt\" \"paint\"*"));
        assert_eq!(query("a\" OR b").as_deref(), Some("\"a\" \"OR\" \"b\"*"));
        assert_eq!(query("name:x NEAR(").as_deref(), Some("\"name:x\" \"NEAR(\"*"));
        assert_eq!(query(" \" - * ( \u{0} "), None);
        assert_eq!(query("a\u{0}b").as_deref(), Some("\"a\" \"b\"*"));
    }
}
