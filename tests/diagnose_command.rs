//! Promise: `matdb diagnose` leaves a whole report, or says in files and in one sentence that it cannot
//! tell; its table gives the errors that it states, and no name in a scene becomes part of its page.

use std::fs;
use std::path::Path;

use crate::support::{entries, matdb, read_cloud, refused};
use matdb::diagnose::curve::terms;
use matdb::effects::{EffectParameter, library};
use serde_json::{Value, json};

/// A sphere and a plate under few chirps with speckle.
const SCENE: &str = "
name = \"<script>alert(1)</script> & \\\"x\\\"\"
seed = 3
[radar]
threshold_dbm = -90.0
[radar.speckle]
looks = 4
form = \"independent\"
[radar.noise]
level_dbm = -110
range_sd_m = 0.002
[radar.scan]
pattern = \"elliptical\"
chirps = 3000
[[mesh]]
name = \"sphere\"
file = \"builtin:sphere\"
size_m = [0.5, 0.5, 0.5]
translation_m = [0.0, 1.25, 0.0]
[[mesh]]
name = \"plate\"
file = \"builtin:cuboid\"
size_m = [0.45, 0.4, 0.01]
rotation_deg = [-15, 10, 0]
translation_m = [0.0, 0.83, 0.0]
[[region]]
name = \"<b>skin</b>\"
material = \"mannequin-paint\"
";

const FILES: [&str; 18] = [
    "after.toml",
    "error.png",
    "error.svg",
    "material-mannequin-paint.toml",
    "quantile-map.png",
    "quantile-map.svg",
    "quantiles.png",
    "quantiles.svg",
    "ranking.png",
    "ranking.svg",
    "report.html",
    "report.json",
    "residual-map.png",
    "residual-map.svg",
    "residual-trends.png",
    "residual-trends.svg",
    "residuals.csv",
    "view.html",
];

/// A folder with the scene and a cloud that was rendered from it with so many looks of speckle.
fn rendered(looks: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let measured = SCENE.replace("looks = 4", &format!("looks = {looks}"));
    fs::write(folder.path().join("measured.toml"), measured).unwrap();
    fs::write(folder.path().join("scene.toml"), SCENE).unwrap();
    matdb(folder.path()).args(["render", "-q", "measured.toml", "-o", "out"]).assert().success();
    folder
}

const DIAGNOSE: [&str; 8] = [
    "diagnose",
    "out/cloud.ply",
    "--scene",
    "scene.toml",
    "--effects",
    "fov-gain,speckle",
    "-o",
    "report",
];

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// Columns of a table by name.
fn column(csv: &str, name: &str) -> Vec<Option<f64>> {
    let mut lines = csv.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let place = lines.next().unwrap().iter().position(|cell| *cell == name).unwrap();
    lines.map(|line| (!line[place].is_empty()).then(|| line[place].parse().unwrap())).collect()
}

/// The table rounds powers to 0.0001 dB.
const ROUNDING_DB: f64 = 2e-4;

/// The law's form is not the one that the scene states, and the residuals have to show it.
#[test]
fn speckle_that_neighbours_share_is_no_effect() {
    let folder = tempfile::tempdir().unwrap();
    let shared =
        SCENE.replace("\"independent\"", "\"law\"").replace("chirps = 3000", "chirps = 9000");
    let stated = shared.replace("\"law\"", "\"independent\"");
    fs::write(folder.path().join("measured.toml"), shared).unwrap();
    fs::write(folder.path().join("scene.toml"), stated).unwrap();
    matdb(folder.path()).args(["render", "-q", "measured.toml", "-o", "out"]).assert().success();
    let effects = ["--effects", "foreign-patch,fov-gain,drift,subsurface"];
    let report = diagnosed(folder.path(), "out/cloud.ply", "scene.toml", &effects);
    assert_eq!(report["verdict"], "no-missing-effect", "{}", report["effects"]);
    let rows =
        fs::read_to_string(folder.path().join("answer/residuals.csv")).unwrap().lines().count();
    let share = report["independent_chirps"].as_f64().unwrap() / rows as f64;
    assert!((0.05..0.5).contains(&share), "{share}");
}

