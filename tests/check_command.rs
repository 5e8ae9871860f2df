//! Promise: `matdb check` finds whatever was changed in a database behind the program's back, fits
//! again what says how it was fitted, and says nothing of a sound one.

use std::fs;
use std::path::Path;

use crate::support::{self, curve, matdb};
use rusqlite::Connection;
use serde_json::Value;

fn database() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scan.csv"), curve()).unwrap();
    matdb(folder.path()).args(["add", "cotton"]).assert().success();
    let arguments = "fit scan.csv --save cotton --kind synthetic --source made --starts 1 --seed 3 \
                     --method tls --theta-sd-deg 0.1 --model mixture";
    matdb(folder.path()).args(arguments.split_whitespace()).assert().success();
    folder
}

fn check(folder: &Path) -> (bool, Value) {
    let output = matdb(folder).args(["check", "--json"]).output().unwrap();
    (output.status.success(), serde_json::from_slice(&output.stdout).unwrap())
}

#[test]
fn a_sound_database_passes_and_nothing_is_missed_in_a_changed_one() {
    let folder = database();
    let (passed, record) = check(folder.path());
    assert!(passed, "{record}");
    assert_eq!((&record["revisions"], &record["fits"]), (&2.into(), &1.into()), "{record}");
    let sound = fs::read(folder.path().join("matdb.sqlite")).unwrap();
    for (sql, place, problem) in [
        ("UPDATE source SET title = 'other'", "cotton@1", "not what was stored"),
        (
            "DROP VIEW v_curves; CREATE VIEW v_curves AS SELECT 1",
            "matdb.sqlite",
            "view v_curves is not the one that matdb makes",
        ),
        ("DROP INDEX entry_class", "matdb.sqlite", "index entry_class"),
        (
            "UPDATE curve_statistic SET mean_greatest = 2 * mean_greatest",
            "cotton@1, curve backscatter",
            "statistics",
        ),
        ("DELETE FROM curve_statistic", "cotton@1, curve backscatter", "statistics"),
        ("UPDATE unit SET ucum = 'furlong' WHERE ucum = 'm'", "matdb.sqlite", "units of columns"),
        ("UPDATE fit_parameter SET sd = 7", "cotton@2", "`fit_parameter`"),
        ("UPDATE fit_parameter SET unit = 'furlong'", "cotton@2", "`fit_parameter`"),
        ("UPDATE entry SET kind = 'measured'", "matdb.sqlite", "what lists and searches say"),
        ("DELETE FROM source WHERE revision_id = 1", "matdb.sqlite", "refer to rows"),
    ] {
        let path = folder.path().join("matdb.sqlite");
        fs::write(&path, &sound).unwrap();
        let conn = Connection::open(&path).unwrap();
        conn.execute_batch(&format!("PRAGMA foreign_keys = off; {sql}")).unwrap();
        drop(conn);
        let (passed, record) = check(folder.path());
        let findings = record["findings"].as_array().unwrap();
        let is_it = |finding: &&Value| {
            finding["place"] == place && finding["problem"].as_str().unwrap().contains(problem)
        };
        assert!(!passed && findings.iter().any(|f| is_it(&f)), "{sql}: {record}");
    }
}

/// A scene of a plate at the focus.
const PLATE: &str = "
[radar.scan]
pattern = \"raster\"
lines = 15
chirps_per_line = 15
width_m = 0.02
height_m = 0.02
[[mesh]]
name = \"plate\"
file = \"builtin:plate\"
size_m = [1, 1, 0]
translation_m = [0, 1.1, 0]
[[region]]
name = \"all\"
material = \"glare\"
";

#[test]
fn a_curve_above_a_mirror_is_named_by_add_check_and_render() {
    for (peak_db, words) in [
        (45, "dB more than a mirror at an incidence of 0.0°, seen by a beam of 0.67°"),
        (30, "less than the beam of 0.67° that sees it"),
        (3, ""),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let curve = format!("theta_deg,sigma0_db\n0,{peak_db}\n0.3,2\n30,-10\n60,-20\n");
        fs::write(folder.path().join("glare.csv"), curve).unwrap();
        fs::write(folder.path().join("scene.toml"), PLATE).unwrap();
        let add = "add --from glare.csv --name glare --class metal --kind synthetic --source made --licence CC0-1.0 \
                   --instrument radar --frequency 300 --threshold -77";
        for arguments in [add, "check", "render scene.toml -o out"] {
            let mut run = matdb(folder.path());
            let output = run.args(arguments.split_whitespace()).output().unwrap();
            let said = String::from_utf8(output.stderr).unwrap()
                + &String::from_utf8(output.stdout).unwrap();
            assert!(output.status.success(), "{said}");
            let is_named = said.contains("than a mirror") || said.contains("than the beam");
            assert_eq!(is_named, !words.is_empty(), "{peak_db} {arguments}: {said}");
            assert!(said.contains(words), "{peak_db} {arguments}: {said}");
            // The strongest detection is above −5.5 dBm and below the 7 dBm that were sent.
            let is_above = said.contains("exceeds the -5.5 dBm that were sent less system_loss_db");
            assert_eq!(is_above, peak_db == 45 && arguments.starts_with("render"), "{said}");
        }
    }
}

#[test]
fn a_missing_database_is_said_to_be_missing() {
    let folder = tempfile::tempdir().unwrap();
    let message = support::refused(matdb(folder.path()).arg("check"));
    assert!(message.contains("there is no database"), "{message}");
}
