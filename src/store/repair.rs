//! Repairs a damaged file as far as lost rows follow from the remaining ones, or from content that is at hand.

use std::path::{Path, PathBuf};

use rusqlite::{Connection, Result, Transaction, params};

use super::damage::damage;
use super::database::Store;
use super::error::{InFile, StoreError, is_damage, reason};
use super::find::stale::stale;
use super::read::RevisionRow;
use super::record::{self, Part};
use super::results::StoredRevision;
use super::row_check::RowCheck;
use super::rows::rows;
use super::tables::{own_tables, quoted, schema, unit_rows};
use super::{connect, law, read, unreachable, write};
use crate::brdf::Brdf;
use crate::material::{Activity, Input, Material, Origin, Slug};

/// Fits of a revision with values in `fit.model` that are tried one by one; further ones are tried together.
const MOST_TRIED_APART: usize = 10;

/// The command that is recorded with what a repair writes.
const COMMAND: &str = "check --repair";

/// Most copies of a database that repairs leave next to it.
const MOST_COPIES: u32 = 99;

/// Result of [`Store::repair`], a sentence each.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Repair {
    /// Repaired damage; empty when nothing was damaged.
    pub mended: Vec<String>,
    /// Steps that failed, and why.
    pub failed: Vec<String>,
    /// A copy of the file as it was before; none where nothing was repaired.
    pub copy: Option<PathBuf>,
}

impl Store {
    /// Repairs what can be repaired, in one transaction, after a copy of the file was written next to it.
    /// Rebuilds indexes, views, units, lists, searches and statistics from the content of revisions. Rewrites a
    /// revision with damaged content if one of `at_hand` has its hash. Restores the lost row of a material from its
    /// row in the lists, if the content then has the stored hash. Where the current revision of a material is lost,
    /// repeats the latest sound one under a new number, so that no number changes its meaning. Replaces a damaged
    /// command, date or origin of a sound revision. Removes rows that belong to no material. [`Store::damage`] and the
    /// hashes of [`Store::get`] show the remaining damage.
    ///
    /// # Errors
    /// When the file cannot be written or copied, or SQLite cannot read it to the end. Then it stays as it was.
    pub fn repair(&mut self, at_hand: &[Material]) -> std::result::Result<Repair, StoreError> {
        let mut row_check = RowCheck::new()?;
        let Store { conn, path, .. } = self;
        // Rows of others may refer to those that are written anew, and would be removed with them.
        conn.pragma_update(None, "foreign_keys", false).in_file(path)?;
        let repaired = repair_with_copy(conn, path, &mut row_check, at_hand);
        conn.pragma_update(None, "foreign_keys", true).in_file(path)?;
        repaired
    }
}

fn repair_with_copy(
    conn: &mut Connection,
    path: &Path,
    row_check: &mut RowCheck,
    at_hand: &[Material],
) -> std::result::Result<Repair, StoreError> {
    let tx = conn.transaction().in_file(path)?;
    let mut repair = repair(&tx, row_check, at_hand).in_file(path)?;
    if !repair.mended.is_empty() && tx.path().is_some_and(|name| !name.is_empty()) {
        let copy = copy_name(path)?;
        connect::back_up(path, &copy)?;
        repair.copy = Some(copy);
    }
    tx.commit().in_file(path)?;
    Ok(repair)
}

/// A free name for a copy.
fn copy_name(path: &Path) -> std::result::Result<PathBuf, StoreError> {
    let name = |number: u32| {
        let mut name = path.as_os_str().to_owned();
        name.push(".before-repair");
        if number > 1 {
            name.push(format!("-{number}"));
        }
        PathBuf::from(name)
    };
    let free = (1..=MOST_COPIES).map(name).find(|path| path.symlink_metadata().is_err());
    free.ok_or_else(|| StoreError::Copies { file: path.to_owned(), copies: MOST_COPIES })
}

