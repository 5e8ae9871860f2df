//! Promise: nothing that is accepted makes a database unreadable; what is damaged is said to be damaged, never
//! served, never stood in for by a built-in material, and can be mended or removed; and no file but the one that
//! `--db` names is ever touched.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::database::{change, contents, is_sound, sound};
use crate::support::{self, matdb, refused};
use matdb::brdf::{Brdf, Lambert, MOST_LEVELS, MOST_MODELS, Mixture, Sum};
use matdb::material::{Activity, Input, Material, Origin, builtin};
use matdb::store::{Addition, Store, StoreError};
use rusqlite::Connection;

/// A database of built-in materials, `matdb.sqlite` in a folder of its own.
fn database(names: &[&str]) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path()).arg("add").args(names).assert().success();
    let path = folder.path().join("matdb.sqlite");
    (folder, path)
}

/// Changes a file as another program would, without its rules.
fn tamper(path: &Path, sql: &str) {
    let conn = Connection::open(path).unwrap();
    conn.execute_batch(&format!("PRAGMA foreign_keys = off; {sql}")).unwrap();
}

/// Makes the index by which materials are found answer for none of them: its page becomes an empty one.
fn empty_index_of_names(path: &Path) {
    let conn = Connection::open(path).unwrap();
    conn.pragma_update(None, "journal_mode", "delete").unwrap();
    let index = "SELECT rootpage FROM sqlite_schema WHERE name = 'sqlite_autoindex_material_1'";
    let page: u32 = conn.query_row(index, [], |row| row.get(0)).unwrap();
    let size: u32 = conn.pragma_query_value(None, "page_size", |row| row.get(0)).unwrap();
    drop(conn);
    let mut bytes = fs::read(path).unwrap();
    // sqlite.org/fileformat.html: a leaf of an index, no free block, no cell, cells begin at the end of the page.
    let (page, size) = (page as usize, size as usize);
    let end = u16::try_from(size).unwrap().to_be_bytes();
    bytes[(page - 1) * size..][..8].copy_from_slice(&[0x0a, 0, 0, 0, 0, end[0], end[1], 0]);
    fs::write(path, bytes).unwrap();
}

/// A sum in a sum, so many levels of models in all.
fn nested(levels: usize) -> Brdf {
    let innermost = Brdf::Lambert(Lambert { albedo: 0.1 });
    (1..levels).fold(innermost, |part, _| Brdf::Sum(Sum { parts: vec![part] }))
}

fn wide(models: usize) -> Brdf {
    Brdf::Sum(Sum { parts: vec![Brdf::Lambert(Lambert { albedo: 0.01 }); models - 1] })
}

fn of_model(model: Brdf) -> Material {
    let mut material = builtin::get("ptfe").unwrap().unwrap();
    material.slug = "own".parse().unwrap();
    material.fits[0].parameter_sources.clear();
    material.fits[0].covariance = None;
    material.fits[0].model = model;
    material
}

#[test]
fn a_law_of_many_models_is_refused_at_the_door_and_one_within_the_limits_goes_all_the_way() {
    let deep = |levels: usize| {
        let albedo = || Box::new(Brdf::Lambert(Lambert { albedo: 0.1 }));
        (1..levels).fold(Brdf::Lambert(Lambert { albedo: 0.1 }), |part, _| {
            Brdf::Mixture(Mixture { k: 0.5, diffuse: albedo(), specular: Box::new(part) })
        })
    };
    let mut store = Store::in_memory().unwrap();
    for (model, problem) in [
        (nested(MOST_LEVELS + 1), "8 deep"),
        (nested(63), "8 deep"),
        (deep(MOST_LEVELS + 1), "8 deep"),
        (wide(MOST_MODELS + 1), "64 models"),
    ] {
        let message = store.add([&of_model(model)]).unwrap_err().to_string();
        assert!(message.contains(problem) && message.contains("fewer parts"), "{message}");
        assert!(store.list().unwrap().is_empty());
    }
    for model in [nested(MOST_LEVELS), deep(MOST_LEVELS), wide(MOST_MODELS)] {
        let (folder, path) = database(&["ptfe"]);
        Store::open(&path).unwrap().add([&of_model(model)]).unwrap();
        for command in ["show own", "check", "search own", "publish site", "verify site", "rm own"]
        {
            matdb(folder.path()).args(command.split(' ')).assert().success();
        }
    }
}

#[test]
fn a_file_with_a_deep_law_is_refused_with_its_place() {
    let folder = tempfile::tempdir().unwrap();
    let text = include_str!("../materials/ptfe/material.toml");
    let at = text.find("[fit.scattering]").unwrap();
    let mut law = String::from("[fit.scattering]\nmodel = \"sum\"\n");
    let mut table = "fit.scattering".to_owned();
    for level in 0..20 {
        table += ".parts";
        law +=
            &format!("[[{table}]]\nmodel = \"{}\"\n", if level < 19 { "sum" } else { "lambert" });
    }
    law += "albedo = 0.1\n";
    let head =
        text[..at].replace("parameter_source = { \"specular.f_lambda\" = \"fresnel\" }\n", "");
    fs::write(folder.path().join("material.toml"), head + &law).unwrap();
    let message = refused(matdb(folder.path()).args(["add", "--from", "material.toml"]));
    assert!(message.contains("8 deep"), "{message}");
    assert!(!folder.path().join("matdb.sqlite").exists());
}

/// Damage of one material, `ptfe`, and what mends it.
const DAMAGE: [(&str, &str); 4] = [
    ("a revision that is not there", "UPDATE material SET current_revision = 9 WHERE slug = 'ptfe'"),
    (
        "a number that was changed",
        "UPDATE fit_parameter SET value = value / 2 WHERE path = 'k' AND revision_id IN
         (SELECT revision.id FROM revision JOIN material ON material.id = material_id WHERE slug = 'ptfe')",
    ),
    (
        "rows that were removed",
        "DELETE FROM source WHERE revision_id IN
         (SELECT revision.id FROM revision JOIN material ON material.id = material_id WHERE slug = 'ptfe')",
    ),
    (
        "a law that cannot be read",
        "UPDATE fit SET model = '{\"model\":\"witchcraft\"}' WHERE revision_id IN
         (SELECT revision.id FROM revision JOIN material ON material.id = material_id WHERE slug = 'ptfe')",
    ),
];

/// A scene of one material.
fn scene_of(folder: &Path, material: &str) -> PathBuf {
    let path = folder.join("scene.toml");
    let text = fs::read_to_string(support::scene("bench.toml")).unwrap();
    let own: Vec<String> = text
        .lines()
        .map(|line| {
            if line.trim_start().starts_with("material = ") {
                format!("material = \"{material}\"")
            } else {
                line.to_owned()
            }
        })
        .collect();
    fs::write(&path, own.join("\n")).unwrap();
    path
}

