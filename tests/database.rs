//! Promise: `add`, `list`, `show` and `rm` keep every revision, change nothing needlessly and answer
//! scripts in JSON; a scene renders what the database holds.

use std::fs;
use std::path::Path;

use crate::support::{self, entries, matdb, refused, refused_with_lines, root, scene};
use serde_json::Value;

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = matdb(folder).args(arguments).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// A copy of a built-in material's folder with one piece of text replaced.
fn variant(folder: &Path, slug: &str, from: &str, to: &str) {
    let text =
        fs::read_to_string(root().join("materials").join(slug).join("material.toml")).unwrap();
    assert!(text.contains(from));
    fs::create_dir_all(folder.join(slug)).unwrap();
    fs::write(folder.join(slug).join("material.toml"), text.replacen(from, to, 1)).unwrap();
}

#[test]
fn a_template_is_printed_whatever_else_is_said() {
    let folder = tempfile::tempdir().unwrap();
    for more in [&[][..], &["--json"], &["--verbose"]] {
        let mut command = matdb(folder.path());
        command.env("MATDB", "mine.sqlite").args(["add", "--template"]).args(more);
        let said = command.output().unwrap();
        assert!(said.status.success(), "{}", String::from_utf8_lossy(&said.stderr));
        assert!(String::from_utf8_lossy(&said.stdout).contains("my-paint"));
    }
    matdb(folder.path()).args(["add", "--template", "-q"]).assert().success();
}

#[test]
fn adding_twice_changes_nothing_and_a_change_is_a_new_revision() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    assert_eq!(json(folder, &["add", "ptfe"])[0]["result"], "added");
    let before = fs::read(folder.join("matdb.sqlite")).unwrap();
    assert_eq!(json(folder, &["add", "ptfe"])[0]["result"], "unchanged");
    assert_eq!(fs::read(folder.join("matdb.sqlite")).unwrap(), before);
    variant(folder, "ptfe", "m = 0.05", "m = 0.06");
    let added = json(folder, &["add", "--from", "ptfe"]);
    assert_eq!((&added[0]["result"], &added[0]["revision"]), (&"revised".into(), &2.into()));
    let m = |name: &str| {
        json(folder, &["show", name])["material"]["fits"][0]["model"]["specular"]["m"].as_f64()
    };
    assert_eq!((m("ptfe"), m("ptfe@1"), m("ptfe@2")), (Some(0.06), Some(0.05), Some(0.06)));
    assert_eq!(json(folder, &["rm", "ptfe"])[0]["revisions"], 2);
    assert_eq!(json(folder, &["list"]), Value::Array(vec![]));
}

#[test]
fn after_a_missing_number_what_differs_is_told_from_the_revision_before() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    json(folder, &["add", "ptfe"]);
    let lose = "PRAGMA foreign_keys = off; UPDATE material SET current_revision = 9";
    let conn = rusqlite::Connection::open(folder.join("matdb.sqlite")).unwrap();
    conn.execute_batch(lose).unwrap();
    drop(conn);
    variant(folder, "ptfe", "m = 0.05", "m = 0.06");
    let added = json(folder, &["add", "--from", "ptfe"]);
    assert_eq!(added[0]["revision"], 10);
    assert!(added[0]["differs"].as_str().unwrap().contains("fit"), "{added}");
}

#[test]
fn several_materials_are_added_together_or_not_at_all() {
    let folder = tempfile::tempdir().unwrap();
    let count = matdb::material::builtin::names().count();
    assert_eq!(json(folder.path(), &["add", "--all"]).as_array().unwrap().len(), count);
    assert_eq!(json(folder.path(), &["list"]).as_array().unwrap().len(), count);
    let own = tempfile::tempdir().unwrap();
    variant(own.path(), "ptfe", "m = 0.05", "m = 0.07");
    variant(own.path(), "glass", "m = 0.02", "m = 9");
    let refused = support::refused(matdb(folder.path()).args(["add", "--from"]).arg(own.path()));
    assert!(refused.contains("glass") && refused.contains("specular.m = 9"), "{refused}");
    assert_eq!(json(folder.path(), &["show", "ptfe"])["revision"], 1);
}

#[test]
fn a_scene_renders_what_the_database_holds() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let render = |out: &str| {
        let scene = scene("human.toml");
        json(folder, &["render", scene.to_str().unwrap(), "-o", out]);
        let record = fs::read(folder.join(out).join("scan.json")).unwrap();
        serde_json::from_slice::<Value>(&record).unwrap()["materials"][0].clone()
    };
    let built_in = render("one");
    assert_eq!((&built_in["origin"], &built_in["revision"]), (&"built-in".into(), &Value::Null));
    assert_eq!(entries(folder), ["one"], "rendering creates no database");
    variant(folder, "human-skin-300-ghz", "m = 0.08", "m = 0.12");
    json(folder, &["add", "--from", "human-skin-300-ghz"]);
    let stored = render("two");
    assert_eq!((&stored["origin"], &stored["revision"]), (&"database".into(), &1.into()));
    assert_eq!(stored["scattering"]["specular"]["m"], 0.12);
}

