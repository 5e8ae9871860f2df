//! Verifying a publication: every file has its listed hash, every material is that of the database, and every fit
//! follows from its curve. Nothing outside the folder is used.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io;
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::api::{Entry, Index, LARGEST_MATERIAL_BYTES, Record};
use super::check_store::{CheckCount, Refit, StoreCheck};
use super::error::CatalogueError;
use super::folder::hashed;
use super::layout::{DATABASE, INDEX, MATERIALS, SUMS, material_path};
use super::listing::files;
use super::problem::{Problem, problem};
use super::read::{LARGEST_FILE_BYTES, LARGEST_TABLE_BYTES, read};
use super::rebuild::check_rebuilt;
use super::view::CatalogueView;
use crate::files::FilesError;
use crate::store::{Store, StoredRevision};

/// What [`verify_with`] found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verification {
    /// Files of the publication.
    pub files: usize,
    /// What of its database was checked.
    #[serde(flatten)]
    pub checked: CheckCount,
    /// What could not be checked, a sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
    /// Everything that is wrong, in the order of the checks; none: the publication is sound.
    pub problems: Vec<Problem>,
}

/// Checks a published folder, or a database by itself. `view` says where `view.html`, which counts by its checksum, shows a
/// material. [`adopt::verify`](crate::adopt::verify) has this program's page.
///
/// # Errors
/// When `bundle` is neither. Whatever is wrong inside is in [`Verification::problems`].
pub fn verify_with(bundle: &Path, view: CatalogueView) -> Result<Verification, CatalogueError> {
    let mut verified = Verification::default();
    let problems = &mut verified.problems;
    if bundle.is_file() {
        alone(bundle)?;
        let store = database(bundle)?;
        verified.checked = StoreCheck {
            name: DATABASE,
            refit: Refit::Current,
            report: &mut |found| problems.push(found),
            advance: &mut || (),
        }
        .run(&store);
        return Ok(verified);
    }
    let sums = sums(bundle, problems)?;
    verified.files = sums.len() + 1;
    check_files(bundle, &sums, problems)?;
    if !sums.contains_key(DATABASE) {
        problems.push(problem(DATABASE, "is not listed in SHA256SUMS"));
    }
    // A damaged file is not opened: nothing that it says would count.
    if problems.iter().any(|found| found.place.starts_with(DATABASE)) {
        return Ok(verified);
    }
    match database(&bundle.join(DATABASE)) {
        Ok(store) => {
            verified.checked = check_content(bundle, &store, &sums, problems);
            // What is wrong already would be found wrong again in every file made of it.
            if problems.is_empty() {
                verified.notes = check_rebuilt(bundle, &store, &sums, view, problems);
            }
        }
        Err(error) => problems.push(problem(DATABASE, error)),
    }
    Ok(verified)
}

/// What is wrong with a publication before it takes its place: its files, read from the disk, against their hashes
/// and against its database, and current fits against their curves. No file is made again: all have just been.
pub(super) fn check_staged(bundle: &Path, store: &Store) -> Result<Vec<Problem>, CatalogueError> {
    let mut problems = Vec::new();
    let sums = sums(bundle, &mut problems)?;
    check_files(bundle, &sums, &mut problems)?;
    check_content(bundle, store, &sums, &mut problems);
    Ok(problems)
}

/// Opens the database of a publication.
pub(super) fn database(path: &Path) -> Result<Store, CatalogueError> {
    let size = fs::metadata(path).map_err(|reason| unreadable(path, reason))?.len();
    if size > LARGEST_TABLE_BYTES {
        return Err(no_bundle(path, "it is larger than any catalogue may be"));
    }
    let store = Store::open_frozen(path)?.ok_or_else(|| no_bundle(path, "it is empty"))?;
    if !store.has_own_schema()? {
        return Err(no_bundle(path, "its tables, indexes or views are not those that matdb makes"));
    }
    Ok(store)
}

/// Whether SQLite would read, roll back or remove the file together with the database.
fn is_beside_database(path: &str) -> bool {
    path.strip_prefix(DATABASE).is_some_and(|ending| ending.starts_with('-'))
}

/// Refuses a database with something beside it that says more, or something else.
fn alone(path: &Path) -> Result<(), CatalogueError> {
    for ending in ["-journal", "-wal"] {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        // An empty log says nothing, and readers leave such behind.
        if fs::symlink_metadata(&name).is_ok_and(|found| found.len() > 0) {
            let problem = format!(
                "{} lies beside it, so that the file by itself is not all of it (`matdb publish` makes a \
                 copy that is)",
                Path::new(&name).display()
            );
            return Err(CatalogueError::NoBundle { path: path.to_owned(), problem });
        }
    }
    Ok(())
}

fn no_bundle(path: &Path, problem: &str) -> CatalogueError {
    CatalogueError::NoBundle { path: path.to_owned(), problem: problem.to_owned() }
}

fn unreadable(path: &Path, reason: io::Error) -> CatalogueError {
    FilesError::unreadable(path, reason).into()
}

