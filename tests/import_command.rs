//! Promise: `matdb import` takes over another laboratory's catalogue with all revisions or changes
//! nothing; what differs from one's own stays as it is and is reported; what cannot be trusted is
//! refused in one sentence.

use std::fs;
use std::path::Path;

use crate::support::database::{changed, contents, sample, sound};
use crate::support::{entries, list_hashes, matdb, refused};
use matdb::adopt::publish;
use matdb::catalogue::About;
use matdb::material::Material;
use matdb::store::Store;
use serde_json::Value;

/// Two folders: theirs with a published `site`, and ours with a database in which `paint` differs.
fn laboratories() -> (tempfile::TempDir, tempfile::TempDir) {
    let (theirs, ours) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let mut store = Store::open(theirs.path().join("matdb.sqlite")).unwrap();
    store.add([&sample("paint"), &sound("primer"), &sample("same")]).unwrap();
    store.add([&changed("primer")]).unwrap();
    drop(store);
    matdb(theirs.path()).args(["publish", "site", "-q"]).assert().success();
    let mut store = Store::open(ours.path().join("matdb.sqlite")).unwrap();
    store.add([&changed("paint"), &sample("same")]).unwrap();
    store.add([&changed("same")]).unwrap();
    (theirs, ours)
}

fn import(ours: &Path, site: &Path, more: &[&str]) -> Value {
    let output = matdb(ours).arg("import").arg(site).args(more).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn results(said: &Value) -> Vec<(&str, &str)> {
    let materials = said["materials"].as_array().unwrap();
    materials
        .iter()
        .map(|taken| (taken["name"].as_str().unwrap(), taken["result"].as_str().unwrap()))
        .collect()
}

#[test]
fn what_is_missing_comes_with_its_revisions_and_what_differs_stays() {
    let (theirs, ours) = laboratories();
    let site = theirs.path().join("site");
    let database = ours.path().join("matdb.sqlite");
    let before = contents(&database);
    let plan = import(ours.path(), &site, &["--dry-run"]);
    assert_eq!(contents(&database), before);
    let said = import(ours.path(), &site, &[]);
    assert_eq!(said["materials"], plan["materials"]);
    let expected = [("paint", "conflict"), ("primer", "added"), ("same", "unchanged")];
    assert_eq!(results(&said), expected);
    let conflict = &said["materials"][0];
    assert_eq!(conflict["ours"], changed("paint").content_hash());
    assert_eq!(conflict["theirs"], sample("paint").content_hash());
    let after = contents(&database);
    assert_eq!(after.len(), before.len() + 2);
    assert!(before.iter().all(|material| after.contains(material)));
    assert!([sound("primer"), changed("primer")].iter().all(|m| after.contains(m)));
    let again = import(ours.path(), &site, &[]);
    assert_eq!(results(&again)[1], ("primer", "unchanged"));
    assert_eq!(contents(&database), after);
}

#[test]
fn a_prefix_puts_what_differs_beside_ones_own() {
    let (theirs, ours) = laboratories();
    let site = theirs.path().join("site/catalogue.sqlite");
    let said = import(ours.path(), &site, &["--as-prefix", "roe-"]);
    assert_eq!(results(&said)[0], ("roe-paint", "added"));
    let after = contents(&ours.path().join("matdb.sqlite"));
    assert!(after.contains(&sample("roe-paint")) && after.contains(&changed("paint")));
    let again = import(ours.path(), &site, &["--as-prefix", "roe-"]);
    assert_eq!(results(&again)[0], ("roe-paint", "unchanged"));
    let said = refused(matdb(ours.path()).arg("import").arg(&site).args(["--as-prefix", "Roe/"]));
    assert!(said.contains("`Roe/paint` is not a material name"), "{said}");
}

fn history(folder: &Path, name: &str) -> Value {
    let output = matdb(folder).args(["history", name, "--json"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

#[test]
fn what_was_taken_says_from_which_catalogue_and_when_it_was_made_there() {
    let (theirs, ours) = laboratories();
    let about = "title = 'Paints of Roe'\nversion = '2.1'\ndoi = '10.1234/paints'\n\
                 [[person]]\nfamily = 'Roe'\ngiven = 'Ann'\n";
    fs::write(theirs.path().join("about.toml"), about).unwrap();
    let publish = ["publish", "site", "-q", "--about", "about.toml"];
    matdb(theirs.path()).args(publish).assert().success();
    import(ours.path(), &theirs.path().join("site"), &[]);
    let [here, there] = [&ours, &theirs].map(|folder| history(folder.path(), "primer"));
    for (number, there) in (1..).zip(there.as_array().unwrap()) {
        let activity = &here[number - 1]["activity"];
        assert_eq!(activity["command"], "import");
        let origin = &activity["origin"];
        assert_eq!(
            (&origin["title"], &origin["version"]),
            (&"Paints of Roe".into(), &"2.1".into())
        );
        assert_eq!(
            (&origin["doi"], &origin["revision"]),
            (&"10.1234/paints".into(), &number.into())
        );
        assert_eq!(origin["added_at"], there["added_at"]);
    }
    let said = matdb(ours.path()).args(["history", "primer"]).output().unwrap().stdout;
    let said = String::from_utf8(said).unwrap();
    assert!(said.contains("import, their revision 2 of "), "{said}");
    let from = "Paints of Roe, version 2.1, https://doi.org/10.1234/paints";
    let credited = format!("Roe, Ann: {from}");
    assert!(said.ends_with(&format!("imported from {credited}\n")), "{said}");

    // It is theirs wherever it is cited, also when it is taken on from a third catalogue.
    let third = tempfile::tempdir().unwrap();
    let mine = about.replace("Paints of Roe", "Mine").replace("family = 'Roe'", "family = 'Doe'");
    fs::write(ours.path().join("about.toml"), mine.replace("10.1234/paints", "10.1234/mine"))
        .unwrap();
    matdb(ours.path()).args(["add", "ptfe"]).assert().success();
    matdb(ours.path()).args(publish).assert().success();
    import(third.path(), &ours.path().join("site"), &[]);
    for folder in [ours.path(), third.path()] {
        let cited = matdb(folder).args(["cite", "primer", "--json"]).output().unwrap().stdout;
        let cited: Value = serde_json::from_slice(&cited).unwrap();
        let text = cited["text"].as_str().unwrap();
        assert!(text.contains(&format!("From {credited}, revision 2 of ")), "{text}");
        let bibtex = cited["bibtex"].as_str().unwrap();
        assert!(bibtex.contains("author = {Roe, Ann}") && !bibtex.contains("Doe"), "{bibtex}");
        assert_eq!(cited["csl"][0]["author"][0]["family"], "Roe");
    }
    // What comes with the program is not theirs, though it came with their catalogue.
    let cited = matdb(third.path()).args(["cite", "ptfe", "--json"]).output().unwrap().stdout;
    let said = String::from_utf8(cited).unwrap();
    assert!(said.contains("Built into matdb") && !said.contains("10.1234/mine"), "{said}");
    let cited: Value = serde_json::from_str(&said).unwrap();
    assert!(!said.contains("Doe") && cited["csl"][0].get("author").is_none(), "{said}");
    let page = |name: &str| {
        fs::read_to_string(ours.path().join(format!("site/material/{name}.html"))).unwrap()
    };
    let cited = |page: &str| page.split("id=\"cite\"").nth(1).unwrap().to_owned();
    let primer = cited(&page("primer"));
    let [text, bibtex] = ["</p>", "BibTeX</button>"].map(|end| primer.split(end).next().unwrap());
    assert!(
        text.contains("Roe, Ann. ") && text.contains("In: Paints of Roe, version 2.1, https:"),
        "{text}"
    );
    assert!(text.contains("Republished in: Mine") && !text.contains("Doe, Ann"), "{text}");
    assert!(
        bibtex.contains("doi = {10.1234&#x2f;paints}") && bibtex.contains("author = {Roe, Ann}"),
        "{bibtex}"
    );
    assert!(primer.contains("imported from <bdi>Paints of Roe</bdi>"), "{primer}");
    let record = page("primer");
    assert!(record.contains("\"familyName\":\"Roe\",\"givenName\":\"Ann\""), "{record}");
    let ptfe = cited(&page("ptfe"));
    assert!(ptfe.contains("Built into matdb") && !ptfe.contains("Doe, Ann"), "{ptfe}");
    let paint = cited(&page("paint"));
    assert!(paint.contains("Doe, Ann") && !paint.contains("Republished"), "{paint}");
}

#[test]
fn what_they_made_since_comes_as_revisions_unless_it_was_changed_here() {
    let (theirs, ours) = laboratories();
    let site = theirs.path().join("site");
    fs::write(theirs.path().join("about.toml"), "title = 'Theirs'\n").unwrap();
    let publish = ["publish", "site", "--about", "about.toml", "-q"];
    matdb(theirs.path()).args(publish).assert().success();
    let revised =
        |name: &str, finish: &str| Material { finish: Some(finish.to_owned()), ..changed(name) };
    import(ours.path(), &site, &["--as-prefix", "roe-"]);
    let mut store = Store::open(theirs.path().join("matdb.sqlite")).unwrap();
    for name in ["paint", "primer"] {
        store.add([&revised(name, "sanded")]).unwrap();
        store.add([&revised(name, "washed")]).unwrap();
    }
    drop(store);
    matdb(theirs.path()).args(["publish", "site", "-q"]).assert().success();
    let said = import(ours.path(), &site, &["--as-prefix", "roe-"]);
    let expected = [("roe-paint", "continued"), ("primer", "continued"), ("same", "unchanged")];
    assert_eq!(results(&said), expected);
    assert_eq!(
        (&said["materials"][1]["revisions"], &said["materials"][1]["after"]),
        (&2.into(), &2.into())
    );
    let revisions = history(ours.path(), "primer");
    assert_eq!(revisions.as_array().unwrap().len(), 4);
    assert_eq!(revisions[3]["content_hash"], revised("primer", "washed").content_hash());
    assert_eq!(revisions[3]["activity"]["origin"]["revision"], 4);
    let again = import(ours.path(), &site, &["--as-prefix", "roe-"]);
    assert!(results(&again).iter().all(|(_, result)| *result == "unchanged"), "{again}");
    let mut store = Store::open(ours.path().join("matdb.sqlite")).unwrap();
    store.add([&revised("primer", "our own")]).unwrap();
    drop(store);
    let mut store = Store::open(theirs.path().join("matdb.sqlite")).unwrap();
    store.add([&revised("primer", "polished")]).unwrap();
    drop(store);
    matdb(theirs.path()).args(["publish", "site", "-q"]).assert().success();
    let said = import(ours.path(), &site, &[]);
    assert!(results(&said).contains(&("primer", "conflict")), "{said}");
    assert_eq!(history(ours.path(), "primer").as_array().unwrap().len(), 5);
}

#[test]
fn nobody_else_revises_or_withdraws_what_is_ones_own() {
    let (theirs, ours) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let add = |folder: &Path, material: &Material| {
        Store::open(folder.join("matdb.sqlite")).unwrap().add([material]).unwrap();
    };
    // Both begin with the same, which nobody has imported.
    for folder in [&theirs, &ours] {
        add(folder.path(), &sound("primer"));
    }
    add(theirs.path(), &changed("primer"));
    let withdraw = ["withdraw", "primer", "--reason", "they say so", "-q"];
    matdb(theirs.path()).args(withdraw).assert().success();
    matdb(theirs.path()).args(["publish", "site", "-q"]).assert().success();
    let site = theirs.path().join("site");
    assert_eq!(results(&import(ours.path(), &site, &[])), [("primer", "conflict")]);
    assert_eq!(contents(&ours.path().join("matdb.sqlite")), [sound("primer")]);
    // Nor does a third one what was imported from somebody.
    let third = tempfile::tempdir().unwrap();
    let about = |title: &str| format!("title = '{title}'\n");
    fs::write(ours.path().join("about.toml"), about("Ours")).unwrap();
    fs::write(theirs.path().join("about.toml"), about("Theirs")).unwrap();
    for folder in [&ours, &theirs] {
        let publish = ["publish", "site", "--about", "about.toml", "-q"];
        matdb(folder.path()).args(publish).assert().success();
    }
    assert_eq!(
        results(&import(third.path(), &ours.path().join("site"), &[])),
        [("primer", "added")]
    );
    assert_eq!(results(&import(third.path(), &site, &[])), [("primer", "conflict")]);
}

#[test]
fn catalogues_of_nobody_are_not_taken_for_one_another() {
    let [first, second, ours] = [(); 3].map(|()| tempfile::tempdir().unwrap());
    for folder in [&first, &second] {
        let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
        store.add([&sound("primer")]).unwrap();
        drop(store);
        if folder.path() == second.path() {
            let withdraw = ["withdraw", "primer", "--reason", "they say so", "-q"];
            matdb(folder.path()).args(withdraw).assert().success();
        }
        matdb(folder.path()).args(["publish", "site", "-q"]).assert().success();
    }
    let import = |from: &Path| import(ours.path(), &from.join("site"), &[]);
    assert_eq!(results(&import(first.path())), [("primer", "added")]);
    assert_eq!(results(&import(second.path())), [("primer", "conflict")]);
}

#[test]
fn a_catalogue_fills_an_empty_folder_and_a_dry_run_leaves_it_empty() {
    let (theirs, _) = laboratories();
    let ours = tempfile::tempdir().unwrap();
    let site = theirs.path().join("site");
    import(ours.path(), &site, &["--dry-run"]);
    assert!(entries(ours.path()).is_empty());
    import(ours.path(), &site, &[]);
    let theirs = contents(&theirs.path().join("matdb.sqlite"));
    assert_eq!(contents(&ours.path().join("matdb.sqlite")), theirs);
}

type Spoil = fn(&Path);

#[test]
fn what_cannot_be_trusted_changes_nothing() {
    let (theirs, ours) = laboratories();
    let site = theirs.path().join("site");
    let database = ours.path().join("matdb.sqlite");
    let before = fs::read(&database).unwrap();
    let spoils: [(Spoil, &str); 9] = [
        (
            |site| {
                let path = site.join("catalogue.sqlite");
                let mut bytes = fs::read(&path).unwrap();
                let last = bytes.len() - 1;
                bytes[last] ^= 1;
                fs::write(path, bytes).unwrap();
            },
            "its hash differs",
        ),
        (
            |site| {
                sql(site, "UPDATE observation SET sigma0 = 9 WHERE sigma0 IS NOT NULL");
                list_hashes(site);
            },
            "is not what was stored",
        ),
        (
            |site| {
                sql(site, "PRAGMA user_version = 999");
                list_hashes(site);
            },
            "newer matdb",
        ),
        (
            |site| {
                sql(site, "CREATE VIEW more AS SELECT 1");
                list_hashes(site);
            },
            "not those that matdb makes",
        ),
        (
            |site| {
                let index = fs::read_to_string(site.join("api/v1/index.json")).unwrap();
                let newer = index.replacen("\"schema_version\":1", "\"schema_version\":2", 1);
                fs::write(site.join("api/v1/index.json"), newer).unwrap();
                list_hashes(site);
            },
            "newer matdb",
        ),
        (
            |site| {
                let mut list = fs::read_to_string(site.join("SHA256SUMS")).unwrap();
                list += &format!("{:064}  ../../matdb.sqlite\n", 0);
                fs::write(site.join("SHA256SUMS"), list).unwrap();
            },
            "outside the folder",
        ),
        (
            |site| {
                let path = site.join("api/v1/materials/huge.json");
                fs::File::create(path).unwrap().set_len((256 << 20) + 1).unwrap();
                let mut list = fs::read_to_string(site.join("SHA256SUMS")).unwrap();
                list += &format!("{:064}  api/v1/materials/huge.json\n", 0);
                fs::write(site.join("SHA256SUMS"), list).unwrap();
            },
            "is larger than 256 MiB",
        ),
        (|site| fs::remove_file(site.join("SHA256SUMS")).unwrap(), "it has no SHA256SUMS"),
        (
            |site| {
                let secret = site.with_file_name("secret");
                fs::write(&secret, "x").unwrap();
                #[cfg(unix)]
                std::os::unix::fs::symlink(&secret, site.join("link.html")).unwrap();
                #[cfg(not(unix))]
                fs::write(site.join("link.html"), "is a link").unwrap();
            },
            "link.html",
        ),
    ];
    for (spoil, expected) in spoils {
        spoil(&site);
        let said = refused(matdb(ours.path()).arg("import").arg(&site));
        assert!(said.contains(expected), "`{expected}` is not in: {said}");
        let would_help = expected != "newer matdb";
        assert!(would_help || !said.contains("a sound copy"), "{said}");
        assert!(fs::read(&database).unwrap() == before, "{expected}");
        fs::remove_dir_all(&site).unwrap();
        matdb(theirs.path()).args(["publish", "site", "-q"]).assert().success();
    }
    let nothing = refused(matdb(ours.path()).args(["import", "nowhere"]));
    assert!(nothing.contains("nowhere"), "{nothing}");
    import(ours.path(), &site, &[]);
}

fn sql(site: &Path, statement: &str) {
    rusqlite::Connection::open(site.join("catalogue.sqlite"))
        .unwrap()
        .execute_batch(statement)
        .unwrap();
}

#[test]
fn an_effect_that_nobody_knows_takes_everything_back() {
    let (theirs, ours) = laboratories();
    let mut strange = sound("zinc");
    strange.effects[0].name = "telepathy".to_owned();
    Store::open(theirs.path().join("matdb.sqlite")).unwrap().add([&strange]).unwrap();
    matdb(theirs.path()).args(["publish", "site", "-q"]).assert().success();
    let database = ours.path().join("matdb.sqlite");
    let before = contents(&database);
    let said = refused(matdb(ours.path()).arg("import").arg(theirs.path().join("site")));
    assert!(said.contains("zinc") && said.contains("telepathy"), "{said}");
    assert_eq!(contents(&database), before, "primer came first and is not there");
}

#[test]
fn a_name_that_add_refuses_does_not_come_in_by_import() {
    let (theirs, ours) = laboratories();
    let tricky = Material { name: "Paint \u{202e}gnp.exe".to_owned(), ..sound("zinc") };
    Store::open(theirs.path().join("matdb.sqlite")).unwrap().add([&tricky]).unwrap();
    matdb(theirs.path()).args(["publish", "site", "-q"]).assert().success();
    let database = ours.path().join("matdb.sqlite");
    let before = contents(&database);
    for more in [&["--dry-run"][..], &[]] {
        let site = theirs.path().join("site");
        let said = refused(matdb(ours.path()).arg("import").arg(site).args(more));
        assert!(said.contains("zinc@1: name: it holds a character that turns"), "{said}");
        assert_eq!(contents(&database), before);
    }
    // Neither do they whom a material would be credited to.
    let turned = "title = 'Paints \u{202e}of Roe'\n";
    fs::write(theirs.path().join("about.toml"), turned).unwrap();
    let own = ["publish", "other", "--about", "about.toml"];
    let said = refused(matdb(theirs.path()).args(own));
    assert!(said.contains("`title` holds a character that turns the line"), "{said}");
    let about = About { title: "Paints \u{202e}of Roe".to_owned(), ..About::default() };
    let mut store = Store::in_memory().unwrap();
    store.add([&sound("lead")]).unwrap();
    let other = theirs.path().join("other");
    publish(&store, &about, &other, |_| ()).unwrap();
    let said = refused(matdb(ours.path()).arg("import").arg(&other));
    assert!(
        said.contains("lead@1: its catalogue or an author") && said.contains("turns"),
        "{said}"
    );
    // What stays away is no reason to refuse the others.
    let mut store = Store::open(&database).unwrap();
    store.add([&sound("zinc")]).unwrap();
    drop(store);
    let said = import(ours.path(), &theirs.path().join("site"), &[]);
    assert!(results(&said).contains(&("zinc", "conflict")), "{said}");
}

/// Puts a journal beside a database that tells SQLite to remove `victim` (sqlite.org/fileformat.html,
/// "The Rollback Journal").
fn plant(database: &Path, victim: &Path) {
    let bytes = fs::read(database).unwrap();
    let page = u32::from(u16::from_be_bytes([bytes[16], bytes[17]]));
    let magic = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];
    let pages = (bytes.len() as u32) / page;
    let mut journal = magic.to_vec();
    [0, 0, pages, 512, page].iter().for_each(|n: &u32| journal.extend(n.to_be_bytes()));
    journal.resize(512, 0);
    let name = victim.to_str().unwrap().as_bytes();
    let sum: u32 = name.iter().map(|byte| u32::from(*byte)).sum();
    journal.extend((0x4000_0000 / page + 1).to_be_bytes());
    journal.extend(name);
    journal.extend((name.len() as u32).to_be_bytes());
    journal.extend(sum.to_be_bytes());
    journal.extend(magic);
    let mut place = database.as_os_str().to_owned();
    place.push("-journal");
    fs::write(place, journal).unwrap();
}

#[test]
fn a_planted_journal_removes_nothing() {
    let (theirs, ours) = laboratories();
    let site = theirs.path().join("site");
    let database = site.join("catalogue.sqlite");
    let victim = ours.path().join("thesis.txt");
    fs::write(&victim, "").unwrap();
    plant(&database, &victim);
    for is_listed in [false, true] {
        if is_listed {
            list_hashes(&site);
        }
        for bundle in [&site, &database] {
            let output = matdb(ours.path()).arg("verify").arg(bundle).output().unwrap();
            assert_eq!(output.status.code(), Some(1));
            refused(matdb(ours.path()).arg("import").arg(bundle).arg("--dry-run"));
            refused(matdb(ours.path()).arg("import").arg(bundle));
            for command in [&["list"][..], &["add", "ptfe"]] {
                let said = refused(matdb(ours.path()).arg("--db").arg(&database).args(command));
                assert!(said.contains("remove the journal"), "{said}");
            }
            assert!(victim.exists() && site.join("catalogue.sqlite-journal").exists());
        }
    }
}
