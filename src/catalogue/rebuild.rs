//! Whether publishing the database again gives the same files.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

use super::about::About;
use super::api::Index;
use super::contents::rebuilt;
use super::folder::Checksum;
use super::layout::{ABOUT, DATABASE, INDEX, VIEW};
use super::problem::{Problem, problem};
use super::read::read;
use super::tables::HAS_PARQUET;
use super::view::CatalogueView;
use crate::store::Store;

/// Publishes once more, without writing, and compares file by file. Returns what was not compared, a sentence each.
pub(super) fn check_rebuilt(
    bundle: &Path,
    store: &Store,
    sums: &BTreeMap<String, String>,
    view: CatalogueView,
    problems: &mut Vec<Problem>,
) -> Vec<String> {
    let (scope, notes) = Scope::new(bundle, store, sums);
    // The tables have other columns since.
    if !scope.same_schema {
        return notes;
    }
    let made = match made_again(bundle, store, sums, view) {
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

/// The hashes of what this program makes of the database.
fn made_again(
    bundle: &Path,
    store: &Store,
    sums: &BTreeMap<String, String>,
    view: CatalogueView,
) -> Result<BTreeMap<String, Checksum>, Problem> {
    let taken = [taken(bundle, sums, DATABASE)?, taken(bundle, sums, VIEW)?];
    let about = read::<About>(bundle, ABOUT).map_err(|what| problem(ABOUT, what))?;
    rebuilt(store, &about, bundle, taken, view).map_err(|error| problem(DATABASE, error))
}

/// The hash and the size of a file that is not made again.
fn taken(bundle: &Path, sums: &BTreeMap<String, String>, file: &str) -> Result<Checksum, Problem> {
    let found = fs::metadata(bundle.join(file)).map_err(|reason| problem(file, reason))?;
    let sha256 = sums.get(file).cloned().unwrap_or_default();
    Ok(Checksum { sha256, bytes: found.len() })
}

/// Number of wrong files that are named one by one.
const MOST_NAMED: usize = 10;

/// Which files of a publication this program would write with the same bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Scope {
    same_version: bool,
    same_schema: bool,
    same_parquet: bool,
}

impl Scope {
    /// The scope, and sentences on what is outside.
    fn new(bundle: &Path, store: &Store, sums: &BTreeMap<String, String>) -> (Scope, Vec<String>) {
        let version = read::<Index>(bundle, INDEX).ok().and_then(|index| index.program_version);
        let has_parquet = sums.keys().any(|path| is_parquet(path));
        let same_schema = !store.is_of_older_schema();
        // Every publication with a database of today's schema states its version: without one it is compared as a whole, and the
        // index is wrong.
        let is_ours = version.as_deref().is_none_or(|version| version == env!("CARGO_PKG_VERSION"));
        let scope = Scope {
            same_version: same_schema && is_ours,
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
            if same_schema {
                "api/v1/ with the database, and those of tables/*.csv that are there"
            } else {
                "and api/v1/ with the database, whose schema is an older one"
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
