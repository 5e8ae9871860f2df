//! Promise: what `matdb publish` writes is the database and nothing else, in files that say what they
//! are; the same database gives the same bytes; a folder is replaced as a whole or not at all; and
//! `matdb verify` sees whatever was changed afterwards.
//!
//! Checked by hand with the peers' own tools on a publication of the built-in materials, two of them
//! fitted: frictionless 5.16.1 (`frictionless validate datapackage.json`: all resources valid, keys and
//! references included), roc-validator 0.13.0 (RO-Crate 1.1, every requirement met), cffconvert 2.0.0
//! (`--validate`), jsonschema 4.26.0 (schemas by their own schema, every file by them).

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::support::database::{bytes, contents, refitted, sample, sound, with_effects};
use crate::support::{self, json_schema::problems};
use crate::support::{entries, matdb, refused, root};
use matdb::store::Store;
use serde_json::Value;

const ABOUT: &str = "title = 'Paints <of> \"ours\"'\nversion = '1.0'\ndoi = '10.5281/zenodo.123'\n\
    [[person]]\nfamily = 'Roe'\ngiven = 'Ann'\norcid = '0000-0002-1825-0097'\n";

/// A folder with a database of two materials, one of them with two revisions.
fn laboratory() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    store.add([&sample("paint"), &sound("primer")]).unwrap();
    store.add([&support::database::changed("paint")]).unwrap();
    fs::write(folder.path().join("about.toml"), ABOUT).unwrap();
    folder
}

fn publish(folder: &Path) {
    matdb(folder).args(["publish", "site", "--about", "about.toml", "-q"]).assert().success();
}

/// Every file below a folder, by its path.
fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in fs::read_dir(&at).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let bytes = fs::read(&path).unwrap();
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), bytes);
            }
        }
    }
    found
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn the_same_database_gives_the_same_bytes_and_every_hash_holds() {
    let folder = laboratory();
    publish(folder.path());
    let first = tree(&folder.path().join("site"));
    publish(folder.path());
    let second = tree(&folder.path().join("site"));
    for (path, bytes) in &first {
        assert!(second.get(path) == Some(bytes), "{}", path.display());
    }
    assert_eq!(first.len(), second.len());
    let said = matdb(folder.path()).args(["verify", "site", "--json"]).output().unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stdout));
    let said: Value = serde_json::from_slice(&said.stdout).unwrap();
    let counts = ["files", "materials", "revisions"].map(|key| said[key].as_u64().unwrap());
    assert_eq!(counts, [first.len() as u64, 2, 3]);
}

#[test]
fn the_database_beside_the_site_is_the_laboratorys() {
    let folder = laboratory();
    publish(folder.path());
    let site = folder.path().join("site");
    let ours = contents(&folder.path().join("matdb.sqlite"));
    assert_eq!(contents(&site.join("catalogue.sqlite")), ours);
    assert!(!site.join("catalogue.sqlite-wal").exists());
}

#[test]
fn every_json_file_is_as_its_schema_says() {
    let folder = laboratory();
    matdb(folder.path()).args(["add", "--all", "-q"]).assert().success();
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    store.add([&refitted(with_effects("reported"))]).unwrap();
    publish(folder.path());
    let site = folder.path().join("site");
    let mut checked = 0;
    let mut check = |schema: &str, file: &Path| {
        let schema = json(&site.join("schema").join(schema));
        let value = json(file);
        assert_eq!(problems(&schema, &value), [""; 0], "{}", file.display());
        let mut spoilt = value;
        spoilt["titel"] = "x".into();
        assert_eq!(problems(&schema, &spoilt), ["/titel: means nothing"]);
        checked += 1;
    };
    check("index.json", &site.join("api/v1/index.json"));
    check("changes.json", &site.join("changes.json"));
    for entry in fs::read_dir(site.join("api/v1/materials")).unwrap() {
        check("material.json", &entry.unwrap().path());
    }
    // The built-in materials, three of the test, the index and the changes.
    assert_eq!(checked, matdb::material::builtin::names().count() + 5);
}

