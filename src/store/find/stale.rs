//! Rows of lists, searches and outlines that say something else than what is stored.
//!
//! Small databases are compared before they are read. A material that cannot be read is left out of the comparison.

use rusqlite::{Connection, Result};

use super::filter::Filter;
use super::outline;
use crate::material::Slug;
use crate::store::error::is_damage;
use crate::store::pages::{is_small, renew_search};
use crate::store::read::{damaged, get_in};
use crate::store::rows::rows;

/// The materials of which the list of a filter says something else than what is stored. Fails where it leaves one out,
/// and, of a list with a filter, where that is mended by a repair: its lines may be of the wrong materials.
pub(super) fn stale_lines(conn: &Connection, filter: &Filter) -> Result<Vec<String>> {
    if !is_small(conn)? {
        return Ok(Vec::new());
    }
    if *filter != Filter::default() {
        return check_filter(conn, filter);
    }
    // No index is read, and what is damaged elsewhere hides nothing.
    ENTRIES.check_whole(conn)?;
    ENTRIES.readable_stale(conn)
}

/// The damaged materials, which searches know as they were. Fails where the index of texts or the list is not that of
/// what is stored.
pub(super) fn stale_texts(conn: &Connection) -> Result<Vec<String>> {
    if is_small(conn)? { check(conn, &[ENTRIES, TEXTS]) } else { Ok(Vec::new()) }
}

/// The damaged materials, of which outlines are as they were. Fails where a list or an outline is not that of what is
/// stored.
pub(super) fn stale_outlines(conn: &Connection, filter: &Filter) -> Result<Vec<String>> {
    if !is_small(conn)? {
        return Ok(Vec::new());
    }
    let mut stale = check_filter(conn, filter)?;
    refuse_first(conn, "SELECT slug FROM material WHERE slug NOT IN (SELECT slug FROM outline)")?;
    stale.extend(damaged_of(conn, outline::stale(conn)?.changed)?);
    Ok(stale)
}

/// A table of lists or searches, with the query of the materials of which it says something else than what is stored.
struct Lines {
    table: &'static str,
    /// A condition under which a material has no line.
    left_out: Option<&'static str>,
    /// Its argument is a condition on the materials, which begins with `WHERE`.
    stale: fn(&str) -> String,
}

const ENTRIES: Lines = Lines {
    table: "entry",
    left_out: Some("slug NOT IN (SELECT slug FROM entry)"),
    stale: |wanted| {
        format!(
            "SELECT slug FROM (
                 SELECT slug, material_id, revision, name, class, status, kind, frequency_min_hz,
                     frequency_max_hz, curves, observations, fits, fitted FROM entry_made {wanted}
                 EXCEPT SELECT * FROM entry)
             UNION SELECT slug FROM (SELECT slug, material_id FROM entry {wanted})
                 WHERE material_id NOT IN (SELECT id FROM material)"
        )
    },
};

const TAGS: Lines = Lines {
    table: "entry_tag",
    // A material need not have a tag.
    left_out: None,
    stale: |wanted| {
        format!(
            "SELECT slug FROM (SELECT * FROM entry_tag_made {wanted} EXCEPT SELECT * FROM entry_tag)
             UNION SELECT slug FROM (
                 SELECT * FROM entry_tag {wanted} EXCEPT SELECT * FROM entry_tag_made {wanted})"
        )
    },
};

const TEXTS: Lines = Lines {
    table: "search",
    left_out: Some("id NOT IN (SELECT rowid FROM search)"),
    stale: |wanted| {
        format!(
            "SELECT slug FROM (SELECT * FROM search_made {wanted} EXCEPT SELECT rowid, * FROM search)
             UNION SELECT slug FROM (SELECT slug, rowid AS id FROM search {wanted})
                 WHERE id NOT IN (SELECT id FROM material)"
        )
    },
};

impl Lines {
    /// The stale materials.
    fn stale(&self, conn: &Connection) -> Result<Vec<String>> {
        rows(conn, &(self.stale)(""), [], |row| row.get(0))
    }

