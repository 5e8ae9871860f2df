//! Promise: `matdb calibrate` finds the loss of a radar and the width of its beam from the cloud of a plate, a sphere
//! or a corner, and refuses in one sentence a cloud that does not show it.

use std::f64::consts::{LN_2, PI};
use std::fmt::Write;
use std::fs;
use std::path::Path;

use crate::support::{self, matdb, refused};
use matdb::brdf::Fresnel;
use matdb::radar::{Chirps, Radar};
use serde_json::Value;

/// The loss with which clouds are rendered, dB; scenes to calibrate have the preset's 12.5.
const LOSS_DB: f64 = 14.2;

/// A raster of chirps in the middle of the field of view.
fn raster(chirps: usize, side_m: f64) -> String {
    format!(
        "[radar.scan]\npattern = \"raster\"\nlines = {chirps}\nchirps_per_line = {chirps}\n\
         width_m = {side_m}\nheight_m = {side_m}\n"
    )
}

/// A scene of one mesh of steel, with more text in front.
fn scene(more: &str, mesh: &str) -> String {
    format!(
        "{more}\n[[mesh]]\nname = \"target\"\n{mesh}\n[[region]]\nname = \"all\"\nmaterial = \"steel\"\n"
    )
}

/// A folder with `scene.toml`, and the scene rendered with the true loss in `out`.
fn rendered(more: &str, mesh: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let lossy = format!("[radar]\nsystem_loss_db = {LOSS_DB}\n{more}");
    fs::write(folder.path().join("scene.toml"), scene(more, mesh)).unwrap();
    fs::write(folder.path().join("true.toml"), scene(&lossy, mesh)).unwrap();
    matdb(folder.path()).args(["render", "-q", "true.toml", "-o", "out"]).assert().success();
    folder
}

fn calibrated(folder: &Path, cloud: &str, scene: &str) -> Value {
    let run = ["--json", "calibrate", cloud, "--scene", scene];
    let output = matdb(folder).args(run).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Checks loss and spot of a calibration.
fn check(found: &Value, loss_db: f64, spot_ratio: f64) {
    let number = |key: &str| found[key]["value"].as_f64().unwrap();
    assert!((number("system_loss_db") - LOSS_DB).abs() < loss_db, "{found}");
    assert!((number("spot_diameter_m") / 0.016 - 1.0).abs() < spot_ratio, "{found}");
    assert_eq!(found["system_loss_db"]["scene"], 12.5);
    assert_eq!(found["beam_agrees"], true, "{found}");
}

const PLATE: &str = "file = \"builtin:plate\"\nsize_m = [0.6, 0.6, 0]\ntranslation_m = [0, 1.1, 0]";

#[test]
fn a_plate_gives_loss_and_divergence_also_through_noise() {
    // The cosines of equation (11) are worth 3 mdB at the edge of the lobe.
    let (loss_db, beam) = (0.01, 2e-3);
    for more in [raster(60, 0.4), raster(60, 0.4) + "[radar.noise]\n"] {
        let folder = rendered(&more, PLATE);
        let found = calibrated(folder.path(), "out/cloud.ply", "scene.toml");
        check(&found, loss_db, beam);
        assert_eq!(
            (&found["shown"], &found["target"]["kind"]),
            (&"divergence".into(), &"plate".into())
        );
        let sd_db = found["system_loss_db"]["sd"].as_f64().unwrap();
        assert!(sd_db < 0.02, "{found}");
    }
}

#[test]
fn the_text_says_what_was_seen_and_what_follows() {
    let folder = rendered(&raster(60, 0.4), PLATE);
    // The wrong diameter of a spot of 16 mm: the beam is 1.7 times as wide.
    let wrong = format!("[radar]\nspot_diameter_is = \"1/e2\"\n{}", raster(60, 0.4));
    fs::write(folder.path().join("wrong.toml"), scene(&wrong, PLATE)).unwrap();
    let run = ["calibrate", "out/cloud.ply", "--scene", "wrong.toml"];
    let output = matdb(folder.path()).args(run).output().unwrap();
    let (text, notes) =
        (String::from_utf8(output.stdout).unwrap(), String::from_utf8(output.stderr).unwrap());
    assert!(text.starts_with("plate `target` at 8.0"), "{text}");
    assert!(text.contains("system_loss_db   14.2"), "{text}");
    assert!(!text.contains("± 0.000"), "{text}");
    assert!(text.contains("the scene has 16.000 (follows from it)"), "{text}");
    assert!(notes.contains("radar.spot_diameter_m = 0.027"), "{notes}");
}

#[test]
fn effects_that_the_scene_declares_are_named_since_a_calibration_leaves_them_out() {
    let folder = rendered(&raster(60, 0.4), PLATE);
    let run = |scene: &str| {
        let run = ["calibrate", "out/cloud.ply", "--scene", scene];
        let output = matdb(folder.path()).args(run).output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stderr).unwrap()
    };
    let effects = "[[radar.effect]]\nname = \"drift\"\nslope_db = 1\n".to_owned();
    let more = effects + "[[radar.effect]]\nname = \"compression\"\nsaturation_dbm = 30\n";
    fs::write(folder.path().join("effects.toml"), scene(&(raster(60, 0.4) + &more), PLATE))
        .unwrap();
    let said = run("effects.toml");
    assert_eq!(
        said.matches("declares drift and compression, which a calibration leaves out").count(),
        1,
        "{said}"
    );
    assert!(!run("scene.toml").contains("leaves out"));
}

