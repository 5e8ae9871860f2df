//! Promise: a rendering says, once for each material and in `scan.json`, where it uses a scattering model or a single
//! ray outside of what its derivation allows, and nothing where it does not; `show` and `fit` say it of models.

use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::support::{matdb, scene};
use serde_json::{Value, json};

/// Rough plates, two of them of one material, and a ball.
const SCENE: &str = r#"
[radar.scan]
pattern = "raster"
lines = 60
chirps_per_line = 60
width_m = 0.4
height_m = 0.4
[[mesh]]
name = "left"
file = "builtin:plate"
size_m = [0.18, 0.4, 0]
translation_m = [-0.1, 1.1, 0]
[[mesh]]
name = "right"
file = "builtin:plate"
size_m = [0.18, 0.4, 0]
translation_m = [0.1, 1.1, 0]
[[region]]
name = "left"
mesh = "left"
material = "sheet"
[[region]]
name = "right"
mesh = "right"
material = "sheet"
"#;

/// A material of one model.
fn sheet(scattering: &str, more: &str) -> String {
    format!(
        r#"
slug = "sheet"
name = "Sheet for tests"
class = "metal"
licence = "CC0-1.0"
frequency_ghz = [200, 400]
theta_deg = [0, 90]
render = "law"
{more}
[[source]]
key = "here"
kind = "synthetic"
title = "Made for tests"
[[fit]]
name = "law"
estimator = "assumed"
source = "here"
scattering = {{ {scattering} }}
"#
    )
}

/// The notices of a rendering about validity, and the list in its record.
fn rendered(folder: &Path, scene: &Path) -> (Vec<String>, Vec<Value>) {
    let render = ["render", scene.to_str().unwrap(), "-o", "out"];
    let output = matdb(folder).args(render).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    let said = said.lines().filter(|line| line.contains(" holds for ")).map(str::to_owned);
    let record = fs::read(folder.join("out/scan.json")).unwrap();
    let record: Value = serde_json::from_slice(&record).unwrap();
    (said.collect(), record["validity"].as_array().unwrap().clone())
}

/// As [`rendered`], of a scene with a material.
fn rendered_with(scene: &str, material: &str) -> (Vec<String>, Vec<Value>) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    fs::write(folder.path().join("sheet.toml"), material).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "sheet.toml"]).assert().success();
    rendered(folder.path(), Path::new("scene.toml"))
}

#[test]
fn a_kirchhoff_surface_of_short_correlation_is_named_once_with_its_regions() {
    let law =
        r#"model = "kirchhoff", rms_height_m = 5e-5, correlation_length_m = 5e-4, eps_real = 3"#;
    let (said, listed) = rendered_with(SCENE, &sheet(law, ""));
    assert_eq!(said.len(), 1, "{said:?}");
    let words = "`sheet` on `left`, `right`: kirchhoff holds for k·l of at least 6, here it is 3.14 (Thorsos";
    assert!(said[0].contains(words), "{said:?}");
    assert_eq!(listed.len(), 1, "{listed:?}");
    let mut entry = listed[0].clone();
    let value = entry["value"].take().as_f64().unwrap();
    assert!((value - 3.1437).abs() < 1e-3, "{value}");
    let expected = json!({
        "material": "sheet", "regions": ["left", "right"], "model": "kirchhoff", "quantity": "k·l", "unit": "1",
        "value": null, "bound": "at-least", "limit": 6.0, "source": "Thorsos, J. Acoust. Soc. Am. 83 (1988) 78",
    });
    assert_eq!(entry, expected);

    // A part of a mixture counts like a model by itself; three limits are broken, each is said once.
    let steep =
        r#"model = "kirchhoff", rms_height_m = 3e-4, correlation_length_m = 5e-4, eps_real = 3"#;
    let mixed = format!(
        r#"model = "sum", parts = [{{ {steep} }}, {{ {steep} }}, {{ model = "lambert", albedo = 0.1 }}]"#
    );
    let (said, listed) = rendered_with(SCENE, &sheet(&mixed, ""));
    let quantities: Vec<&str> =
        listed.iter().map(|one| one["quantity"].as_str().unwrap()).collect();
    assert_eq!(quantities, ["k·l", "l²/(s·λ)", "the rms slope √2·s/l"]);
    assert_eq!(said.len(), 3, "{said:?}");
}

#[test]
fn a_sound_model_is_not_named() {
    let gentle =
        r#"model = "kirchhoff", rms_height_m = 1e-4, correlation_length_m = 2e-3, eps_real = 3"#;
    let rays = r#"model = "kirchhoff-go", rms_slope = 0.2, eps_real = 3"#;
    let lambert = r#"model = "lambert", albedo = 0.1"#;
    for law in [gentle, rays, lambert] {
        assert_eq!(rendered_with(SCENE, &sheet(law, "")), (vec![], vec![]), "{law}");
    }
}