#[test]
fn a_damaged_material_is_damage_and_no_built_in_stands_in_for_it() {
    for (case, sql) in DAMAGE {
        let (folder, path) = database(&["ptfe", "glass"]);
        tamper(&path, sql);
        scene_of(folder.path(), "ptfe");
        for command in [
            "show ptfe",
            "near --material ptfe",
            "render scene.toml -o out",
            "export ptfe --as mitsuba --output ptfe.xml",
        ] {
            let message = refused(matdb(folder.path()).args(command.split(' ')));
            assert!(message.contains("is damaged"), "{case}, {command}: {message}");
            assert!(message.contains("check --repair"), "{case}, {command}: {message}");
        }
        assert!(!folder.path().join("out").exists());
        matdb(folder.path()).args(["show", "glass"]).assert().success();
    }
}

#[test]
fn an_index_that_has_lost_a_name_hides_nothing() {
    let (folder, path) = database(&["ptfe", "glass"]);
    let whole = contents(&path);
    empty_index_of_names(&path);
    let message = refused(matdb(folder.path()).args(["show", "ptfe"]));
    assert!(message.contains("is damaged") && message.contains("`ptfe` is there"), "{message}");
    matdb(folder.path()).arg("check").assert().failure();
    let output = matdb(folder.path()).args(["check", "--repair"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && text.contains("made anew"), "{text}");
    assert!(is_sound(&path));
    assert_eq!(contents(&path), whole);
}

#[test]
fn a_damaged_database_is_not_published_and_the_site_there_stays() {
    let (folder, path) = database(&["ptfe", "glass"]);
    matdb(folder.path()).args(["publish", "site"]).assert().success();
    let site = folder.path().join("site");
    let sums = fs::read(site.join("SHA256SUMS")).unwrap();
    let sound = fs::read(&path).unwrap();
    let strange = [
        ("an index that lost its names", ""),
        ("a stranger's table", "CREATE TABLE more (x)"),
        ("a stranger's view", "CREATE VIEW more AS SELECT 1"),
        ("a list without a name", "DELETE FROM entry WHERE slug = 'ptfe'"),
    ];
    for (case, sql) in DAMAGE.into_iter().chain(strange) {
        fs::write(&path, &sound).unwrap();
        match sql {
            "" => empty_index_of_names(&path),
            sql => tamper(&path, sql),
        }
        let message = refused(matdb(folder.path()).args(["publish", "site"]));
        assert!(
            message.contains("nothing was published") || message.contains("is damaged"),
            "{case}: {message}"
        );
        assert_eq!(fs::read(site.join("SHA256SUMS")).unwrap(), sums, "{case}");
        matdb(folder.path()).args(["verify", "site"]).assert().success();
    }
}

#[test]
fn the_same_content_mends_a_damaged_material_and_rm_removes_it() {
    for (case, sql) in DAMAGE {
        let (folder, path) = database(&["ptfe", "glass"]);
        let whole = contents(&path);
        tamper(&path, sql);
        let damaged = fs::read(&path).unwrap();
        let output = matdb(folder.path()).args(["add", "ptfe"]).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && !text.contains("unchanged"), "{case}: {text}");
        matdb(folder.path()).args(["show", "ptfe"]).assert().success();
        matdb(folder.path()).args(["add", "ptfe"]).assert().success().stdout(
            "unchanged ptfe, revision 1, in matdb.sqlite\n".replace(
                "revision 1",
                if case.contains("not there") { "revision 10" } else { "revision 1" },
            ),
        );

        fs::write(&path, &damaged).unwrap();
        matdb(folder.path()).args(["rm", "ptfe"]).assert().success();
        matdb(folder.path()).arg("check").assert().success();

        fs::write(&path, &damaged).unwrap();
        if case.contains("not there") {
            // The revision that is lost may have withdrawn the material.
            let output = matdb(folder.path()).args(["check", "--repair"]).output().unwrap();
            let text = String::from_utf8_lossy(&output.stdout);
            assert!(!output.status.success() && text.contains("add the material again"), "{text}");
            continue;
        }
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        assert!(is_sound(&path), "{case}");
        let store = Store::open_existing(&path).unwrap().unwrap();
        for material in &whole {
            let stored = store.get(&material.slug, None).unwrap().unwrap();
            assert_eq!((stored.revision, &stored.material), (1, material), "{case}");
        }
    }
}

#[test]
fn a_material_whose_row_is_lost_comes_back_with_all_that_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let own = sound("own");
    Store::open(&path).unwrap().add([&own, &support::database::change(sound("own"))]).unwrap();
    let whole = contents(&path);
    assert_eq!(whole.len(), 2);
    tamper(&path, "DELETE FROM material");
    let message = refused(matdb(folder.path()).args(["publish", "site"]));
    assert!(message.contains("is damaged"), "{message}");
    matdb(folder.path()).args(["check", "--repair"]).assert().success();
    assert_eq!(contents(&path), whole);

    // Without any word of its name it cannot come back, and its measured rows stay in a copy.
    tamper(&path, "DELETE FROM material; DELETE FROM entry");
    matdb(folder.path()).args(["check", "--repair"]).assert().success();
    let left: i64 = Connection::open(folder.path().join("matdb.sqlite.before-repair-2"))
        .unwrap()
        .query_row("SELECT count(*) FROM observation", [], |row| row.get(0))
        .unwrap();
    assert!(left > 0);
}

#[test]
fn a_material_whose_name_is_taken_does_not_keep_the_others_from_coming_back() {
    let (folder, path) = database(&["ptfe", "glass", "mannequin-paint"]);
    tamper(
        &path,
        "DELETE FROM material WHERE slug <> 'glass'; DELETE FROM entry WHERE slug = 'glass';
         UPDATE entry SET slug = 'glass' WHERE slug = 'ptfe'",
    );
    let output = matdb(folder.path()).args(["check", "--repair", "--json"]).output().unwrap();
    let record: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = record.to_string();
    assert!(text.contains("`mannequin-paint` has its row again"), "{text}");
    assert!(text.contains("another material has its name, `glass`"), "{text}");
    assert!(!text.contains("UNIQUE"), "{text}");
    for name in ["glass", "mannequin-paint"] {
        matdb(folder.path()).args(["show", name]).assert().success();
    }
}

#[test]
fn a_repeated_revision_was_made_by_the_repair() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let own = sound("own");
    let mut store = Store::open(&path).unwrap();
    let fit = Activity { command: "fit".to_owned(), ..Activity::default() };
    store.add_made(&[(own.clone(), fit.clone())]).unwrap();
    store.add([&change(sound("own"))]).unwrap();
    tamper(&path, "DELETE FROM revision WHERE number = 2");
    store.repair(&[]).unwrap();
    let [first, last] = [1, 3].map(|number| store.get(&own.slug, Some(number)).unwrap().unwrap());
    assert_eq!(last.material, own);
    let Some(Activity { command, inputs, origin }) = last.activity else { panic!("no activity") };
    assert_eq!((command.as_str(), origin), ("check --repair", None));
    assert_eq!(inputs, [Input { name: "own@1".to_owned(), hash: first.content_hash }]);
    assert_eq!(first.activity, Some(fit));
}