#[test]
fn a_sphere_gives_loss_and_spot() {
    let more = raster(16, 0.06) + "[spot]\nrays = 6000\n";
    let mesh = "file = \"builtin:sphere-cap\"\nscale = 0.2\ntranslation_m = [0.002, 1.1, -0.1]";
    let folder = rendered(&more, mesh);
    let found = calibrated(folder.path(), "out/cloud.ply", "scene.toml");
    // Facets that turn by 2.5 mrad, and a spot of finitely many rays.
    check(&found, 0.25, 0.02);
    assert_eq!(found["shown"], "spot");
}

/// The cloud of a large corner at the origin of the target plane, by hand: P_t − loss + R³ − 4s²/w², w² with its growth
/// off the centre, 1 + ζ² with the range of the apex.
fn corner_cloud(radar: &Radar, apex: [f64; 3]) -> String {
    let chirps = Chirps::draw(radar, |_| Err("no file".to_owned())).unwrap();
    let metal = Fresnel { eps_real: 1.0, eps_imag: 83_884.0, lobe_rad: None };
    let reflected_db = 30.0 * metal.reflectance(0.0).log10();
    let wavelength_m = 299_792_458.0 / 300e9;
    let mut text = "x_m,y_m,z_m,power_dbm,chirp,range_m\n".to_owned();
    for (ray, number) in std::iter::zip(&chirps.rays, &chirps.number) {
        let (o, d) = (ray.origin.xyz.to_array(), ray.direction.xyz().to_array());
        let to_apex: [f64; 3] = std::array::from_fn(|i| apex[i] - o[i]);
        let range_m: f64 = (0..3).map(|i| to_apex[i] * d[i]).sum();
        let aside2: f64 = to_apex.iter().map(|x| x * x).sum::<f64>() - range_m * range_m;
        let aim: [f64; 3] = std::array::from_fn(|i| o[i] + 8.0 * d[i]);
        let off2 = aim[0] * aim[0] + (aim[1] - 1.1).powi(2);
        let waist_m = 0.016 / (2.0 * LN_2).sqrt() * (1.0 + 0.5 * off2 / 0.25);
        let zeta = (range_m - 8.0) * wavelength_m / (PI * waist_m * waist_m);
        let w2 = waist_m * waist_m * (1.0 + zeta * zeta);
        let fall_db = 10.0 * (1.0 + zeta * zeta).log10() + 40.0 / 10f64.ln() * aside2 / w2;
        let power_dbm = 7.0 - LOSS_DB + reflected_db - fall_db;
        if power_dbm >= -77.0 {
            let [x, y, z]: [f64; 3] = std::array::from_fn(|i| o[i] + range_m * d[i]);
            writeln!(text, "{x},{y},{z},{power_dbm},{number},{range_m}").unwrap();
        }
    }
    text
}