fn repair(tx: &Transaction, row_check: &mut RowCheck, at_hand: &[Material]) -> Result<Repair> {
    // A table or a view may be missing.
    let before = readable(damage(tx))?;
    let is_sound = before.as_ref().is_some_and(Vec::is_empty);
    let mut repair = Repair::default();
    let sound = if is_sound { Vec::new() } else { sound_revisions(tx)? };
    let at_hand: Vec<&Material> = at_hand.iter().chain(&sound).collect();
    repair.attempt(tx, "tables, indexes and views", || own_schema(tx, row_check))?;
    repair.attempt(tx, "indexes", || indexes(tx))?;
    repair.attempt(tx, "units of columns", || units(tx, row_check))?;
    for renamed in renamed_materials(tx)? {
        repair.attempt(tx, &renamed.slug, || renamed_material(tx, &renamed))?;
    }
    for lost in lost_materials(tx)? {
        repair.attempt(tx, &lost.slug, || lost_material(tx, &lost))?;
    }
    repair.attempt(tx, "lists", || unreachable_lines(tx))?;
    // A new revision could take the number of a lost one.
    repair.attempt(tx, "rows of no material", || unreachable_rows(tx))?;
    let mut slugs = Vec::new();
    let named: Vec<String> = rows(tx, "SELECT slug FROM material", [], |row| row.get(0))?;
    for name in named {
        match name.parse::<Slug>() {
            Ok(slug) => slugs.push(slug),
            Err(_) => repair.failed.push(format!("`{name}` is not a name of a material")),
        }
    }
    for slug in &slugs {
        for row in readable(read::revision_rows(tx, slug))?.unwrap_or_default() {
            let place = format!("{slug}@{}", row.number);
            repair.attempt(tx, &place, || revision(tx, row_check, slug, &row, &at_hand))?;
            repair.attempt(tx, &place, || record_of(tx, slug, &row))?;
        }
        repair.attempt(tx, slug.as_str(), || latest_revision(tx, slug))?;
        repair.attempt(tx, slug.as_str(), || lost_current_revision(tx, slug))?;
    }
    repair.attempt(tx, "lists and searches", || lists(tx, &slugs))?;
    if repair.mended.is_empty() && Some(damage(tx)?) != before {
        repair.mended.push("indexes and searches were made anew".to_owned());
    }
    Ok(repair)
}

/// Makes the indexes of the tables of matdb anew.
fn indexes(tx: &Transaction) -> Result<Vec<String>> {
    for table in own_tables(tx)? {
        tx.execute_batch(&format!("REINDEX {}", quoted(&table.name)))?;
    }
    tx.execute_batch("REINDEX outline")?;
    Ok(Vec::new())
}

/// Removes rows that belong to no material.
fn unreachable_rows(tx: &Transaction) -> Result<Vec<String>> {
    let rows = unreachable::count(tx)?;
    if rows == 0 {
        return Ok(Vec::new());
    }
    unreachable::remove(tx)?;
    Ok(vec![format!("{rows} rows of lost revisions belonged to no material and were removed")])
}

impl Repair {
    /// Takes one step. A step that fails is undone alone.
    fn attempt(
        &mut self,
        tx: &Transaction,
        what: &str,
        step: impl FnOnce() -> Result<Vec<String>>,
    ) -> Result<()> {
        tx.execute_batch("SAVEPOINT step")?;
        match step() {
            Ok(mended) => {
                self.mended.extend(mended);
                tx.execute_batch("RELEASE step")
            }
            Err(error) => {
                self.failed.push(format!("{what} cannot be mended: {}", reason(&error)));
                tx.execute_batch("ROLLBACK TO step; RELEASE step")
            }
        }
    }
}

