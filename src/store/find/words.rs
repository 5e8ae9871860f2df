//! Full-text search, and its way around very frequent words.

use std::collections::BTreeSet;

use rusqlite::types::Value;
use rusqlite::{Connection, Result, Row, params, params_from_iter};

use super::filter::{Filter, from_rarest};
use crate::material::Slug;
use crate::store::rows::rows;

/// A material with the words of a search.
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Match {
    /// Short name.
    pub slug: Slug,
    /// Full name.
    pub name: String,
    /// Current revision, from 1.
    pub revision: u32,
    /// Text around the found words, which are in brackets.
    pub snippet: String,
    /// `active`, `superseded` or `withdrawn`.
    pub status: String,
    /// Rank (BM25), smaller is better. Comparable only within one search; 0 where not ranked.
    pub rank: f64,
    /// Whether the material is damaged; this is what was stored.
    #[serde(rename = "damaged", skip_serializing_if = "std::ops::Not::not")]
    pub is_damaged: bool,
}

/// Largest number of words of a search; further ones are ignored.
const MOST_WORDS: usize = 32;

/// A word in more materials than this is frequent.
const RARE: u32 = 500;

/// The condition on materials besides their words.
struct Among {
    sql: String,
    values: Vec<Value>,
}

impl Among {
    /// The materials that match a filter.
    fn new(conn: &Connection, filter: &Filter) -> Result<Among> {
        if *filter == Filter::default() {
            return Ok(Among { sql: String::new(), values: Vec::new() });
        }
        let (from, values) = from_rarest(conn, filter)?;
        Ok(Among { sql: format!("AND entry.slug IN (SELECT slug {from})"), values })
    }

    /// Values for `first`, the condition, and `last`, as they stand in a query.
    fn between(&self, first: &[&str], last: u32) -> Vec<Value> {
        let first = first.iter().map(|text| Value::Text((*text).to_owned()));
        first.chain(self.values.iter().cloned()).chain([Value::Integer(last.into())]).collect()
    }
}

/// Up to `most` materials of a filter that have all these words.
pub(super) fn search(
    conn: &Connection,
    words: &str,
    filter: &Filter,
    most: u32,
) -> Result<Vec<Match>> {
    let phrases = phrases(words);
    if phrases.is_empty() {
        return Ok(Vec::new());
    }
    let among = Among::new(conn, filter)?;
    if are_rare(conn, &phrases)? {
        return ranked(conn, &beginning(&phrases), &among, most);
    }
    unranked(conn, words, &phrases, &among, most)
}

/// Words in the syntax of the index: each as a phrase in quotes.
fn phrases(words: &str) -> Vec<String> {
    let words = words.split(|c: char| c.is_whitespace() || c.is_control() || c == '"');
    let words = words.filter(|word| word.chars().any(char::is_alphanumeric));
    words.take(MOST_WORDS).map(|word| format!("\"{word}\"")).collect()
}

/// A query of all words, the last also as the beginning of a word.
fn beginning(phrases: &[String]) -> String {
    phrases.join(" ") + "*"
}

/// Whether every word by itself is in few materials, so that ranking is fast.
fn are_rare(conn: &Connection, phrases: &[String]) -> Result<bool> {
    let last = phrases.last().map(|last| format!("{last}*"));
    for phrase in phrases.iter().chain(&last) {
        let sql = "SELECT count(*) FROM (SELECT 1 FROM search WHERE search MATCH ?1 LIMIT ?2)";
        let found: u32 =
            conn.prepare_cached(sql)?.query_row(params![phrase, RARE + 1], |row| row.get(0))?;
        if found > RARE {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Materials with all words, the best first.
fn ranked(conn: &Connection, query: &str, among: &Among, most: u32) -> Result<Vec<Match>> {
    let sql = format!(
        "
        SELECT search.slug, search.name, revision, status,
            snippet(search, -1, '[', ']', '…', 12), rank
        FROM search JOIN entry ON material_id = search.rowid
        WHERE search MATCH ? AND rank MATCH 'bm25(10, 10, 5, 5, 1, 2, 1, 1)' {}
        ORDER BY rank LIMIT ?",
        among.sql
    );
    rows(conn, &sql, params_from_iter(among.between(&[query], most)), hit)
}

/// Materials whose short name begins with the words, then those with the whole words, then all others.
fn unranked(
    conn: &Connection,
    words: &str,
    phrases: &[String],
    among: &Among,
    most: u32,
) -> Result<Vec<Match>> {
    let sql = format!(
        "
        SELECT search.slug, search.name, revision, status,
            snippet(search, -1, '[', ']', '…', 12), 0.0
        FROM search JOIN entry ON material_id = search.rowid
        WHERE search MATCH ? {} ORDER BY search.rowid LIMIT ?",
        among.sql
    );
    let mut found = called(conn, words, among, most)?;
    let wanted = usize::try_from(most).unwrap_or(usize::MAX);
    for query in [&phrases.join(" "), &beginning(phrases)] {
        if found.len() < wanted {
            // Some of these may be there already.
            let known: BTreeSet<Slug> = found.iter().map(|hit| hit.slug.clone()).collect();
            let more = rows(conn, &sql, params_from_iter(among.between(&[query], most)), hit)?;
            found.extend(more.into_iter().filter(|hit| !known.contains(&hit.slug)));
        }
    }
    found.truncate(wanted);
    Ok(found)
}

/// Materials whose short name begins with the words.
fn called(conn: &Connection, words: &str, among: &Among, most: u32) -> Result<Vec<Match>> {
    let begin = words.split_whitespace().collect::<Vec<_>>().join("-").to_lowercase();
    // In ASCII, `~` comes after every character of a short name.
    let end = format!("{begin}~");
    let sql = format!(
        "SELECT slug, name, revision, status FROM entry
         WHERE slug >= ? AND slug < ? {} ORDER BY slug LIMIT ?",
        among.sql
    );
    rows(conn, &sql, params_from_iter(among.between(&[&begin, &end], most)), |row| {
        let slug: Slug = row.get(0)?;
        let rest = slug.as_str().strip_prefix(&begin).unwrap_or_default();
        let snippet = format!("[{begin}]{rest}");
        let (name, revision, status) = (row.get(1)?, row.get(2)?, row.get(3)?);
        Ok(Match { slug, name, revision, status, snippet, rank: 0.0, is_damaged: false })
    })
}

fn hit(row: &Row) -> Result<Match> {
    Ok(Match {
        slug: row.get(0)?,
        name: row.get(1)?,
        revision: row.get(2)?,
        status: row.get(3)?,
        snippet: row.get(4)?,
        rank: row.get(5)?,
        is_damaged: false,
    })
}

#[cfg(test)]
mod tests {
    use super::{beginning, phrases};

    fn query(words: &str) -> Option<String> {
        let phrases = phrases(words);
        (!phrases.is_empty()).then(|| beginning(&phrases))
    }

    #[test]
    fn words_are_only_words() {
        assert_eq!(query("matt paint").as_deref(), Some("\"matt\" \"paint\"*"));
        assert_eq!(query("a\" OR b").as_deref(), Some("\"a\" \"OR\" \"b\"*"));
        assert_eq!(query("name:x NEAR(").as_deref(), Some("\"name:x\" \"NEAR(\"*"));
        assert_eq!(query(" \" - * ( \u{0} "), None);
        assert_eq!(query("a\u{0}b").as_deref(), Some("\"a\" \"b\"*"));
    }
}