/// Several rays in a spot and second-order paths, as the scene tells the renderer to follow them.
#[test]
fn what_the_renderer_follows_is_no_effect() {
    let corner = SCENE.replace("rotation_deg = [-15, 10, 0]", "rotation_deg = [-80, 0, 0]");
    let several = SCENE.replace("[radar]\n", "[spot]\nrays = 16\n[radar]\n");
    let bounce = corner.replace("[radar]\n", "[bounce]\nrays = 32\n[radar]\n");
    for (scene, follows, effects) in [
        (&several, "finite-spot", "foreign-patch,subsurface,finite-spot"),
        (&bounce, "multi-bounce", "foreign-patch,subsurface,multi-bounce"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        fs::write(at.join("scene.toml"), scene).unwrap();
        matdb(at).args(["render", "-q", "scene.toml", "-o", "out"]).assert().success();
        let report = diagnosed(at, "out/cloud.ply", "scene.toml", &["--effects", effects]);
        assert_eq!(report["verdict"], "no-missing-effect", "{follows}: {}", report["effects"]);
        let is_left_out = |one: &Value| one["name"] == follows && one["reason"] == "declared";
        assert!(report["not_tried"].as_array().unwrap().iter().any(is_left_out), "{follows}");
    }
    // Without the paths that were followed the model lacks something.
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("several.toml"), &several).unwrap();
    fs::write(at.join("scene.toml"), format!("{SCENE}{LEFT}")).unwrap();
    matdb(at).args(["render", "-q", "several.toml", "-o", "out"]).assert().success();
    let arguments = ["diagnose", "out/cloud.ply", "--scene", "scene.toml", "-o", "answer"];
    let answer = matdb(at).args(arguments).args(["--effects", "finite-spot,subsurface"]).assert();
    let answer = answer.success();
    let report = json(&at.join("answer/report.json"));
    assert_eq!(report["effects"][0]["name"], "finite-spot", "{report}");
    // It has no meaning at another antenna, without which the scene after can be rendered.
    let said = String::from_utf8_lossy(&answer.get_output().stderr);
    assert!(said.contains("has no [[receiver]]: nothing says what finite-spot does"), "{said}");
    matdb(at).args(["add", "--from", "answer/material-mannequin-paint.toml"]).assert().success();
    matdb(at).args(["render", "-q", "answer/after.toml", "-o", "after"]).assert().success();
}

/// Diagnoses a cloud of the folder without controls, which change no answer, and gives the report.
fn diagnosed(at: &Path, cloud: &str, scene: &str, flags: &[&str]) -> Value {
    let arguments = ["diagnose", "-q", cloud, "--scene", scene, "--no-controls", "-o", "answer"];
    matdb(at).args(arguments).args(flags).assert().success();
    json(&at.join("answer/report.json"))
}

/// Writes a scene and renders it into a folder of its name.
fn render(at: &Path, name: &str, scene: &str) {
    fs::write(at.join(format!("{name}.toml")), scene).unwrap();
    matdb(at).args(["render", "-q", &format!("{name}.toml"), "-o", name]).assert().success();
}

/// A drift of 2 dB, and a check that it was found.
const DRIFT: &str = "[[radar.effect]]\nname = \"drift\"\nslope_db = 2.0\n";

fn assert_drift(report: &Value) {
    let effects = report["effects"].as_array().unwrap();
    assert_eq!(effects.len(), 1, "{effects:?}");
    assert_eq!(effects[0]["name"], "drift", "{effects:?}");
    let slope = &effects[0]["parameters"]["slope_db"];
    assert!((number(&slope["value"]) - 2.0).abs() < 3.0 * number(&slope["sd"]), "{slope}");
}

/// An antenna apart from the radar's.
const LEFT: &str = "[[receiver]]\nname = \"left\"\nposition_m = [-3.0, 1.3, 5.0]\n";

/// An antenna apart from the radar's sees f(i, o) where the target does not stand between.
#[test]
fn the_cloud_of_another_antenna_has_its_own_prediction() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scene = format!("{SCENE}{LEFT}");
    render(at, "scene", &scene);
    render(at, "drift", &format!("{scene}{DRIFT}"));
    let of_left = ["--receiver", "left", "--effects", "fov-gain,drift,pose"];
    let complete = diagnosed(at, "scene/cloud-left.ply", "scene.toml", &of_left);
    assert_eq!(complete["verdict"], "no-missing-effect", "{}", complete["effects"]);
    assert_drift(&diagnosed(at, "drift/cloud-left.ply", "scene.toml", &of_left));
    // What was found can be rendered, at the same antenna.
    matdb(at).args(["add", "--from", "answer/material-mannequin-paint.toml"]).assert().success();
    matdb(at).args(["render", "-q", "answer/after.toml", "-o", "after"]).assert().success();
    // The radar's own cloud is not hindered by the other antenna.
    let own = diagnosed(at, "scene/cloud.ply", "scene.toml", &["--effects", "fov-gain,drift"]);
    assert_eq!(own["verdict"], "no-missing-effect", "{}", own["effects"]);
    let of_left = ["diagnose", "scene/cloud-left.ply", "--scene", "scene.toml", "-o", "x"];
    let of_left = |flags: [&str; 4]| refused(matdb(at).args(of_left).args(flags));
    assert!(of_left(["--receiver", "right", "--seed", "1"]).contains("name one of left"));
    let message = of_left(["--receiver", "left", "--effects", "subsurface"]);
    assert!(message.contains("subsurface") && message.contains("another antenna"), "{message}");
    let two = ["diagnose", "scene/cloud-left.ply", "drift/cloud-left.ply", "--scene", "scene.toml"];
    let message = refused(matdb(at).args(two).args(["--receiver", "left", "-o", "x"]));
    assert!(message.contains("has one cloud, and 2 are given"), "{message}");
}

