//! Databases written by any released version stay readable: for every schema there ever was, a file
//! of that schema lies in `tests/fixtures/`. It opens, holds what it should, and once brought up to
//! date has the very schema of a fresh file.
//!
//! `cargo test --test store_schema make_the_fixture -- --ignored` writes the file of the newest
//! schema; do so once when a schema is added, and never change the file again.

mod support;

use std::fs;
use std::path::{Path, PathBuf};

use matdb::material::Material;
use matdb::store::{Added, Store};
use rusqlite::Connection;
use support::database::{change, contents, fitted, sample, with_effects};

const NEWEST: &str = "schema-0003.sqlite";

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures")
}

/// Every table, index, view and trigger with its SQL, and the numbers in the header.
fn schema(path: &Path) -> (Vec<[Option<String>; 4]>, [i64; 2]) {
    let conn = Connection::open(path).unwrap();
    let sql = "SELECT type, name, tbl_name, sql FROM sqlite_schema ORDER BY type, name";
    let mut statement = conn.prepare(sql).unwrap();
    let rows = statement
        .query_map([], |row| Ok([row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?]))
        .unwrap();
    let number = |name| conn.pragma_query_value(None, name, |row| row.get(0)).unwrap();
    (rows.map(Result::unwrap).collect(), ["application_id", "user_version"].map(number))
}

/// What the file of a schema holds: all that the schema can say.
fn held(file: &str) -> [Material; 3] {
    let make = match file {
        "schema-0001.sqlite" => sample,
        "schema-0002.sqlite" => fitted,
        _ => with_effects,
    };
    [make("paint"), change(make("paint")), make("primer")]
}

/// The files of all schemas, by name.
fn files() -> Vec<String> {
    let names = fs::read_dir(fixtures()).unwrap().map(|entry| entry.unwrap().file_name());
    let names = names.map(|name| name.into_string().unwrap());
    let mut files: Vec<String> = names.filter(|name| name.ends_with(".sqlite")).collect();
    files.sort();
    files
}

/// Fills a new file as the newest schema's file is.
fn fill(path: &Path) {
    let mut store = Store::open(path).unwrap();
    for material in held(NEWEST) {
        store.add([&material]).unwrap();
    }
}

#[test]
fn files_of_every_schema_open_and_become_the_newest() {
    let folder = tempfile::tempdir().unwrap();
    let fresh = folder.path().join("fresh.sqlite");
    drop(Store::open(&fresh).unwrap());
    for file in files() {
        let old = folder.path().join("old.sqlite");
        fs::write(&old, fs::read(fixtures().join(&file)).unwrap()).unwrap();
        let mut store = Store::open(&old).unwrap();
        assert_eq!(store.add([&held(&file)[2]]).unwrap(), [Added::Unchanged(1)]);
        drop(store);
        assert_eq!(contents(&old), held(&file));
        assert_eq!(schema(&old), schema(&fresh));
    }
}

#[test]
fn files_of_every_schema_are_read_as_they_are_and_not_changed() {
    for file in files() {
        let folder = tempfile::tempdir().unwrap();
        let old = folder.path().join("old.sqlite");
        let before = fs::read(fixtures().join(&file)).unwrap();
        fs::write(&old, &before).unwrap();
        let mut permissions = fs::metadata(&old).unwrap().permissions();
        permissions.set_readonly(true);
        fs::set_permissions(&old, permissions).unwrap();
        assert_eq!(contents(&old), held(&file), "{file}");
        assert!(fs::read(&old).unwrap() == before, "{file} was written to");
        assert_eq!(support::entries(folder.path()), ["old.sqlite"]);
        support::matdb(folder.path()).args(["list", "--db", "old.sqlite"]).assert().success();
        support::matdb(folder.path())
            .args(["show", "paint", "--db", "old.sqlite"])
            .assert()
            .success();
        assert!(fs::read(&old).unwrap() == before, "{file} was written to");
    }
}

#[test]
fn the_newest_schema_has_its_file() {
    let folder = tempfile::tempdir().unwrap();
    let (fresh, kept) = (folder.path().join("fresh.sqlite"), folder.path().join("kept.sqlite"));
    fill(&fresh);
    fs::write(&kept, fs::read(fixtures().join(NEWEST)).unwrap()).unwrap();
    assert_eq!(contents(&kept), contents(&fresh));
    assert_eq!(schema(&kept), schema(&fresh));
}

#[test]
#[ignore = "writes into the source tree; see the top of this file"]
fn make_the_fixture() {
    let path = fixtures().join(NEWEST);
    assert!(!path.exists(), "{} is never changed again", path.display());
    fill(&path);
    // Small pages for a small file.
    let shrink =
        "PRAGMA journal_mode = delete; PRAGMA page_size = 1024; VACUUM; PRAGMA journal_mode = wal;";
    Connection::open(&path).unwrap().execute_batch(shrink).unwrap();
}

#[test]
fn numbers_are_kept_with_their_units_and_uncertainty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sqlite");
    fill(&path);
    let conn = Connection::open(&path).unwrap();
    let sql = "SELECT path, value, unit, sd FROM fit_parameter ORDER BY revision_id, position";
    let read = |row: &rusqlite::Row| Ok((row.get(0)?, row.get(1)?, row.get(2)?, row.get(3)?));
    let first: (String, f64, String, Option<f64>) = conn.query_row(sql, [], read).unwrap();
    let parameter = sample("paint").fits[0].model.parameters().remove(0);
    assert_eq!(first, (parameter.path, parameter.value, "1".to_owned(), Some(0.1)));
}

#[test]
fn the_database_itself_refuses_what_a_material_may_not_be() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sqlite");
    fill(&path);
    let conn = Connection::open(&path).unwrap();
    for sql in [
        "UPDATE observation SET sigma0 = NULL WHERE censor = 'none'",
        "UPDATE observation SET sigma0 = 1.0 WHERE censor = 'left'",
        "UPDATE observation SET sigma0 = -1.0 WHERE censor = 'none'",
        "UPDATE observation SET censor = 'maybe'",
        "UPDATE observation SET threshold_sigma0 = NULL",
        "UPDATE observation SET theta_i_rad = 1.6",
        "UPDATE source SET kind = 'guessed'",
        "UPDATE source SET key = 'other'",
        "UPDATE curve SET source = 'other'",
        "UPDATE curve SET instrument = 'other'",
        "UPDATE fit SET curve = 'other'",
        "UPDATE fit_parameter SET source = 'other'",
        "UPDATE fit_covariance SET row_path = 'other'",
        "UPDATE material SET slug = 'Upper'",
        "UPDATE material SET current_revision = 9",
        "UPDATE revision SET frequency_min_hz = 'low'",
        "UPDATE revision SET theta_max_rad = 2",
        "UPDATE revision SET tags = '{}'",
        "UPDATE observation SET theta_sd_rad = 1.6",
        "UPDATE observation SET power_w = 0.0",
        "UPDATE observation SET range_m = -1.0",
        "UPDATE observation SET chirp = -1",
        "UPDATE observation SET chirp = 4294967296",
        "UPDATE fit SET report = '[]'",
        "UPDATE fit SET report = 'nonsense'",
        "UPDATE effect SET name = ''",
        "UPDATE effect SET name = 'other'",
        "UPDATE effect SET revision_id = 99",
        "UPDATE effect_parameter SET effect = 'other'",
        "UPDATE effect_parameter SET value = 'much'",
    ] {
        assert!(conn.execute(sql, []).is_err(), "{sql}");
    }
}