    /// As [`Lines::stale`], without the materials that cannot be read.
    fn readable_stale(&self, conn: &Connection) -> Result<Vec<String>> {
        match self.stale(conn) {
            Err(error) if is_damage(&error) => {}
            stale => return stale,
        }
        let slugs: Vec<String> = rows(conn, "SELECT slug FROM material", [], |row| row.get(0))?;
        let one = (self.stale)("WHERE slug = ?1");
        let mut all = Vec::new();
        for slug in slugs {
            match rows(conn, &one, [slug], |row| row.get(0)) {
                Err(error) if is_damage(&error) => {}
                stale => all.extend(stale?),
            }
        }
        Ok(all)
    }

    /// Fails where a material has no line, a damaged one, too: a list would leave it out without a word.
    fn check_whole(&self, conn: &Connection) -> Result<()> {
        self.left_out.map_or(Ok(()), |condition| {
            refuse_first(conn, &format!("SELECT slug FROM material WHERE {condition}"))
        })
    }

    /// Fails where the pages or indexes of the table are damaged.
    fn check_pages(&self, conn: &Connection) -> Result<()> {
        renew_search(conn);
        let sql = "SELECT integrity_check FROM pragma_integrity_check(?1)";
        let found: Vec<String> = rows(conn, sql, [self.table], |row| row.get(0))?;
        found.into_iter().find(|line| line != "ok").map_or(Ok(()), |line| Err(damaged(line)))
    }
}

fn check_filter(conn: &Connection, filter: &Filter) -> Result<Vec<String>> {
    match filter {
        all if *all == Filter::default() => stale_of(conn, &[ENTRIES]),
        Filter { tag: Some(_), .. } => check(conn, &[ENTRIES, TAGS]),
        _ => check(conn, &[ENTRIES]),
    }
}

fn check(conn: &Connection, tables: &[Lines]) -> Result<Vec<String>> {
    tables.iter().try_for_each(|table| table.check_pages(conn))?;
    stale_of(conn, tables)
}

fn stale_of(conn: &Connection, tables: &[Lines]) -> Result<Vec<String>> {
    let mut stale = Vec::new();
    for table in tables {
        table.check_whole(conn)?;
        stale.extend(damaged_of(conn, table.readable_stale(conn)?)?);
    }
    Ok(stale)
}

/// Fails with the first material of a query, one without a line.
fn refuse_first(conn: &Connection, sql: &str) -> Result<()> {
    // A material without a proper name has none.
    let sql = format!("{sql} AND slug <> '' AND slug NOT GLOB '*[^a-z0-9-]*'");
    let left_out: Vec<String> = rows(conn, &sql, [], |row| row.get(0))?;
    left_out.first().map_or(Ok(()), |slug| Err(damaged(problem(slug))))
}

/// Those materials that are damaged themselves: a repair leaves what lists say of them as it was. Fails where one is
/// sound, and lists are not.
fn damaged_of(conn: &Connection, stale: Vec<String>) -> Result<Vec<String>> {
    for slug in &stale {
        let name = slug.parse::<Slug>().ok();
        let current = match name.map(|name| get_in(conn, &name, None)).transpose() {
            Err(error) if is_damage(&error) => continue,
            current => current?.flatten(),
        };
        if current.is_none_or(|stored| stored.material.content_hash() == stored.content_hash) {
            return Err(damaged(problem(slug)));
        }
    }
    Ok(stale)
}

/// What is wrong with the lines of a material.
pub(in crate::store) fn problem(slug: &str) -> String {
    format!("what lists and searches say of `{slug}` is not what is stored")
}

/// Materials whose rows in lists, searches or outlines differ from their current revision.
pub(in crate::store) fn stale(conn: &Connection) -> Result<Vec<String>> {
    let mut stale = Vec::new();
    for table in [ENTRIES, TAGS, TEXTS] {
        stale.extend(table.stale(conn)?);
    }
    let outline::Stale { changed, unreadable } = outline::stale(conn)?;
    stale.extend(changed);
    stale.extend(unreadable.iter().map(Slug::to_string));
    stale.sort();
    stale.dedup();
    Ok(stale)
}