#[test]
fn a_table_has_every_row_bit_for_bit_and_a_unit_for_every_number() {
    let folder = laboratory();
    publish(folder.path());
    let site = folder.path().join("site");
    let mut table = csv::Reader::from_path(site.join("tables/observation.csv")).unwrap();
    let header = table.headers().unwrap().clone();
    let at = |name: &str| header.iter().position(|column| column == name).unwrap();
    let (theta, sigma0) = (at("theta_i_rad"), at("sigma0"));
    let rows: Vec<csv::StringRecord> = table.records().map(Result::unwrap).collect();
    assert_eq!(rows.len(), 9, "three revisions of three points");
    let points: Vec<(f64, Option<f64>)> =
        rows.iter().map(|row| (row[theta].parse().unwrap(), row[sigma0].parse().ok())).collect();
    let of_paint = sound("primer").curves[0].observations.clone();
    assert!(of_paint.iter().all(|o| points.contains(&(o.theta_i_rad, o.sigma0))));
    let units = fs::read_to_string(site.join("tables/units.csv")).unwrap();
    assert!(units.contains("observation,theta_i_rad,rad,\n"), "{units}");
    let conn = rusqlite::Connection::open(site.join("catalogue.sqlite")).unwrap();
    for line in units.lines().skip(1) {
        let [table, column, code, _] = line.split(',').collect::<Vec<_>>()[..] else {
            panic!("{line}")
        };
        let sql = "SELECT coalesce(ucum, '') FROM unit WHERE column_name = ?1";
        let own: String = conn.query_row(sql, [column], |row| row.get(0)).unwrap();
        assert_eq!(own, code, "{table}.{column}: the table `unit` of the database says otherwise");
    }
    let package = json(&site.join("datapackage.json"));
    let resources = package["resources"].as_array().unwrap();
    for resource in resources {
        let path = site.join(resource["path"].as_str().unwrap());
        assert_eq!(resource["bytes"], fs::metadata(&path).unwrap().len(), "{}", path.display());
    }
    let fields = resources.iter().filter_map(|resource| resource["schema"]["fields"].as_array());
    for field in fields.flatten().filter(|field| field["type"] != "string") {
        assert!(field["unit"].is_string() || field["description"].is_string(), "{field}");
    }
}

#[test]
fn changes_are_told_from_one_publication_to_the_next() {
    let folder = laboratory();
    publish(folder.path());
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    store.add([&sample("paint"), &sample("new")]).unwrap();
    store.remove([&"primer".parse().unwrap()]).unwrap();
    drop(store);
    publish(folder.path());
    let changes = json(&folder.path().join("site/changes.json"));
    let publications = changes["publications"].as_array().unwrap();
    assert_eq!(publications.len(), 2);
    let slugs = |which: &str| -> Vec<&str> {
        let list = publications[0][which].as_array().unwrap();
        list.iter().map(|change| change["slug"].as_str().unwrap()).collect()
    };
    assert_eq!(
        [slugs("added"), slugs("changed"), slugs("withdrawn")],
        [["new"], ["paint"], ["primer"]]
    );
    assert_eq!(publications[0]["changed"][0]["before"]["revision"], 2);
    assert_eq!(publications[1]["added"].as_array().unwrap().len(), 2);
    let text = fs::read_to_string(folder.path().join("site/CHANGES.md")).unwrap();
    assert!(text.contains("- paint, revision 2 to 3") && text.contains("Withdrawn:"), "{text}");
}

#[test]
fn a_version_is_text_and_a_name_no_formula() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    let mut paint = sample("paint");
    paint.name = "=HYPERLINK(\"http://x\")".to_owned();
    store.add([&paint]).unwrap();
    let about = "title = 't'\nversion = '[1](http://x) <b>'\nlicence = 'CC-BY-4.0'\n";
    fs::write(folder.path().join("about.toml"), about).unwrap();
    publish(folder.path());
    let read = |name: &str| fs::read_to_string(folder.path().join("site").join(name)).unwrap();
    let changes = read("CHANGES.md");
    assert!(changes.contains("## \\[1\\](http://x) \\<b\\>"), "{changes}");
    let table = read("tables/revision.csv");
    assert!(table.contains("\"'=HYPERLINK(") && !table.contains(",\"=H"), "{table}");
    matdb(folder.path()).args(["verify", "site", "-q"]).assert().success();
}