#[test]
fn the_database_is_where_the_flag_or_the_environment_says() {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path()).args(["add", "ptfe", "--db", "flag.sqlite"]).assert().success();
    matdb(folder.path()).args(["add", "ptfe"]).env("MATDB", "variable.sqlite").assert().success();
    assert_eq!(entries(folder.path()), ["flag.sqlite", "variable.sqlite"]);
}

#[test]
fn quiet_says_nothing_and_a_reader_that_leaves_is_no_error() {
    let folder = tempfile::tempdir().unwrap();
    let output = matdb(folder.path()).args(["add", "--all", "--quiet"]).output().unwrap();
    assert!(output.status.success() && output.stdout.is_empty() && output.stderr.is_empty());
    let program = assert_cmd::cargo::cargo_bin("matdb");
    let script = format!("'{}' completions bash | head -c 10", program.display());
    let piped = std::process::Command::new("bash")
        .args(["-o", "pipefail", "-c", &script])
        .output()
        .unwrap();
    assert!(piped.status.success(), "{}", String::from_utf8_lossy(&piped.stderr));
}

/// A folder with the program's own template, changed, and its curve.
fn from_template(change: impl Fn(String) -> String, csv: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let output = matdb(folder.path()).args(["add", "--template"]).output().unwrap();
    let text = change(String::from_utf8(output.stdout).unwrap());
    fs::write(folder.path().join("material.toml"), text).unwrap();
    fs::write(folder.path().join("scan.csv"), csv).unwrap();
    folder
}

const BARE: &str = "theta_deg,sigma0_db\n0,5\n20,-10\n";

