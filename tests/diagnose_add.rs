//! Promise: what `matdb diagnose --add` stores is what `matdb render` then uses. The scene that it leaves
//! renders the powers of the scene with the hidden effect; it stores all or nothing, and writes over
//! nobody's scene.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::support::database::contents;
use crate::support::{entries, matdb, read_cloud, refused, root};
use matdb::material::FindingVerdict;
use matdb::scene::SceneFile;

/// A ball under few chirps with speckle and noise; its mesh stands in a folder of its own.
const SCENE: &str = r#"
seed = 3
[radar]
threshold_dbm = -95.0
[radar.speckle]
looks = 4
form = "independent"
[radar.noise]
level_dbm = -110
range_sd_m = 0.002
[radar.scan]
pattern = "elliptical"
chirps = 3000
[[mesh]]
name = "ball"
file = "meshes/corner.obj"
[[mesh]]
name = "sphere"
file = "builtin:sphere"
size_m = [0.5, 0.5, 0.5]
translation_m = [0.0, 1.25, 0.0]
[[region]]
name = "skin"
material = "mannequin-paint"
"#;

/// A facet far outside the scan: only its file matters.
const CORNER: &str = "v 5 5 0\nv 6 5 0\nv 5 6 0\nf 1 2 3\n";

const DRIFT: &str = "[[radar.effect]]\nname = \"drift\"\nslope_db = 5.0\n";
const PATCH: &str = "[[effect]]\nname = \"foreign-patch\"\nlevel_db = 6.0\ncentre_x_m = 0.05\n\
                     centre_y_m = 0.1\nradius_m = 0.08\n";
const LAYER: &str = "[[effect]]\nname = \"covering-layer\"\nloss_db = 4.0\nboundary_m = 0.1\n\
                     direction_deg = 0.0\n";
const ANISOTROPY: &str = "[[effect]]\nname = \"anisotropy\"\nratio = 2.5\nturn_deg = 30.0\n";

/// What speckle lets some 2000 detections of 4 looks tell of a scan's powers, dB rms.
const FOUND_DB: f64 = 0.35;
/// What the hidden effects do to them at least, dB rms.
const HIDDEN_DB: f64 = 0.7;

/// A folder with the scene and `out/cloud.ply`, which was rendered from `hidden.toml`.
fn measured(effect: &str, material: Option<&str>) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::create_dir(at.join("meshes")).unwrap();
    fs::write(at.join("meshes/corner.obj"), CORNER).unwrap();
    fs::write(at.join("scene.toml"), SCENE).unwrap();
    let mut hidden = SCENE.to_owned() + effect;
    if let Some(effect) = material {
        let paint = root().join("materials/mannequin-paint/material.toml");
        let paint = fs::read_to_string(paint).unwrap() + effect;
        let paint = paint.replace("slug = \"mannequin-paint\"", "slug = \"hidden\"");
        fs::write(at.join("hidden-paint.toml"), paint).unwrap();
        run(at, &["--db", "hidden.sqlite", "add", "--from", "hidden-paint.toml"], "");
        hidden = hidden.replace("mannequin-paint", "hidden");
    }
    fs::write(at.join("hidden.toml"), hidden).unwrap();
    let db: &[&str] = if material.is_some() { &["--db", "hidden.sqlite"] } else { &[] };
    run(at, &[db, &["render", "hidden.toml", "-o", "out"]].concat(), "");
    folder
}

/// Standard output of a run that must succeed and say `expected`.
fn run(folder: &Path, arguments: &[&str], expected: &str) -> String {
    let output = matdb(folder).args(arguments).output().unwrap();
    let [out, error] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert!(output.status.success(), "{arguments:?}: {error}");
    assert!(out.contains(expected), "`{expected}` is not in:\n{out}");
    out
}

