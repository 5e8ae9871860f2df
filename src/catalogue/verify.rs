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

use super::about::About;
use super::api::{Entry, Index, LARGEST_MATERIAL_BYTES, Record, SCHEMA_VERSION};
use super::contents::rebuilt;
use super::error::CatalogueError;
use super::folder::{Sum, files, hashed};
use super::layout::{ABOUT, DATABASE, INDEX, MATERIALS, SUMS, material_path};
use super::tables::HAS_PARQUET;
use crate::fit::again::{lacks_report, problems};
use crate::material::Fit;
use crate::store::{Again, RevisionSummary, Store, StoreError, Stored, Summary};

/// Largest database or table that is read, bytes.
pub const LARGEST_TABLE_BYTES: u64 = 64 << 30;
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
    /// What could not be checked, a sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<String>,
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
        alone(bundle)?;
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
        Ok(store) => {
            verified.checked = check_content(bundle, &store, &sums, Refit::All, problems);
            // What is wrong already would be found wrong again in every file made of it.
            if problems.is_empty() {
                verified.notes = check_rebuilt(bundle, &store, &sums, problems);
            }
        }
        Err(error) => problems.push(problem(DATABASE, error)),
    }
    Ok(verified)
}

/// Checks a database: its pages and indexes are sound, every revision has the content that its hash
/// says, what else is stored follows from that, and every fit of a current revision from its curve. `report` hears of everything that is wrong.
pub fn check_store(store: &Store, report: &mut dyn FnMut(Problem)) -> Checked {
    check_each(store, Refit::All, report, |_, _, _| ())
}

/// What is wrong with a publication before it takes its place: its files, read from the disk, against their hashes
/// and against its database. Fits are not made again, and no file is: both have just been.
pub(super) fn check_staged(bundle: &Path, store: &Store) -> Result<Vec<Problem>, CatalogueError> {
    let mut problems = Vec::new();
    let sums = sums(bundle, &mut problems)?;
    check_files(bundle, &sums, &mut problems)?;
    if !store.has_own_schema()? {
        problems.push(problem(DATABASE, "its tables, indexes or views are not those of matdb"));
    }
    check_content(bundle, store, &sums, Refit::None, &mut problems);
    Ok(problems)
}

