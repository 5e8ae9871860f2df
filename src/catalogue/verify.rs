//! Whether a publication is what it says: every file as listed, every material as in the database, every
//! fit as its curve gives it. Nothing outside the folder is asked.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::fs::{self, File};
use std::io;
use std::path::Path;

use serde::Serialize;
use serde::de::DeserializeOwned;
use serde_json::Value;

use super::CatalogueError;
use super::api::{self, Entry, Index, Record, SCHEMA_VERSION};
use super::folder::{INDEX, SUMS, files, hashed};
use super::publish::DATABASE;
use crate::fit::again::problems;
use crate::store::{RevisionSummary, Store, StoreError, Stored, Summary};

/// Largest database or table that is read, bytes.
pub const LARGEST_TABLE_BYTES: u64 = 64 << 30;
/// Largest file of a single material, bytes.
pub const LARGEST_MATERIAL_BYTES: u64 = 32 << 20;
/// Largest file of any other kind, bytes.
pub const LARGEST_FILE_BYTES: u64 = 1 << 30;

/// Something that is not as it should be.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Problem {
    /// The file, or the material and its revision.
    pub place: String,
    /// What is wrong.
    pub problem: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.problem)
    }
}

fn problem(place: impl Into<String>, problem: impl fmt::Display) -> Problem {
    Problem { place: place.into(), problem: problem.to_string() }
}

/// How much was checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Checked {
    /// Materials.
    pub materials: usize,
    /// Their revisions, whose hashes were recomputed.
    pub revisions: usize,
    /// Fits of current revisions that were made again.
    pub fits: usize,
}

/// What [`verify`] found.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Verified {
    /// Files of the publication.
    pub files: usize,
    /// What of its database was checked.
    #[serde(flatten)]
    pub checked: Checked,
    /// Everything that is wrong, in the order of the checks; none: the publication is sound.
    pub problems: Vec<Problem>,
}

/// Checks a published folder, or a database by itself.
///
/// # Errors
/// When `bundle` is neither. Whatever is wrong inside is in [`Verified::problems`].
pub fn verify(bundle: &Path) -> Result<Verified, CatalogueError> {
    let mut verified = Verified::default();
    let problems = &mut verified.problems;
    if bundle.is_file() {
        let store = database(bundle)?;
        verified.checked = check_store(&store, &mut |found| problems.push(found));
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
        Ok(store) => verified.checked = check_content(bundle, &store, &sums, problems),
        Err(error) => problems.push(problem(DATABASE, error)),
    }
    Ok(verified)
}

/// Checks a database: every revision has the content that its hash says, and every fit of a current
/// revision follows from its curve. `report` hears of everything that is wrong.
pub fn check_store(store: &Store, report: &mut dyn FnMut(Problem)) -> Checked {
    check_each(store, report, |_, _, _| ())
}

/// Opens the database of a publication.
pub(super) fn database(path: &Path) -> Result<Store, CatalogueError> {
    let no_bundle = |problem: &str| CatalogueError::NoBundle {
        path: path.to_owned(),
        problem: problem.to_owned(),
    };
    let size = fs::metadata(path).map_err(|reason| unreadable(path, reason))?.len();
    if size > LARGEST_TABLE_BYTES {
        return Err(no_bundle("it is larger than any catalogue may be"));
    }
    let store = Store::open_existing(path)?.ok_or_else(|| no_bundle("it is empty"))?;
    match store.has_own_schema()? {
        true => Ok(store),
        false => Err(no_bundle("its tables, indexes or views are not those that matdb makes")),
    }
}

fn unreadable(path: &Path, reason: io::Error) -> CatalogueError {
    CatalogueError::Io { verb: "read", path: path.to_owned(), reason }
}

/// The list of hashes: path → SHA-256.
fn sums(
    bundle: &Path,
    problems: &mut Vec<Problem>,
) -> Result<BTreeMap<String, String>, CatalogueError> {
    let path = bundle.join(SUMS);
    let no_bundle = |problem: &str| CatalogueError::NoBundle {
        path: bundle.to_owned(),
        problem: problem.to_owned(),
    };
    match fs::symlink_metadata(&path) {
        Ok(found) if !found.is_file() => return Err(no_bundle("its SHA256SUMS is no plain file")),
        Ok(found) if found.len() > LARGEST_FILE_BYTES => {
            return Err(no_bundle("its SHA256SUMS is larger than 1 GiB"));
        }
        Ok(_) => {}
        Err(_) => return Err(no_bundle("it has no SHA256SUMS")),
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
            _ => problems.push(problem(place(), "is no hash with a path")),
        }
    }
    Ok(sums)
}

/// Whether a path stays within the folder that it is taken from.
fn is_inside(path: &str) -> bool {
    let is_name = |part: &str| !part.is_empty() && part != "." && part != "..";
    path.split('/').all(is_name) && !path.contains(['\\', ':', '\0'])
}

fn check_files(
    bundle: &Path,
    sums: &BTreeMap<String, String>,
    problems: &mut Vec<Problem>,
) -> Result<(), CatalogueError> {
    let found = files(bundle).map_err(|reason| unreadable(bundle, reason))?;
    for (path, is_plain) in &found {
        match sums.get(path) {
            _ if !is_plain => problems.push(problem(path, "is a link or no plain file")),
            None if path == SUMS => {}
            None => problems.push(problem(path, "is not listed in SHA256SUMS")),
            Some(sum) => problems.extend(check_file(bundle, path, sum)),
        }
    }
    let is_there = |path: &String| found.binary_search_by(|(known, _)| known.cmp(path)).is_ok();
    let missing = sums.keys().filter(|path| !is_there(path));
    problems.extend(missing.map(|path| problem(path, "is missing")));
    Ok(())
}