/// Power of every chirp of a scene without speckle and noise, dBm.
fn noiseless(folder: &Path, scene: &str, database: &str) -> BTreeMap<u32, f64> {
    let text = fs::read_to_string(folder.join(scene)).unwrap();
    let mut file = SceneFile::parse(&text).unwrap();
    (file.radar.speckle, file.radar.noise) = (None, None);
    let bare = Path::new(scene).with_file_name("bare.toml");
    fs::write(folder.join(&bare), file.write(&text).unwrap()).unwrap();
    let bare = bare.to_str().unwrap();
    let db: &[&str] = if folder.join(database).exists() { &["--db", database] } else { &[] };
    run(folder, &[db, &["render", bare, "-o", "noiseless"]].concat(), "");
    let cloud = read_cloud(&folder.join("noiseless/cloud.ply"));
    let number = |chirp: &f64| *chirp as u32;
    cloud["chirp"].iter().map(number).zip(cloud["power_dbm"].iter().copied()).collect()
}

fn rms_db(one: &BTreeMap<u32, f64>, other: &BTreeMap<u32, f64>) -> f64 {
    let squares: Vec<f64> =
        one.iter().filter_map(|(n, a)| Some((a - other.get(n)?).powi(2))).collect();
    assert!(squares.len() > 1000, "{}", squares.len());
    (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
}

fn diagnose<'a>(scene: &'a str, effects: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let first =
        ["diagnose", "out/cloud.ply", "--scene", scene, "--effects", effects, "-o", "report"];
    [&first, more].concat()
}

#[test]
fn an_effect_of_the_instrument_is_rendered_once_it_is_added() {
    let folder = measured(DRIFT, None);
    let at = folder.path();
    let (before, hidden) =
        (noiseless(at, "scene.toml", "matdb.sqlite"), noiseless(at, "hidden.toml", "matdb.sqlite"));
    assert!(rms_db(&before, &hidden) > HIDDEN_DB, "{}", rms_db(&before, &hidden));
    let add = diagnose("scene.toml", "drift,fov-gain", &["--add"]);
    let said = run(at, &add, "stored mannequin-paint@2 in matdb.sqlite; scene-after.toml renders");
    assert!(said.contains("what they had is mannequin-paint@1"), "{said}");
    assert_eq!(fs::read_to_string(at.join("scene.toml")).unwrap(), SCENE);

    let [builtin, diagnosed] = &contents(&at.join("matdb.sqlite"))[..] else { panic!() };
    assert_eq!(builtin.render, "stated");
    assert_eq!((diagnosed.render.as_str(), diagnosed.effects.len()), ("diagnosed", 0));
    assert_eq!(diagnosed.render_kind().unwrap().as_str(), "modelled");
    for scene in ["scene-after.toml", "report/after.toml"] {
        let text = fs::read_to_string(at.join(scene)).unwrap();
        assert!(text.contains("mannequin-paint@2") && !text.contains("aperture_m2"), "{text}");
        let after = noiseless(at, scene, "matdb.sqlite");
        assert!(rms_db(&after, &hidden) < FOUND_DB, "{scene}: {}", rms_db(&after, &hidden));
    }

    let again = diagnose("scene-after.toml", "drift", &[]);
    let message = refused(matdb(at).args(again));
    assert!(message.contains("declares drift already"), "{message}");
    // Its own file it may write again; the search now begins at revision 2.
    run(at, &add, "stored mannequin-paint@");
    assert!(entries(at).contains(&"scene-after.toml".to_owned()));
}