/// Side lobes that the scene states, and both ways round a pair of surfaces in phase.
#[test]
fn a_bounce_has_the_side_lobes_and_phases_of_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let corner = SCENE.replace("rotation_deg = [-15, 10, 0]", "rotation_deg = [-80, 0, 0]");
    let bounce = "[bounce]\nrays = 32\noutside_spot_db = -10\nin_phase = true\n[radar]\n";
    let scene = corner.replace("[radar]\n", bounce);
    render(at, "scene", &scene);
    render(at, "drift", &format!("{scene}{DRIFT}"));
    let effects = ["--effects", "foreign-patch,drift"];
    let complete = diagnosed(at, "scene/cloud.ply", "scene.toml", &effects);
    assert_eq!(complete["verdict"], "no-missing-effect", "{}", complete["effects"]);
    assert_drift(&diagnosed(at, "drift/cloud.ply", "scene.toml", &effects));
    // The renderer follows these paths on the target where the scene has it.
    let arguments = ["diagnose", "scene/cloud.ply", "--scene", "scene.toml", "-o", "x"];
    let message = refused(matdb(at).args(arguments).args(["--effects", "drift,pose"]));
    assert!(message.contains("pose") && message.contains("remove [bounce]"), "{message}");
}

/// The strongest peak of the spectrum, whose noise and threshold are those of the range receiver.
#[test]
fn a_range_receiver_has_its_own_noise_and_threshold() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let noise = "[radar.noise]\nlevel_dbm = -110\nrange_sd_m = 0.002\n";
    let receiver = "[radar.receiver]\nnoise_figure_db = 45\nfalse_alarm_probability = 1e-4\n\
                    gate_m = [7.0, 9.0]\nzero_padding = 4\n";
    let scene = SCENE.replace(noise, receiver);
    render(at, "scene", &scene);
    render(at, "drift", &format!("{scene}{DRIFT}"));
    let effects = ["--effects", "subsurface,drift"];
    let complete = diagnosed(at, "scene/cloud.ply", "scene.toml", &effects);
    assert_eq!(complete["verdict"], "no-missing-effect", "{}", complete["effects"]);
    assert_drift(&diagnosed(at, "drift/cloud.ply", "scene.toml", &effects));
    let arguments = ["diagnose", "scene/cloud.ply", "--scene", "scene.toml", "-o", "x"];
    let message = refused(matdb(at).args(arguments).args(["--effects", "noise-floor"]));
    assert!(message.contains("noise_figure_db"), "{message}");
}

/// Of wood, a smooth mirror over a diffuse surface, a part of an echo does not speckle.
#[test]
fn a_wave_that_does_not_speckle_is_no_effect() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let many = SCENE.replace("mannequin-paint", "wood");
    let many = many.replace("rotation_deg = [-15, 10, 0]", "rotation_deg = [-3, 2, 0]");
    let few = many.replace("chirps = 3000", "chirps = 1500");
    let effects = ["--effects", "speckle,compression,foreign-patch,drift"];
    for seed in [3, 4, 5] {
        let name = format!("seed-{seed}");
        render(at, &name, &few.replace("seed = 3", &format!("seed = {seed}")));
        let cloud = format!("{name}/cloud.ply");
        let complete = diagnosed(at, &cloud, "seed-3.toml", &effects);
        assert_eq!(complete["verdict"], "no-missing-effect", "{seed}: {}", complete["effects"]);
    }
    fs::write(at.join("many.toml"), &many).unwrap();
    render(at, "drift", &format!("{many}{DRIFT}"));
    assert_drift(&diagnosed(at, "drift/cloud.ply", "many.toml", &effects));
}

/// A sphere and a plate behind a cloth, 4 cm and a few millimetres in front of them.
fn behind_a_cloth(returns: &str) -> String {
    let scene = SCENE.replace("chirps = 3000", "chirps = 1500");
    let scene = scene.replace("[radar]\n", &format!("[radar]\nreturns = \"{returns}\"\n"));
    let scene = scene.replace("material =", "mesh = \"sphere\"\nmaterial =");
    format!(
        "{scene}[[region]]\nname = \"board\"\nmaterial = \"mannequin-paint\"\nmesh = \"plate\"\n\
         [[mesh]]\nname = \"cloth\"\nfile = \"builtin:sphere\"\nsize_m = [0.58, 0.58, 0.58]\n\
         translation_m = [0.0, 1.25, 0.0]\n\
         [[region]]\nname = \"cloth\"\nmaterial = \"cotton\"\nmesh = \"cloth\"\nthickness_m = 0.0005\n"
    )
}

