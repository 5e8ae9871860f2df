//! Promise: the diagnosis is right on scans that other code made: Mitsuba's rays and BSDFs, with speckle, noise and level by
//! numpy (`tests/fixtures/mitsuba`). The whole set takes hours: `.ci/long mitsuba`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::support::matdb;
use serde_json::Value;

fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/mitsuba")
}

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

/// The report on a case, and its truth.
fn diagnosed(case: &str) -> [Value; 2] {
    let (folder, at) = (tempfile::tempdir().unwrap(), fixtures().join(case));
    let material = at.join("material");
    matdb(folder.path()).args(["-q", "add", "--from"]).arg(material).assert().success();
    let (cloud, scene) = (at.join("cloud.ply"), at.join("scene.toml"));
    // Those of which one could be taken for the layer, and those that a level or shared speckle could be taken for.
    let effects = "covering-layer,foreign-patch,fov-gain,drift,subsurface,noise-floor";
    matdb(folder.path())
        .args(["-q", "diagnose"])
        .arg(cloud)
        .arg("--scene")
        .arg(scene)
        .args(["--effects", effects, "-o", "answer"])
        .assert()
        .success();
    [json(&folder.path().join("answer/report.json")), json(&at.join("truth.json"))]
}

fn assert_level(report: &Value, truth: &Value) {
    let number = |value: &Value| value.as_f64().unwrap();
    let (found, truth) = (&report["base"]["level_db"], number(&truth["level_offset_db"]));
    // The stored law is some 20 % off, too.
    assert!(
        (number(&found["value"]) - truth).abs() < 2.5 * number(&found["sd"]),
        "{found} {truth}"
    );
}

/// Neighbouring chirps share their speckle, as through a beam of 13.6 mm, and the level is off by 1 dB.
#[test]
fn of_a_complete_scan_nothing_is_missing() {
    let [report, truth] = diagnosed("complete");
    assert_eq!(report["verdict"], "no-missing-effect", "{}", report["effects"]);
    assert_level(&report, &truth);
}

/// The layer is a polygon of uneven thickness; the library's is oval.
#[test]
fn a_layer_of_another_shape_is_named() {
    let [report, truth] = diagnosed("covering-layer");
    assert_eq!(report["effects"][0]["name"], truth["labels"][0], "{}", report["effects"]);
    assert_level(&report, &truth);
}