#[test]
fn an_effect_of_the_scene_stands_in_the_scene_beside_the_old_one() {
    let folder = measured(PATCH, None);
    let at = folder.path();
    let (before, hidden) =
        (noiseless(at, "scene.toml", "matdb.sqlite"), noiseless(at, "hidden.toml", "matdb.sqlite"));
    assert!(rms_db(&before, &hidden) > HIDDEN_DB, "{}", rms_db(&before, &hidden));
    let add = diagnose("scene.toml", "foreign-patch,covering-layer", &["--add"]);
    let said = run(at, &add, "stored mannequin-paint@2 in matdb.sqlite; scene-after.toml renders");
    assert!(said.contains("centre_m = (") && said.contains(") m"), "where it is, is told: {said}");
    let page = fs::read_to_string(at.join("report/report.html")).unwrap();
    assert!(page.contains("<th scope=\"row\">centre_m</th>") && page.contains("The ring is"));
    assert_eq!(fs::read_to_string(at.join("scene.toml")).unwrap(), SCENE);

    // It belongs to the scene: neither the material nor the radar takes it in.
    let stored = contents(&at.join("matdb.sqlite"));
    assert!(stored.len() == 2 && stored.iter().all(|material| material.effects.is_empty()));
    for scene in ["scene-after.toml", "report/after.toml"] {
        let file = SceneFile::parse(&fs::read_to_string(at.join(scene)).unwrap()).unwrap();
        let [patch] = &file.effect[..] else { panic!("{scene}: {:?}", file.effect) };
        assert_eq!((patch.name.as_str(), file.radar.effect.len()), ("foreign-patch", 0));
        let after = noiseless(at, scene, "matdb.sqlite");
        assert!(rms_db(&after, &hidden) < FOUND_DB, "{scene}: {}", rms_db(&after, &hidden));
    }
}

#[test]
fn a_layer_is_told_by_what_it_covers_and_by_its_border() {
    let folder = measured(LAYER, None);
    let at = folder.path();
    run(at, &diagnose("scene.toml", "foreign-patch,covering-layer", &[]), "covering-layer");
    let report = fs::read_to_string(at.join("report/report.json")).unwrap();
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    let found = &report["effects"][0];
    assert_eq!(found["name"], "covering-layer");
    // Of a ball of 0.25 m in radius at x = 0, what lies beyond x = 0.1.
    let along =
        |name: &str, axis: usize| found["parameters"][name]["value"][axis].as_f64().unwrap();
    let [centre_m, extent_m] = ["centre_m", "extent_m"].map(|name| along(name, 0));
    assert!((centre_m - 0.175).abs() < 0.02 && (extent_m - 0.15).abs() < 0.04, "{found}");
    assert!((along("centre_m", 1) - 1.25).abs() < 0.03 && along("extent_m", 1) > 0.3, "{found}");
    let page = fs::read_to_string(at.join("report/report.html")).unwrap();
    assert!(
        page.contains("<th scope=\"row\">extent_m</th>") && page.contains("border of the layer")
    );
}

#[test]
fn an_effect_of_a_material_becomes_a_revision_or_a_file() {
    let folder = measured("", Some(ANISOTROPY));
    let at = folder.path();
    let hidden = noiseless(at, "hidden.toml", "hidden.sqlite");
    let before = noiseless(at, "scene.toml", "none.sqlite");
    assert!(rms_db(&before, &hidden) > HIDDEN_DB, "{}", rms_db(&before, &hidden));

    run(at, &diagnose("scene.toml", "anisotropy,fov-gain", &[]), "after.toml");
    assert!(!at.join("matdb.sqlite").exists() && !at.join("scene-after.toml").exists());
    let file = "report/material-mannequin-paint.toml";
    run(at, &["--db", "other.sqlite", "add", "--from", file], "mannequin-paint-diagnosed");
    let after = noiseless(at, "report/after.toml", "other.sqlite");
    assert!(rms_db(&after, &hidden) < FOUND_DB, "{}", rms_db(&after, &hidden));

    let add = ["--add", "--material", "mannequin-paint"];
    run(at, &diagnose("scene.toml", "anisotropy,fov-gain", &add), "stored mannequin-paint@2");
    let diagnosed = contents(&at.join("matdb.sqlite")).pop().unwrap();
    assert_eq!(diagnosed.effects[0].name, "anisotropy");
    let from = &diagnosed.findings[0].source;
    assert_eq!(
        diagnosed.effects[0].source.as_ref(),
        Some(from),
        "the diagnosis states its numbers"
    );
    let stated = diagnosed.sources.iter().find(|source| source.key == *from).unwrap();
    let hash = blake3::hash(&fs::read(at.join("out/cloud.ply")).unwrap()).to_hex();
    let cloud = format!("Diagnosis of cloud.ply (BLAKE3 {})", &hash[..12]);
    assert!(stated.title.starts_with(&cloud), "{}", stated.title);
    let verdict = |name: &str| {
        let found = diagnosed.findings.iter().find(|finding| finding.effect == name);
        found.map(|finding| (finding.verdict, finding.fit_after.as_deref()))
    };
    assert_eq!(verdict("anisotropy"), Some((FindingVerdict::Found, Some("diagnosed"))));
    assert_eq!(verdict("fov-gain"), Some((FindingVerdict::NotFound, Some("diagnosed"))));
    let after = noiseless(at, "scene-after.toml", "matdb.sqlite");
    assert!(rms_db(&after, &hidden) < FOUND_DB, "{}", rms_db(&after, &hidden));
}