#[test]
fn one_bad_name_does_not_keep_the_rest_from_being_mended() {
    let (folder, path) = database(&["ptfe", "glass"]);
    tamper(
        &path,
        "PRAGMA ignore_check_constraints = on; UPDATE material SET slug = 'No Name' WHERE slug = 'glass';
         DELETE FROM entry WHERE slug = 'glass'; DROP TABLE unit; UPDATE fit_parameter SET value = value / 2 WHERE path = 'k' AND revision_id IN
         (SELECT revision.id FROM revision JOIN material ON material.id = material_id WHERE slug = 'ptfe')",
    );
    let output = matdb(folder.path()).args(["check", "--repair", "--json"]).output().unwrap();
    let record: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let text = record.to_string();
    assert!(text.contains("`ptfe@1` was written anew") && text.contains("table unit"), "{text}");
    assert!(text.contains("`No Name` is not a name"), "{text}");
    matdb(folder.path()).args(["show", "ptfe"]).assert().success();
}

#[test]
fn mending_a_revision_of_an_old_program_leaves_its_neighbours_sound() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    fs::copy(support::root().join("tests/fixtures/schema-0003.sqlite"), &path).unwrap();
    let mut store = Store::open(&path).unwrap();
    let slug = store.list().unwrap()[0].slug.clone();
    let stored = store.get(&slug, None).unwrap().unwrap();
    tamper(&path, "UPDATE source SET title = 'other' WHERE revision_id = 2");
    assert_eq!(store.add([&stored.material]).unwrap(), [Addition::Repaired(stored.revision)]);
    drop(store);
    let output = matdb(folder.path()).args(["check", "--json"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(!text.contains("statistics"), "{text}");
}

#[test]
fn what_is_not_at_hand_is_left_and_named_and_what_is_sound_is_mended_around_it() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let own = sound("own");
    let ptfe = builtin::get("ptfe").unwrap().unwrap();
    Store::open(&path).unwrap().add([&own, &ptfe]).unwrap();
    tamper(
        &path,
        "UPDATE source SET title = 'other'; UPDATE unit SET ucum = 'furlong' WHERE ucum = 'm'; DROP INDEX entry_class",
    );
    let output = matdb(folder.path()).args(["check", "--repair", "--json"]).output().unwrap();
    assert!(!output.status.success());
    let record: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let findings = record["findings"].as_array().unwrap();
    let is_of_own = |found: &serde_json::Value| found.to_string().contains("own");
    assert!(!findings.is_empty() && findings.iter().all(is_of_own), "{record}");
    assert!(record["repaired"].as_array().unwrap().len() >= 3, "{record}");
    // Whoever has the content brings it back, under the number, date and maker that it had.
    let before = Store::open_existing(&path).unwrap().unwrap().history(&own.slug).unwrap();
    assert_eq!(Store::open(&path).unwrap().add([&own]).unwrap(), [Addition::Repaired(1)]);
    assert_eq!(Store::open_existing(&path).unwrap().unwrap().history(&own.slug).unwrap(), before);
    assert_eq!(contents(&path), [own, ptfe]);
    matdb(folder.path()).arg("check").assert().success();
}

#[test]
fn an_earlier_revision_never_passes_for_the_current_one() {
    let (folder, path) = database(&["ptfe"]);
    let withdraw = ["withdraw", "ptfe", "--reason", "the trihedral was dented"];
    matdb(folder.path()).args(withdraw).assert().success();
    tamper(&path, "UPDATE material SET current_revision = 1");
    for command in ["show ptfe", "cite ptfe", "publish site"] {
        let message = refused(matdb(folder.path()).arg("-q").args(command.split(' ')));
        assert!(message.contains("revision 1 as its current one, and a revision 2"), "{message}");
    }
    matdb(folder.path()).arg("check").assert().failure();
    matdb(folder.path()).args(["check", "--repair"]).assert().success();
    let listed = matdb(folder.path()).arg("list").assert().success();
    assert!(String::from_utf8_lossy(&listed.get_output().stdout).contains("withdrawn"));
}

#[test]
fn a_built_in_never_stands_in_for_a_material_that_has_lost_its_row() {
    let (folder, path) = database(&["cotton"]);
    let scene = scene_of(folder.path(), "cotton");
    tamper(&path, "DELETE FROM material");
    for command in ["show cotton", "cite cotton", "export cotton --as csv -o c.csv"] {
        let message = refused(matdb(folder.path()).arg("-q").args(command.split(' ')));
        assert!(message.contains("its own row is not there"), "{message}");
    }
    refused(matdb(folder.path()).arg("-q").arg("render").arg(&scene).args(["-o", "out"]));
    matdb(folder.path()).arg("check").assert().failure();
    fs::copy(&path, folder.path().join("copy.sqlite")).unwrap();
    matdb(folder.path()).args(["check", "--repair"]).assert().success();
    matdb(folder.path()).args(["show", "cotton"]).assert().success();
    // Or it is removed.
    let mut other = matdb(folder.path());
    other.args(["--db", "copy.sqlite", "rm", "cotton"]).assert().success();
    matdb(folder.path()).args(["--db", "copy.sqlite", "check"]).assert().success();
}

#[test]
fn what_a_lost_revision_leaves_behind_is_removed_and_a_copy_keeps_it() {
    for lost in [
        "DELETE FROM revision WHERE number = 1",
        // With all its revisions: the rows and the line of a list that named them.
        "DELETE FROM material; DELETE FROM entry; DELETE FROM revision WHERE number = 2",
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matdb.sqlite");
        let mut store = Store::open(&path).unwrap();
        store.add([&sound("own")]).unwrap();
        store.add([&change(sound("own"))]).unwrap();
        drop(store);
        let levels = |path: &Path| -> i64 {
            let conn = Connection::open(path).unwrap();
            conn.query_row("SELECT count(*) FROM observation", [], |row| row.get(0)).unwrap()
        };
        let before = levels(&path);
        tamper(&path, lost);
        refused(matdb(folder.path()).args(["-q", "publish", "site"]));
        let output = matdb(folder.path()).args(["check", "--repair"]).assert().success();
        let said = String::from_utf8_lossy(&output.get_output().stdout).into_owned();
        let copy = folder.path().join("matdb.sqlite.before-repair");
        assert!(
            said.contains("rows of lost revisions")
                && said.contains(".before-repair: as it was before the repair"),
            "{said}"
        );
        assert_eq!(levels(&copy), before);
        assert!(levels(&path) < before);
        matdb(folder.path()).arg("check").assert().success();
        // The number that was lost is not taken by what is added next.
        assert_eq!(Store::open(&path).unwrap().add([&sound("new")]).unwrap(), [Addition::New]);
        matdb(folder.path()).arg("check").assert().success();
        // Nothing more to copy.
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        assert!(!folder.path().join("matdb.sqlite.before-repair-2").exists());
    }
}

