//! Databases written by any released version stay readable: for every schema there ever was, a file
//! of that schema lies in `tests/fixtures/`. It opens, holds what it should, and once brought up to
//! date has the very schema of a fresh file.
//!
//! `cargo test --test promises make_the_fixture -- --ignored` writes the file of the newest
//! schema; do so once when a schema is added, and never change the file again.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support;
use crate::support::database::{
    attributed, change, complete, contents, fitted, lit, placed, relative, sample, with_effects,
};
use matdb::material::{Activity, Input, Material, Origin};
use matdb::store::{Addition, Store};
use rusqlite::Connection;
use rusqlite::functions::FunctionFlags;

const NEWEST: &str = "schema-0016.sqlite";

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
    let make: fn(&str) -> Material = match file {
        "schema-0001.sqlite" => sample,
        "schema-0002.sqlite" => fitted,
        "schema-0003.sqlite" => with_effects,
        "schema-0004.sqlite" | "schema-0005.sqlite" | "schema-0006.sqlite" => complete,
        "schema-0007.sqlite" | "schema-0008.sqlite" => attributed,
        "schema-0009.sqlite" | "schema-0010.sqlite" | "schema-0011.sqlite" => placed,
        "schema-0012.sqlite" => lit,
        _ => relative,
    };
    let mut held = [make("paint"), change(make("paint")), make("primer")];
    if file < "schema-0008.sqlite" {
        // They were written when the fit did not say yet by which method it was found.
        held.iter_mut().for_each(|material| material.fits[0].estimator = "stated".to_owned());
    }
    held
}

/// The files of all schemas, by name.
fn files() -> Vec<String> {
    let names = fs::read_dir(fixtures()).unwrap().map(|entry| entry.unwrap().file_name());
    let names = names.map(|name| name.into_string().unwrap());
    let is_schema = |name: &String| name.starts_with("schema-") && name.ends_with(".sqlite");
    let mut files: Vec<String> = names.filter(is_schema).collect();
    files.sort();
    files
}

/// Which command made what the newest schema's file holds.
fn imported() -> Activity {
    let input = Input { name: "catalogue.sqlite".to_owned(), hash: "0e".repeat(32) };
    let origin = Origin {
        authors: vec!["Roe, Ann".to_owned(), "Doe, Jane".to_owned()],
        title: Some("Paints of Roe".to_owned()),
        version: Some("2.1".to_owned()),
        doi: Some("10.1234/paints".to_owned()),
        url: Some("https://paints.example.org".to_owned()),
        revision: 1,
        added_at: "2026-03-14T09:26:53Z".to_owned(),
        program_version: "0.1.0".to_owned(),
        command: Some("add".to_owned()),
    };
    Activity { command: "import".to_owned(), inputs: vec![input], origin: Some(origin) }
}

