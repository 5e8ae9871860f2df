//! Databases and catalogues from elsewhere, and what is typed to search them.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use matdb::adopt::{publish, verify};
use matdb::brdf::Brdf;
use matdb::catalogue::{About, Import};
use matdb::fit::{Fit, Method};
use matdb::formats::ColumnNames;
use matdb::material::file::parse;
use matdb::material::{Activity, Material, Slug, builtin, form};
use matdb::measure::Curve;
use matdb::report::{CATALOGUE_VIEW, angles_deg};
use matdb::store::{Filter, Store};
use rusqlite::Connection;
use rusqlite::config::DbConfig;
use sha2::{Digest, Sha256};
use tempfile::TempDir;

/// A complete material file.
const COMPLETE: &str = include_str!("../../src/setup/material-template.toml");
const POINTS: &str = "theta_deg,sigma0_db,censor,threshold_db\n0,5,none,-30\n15,-2,none,-30\n\
                      30,-8,none,-30\n45,-15,none,-30\n60,-19,none,-30\n70,,left,-30\n";

/// Columns of the database that hold JSON.
const JSON_COLUMNS: [(&str, &str); 7] = [
    ("fit", "model"),
    ("fit", "report"),
    ("session", "pose"),
    ("source", "authors"),
    ("finding", "confusable_with"),
    ("revision", "tags"),
    ("revision", "unknown"),
];

/// Files of a publication that are read, besides its database.
const READ: [&str; 5] = [
    "about.json",
    "api/v1/index.json",
    "api/v1/materials/my-paint.json",
    "changes.json",
    "SHA256SUMS",
];

thread_local! {
    static LABORATORY: Laboratory = Laboratory::new();
    static BUILT_IN: Store = {
        let mut store = Store::in_memory().expect("a database in memory");
        let materials: Vec<Material> =
            builtin::names().filter_map(|name| builtin::get(name)?.ok()).collect();
        store.add(&materials).expect("built-in materials are sound");
        store
    };
}

/// A database and a publication of it, from which every try starts.
struct Laboratory {
    folder: TempDir,
    /// What is in the database.
    material: Material,
    /// The database.
    bytes: Vec<u8>,
    /// Tables and names of all columns of text.
    text_columns: Vec<(String, String)>,
    /// The files of [`READ`] as they were published.
    published: BTreeMap<&'static str, Vec<u8>>,
}

impl Laboratory {
    fn new() -> Laboratory {
        let folder = tempfile::tempdir().expect("a folder");
        let mut store = Store::in_memory().expect("a database in memory");
        let material = complete();
        store.add([&material]).expect("a sound material");
        let (made, path) = (folder.path().join("made.sqlite"), folder.path().join("matdb.sqlite"));
        store.copy_to(&made).expect("a copy");
        // Files of a corpus must not depend on the hour. What is added again keeps its date.
        let conn = Connection::open(&made).expect("a database");
        conn.execute("UPDATE revision SET added_at = '2026-03-14T10:00:00Z'", []).expect("a date");
        drop(conn);
        let mut store = Store::open(&made).expect("a database");
        store.add([&material]).expect("the same material");
        store.copy_to(&path).expect("a copy");
        let store = Store::open_frozen(&path).expect("a database").expect("a database with tables");
        let site = folder.path().join("site");
        publish(&store, &About::default(), &site, |_| ()).expect("a publication");
        let published = READ.map(|name| (name, fs::read(site.join(name)).expect("a file")));
        let bytes = fs::read(&path).expect("a file");
        let text_columns = text_columns(&path);
        Laboratory { folder, material, bytes, text_columns, published: published.into() }
    }

    fn database(&self) -> PathBuf {
        self.folder.path().join("matdb.sqlite")
    }

    fn site(&self) -> PathBuf {
        self.folder.path().join("site")
    }

    /// Puts a file of the publication in place, with its hash in the list.
    fn replace(&self, name: &str, content: &[u8]) {
        let site = self.site();
        fs::write(site.join(name), content).expect("room for a file");
        if name == "SHA256SUMS" {
            return;
        }
        let sum: String = Sha256::digest(content).iter().map(|b| format!("{b:02x}")).collect();
        let mut sums = String::new();
        for line in String::from_utf8_lossy(&self.published["SHA256SUMS"]).lines() {
            match line.split_once("  ") {
                Some((_, path)) if path == name => sums += &format!("{sum}  {name}\n"),
                _ => sums += &format!("{line}\n"),
            }
        }
        fs::write(site.join("SHA256SUMS"), sums).expect("room for a file");
    }