/// Which echo of a chirp is reported follows from `returns`, and the others are no effect.
#[test]
fn what_lies_behind_a_sheet_has_its_own_prediction() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let effects = ["--effects", "foreign-patch,speckle,subsurface,drift"];
    for returns in ["strongest", "first"] {
        let scene = behind_a_cloth(returns);
        render(at, returns, &scene);
        let (cloud, scene_file) = (format!("{returns}/cloud.ply"), format!("{returns}.toml"));
        let complete = diagnosed(at, &cloud, &scene_file, &effects);
        assert_eq!(complete["verdict"], "no-missing-effect", "{returns}: {}", complete["effects"]);
    }
    render(at, "drift", &format!("{}{DRIFT}", behind_a_cloth("strongest")));
    assert_drift(&diagnosed(at, "drift/cloud.ply", "strongest.toml", &effects));
    let arguments = ["diagnose", "drift/cloud.ply", "--scene", "strongest.toml", "-o", "x"];
    let message = refused(matdb(at).args(arguments).args(["--effects", "drift,pose"]));
    assert!(message.contains("pose") && message.contains("let them pass on"), "{message}");
    let several = behind_a_cloth("strongest").replace("[radar]\n", "[spot]\nrays = 16\n[radar]\n");
    fs::write(at.join("several.toml"), several).unwrap();
    let several = ["diagnose", "drift/cloud.ply", "--scene", "several.toml", "-o", "x"];
    let message = refused(matdb(at).args(several));
    assert!(message.contains("spot.rays = 1"), "{message}");
}

/// An echo that spreads over range cells, and paths by way of a second surface, as a range receiver reads them.
#[test]
fn a_range_receiver_reads_spots_and_second_paths() {
    let noise = "[radar.noise]\nlevel_dbm = -110\nrange_sd_m = 0.002\n";
    let receiver = "[radar.receiver]\nnoise_figure_db = 45\nfalse_alarm_probability = 1e-4\n\
                    gate_m = [7.0, 9.0]\nzero_padding = 4\n";
    let read = SCENE.replace(noise, receiver).replace("chirps = 3000", "chirps = 1500");
    let several = read.replace("[radar]\n", "[spot]\nrays = 16\n[radar]\n");
    let corner = read.replace("rotation_deg = [-15, 10, 0]", "rotation_deg = [-80, 0, 0]");
    let bounce = corner.replace("[radar]\n", "[bounce]\nrays = 32\n[radar]\n");
    let effects = ["--effects", "foreign-patch,drift"];
    for scene in [several, bounce] {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        render(at, "scene", &scene);
        render(at, "drift", &format!("{scene}{DRIFT}"));
        let complete = diagnosed(at, "scene/cloud.ply", "scene.toml", &effects);
        assert_eq!(complete["verdict"], "no-missing-effect", "{}", complete["effects"]);
        assert_drift(&diagnosed(at, "drift/cloud.ply", "scene.toml", &effects));
    }
}

/// A radar that was never calibrated: its scene states a loss that is 15 dB wrong, to either side.
#[test]
fn the_level_of_a_radar_is_no_effect() {
    let folder = rendered("4");
    let at = folder.path();
    for (loss_db, level_db) in [(27.5, 15.0), (-2.5, -15.0)] {
        let off = SCENE.replace("[radar]\n", &format!("[radar]\nsystem_loss_db = {loss_db}\n"));
        fs::write(at.join("off.toml"), &off).unwrap();
        let effects = ["--effects", "subsurface,noise-floor,foreign-patch"];
        let report = diagnosed(at, "out/cloud.ply", "off.toml", &effects);
        assert_eq!(report["verdict"], "no-missing-effect", "{}", report["effects"]);
        let found = &report["base"]["level_db"];
        let (value, sd) = (number(&found["value"]), number(&found["sd"]));
        assert!((value - level_db).abs() < 1.96 * sd && sd < 1.5, "{found}");
        let after = fs::read_to_string(at.join("answer/after.toml")).unwrap();
        let after: toml::Table = after.parse().unwrap();
        let loss_db = after["radar"]["system_loss_db"].as_float().unwrap();
        assert!((loss_db - 12.5).abs() < 1.96 * sd, "{loss_db}");
    }
    // A radar that was calibrated has the level that it states.
    let sure = SCENE.replace("[radar]\n", "[radar]\ncalibrated = true\n");
    fs::write(at.join("sure.toml"), sure).unwrap();
    let report = diagnosed(at, "out/cloud.ply", "sure.toml", &["--effects", "subsurface"]);
    assert!(report["base"]["level_db"].is_null());
}