fn check_file(bundle: &Path, path: &str, sum: &str) -> Option<Problem> {
    let limit = match path {
        path if path == DATABASE || path.starts_with("tables/") => LARGEST_TABLE_BYTES,
        path if path.starts_with(api::FOLDER) => LARGEST_MATERIAL_BYTES,
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

/// Goes through a database; `each` sees every current revision with its line in the list.
fn check_each(
    store: &Store,
    report: &mut dyn FnMut(Problem),
    mut each: impl FnMut(&Summary, &Stored, &mut dyn FnMut(Problem)),
) -> Checked {
    let mut checked = Checked::default();
    let summaries = match store.list() {
        Ok(summaries) => summaries,
        Err(error) => {
            report(problem("materials", error));
            return checked;
        }
    };
    for summary in &summaries {
        checked.materials += 1;
        if let Err(error) = check_material(store, summary, report, &mut checked, &mut each) {
            report(problem(summary.slug.as_str(), error));
        }
    }
    checked
}

fn check_material(
    store: &Store,
    summary: &Summary,
    report: &mut dyn FnMut(Problem),
    checked: &mut Checked,
    each: &mut impl FnMut(&Summary, &Stored, &mut dyn FnMut(Problem)),
) -> Result<(), StoreError> {
    for RevisionSummary { revision, .. } in store.history(&summary.slug)? {
        let place = || format!("{}@{revision}", summary.slug);
        // Reading recomputes the hash.
        let stored = match store.get(&summary.slug, Some(revision)) {
            Ok(Some(stored)) => stored,
            Ok(None) => continue,
            Err(StoreError::Corrupt { problem: what, .. }) => {
                report(problem(place(), what));
                continue;
            }
            Err(error) => return Err(error),
        };
        checked.revisions += 1;
        if let Err(error) = stored.material.validate() {
            report(problem(place(), error));
            continue;
        }
        if revision == summary.revision {
            checked.fits += check_fits(&stored, report);
            each(summary, &stored, report);
        }
    }
    Ok(())
}

fn check_fits(stored: &Stored, report: &mut dyn FnMut(Problem)) -> usize {
    let material = &stored.material;
    let again = material.fits.iter().filter_map(|fit| Some((fit, problems(material, fit)?)));
    again
        .map(|(fit, wrong)| {
            for what in wrong {
                let place = format!("{}@{}, fit `{}`", material.slug, stored.revision, fit.name);
                report(problem(place, what));
            }
        })
        .count()
}

/// Checks that files and database say the same.
fn check_content(
    bundle: &Path,
    store: &Store,
    sums: &BTreeMap<String, String>,
    problems: &mut Vec<Problem>,
) -> Checked {
    let mut entries = Vec::new();
    let checked =
        check_each(store, &mut |found| problems.push(found), |summary, stored, report| {
            entries.push(Entry::new(summary, stored));
            if let Some(found) = check_record(bundle, stored) {
                report(found);
            }
        });
    problems.extend(check_index(bundle, &entries));
    let known: BTreeSet<&str> = entries.iter().map(|entry| entry.path.as_str()).collect();
    let strangers = sums.keys().filter(|path| path.starts_with(api::FOLDER));
    let strangers = strangers.filter(|path| !known.contains(path.as_str()));
    problems.extend(strangers.map(|path| problem(path, "is of no material of the database")));
    checked
}

fn check_record(bundle: &Path, stored: &Stored) -> Option<Problem> {
    let path = api::path(stored.material.slug.as_str());
    let wanted = serde_json::to_value(Record::new(stored)).ok();
    match read::<Value>(bundle, &path) {
        Ok(found) if Some(&found) == wanted.as_ref() => None,
        Ok(_) => Some(problem(path, "says something else than the database")),
        Err(what) => Some(problem(path, what)),
    }
}

fn check_index(bundle: &Path, entries: &[Entry]) -> Option<Problem> {
    match read::<Index>(bundle, INDEX) {
        Ok(index) if index.materials == entries => None,
        Ok(_) => Some(problem(INDEX, "lists something else than the database")),
        Err(what) => Some(problem(INDEX, what)),
    }
}

fn read<T: DeserializeOwned>(bundle: &Path, path: &str) -> Result<T, String> {
    let place = bundle.join(path);
    let limit = if path == INDEX { LARGEST_FILE_BYTES } else { LARGEST_MATERIAL_BYTES };
    let size = fs::metadata(&place).map_err(|reason| reason.to_string())?.len();
    if size > limit {
        return Err("is too large to read".to_owned());
    }
    let bytes = fs::read(place).map_err(|reason| reason.to_string())?;
    serde_json::from_slice(&bytes).map_err(|error| error.to_string())
}

/// Whether a newer program has published this: its files may say what this one would not understand.
pub(super) fn is_newer(bundle: &Path) -> bool {
    #[derive(serde::Deserialize)]
    struct Version {
        schema_version: u32,
    }
    read::<Version>(bundle, INDEX).is_ok_and(|found| found.schema_version > SCHEMA_VERSION)
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