#[test]
fn what_was_tried_and_not_found_is_stored_and_nothing_when_something_hinders_it() {
    let folder = measured("", None);
    let at = folder.path();
    let add = diagnose("scene.toml", "fov-gain", &["--add"]);
    run(at, &add, "stored in mannequin-paint@2 of matdb.sqlite what was tried and not found");
    assert!(!at.join("scene-after.toml").exists());
    let [builtin, tried] = &contents(&at.join("matdb.sqlite"))[..] else { panic!() };
    let [finding] = &tried.findings[..] else { panic!("{:?}", tried.findings) };
    assert_eq!((finding.effect.as_str(), finding.verdict), ("fov-gain", FindingVerdict::NotFound));
    assert_eq!((finding.fit_before.as_deref(), &finding.fit_after), (Some("stated"), &None));
    assert_eq!((&tried.render, &tried.fits), (&builtin.render, &builtin.fits));
    // The same once more is no revision.
    run(at, &add, "stored in mannequin-paint@2 of");
    run(at, &["render", "report/after.toml", "-o", "again"], "");

    let stranger = ["--add", "--material", "mannequin-pant"];
    let message = refused(matdb(at).args(diagnose("scene.toml", "drift", &stranger)));
    assert!(message.contains("its materials are: mannequin-paint"), "{message}");
    fs::write(at.join("scene-after.toml"), "name = \"mine\"\n").unwrap();
    let message = refused(matdb(at).args(diagnose("scene.toml", "drift", &["--add"])));
    assert!(message.contains("no diagnosis wrote it"), "{message}");
    assert_eq!(fs::read_to_string(at.join("scene-after.toml")).unwrap(), "name = \"mine\"\n");
}

#[test]
fn a_file_that_cannot_be_written_leaves_database_and_files_as_they_were() {
    let folder = measured(DRIFT, None);
    let at = folder.path();
    run(at, &["add", "mannequin-paint"], "");
    // A folder where a picture is to be: found out when the revision is in the transaction already.
    fs::create_dir_all(at.join("report/residual-map.png/x")).unwrap();
    let message = refused(matdb(at).args(diagnose("scene.toml", "drift", &["--add", "-q"])));
    assert!(message.contains("residual-map.png"), "{message}");
    // The answer is not lost with the picture.
    assert!(message.contains("the answer is in report/report.json"), "{message}");
    assert_eq!(entries(&at.join("report")), ["report.json", "residual-map.png", "residuals.csv"]);
    assert_eq!(contents(&at.join("matdb.sqlite")).len(), 1);
    assert!(!at.join("scene-after.toml").exists());
}

#[test]
fn a_database_in_use_does_not_lose_the_answer() {
    let folder = measured(DRIFT, None);
    let at = folder.path();
    run(at, &["add", "mannequin-paint"], "");
    let other = rusqlite::Connection::open(at.join("matdb.sqlite")).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let message = refused(matdb(at).args(diagnose("scene.toml", "drift", &["--add", "-q"])));
    assert!(message.contains("in use by another program"), "{message}");
    assert!(
        message.contains("nothing was stored, and the answer is in report/report.json"),
        "{message}"
    );
    let report = fs::read_to_string(at.join("report/report.json")).unwrap();
    assert!(report.contains("\"verdict\": \"explained\""), "{report}");
    assert!(at.join("report/report.html").exists() && !at.join("scene-after.toml").exists());
    other.execute_batch("COMMIT").unwrap();
    assert_eq!(contents(&at.join("matdb.sqlite")).len(), 1);
}