#[test]
fn triggers_tables_and_indexes_of_others_are_seen_and_a_trigger_never_runs() {
    for (sql, named) in [
        (
            "CREATE TRIGGER evil AFTER INSERT ON revision BEGIN DELETE FROM material; END",
            "trigger evil",
        ),
        ("CREATE TABLE more (x)", "table more"),
        ("CREATE INDEX more ON source (title)", "index more"),
        ("CREATE VIEW more AS SELECT 1", "view more"),
    ] {
        let (folder, path) = database(&["ptfe"]);
        tamper(&path, sql);
        let output = matdb(folder.path()).arg("check").output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(!output.status.success() && text.contains(named), "{sql}: {text}");
    }
    let (folder, path) = database(&["ptfe"]);
    tamper(&path, "CREATE TRIGGER evil AFTER INSERT ON revision BEGIN DELETE FROM material; END");
    let before = fs::read(&path).unwrap();
    for command in ["add glass", "rm ptfe", "withdraw ptfe --reason x", "check --repair"] {
        let message = refused(matdb(folder.path()).args(command.split(' ')));
        assert!(
            message.contains("trigger `evil`") && message.contains("DROP TRIGGER"),
            "{message}"
        );
    }
    assert_eq!(fs::read(&path).unwrap(), before);
    tamper(&path, "DROP TRIGGER evil");
    matdb(folder.path()).args(["add", "glass"]).assert().success();
}

#[test]
fn a_database_is_a_path_whatever_its_name_means_to_sqlite() {
    let folder = tempfile::tempdir().unwrap();
    let foreign = folder.path().join("foreign.sqlite");
    Connection::open(&foreign).unwrap().execute_batch("CREATE TABLE t (x)").unwrap();
    let before = fs::read(&foreign).unwrap();
    for name in
        ["file:foreign.sqlite", ":memory:", "file:x?mode=memory", "file:foreign.sqlite?vfs=unix"]
    {
        matdb(folder.path()).args(["--db", name, "add", "ptfe"]).assert().success();
        matdb(folder.path()).args(["--db", name, "show", "ptfe"]).assert().success();
        matdb(folder.path()).args(["--db", name, "publish", "site"]).assert().success();
        assert!(folder.path().join(name).is_file(), "{name}");
    }
    assert_eq!(fs::read(&foreign).unwrap(), before);
    let message = refused(matdb(folder.path()).args(["--db", "foreign.sqlite", "add", "ptfe"]));
    assert!(message.contains("is not a matdb database"), "{message}");
}

#[test]
fn what_cannot_be_read_back_is_not_stored() {
    let (_folder, path) = database(&["ptfe"]);
    // Rows that a faulty disk or program lets vanish on their way.
    let mut store = Store::open(&path).unwrap();
    tamper(
        &path,
        "CREATE TRIGGER lost AFTER INSERT ON source BEGIN UPDATE source SET title = 'x'; END",
    );
    let error = store.add([&builtin::get("glass").unwrap().unwrap()]).unwrap_err();
    let message = error.to_string();
    assert!(matches!(error, StoreError::NotReadable { .. }), "{message}");
    assert!(message.contains("`glass`") && message.contains("nothing was stored"), "{message}");
    assert_eq!(contents(&path).len(), 1);
}

/// Overwrites the first page of a table or an index.
fn tear(path: &Path, name: &str) {
    let conn = Connection::open(path).unwrap();
    conn.pragma_update(None, "journal_mode", "delete").unwrap();
    let sql = "SELECT rootpage FROM sqlite_schema WHERE name = ?1";
    let page: u32 = conn.query_row(sql, [name], |row| row.get(0)).unwrap();
    let size: u32 = conn.pragma_query_value(None, "page_size", |row| row.get(0)).unwrap();
    drop(conn);
    let (page, size) = (page as usize, size as usize);
    let mut bytes = fs::read(path).unwrap();
    bytes[(page - 1) * size..page * size].fill(0xff);
    fs::write(path, bytes).unwrap();
}

#[test]
fn a_damaged_page_is_beyond_repair_and_what_can_still_be_done_is_said() {
    for torn in ["entry_tag_tag", "unit", "search_data"] {
        let (folder, path) = database(&["cotton"]);
        tear(&path, torn);
        let message = refused(matdb(folder.path()).args(["check", "--repair"]));
        assert!(message.contains("no repair mends that"), "{torn}: {message}");
        assert!(message.contains("restore the file from a copy"), "{torn}: {message}");
        assert!(!message.contains("check --repair"), "{torn}: {message}");
        // What the message offers works.
        matdb(folder.path()).arg("list").assert().success();
        let export = ["export", "cotton", "--as", "csv", "-o", "cotton.csv"];
        matdb(folder.path()).args(export).assert().success();
    }
}

#[test]
fn a_whole_revision_is_shown_though_the_current_one_is_damaged() {
    let (folder, path) = database(&["cotton"]);
    let withdraw = ["withdraw", "cotton", "--reason", "Measured again."];
    matdb(folder.path()).args(withdraw).assert().success();
    tamper(&path, "UPDATE revision SET name = 'another' WHERE number = 2");
    refused(matdb(folder.path()).args(["show", "cotton"]));
    for command in [&["show", "cotton@1"][..], &["cite", "cotton@1"]] {
        let run = matdb(folder.path()).args(command).output().unwrap();
        let notices = String::from_utf8(run.stderr).unwrap();
        assert!(run.status.success() && !run.stdout.is_empty(), "{notices}");
        assert!(notices.contains("the current revision of `cotton` is damaged: "), "{notices}");
    }
}

/// A database with one material of two revisions, each with the command that made it.
fn recorded() -> (tempfile::TempDir, PathBuf, Material) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let by = |command: &str| Activity {
        command: command.to_owned(),
        inputs: vec![Input { name: "own.csv".to_owned(), hash: "0".repeat(64) }],
        origin: None,
    };
    let last = change(sound("own"));
    let mut store = Store::open(&path).unwrap();
    store.add_made(&[(sound("own"), by("measure")), (last.clone(), by("fit"))]).unwrap();
    (folder, path, last)
}