/// Creates missing tables, and indexes, views and triggers that are missing or different. Existing tables stay.
fn own_schema(tx: &Transaction, row_check: &RowCheck) -> Result<Vec<String>> {
    let mut there = schema(tx)?;
    let mut own = schema(row_check.scratch())?;
    // An index needs its table.
    own.sort_by_key(|[kind, ..]| kind.as_deref() != Some("table"));
    let mut mended = Vec::new();
    // The full-text index is made with all its tables or not at all.
    if own.iter().any(|object| is_of_search(object) && !there.contains(object)) {
        tx.execute_batch("DROP TABLE IF EXISTS search")?;
        there.retain(|object| object[1].as_deref() != Some("search"));
    }
    for object in own {
        let [Some(kind), Some(name), _, Some(sql)] = &object else { continue };
        // The full-text index creates its own tables.
        let is_shadow = name.starts_with("search_") && kind == "table";
        let is_kept_table = kind == "table" && there.iter().any(|other| other[1] == object[1]);
        if is_shadow || is_kept_table || there.contains(&object) {
            continue;
        }
        if kind != "table" {
            tx.execute_batch(&format!("DROP {kind} IF EXISTS \"{name}\""))?;
        }
        tx.execute_batch(sql)?;
        mended.push(format!("{kind} {name} was made anew"));
    }
    Ok(mended)
}

/// Whether it is a table of the full-text index.
fn is_of_search([kind, name, ..]: &[Option<String>; 4]) -> bool {
    kind.as_deref() == Some("table")
        && name.as_ref().is_some_and(|name| name.starts_with("search_"))
}

/// Rewrites the units of columns where they differ.
fn units(tx: &Transaction, row_check: &RowCheck) -> Result<Vec<String>> {
    let own = unit_rows(row_check.scratch())?;
    if unit_rows(tx)? == own {
        return Ok(Vec::new());
    }
    tx.execute("DELETE FROM unit", [])?;
    for [column, ucum, meaning] in own {
        tx.execute("INSERT INTO unit VALUES (?1, ?2, ?3)", params![column, ucum, meaning])?;
    }
    Ok(vec!["units of columns were written anew".to_owned()])
}

/// What was read; none of what is damaged.
fn readable<T>(read: Result<T>) -> Result<Option<T>> {
    match read {
        Err(error) if is_damage(&error) => Ok(None),
        read => read.map(Some),
    }
}

/// Every revision with its stored hash. A table and its indexes may differ, and one of the two is lost when indexes are
/// made anew.
fn sound_revisions(tx: &Transaction) -> Result<Vec<Material>> {
    // Without an index, which may have rows that are not there: to look for one would end every write.
    let sql = "SELECT slug, number FROM revision NOT INDEXED
               JOIN material NOT INDEXED ON material.id = material_id";
    let named = readable(rows(tx, sql, [], |row| Ok((row.get(0)?, row.get(1)?))))?;
    let named: Vec<(String, u32)> = named.unwrap_or_default();
    let mut sound = Vec::new();
    for (name, number) in named {
        let Ok(slug) = name.parse::<Slug>() else { continue };
        sound.extend(sound_revision(tx, &slug, number)?.map(|stored| stored.material));
    }
    Ok(sound)
}

fn is_as_stored(stored: &StoredRevision) -> bool {
    stored.material.content_hash() == stored.content_hash
}

/// Materials that the lists have under another name.
fn renamed_materials(tx: &Transaction) -> Result<Vec<LostMaterial>> {
    let sql = "SELECT material_id, entry.slug, revision FROM entry
               JOIN material NOT INDEXED ON material.id = material_id
               WHERE material.slug <> entry.slug";
    rows(tx, sql, [], |row| {
        Ok(LostMaterial { id: row.get(0)?, slug: row.get(1)?, revision: row.get(2)? })
    })
}

/// Gives a material the name that the lists have, where its content then has the stored hash.
fn renamed_material(tx: &Transaction, renamed: &LostMaterial) -> Result<Vec<String>> {
    let LostMaterial { id, slug, .. } = renamed;
    // A damaged line is made anew.
    let Ok(name) = slug.parse::<Slug>() else { return Ok(Vec::new()) };
    tx.execute_batch("SAVEPOINT renamed")?;
    tx.execute("UPDATE material SET slug = ?2 WHERE id = ?1", params![id, slug])?;
    let stored = readable(read::get_in(tx, &name, None))?.flatten();
    if stored.as_ref().is_some_and(is_as_stored) {
        tx.execute_batch("RELEASE renamed")?;
        return Ok(vec![format!("`{slug}` has its name again")]);
    }
    tx.execute_batch("ROLLBACK TO renamed; RELEASE renamed")?;
    Ok(Vec::new())
}