#[test]
fn an_error_of_the_about_file_is_one_sentence() {
    let folder = laboratory();
    for (text, expected) in [
        ("title = \"a\nb = 3\n", "about.toml: line 1, column 1"),
        (
            "titel = 'a'\n",
            "about.toml: line 1, column 1: unknown key `titel`; did you mean `title`?",
        ),
    ] {
        fs::write(folder.path().join("about.toml"), text).unwrap();
        let publish = ["publish", "site", "--about", "about.toml"];
        let said = refused(matdb(folder.path()).args(publish));
        assert!(said.contains(expected) && said.trim_end().lines().count() == 1, "{said}");
    }
}

#[test]
fn what_the_publication_there_says_of_itself_stays_and_is_said() {
    let folder = laboratory();
    publish(folder.path());
    let run = |arguments: &[&str]| {
        let output = matdb(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stderr).unwrap()
    };
    let before = json(&folder.path().join("site/about.json"));
    let notes = run(&["publish", "site"]);
    assert_eq!(json(&folder.path().join("site/about.json")), before);
    assert!(notes.contains("those of the publication there, `Paints <of> \"ours\"`"), "{notes}");
    assert!(!notes.contains("other data"), "{notes}");
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    store.add([&sample("new")]).unwrap();
    drop(store);
    let notes = run(&["publish", "site", "--about", "about.toml"]);
    assert!(notes.contains("version 1.0 stood there with other data"), "{notes}");
    assert!(!notes.contains("those of the publication there"), "{notes}");
    fs::write(folder.path().join("about.toml"), ABOUT.replace("0097", "0098")).unwrap();
    let said = refused(matdb(folder.path()).args(["publish", "site", "--about", "about.toml"]));
    assert!(said.contains("`orcid` is `0000-0002-1825-0098`, whose digits do not check"), "{said}");
}