#[test]
fn a_revision_with_another_record_is_not_shown_and_a_repair_says_that_it_was_there() {
    for change in [
        "UPDATE revision SET added_at = '2001-01-01T00:00:00Z' WHERE number = 2",
        "UPDATE revision SET program_version = '9.9.9' WHERE number = 2",
        "UPDATE record SET date_hash = NULL WHERE revision_id = 2",
        "UPDATE activity SET command = 'import' WHERE command = 'fit'",
        "DELETE FROM activity WHERE command = 'fit'",
        "UPDATE activity_input SET name = 'another.csv' WHERE revision_id = 2",
        "DELETE FROM activity_input WHERE revision_id = 2",
        "INSERT INTO origin (revision_id, revision, added_at, program_version)
         VALUES (2, 1, '2001-01-01T00:00:00Z', '0.1.0')",
    ] {
        let (folder, path, material) = recorded();
        tamper(&path, change);
        let damaged = fs::read(&path).unwrap();
        for command in ["show own", "show own@2 --json", "history own", "publish site", "check"] {
            let output = matdb(folder.path()).args(command.split(' ')).output().unwrap();
            let text = [output.stdout, output.stderr].concat();
            let text = String::from_utf8_lossy(&text);
            assert!(!output.status.success(), "{change}: {command}: {text}");
            let is_named = text.contains(" than was stored");
            assert!(is_named || command.starts_with("publish"), "{change}: {command}: {text}");
        }
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        assert!(is_sound(&path), "{change}");
        let stored = Store::open(&path).unwrap().get(&material.slug, None).unwrap().unwrap();
        // What was sound of its record stays.
        let is_of_command = change.contains("activity");
        let Activity { command, inputs, origin } = stored.activity.unwrap();
        assert_eq!(command, if is_of_command { "check --repair" } else { "fit" }, "{change}");
        assert_eq!(inputs[0].name, if is_of_command { "own@2" } else { "own.csv" }, "{change}");
        assert_eq!(origin, None, "{change}");
        let is_of_date = change.starts_with("UPDATE revision SET added_at");
        assert_eq!(stored.program_version, env!("CARGO_PKG_VERSION"), "{change}");
        assert!(!is_of_date || stored.added_at.as_str() > "2026-01-01", "{change}");
        assert_eq!(stored.revision, 2);

        fs::write(&path, damaged).unwrap();
        let mut store = Store::open(&path).unwrap();
        assert_eq!(store.add([&material]).unwrap(), [Addition::Repaired(2)], "{change}");
        assert!(is_sound(&path), "{change}");
    }
}

#[test]
fn revisions_under_other_numbers_are_refused_and_never_taken_for_what_they_are_called() {
    let (folder, path, material) = recorded();
    tamper(
        &path,
        "UPDATE revision SET number = number + 10; UPDATE revision SET number = 13 - number",
    );
    refused(matdb(folder.path()).args(["show", "own"]));
    refused(matdb(folder.path()).args(["show", "own@1"]));
    let output = matdb(folder.path()).args(["check", "--repair"]).output().unwrap();
    let text = String::from_utf8_lossy(&output.stdout).into_owned()
        + &String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && text.contains("name or number"), "{text}");
    refused(matdb(folder.path()).args(["show", "own"]));
    // What is added gets a number of its own.
    let mut store = Store::open(&path).unwrap();
    assert_eq!(store.add([&material]).unwrap(), [Addition::Revision(3)]);
    assert_eq!(store.get(&material.slug, None).unwrap().unwrap().material, material);
}

#[test]
fn a_revision_whose_number_cannot_be_proved_is_never_accepted() {
    for change in [
        "DELETE FROM record WHERE revision_id = 2",
        "UPDATE record SET number_hash = NULL WHERE revision_id = 2",
        "UPDATE revision SET number = 9, added_at = '2001-01-01T00:00:00Z' WHERE number = 2;
         UPDATE material SET current_revision = 9",
        "UPDATE revision SET number = number + 10;
         UPDATE revision SET number = 13 - number, added_at = '2001-01-01T00:00:00Z'",
    ] {
        let (folder, path, material) = recorded();
        tamper(&path, change);
        for command in ["show own", "check --repair", "show own"] {
            let output = matdb(folder.path()).args(command.split(' ')).output().unwrap();
            let text = [output.stdout, output.stderr].concat();
            let text = String::from_utf8_lossy(&text);
            let is_said =
                ["name or number", "name and number"].iter().any(|words| text.contains(words));
            assert!(!output.status.success() && is_said, "{change}: {command}: {text}");
        }
        // What is added gets a number of its own.
        let mut store = Store::open(&path).unwrap();
        let added = store.add([&material]).unwrap();
        assert!(matches!(added[0], Addition::Revision(3 | 10)), "{change}: {added:?}");
        assert_eq!(store.get(&material.slug, None).unwrap().unwrap().material, material);
    }
}

#[test]
fn a_repair_never_takes_a_withdrawal_back() {
    for change in [
        "DELETE FROM revision WHERE number = 2",
        "UPDATE revision SET status = 'active', status_reason = NULL WHERE number = 2",
        "UPDATE revision SET number = 9 WHERE number = 2",
    ] {
        let (folder, path) = database(&["ptfe", "glass"]);
        let withdraw = ["withdraw", "ptfe", "--reason", "the trihedral was dented"];
        matdb(folder.path()).args(withdraw).assert().success();
        tamper(&path, change);
        matdb(folder.path()).args(["check", "--repair"]).assert().failure();
        let output = matdb(folder.path()).arg("list").output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        let line = text.lines().find(|line| line.starts_with("ptfe ")).unwrap();
        assert!(output.status.success(), "{change}");
        assert!(line.contains(" damaged ") || line.contains("withdrawn"), "{change}: {line}");
        refused(matdb(folder.path()).args(["show", "ptfe"]));
    }
}