/// A revision of a material if it has its stored content.
fn sound_revision(tx: &Transaction, slug: &Slug, number: u32) -> Result<Option<StoredRevision>> {
    Ok(readable(read::get_in(tx, slug, Some(number)))?.flatten().filter(is_as_stored))
}

/// What is recorded with a revision that a repair takes from this one.
fn repaired_from(slug: &Slug, row: &RevisionRow, origin: Option<Origin>) -> Activity {
    let name = format!("{slug}@{}", row.number);
    let inputs = vec![Input { name, hash: row.content_hash.clone() }];
    Activity { command: COMMAND.to_owned(), inputs, origin }
}

/// Replaces the damaged parts of the record of a revision with its stored content.
fn record_of(tx: &Transaction, slug: &Slug, row: &RevisionRow) -> Result<Vec<String>> {
    if sound_revision(tx, slug, row.number)?.is_none() {
        return Ok(Vec::new());
    }
    let changed = write::restore_record(
        tx,
        row.id,
        (slug, row.number),
        Some(&repaired_from(slug, row, None)),
    )?;
    let words = changed.iter().filter_map(|part| match part {
        Part::Number => None,
        Part::Date => Some("its date is that of the repair now"),
        Part::Command => Some("its command is `check --repair` now"),
        Part::Origin => Some("its origin was removed"),
    });
    let words: Vec<&str> = words.collect();
    Ok((!changed.is_empty())
        .then(|| {
            let (parts, words) = (record::listed(&changed), words.join(", "));
            format!("`{slug}@{}` had another {parts} than was stored; {words}", row.number)
        })
        .into_iter()
        .collect())
}

/// Makes the latest revision of a material the current one, if that is its number.
fn latest_revision(tx: &Transaction, slug: &Slug) -> Result<Vec<String>> {
    let Some(latest) = read::revision_rows(tx, slug)?.pop() else { return Ok(Vec::new()) };
    if !record::has_its_number(tx, latest.id, slug, latest.number)? {
        return Ok(Vec::new());
    }
    let sql = "UPDATE material SET current_revision = ?2 WHERE slug = ?1 AND current_revision < ?2";
    let changed = tx.execute(sql, params![slug.as_str(), latest.number])?;
    Ok((changed > 0)
        .then(|| format!("the latest revision of `{slug}` is its current one again"))
        .into_iter()
        .collect())
}

/// A material that has revisions but no row of its own, as the lists have it.
struct LostMaterial {
    id: i64,
    slug: String,
    revision: u32,
}

fn lost_materials(tx: &Transaction) -> Result<Vec<LostMaterial>> {
    let sql = "SELECT material_id, slug, revision FROM entry
               WHERE material_id NOT IN (SELECT id FROM material)
               AND material_id IN (SELECT material_id FROM revision)";
    rows(tx, sql, [], |row| {
        Ok(LostMaterial { id: row.get(0)?, slug: row.get(1)?, revision: row.get(2)? })
    })
}

/// Restores the lost row of a material.
fn lost_material(tx: &Transaction, lost: &LostMaterial) -> Result<Vec<String>> {
    let LostMaterial { id, slug, revision } = lost;
    let sql = "SELECT EXISTS (SELECT 1 FROM material NOT INDEXED WHERE slug = ?1)";
    if tx.query_row(sql, [slug], |row| row.get(0))? {
        return Err(read::damaged(format!(
            "another material has its name, `{slug}`; remove that one, then repair again"
        )));
    }
    tx.execute_batch("SAVEPOINT lost")?;
    tx.execute(
        "INSERT INTO material (id, slug, current_revision) VALUES (?1, ?2, ?3)",
        params![id, slug, revision],
    )?;
    // The hash covers the name: a wrong name is not restored.
    let name = slug.parse::<Slug>().ok();
    let stored = name.and_then(|name| read::get_in(tx, &name, None).ok().flatten());
    if stored.as_ref().is_some_and(is_as_stored) {
        tx.execute_batch("RELEASE lost")?;
        return Ok(vec![format!("`{slug}` has its row again")]);
    }
    tx.execute_batch("ROLLBACK TO lost; RELEASE lost")?;
    Ok(Vec::new())
}