#[test]
fn a_catalogue_is_under_the_licence_of_its_materials_and_under_none_where_they_differ() {
    let folder = laboratory();
    let at = folder.path();
    let site = at.join("site");
    matdb(at).args(["publish", "site", "-q"]).assert().success();
    assert_eq!(json(&site.join("api/v1/index.json"))["licence"], "CC0-1.0");
    assert_eq!(
        json(&site.join("datapackage.json"))["licenses"],
        serde_json::json!([{ "name": "CC0-1.0" }])
    );
    assert_eq!(json(&site.join("about.json"))["licence"], Value::Null, "nobody declared it");
    let mut store = Store::open(at.join("matdb.sqlite")).unwrap();
    let other = |name: &str, licence: &str| {
        let licence = licence.to_owned();
        matdb::material::Material { licence, ..sample(name) }
    };
    store.add([&other("ours", "CC-BY-4.0"), &other("choice", "MIT OR CC0-1.0")]).unwrap();
    let before = tree(&site);
    let said = refused(matdb(at).args(["publish", "site"]));
    let whole = "CC-BY-4.0 AND CC0-1.0 AND (MIT OR CC0-1.0)";
    for part in
        ["under CC-BY-4.0, CC0-1.0, MIT OR CC0-1.0,", "--about", &format!("licence = \"{whole}\"")]
    {
        assert!(said.contains(part), "`{part}` is not in: {said}");
    }
    assert_eq!(tree(&site), before);
    fs::write(at.join("about.toml"), format!("licence = '{whole}'\n")).unwrap();
    assert!(site.join(".zenodo.json").exists());
    let output = matdb(at).args(["publish", "site", "--about", "about.toml"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && said.contains("choose the licence there by hand"), "{said}");
    assert!(!site.join(".zenodo.json").exists(), "to Zenodo it would mean CC0");
    matdb(at).args(["verify", "site"]).assert().success();
    assert_eq!(json(&site.join("api/v1/index.json"))["licence"], whole);
    let names = json(&site.join("datapackage.json"))["licenses"].clone();
    assert_eq!(
        names,
        serde_json::json!([{ "name": "CC-BY-4.0" }, { "name": "CC0-1.0" }, { "name": "MIT" }])
    );
    let work = serde_json::json!({ "@type": "CreativeWork", "name": whole });
    assert_eq!(json(&site.join("dataset.jsonld"))["license"], work);
    let linked = json(&site.join("ro-crate-metadata.json"));
    let graph = linked["@graph"].as_array().unwrap();
    let of = |id: &str| graph.iter().find(|entity| entity["@id"] == id).unwrap();
    assert_eq!(
        (&of("./")["license"]["@id"], &of("#licence")["name"]),
        (&"#licence".into(), &whole.into())
    );
    assert!(!said.contains("is declared to be under"), "{said}");
    // Who declares less than there is hears of it.
    fs::write(at.join("less.toml"), "licence = 'CC0-1.0'\n").unwrap();
    let output = matdb(at).args(["publish", "less", "--about", "less.toml"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(said.contains("under CC0-1.0, but materials in it are under CC-BY-4.0;"), "{said}");
    // What was declared stays so until somebody declares otherwise.
    matdb(at).args(["publish", "site", "-q"]).assert().success();
    assert_eq!(json(&site.join("api/v1/index.json"))["licence"], whole);
    // A licence in words is none that a catalogue could state, and an empty catalogue has none.
    let empty = at.join("empty");
    let words =
        Store::open(at.join("words.sqlite")).unwrap().add([&other("a", "all rights <reserved>")]);
    assert!(words.is_ok());
    let said = refused(matdb(at).args(["--db", "words.sqlite", "publish", "empty"]));
    assert!(
        said.contains("all rights <reserved>") && said.contains("such as licence = \"CC-BY-4.0\""),
        "{said}"
    );
    let mut store = Store::open(at.join("words.sqlite")).unwrap();
    store.remove([&"a".parse().unwrap()]).unwrap();
    matdb(at).args(["--db", "words.sqlite", "publish", "empty", "-q"]).assert().success();
    matdb(at).args(["verify", "empty"]).assert().success();
    let index = json(&empty.join("api/v1/index.json"));
    assert_eq!(index.get("licence"), None);
    assert_eq!(problems(&json(&empty.join("schema/index.json")), &index), [""; 0]);
}

#[test]
fn a_withdrawn_material_says_so_in_every_file_that_names_it() {
    let folder = laboratory();
    publish(folder.path());
    let site = folder.path().join("site");
    let read = |path: &str| fs::read_to_string(site.join(path)).unwrap();
    assert!(
        !read("api/v1/index.json").contains("status") && !read("index/1.js").contains("status")
    );
    let withdraw = ["withdraw", "primer", "--reason", "Levels are <3> dB low."];
    matdb(folder.path()).args(withdraw).assert().success();
    publish(folder.path());
    let index = json(&site.join("api/v1/index.json"));
    let primer = index["materials"].as_array().unwrap().iter().find(|m| m["slug"] == "primer");
    let reason = "Levels are <3> dB low.";
    assert_eq!(
        primer.unwrap()["status"],
        serde_json::json!({ "is": "withdrawn", "reason": reason })
    );
    let changes = json(&site.join("changes.json"));
    let now = &changes["publications"][0];
    assert_eq!(now["withdrawn"][0]["slug"], "primer");
    assert_eq!(now["withdrawn"][0]["now"]["revision"], 2);
    assert_eq!(
        (now["added"].clone(), now["changed"].clone()),
        (Value::from([0; 0]), Value::from([0; 0]))
    );
    for (schema, value) in [("index.json", &index), ("changes.json", &changes)] {
        assert_eq!(problems(&json(&site.join("schema").join(schema)), value), [""; 0]);
    }
    let said = read("CHANGES.md");
    assert!(said.contains("Withdrawn:\n\n- primer, revision 1 to 2, withdrawn: Levels"), "{said}");
    assert!(read("index/1.js").contains("\"status\":\"withdrawn\""));
    assert!(read("data/primer.js").contains("\"status\":\"withdrawn\""));
    assert!(read("data/paint.js").contains("\"status\":null"));
    assert_eq!(read("list/1.html").matches("is-withdrawn").count(), 1);
    let page = read("material/primer.html");
    let title = page.find("</h1>").unwrap();
    let said = page.find("This entry is withdrawn.").unwrap();
    assert!(
        said > title && !page[title..said].contains("class=\"facts\""),
        "directly below the title"
    );
    assert!(page.contains("\"creativeWorkStatus\":\"withdrawn: Levels are \\u003c3"));
    assert!(page.contains("This entry is withdrawn: Levels are &lt;3&gt; dB low."));
    assert!(!page.contains("\":null"), "linked data say only what is known");
    assert!(!read("index.html").contains("\":null"));
    // Nothing turns withdrawn twice.
    publish(folder.path());
    assert_eq!(json(&site.join("changes.json")), changes);
}

#[test]
fn nothing_of_somebody_elses_folder_is_touched() {
    let folder = laboratory();
    let at = folder.path();
    fs::create_dir(at.join("site")).unwrap();
    fs::write(at.join("site/thesis.tex"), "mine").unwrap();
    let said = refused(matdb(at).args(["publish", "site"]));
    assert!(said.contains("thesis.tex"), "{said}");
    fs::remove_file(at.join("site/thesis.tex")).unwrap();
    publish(at);
    fs::write(at.join("site/thesis.tex"), "mine").unwrap();
    let before = tree(&at.join("site"));
    let said = refused(matdb(at).args(["publish", "site"]));
    assert!(said.contains("thesis.tex"), "{said}");
    assert_eq!(tree(&at.join("site")), before);
    fs::remove_file(at.join("site/thesis.tex")).unwrap();
    fs::write(at.join("site/changes.json"), "{\"schema_version\":99}").unwrap();
    let said = refused(matdb(at).args(["publish", "site"]));
    assert!(said.contains("newer matdb"), "{said}");
    assert_eq!(support::entries(at), ["about.toml", "matdb.sqlite", "site"]);
}

#[cfg(unix)]
#[test]
fn nothing_is_published_inside_a_publication() {
    let folder = laboratory();
    publish(folder.path());
    let before = tree(&folder.path().join("site"));
    let said = refused(matdb(folder.path()).args(["publish", "site/deep/er"]));
    assert!(said.contains("lies in the publication") && said.contains("beside it"), "{said}");
    assert_eq!(tree(&folder.path().join("site")), before);
}

#[test]
fn what_cannot_be_written_leaves_everything_as_it_was() {
    use std::os::unix::fs::PermissionsExt;
    let folder = laboratory();
    let at = folder.path();
    let target = at.join("shelf");
    fs::create_dir(&target).unwrap();
    fs::set_permissions(&target, fs::Permissions::from_mode(0o555)).unwrap();
    // Root may write anywhere.
    if fs::write(target.join("probe"), "").is_err() {
        refused(matdb(at).args(["publish", "shelf/site", "-q"]));
        assert!(support::entries(&target).is_empty());
    }
    fs::set_permissions(&target, fs::Permissions::from_mode(0o755)).unwrap();
    fs::write(at.join("file"), "x").unwrap();
    refused(matdb(at).args(["publish", "file/site", "-q"]));
    refused(matdb(at).args(["publish", "file", "-q"]));
    assert_eq!(fs::read(at.join("file")).unwrap(), b"x");
}

#[test]
fn a_killed_publication_leaves_a_whole_one() {
    let folder = laboratory();
    let at = folder.path();
    let mut store = Store::open(at.join("matdb.sqlite")).unwrap();
    let many: Vec<_> = (0..200).map(|number| sample(&format!("of-many-{number}"))).collect();
    store.add(&many).unwrap();
    publish(at);
    store.add([&sample("one-more")]).unwrap();
    drop(store);
    let site = at.join("site");
    let old = fs::read(site.join("SHA256SUMS")).unwrap();
    let mut killed = 0;
    for delay_ms in [1, 5, 20, 50, 100] {
        let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("matdb"))
            .args(["publish", "site", "-q"])
            .current_dir(at)
            .env_remove("MATDB")
            .spawn()
            .unwrap();
        std::thread::sleep(std::time::Duration::from_millis(delay_ms));
        child.kill().unwrap();
        killed += u32::from(!child.wait().unwrap().success());
        let said = matdb::adopt::verify(&site).unwrap();
        assert_eq!(said.problems, [], "after {delay_ms} ms");
        if fs::read(site.join("SHA256SUMS")).unwrap() != old {
            break;
        }
    }
    assert!(killed > 0);
    publish(at);
    let left: Vec<_> = entries(at).into_iter().filter(|name| name.starts_with(".matdb")).collect();
    assert_eq!(left, [""; 0], "what the killed ones had begun");
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link_and_version_control_stays_in_the_folder() {
    let folder = laboratory();
    let at = folder.path();
    let real = at.join("real");
    fs::create_dir_all(real.join(".git")).unwrap();
    fs::write(real.join(".git/HEAD"), "ref: x").unwrap();
    fs::write(real.join("CNAME"), "example.org").unwrap();
    std::os::unix::fs::symlink("real", at.join("site")).unwrap();
    publish(at);
    publish(at);
    assert!(at.join("site").symlink_metadata().unwrap().is_symlink());
    assert_eq!(fs::read(real.join(".git/HEAD")).unwrap(), b"ref: x");
    assert!(real.join("CNAME").exists() && real.join("index.html").exists());
    matdb(at).args(["verify", "site", "-q"]).assert().success();
    let said = refused(matdb(&real).args(["publish", ".", "--db", "../matdb.sqlite"]));
    assert!(said.contains("you are in it"), "{said}");
}

type Spoil = fn(&Path);

#[test]
fn whatever_is_changed_afterwards_is_seen() {
    let folder = laboratory();
    let at = folder.path();
    publish(at);
    let site = at.join("site");
    let forged = "is not what its database gives";
    let spoils: [(Spoil, &str); 18] = [
        // Without the program's version the pages are compared all the same.
        (
            |site| {
                let mut index = json(&site.join("api/v1/index.json"));
                assert!(index.as_object_mut().unwrap().remove("program_version").is_some());
                relist(site, "api/v1/index.json", index.to_string().as_bytes());
                relist(site, "material/paint.html", b"x");
            },
            "material/paint.html: is not what its database gives",
        ),
        (|site| relist(site, "CITATION.cff", b"x"), forged),
        (|site| relist(site, ".zenodo.json", b"{}"), forged),
        (|site| relist(site, "tables/curve.csv", b"x"), forged),
        (|site| relist(site, "material/paint.html", b"x"), forged),
        (|site| relist(site, "data/paint.js", b"x"), forged),
        (|site| relist(site, "datapackage.json", b"{}"), forged),
        (|site| relist(site, "evil.html", b"x"), "evil.html: is of no publication"),
        (|site| relist(site, "catalogue.sqlite-journal", b"x"), "taken for a part of the database"),
        (|site| resql(site, "UPDATE unit SET ucum = 'furlong'"), "units of columns"),
        (|site| resql(site, "UPDATE fit_parameter SET sd = 7"), "`fit_parameter`"),
        (|site| flip(&site.join("api/v1/materials/paint.json")), "paint.json: is not what"),
        (|site| flip(&site.join("catalogue.sqlite")), "catalogue.sqlite: is not what"),
        (|site| fs::remove_file(site.join("CITATION.cff")).unwrap(), "CITATION.cff: is missing"),
        (|site| fs::write(site.join("more.html"), "").unwrap(), "more.html: is not listed"),
        (
            |site| relist(site, "api/v1/materials/paint.json", b"{}\n"),
            "something else than the data",
        ),
        (|site| relist(site, "api/v1/materials/x.json", b"{}\n"), "of no material"),
        (
            |site| {
                let mut list = fs::read_to_string(site.join("SHA256SUMS")).unwrap();
                list += &format!("{:064}  ../matdb.sqlite\n", 0);
                fs::write(site.join("SHA256SUMS"), list).unwrap();
            },
            "outside the folder",
        ),
    ];
    for (spoil, expected) in spoils {
        spoil(&site);
        let output = matdb(at).args(["verify", "site"]).output().unwrap();
        assert_eq!(output.status.code(), Some(1), "{expected}");
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(said.contains(expected), "`{expected}` is not in: {said}");
        fs::remove_dir_all(&site).unwrap();
        publish(at);
    }
    matdb(at).args(["verify", "site", "-q"]).assert().success();
}

fn flip(path: &Path) {
    let mut bytes = fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(path, bytes).unwrap();
}

/// Changes the database and the list of hashes with it.
fn resql(site: &Path, sql: &str) {
    let conn = rusqlite::Connection::open(site.join("catalogue.sqlite")).unwrap();
    conn.execute_batch(sql).unwrap();
    drop(conn);
    support::list_hashes(site);
}

/// Changes a file and the list of hashes with it.
fn relist(site: &Path, path: &str, bytes: &[u8]) {
    fs::write(site.join(path), bytes).unwrap();
    support::list_hashes(site);
}

#[test]
fn a_fit_that_does_not_follow_from_its_curve_is_seen() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut text = "theta_deg,sigma0_db\n".to_owned();
    for step in 0..80 {
        text += &format!("{step},{}\n", -20.0 + f64::from((step * 7) % 13) / 2.0);
    }
    fs::write(at.join("curve.csv"), text).unwrap();
    matdb(at).args(["add", "ptfe", "-q"]).assert().success();
    let fit = ["fit", "curve.csv", "--model", "lambert", "--save", "ptfe", "--kind", "synthetic"];
    matdb(at).args(fit).args(["--source", "a test", "-q"]).assert().success();
    let said = matdb(at).args(["verify", "matdb.sqlite", "--json"]).output().unwrap();
    assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stdout));
    let said: Value = serde_json::from_slice(&said.stdout).unwrap();
    assert_eq!((&said["fits"], &said["revisions"]), (&1.into(), &2.into()));
    let path = at.join("matdb.sqlite");
    let store = Store::open(&path).unwrap();
    let mut ptfe = store.get(&"ptfe".parse().unwrap(), None).unwrap().unwrap().material;
    drop(store);
    let report = ptfe.fits.last_mut().unwrap().report.as_mut().unwrap();
    report.objective += 1.0;
    Store::open(&path).unwrap().add([&ptfe]).unwrap();
    let output = matdb(at).args(["verify", "matdb.sqlite"]).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!output.status.success() && said.contains("ptfe@3, fit `lambert-censored`"), "{said}");
    assert_eq!(bytes(at).len(), 2, "verifying leaves nothing behind");
    ptfe.fits.last_mut().unwrap().report = None;
    Store::open(&path).unwrap().add([&ptfe]).unwrap();
    for command in [&["verify", "matdb.sqlite"][..], &["check"]] {
        let output = matdb(at).args(command).output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(
            !output.status.success() && said.contains("the report of that is not there"),
            "{said}"
        );
    }
}