#[test]
fn a_sound_origin_is_kept_and_a_damaged_one_is_not() {
    let origin = Origin {
        title: Some("Paints of Roe".to_owned()),
        authors: vec!["Roe, Ann".to_owned()],
        added_at: "2026-03-14T09:26:53Z".to_owned(),
        program_version: "0.1.0".to_owned(),
        revision: 1,
        ..Origin::default()
    };
    let by = |command: &str, origin: Option<Origin>| Activity {
        command: command.to_owned(),
        inputs: Vec::new(),
        origin,
    };
    for (change, is_kept, command) in [
        ("UPDATE activity SET command = 'add'", true, "check --repair"),
        ("DELETE FROM activity", true, "check --repair"),
        ("UPDATE origin SET title = 'Paints of Doe'", false, "import"),
        ("UPDATE origin_author SET author = 'Doe, Jane'", false, "import"),
        ("DELETE FROM origin_author; DELETE FROM origin", false, "import"),
        ("UPDATE revision SET added_at = '2001-01-01T00:00:00Z'", true, "import"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matdb.sqlite");
        let own = sound("own");
        let made = [(own.clone(), by("import", Some(origin.clone())))];
        Store::open(&path).unwrap().add_made(&made).unwrap();
        tamper(&path, change);
        let damaged = fs::read(&path).unwrap();
        let made_by = |path: &Path| {
            let stored = Store::open(path).unwrap().get(&own.slug, None).unwrap().unwrap();
            stored.activity.unwrap()
        };
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        let repaired = made_by(&path);
        assert_eq!(repaired.command, command, "{change}");
        assert_eq!(repaired.origin, is_kept.then(|| origin.clone()), "{change}");
        // What is added again brings an origin with it.
        fs::write(&path, damaged).unwrap();
        let other = Origin { title: Some("A second import".to_owned()), ..origin.clone() };
        let made = [(own.clone(), by("import again", Some(other.clone())))];
        Store::open(&path).unwrap().add_made(&made).unwrap();
        let again = made_by(&path);
        assert_eq!(again.origin, Some(if is_kept { origin.clone() } else { other }), "{change}");
    }
}

#[test]
fn rows_of_others_stay_and_a_repair_leaves_a_copy() {
    let (folder, path) = database(&["ptfe", "glass"]);
    tamper(
        &path,
        "CREATE TABLE mine (revision_id INTEGER, note TEXT);
         INSERT INTO mine VALUES (1, 'a note'), (77, 'of no revision');
         UPDATE source SET title = 'other'",
    );
    let said = matdb(folder.path()).args(["check", "--repair"]).assert().failure();
    let said = String::from_utf8_lossy(&said.get_output().stdout).into_owned();
    assert!(said.contains("DROP table mine removes it"), "{said}");
    let count = |path: &Path, sql: &str| -> i64 {
        Connection::open(path).unwrap().query_row(sql, [], |row| row.get(0)).unwrap()
    };
    assert_eq!(count(&path, "SELECT count(*) FROM mine"), 2);
    let copy = folder.path().join("matdb.sqlite.before-repair");
    assert_eq!(count(&copy, "SELECT count(*) FROM mine"), 2);
    assert!(count(&copy, "SELECT count(*) FROM source WHERE title = 'other'") > 0);
    assert_eq!(count(&path, "SELECT count(*) FROM source WHERE title = 'other'"), 0);
}

#[test]
fn a_lost_database_beside_its_log_is_not_a_new_one() {
    for is_there in [false, true] {
        let (folder, path) = database(&["ptfe"]);
        fs::remove_file(&path).unwrap();
        if is_there {
            fs::write(&path, b"").unwrap();
        }
        let log = folder.path().join("matdb.sqlite-wal");
        fs::write(&log, b"what was written last").unwrap();
        for command in ["list", "add glass", "show ptfe", "check"] {
            let message = refused(matdb(folder.path()).args(command.split(' ')));
            assert!(message.contains("matdb.sqlite-wal is; bring the file back"), "{message}");
            assert_eq!(fs::read(&log).unwrap(), b"what was written last");
        }
    }
}

#[test]
fn an_earlier_revision_that_is_gone_is_noticed() {
    let (folder, path) = database(&["ptfe"]);
    let withdraw = ["withdraw", "ptfe", "--reason", "the trihedral was dented"];
    matdb(folder.path()).args(withdraw).assert().success();
    let conn = Connection::open(&path).unwrap();
    conn.pragma_update(None, "foreign_keys", true).unwrap();
    conn.execute("DELETE FROM revision WHERE number = 1", []).unwrap();
    drop(conn);
    let said = matdb(folder.path()).arg("check").assert().success();
    let said = String::from_utf8_lossy(&said.get_output().stderr).into_owned();
    assert!(said.contains("`ptfe` has revisions up to 2, of which 1 are stored"), "{said}");
}

#[test]
fn a_sound_revision_is_shown_though_another_has_another_date() {
    let (folder, path, _) = recorded();
    tamper(&path, "UPDATE revision SET added_at = '2001-01-01T00:00:00Z' WHERE number = 1");
    let output = matdb(folder.path()).args(["show", "own"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && said.contains("its revisions are not listed"), "{said}");
    refused(matdb(folder.path()).args(["show", "own@1"]));
}

#[test]
fn a_wrong_number_of_the_schema_does_not_advise_to_remove_tables() {
    let (folder, path) = database(&["ptfe"]);
    tamper(&path, "PRAGMA user_version = 14");
    for command in ["list", "add glass"] {
        let message = refused(matdb(folder.path()).args(command.split(' ')));
        assert!(
            message.contains("says that it has schema 14, but its table `record`"),
            "{message}"
        );
        assert!(!message.contains("remove"), "{message}");
    }
}

#[test]
fn lists_and_searches_that_say_something_else_are_refused_until_they_are_repaired() {
    let readers = [
        "list --status active",
        "list --class metal",
        "list --tag dielectric",
        "search ptfe",
        "near --material cotton",
    ];
    for (change, reading) in [
        ("UPDATE entry SET name = 'Another name' WHERE slug = 'glass'", &readers[..]),
        ("UPDATE entry SET status = 'withdrawn' WHERE slug = 'glass'", &readers[..]),
        ("DELETE FROM entry WHERE slug = 'glass'", &readers[..]),
        ("DELETE FROM entry_tag WHERE slug = 'glass'", &readers[2..3]),
        ("DELETE FROM search WHERE slug = 'glass'", &readers[3..4]),
        ("UPDATE search SET description = 'ptfe' WHERE slug = 'glass'", &readers[3..4]),
        (
            "UPDATE outline SET levels = (SELECT levels FROM outline WHERE slug = 'ptfe')
             WHERE slug = 'glass'",
            &readers[4..],
        ),
        ("DELETE FROM outline WHERE slug = 'glass'", &readers[4..]),
    ] {
        let (folder, path) = database(&["ptfe", "glass", "steel", "cotton"]);
        for command in readers {
            matdb(folder.path()).args(command.split(' ')).assert().success();
        }
        tamper(&path, change);
        for command in reading {
            let message = refused(matdb(folder.path()).args(command.split(' ')));
            assert!(message.contains("`glass` is not what is stored"), "{change}: {message}");
            assert!(message.contains("check --repair"), "{message}");
        }
        // A list of all materials shows the others.
        let output = matdb(folder.path()).arg("list").output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        let is_called_damaged =
            text.lines().any(|line| line.starts_with("glass ") && line.contains(" damaged "));
        assert_eq!(is_called_damaged, change.starts_with("UPDATE entry"), "{change}: {text}");
        assert_eq!(
            output.status.success(),
            !change.starts_with("DELETE FROM entry WHERE"),
            "{change}"
        );
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        for command in readers {
            matdb(folder.path()).args(command.split(' ')).assert().success();
        }
    }
}

#[test]
fn a_material_that_no_repair_mends_does_not_close_lists_and_searches() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("matdb.sqlite");
    let [cotton, steel] = ["cotton", "steel"].map(|name| builtin::get(name).unwrap().unwrap());
    let mut own = cotton.clone();
    own.slug = "own".parse().unwrap();
    Store::open(&path).unwrap().add([&own, &cotton, &steel]).unwrap();
    tamper(
        &path,
        "UPDATE revision SET class = 'metal', description = 'steel' WHERE id = 1;
         UPDATE fit_parameter SET value = value / 2 WHERE revision_id = 1",
    );
    matdb(folder.path()).args(["check", "--repair"]).assert().failure();
    for command in ["list --class metal", "list", "search steel", "near --material cotton"] {
        let output = matdb(folder.path()).args(command.split(' ')).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        let notices = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command}: {notices}");
        let own = text.lines().find(|line| line.starts_with("own"));
        assert!(own.is_none_or(|line| line.contains("damaged")), "{command}: {text}");
        assert_eq!(own.is_some(), command == "list", "{command}: {text}");
        assert!(!command.starts_with("near") || notices.contains("`own` is damaged"), "{notices}");
    }
}