/// Which fits are made again.
#[derive(Clone, Copy, PartialEq)]
enum Refit {
    None,
    All,
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
    let store = Store::open_frozen(path)?.ok_or_else(|| no_bundle("it is empty"))?;
    match store.has_own_schema()? {
        true => Ok(store),
        false => Err(no_bundle("its tables, indexes or views are not those that matdb makes")),
    }
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
    let is_there = |path: &String| found.binary_search_by(|(known, _)| known.cmp(path)).is_ok();
    let missing = sums.keys().filter(|path| !is_there(path));
    problems.extend(missing.map(|path| problem(path, "is missing")));
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

/// Goes through a database; `each` sees every current revision with its line in the list.
fn check_each(
    store: &Store,
    refit: Refit,
    report: &mut dyn FnMut(Problem),
    mut each: impl FnMut(&Summary, &Stored, &mut dyn FnMut(Problem)),
) -> Checked {
    let mut checked = Checked::default();
    let opened = check_file_itself(store, report).and_then(|()| Ok((store.list()?, Again::new()?)));
    let (summaries, mut again) = match opened {
        Ok(opened) => opened,
        Err(error) => {
            report(problem("materials", error));
            return checked;
        }
    };
    for summary in &summaries {
        checked.materials += 1;
        let done =
            check_material(store, &mut again, summary, refit, report, &mut checked, &mut each);
        if let Err(error) = done {
            report(problem(summary.slug.as_str(), error));
        }
    }
    checked
}

fn check_file_itself(store: &Store, report: &mut dyn FnMut(Problem)) -> Result<(), StoreError> {
    store.damage()?.into_iter().for_each(|what| report(problem(DATABASE, what)));
    if !Again::new()?.has_own_units(store)? {
        report(problem(DATABASE, OTHER_UNITS));
    }
    Ok(())
}

/// What is wrong with a database whose table of units was changed.
pub const OTHER_UNITS: &str = "its units of columns are not those that matdb writes";

/// What of a stored revision does not follow from its content: statistics of curves, numbers beside
/// parameters, and whatever else the program writes twice.
///
/// # Errors
/// When the database cannot be read.
pub fn derived(
    again: &mut Again,
    store: &Store,
    stored: &Stored,
) -> Result<Vec<Problem>, StoreError> {
    let place = format!("{}@{}", stored.material.slug, stored.revision);
    let differences = again.differences(store, stored)?.into_iter();
    Ok(differences
        .map(|found| match found.curve {
            Some(curve) => problem(
                format!("{place}, curve {curve}"),
                "its statistics are not those of its points",
            ),
            None => problem(
                place.clone(),
                format!("its rows of `{}` are not those that its content gives", found.table),
            ),
        })
        .collect())
}

fn check_material(
    store: &Store,
    again: &mut Again,
    summary: &Summary,
    refit: Refit,
    report: &mut dyn FnMut(Problem),
    checked: &mut Checked,
    each: &mut impl FnMut(&Summary, &Stored, &mut dyn FnMut(Problem)),
) -> Result<(), StoreError> {
    for RevisionSummary { revision, .. } in store.history(&summary.slug)? {
        let place = || format!("{}@{revision}", summary.slug);
        // Reading recomputes the hash.
        let stored = match store.get(&summary.slug, Some(revision)) {
            Ok(Some(stored)) => stored,
            Ok(None) => {
                report(problem(place(), "is not there"));
                continue;
            }
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
        derived(again, store, &stored)?.into_iter().for_each(&mut *report);
        if revision == summary.revision {
            if refit == Refit::All {
                checked.fits += check_fits(&stored, report);
            }
            each(summary, &stored, report);
        }
    }
    Ok(())
}

fn check_fits(stored: &Stored, report: &mut dyn FnMut(Problem)) -> usize {
    let material = &stored.material;
    for fit in material.fits.iter().filter(|fit| lacks_report(fit)) {
        let place = format!("{}@{}, fit `{}`", material.slug, stored.revision, fit.name);
        report(problem(place, without_report(fit)));
    }
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

/// What is wrong with a fit whose report was taken away.
pub fn without_report(fit: &Fit) -> String {
    format!("was found by `{}`, but the report of that is not there", fit.estimator)
}

/// Checks that files and database say the same.
fn check_content(
    bundle: &Path,
    store: &Store,
    sums: &BTreeMap<String, String>,
    refit: Refit,
    problems: &mut Vec<Problem>,
) -> Checked {
    let mut entries = Vec::new();
    let checked =
        check_each(store, refit, &mut |found| problems.push(found), |summary, stored, report| {
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

/// Publishes once more, without writing, and compares file by file; what was left out, a sentence each.
fn check_rebuilt(
    bundle: &Path,
    store: &Store,
    sums: &BTreeMap<String, String>,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let (scope, notes) = Scope::new(bundle, store, sums);
    // Tables have other columns since.
    if !scope.same_schema {
        return notes;
    }
    let made = database_sum(bundle, sums).and_then(|database| {
        let about = read::<About>(bundle, ABOUT).map_err(|what| problem(ABOUT, what))?;
        rebuilt(store, &about, bundle, database).map_err(|error| problem(DATABASE, error))
    });
    let made = match made {
        Ok(made) => made,
        Err(what) => {
            problems.push(what);
            return Vec::new();
        }
    };
    let paths: BTreeSet<&String> = sums.keys().chain(made.keys()).collect();
    let mut wrong = paths.into_iter().filter(|path| scope.has(path)).filter_map(|path| {
        match (sums.get(path), made.get(path)) {
            (Some(sum), Some(made)) if *sum == made.sha256 => None,
            (Some(_), Some(_)) => Some(problem(path, "is not what its database gives")),
            (Some(_), None) => Some(problem(path, "is of no publication of its database")),
            // An older version had fewer tables.
            (None, _) if !scope.same_version => None,
            (None, _) => Some(problem(path, "is missing: its database gives it")),
        }
    });
    problems.extend(wrong.by_ref().take(MOST_NAMED));
    let more = wrong.count();
    if more > 0 {
        problems.push(problem(".", format!("{more} more files are not what its database gives")));
    }
    notes
}

/// The database as its hash was found to be.
fn database_sum(bundle: &Path, sums: &BTreeMap<String, String>) -> Result<Sum, Problem> {
    let found = fs::metadata(bundle.join(DATABASE)).map_err(|reason| problem(DATABASE, reason))?;
    let sha256 = sums.get(DATABASE).cloned().unwrap_or_default();
    Ok(Sum { sha256, bytes: found.len() })
}

/// Files that are named one by one.
const MOST_NAMED: usize = 10;

/// Which files of a publication this program would write just so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Scope {
    same_version: bool,
    same_schema: bool,
    same_parquet: bool,
}

impl Scope {
    /// The scope, and what is outside.
    fn new(bundle: &Path, store: &Store, sums: &BTreeMap<String, String>) -> (Scope, Vec<String>) {
        let version = read::<Index>(bundle, INDEX).ok().and_then(|index| index.program_version);
        let has_parquet = sums.keys().any(|path| is_parquet(path));
        let same_schema = !store.is_of_older_schema();
        let scope = Scope {
            same_version: same_schema && version.as_deref() == Some(env!("CARGO_PKG_VERSION")),
            same_schema,
            same_parquet: has_parquet == HAS_PARQUET,
        };
        let by = version.map_or("an older matdb".to_owned(), |version| format!("matdb {version}"));
        let other_version = format!(
            "{by} has published this and this is matdb {}: compared were the hashes of all files, the \
             database in itself, its fits with their curves, {}; not compared were the pages, {}Parquet, \
             the records (datapackage.json, CITATION.cff and others), tables/units.csv, and whether a \
             table is missing",
            env!("CARGO_PKG_VERSION"),
            match same_schema {
                true => "api/v1/ with the database, and those of tables/*.csv that are there",
                false => "and api/v1/ with the database, whose schema is an older one",
            },
            if same_schema { "" } else { "tables/*.csv, " }
        );
        let other_tables = "this matdb was built with other formats of tables, so that Parquet and the \
                            records that list it were not made again";
        let notes = match scope {
            Scope { same_version: false, .. } => vec![other_version],
            Scope { same_parquet: false, .. } => vec![other_tables.to_owned()],
            _ => Vec::new(),
        };
        (scope, notes)
    }

    fn has(self, path: &str) -> bool {
        const LISTS: [&str; 3] = ["datapackage.json", "dataset.jsonld", "ro-crate-metadata.json"];
        match self {
            Scope { same_version: false, .. } => {
                // The list of units has a line for every table that the program knows.
                path.starts_with("tables/") && path.ends_with(".csv") && path != "tables/units.csv"
            }
            Scope { same_parquet: false, .. } => !is_parquet(path) && !LISTS.contains(&path),
            _ => true,
        }
    }
}

fn is_parquet(path: &str) -> bool {
    path.starts_with("tables/") && path.ends_with(".parquet")
}

fn check_record(bundle: &Path, stored: &Stored) -> Option<Problem> {
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

/// What a publication says of itself.
pub(super) fn about(bundle: &Path) -> Result<About, String> {
    read(bundle, ABOUT).map_err(|what| format!("{ABOUT}: {what}"))
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