/// Fills a new file as the newest schema's file is.
fn fill(path: &Path) {
    let mut store = Store::open(path).unwrap();
    store.record(imported());
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
        assert_eq!(store.add([&held(&file)[2]]).unwrap(), [Addition::Unchanged(1)]);
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

/// Damage of the fits of a file of schema 10; the number of its materials that stay readable.
fn damaged_fits(path: &Path, case: &str) -> usize {
    let conn = Connection::open(path).unwrap();
    let alone = "PRAGMA journal_mode = delete; PRAGMA ignore_check_constraints = on; PRAGMA foreign_keys = off";
    conn.execute_batch(alone).unwrap();
    let change = |sql: &str| {
        conn.execute(sql, []).unwrap();
        1
    };
    match case {
        "a model" => change("UPDATE fit SET model = 'nonsense' WHERE revision_id = 2"),
        "a report" => change("UPDATE fit SET report = '{' WHERE revision_id = 2"),
        "a text" => change("UPDATE fit SET name = CAST(x'ff' AS TEXT) WHERE revision_id = 2"),
        _ => {
            let sql = "SELECT rootpage FROM sqlite_schema WHERE name = 'fit'";
            let page: u32 = conn.query_row(sql, [], |row| row.get(0)).unwrap();
            let size: u32 = conn.pragma_query_value(None, "page_size", |row| row.get(0)).unwrap();
            drop(conn);
            let (page, size) = (page as usize, size as usize);
            let mut bytes = fs::read(path).unwrap();
            bytes[(page - 1) * size..page * size].fill(0xa5);
            fs::write(path, bytes).unwrap();
            0
        }
    }
}

#[test]
fn a_damaged_fit_does_not_close_a_file_of_an_older_schema() {
    for case in ["a model", "a report", "a text", "a page"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matdb.sqlite");
        fs::copy(fixtures().join("schema-0010.sqlite"), &path).unwrap();
        let readable = damaged_fits(&path, case);
        let before = fs::read(&path).unwrap();
        let run = |line: &str| {
            let output = support::matdb(folder.path()).args(line.split(' ')).output().unwrap();
            (output.status.success(), String::from_utf8_lossy(&output.stdout).into_owned())
        };
        assert!(run("list").0, "{case}");
        assert!(fs::read(&path).unwrap() == before, "{case}: a reader has written");
        let message = support::refused(support::matdb(folder.path()).args(["show", "paint"]));
        assert!(message.contains("is damaged") && message.contains("check --repair"), "{message}");
        // SQLite writes nothing more once it has read a damaged page.
        for command in ["check", "check --repair"].into_iter().take(1 + readable) {
            let (is_sound, text) = run(command);
            assert!(!is_sound && text.contains("paint@2"), "{case}, {command}: {text}");
        }
        let store = Store::open(&path).unwrap();
        let shown = ["paint", "primer"].map(|slug| store.get(&slug.parse().unwrap(), None).is_ok());
        assert_eq!(shown.iter().filter(|is| **is).count(), readable, "{case}");
        // What cannot be read stays for whoever can mend it.
        let conn = Connection::open(&path).unwrap();
        let count = |table: &str| -> i64 {
            let sql = format!("SELECT count(*) FROM {table} NOT INDEXED");
            conn.query_row(&sql, [], |row| row.get(0)).unwrap()
        };
        assert!(count("fit_parameter") > 0, "{case}");
        assert!(readable == 0 || count("fit") == 3, "{case}");
    }
}

/// Overwrites the root page of a table or an index of an older file.
fn torn_page(path: &Path, of: &str) {
    let conn = Connection::open(path).unwrap();
    conn.pragma_update(None, "journal_mode", "delete").unwrap();
    let sql = "SELECT rootpage FROM sqlite_schema WHERE name = ?1";
    let page: usize = conn.query_row(sql, [of], |row| row.get::<_, u32>(0)).unwrap() as usize;
    let size: u32 = conn.pragma_query_value(None, "page_size", |row| row.get(0)).unwrap();
    drop(conn);
    let size = size as usize;
    let mut bytes = fs::read(path).unwrap();
    bytes[(page - 1) * size..page * size].fill(0xa5);
    fs::write(path, bytes).unwrap();
}

#[test]
fn damaged_tables_and_indexes_do_not_close_a_file_of_an_older_schema() {
    for of in ["curve_statistic", "sqlite_autoindex_curve_2", "activity", "origin", "session"] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matdb.sqlite");
        fs::copy(fixtures().join("schema-0014.sqlite"), &path).unwrap();
        torn_page(&path, of);
        let output = support::matdb(folder.path()).arg("list").output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("primer"), "{of}: {text}");
        let output = support::matdb(folder.path()).arg("check").output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(!output.status.success() && text.contains("paint@"), "{of}: {text}");
    }
}