#[test]
fn a_fit_that_nobody_could_verify_is_not_published() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // A database whose fits have reports that their curves of three rows cannot give.
    fs::copy(root().join("tests/fixtures/schema-0002.sqlite"), at.join("matdb.sqlite")).unwrap();
    let message = refused(matdb(at).args(["publish", "site"]));
    assert!(message.contains("fit `stated`: 2 detections cannot give 4 unknowns"), "{message}");
    assert!(message.contains("nothing was published, as nobody could verify it"), "{message}");
    assert_eq!(entries(at), ["matdb.sqlite"]);
}

/// The statement of a migration that begins like this.
fn statement(migration: &str, begin: &str) -> String {
    let text = fs::read_to_string(root().join("migrations").join(migration)).unwrap();
    let from = text.find(begin).unwrap();
    text[from..=from + text[from..].find(';').unwrap()].to_owned()
}

/// Puts the values of parameters into `fit.model`, where schemas before 11 had them, too.
fn put_values_into_models(site: &Path) {
    let conn = rusqlite::Connection::open(site.join("catalogue.sqlite")).unwrap();
    let mut statement = conn.prepare("SELECT revision_id, name, model FROM fit").unwrap();
    let read = |row: &rusqlite::Row| Ok((row.get(0)?, row.get(1)?, row.get(2)?));
    let fits: Vec<(i64, String, String)> =
        statement.query_map([], read).unwrap().map(Result::unwrap).collect();
    for (revision_id, name, model) in fits {
        let sql = "SELECT path, value FROM fit_parameter WHERE revision_id = ?1 AND fit = ?2";
        let mut model: Value = serde_json::from_str(&model).unwrap();
        let mut statement = conn.prepare(sql).unwrap();
        let mut rows = statement.query((revision_id, &name)).unwrap();
        while let Some(row) = rows.next().unwrap() {
            let (path, value): (String, f64) = (row.get(0).unwrap(), row.get(1).unwrap());
            let place = model.pointer_mut(&format!("/{}", path.replace('.', "/"))).unwrap();
            assert!(place.is_null(), "{path}");
            *place = value.into();
        }
        let update = "UPDATE fit SET model = ?1 WHERE revision_id = ?2 AND name = ?3";
        conn.execute(update, (model.to_string(), revision_id, name)).unwrap();
    }
    drop(statement);
    drop(conn);
    support::list_hashes(site);
}