#[test]
fn a_report_is_complete_and_its_table_gives_its_errors() {
    let folder = rendered("1");
    let at = folder.path();
    let output = matdb(at).args(DIAGNOSE).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(entries(&at.join("report")), FILES);
    let report = json(&at.join("report/report.json"));
    assert_eq!(report["schema"], 3);
    // The speckle is of one look, and the scene says four.
    assert_eq!(report["verdict"], "explained", "{report}");
    assert_eq!(report["effects"][0]["name"], "speckle");

    assert_eq!(report["not_tried"].as_array().unwrap().len(), library().len() - 2);
    let stood = json!({
        "mesh": "plate", "rotation_deg": [-15.0, 10.0, 0.0], "translation_m": [0.0, 0.83, 0.0],
    });
    assert_eq!(report["base"]["pose"][1], stood);
    assert!((number(&report["base"]["noise_dbm"]) + 110.0).abs() < 1e-9, "{report}");
    assert_eq!(report["base"]["range_sd_m"], 0.002);
    assert!(report["error"]["with_unknown"].is_null(), "nothing unknown is left: {report}");

    let csv = fs::read_to_string(at.join("report/residuals.csv")).unwrap();
    let observed = column(&csv, "observed_dbm");
    for model in ["before", "after"] {
        let predicted = column(&csv, &format!("{model}_dbm"));
        let squares: Vec<f64> = observed
            .iter()
            .zip(&predicted)
            .filter_map(|(o, p)| Some((o.as_ref()? - p.as_ref()?).powi(2)))
            .collect();
        let rmse_db = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        let stated_db = number(&report["error"][model]["rmse_db"]);
        assert!((rmse_db - stated_db).abs() < ROUNDING_DB, "{model}: {rmse_db} {stated_db}");
    }
    let floor_db = number(&report["error"]["noise_floor_db"]);
    assert!(floor_db > 0.0 && floor_db <= 1.1 * number(&report["error"]["after"]["rmse_db"]));

    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("explained: ") && (5..=12).contains(&text.lines().count()), "{text}");
    for part in ["speckle (instrument): looks = ", " ± ", "noise floor", "wrote report.html"] {
        assert!(text.contains(part), "`{part}` is not in:\n{text}");
    }
    page(&at.join("report/report.html"));

    // What another cloud does not need goes, and what somebody else put there stays.
    fs::write(at.join("report/notes.txt"), "mine").unwrap();
    fs::write(at.join("report/unknown-map.png"), "stale").unwrap();
    matdb(at).args(["render", "-q", "scene.toml", "-o", "out"]).assert().success();
    matdb(at).args(DIAGNOSE).assert().success();
    let mut left = FILES.to_vec();
    left.retain(|name| !name.starts_with("material-"));
    left.insert(left.iter().position(|name| *name > "notes.txt").unwrap(), "notes.txt");
    assert_eq!(entries(&at.join("report")), left);
}

#[test]
fn complete_data_lack_nothing_and_json_is_the_report() {
    let folder = rendered("4");
    let at = folder.path();
    let output = matdb(at).arg("--json").args(DIAGNOSE).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let printed: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(printed, json(&at.join("report/report.json")));
    assert_eq!(printed["verdict"], "no-missing-effect", "{printed}");
    let html = page(&at.join("report/report.html"));
    assert!(html.contains("Nothing is missing") && !html.contains("--add"));
    // Without controls the answer is the same, and they are said to be missing.
    let flags = ["--json", "--no-controls"];
    let output = matdb(at).args(DIAGNOSE).args(flags).output().unwrap();
    let bare: Value = serde_json::from_slice(&output.stdout).unwrap();
    let mut expected = printed;
    let found = expected["controls"]["injection_recovery"].as_array().unwrap().len();
    assert_eq!(found, 2);
    expected["controls"] =
        json!({"placebo": null, "equal_df_spline": null, "injection_recovery": []});
    assert_eq!(bare, expected);
}

/// The page, after checking that it stands alone, is well-formed and nothing in it is a scene's.
fn page(path: &Path) -> String {
    let html = fs::read_to_string(path).unwrap();
    for outside in ["http", "<script", "<link", "@import", "url("] {
        assert!(!html.contains(outside), "{outside}");
    }
    assert!(!html.contains("<b>") && html.contains("&lt;script&gt;alert(1)"));
    assert!(html.contains("&lt;b&gt;skin&lt;&#x2f;b&gt;"));
    balanced(&html);
    html
}

/// Every tag that is opened is closed, in order, and text has no bare sign.
fn balanced(html: &str) {
    const VOID: [&str; 2] = ["meta", "!DOCTYPE"];
    let mut open: Vec<&str> = Vec::new();
    for part in html.split('<').skip(1) {
        let (tag, text) = part.split_once('>').unwrap_or_else(|| panic!("not closed: {part}"));
        assert!(!text.contains('>') || open.last() == Some(&"style"), "a bare sign: {text}");
        let name = tag.trim_start_matches('/').split([' ', '\n', '/']).next().unwrap();
        assert_eq!(tag.matches('"').count() % 2, 0, "quotes: {tag}");
        if VOID.contains(&name) || tag.ends_with('/') {
            continue;
        }
        if tag.starts_with('/') {
            assert_eq!(open.pop(), Some(name), "{tag}")
        } else {
            open.push(name)
        }
    }
    assert!(open.is_empty(), "{open:?}");
}