#[test]
fn a_damaged_index_of_revisions_costs_a_file_of_an_older_schema_no_revision() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    fs::copy(fixtures().join("schema-0014.sqlite"), &path).unwrap();
    let conn = Connection::open(&path).unwrap();
    conn.pragma_update(None, "journal_mode", "delete").unwrap();
    let sql = "SELECT rootpage FROM sqlite_schema WHERE name = 'sqlite_autoindex_revision_1'";
    let page = conn.query_row(sql, [], |row| row.get::<_, u32>(0)).unwrap() as usize;
    drop(conn);
    // sqlite.org/fileformat.html: a leaf of an index without cells. Pages of the file have 1024 bytes.
    let mut bytes = fs::read(&path).unwrap();
    bytes[(page - 1) * 1024..][..8].copy_from_slice(&[0x0a, 0, 0, 0, 0, 4, 0, 0]);
    fs::write(&path, bytes).unwrap();
    support::refused(support::matdb(folder.path()).args(["show", "paint"]));
    // Its fits are made up, and cannot be made again.
    let _ = support::matdb(folder.path()).args(["check", "--repair"]).output().unwrap();
    assert_eq!(contents(&path), held("schema-0014.sqlite"));
}

#[test]
fn lost_rows_do_not_close_a_file_of_an_older_schema() {
    for sql in [
        "DELETE FROM revision WHERE id = 2",
        "INSERT INTO effect VALUES (99, 0, 'x')",
        "INSERT INTO effect_parameter VALUES (1, 'nosuch', 'a', 1.0)",
        "DELETE FROM source WHERE revision_id = 2",
        "UPDATE revision SET id = -1 WHERE id = 2",
    ] {
        for file in ["schema-0003.sqlite", "schema-0005.sqlite", "schema-0006.sqlite"] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("matdb.sqlite");
            fs::copy(fixtures().join(file), &path).unwrap();
            damaged_revision(&path, sql);
            support::matdb(folder.path()).args(["show", "primer"]).assert().success();
            let check = support::matdb(folder.path()).arg("check").output().unwrap();
            let said = String::from_utf8_lossy(&check.stdout).into_owned();
            assert!(!check.status.success() && said.contains("looked at"), "{file}, {sql}: {said}");
        }
    }
}

#[test]
fn tables_of_others_with_passing_names_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    fs::copy(fixtures().join("schema-0006.sqlite"), &path).unwrap();
    damaged_revision(&path, "CREATE TABLE kept (x)");
    let message = support::refused(support::matdb(folder.path()).arg("list"));
    assert!(message.contains("rename or remove the table `kept`"), "{message}");
}

/// Writes over what a row of `revision` of an older file holds, without the rules of its tables.
fn damaged_revision(path: &Path, sql: &str) {
    let conn = Connection::open(path).unwrap();
    let alone = "PRAGMA journal_mode = delete; PRAGMA ignore_check_constraints = on; PRAGMA foreign_keys = off";
    conn.execute_batch(alone).unwrap();
    conn.execute_batch(sql).unwrap();
}

