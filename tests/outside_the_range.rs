//! Promise: what is asked of a material outside the range that it claims is answered with the distance
//! stated, never silently: in frequency and in angle, by `render`, `show`, `plot`, `compare`, `diagnose`
//! and `near`.

use std::fs;

use crate::support::{self, matdb, scene};
use serde_json::Value;

const PLATE: &str = "
seed = 7
[radar.scan]
pattern = \"raster\"
lines = 10
chirps_per_line = 10
width_m = 0.2
height_m = 0.2
[[mesh]]
name = \"plate\"
file = \"builtin:plate\"
size_m = [1, 1, 0]
translation_m = [0, 1.1, 0]
[[region]]
name = \"all\"
material = \"ptfe\"
";

/// Standard error and the record of the one material of a scene.
fn rendered(text: &str) -> (String, Value) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), text).unwrap();
    let output = matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).output().unwrap();
    assert!(output.status.success());
    let record = fs::read(folder.path().join("out/scan.json")).unwrap();
    let record: Value = serde_json::from_slice(&record).unwrap();
    (String::from_utf8(output.stderr).unwrap(), record["materials"][0].clone())
}

#[test]
fn a_radar_outside_the_frequencies_is_told_how_far() {
    let (said, record) = rendered(PLATE);
    let words = "`ptfe` is described for 90–270 GHz, the radar works at 300 GHz, 30 GHz away";
    assert!(said.contains(words), "{said}");
    assert_eq!(record["frequency_outside_ghz"], 30.0);
    let (said, record) = rendered(&PLATE.replace("ptfe", "polystyrene"));
    assert!(said.contains("described for 140 GHz,") && said.contains("160 GHz away"), "{said}");
    assert_eq!(record["frequency_outside_ghz"], 160.0);
    let (said, record) = rendered(&PLATE.replace("ptfe", "glass"));
    assert!(!said.contains("GHz"), "{said}");
    assert_eq!(record["frequency_outside_ghz"], 0.0);
}

#[test]
fn detections_outside_the_angles_are_counted_and_the_farthest_is_stated() {
    let turned = PLATE.replace("ptfe", "cotton");
    let (_, record) = rendered(&turned);
    assert_eq!(
        (&record["detections_outside_theta"], &record["theta_outside_deg"]),
        (&0.into(), &0.0.into())
    );
    let folder = tempfile::tempdir().unwrap();
    let narrow = fs::read_to_string(support::root().join("materials/glass/material.toml")).unwrap();
    let narrow = narrow.replace("theta_deg = [0, 80]", "theta_deg = [0, 0.1]");
    fs::write(folder.path().join("material.toml"), narrow).unwrap();
    fs::write(folder.path().join("scene.toml"), PLATE.replace("ptfe", "glass")).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "material.toml"]).assert().success();
    let output = matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    let record = fs::read(folder.path().join("out/scan.json")).unwrap();
    let record: Value = serde_json::from_slice(&record).unwrap();
    let material = &record["materials"][0];
    let farthest_deg = material["theta_outside_deg"].as_f64().unwrap();
    assert!(material["detections_outside_theta"].as_u64() > Some(0), "{material}");
    // The scan reaches 0.1 m to each side at 8 m: 1° at most from the plate's normal, and a little.
    assert!(farthest_deg > 0.1 && farthest_deg < 3.0, "{farthest_deg}");
    let words =
        format!("lie outside the 0–0.1° for which it is described, by up to {farthest_deg:.1}°");
    assert!(said.contains(&words), "{said}");
}

#[test]
fn show_and_plot_tell_what_is_claimed_from_what_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let output = matdb(folder.path()).args(["show", "ptfe"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("90–270 GHz, 0–80°") && !text.contains("outside the range"), "{text}");
    let output = matdb(folder.path()).args(["show", "cotton"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(
        text.contains("15° outside the range") && text.matches("outside").count() == 1,
        "{text}"
    );
    let lines = || {
        matdb(folder.path()).args(["plot", "glass", "-o", "plot.svg"]).assert().success();
        fs::read_to_string(folder.path().join("plot.svg")).unwrap().matches("<polyline").count()
    };
    let claimed_to_80 = lines();
    let glass = fs::read_to_string(support::root().join("materials/glass/material.toml")).unwrap();
    let wide = glass.replace("theta_deg = [0, 80]", "theta_deg = [0, 90]");
    fs::write(folder.path().join("material.toml"), wide).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "material.toml"]).assert().success();
    assert!(claimed_to_80 > lines(), "what is not claimed is drawn in dashes");
}

#[test]
fn comparing_and_diagnosing_tell_how_far_a_material_is_from_the_radars_frequency() {
    const AWAY: &str =
        "`ptfe` is described for 90–270 GHz, the radar works at 300 GHz, 30 GHz away";
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), PLATE).unwrap();
    matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).assert().success();
    for command in ["compare", "diagnose"] {
        let arguments = [command, "out/cloud.ply", "--scene", "scene.toml", "-o", command];
        let output = matdb(folder.path()).args(arguments).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.contains(AWAY), "{command}: {said}");
    }
    let record = fs::read(folder.path().join("compare/error.json")).unwrap();
    let record: Value = serde_json::from_slice(&record).unwrap();
    assert!(record["notices"].to_string().contains("30 GHz away"), "{record}");
}

