//! Mending a damaged file as far as what is lost follows from what is left, or from content that is at hand.

use rusqlite::{Connection, Result, Transaction, params};

use super::again::Again;
use super::damage::damage;
use super::database::Store;
use super::error::{InFile, StoreError};
use super::record::Stored;
use super::rows::rows;
use super::tables::{schema, tables, unit_rows};
use super::{read, write};
use crate::material::{Material, Slug};

impl Store {
    /// Mends what can be, in one transaction, and says what was mended, a sentence each; none where nothing was
    /// damaged. Indexes, views, units, lists, searches and statistics are made anew from the content of revisions.
    /// A revision whose content is damaged is written anew if one of `at_hand` has its hash. A material that has
    /// lost its current revision gets the latest one that is there. [`Store::damage`] and the hashes of
    /// [`Store::get`] tell what is left.
    ///
    /// # Errors
    /// When the file cannot be written, or is so damaged that SQLite cannot go through it.
    pub fn repair(&mut self, at_hand: &[Material]) -> std::result::Result<Vec<String>, StoreError> {
        let mut again = Again::new()?;
        let Store { conn, path, .. } = self;
        repair(conn, &mut again, at_hand).in_file(path)
    }
}

fn repair(conn: &mut Connection, again: &mut Again, at_hand: &[Material]) -> Result<Vec<String>> {
    let is_sound_before = damage(conn)?.is_empty();
    let tx = conn.transaction()?;
    tx.pragma_update(None, "defer_foreign_keys", true)?;
    let mut mended = own_schema(&tx, again)?;
    tx.execute_batch("REINDEX")?;
    mended.extend(units(&tx, again)?);
    mended.extend(orphans(&tx)?);
    mended.extend(current_revisions(&tx)?);
    let slugs: Vec<Slug> = rows(&tx, "SELECT slug FROM material", [], |row| row.get(0))?;
    for slug in &slugs {
        mended.extend(revisions(&tx, again, slug, at_hand)?);
    }
    lists(&tx, &slugs)?;
    if !is_sound_before && mended.is_empty() {
        mended.push("indexes, lists and searches were made anew".to_owned());
    }
    tx.commit()?;
    Ok(mended)
}

/// Makes indexes, views and triggers anew that are missing or others; tables stay as they are.
fn own_schema(tx: &Transaction, again: &Again) -> Result<Vec<String>> {
    let there = schema(tx)?;
    let mut mended = Vec::new();
    for object in schema(again.scratch())? {
        let [Some(kind), Some(name), _, Some(sql)] = &object else { continue };
        if kind == "table" || there.contains(&object) {
            continue;
        }
        tx.execute_batch(&format!("DROP {kind} IF EXISTS \"{name}\"; {sql}"))?;
        mended.push(format!("{kind} {name} was made anew"));
    }
    Ok(mended)
}

/// Writes the units of columns anew where they are others.
fn units(tx: &Transaction, again: &Again) -> Result<Vec<String>> {
    let own = unit_rows(again.scratch())?;
    if unit_rows(tx)? == own {
        return Ok(Vec::new());
    }
    tx.execute("DELETE FROM unit", [])?;
    for [column, ucum, meaning] in own {
        tx.execute("INSERT INTO unit VALUES (?1, ?2, ?3)", params![column, ucum, meaning])?;
    }
    Ok(vec!["units of columns were written anew".to_owned()])
}

/// Removes rows of revisions and materials that are not there any more, which nothing can reach.
fn orphans(tx: &Transaction) -> Result<Vec<String>> {
    let mut removed = Vec::new();
    removed.extend(remove(tx, "revision", "material_id NOT IN (SELECT id FROM material)")?);
    for table in tables(tx)? {
        if table.columns.iter().any(|column| column.name == "revision_id") {
            let condition = "revision_id NOT IN (SELECT id FROM revision)";
            removed.extend(remove(tx, &table.name, condition)?);
        }
    }
    removed.extend(remove(tx, "entry", "material_id NOT IN (SELECT id FROM material)")?);
    removed.extend(remove(tx, "search", "rowid NOT IN (SELECT id FROM material)")?);
    Ok(removed)
}

/// Removes rows of a table; returns a sentence if there were any.
fn remove(tx: &Transaction, table: &str, condition: &str) -> Result<Option<String>> {
    let count = tx.execute(&format!("DELETE FROM \"{table}\" WHERE {condition}"), [])?;
    Ok((count > 0).then(|| format!("{count} of `{table}` belonged to nothing and were removed")))
}

