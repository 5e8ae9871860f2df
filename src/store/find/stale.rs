//! Rows of lists, searches and outlines that say something else than what is stored.

use rusqlite::{Connection, Result};

use super::filter::Filter;
use super::outline;
use crate::material::Slug;
use crate::store::database::Store;
use crate::store::error::{InFile, StoreError, is_damage};
use crate::store::pages::is_small;
use crate::store::read::damaged;
use crate::store::rows::rows;

impl Store {
    /// Compares what [`Store::find`] and [`Store::page`] read for a filter with what is stored. A material that cannot be
    /// read is left out. [`Store::damage`] compares all of it in databases of any size; here, those above 8 MiB are not
    /// looked at, since a look takes as long as reading every row.
    ///
    /// # Errors
    /// Where a list says of a material what is not stored, or leaves one out; when the file cannot be read.
    pub fn check_lists(&self, filter: &Filter) -> std::result::Result<(), StoreError> {
        self.look(|conn| check_filter(conn, filter))
    }

    /// The materials of which a list without a filter says something else than what is stored; none in databases above
    /// 8 MiB.
    ///
    /// # Errors
    /// Where the list leaves a material out; when the file cannot be read.
    pub fn stale_lines(&self) -> std::result::Result<Vec<String>, StoreError> {
        self.look(|conn| {
            let sql = "SELECT slug FROM material WHERE slug NOT IN (SELECT slug FROM entry)";
            refuse(&rows(conn, sql, [], |row| row.get(0))?)?;
            ENTRIES.readable_stale(conn)
        })
    }

    /// As [`Store::check_lists`], for what [`Store::search`] reads.
    ///
    /// # Errors
    /// Where the index of texts or the list is not that of what is stored; when the file cannot be read.
    pub fn check_texts(&self) -> std::result::Result<(), StoreError> {
        self.look(|conn| check(conn, &[ENTRIES, TEXTS]))
    }

    /// As [`Store::check_lists`], for what [`Store::outlines`] reads.
    ///
    /// # Errors
    /// Where a list or an outline is not that of what is stored; when the file cannot be read.
    pub fn check_outlines(&self, filter: &Filter) -> std::result::Result<(), StoreError> {
        self.look(|conn| {
            check_filter(conn, filter)?;
            refuse(&outline::stale(conn)?.changed)
        })
    }

    /// Looks at a small database.
    fn look<T: Default>(
        &self,
        look: impl FnOnce(&Connection) -> Result<T>,
    ) -> std::result::Result<T, StoreError> {
        let seen = is_small(&self.conn)
            .and_then(|small| if small { look(&self.conn) } else { Ok(T::default()) });
        seen.in_file(&self.path)
    }
}

/// A table of lists or searches, with the query of the materials of which it says something else than what is stored.
/// `?1` is the name of a material, or null for all.
struct Lines {
    table: &'static str,
    stale: &'static str,
}

const ENTRIES: Lines = Lines {
    table: "entry",
    stale: "
        SELECT slug FROM (
            SELECT slug, material_id, revision, name, class, status, kind, frequency_min_hz,
                frequency_max_hz, curves, observations, fits, fitted FROM entry_made
            WHERE slug = coalesce(?1, slug) EXCEPT SELECT * FROM entry)
        UNION SELECT slug FROM entry WHERE material_id NOT IN (SELECT id FROM material)",
};

const TAGS: Lines = Lines {
    table: "entry_tag",
    stale: "
        SELECT slug FROM (SELECT * FROM entry_tag_made WHERE slug = coalesce(?1, slug)
            EXCEPT SELECT * FROM entry_tag)
        UNION SELECT slug FROM (SELECT * FROM entry_tag WHERE slug = coalesce(?1, slug)
            EXCEPT SELECT * FROM entry_tag_made WHERE slug = coalesce(?1, slug))",
};

const TEXTS: Lines = Lines {
    table: "search",
    stale: "
        SELECT slug FROM (SELECT * FROM search_made WHERE slug = coalesce(?1, slug)
            EXCEPT SELECT rowid, * FROM search)
        UNION SELECT slug FROM search WHERE rowid NOT IN (SELECT id FROM material)",
};

impl Lines {
    /// The stale materials, or the one of this name if it is.
    fn stale(&self, conn: &Connection, only: Option<&str>) -> Result<Vec<String>> {
        rows(conn, self.stale, [only], |row| row.get(0))
    }

    /// As [`Lines::stale`], without the materials that cannot be read.
    fn readable_stale(&self, conn: &Connection) -> Result<Vec<String>> {
        match self.stale(conn, None) {
            Err(error) if is_damage(&error) => {}
            stale => return stale,
        }
        let slugs: Vec<String> = rows(conn, "SELECT slug FROM material", [], |row| row.get(0))?;
        let mut all = Vec::new();
        for slug in slugs {
            match self.stale(conn, Some(&slug)) {
                Err(error) if is_damage(&error) => {}
                stale => all.extend(stale?),
            }
        }
        Ok(all)
    }

    /// Fails where the pages or indexes of the table are damaged.
    fn check_pages(&self, conn: &Connection) -> Result<()> {
        let sql = "SELECT integrity_check FROM pragma_integrity_check(?1)";
        let found: Vec<String> = rows(conn, sql, [self.table], |row| row.get(0))?;
        found.into_iter().find(|line| line != "ok").map_or(Ok(()), |line| Err(damaged(line)))
    }
}

fn check_filter(conn: &Connection, filter: &Filter) -> Result<()> {
    match filter {
        // No index is read, and what is damaged elsewhere hides nothing.
        all if *all == Filter::default() => refuse_stale(conn, &[ENTRIES]),
        Filter { tag: Some(_), .. } => check(conn, &[ENTRIES, TAGS]),
        _ => check(conn, &[ENTRIES]),
    }
}

fn check(conn: &Connection, tables: &[Lines]) -> Result<()> {
    tables.iter().try_for_each(|table| table.check_pages(conn))?;
    refuse_stale(conn, tables)
}

fn refuse_stale(conn: &Connection, tables: &[Lines]) -> Result<()> {
    tables.iter().try_for_each(|table| refuse(&table.readable_stale(conn)?))
}

fn refuse(stale: &[String]) -> Result<()> {
    stale.first().map_or(Ok(()), |slug| Err(damaged(problem(slug))))
}

/// What is wrong with the lines of a material.
pub(in crate::store) fn problem(slug: &str) -> String {
    format!("what lists and searches say of `{slug}` is not what is stored")
}

/// Materials whose rows in lists, searches or outlines differ from their current revision.
pub(in crate::store) fn stale(conn: &Connection) -> Result<Vec<String>> {
    let mut stale = Vec::new();
    for table in [ENTRIES, TAGS, TEXTS] {
        stale.extend(table.stale(conn, None)?);
    }
    let outline::Stale { changed, unreadable } = outline::stale(conn)?;
    stale.extend(changed);
    stale.extend(unreadable.iter().map(Slug::to_string));
    stale.sort();
    stale.dedup();
    Ok(stale)
}