#[test]
fn a_damaged_revision_does_not_close_a_file_of_an_older_schema() {
    for (file, sql) in [
        ("schema-0001.sqlite", "UPDATE revision SET tags = 'gold' WHERE id = 2"),
        ("schema-0001.sqlite", "UPDATE revision SET tags = '[null]' WHERE id = 2"),
        (
            "schema-0003.sqlite",
            "UPDATE revision SET description = CAST(x'ff' AS TEXT) WHERE id = 2",
        ),
        ("schema-0010.sqlite", "UPDATE revision SET theta_max_rad = 9.0 WHERE id = 2"),
        ("schema-0014.sqlite", "UPDATE revision SET status = 'activ' WHERE id = 2"),
        ("schema-0014.sqlite", "UPDATE revision SET tags = '[' WHERE id = 2"),
        ("schema-0014.sqlite", "UPDATE revision SET unknown = 'nothing' WHERE id = 2"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matdb.sqlite");
        fs::copy(fixtures().join(file), &path).unwrap();
        damaged_revision(&path, sql);
        let before = fs::read(&path).unwrap();
        let run = |line: &str| {
            let output = support::matdb(folder.path()).args(line.split(' ')).output().unwrap();
            let text = [output.stdout, output.stderr].concat();
            (output.status.success(), String::from_utf8_lossy(&text).into_owned())
        };
        let (is_done, text) = run("list");
        assert!(is_done && text.contains("primer"), "{file}, {sql}: {text}");
        assert!(run("show primer").0, "{file}, {sql}");
        let (is_done, text) = run("show paint");
        assert!(!is_done && text.contains("check --repair"), "{file}, {sql}: {text}");
        assert!(fs::read(&path).unwrap() == before, "{file}, {sql}: a reader has written");
        for command in ["check", "check --repair"] {
            let (is_sound, text) = run(command);
            assert!(!is_sound && text.contains("paint"), "{file}, {sql}, {command}: {text}");
        }
        // Whoever has the content brings it back.
        let mut store = Store::open(&path).unwrap();
        let added = store.add([&held(file)[1]]).unwrap();
        assert!(matches!(added[0], Addition::Repaired(2)), "{file}, {sql}: {added:?}");
        drop(store);
        assert_eq!(contents(&path), held(file));
    }
}

#[test]
fn a_revision_on_a_damaged_page_does_not_close_a_file_of_an_older_schema() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    fs::copy(fixtures().join("schema-0014.sqlite"), &path).unwrap();
    damaged_revision(
        &path,
        "UPDATE revision SET description = printf('%.*c', 4000, 'x') WHERE id = 2;",
    );
    let mut bytes = fs::read(&path).unwrap();
    let text = [b'x'; 900];
    let place = bytes.windows(text.len()).position(|window| window == text).unwrap();
    // The first whole page of the text: the page that follows it becomes one that is not there.
    let page = place.div_ceil(1024) * 1024;
    bytes[page..page + 4].fill(0xa5);
    fs::write(&path, bytes).unwrap();
    for command in ["list", "show primer"] {
        support::matdb(folder.path()).args(command.split(' ')).assert().success();
    }
    let message = support::refused(support::matdb(folder.path()).args(["show", "paint"]));
    assert!(message.contains("is damaged"), "{message}");
}