#[test]
fn too_few_detections_are_said_in_files_and_one_sentence() {
    let folder = rendered("4");
    let at = folder.path();
    let cloud = read_cloud(&at.join("out/cloud.ply"));
    let columns = ["x", "y", "z", "power_dbm", "chirp"];
    let line = |row: usize| columns.map(|name| cloud[name][row].to_string()).join(",") + "\n";
    let csv = "x_m,y_m,z_m,power_dbm,chirp\n".to_owned() + &(0..80).map(line).collect::<String>();
    fs::write(at.join("few.csv"), csv).unwrap();
    // As an earlier diagnosis would have left them.
    fs::create_dir(at.join("report")).unwrap();
    for stale in ["residuals.csv", "ranking.png", "unknown-map.svg", "curve.svg"] {
        fs::write(at.join("report").join(stale), "stale").unwrap();
    }
    fs::write(at.join("report/report.json"), "{\"schema\": 2, \"verdict\": \"explained\"}")
        .unwrap();
    fs::write(at.join("report/after.toml"), "# The scene as `matdb diagnose` leaves it.\n")
        .unwrap();
    let few = ["diagnose", "few.csv", "--scene", "scene.toml", "-o", "report"];
    let message = refused(matdb(at).args(few));
    assert!(message.contains("80 detections") && message.contains("300"), "{message}");
    assert_eq!(entries(&at.join("report")), ["report.html", "report.json"]);
    let report = json(&at.join("report/report.json"));
    assert_eq!(report["schema"], 3);
    assert_eq!(report["verdict"], "cannot-tell");
    assert_eq!(report["effects"].as_array().unwrap().len(), 0);
    for key in ["reason", "would_help"] {
        assert!(report[key].as_str().unwrap().len() > 20, "{report}");
    }
    let html = fs::read_to_string(at.join("report/report.html")).unwrap();
    assert!(html.contains("Cannot tell") && !html.contains("http"));
    balanced(&html);
    let output = matdb(at).arg("--json").args(few).output().unwrap();
    assert!(!output.status.success());
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap(), report);
}

#[test]
fn nothing_detected_and_scenes_that_no_diagnosis_predicts_are_said() {
    let folder = rendered("4");
    let at = folder.path();
    fs::write(at.join("none.csv"), "x_m,y_m,z_m,power_dbm,chirp\n").unwrap();
    let none = ["diagnose", "none.csv", "--scene", "scene.toml", "-o", "report"];
    assert!(refused(matdb(at).args(none)).contains("0 detections"));
    assert_eq!(json(&at.join("report/report.json"))["verdict"], "cannot-tell");
    let scene = fs::read_to_string(at.join("scene.toml")).unwrap();
    let noise = "[radar.noise]\nlevel_dbm = -110\nrange_sd_m = 0.002\n";
    let first = scene.replace("[radar]\n", "[radar]\nreturns = \"first\"\n");
    fs::write(at.join("more.toml"), first.replace(noise, "[radar.receiver]\n")).unwrap();
    let more = ["diagnose", "out/cloud.ply", "--scene", "more.toml", "-o", "more"];
    let message = refused(matdb(at).args(more));
    assert!(message.contains("more.toml") && message.contains("radar.returns"), "{message}");
    assert!(!at.join("more").exists());
    let unknown = ["diagnose", "out/cloud.ply", "--scene", "scene.toml", "-o", "more"];
    let message = refused(matdb(at).args(unknown).args(["--effects", "unknown"]));
    assert!(message.contains("always looked for"), "{message}");
}

#[test]
fn a_cloud_of_another_scene_is_no_answer() {
    let folder = rendered("4");
    let at = folder.path();
    // Without the sphere, the larger part of the cloud has nothing to lie on; and of the sphere there is another.
    let (sphere, _) = SCENE.split_once("[[mesh]]\nname = \"plate\"").unwrap();
    let region = &SCENE[SCENE.find("[[region]]").unwrap()..];
    let aside =
        SCENE.replace("translation_m = [0.0, 1.25, 0.0]", "translation_m = [0.0, 1.25, 0.15]");
    for (name, scene) in [("half.toml", format!("{sphere}{region}")), ("aside.toml", aside)] {
        fs::write(at.join(name), scene).unwrap();
        let asked = ["diagnose", "out/cloud.ply", "--scene", name, "-o", "report"];
        let message = refused(matdb(at).args(asked));
        assert!(message.contains("lie where the scan meets the mesh"), "{name}: {message}");
        let report = json(&at.join("report/report.json"));
        assert_eq!(report["verdict"], "cannot-tell", "{name}");
        assert_eq!(report["effects"], json!([]), "{name}");
    }
}

#[test]
fn a_mesh_that_hardly_covers_the_cloud_is_no_answer() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // All that lies beside the smaller plate is within what a wide spot could see, and none is found.
    let (radar, _) = SCENE.split_once("[[mesh]]").unwrap();
    let region = &SCENE[SCENE.find("[[region]]").unwrap()..];
    for (name, side_m) in [("measured.toml", 0.6), ("small.toml", 0.45)] {
        let plate = format!(
            "[[mesh]]\nname = \"plate\"\nfile = \"builtin:plate\"\nsize_m = [{side_m}, {side_m}, 0]\n\
             translation_m = [0, 1.1, 0]\n"
        );
        fs::write(at.join(name), format!("{radar}{plate}{region}")).unwrap();
    }
    matdb(at).args(["render", "-q", "measured.toml", "-o", "out"]).assert().success();
    let asked = ["diagnose", "out/cloud.ply", "--scene", "small.toml", "-o", "report"];
    let message = refused(matdb(at).args(asked).args(["--effects", "fov-gain,speckle"]));
    assert!(message.contains("lie where the scan meets the mesh"), "{message}");
    assert_eq!(json(&at.join("report/report.json"))["verdict"], "cannot-tell");
}