#[test]
fn a_corner_gives_loss_and_spot_though_no_rendering_shows_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let cloud = corner_cloud(&Radar::default(), [0.003, 1.098, 0.15]);
    fs::write(at.join("cloud.csv"), cloud).unwrap();
    let text = fs::read_to_string(support::scene("calibration-trihedral.toml")).unwrap();
    fs::write(at.join("corner.toml"), text.replace("1.1, 0.0]", "1.1, 0.15]")).unwrap();
    let found = calibrated(at, "cloud.csv", "corner.toml");
    // A corner with legs of 12 cm is larger than the beam; the scan of the paper sees it with some 15 chirps.
    check(&found, 2e-3, 1e-3);
    let aside_m = found["target"]["off"]["aside_m"].as_f64().unwrap();
    assert!((aside_m - 0.003f64.hypot(0.002)).abs() < 1e-5, "{found}");

    let render = ["render", "builtin:calibration-trihedral", "-o", "out"];
    let output = matdb(at).args(render).output().unwrap();
    let notes = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success() && notes.contains("three surfaces"), "{notes}");
}

#[test]
fn what_does_not_calibrate_is_refused() {
    let folder = rendered(&raster(60, 0.4), PLATE);
    let at = folder.path();
    let write = |name: &str, text: &str| fs::write(at.join(name), text).unwrap();
    let header = "x_m,y_m,z_m,power_dbm\n";
    write("empty.csv", header);
    write("nan.csv", &format!("{header}0,1.1,0,nan\n"));
    write("one.csv", &format!("{header}0,1.1,0,-5\n"));
    write("stretched.toml", &scene("", "file = \"builtin:trihedral\"\nsize_m = [0.1, 0.1, 0.2]"));
    write("elsewhere.toml", &scene(&raster(60, 0.4), &PLATE.replace("1.1, 0]", "1.1, 0.5]")));
    let deaf = format!("[radar]\nthreshold_dbm = 20\n{}", raster(60, 0.4));
    write("deaf.toml", &scene(&deaf, PLATE));
    let rough = scene(&raster(60, 0.4), PLATE).replace("\"steel\"", "\"aluminium\"");
    write("rough.toml", &rough);
    // A diffuse reference in place of the mirror, which a radar sees alike everywhere.
    write("paper.toml", &scene(&raster(60, 0.4), PLATE).replace("\"steel\"", "\"spectralon\""));
    matdb(at).args(["render", "-q", "paper.toml", "-o", "paper"]).assert().success();
    let mannequin = support::scene("mannequin.toml").display().to_string();
    let good = "out/cloud.ply";
    for (cloud, scene, parts) in [
        ("empty.csv", "scene.toml", &["empty.csv", "no points"][..]),
        ("nan.csv", "scene.toml", &["nan.csv", "finite"]),
        (
            "one.csv",
            "scene.toml",
            &["one.csv", "the plate has 1 point within 20 dB", "a calibration needs 8"],
        ),
        ("paper/cloud.ply", "scene.toml", &["paper/cloud.ply", "plate"]),
        (good, "elsewhere.toml", &["mm off the plate", "place"]),
        (good, "deaf.toml", &["threshold of 20 dBm", "radar.threshold_dbm"]),
        (good, "rough.toml", &["`aluminium`", "smooth"]),
        (good, "stretched.toml", &["mesh `target`", "`scale`"]),
        (good, &mannequin, &["calibration target", "builtin:calibration-plate"]),
        (good, "builtin:calibration-plat", &["did you mean `builtin:calibration-plate`?"]),
        (
            good,
            "builtin:calibration-sphere",
            &[good, "which the scan does not have", "the scan of the measurement"],
        ),
    ] {
        let text = refused(matdb(at).args(["calibrate", cloud, "--scene", scene]));
        assert!(parts.iter().all(|part| text.contains(part)), "{scene}: {text}");
    }
    let narrow = ["calibrate", good, "--scene", "scene.toml", "--within", "3"];
    assert!(refused(matdb(at).args(narrow)).contains("--within 3"));
}