/// The list of hashes: path → SHA-256.
fn sums(
    bundle: &Path,
    problems: &mut Vec<Problem>,
) -> Result<BTreeMap<String, String>, CatalogueError> {
    let path = bundle.join(SUMS);
    match fs::symlink_metadata(&path) {
        Ok(found) if !found.is_file() => {
            return Err(no_bundle(bundle, "its SHA256SUMS is not a plain file"));
        }
        Ok(found) if found.len() > LARGEST_FILE_BYTES => {
            return Err(no_bundle(bundle, "its SHA256SUMS is larger than 1 GiB"));
        }
        Ok(_) => {}
        Err(_) => return Err(no_bundle(bundle, "it has no SHA256SUMS")),
    }
    let text = fs::read_to_string(&path).map_err(|reason| unreadable(&path, reason))?;
    let mut sums = BTreeMap::new();
    for (number, line) in (1..).zip(text.lines()) {
        let place = || format!("{SUMS}, line {number}");
        match line.split_once("  ") {
            Some((sum, path)) if sum.len() == 64 && is_inside(path) => {
                if sums.insert(path.to_owned(), sum.to_owned()).is_some() {
                    problems.push(problem(place(), "names a file for the second time"));
                }
            }
            Some((_, path)) if !is_inside(path) => {
                problems.push(problem(place(), "names a file outside the folder"));
            }
            _ => problems.push(problem(place(), "is not a hash with a path")),
        }
    }
    Ok(sums)
}

/// Whether a path stays within the folder that it is taken from.
fn is_inside(path: &str) -> bool {
    path.split('/').all(|part| !["", ".", ".."].contains(&part))
        && !path.contains(['\\', ':', '\0'])
}

fn check_files(
    bundle: &Path,
    sums: &BTreeMap<String, String>,
    problems: &mut Vec<Problem>,
) -> Result<(), CatalogueError> {
    let found = files(bundle).map_err(|reason| unreadable(bundle, reason))?;
    for (path, is_plain) in &found {
        match sums.get(path) {
            _ if is_beside_database(path) => {
                problems
                    .push(problem(path, "would be taken for a part of the database; remove it"));
            }
            _ if !is_plain => problems.push(problem(path, "is a link or no plain file")),
            None if path == SUMS => {}
            None => problems.push(problem(path, "is not listed in SHA256SUMS")),
            Some(sum) => problems.extend(check_file(bundle, path, sum)),
        }
    }
    for path in sums.keys() {
        if found.binary_search_by(|(known, _)| known.cmp(path)).is_err() {
            problems.push(problem(path, "is missing"));
        }
    }
    Ok(())
}

fn check_file(bundle: &Path, path: &str, sum: &str) -> Option<Problem> {
    let limit = match path {
        path if path == DATABASE || path.starts_with("tables/") => LARGEST_TABLE_BYTES,
        path if path.starts_with(MATERIALS) => LARGEST_MATERIAL_BYTES,
        _ => LARGEST_FILE_BYTES,
    };
    let file = bundle.join(path);
    match fs::metadata(&file) {
        Ok(found) if found.len() > limit => {
            return Some(problem(path, format!("is larger than {} MiB", limit >> 20)));
        }
        _ => {}
    }
    match File::open(file).and_then(hashed) {
        Ok(found) if found.sha256 == sum => None,
        Ok(_) => Some(problem(path, "is not what SHA256SUMS says: its hash differs")),
        Err(reason) => Some(problem(path, reason)),
    }
}

/// Checks that files and database say the same.
fn check_content(
    bundle: &Path,
    store: &Store,
    sums: &BTreeMap<String, String>,
    problems: &mut Vec<Problem>,
) -> CheckCount {
    let mut entries = Vec::new();
    let check = StoreCheck {
        name: DATABASE,
        refit: Refit::Current,
        report: &mut |found| problems.push(found),
        advance: &mut || (),
    };
    let checked = check.run_with(store, |summary, stored, report| {
        entries.push(Entry::new(summary, stored));
        if let Some(found) = check_record(bundle, stored) {
            report(found);
        }
    });
    problems.extend(check_index(bundle, &entries));
    let known: BTreeSet<&str> = entries.iter().map(|entry| entry.path.as_str()).collect();
    let strangers = sums.keys().filter(|path| path.starts_with(MATERIALS));
    let strangers = strangers.filter(|path| !known.contains(path.as_str()));
    problems.extend(strangers.map(|path| problem(path, "is of no material of the database")));
    checked
}

fn check_record(bundle: &Path, stored: &StoredRevision) -> Option<Problem> {
    let path = material_path(stored.material.slug.as_str());
    let mut wanted = serde_json::to_value(Record::new(stored)).unwrap_or_default();
    match read::<Value>(bundle, &path) {
        Ok(found) if found == wanted => None,
        // An older program wrote none.
        Ok(found) if found.get("origin").is_none() && found == without(&mut wanted, "origin") => {
            None
        }
        Ok(_) => Some(problem(path, "says something else than the database")),
        Err(what) => Some(problem(path, what)),
    }
}

fn without(value: &mut Value, key: &str) -> Value {
    value.as_object_mut().and_then(|object| object.remove(key));
    value.take()
}

fn check_index(bundle: &Path, entries: &[Entry]) -> Option<Problem> {
    match read::<Index>(bundle, INDEX) {
        Ok(Index { materials, .. })
            if materials.len() == entries.len()
                && materials.iter().zip(entries).all(|(said, entry)| said.is_of(entry)) =>
        {
            None
        }
        Ok(_) => Some(problem(INDEX, "lists something else than the database")),
        Err(what) => Some(problem(INDEX, what)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_that_leaves_the_folder_is_seen() {
        for good in ["a", "api/v1/index.json", ".zenodo.json", "a..b"] {
            assert!(is_inside(good), "{good}");
        }
        for bad in ["", "/etc/passwd", "../a", "a/../../b", "a//b", "./a", "C:a", "a\\..\\b"] {
            assert!(!is_inside(bad), "{bad}");
        }
    }
}