#[test]
fn of_an_older_file_the_greatest_number_is_not_taken_for_the_latest_revision() {
    let folder = tempfile::tempdir().unwrap();
    for sql in [
        "UPDATE revision SET number = 7 WHERE id = 1",
        "UPDATE revision SET number = 7 WHERE id = 2",
    ] {
        let path = folder.path().join("matdb.sqlite");
        fs::copy(fixtures().join("schema-0014.sqlite"), &path).unwrap();
        damaged_revision(&path, sql);
        let output = support::matdb(folder.path()).args(["check", "--repair"]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(!output.status.success() && text.contains("name or number"), "{sql}: {text}");
        let conn = Connection::open(&path).unwrap();
        let current = "SELECT current_revision FROM material WHERE slug = 'paint'";
        let current: i64 = conn.query_row(current, [], |row| row.get(0)).unwrap();
        assert_eq!(current, 2, "{sql}");
        support::refused(support::matdb(folder.path()).args(["show", "paint"]));
        support::matdb(folder.path()).args(["show", "primer"]).assert().success();
    }
}

#[test]
fn what_others_have_made_in_the_way_of_a_newer_schema_is_named() {
    let refers = "CREATE TABLE mine (r, f, p, FOREIGN KEY (r, f, p)
                      REFERENCES fit_estimate (revision_id, fit, position));
                  INSERT INTO mine SELECT revision_id, fit, position FROM fit_estimate";
    for (sql, drop_it, problem, remedy) in [
        (
            "CREATE TABLE Fit_Number (a)",
            "DROP TABLE Fit_Number",
            "matdb needs the name of the table `Fit_Number`, which it has not made",
            "rename or remove the table `Fit_Number` in another program",
        ),
        (
            "CREATE VIEW fit_number AS SELECT 1 AS a",
            "DROP VIEW fit_number",
            "matdb needs the name of the view `fit_number`, which it has not made",
            "rename or remove the view `fit_number` in another program",
        ),
        (
            refers,
            "DROP TABLE mine",
            "the table `mine`, which matdb has not made, refers to `fit_estimate`",
            "rename or remove the table `mine` in another program",
        ),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matdb.sqlite");
        fs::copy(fixtures().join("schema-0010.sqlite"), &path).unwrap();
        let conn = Connection::open(&path).unwrap();
        conn.execute_batch(sql).unwrap();
        drop(conn);
        let before = schema(&path);
        for command in ["list", "add ptfe", "check", "check --repair"] {
            let arguments = command.split(' ');
            let message = support::refused(support::matdb(folder.path()).args(arguments));
            let wanted = format!("cannot be brought up to date: {problem}; {remedy}");
            assert!(message.contains(&wanted), "{command}: {message}");
            assert!(!message.contains("damaged"), "{command}: {message}");
            assert_eq!(schema(&path), before, "{command}");
        }
        let conn = Connection::open(&path).unwrap();
        conn.execute_batch(drop_it).unwrap();
        drop(conn);
        support::matdb(folder.path()).args(["add", "ptfe", "-q"]).assert().success();
        assert!(support::database::is_sound(&path), "{sql}");
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
    let store = Store::open_existing(&kept).unwrap().unwrap();
    let stored = store.get(&"paint".parse().unwrap(), Some(1)).unwrap().unwrap();
    assert_eq!(stored.activity, Some(imported()));
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
        "UPDATE revision SET status = 'doubtful'",
        "UPDATE revision SET status = 'active'",
        "UPDATE revision SET status_reason = NULL",
        "UPDATE revision SET superseded_by = NULL",
        "UPDATE revision SET unknown = '{}'",
        "UPDATE source SET authors = 'Doe'",
        "UPDATE source SET year = 26",
        "UPDATE source SET making = 'guessed'",
        "UPDATE instrument SET geometry = 'round'",
        "UPDATE instrument SET stand_off_m = 0",
        "UPDATE instrument SET calibration_sd_factor = 0.5",
        "UPDATE instrument SET scale = 'large'",
        "UPDATE instrument SET threshold_w = -1",
        "UPDATE instrument SET false_alarm_probability = 1",
        "UPDATE instrument SET range_bins = 0",
        "UPDATE instrument SET looks = 0",
        "UPDATE permittivity SET imaginary = -0.1",
        "UPDATE permittivity SET frequency_hz = 0",
        "UPDATE permittivity SET frequency_hz = 3e11",
        "UPDATE permittivity SET temperature_k = 0",
        "UPDATE permittivity SET source = 'other'",
        "UPDATE permittivity SET frequency_source = 'other'",
        "UPDATE layer SET thickness_m = 0",
        "UPDATE layer SET source = 'other'",
        "UPDATE effect SET source = 'other'",
        "UPDATE curve_illumination SET footprint = 'flat'",
        "UPDATE curve_illumination SET beam_rad = 0",
        "UPDATE curve_illumination SET footprint = NULL, beam_rad = NULL",
        "UPDATE curve_illumination SET curve = 'other'",
        "UPDATE curve_levels SET relative = 2",
        "UPDATE curve_levels SET only_detected = -1",
        "UPDATE curve_levels SET relative = 0, only_detected = 0",
        "UPDATE curve_levels SET curve = 'other'",
        "UPDATE fit_lobes SET lobes = 'radar-and-surface'",
        "UPDATE fit_lobes SET fit = 'other'",
        "UPDATE fit_number SET fit = 'other'",
        "UPDATE fit_number SET at_bound = 2",
        "UPDATE fit_number SET chosen_by = 'chance'",
        "UPDATE fit_number SET estimate = NULL",
        "UPDATE fit_number SET estimate = '$.sd'",
        "UPDATE roughness SET rms_height_m = -1",
        "UPDATE roughness SET correlation_length_m = 0",
        "UPDATE roughness SET source = 'other'",
        "UPDATE session SET key = 'other'",
        "UPDATE session SET date = '2026-02-30'",
        "UPDATE session SET relative_humidity = 40",
        "UPDATE session SET cloud_hash = '0c'",
        "UPDATE session SET normal_sd_rad = 2",
        "UPDATE session SET pose = '[]'",
        "UPDATE curve_session SET session = 'other'",
        "UPDATE curve_statistic SET points = 0",
        "UPDATE curve_statistic SET censored_points = 2",
        "UPDATE curve_statistic SET mean_greatest = mean_least - 1",
        "UPDATE curve_statistic SET theta_min_rad = -1",
        "UPDATE curve_statistic SET curve = 'other'",
        "UPDATE finding SET verdict = 'maybe'",
        "UPDATE finding SET p = 2",
        "UPDATE finding SET size_db = -1",
        "UPDATE finding SET fit_after = 'other'",
        "UPDATE finding SET source = 'other'",
        "UPDATE finding SET confusable_with = '{}'",
        "UPDATE origin SET revision = 0",
        "UPDATE origin_author SET author = ''",
        "UPDATE origin_author SET revision_id = 99",
        "UPDATE entry SET material_id = 99",
        "UPDATE entry SET kind = 1, curves = 'many'",
        "UPDATE entry_tag SET slug = 'other'",
    ] {
        assert!(conn.execute(sql, []).is_err(), "{sql}");
    }
}