#[test]
fn the_nearest_materials_say_how_far_they_are_from_the_curves_frequency() {
    let folder = tempfile::tempdir().unwrap();
    let curve = "theta_deg,sigma0_db\n2,-1\n6,-9\n10,-18\n14,-20\n";
    fs::write(folder.path().join("curve.csv"), curve).unwrap();
    let near = |more: &[&str]| {
        let mut command = matdb(folder.path());
        let command = command.args(["near", "--curve", "curve.csv", "--limit", "40"]).args(more);
        String::from_utf8(command.output().unwrap().stdout).unwrap()
    };
    let said = near(&[]);
    assert!(
        said.contains("the frequency of the curve is not stated") && !said.contains("GHz outside"),
        "{said}"
    );
    let said = near(&["--measured-at", "300"]);
    let ptfe = said.lines().find(|line| line.starts_with("ptfe ")).unwrap();
    assert!(ptfe.contains("90–270") && ptfe.contains("30 GHz outside its range"), "{ptfe}");
    let record: Value = serde_json::from_str(&near(&["--measured-at", "300", "--json"])).unwrap();
    let materials = record["materials"].as_array().unwrap();
    let ptfe = materials.iter().find(|near| near["slug"] == "ptfe").unwrap();
    assert_eq!(ptfe["frequency_outside_ghz"], 30.0);
    assert_eq!(record["measured_at_ghz"], 300.0);
}

#[test]
fn the_scenes_that_come_with_the_program_still_run() {
    let folder = tempfile::tempdir().unwrap();
    let scene = scene("human.toml");
    let arguments = ["render", scene.to_str().unwrap(), "-o", "out"];
    let output = matdb(folder.path()).args(arguments).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    assert!(!said.contains("GHz away"), "{said}");
    let (said, _) = rendered(&PLATE.replace("ptfe", "human-skin"));
    assert!(
        said.contains("`human-skin` is described for 100 GHz") && said.contains("200 GHz away")
    );
}

#[test]
fn a_withdrawn_material_is_rendered_with_its_reason() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), PLATE.replace("ptfe", "glass")).unwrap();
    let rendered = || {
        let arguments = ["render", "scene.toml", "-o", "out"];
        let output = matdb(folder.path()).args(arguments).output().unwrap();
        let record = fs::read(folder.path().join("out/scan.json")).unwrap();
        let record: Value = serde_json::from_slice(&record).unwrap();
        let status = record["materials"][0]["status"].clone();
        (String::from_utf8(output.stderr).unwrap(), status)
    };
    let (said, status) = rendered();
    assert!(!said.contains("withdrawn") && status.is_null(), "{said}");
    matdb(folder.path()).args(["add", "-q", "glass"]).assert().success();
    matdb(folder.path()).args(["withdraw", "glass", "--reason", "Dented."]).assert().success();
    let (said, status) = rendered();
    assert!(said.contains("`glass` is withdrawn: Dented."), "{said}");
    assert_eq!((&status["is"], &status["reason"]), (&"withdrawn".into(), &"Dented.".into()));
}

#[test]
fn a_rendered_curve_answers_no_farther_than_its_points_and_says_its_thresholds() {
    let folder = tempfile::tempdir().unwrap();
    let output = matdb(folder.path()).args(["add", "--template"]).output().unwrap();
    fs::write(folder.path().join("material.toml"), output.stdout).unwrap();
    let csv = "theta_deg,sigma0_db,censor,threshold_db\n5,5.0,none,-32.9\n20,-19.5,none,-32.9\n\
               60,,left,-32.9\n";
    fs::write(folder.path().join("scan.csv"), csv).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "."]).assert().success();
    let output = matdb(folder.path()).args(["show", "my-paint"]).output().unwrap();
    let text = String::from_utf8(output.stdout).unwrap();
    let line = |angle: &str| {
        let mut lines = text.lines().map(str::trim_start);
        lines.rfind(|line| line.starts_with(angle)).unwrap().to_owned()
    };
    for (angle, level, outside) in [
        ("0°", "5.0", "5° outside"),
        ("10°", "", ""),
        ("45°", "-19.5", "15° outside"),
        ("60°", "< -32.9", ""),
        ("75°", "nothing", "15° outside"),
    ] {
        let line = line(angle);
        assert!(line.contains(level) && line.contains(outside), "{line}");
        assert_eq!(line.contains("outside"), !outside.is_empty(), "{line}");
    }
    matdb(folder.path()).args(["publish", "site", "-q"]).assert().success();
    let page = fs::read_to_string(folder.path().join("site/material/my-paint.html")).unwrap();
    let levels = page.split("Levels of ").nth(1).unwrap().split("</table>").next().unwrap();
    let row = levels.split("<tbody>").nth(1).unwrap();
    let cells: Vec<&str> =
        row.split("<td>").skip(1).map(|c| c.split('<').next().unwrap()).collect();
    assert_eq!(
        (cells.len(), cells[0], cells[6], cells[8]),
        (9, "not claimed", "not claimed", "not claimed")
    );
    assert_eq!(cells[7], "&lt; −32.9");
    let compared = fs::read_to_string(folder.path().join("site/data/my-paint.js")).unwrap();
    assert!(
        compared.contains("\"\\u003c −32.9\"") && compared.contains("\"not claimed\""),
        "{compared}"
    );
    let near = |angles: [u32; 4]| {
        let rows: String = angles.iter().map(|angle| format!("{angle},-12\n")).collect();
        fs::write(folder.path().join("curve.csv"), format!("theta_deg,sigma0_db\n{rows}")).unwrap();
        let near = ["near", "--curve", "curve.csv", "--limit", "99"];
        let output = matdb(folder.path()).args(near).output().unwrap();
        String::from_utf8(output.stdout).unwrap().contains("my-paint")
    };
    assert!(
        near([8, 10, 12, 14]) && !near([62, 64, 66, 68]),
        "within the claim, beyond the points"
    );
}