#[test]
fn a_publication_of_an_older_schema_is_verified_and_imported() {
    let folder = laboratory();
    let at = folder.path();
    publish(at);
    let site = at.join("site");
    // Back to schema 8, which had no places.
    let curves = statement("0004_catalogue.sql", "CREATE VIEW v_curves");
    let fits = statement("0007_attribution.sql", "CREATE VIEW v_fits");
    let estimates = statement("0007_attribution.sql", "CREATE TABLE fit_estimate");
    resql(
        &site,
        &format!(
            "DROP VIEW v_findings; DROP VIEW v_fits; DROP VIEW v_curves;
             DROP VIEW fit_estimate; DROP TABLE fit_number; {estimates}
             DROP TABLE curve_levels; DROP TABLE curve_illumination; DROP TABLE fit_lobes;
             DROP TABLE record;
             ALTER TABLE outline DROP COLUMN footprint; ALTER TABLE outline DROP COLUMN lobes;
             ALTER TABLE observation DROP COLUMN yt_m; ALTER TABLE observation DROP COLUMN xt_m;
             DELETE FROM unit WHERE column_name LIKE 'held_out%' OR column_name IN ('xt_m', 'yt_m', 'beam_rad', 'relative', 'only_detected');
             {curves} {fits} PRAGMA user_version = 8;"
        ),
    );
    put_values_into_models(&site);
    relist(&site, "tables/observation.csv", b"of other columns");
    let output = matdb(at).args(["verify", "site"]).output().unwrap();
    let said = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert!(output.status.success() && said.contains("whose schema is an older one"), "{said}");
    let other = tempfile::tempdir().unwrap();
    matdb(other.path()).arg("import").arg(&site).assert().success();
    assert_eq!(contents(&other.path().join("matdb.sqlite")), contents(&at.join("matdb.sqlite")));
    // What it says of itself is held against its database all the same.
    relist(&site, "api/v1/index.json", b"{}");
    assert!(!matdb(at).args(["verify", "site", "-q"]).output().unwrap().status.success());
}

