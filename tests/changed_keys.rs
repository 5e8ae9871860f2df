//! Promise: `matdb render --set` and `--seed` render the scene that a file with these values would be, and record it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::support::matdb;

const SCENE: &str = "
seed = 1
[radar.scan]
pattern = \"raster\"
lines = 10
chirps_per_line = 12
width_m = 0.3
height_m = 0.3
[[mesh]]
name = \"plate\"
file = \"builtin:cuboid\"
size_m = [0.4, 0.4, 0.01]
translation_m = [0, 1.1, 0]
[[region]]
name = \"skin\"
material = \"mannequin-paint\"
";

/// Renders a scene with more arguments; every file that is written.
fn rendered(folder: &Path, scene: &str, more: &[&str]) -> Vec<(String, Vec<u8>)> {
    fs::write(folder.join("scene.toml"), scene).unwrap();
    let _ = fs::remove_dir_all(folder.join("out"));
    matdb(folder).args(["render", "-q", "scene.toml", "-o", "out"]).args(more).assert().success();
    let mut files = Vec::new();
    for entry in folder.join("out").read_dir().unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        files.push((name, fs::read(path).unwrap()));
    }
    files.sort();
    files
}

fn refused(folder: &Path, more: &[&str]) -> String {
    fs::write(folder.join("scene.toml"), SCENE).unwrap();
    let run =
        matdb(folder).args(["render", "scene.toml", "-o", "no"]).args(more).assert().failure();
    assert!(!folder.join("no").exists());
    String::from_utf8(run.get_output().stderr.clone()).unwrap()
}

#[test]
fn a_change_is_the_same_as_an_edit_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let bare = rendered(folder.path(), SCENE, &[]);
    let drift = "[[radar.effect]]\nname = \"drift\"\nslope_db = 8\n[radar.scan]";
    let speckle = "[radar.speckle]\nlooks = 2\n[radar.scan]";
    let pose = "[[effect]]\nname = \"pose\"\nrotation_y_deg = 2\n[[region]]";
    for (find, put, changes) in [
        ("seed = 1", "seed = 7", &["--seed", "7"][..]),
        ("seed = 1", "seed = 7", &["--set", "seed=7"]),
        ("mannequin-paint", "human-skin", &["--set", "region.skin.material=human-skin"]),
        (
            "size_m",
            "rotation_deg = [0, 4, 0]\nsize_m",
            &["--set", "mesh.plate.rotation_deg=[0, 4, 0]"],
        ),
        ("[radar.scan]", drift, &["--set", "radar.effect.drift.slope_db=8"]),
        ("[[region]]", pose, &["--set", "effect.pose.rotation_y_deg=2"]),
        (
            "[radar.scan]",
            speckle,
            &["--set", "radar.speckle.looks=4", "--set", "radar.speckle.looks=2"],
        ),
        ("lines = 10", "lines = 5", &["--set", "radar.scan.lines=5"]),
    ] {
        let edited = rendered(folder.path(), &SCENE.replace(find, put), &[]);
        let changed = rendered(folder.path(), SCENE, changes);
        assert!(edited == changed, "{changes:?}");
        assert!(changed != bare, "{changes:?}");
    }
}

#[test]
fn the_record_is_that_of_the_changed_scene() {
    let folder = tempfile::tempdir().unwrap();
    let changes =
        ["--seed", "9", "--set", "name=turned", "--set", "mesh.plate.rotation_deg=[0, 5, 0]"];
    rendered(folder.path(), SCENE, &changes);
    let json = fs::read(folder.path().join("out/scan.json")).unwrap();
    let record: Value = serde_json::from_slice(&json).unwrap();
    let scene = &record["scene"];
    assert_eq!((&scene["seed"], &scene["name"]), (&9.into(), &"turned".into()));
    assert_eq!(scene["mesh"][0]["rotation_deg"][1], 5.0);
}

#[test]
fn a_refusal_names_the_flag_and_the_key() {
    let folder = tempfile::tempdir().unwrap();
    for (change, problem, way_out) in [
        ("radar.speckle.lookz=4", "unknown key `lookz`", "did you mean `looks`?"),
        ("radar.threshold_dbm=low", "expected a number", ""),
        ("radar.threshold_dbm=500", "threshold_dbm = 500", ""),
        ("mesh.plat.scale=2", "there is no mesh `plat`", "did you mean `plate`? there are: plate"),
        ("region.skin.material=human-skim", "no material `human-skim`", "human-skin"),
        ("effect.poze.rotation_y_deg=1", "poze", "did you mean `pose`?"),
        ("radar.effect.drift.slope_db=1e9", "slope_db", ""),
        ("spot.rays=0", "spot.rays", "give 1 to 10 000"),
    ] {
        let (key, _) = change.split_once('=').unwrap();
        // A change beside it that is in order is not named.
        let said = refused(folder.path(), &["--set", "seed=3", "--set", change, "--set", "name=a"]);
        assert!(said.contains(&format!("--set {key}=")), "{said}");
        assert!(said.contains(problem) && said.contains(way_out), "{said}");
        assert!(!said.contains("seed") && !said.contains("name="), "{said}");
    }
    for (arguments, problem) in [
        (&["--set", "seed"][..], "--set <KEY=VALUE>"),
        (&["--set", "mesh.plate.scale=[1"], "no value of TOML"),
        (&["--seed=-1"], "--seed"),
        (&["--set", "seed=-1", "--set", "spot.rays=0"], "--set seed=-1, spot.rays=0: "),
    ] {
        let said = refused(folder.path(), arguments);
        assert!(said.contains(problem), "{said}");
    }
}