/// Removes rows of lists and searches without a material or revision.
fn unreachable_lines(tx: &Transaction) -> Result<Vec<String>> {
    let condition = "NOT IN (SELECT id FROM material)";
    let of_no_revision = "AND material_id NOT IN (SELECT material_id FROM revision)";
    let mut lines = tx.execute(
        &format!("DELETE FROM entry WHERE material_id {condition} {of_no_revision}"),
        [],
    )?;
    for table in ["entry_tag", "outline"] {
        let sql = format!("DELETE FROM {table} WHERE slug NOT IN (SELECT slug FROM entry)");
        lines += tx.execute(&sql, [])?;
    }
    lines += tx.execute(&format!("DELETE FROM search WHERE rowid {condition}"), [])?;
    Ok((lines > 0)
        .then(|| format!("{lines} rows of lists and searches were of no material and were removed"))
        .into_iter()
        .collect())
}

/// Where the current revision of a material is lost, repeats the latest sound one as a new revision, unless the lost one
/// had another status, or another revision has not the number with which it was stored.
fn lost_current_revision(tx: &Transaction, slug: &Slug) -> Result<Vec<String>> {
    let sql = "SELECT current_revision, status FROM material
               LEFT JOIN entry ON entry.material_id = material.id AND revision = current_revision
               WHERE material.slug = ?1 AND NOT EXISTS
               (SELECT 1 FROM revision WHERE material_id = material.id AND number = current_revision)";
    let lost: Vec<(i64, Option<String>)> =
        rows(tx, sql, [slug.as_str()], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let Some((lost, status)) = lost.into_iter().next() else { return Ok(Vec::new()) };
    for row in read::revision_rows(tx, slug)?.into_iter().rev() {
        let Some(StoredRevision { material, activity, .. }) = sound_revision(tx, slug, row.number)?
        else {
            continue;
        };
        let number = row.number;
        if !record::has_its_number(tx, row.id, slug, number)? {
            return Err(read::damaged(format!(
                "its revision {lost} is lost, and what is called revision {number} was stored under another number"
            )));
        }
        // Lists do not know the successor of a superseded material.
        let is_confirmed = material.status.superseded_by().is_none()
            && status.as_deref() == Some(material.status.as_str());
        if !is_confirmed {
            let known =
                status.map_or(String::new(), |status| format!(", which lists call {status}"));
            return Err(read::damaged(format!(
                "its revision {lost} is lost{known}, and revision {number}, the latest that is sound, is {}; add the \
                 material again, with the status that it should have",
                material.status.as_str()
            )));
        }
        // An origin is that of the content.
        let origin = activity.and_then(|activity| activity.origin);
        let by = repaired_from(slug, &row, origin);
        let added = write::MaterialWriter::new(tx).add(&material, Some(&by))?.revision();
        return Ok(vec![format!(
            "`{slug}` has lost its revision {lost}; revision {added} repeats revision {number}"
        )]);
    }
    Ok(Vec::new())
}

/// Rewrites a revision with another content than its hash says, or with wrong derived rows.
fn revision(
    tx: &Transaction,
    row_check: &mut RowCheck,
    slug: &Slug,
    row: &RevisionRow,
    at_hand: &[&Material],
) -> Result<Vec<String>> {
    let RevisionRow { id, number, content_hash } = row;
    let place = format!("`{slug}@{number}`");
    if let Some(stored) = readable(read::get_in(tx, slug, Some(*number)))?.flatten() {
        if is_as_stored(&stored) {
            let differences = row_check.compare(tx, &stored)?;
            if differences.is_empty() {
                return Ok(Vec::new());
            }
            write::rewrite(tx, *id, &stored.material)?;
            return Ok(vec![format!("{place} was written anew")]);
        }
        if let Some((by_structure, fits)) = by_structure(tx, *id, &stored.material, content_hash)? {
            write::rewrite(tx, *id, &by_structure)?;
            return Ok(vec![format!(
                "{place} was written anew with the values in `fit.model` of {fits}: its hash covers them, and not \
                 those in `fit_parameter`"
            )]);
        }
    }
    let content = at_hand.iter().find(|material| material.content_hash() == *content_hash);
    let Some(content) = content else { return Ok(Vec::new()) };
    write::rewrite(tx, *id, content)?;
    Ok(vec![format!("{place} was written anew")])
}

/// The content of this hash that some fits of a revision give with the values that migration 11 has left in
/// `fit.model` instead of those in `fit_parameter`, and the names of those fits; `None` where no choice gives it.
fn by_structure(
    tx: &Transaction,
    revision_id: i64,
    material: &Material,
    hash: &str,
) -> Result<Option<(Material, String)>> {
    let left = law::left_in_structure(tx, revision_id)?;
    let mut disagreeing: Vec<(usize, Brdf)> = Vec::new();
    for (place, fit) in material.fits.iter().enumerate() {
        let model = left.iter().find(|(name, model)| *name == fit.name && *model != fit.model);
        disagreeing.extend(model.map(|(_, model)| (place, model.clone())));
    }
    let bits = disagreeing.len().min(MOST_TRIED_APART);
    // The hash covers the whole revision, so every choice must be tried.
    for choice in 1_usize..1 << bits {
        let (mut candidate, mut names) = (material.clone(), Vec::new());
        for (bit, (place, model)) in disagreeing.iter().enumerate() {
            if choice >> bit.min(MOST_TRIED_APART - 1) & 1 == 1 {
                let fit = &mut candidate.fits[*place];
                fit.model = model.clone();
                names.push(format!("`{}`", fit.name));
            }
        }
        if candidate.content_hash() == hash {
            return Ok(Some((candidate, names.join(", "))));
        }
    }
    Ok(None)
}

/// Rebuilds lists and searches. Where the current revision is not what was stored, they keep what they say of it.
fn lists(tx: &Transaction, slugs: &[Slug]) -> Result<Vec<String>> {
    let before = readable(stale(tx))?.unwrap_or_default();
    tx.execute("INSERT INTO search (search) VALUES ('rebuild')", [])?;
    let mut adding = write::MaterialWriter::new(tx);
    for slug in slugs {
        let Some(stored) = readable(read::get_in(tx, slug, None))?.flatten() else { continue };
        let sql =
            "SELECT material.id, revision.id, (SELECT max(revision) FROM entry WHERE slug = ?1)
                   FROM material
                   JOIN revision ON material_id = material.id AND number = current_revision
                   WHERE slug = ?1";
        let (material_id, revision_id, listed): (i64, i64, Option<u32>) =
            tx.query_row(sql, [slug.as_str()], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))?;
        // A list that knows a later revision knows one that is lost.
        if is_as_stored(&stored)
            && record::has_its_number(tx, revision_id, slug, stored.revision)?
            && listed.is_none_or(|listed| listed <= stored.revision)
        {
            adding.queue(material_id, &stored.material)?;
        }
    }
    adding.finish()?;
    let after = stale(tx)?;
    let mended = before.iter().filter(|slug| !after.contains(slug));
    Ok(mended.map(|slug| format!("lists and searches of `{slug}` were made anew")).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::builtin;
    use crate::store::tables::{follows_from_content, tables};

    #[test]
    fn a_sound_database_has_nothing_to_mend_and_stays_as_it_is() {
        let mut store = Store::in_memory().unwrap();
        let paint = builtin::get("mannequin-paint").unwrap().unwrap();
        store.add([&paint]).unwrap();
        assert_eq!(store.repair(&[]).unwrap(), Repair::default());
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
            let Repair { mended, failed, .. } = store.repair(std::slice::from_ref(&paint)).unwrap();
            assert_eq!(failed, Vec::<String>::new());
            assert_eq!(mended.is_empty(), emptied == 0, "{}: {mended:?}", table.name);
            assert_eq!(store.get(&paint.slug, None).unwrap().unwrap().material, paint);
            assert_eq!(store.damage().unwrap(), Vec::<String>::new(), "{}", table.name);
        }
    }
}
