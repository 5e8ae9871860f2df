//! Full-text search, and its way around very frequent words.

use std::collections::BTreeSet;

use rusqlite::{Connection, Result, Row, params};

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

/// Up to `most` materials that have all these words.
pub(super) fn search(conn: &Connection, words: &str, most: u32) -> Result<Vec<Match>> {
    let phrases = phrases(words);
    if phrases.is_empty() {
        return Ok(Vec::new());
    }
    if are_rare(conn, &phrases)? {
        return ranked(conn, &beginning(&phrases), most);
    }
    unranked(conn, words, &phrases, most)
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
fn ranked(conn: &Connection, query: &str, most: u32) -> Result<Vec<Match>> {
    let sql = "
        SELECT search.slug, search.name, revision, status,
            snippet(search, -1, '[', ']', '…', 12), rank
        FROM search JOIN entry ON material_id = search.rowid
        WHERE search MATCH ?1 AND rank MATCH 'bm25(10, 10, 5, 5, 1, 2, 1, 1)'
        ORDER BY rank LIMIT ?2";
    rows(conn, sql, params![query, most], hit)
}

/// Materials whose short name begins with the words, then those with the whole words, then all others.
fn unranked(conn: &Connection, words: &str, phrases: &[String], most: u32) -> Result<Vec<Match>> {
    let sql = "
        SELECT search.slug, search.name, revision, status,
            snippet(search, -1, '[', ']', '…', 12), 0.0
        FROM search JOIN entry ON material_id = search.rowid
        WHERE search MATCH ?1 ORDER BY search.rowid LIMIT ?2";
    let mut found = called(conn, words, most)?;
    let wanted = usize::try_from(most).unwrap_or(usize::MAX);
    for query in [&phrases.join(" "), &beginning(phrases)] {
        if found.len() < wanted {
            // Some of these may be there already.
            let known: BTreeSet<Slug> = found.iter().map(|hit| hit.slug.clone()).collect();
            let more = rows(conn, sql, params![query, most], hit)?;
            found.extend(more.into_iter().filter(|hit| !known.contains(&hit.slug)));
        }
    }
    found.truncate(wanted);
    Ok(found)
}

/// Materials whose short name begins with the words.
fn called(conn: &Connection, words: &str, most: u32) -> Result<Vec<Match>> {
    let begin = words.split_whitespace().collect::<Vec<_>>().join("-").to_lowercase();
    // In ASCII, `~` comes after every character of a short name.
    let end = format!("{begin}~");
    let sql = "SELECT slug, name, revision, status FROM entry
               WHERE slug >= ?1 AND slug < ?2 ORDER BY slug LIMIT ?3";
    rows(conn, sql, params![begin, end, most], |row| {
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
