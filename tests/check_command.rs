//! Promise: `matdb check` finds whatever was changed in a database behind the program's back, fits
//! again what says how it was fitted, and says nothing of a sound one.

mod support;

use std::fs;
use std::path::Path;

use rusqlite::Connection;
use serde_json::Value;
use support::matdb;

/// Two lobes at 61 angles, without noise.
fn curve() -> String {
    let mut text = "theta_deg,sigma0_db\n".to_owned();
    for step in 0..=60 {
        let theta_rad = f64::from(step).to_radians();
        let brdf = 5.0 * (-(theta_rad.tan() / 0.05).powi(2)).exp() + 0.01 * theta_rad.cos().powi(3);
        let sigma0 = 4.0 * std::f64::consts::PI * brdf * theta_rad.cos().powi(2);
        text += &format!("{step},{:.4}\n", 10.0 * sigma0.log10());
    }
    text
}

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
        ("DELETE FROM source WHERE revision_id = 1", "matdb.sqlite", "refers to a row"),
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

#[test]
fn a_missing_database_is_said_to_be_missing() {
    let folder = tempfile::tempdir().unwrap();
    let message = support::refused(matdb(folder.path()).arg("check"));
    assert!(message.contains("there is no database"), "{message}");
}