#[test]
fn of_another_versions_publication_it_is_said_what_was_compared_and_what_not() {
    let folder = laboratory();
    publish(folder.path());
    let site = folder.path().join("site");
    let index = fs::read_to_string(site.join("api/v1/index.json")).unwrap();
    let own = format!("\"program_version\":\"{}\"", env!("CARGO_PKG_VERSION"));
    let old = index.replacen(&own, "\"program_version\":\"0.0.1\"", 1);
    assert_ne!(old, index);
    let without_words = old.replace("\"render_words\":\"stated beside modelled data\",", "");
    assert_ne!(without_words, old);
    let old = without_words;
    fs::write(site.join("api/v1/index.json"), old).unwrap();
    // It knew fewer tables, and other pages.
    fs::remove_file(site.join("tables/origin.csv")).unwrap();
    relist(&site, "index.html", b"another page");
    let output = matdb(folder.path()).args(["verify", "site"]).output().unwrap();
    let said = [output.stdout, output.stderr].concat();
    let said = String::from_utf8(said).unwrap();
    assert!(output.status.success(), "{said}");
    for part in [
        "matdb 0.0.1 has published this",
        "compared were the hashes",
        "not compared were the pages",
    ] {
        assert!(said.contains(part), "`{part}` is not in: {said}");
    }
    relist(&site, "tables/curve.csv", b"x");
    let output = matdb(folder.path()).args(["verify", "site"]).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(!output.status.success() && said.contains("tables/curve.csv: is not what"), "{said}");
}