/// Changes an index as a table of its columns and the row number, called `entries`.
fn change_index(path: &Path, index: &str, columns: &str, sql: &str) {
    let conn = Connection::open(path).unwrap();
    conn.execute_batch("PRAGMA writable_schema = on").unwrap();
    let table = format!("CREATE TABLE entries ({columns}, PRIMARY KEY ({columns})) WITHOUT ROWID");
    let add = "INSERT INTO sqlite_schema SELECT 'table', 'entries', 'entries', rootpage, ?2
               FROM sqlite_schema WHERE name = ?1";
    conn.execute(add, [index, table.as_str()]).unwrap();
    drop(conn);
    let conn = Connection::open(path).unwrap();
    conn.execute_batch(sql).unwrap();
    let remove = "PRAGMA writable_schema = on; DELETE FROM sqlite_schema WHERE name = 'entries'";
    conn.execute_batch(remove).unwrap();
}

#[test]
fn an_index_that_exchanges_two_revisions_is_not_believed() {
    let (folder, path) = database(&["ptfe", "steel"]);
    let withdraw = ["withdraw", "ptfe", "--reason", "the trihedral was dented"];
    matdb(folder.path()).args(withdraw).assert().success();
    let sound = fs::read(&path).unwrap();
    for sql in [
        "DELETE FROM entries WHERE m = 1; INSERT INTO entries VALUES (1, 1, 3), (1, 2, 1)",
        "INSERT INTO entries VALUES (1, 3, 1)",
        "INSERT INTO entries VALUES (1, 9, 77)",
    ] {
        fs::write(&path, &sound).unwrap();
        change_index(&path, "sqlite_autoindex_revision_1", "m, n, r", sql);
        for command in ["show ptfe", "history ptfe", "cite ptfe", "export ptfe --as csv -o a.csv"] {
            let message = refused(matdb(folder.path()).args(command.split(' ')));
            assert!(message.contains("damaged"), "{sql}: {command}: {message}");
        }
        matdb(folder.path()).arg("check").assert().failure();
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        let shown = matdb(folder.path()).args(["show", "ptfe"]).assert().success();
        let shown = String::from_utf8_lossy(&shown.get_output().stdout).into_owned();
        assert!(shown.contains("the trihedral was dented"), "{sql}: {shown}");
    }
}

#[test]
fn rows_of_others_that_refer_to_lists_and_fits_stay() {
    let (folder, path) = database(&["ptfe", "steel"]);
    tamper(
        &path,
        "CREATE TABLE note (slug TEXT REFERENCES entry (slug) ON DELETE CASCADE, note TEXT);
         INSERT INTO note VALUES ('steel', 'mine');
         CREATE TABLE mark (revision_id INTEGER, fit TEXT, FOREIGN KEY (revision_id, fit)
             REFERENCES fit (revision_id, name) ON DELETE CASCADE);
         INSERT INTO mark SELECT revision_id, name FROM fit;
         UPDATE source SET title = 'other'",
    );
    let count = |table: &str| -> i64 {
        let sql = format!("SELECT count(*) FROM {table}");
        Connection::open(&path).unwrap().query_row(&sql, [], |row| row.get(0)).unwrap()
    };
    let marks = count("mark");
    let said = matdb(folder.path()).args(["check", "--repair"]).assert().failure();
    let said = String::from_utf8_lossy(&said.get_output().stdout).into_owned();
    assert!(said.contains("`steel@1` was written anew"), "{said}");
    assert_eq!((count("note"), count("mark")), (1, marks));
    matdb(folder.path()).args(["withdraw", "steel", "--reason", "old"]).assert().success();
    assert_eq!(count("note"), 1);
}

#[test]
fn what_lists_know_of_a_lost_revision_is_not_overwritten() {
    let withdrawn = |lost: &str| {
        let (folder, path) = database(&["ptfe", "steel", "glass"]);
        let withdraw = ["withdraw", "ptfe", "--reason", "the trihedral was dented"];
        matdb(folder.path()).args(withdraw).assert().success();
        tamper(&path, lost);
        folder
    };
    for lost in [
        "DELETE FROM revision WHERE number = 2; UPDATE material SET current_revision = 1",
        "DELETE FROM revision WHERE number = 2; UPDATE entry SET revision = 1, status = 'active'",
    ] {
        let folder = withdrawn(lost);
        matdb(folder.path()).args(["check", "--repair"]).assert().failure();
        let listed = matdb(folder.path()).arg("list").assert().success();
        let listed = String::from_utf8_lossy(&listed.get_output().stdout).into_owned();
        let line = listed.lines().find(|line| line.starts_with("ptfe ")).unwrap();
        assert!(line.contains("damaged"), "{lost}: {line}");
    }
    let (folder, path) = database(&["ptfe", "steel", "glass"]);
    for by in ["steel", "glass"] {
        let supersede = ["withdraw", "ptfe", "--reason", "measured again", "--superseded-by", by];
        matdb(folder.path()).args(supersede).assert().success();
    }
    tamper(&path, "DELETE FROM revision WHERE number = 3");
    matdb(folder.path()).args(["check", "--repair"]).assert().failure();
    refused(matdb(folder.path()).args(["show", "ptfe"]));
}

#[test]
fn what_follows_from_the_materials_comes_back_whatever_is_dropped() {
    for dropped in [
        "TABLE curve",
        "TABLE observation",
        "TABLE entry",
        "TABLE entry_tag",
        "TABLE outline",
        "TABLE search",
        "TABLE unit",
        "TABLE curve_statistic",
        "VIEW entry_made",
        "VIEW entry_tag_made",
        "VIEW search_made",
        "VIEW v_fits",
        "INDEX entry_class",
        "TRIGGER search_removed",
    ] {
        let (folder, path) = database(&["cotton", "ptfe"]);
        let whole = contents(&path);
        tamper(&path, &format!("DROP {dropped}"));
        let found = matdb(folder.path()).arg("check").assert().failure();
        let found = String::from_utf8_lossy(&found.get_output().stdout).into_owned();
        let name = dropped.split(' ').nth(1).unwrap();
        assert!(found.contains(name), "{dropped}: {found}");
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        assert!(is_sound(&path), "{dropped}");
        assert_eq!(contents(&path), whole, "{dropped}");
    }
}

#[test]
fn a_damaged_line_of_a_list_does_not_end_a_check() {
    for change in [
        "UPDATE entry SET kind = '' WHERE slug = 'steel'",
        "UPDATE entry SET curves = -1 WHERE slug = 'steel'",
        "UPDATE entry SET name = CAST(x'ff' AS TEXT) WHERE slug = 'steel'",
        "UPDATE entry SET slug = '' WHERE slug = 'steel'",
    ] {
        let (folder, path) = database(&["ptfe", "steel"]);
        tamper(&path, change);
        let found = matdb(folder.path()).arg("check").assert().failure();
        let output = found.get_output();
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(said.contains("looked at 2 revisions"), "{change}: {said}");
        matdb(folder.path()).args(["check", "--repair"]).assert().success();
        assert!(is_sound(&path), "{change}");
    }
}