/// The program's own SQLite has no logarithm, which the views need; that of the sqlite3 program has.
fn with_logarithm(path: &Path) -> Connection {
    let conn = Connection::open(path).unwrap();
    conn.create_scalar_function("log10", 1, FunctionFlags::SQLITE_UTF8, |context| {
        context.get::<Option<f64>>(0).map(|x| x.map(f64::log10))
    })
    .unwrap();
    conn
}

/// Columns of all tables and views with their declared types; those of views have none where they
/// are computed.
fn columns(conn: &Connection) -> Vec<(String, String, String)> {
    let sql = "SELECT schema.type, info.name, upper(info.type)
               FROM sqlite_schema AS schema JOIN pragma_table_info(schema.name) AS info
               WHERE schema.type IN ('table', 'view') AND schema.name NOT LIKE 'sqlite_%'";
    let mut statement = conn.prepare(sql).unwrap();
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).unwrap();
    rows.map(Result::unwrap).collect()
}

#[test]
fn every_number_has_its_unit() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sqlite");
    drop(Store::open(&path).unwrap());
    let conn = with_logarithm(&path);
    let mut statement = conn.prepare("SELECT column_name, ucum, meaning FROM unit").unwrap();
    let units: BTreeMap<String, (Option<String>, String)> = statement
        .query_map([], |row| Ok((row.get(0)?, (row.get(1)?, row.get(2)?))))
        .unwrap()
        .map(Result::unwrap)
        .collect();
    let is_number = |kind: &str| matches!(kind, "REAL" | "INTEGER");
    let columns = columns(&conn);
    for (_, name, kind) in &columns {
        let is_converted = ["_db", "_deg", "_ghz"].iter().any(|end| name.ends_with(end));
        let is_text_elsewhere = kind == "TEXT" && !is_converted;
        assert!(
            units.contains_key(name) || is_text_elsewhere || !(is_number(kind) || is_converted),
            "{name}"
        );
    }
    for (name, (ucum, meaning)) in &units {
        let kinds = columns.iter().filter(|(_, column, _)| column == name);
        assert!(kinds.count() > 0, "no column `{name}`");
        assert!(meaning.len() > 5, "{name}");
        let ends = [
            ("_rad", "rad"),
            ("_deg", "deg"),
            ("_m", "m"),
            ("_hz", "Hz"),
            ("_ghz", "GHz"),
            ("_w", "W"),
            ("_k", "K"),
            ("_db", "dB"),
        ];
        if let Some((_, unit)) = ends.into_iter().find(|(end, _)| name.ends_with(end)) {
            assert_eq!(ucum.as_deref(), Some(unit), "{name}");
        }
    }
}