    fn restore(&self) {
        for (name, content) in &self.published {
            fs::write(self.site().join(name), content).expect("room for a file");
        }
    }
}

/// A material with a row in almost every table.
fn complete() -> Material {
    let read = |_: &str| Ok(POINTS.as_bytes().to_vec());
    let mut material = parse("material.toml", COMPLETE, read).expect("a template");
    let curve = Curve::of_material(&material.curves[0]).expect("a curve");
    let start: Brdf = serde_json::from_str(r#"{"model":"lambert","albedo":0.5}"#).expect("a law");
    let fit = Fit { method: Method::Mse { split_rad: 0.1 }, ..Fit::default() };
    let found = fit.run(&start, &curve).expect("a fit");
    material.fits.push(found.stored("lambert-mse", "scan", "bench"));
    material
}

fn text_columns(path: &Path) -> Vec<(String, String)> {
    let conn = Connection::open(path).expect("a database");
    let sql = "SELECT t.name, c.name FROM sqlite_schema AS t, pragma_table_info(t.name) AS c
               WHERE t.type = 'table' AND t.sql LIKE '%STRICT%' AND c.type = 'TEXT' ORDER BY 1, 2";
    let mut statement = conn.prepare(sql).expect("a query");
    let rows = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).expect("rows");
    rows.collect::<Result<_, _>>().expect("names")
}

/// A database from elsewhere, in which other text stands in a column or other bytes on its pages, or other bytes
/// altogether: the first byte chooses, and the next one may be the column. It also chooses what is done with it, since
/// that takes long: it is read, imported if it is sound, or repaired.
pub fn database(bytes: &[u8]) {
    let Some((variant, rest)) = super::choice(bytes) else { return };
    LABORATORY.with(|laboratory| {
        let path = laboratory.database();
        match variant % 3 {
            0 => {
                fs::write(&path, &laboratory.bytes).expect("room for a file");
                let Some((column, text)) = super::choice(rest) else { return };
                let known = column.checked_sub(JSON_COLUMNS.len());
                let (table, column) = match known {
                    None => JSON_COLUMNS[column],
                    Some(number) => {
                        let columns = &laboratory.text_columns;
                        let (table, column) = &columns[number % columns.len()];
                        (table.as_str(), column.as_str())
                    }
                };
                write_text(&path, table, column, &String::from_utf8_lossy(text));
            }
            1 => fs::write(&path, patched(&laboratory.bytes, rest)).expect("room for a file"),
            _ => fs::write(&path, rest).expect("room for a file"),
        }
        match variant / 3 % 4 {
            1 => _ = can_be_imported(&path),
            2 => {
                if let Ok(mut store) = Store::open(&path) {
                    let _ = store.repair(std::slice::from_ref(&laboratory.material));
                    drop(store);
                    read_everything(&path);
                }
            }
            _ => read_everything(&path),
        }
        for ending in ["-wal", "-shm", "-journal"] {
            let _ = fs::remove_file(laboratory.folder.path().join(format!("matdb.sqlite{ending}")));
        }
    });
}

/// Puts a text into the first row of a column, without the checks of the table.
fn write_text(path: &Path, table: &str, column: &str, text: &str) {
    let conn = Connection::open(path).expect("a database");
    conn.execute_batch(
        "PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA foreign_keys = OFF;
         PRAGMA ignore_check_constraints = ON",
    )
    .expect("settings");
    conn.set_db_config(DbConfig::SQLITE_DBCONFIG_ENABLE_TRIGGER, false).expect("a setting");
    // A key that is there already is refused.
    let _ = conn.execute(&format!("UPDATE \"{table}\" SET \"{column}\" = ?1"), [text]);
}