#[test]
fn the_limit_of_rays_is_judged_by_the_height_that_the_material_states() {
    let rays = r#"model = "kirchhoff-go", rms_slope = 0.2, eps_real = 3"#;
    let rough = |um: f64| format!("roughness = {{ rms_height_um = {um}, source = \"here\" }}");
    let (said, listed) = rendered_with(SCENE, &sheet(rays, &rough(20.0)));
    assert_eq!(listed[0]["quantity"], "(2·k·s)²");
    assert!(
        said[0].contains("kirchhoff-go holds for (2·k·s)² of at least 10, here it is 0.0633"),
        "{said:?}"
    );
    assert_eq!(rendered_with(SCENE, &sheet(rays, &rough(300.0))), (vec![], vec![]));
}

/// A ball of a radius, m, whose front is in the focus, under rays per spot.
fn ball(radius_m: f64, rays: usize) -> String {
    let diameter_m = 2.0 * radius_m;
    let plates = SCENE.find("[[mesh]]").unwrap();
    let scan = SCENE[..plates].replace("0.4", "0.2");
    format!(
        r#"{scan}
[spot]
rays = {rays}
[[mesh]]
name = "ball"
file = "builtin:sphere"
size_m = [{diameter_m}, {diameter_m}, {diameter_m}]
translation_m = [0, 1.1, {}]
[[region]]
name = "all"
material = "sheet"
"#,
        -radius_m
    )
}

/// The paper's specular term; with the beam's divergence of 0.0117 rad its lobe is 0.0514 rad wide.
const LOBE: &str = r#"model = "cook-torrance", f_lambda = 0.1, m = 0.05"#;

#[test]
fn a_single_ray_on_a_ball_is_named_where_the_ball_is_curved_within_the_spot() {
    // w = 13.59 mm: the tilt over it is 0.091 rad on a ball of 0.15 m, 0.034 rad on one of 0.4 m.
    let (said, listed) = rendered_with(&ball(0.15, 1), &sheet(LOBE, ""));
    assert_eq!((said.len(), listed.len()), (1, 1), "{said:?}");
    assert!(said[0].contains("`sheet` on `all`: one ray per spot holds for a tilt"), "{said:?}");
    assert!(said[0].ends_with("; set rays = 16 under [spot]"), "{said:?}");
    let number = |key: &str| listed[0][key].as_f64().unwrap();
    // The facets, a third of the spot wide, scatter by a tenth, of which the upper quartile is taken.
    assert!((number("value") / 0.0906 - 1.0).abs() < 0.15, "{}", number("value"));
    assert!((number("limit") / 0.0514 - 1.0).abs() < 0.01, "{}", number("limit"));

    assert_eq!(rendered_with(&ball(0.15, 16), &sheet(LOBE, "")), (vec![], vec![]));
    assert_eq!(rendered_with(&ball(0.4, 1), &sheet(LOBE, "")), (vec![], vec![]));
    // A diffuse surface has no lobe that a tilt could move.
    let lambert = r#"model = "lambert", albedo = 0.1"#;
    assert_eq!(rendered_with(&ball(0.05, 1), &sheet(lambert, "")), (vec![], vec![]));
    // A spot that an effect stands for is no single ray.
    let with_effect =
        ball(0.15, 1) + "[[radar.effect]]\nname = \"finite-spot\"\ndiameter_m = 0.016\n";
    assert_eq!(rendered_with(&with_effect, &sheet(LOBE, "")), (vec![], vec![]));
}

/// Polished metal: its lobe is the beam's, 0.0117 rad or 0.671° wide.
const POLISHED: &str = r#"model = "fresnel", eps_real = 1, eps_imag = 1e9"#;

#[test]
fn facets_that_step_over_the_lobe_of_a_mirror_are_named_with_the_way_out() {
    let (said, listed) = rendered_with(&ball(0.15, 16), &sheet(POLISHED, ""));
    assert_eq!((said.len(), listed.len()), (1, 1), "{said:?}");
    for words in [
        "`sheet` on `all`: a mesh of facets holds for a step between the normals of neighbours of at most 0.335 deg",
        "the lobe that the beam sees is 0.671 deg wide",
        "builtin:sphere-cap",
    ] {
        assert!(said[0].contains(words), "{said:?}");
    }
    // 20 480 facets turn by 0.0217 rad, and a quarter of them by more.
    let step_deg = listed[0]["value"].as_f64().unwrap();
    assert!((1.1..1.6).contains(&step_deg), "{step_deg}");
    assert_eq!(listed[0]["unit"], "deg");

    // The cap of the same ball, whose facets turn by 0.0025 rad.
    let size = "size_m = [0.3, 0.3, 0.3]";
    let cap = ball(0.15, 16).replace("builtin:sphere", "builtin:sphere-cap");
    assert!(cap.contains(size));
    let cap = cap.replace(size, "scale = 0.3");
    assert_eq!(rendered_with(&cap, &sheet(POLISHED, "")), (vec![], vec![]));
    // A rough lobe of √(m² + δ²) = 0.0514 rad is wide enough for this ball, and one of 0.0232 rad is not.
    assert_eq!(rendered_with(&ball(0.15, 16), &sheet(LOBE, "")), (vec![], vec![]));
    let smoother = LOBE.replace("m = 0.05", "m = 0.02");
    assert_eq!(rendered_with(&ball(0.15, 16), &sheet(&smoother, "")).0.len(), 1);
    // A mirror that has lost its wave to roughness has no lobe that would count.
    let rough =
        r#"model = "kirchhoff", rms_height_m = 1e-3, correlation_length_m = 8e-3, eps_real = 3"#;
    assert_eq!(rendered_with(&ball(0.15, 16), &sheet(rough, "")), (vec![], vec![]));
    // Flat plates have no step, and their edges are none.
    assert_eq!(rendered_with(SCENE, &sheet(POLISHED, "")), (vec![], vec![]));
}