#[test]
fn nothing_that_is_read_is_written_over() {
    let folder = rendered("4");
    let at = folder.path();
    fs::copy(at.join("out/cloud.ply"), at.join("residuals.csv")).unwrap();
    let cloud = ["diagnose", "residuals.csv", "--scene", "scene.toml", "-o", "."];
    assert!(refused(matdb(at).args(cloud)).contains("which is read"));
    let curve = ["diagnose", "--curve", "residuals.csv", "-o", "."];
    assert!(refused(matdb(at).args(curve)).contains("which is read"));
    fs::write(at.join("out/after.toml"), "name = \"mine\"\n").unwrap();
    let own = ["diagnose", "out/cloud.ply", "--scene", "scene.toml", "-o", "out"];
    assert!(refused(matdb(at).args(own)).contains("no diagnosis wrote it"));
    assert!(!at.join("report.json").exists() && !at.join("out/report.json").exists());
}

#[test]
fn the_library_is_listed_and_every_entry_is_complete() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = matdb(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{arguments:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let list = run(&["effects"]);
    let records: Value = serde_json::from_str(&run(&["effects", "--json"])).unwrap();
    let records = records.as_array().unwrap();
    assert!(list.lines().all(|line| line.chars().count() <= 100), "{list}");
    let (of_clouds, of_curves) = list.split_once("Of a curve").unwrap();
    let check = |list: &str,
                 record: &Value,
                 of: &str,
                 name: &str,
                 says: [&str; 2],
                 parameters: &[EffectParameter]| {
        assert!(list.lines().any(|line| line.starts_with(&format!("{name} "))), "{name}");
        let entry = run(&["effects", name]);
        assert!(says.iter().all(|text| entry.contains(text)), "{entry}");
        for parameter in parameters {
            assert!(entry.contains(parameter.name), "{name}: {}", parameter.name);
        }
        assert_eq!((&record["name"], &record["applies_to"]), (&name.into(), &json!([of])));
        assert_eq!(record["parameters"].as_array().unwrap().len(), parameters.len());
    };
    let mut rest = records.iter();
    for (effect, record) in library().iter().zip(rest.by_ref()) {
        let says = [effect.description(), effect.signature()];
        check(of_clouds, record, "cloud", effect.name(), says, effect.parameters());
    }
    for (term, record) in terms().iter().zip(rest.by_ref()) {
        let says = [term.description(), term.signature()];
        check(of_curves, record, "curve", term.name(), says, term.parameters());
    }
    let unknown = rest.next().unwrap();
    assert_eq!(unknown["name"], "unknown");
    assert_eq!(unknown["applies_to"], json!(["cloud", "curve"]));
    assert_eq!((rest.next(), unknown["level"].is_null()), (None, true));
    // Both have a film, and it is not the same one.
    let films: Value = serde_json::from_str(&run(&["effects", "thin-film", "--json"])).unwrap();
    assert_eq!(films.as_array().unwrap().len(), 2);
    let message = refused(matdb(folder.path()).args(["effects", "drfit"]));
    assert!(message.contains("did you mean `drift`?"), "{message}");
}

#[test]
fn a_scan_without_times_is_diagnosed_without_what_goes_with_time() {
    let folder = rendered("4");
    let at = folder.path();
    matdb(at).args(["radar", "-q", "scene.toml", "-o", "radar"]).assert().success();
    let rays = fs::read_to_string(at.join("radar/scan.csv")).unwrap();
    let wanted = ["chirp", "ox_m", "oy_m", "oz_m", "dx", "dy", "dz"];
    let header: Vec<&str> = rays.lines().next().unwrap().split(',').collect();
    let places = wanted.map(|name| header.iter().position(|column| *column == name).unwrap());
    let row = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        places.map(|place| cells[place]).join(",") + "\n"
    };
    fs::write(at.join("rays.csv"), rays.lines().map(row).collect::<String>()).unwrap();
    let scan = "pattern = \"rays\"\nfile = \"rays.csv\"\n";
    let untimed = SCENE.replace("pattern = \"elliptical\"\nchirps = 3000\n", scan);
    fs::write(at.join("untimed.toml"), untimed).unwrap();
    let asked = |effects: &str| {
        let mut asked = matdb(at);
        asked.args(["diagnose", "out/cloud.ply", "--scene", "untimed.toml", "-o", "report"]);
        asked.args(["--effects", effects]);
        asked
    };
    let said = refused(&mut asked("drift"));
    assert!(
        said.contains("drift cannot be identified without") && said.contains("time_s"),
        "{said}"
    );
    assert_eq!(json(&at.join("report/report.json"))["verdict"], "cannot-tell");
    asked("fov-gain").assert().success();
    let left_out = || json(&at.join("report/report.json"))["not_tried"].clone();
    let expected = json!({"name": "drift", "reason": "not-asked"});
    assert!(left_out().as_array().unwrap().contains(&expected), "{}", left_out());
    let all = ["diagnose", "out/cloud.ply", "--scene", "untimed.toml", "-o", "report"];
    matdb(at).args(all).arg("--no-controls").assert().success();
    let untimed = ["drift", "motion"].map(|name| json!({"name": name, "reason": "no-times"}));
    let mut found = left_out().as_array().unwrap().clone();
    found.sort_by_key(|one| one["name"].to_string());
    assert_eq!(found, untimed);
    // Without ranges nothing tells where the target is.
    let scene = fs::read_to_string(at.join("scene.toml")).unwrap();
    fs::write(at.join("unranged.toml"), scene.replace("range_sd_m = 0.002", "range_sd_m = 0"))
        .unwrap();
    let mut all =
        ["diagnose", "out/cloud.ply", "--scene", "unranged.toml", "-o", "unranged"].to_vec();
    matdb(at).args(&all).arg("--no-controls").assert().success();
    let left_out = json(&at.join("unranged/report.json"))["not_tried"].clone();
    for name in ["pose", "motion"] {
        let expected = json!({"name": name, "reason": "no-ranges"});
        assert!(left_out.as_array().unwrap().contains(&expected), "{left_out}");
    }
    all.extend(["--effects", "pose"]);
    let said = refused(matdb(at).args(all));
    assert!(said.contains("pose cannot be identified from powers alone"), "{said}");
}