/// The database with runs of other bytes: of each its page, its place on it, its length and the bytes.
fn patched(database: &[u8], mut runs: &[u8]) -> Vec<u8> {
    let mut patched = database.to_vec();
    while let [page, place_high, place_low, length, rest @ ..] = runs {
        let length = rest.len().min(usize::from(*length % 32) + 1);
        let (run, rest) = rest.split_at(length);
        let place = usize::from(u16::from_be_bytes([*place_high, *place_low])) % 4096;
        let place = (4096 * usize::from(*page) + place) % patched.len();
        let length = length.min(patched.len() - place);
        patched[place..place + length].copy_from_slice(&run[..length]);
        runs = rest;
    }
    patched
}

/// Reads all that the program shows of a database.
fn read_everything(path: &Path) {
    let Ok(Some(store)) = Store::open_frozen(path) else { return };
    let _ = (store.damage(), store.licences(), store.classes(), store.tags(9));
    let _ = (store.search("paint", &Filter::default(), 9), store.outlines(&Filter::default()));
    let _ = store.count(&Filter { fitted: Some(true), ..Filter::default() }, 9);
    let slugs = store.list().map(|list| list.into_iter().map(|line| line.slug));
    let slugs: Vec<Slug> =
        slugs.into_iter().flatten().chain(["my-paint".parse().expect("a name")]).collect();
    let _ = store.rendered_words(&slugs);
    for slug in &slugs {
        let _ = (store.history(slug), store.rendered(slug), store.statistics(slug, None, "scan"));
        if let Ok(Some(stored)) = store.get(slug, None) {
            assert_eq!(stored.material.content_hash(), stored.content_hash);
        }
    }
}

/// Whether a catalogue is found sound. Then all of it can be imported, and is the same there.
fn can_be_imported(bundle: &Path) -> bool {
    let Ok(found) = verify(bundle) else { return false };
    if !found.problems.is_empty() {
        return false;
    }
    let import = Import::open(bundle, CATALOGUE_VIEW).expect("what was verified can be opened");
    let mut ours = Store::in_memory().expect("a database in memory");
    // Names that would mislead, and effects of a newer program, are refused here.
    let Ok(plan) = import.plan(None, None) else { return true };
    let by = Activity { command: "import".to_owned(), ..Activity::default() };
    import.take(&mut ours, &plan, &by).expect("what was planned can be taken over");
    assert_eq!(ours.list().expect("a list").len(), plan.len());
    assert_eq!(ours.damage().expect("a database that can be read"), [""; 0]);
    for taken in &plan {
        assert!(ours.get(&taken.name, None).expect("a material that can be read").is_some());
    }
    true
}

/// A published folder in which the first byte chooses a file that has other content: see [`can_be_imported`].
pub fn publication(bytes: &[u8]) {
    let Some((variant, content)) = super::choice(bytes) else { return };
    LABORATORY.with(|laboratory| {
        laboratory.replace(READ[variant % READ.len()], content);
        can_be_imported(&laboratory.site());
        laboratory.restore();
    });
}

/// Title, people and licence of a catalogue, as TOML: what is read can be written and read again.
pub fn about(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(about) = About::parse("about.toml", text) else { return };
    let written = toml::to_string(&about).expect("what was read can be written");
    let again = About::parse("about.toml", &written).expect("what was written can be read");
    assert_eq!(again, about);
    let json = serde_json::to_vec(&about).expect("what was read can be written");
    assert_eq!(serde_json::from_slice::<About>(&json).expect("JSON"), about);
}

/// What people type: words of a search, names of columns, materials, angles, licences.
pub fn words(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    BUILT_IN.with(|store| {
        for found in store.search(text, &Filter::default(), 5).expect("words are only words") {
            assert!(store.holds(&found.slug).expect("a database that can be read"));
        }
        let filter = Filter { tag: Some(text.to_owned()), ..Filter::default() };
        store.find(&filter).expect("a tag is only a text");
    });
    if let Ok(names) = text.parse::<ColumnNames>() {
        assert_eq!(names.to_string().parse::<ColumnNames>(), Ok(names));
    }
    if let Ok(slug) = text.parse::<Slug>() {
        assert_eq!(slug.as_str(), text);
    }
    let angles = angles_deg(text).unwrap_or_default();
    assert!(angles.iter().all(|angle| (0.0..90.0).contains(angle)));
    if form::is_licence(text) {
        assert!(form::licence_names(text).next().is_some());
    }
    let _ = (form::licence_doubt(text), form::alternative_licences(text));
    let _ = (form::is_orcid(text), form::is_doi(text), form::is_address(text));
}