#[test]
fn the_template_is_accepted_and_shown() {
    let folder = from_template(|text| text, BARE);
    matdb(folder.path()).args(["add", "--from", "."]).assert().success();
    let output = matdb(folder.path()).args(["show", "my-paint"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    for said in ["outermost first", "half space", "acrylic", "4.2 um rms", "2026-03-14", "22 °C"]
        .into_iter()
        .chain(["not known: The thickness of each coat.", "sprayed", "thin-film", "not found"])
    {
        assert!(text.contains(said), "{said}: {text}");
    }
}

#[test]
fn values_that_only_a_slip_can_give_are_refused() {
    for (from, to, expected) in [
        ("licence = \"CC-BY-4.0\"", "licence = \"all rights reserved\"", "not an SPDX expression"),
        ("10.1234/example", "https://doi.org/10.1234/example", "is not a DOI"),
        ("doi = \"10.1234/example\"", "url = \"javascript:alert(1)\"", "begins with http://"),
        ("bandwidth_ghz = 27", "bandwidth_ghz = 27e9", "begins below 0 Hz"),
        ("thickness_mm = 0.12", "thickness_mm = 120000", "120 m thick"),
        (
            "centre_frequency_ghz = 300",
            "centre_frequency_ghz = 94",
            "measured at 94 GHz and the entry claims 290–310 GHz",
        ),
        ("curve = \"scan\"\n", "", "fit `two-lobes` has the measured source `bench`"),
    ] {
        let folder = from_template(|text: String| text.replacen(from, to, 1), BARE);
        let message = refused(matdb(folder.path()).args(["add", "--from", "."]));
        assert!(message.contains(expected), "{expected}: {message}");
        assert!(!folder.path().join("matdb.sqlite").exists());
    }
    for (key, expected) in [
        ("licence = 'all mine'", "SPDX"),
        ("url = 'javascript:alert(1)'", "http://"),
        ("doi = 'doi:10.1/x'", "resolver"),
    ] {
        let error = matdb::catalogue::About::parse("about.toml", key).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_measured_curve_without_its_circumstances_is_refused() {
    let all = "source `bench` has no licence; curve `scan` names no instrument; not every row";
    let lacks = |text: String| {
        let text = text.replace("licence = \"CC-BY-4.0\"             # SPDX, of", "# of");
        text.replace("instrument = \"radar\"\n", "")
    };
    for (change, expected, line) in [
        (&lacks as &dyn Fn(String) -> String, all, "\ninstrument = \"radar\""),
        (
            &|text: String| text.replace("threshold_dbm = -77", "#"),
            "instrument `radar` has no threshold_dbm",
            "\nthreshold_dbm = …",
        ),
    ] {
        let folder = from_template(change, BARE);
        let (message, lines) =
            refused_with_lines(matdb(folder.path()).args(["add", "--from", "."]));
        assert!(message.contains(expected) && message.contains("--template"), "{message}");
        assert!(lines.contains(line), "{lines}");
        assert!(!folder.path().join("matdb.sqlite").exists());
    }
    let synthetic =
        |text: String| lacks(text).replace("kind = \"measured\"", "kind = \"synthetic\"");
    let folder = from_template(synthetic, BARE);
    matdb(folder.path()).args(["add", "--from", "."]).assert().success();
    let rows = "theta_deg,sigma0_db,censor,threshold_db\n0,5,none,-30\n20,-10,none,-30\n";
    let folder = from_template(|text: String| text.replace("threshold_dbm = -77", "#"), rows);
    matdb(folder.path()).args(["add", "--from", "."]).assert().success();
}

#[test]
fn references_to_nothing_and_to_what_never_ends_are_refused() {
    let no_instrument = |text: String| {
        let (before, rest) = text.split_once("[[instrument]]").unwrap();
        format!("{before}{}", &rest[rest.find("\n[[").unwrap()..])
    };
    let devices = |text: String| text.replace("file = \"scan.csv\"", "file = \"/dev/zero\"");
    let twice = |text: String| text.replace("tags = [", "tags = [\"matt\", \"matt\", ");
    let unfilled = |text: String| {
        let from = text.find("[[instrument]]").unwrap();
        let name = from + text[from..].find("name = ").unwrap();
        let end = name + text[name..].find('\n').unwrap();
        format!("{}name = \"…\"{}", &text[..name], &text[end..])
    };
    let empty = |text: String| text.replace("tags = [", "tags = [\" \", ");
    for (change, expected) in [
        (&no_instrument as &dyn Fn(String) -> String, "define it, or leave the reference out"),
        (&devices, "not a regular file"),
        (&twice, "tags holds `matt` twice"),
        (&empty, "tags holds an empty word"),
        (&unfilled, "the name of instrument `radar` is not filled in"),
    ] {
        let folder = from_template(change, BARE);
        let message = refused(matdb(folder.path()).args(["add", "--from", "."]));
        assert!(message.contains(expected), "{expected}: {message}");
    }
}

#[test]
fn what_may_surprise_later_is_said_when_it_is_added() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let detected = (0..12).map(|step| format!("{},{},,\n", 5 * step, -3 - 2 * step));
    let curve = format!(
        "theta_deg,sigma0_db,censor,threshold_db\n{}60,-28,,\n60,,left,-33\n60,,left,-33\n",
        detected.collect::<String>()
    );
    fs::write(folder.join("scan.csv"), curve).unwrap();
    let add = |name: &str, frequency: &str, more: &[&str]| {
        let mut command = matdb(folder);
        command.args(["add", "--from", "scan.csv", "--class", "paint", "--kind", "measured"]);
        command.args(["--source", "Own bench", "--licence", "CC-BY-4.0", "--instrument", "Radar"]);
        command.args(["--threshold", "-77", "--name", name, "--frequency", frequency]).args(more);
        let output = command.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap())
    };
    let [_, notices] = add("ptfe", "0.3", &["--tag", "matt"]);
    for expected in [
        "at 60° 2 of 3 points of curve `scan` were missed",
        "a built-in material has this name",
        "at 0.3 GHz; is that in GHz?",
    ] {
        assert!(notices.contains(expected), "{expected}: {notices}");
    }
    let [said, notices] = add("my-paint", "300", &["--tag", "matt"]);
    assert!(!notices.contains("GHz") && !notices.contains("built-in"), "{notices}");
    assert!(!said.contains("differs"), "{said}");
    let [said, _] = add("my-paint", "300", &[]);
    assert!(said.contains("revision 2") && said.contains("what differs: without tags"), "{said}");
    let near = json(folder, &["near", "--material", "my-paint"]);
    let found: Vec<&str> =
        near["materials"].as_array().unwrap().iter().flat_map(|m| m["slug"].as_str()).collect();
    assert!(found.contains(&"ptfe") && !found.contains(&"my-paint"), "{found:?}");
}

#[test]
fn what_was_kept_is_not_lost_without_a_word() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let said = |arguments: &[&str]| {
        let output = matdb(folder).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8([output.stdout, output.stderr].concat()).unwrap()
    };
    variant(folder, "ptfe", "m = 0.05", "m = 0.06");
    said(&["add", "--from", "ptfe"]);
    let before = fs::read(folder.join("matdb.sqlite")).unwrap();
    let over = ["export", "ptfe", "--as", "mitsuba", "-o", "matdb.sqlite"];
    assert!(refused(matdb(folder).args(over)).contains("a database is there"));
    assert!(fs::read(folder.join("matdb.sqlite")).unwrap() == before);
    said(&["withdraw", "ptfe", "--reason", "The plate was wet."]);
    for command in [["show", "ptfe@1"], ["cite", "ptfe@1"]] {
        assert!(said(&command).contains("withdrawn: The plate was wet."), "{command:?}");
    }
    assert!(said(&["add", "--from", "ptfe"]).contains("it was withdrawn: The plate was wet."));
}