/// A second pose of the target and a second radar, 2 dB stronger than its scene says.
#[test]
fn two_clouds_of_one_target_have_one_answer() {
    let folder = rendered("4");
    let turned = |text: &str| {
        let text =
            text.replace("translation_m = [0.0, 1.25, 0.0]", "translation_m = [0.02, 1.25, 0.0]");
        let text =
            text.replace("translation_m = [0.0, 0.83, 0.0]", "translation_m = [0.02, 0.83, 0.0]");
        text.replace("[radar]\n", "[radar]\ntransmit_power_dbm = 9.0\n")
            .replace("seed = 3", "seed = 4")
    };
    let stronger = turned(SCENE).replace("[radar]\n", "[radar]\nsystem_loss_db = 10.5\n");
    fs::write(folder.path().join("second.toml"), turned(SCENE)).unwrap();
    fs::write(folder.path().join("stronger.toml"), stronger).unwrap();
    let matdb = || matdb(folder.path());
    matdb().args(["render", "-q", "stronger.toml", "-o", "out2"]).assert().success();
    fs::copy(folder.path().join("out/cloud.ply"), folder.path().join("copy.ply")).unwrap();
    let both = [
        "diagnose",
        "out/cloud.ply",
        "out2/cloud.ply",
        "--effects",
        "fov-gain,drift",
        "-o",
        "report",
    ];
    let scenes = ["--scene", "scene.toml", "--scene", "second.toml"];
    matdb().args(both).args(scenes).assert().success();
    let report = json(&folder.path().join("report/report.json"));
    assert_eq!(report["verdict"], "no-missing-effect", "{report:#}");
    assert_eq!(report["clouds"][1]["name"], "out2/cloud.ply");
    let [a_db, b_db] = [0, 1].map(|cloud| number(&report["clouds"][cloud]["level_db"]["value"]));
    assert!((b_db - a_db - 2.0).abs() < 0.4, "{a_db} {b_db}");
    let csv = fs::read_to_string(folder.path().join("report/residuals.csv")).unwrap();
    let clouds = column(&csv, "cloud");
    for cloud in [1.0, 2.0] {
        let rows = clouds.iter().filter(|one| **one == Some(cloud)).count();
        assert_eq!(rows as f64, number(&report["clouds"][cloud as usize - 1]["chirps"]));
    }
    let page = page(&folder.path().join("report/report.html"));
    assert!(page.contains("The clouds") && page.contains("out2&#x2f;cloud.ply"));
    for name in ["after.toml", "after-2.toml"] {
        assert!(folder.path().join("report").join(name).is_file(), "{name}");
    }
    // What cannot be one diagnosis is said before it starts.
    let other = turned(SCENE).replace("mannequin-paint", "ptfe");
    fs::write(folder.path().join("other.toml"), other).unwrap();
    for (arguments, expected) in [
        (
            &[
                "out2/cloud.ply",
                "--scene",
                "scene.toml",
                "--scene",
                "second.toml",
                "--scene",
                "second.toml",
            ][..],
            "3 scenes for 2 clouds",
        ),
        (&["out2/cloud.ply", "--scene", "scene.toml", "--scene", "other.toml"][..], "is of `ptfe`"),
        (&["out/cloud.ply", "--scene", "scene.toml"][..], "is given twice"),
        (&["./out/cloud.ply", "--scene", "scene.toml"][..], "is given twice"),
        (&["copy.ply", "--scene", "scene.toml"][..], "cloud.ply and copy.ply have the same powers"),
    ] {
        let message =
            refused(matdb().args(["diagnose", "out/cloud.ply", "-o", "refused"]).args(arguments));
        assert!(message.contains(expected), "{message}");
    }
    assert!(!folder.path().join("refused").exists());
}