#[test]
fn views_show_people_decibels_and_degrees() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sqlite");
    fill(&path);
    let conn = with_logarithm(&path);
    let sql = "SELECT theta_i_deg, sigma0_db, threshold_db, censor FROM v_curves
               WHERE slug = 'paint' AND revision = 2";
    let mut statement = conn.prepare(sql).unwrap();
    type Point = (f64, Option<f64>, f64, String);
    let rows: Vec<Point> = statement
        .query_map([], |r| Ok((r.get(0)?, r.get(1)?, r.get(2)?, r.get(3)?)))
        .unwrap()
        .map(Result::unwrap)
        .collect();
    assert_eq!(rows.len(), 3);
    assert!((rows[1].0 - 28.6479).abs() < 1e-4 && (rows[1].1.unwrap() + 6.9897).abs() < 1e-4);
    assert_eq!((rows[2].1, rows[2].3.as_str()), (None, "left"));
    assert!((rows[2].2 + 30.0).abs() < 1e-9);
    // What was typed: radians and ratios lose the last digits on the way and back.
    let typed = "SELECT count(*) FROM v_curves WHERE sigma0_db <> round(sigma0_db, 9) OR theta_i_deg <> round(theta_i_deg, 9)";
    assert_eq!(conn.query_row(typed, [], |row| row.get::<_, i64>(0)).unwrap(), 0);
    let count = |sql: &str| conn.query_row(sql, [], |row| row.get::<_, i64>(0)).unwrap();
    assert_eq!(count("SELECT count(*) FROM v_materials WHERE status = 'superseded'"), 2);
    assert_eq!(count("SELECT count(*) FROM v_materials WHERE frequency_min_ghz = 290"), 2);
    let parameters = sample("paint").fits[0].model.parameters().len() as i64;
    let told = attributed("paint").fits[0].numbers().len() as i64;
    assert!(told > parameters, "S and R stand beside the parameters");
    assert_eq!(count("SELECT count(*) FROM v_fits WHERE is_rendered"), 2 * told);
}

#[test]
fn a_fit_says_of_each_number_whether_the_data_tell_it() {
    let folder = tempfile::tempdir().unwrap();
    let (fresh, old) = (folder.path().join("a.sqlite"), folder.path().join("old.sqlite"));
    fill(&fresh);
    fs::write(&old, fs::read(fixtures().join("schema-0002.sqlite")).unwrap()).unwrap();
    drop(Store::open(&old).unwrap());
    for path in [&fresh, &old] {
        let conn = Connection::open(path).unwrap();
        let sql = "SELECT path, chosen_by, identified, at_bound FROM v_fits
                   WHERE slug = 'paint' AND chosen_by IS NOT NULL ORDER BY path";
        let mut statement = conn.prepare(sql).unwrap();
        type Row = (String, String, bool, bool);
        let rows: Vec<Row> = statement
            .query_map([], |r| Ok((r.get(0)?, r.get(1)?, r.get(2)?, r.get(3)?)))
            .unwrap()
            .map(Result::unwrap)
            .collect();
        let of = |name: &str| {
            let row = rows.iter().find(|row| row.0 == name).unwrap();
            (row.1.as_str(), row.2, row.3)
        };
        assert_eq!(of("S"), ("data", true, false));
        assert_eq!(of("R"), ("data", false, false));
        assert_eq!(of("diffuse.alpha"), ("hand", false, false));
        for name in ["k", "specular.f_lambda", "diffuse.r_s"] {
            assert_eq!(of(name), ("convention", false, false), "{name}");
        }
    }
    let conn = Connection::open(&fresh).unwrap();
    let sql = "SELECT low_95, high_95 FROM fit_estimate WHERE name = 'S'";
    let interval: (f64, f64) = conn.query_row(sql, [], |r| Ok((r.get(0)?, r.get(1)?))).unwrap();
    assert_eq!(interval, (0.25 - 0.02, 0.25 + 0.02));
}

#[test]
fn what_was_stated_beside_a_curve_is_no_fit_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.sqlite");
    let mut store = Store::open(&path).unwrap();
    let mut stated = fitted("stated");
    stated.fits[0].report = None;
    stated.fits[0].estimator = "stated".to_owned();
    let mut made = stated.clone();
    made.slug = "made".parse().unwrap();
    made.fits[0].estimator = "censored".to_owned();
    store.add([&stated, &made]).unwrap();
    let conn = Connection::open(&path).unwrap();
    let fitted = |slug: &str| {
        conn.query_row("SELECT fitted FROM entry WHERE slug = ?1", [slug], |row| {
            row.get::<_, i64>(0)
        })
    };
    assert_eq!((fitted("stated").unwrap(), fitted("made").unwrap()), (0, 1));
}