/// Gives materials that have lost their current revision the latest one that is there.
fn current_revisions(tx: &Transaction) -> Result<Vec<String>> {
    let sql = "SELECT material.id, slug, current_revision, max(number) FROM material
               JOIN revision ON material_id = material.id GROUP BY material.id
               HAVING sum(number = current_revision) = 0";
    let lost: Vec<(i64, String, i64, i64)> =
        rows(tx, sql, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?)))?;
    let mut mended = Vec::new();
    for (id, slug, number, latest) in lost {
        let update = "UPDATE material SET current_revision = ?2 WHERE id = ?1";
        tx.execute(update, [id, latest])?;
        mended.push(format!(
            "`{slug}` has lost its revision {number}; the latest that is there, {latest}, is current now"
        ));
    }
    Ok(mended)
}

/// Writes revisions of a material anew that are not what their hash says or whose other rows do not follow.
fn revisions(
    tx: &Transaction,
    again: &mut Again,
    slug: &Slug,
    at_hand: &[Material],
) -> Result<Vec<String>> {
    let sql = "SELECT revision.id, number, content_hash FROM revision
               JOIN material ON material.id = material_id WHERE slug = ?1 ORDER BY number";
    let listed: Vec<(i64, u32, String)> =
        rows(tx, sql, [slug.as_str()], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
    let mut mended = Vec::new();
    for (id, number, hash) in listed {
        let stored = read::get_in(tx, slug, Some(number)).ok().flatten();
        let stored = stored.filter(|stored| stored.material.content_hash() == hash);
        let content = match &stored {
            Some(stored) if again.compare(tx, stored)?.is_empty() => continue,
            Some(Stored { material, .. }) => Some(material),
            None => at_hand.iter().find(|material| material.content_hash() == hash),
        };
        let Some(content) = content else { continue };
        write::rewrite(tx, id, content)?;
        mended.push(format!("`{slug}@{number}` was written anew"));
    }
    Ok(mended)
}

/// Makes all that materials are found by anew.
fn lists(tx: &Transaction, slugs: &[Slug]) -> Result<()> {
    tx.execute("INSERT INTO search (search) VALUES ('rebuild')", [])?;
    let mut adding = write::Adding::new(tx);
    for slug in slugs {
        // What cannot be read is in no list.
        let Ok(Some(stored)) = read::get_in(tx, slug, None) else { continue };
        let sql = "SELECT id FROM material WHERE slug = ?1";
        let material_id = tx.query_row(sql, [slug.as_str()], |row| row.get(0))?;
        adding.find_by(material_id, &stored.material)?;
    }
    adding.finish()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::builtin;
    use crate::store::tables::follows_from_content;

    #[test]
    fn a_sound_database_has_nothing_to_mend_and_stays_as_it_is() {
        let mut store = Store::in_memory().unwrap();
        let paint = builtin::get("mannequin-paint").unwrap().unwrap();
        store.add([&paint]).unwrap();
        assert_eq!(store.repair(&[]).unwrap(), Vec::<String>::new());
        assert_eq!(store.damage().unwrap(), Vec::<String>::new());
        assert_eq!(store.get(&paint.slug, None).unwrap().unwrap().material, paint);
    }

    #[test]
    fn every_table_of_content_is_written_anew() {
        let mut store = Store::in_memory().unwrap();
        let paint = builtin::get("mannequin-paint").unwrap().unwrap();
        store.add([&paint]).unwrap();
        for table in tables(&store.conn).unwrap().iter().filter(|table| follows_from_content(table))
        {
            store.conn.pragma_update(None, "foreign_keys", false).unwrap();
            let emptied =
                store.conn.execute(&format!("DELETE FROM \"{}\"", table.name), []).unwrap();
            store.conn.pragma_update(None, "foreign_keys", true).unwrap();
            let mended = store.repair(std::slice::from_ref(&paint)).unwrap();
            assert_eq!(mended.is_empty(), emptied == 0, "{}: {mended:?}", table.name);
            assert_eq!(store.get(&paint.slug, None).unwrap().unwrap().material, paint);
            assert_eq!(store.damage().unwrap(), Vec::<String>::new(), "{}", table.name);
        }
    }
}
