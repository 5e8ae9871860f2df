//! Promise: sealed twins are scans that the program reads, with the truth apart from them, the same
//! for the same seed, and without a residual where nothing is missing.

#[path = "../examples/twins/main.rs"]
#[allow(dead_code)]
mod twins;

mod support;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::Value;
use support::{entries, matdb};
use twins::case::{Outcome, Plan};
use twins::physics::Class;
use twins::scenes::Geometry;

const CHIRPS: usize = 1500;

fn plan(effects: &[&'static str], class: Option<Class>, geometry: Geometry) -> Plan {
    Plan {
        seed: 7,
        number: 0,
        attempt: 0,
        effects: effects.to_vec(),
        class,
        geometry,
        chirps: CHIRPS,
    }
}

fn label(plan: &Plan, out: &Path) -> Value {
    match plan.run(out).unwrap() {
        Outcome::Written(label) => label,
        Outcome::OutOfReach(reached) => panic!("{reached}"),
    }
}

/// Every file below a folder.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        match entry.path().is_dir() {
            true => found
                .extend(files(&entry.path()).into_iter().map(|(n, b)| (format!("{name}/{n}"), b))),
            false => drop(found.insert(name, fs::read(entry.path()).unwrap())),
        }
    }
    found
}

#[test]
fn a_case_is_read_by_the_program_and_does_not_hold_its_label() {
    let out = tempfile::tempdir().unwrap();
    let plan = plan(&["covering-layer"], Some(Class::Strong), Geometry::TorsoAndArm);
    let label = label(&plan, out.path());
    let name = label["case"].as_str().unwrap();
    assert_eq!(entries(out.path()), ["cases", "labels"]);
    let case = out.path().join("cases").join(name);
    for (file, bytes) in files(&case) {
        let text = String::from_utf8(bytes).unwrap();
        assert!(!text.contains("covering") && !text.contains("label"), "{file}");
    }
    matdb(&case).args(["add", "--from", "material"]).assert().success();
    matdb(&case).args(["render", "scene.toml", "-q", "-o", "rendered"]).assert().success();
    matdb(&case)
        .args(["measure", "cloud.csv", "--scene", "scene.toml", "--exact-mesh", "-o", "measured"])
        .assert()
        .success();
}

#[test]
fn the_same_seed_gives_the_same_bytes() {
    let plan = plan(&["finite-spot"], Some(Class::Moderate), Geometry::WavyPanel);
    let [one, two] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    assert_eq!(label(&plan, one.path()), label(&plan, two.path()));
    assert!(files(one.path()) == files(two.path()));
}

#[test]
fn where_nothing_is_missing_the_base_law_leaves_nothing() {
    // What a descent that stops early leaves; a weak effect leaves 0.35 dB.
    const STOPPED_DB: f64 = 0.01;
    for geometry in Geometry::ALL {
        let out = tempfile::tempdir().unwrap();
        let label = label(&plan(&[], None, geometry), out.path());
        assert_eq!(label["expected_verdict"], "no-missing-effect");
        let left_db = label["rms_db"].as_f64().unwrap();
        assert!(left_db < STOPPED_DB, "{geometry:?}: {left_db}");
        assert!(label["detections"].as_u64().unwrap() > 300, "{geometry:?}: {label}");
    }
}

#[test]
fn an_effect_is_as_strong_as_its_class() {
    let out = tempfile::tempdir().unwrap();
    for class in Class::ALL {
        let label = label(&plan(&["drift"], Some(class), Geometry::Mannequin), out.path());
        let rms_db = label["rms_db"].as_f64().unwrap();
        // Two percent of the bisection, and its rounding.
        assert!((rms_db / class.rms_db() - 1.0).abs() < 0.03, "{class:?}: {rms_db}");
    }
}