#[test]
fn advice_on_damage_can_be_followed() {
    let (folder, path) = database(&["ptfe"]);
    let withdraw = ["withdraw", "ptfe", "--reason", "the trihedral was dented"];
    matdb(folder.path()).args(withdraw).assert().success();
    tamper(&path, "UPDATE material SET current_revision = 1");
    let message = refused(matdb(folder.path()).args(["add", "ptfe"]));
    assert!(message.contains("check --repair"), "{message}");
    // What goes with a table of others goes when it does.
    let (folder, path) = database(&["ptfe"]);
    let table = "CREATE TABLE \"my notes\" (id INTEGER PRIMARY KEY AUTOINCREMENT, a UNIQUE);
                 INSERT INTO \"my notes\" (a) VALUES (1); CREATE VIRTUAL TABLE own USING fts5 (a)";
    tamper(&path, table);
    let said = matdb(folder.path()).arg("check").assert().failure();
    let said = String::from_utf8_lossy(&said.get_output().stdout).into_owned();
    let advice = said.lines().filter_map(|line| Some(line.split_once(": DROP ")?.1));
    let drops: Vec<&str> = advice.map(|line| line.trim_end_matches(" removes it")).collect();
    assert_eq!(drops, ["table \"my notes\"", "table own"]);
    drops.iter().for_each(|drop| tamper(&path, &format!("DROP {drop}")));
    matdb(folder.path()).arg("check").assert().success();
}

#[test]
fn an_index_of_others_that_only_their_program_reads_stops_nothing() {
    let (folder, path) = database(&["ptfe", "steel"]);
    let conn = Connection::open(&path).unwrap();
    let flags = rusqlite::functions::FunctionFlags::SQLITE_DETERMINISTIC
        | rusqlite::functions::FunctionFlags::SQLITE_UTF8;
    conn.create_scalar_function("own", 1, flags, |context| context.get::<String>(0)).unwrap();
    conn.execute_batch("CREATE TABLE mine (x TEXT); CREATE INDEX mine_x ON mine (own(x))").unwrap();
    drop(conn);
    matdb(folder.path()).args(["add", "glass"]).assert().success();
    tamper(&path, "DROP INDEX entry_class");
    let said = matdb(folder.path()).args(["check", "--repair"]).assert().failure();
    let said = String::from_utf8_lossy(&said.get_output().stdout).into_owned();
    assert!(said.contains("index entry_class was made anew"), "{said}");
    assert!(!said.contains("cannot be mended"), "{said}");
}

#[test]
fn what_is_added_again_repairs_an_earlier_revision_under_its_number() {
    let (folder, path, last) = recorded();
    let first = sound("own");
    tamper(&path, "UPDATE source SET title = 'other' WHERE revision_id = 1");
    refused(matdb(folder.path()).args(["show", "own@1"]));
    let mut store = Store::open(&path).unwrap();
    assert_eq!(store.add([&first]).unwrap(), [Addition::Repaired(1)]);
    assert_eq!(store.get(&first.slug, Some(1)).unwrap().unwrap().material, first);
    assert_eq!(store.get(&first.slug, None).unwrap().unwrap().material, last);
    drop(store);
    assert!(is_sound(&path));
    // Sound, it is what the material was before: a new revision brings that back.
    assert_eq!(Store::open(&path).unwrap().add([&first]).unwrap(), [Addition::Revision(3)]);
}

#[test]
fn rows_of_a_lost_revision_do_not_stop_another_material() {
    let (folder, path) = database(&["ptfe", "wood"]);
    let withdraw = ["withdraw", "wood", "--reason", "the sample was wet"];
    matdb(folder.path()).args(withdraw).assert().success();
    tamper(&path, "DELETE FROM revision WHERE number = 2");
    let found = matdb(folder.path()).arg("check").assert().failure();
    let found = String::from_utf8_lossy(&found.get_output().stdout).into_owned();
    assert!(found.contains("`wood` is there, but its revision 2 is not"), "{found}");
    matdb(folder.path()).args(["add", "brick"]).assert().success();
    let repaired = matdb(folder.path()).args(["check", "--repair"]).assert().failure();
    let repaired = String::from_utf8_lossy(&repaired.get_output().stdout).into_owned();
    assert!(repaired.contains("which lists call withdrawn"), "{repaired}");
    let added = matdb(folder.path()).args(["add", "wood"]).assert().success();
    let notice = String::from_utf8_lossy(&added.get_output().stderr).into_owned();
    assert!(notice.contains("if that had withdrawn it, withdraw it again"), "{notice}");
}

#[test]
fn a_file_that_was_cut_off_says_so_wherever_it_was() {
    let (folder, path) = database(&["ptfe", "wood", "glass"]);
    let whole = fs::read(&path).unwrap();
    for bytes in [50, 300, 4096, whole.len() / 2, whole.len() - 5000, whole.len() - 100] {
        fs::write(&path, &whole[..bytes]).unwrap();
        for command in ["list", "check", "add brick"] {
            let message = refused(matdb(folder.path()).args(command.split(' ')));
            assert!(message.contains("was cut off"), "{bytes}, {command}: {message}");
        }
    }
}

#[test]
fn the_log_of_another_database_is_named() {
    let (other, other_path) = database(&["--all"]);
    let (folder, path) = database(&["ptfe"]);
    let conn = Connection::open(&other_path).unwrap();
    let change = "UPDATE source SET title = 'other'; UPDATE revision SET description = name";
    conn.execute_batch(change).unwrap();
    fs::copy(other.path().join("matdb.sqlite-wal"), folder.path().join("matdb.sqlite-wal"))
        .unwrap();
    drop(conn);
    let sound = fs::read(&path).unwrap();
    for command in ["list", "check", "add glass"] {
        let message = refused(matdb(folder.path()).args(command.split(' ')));
        assert!(message.contains("move it away"), "{command}: {message}");
        assert_eq!(fs::read(&path).unwrap(), sound);
    }
    fs::remove_file(folder.path().join("matdb.sqlite-wal")).unwrap();
    matdb(folder.path()).arg("check").assert().success();
}

#[test]
fn history_says_when_the_current_revision_is_lost() {
    let (folder, path) = database(&["ptfe"]);
    let withdraw = ["withdraw", "ptfe", "--reason", "the trihedral was dented"];
    matdb(folder.path()).args(withdraw).assert().success();
    tamper(&path, "DELETE FROM revision WHERE number = 2");
    let message = refused(matdb(folder.path()).args(["history", "ptfe"]));
    assert!(message.contains("its revision 2 is not"), "{message}");
}

#[test]
fn lists_show_the_others_where_one_material_cannot_be_read() {
    let (folder, path) = database(&["cotton", "glass", "steel"]);
    tamper(
        &path,
        "DELETE FROM revision WHERE material_id = (SELECT id FROM material WHERE slug = 'glass')",
    );
    for command in ["list", "list --json", "search metal"] {
        let output = matdb(folder.path()).args(command.split(' ')).output().unwrap();
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success() && text.contains("steel"), "{command}: {text}");
    }
}