/// A cap of a ball, 80 mm wide and in facets of half a millimetre, as an OBJ file; its top is the origin.
fn cap(radius_m: f64) -> String {
    const STEPS: usize = 160;
    let place = |step: usize| 0.08 * (step as f64 / STEPS as f64 - 0.5);
    let mut text = String::new();
    for row in 0..=STEPS {
        for column in 0..=STEPS {
            let (x, y) = (place(column), place(row));
            let z = (radius_m * radius_m - x * x - y * y).sqrt() - radius_m;
            writeln!(text, "v {x} {y} {z}").unwrap();
        }
    }
    for row in 0..STEPS {
        for column in 0..STEPS {
            let corner = row * (STEPS + 1) + column + 1;
            let above = corner + STEPS + 1;
            writeln!(text, "f {corner} {} {} {above}", corner + 1, above + 1).unwrap();
        }
    }
    text
}

/// At the limit, w/a = m_eff, the curvature takes 10·lg(1 + 1/4) from the peak of the lobe.
#[test]
fn at_the_limit_a_single_ray_errs_by_one_decibel() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("sheet.toml"), sheet(LOBE, "")).unwrap();
    fs::write(folder.path().join("cap.obj"), cap(0.2646)).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "sheet.toml"]).assert().success();
    let strongest_dbm = |rays: usize| {
        let ball = ball(0.2646, rays);
        let (scan, rest) = ball.split_at(ball.find("[[mesh]]").unwrap());
        let region = &rest[rest.find("[[region]]").unwrap()..];
        let scan = scan.replace("= 60", "= 9").replace("_m = 0.2\n", "_m = 0.02\n");
        let mesh = "[[mesh]]\nname = \"cap\"\nfile = \"cap.obj\"\ntranslation_m = [0, 1.1, 0]\n";
        fs::write(folder.path().join("scene.toml"), format!("{scan}{mesh}{region}")).unwrap();
        matdb(folder.path()).args(["render", "-q", "scene.toml", "-o", "out"]).assert().success();
        let record = fs::read(folder.path().join("out/scan.json")).unwrap();
        let record: Value = serde_json::from_slice(&record).unwrap();
        record["power_dbm"]["strongest"].as_f64().unwrap()
    };
    let too_strong_db = strongest_dbm(1) - strongest_dbm(256);
    assert!((too_strong_db - 0.97).abs() < 0.1, "{too_strong_db}");
}

/// Bodies are curved within the spot; plates and blocks are not, and the showcase has sixteen rays.
#[test]
fn the_scenes_that_come_with_the_program_warn_where_their_single_rays_meet_bodies() {
    let folder = tempfile::tempdir().unwrap();
    for (name, expected) in [
        ("bench.toml", vec!["mannequin-paint"]),
        ("concealed.toml", vec!["mannequin-paint"]),
        ("human.toml", vec!["human-skin-300-ghz", "aluminium"]),
        ("mannequin.toml", vec!["mannequin-paint"]),
        ("showcase.toml", vec![]),
    ] {
        let (said, listed) = rendered(folder.path(), &scene(name));
        let materials: Vec<&str> =
            listed.iter().map(|one| one["material"].as_str().unwrap()).collect();
        assert_eq!(materials, expected, "{name}");
        assert_eq!(said.len(), expected.len(), "{name}: {said:?}");
        assert!(listed.iter().all(|one| one["model"] == "one ray per spot"), "{listed:?}");
    }
}

#[test]
fn show_and_fit_say_it_of_a_model() {
    let folder = tempfile::tempdir().unwrap();
    let law =
        r#"model = "kirchhoff", rms_height_m = 5e-5, correlation_length_m = 5e-4, eps_real = 3"#;
    fs::write(folder.path().join("sheet.toml"), sheet(law, "")).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "sheet.toml"]).assert().success();
    let shown = matdb(folder.path()).args(["show", "sheet"]).output().unwrap().stdout;
    let shown = String::from_utf8(shown).unwrap();
    let words = "outside of its derivation: kirchhoff holds for k·l of at least 6, here it is 3.14";
    assert_eq!(shown.matches(words).count(), 1, "{shown}");

    let fit = ["fit", "cotton", "--model", "kirchhoff", "--fix", "correlation_length_m=5e-4"];
    let fitted = matdb(folder.path()).args(fit).output().unwrap();
    let said = String::from_utf8(fitted.stderr).unwrap();
    assert!(said.contains("kirchhoff holds for k·l of at least 6, here it is 3.14"), "{said}");
}
