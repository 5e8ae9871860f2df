//! Promise: a measured cloud becomes a material that renders like it: registered from a wrong pose,
//! reduced to a curve, fitted, stored, rendered and compared. Clouds that cannot be used give one
//! sentence and no number.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use crate::support::{entries, matdb, read_cloud, refused};
use serde_json::Value;

/// The painted mannequin alone, with speckle, noise and a range error; `paint` is what it is made of.
const SCENE: &str = "
seed = 11
[radar.speckle]
looks = 4
form = \"independent\"
[radar.noise]
level_dbm = -100
range_sd_m = 0.002
[[mesh]]
name = \"body\"
file = \"builtin:mannequin\"
[[region]]
name = \"body\"
material = \"mannequin-paint\"
";

/// A folder with a scene as measured, the same without speckle and noise, and the measured cloud.
fn measured() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let plain = &SCENE[SCENE.find("[[mesh]]").unwrap()..];
    fs::write(folder.path().join("measured.toml"), SCENE).unwrap();
    fs::write(folder.path().join("scene.toml"), plain).unwrap();
    matdb(folder.path()).args(["render", "-q", "measured.toml", "-o", "out"]).assert().success();
    folder
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = matdb(folder).arg("--json").args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// A fifth of a noise of 2 mm, over thousands of points, at three standard deviations.
const POSE_M: f64 = 5e-4;
const POSE_RAD: f64 = 9e-4;

#[test]
fn a_cloud_becomes_a_material_that_renders_like_it() {
    let folder = measured();
    let at = folder.path();
    matdb(at).args(["add", "-q", "mannequin-paint"]).assert().success();
    let rough = "--pose=0.02,0.01,-0.015,0.8,1,-0.8";
    let pose = json(
        at,
        &[
            "measure",
            "out/cloud.ply",
            "--scene",
            "scene.toml",
            rough,
            "--exact-mesh",
            "--save",
            "mannequin-paint",
            "--kind",
            "synthetic",
            "--source",
            "made by a test",
            "--date",
            "2026-03-14",
            "-o",
            "measured",
        ],
    );
    assert_eq!(entries(&at.join("measured")), ["curve.csv", "curve.svg", "pose.json"]);
    let curve = fs::read_to_string(at.join("measured/curve.csv")).unwrap();
    let cloud = read_cloud(&at.join("out/cloud.ply"));
    let places: BTreeMap<u32, [f64; 2]> = (0..cloud["chirp"].len())
        .map(|i| (cloud["chirp"][i] as u32, ["xt_m", "yt_m"].map(|axis| cloud[axis][i])))
        .collect();
    let mut compared = 0;
    for line in curve.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let Some([xt_m, yt_m]) = places.get(&cells[5].parse().unwrap()) else { continue };
        let said = [cells[7], cells[8]].map(|cell| cell.parse::<f64>().unwrap());
        assert!((said[0] - xt_m).abs() < 1e-4 && (said[1] - yt_m).abs() < 1e-4, "{line}");
        compared += 1;
    }
    assert!(compared > 1000, "{compared}");
    let session = &json(at, &["show", "mannequin-paint"])["material"]["sessions"][0];
    assert_eq!(session["date"], "2026-03-14");
    assert_eq!(session["pose"]["translation_m"], pose["pose"]["translation_m"]);
    assert_eq!(session["registration_rms_m"], pose["rms_m"]);
    let cloud_hash = blake3::hash(&fs::read(at.join("out/cloud.ply")).unwrap()).to_hex();
    assert_eq!(session["cloud_hash"], cloud_hash.as_str());
    // The mesh stood where the scene has it: at the points the pose moves nothing.
    let about = &pose["covariance"]["about_m"];
    for row in 0..3 {
        let turned: f64 = (0..3)
            .map(|c| number(&pose["pose"]["rotation_rows"][row][c]) * number(&about[c]))
            .sum();
        let shift_m = turned + number(&pose["pose"]["translation_m"][row]) - number(&about[row]);
        assert!(shift_m.abs() < POSE_M, "{row}: {shift_m}");
        let diagonal = number(&pose["pose"]["rotation_rows"][row][row]);
        assert!(diagonal.acos().abs() < POSE_RAD, "{diagonal}");
    }
    assert_eq!(pose["converged"], true);

    let fit = json(at, &["fit", "mannequin-paint", "--noise-dbm", "-100", "--save"]);
    assert_eq!(fit["converged"], true);
    // A right law does as well on squares of the target that it has not seen.
    let held = &fit["held_out"];
    assert_eq!(held["folds"], 5);
    assert!(number(&held["block_m"]) > 0.01 && number(&held["blocks"]) > 20.0, "{held}");
    let (seen, unseen) = (number(&fit["goodness"]["rms_db"]), number(&held["rms_db"]));
    assert!((unseen / seen - 1.0).abs() < 0.02, "{seen} {unseen}");
    let rows = number(&fit["goodness"]["rows"]);
    let off = number(&held["score"]) - number(&fit["objective"]) / rows;
    assert!(off < 0.0 && -off < number(&held["score_sd"]), "{held} {off}");
    let truth = json(at, &["show", "mannequin-paint@1"]);
    let model = &truth["material"]["fits"][0]["model"];
    let k = number(&model["k"]);
    let parameter = |part: &str, name: &str| number(&model[part][name]);
    // The paint's lobe is that of radar and surface together, of which the fit takes the beam.
    let beam_rad = number(&pose["curve"]["beam_rad"]);
    let own_m = (parameter("specular", "m").powi(2) - beam_rad.powi(2)).sqrt();
    let (f_lambda, r_s) = (parameter("specular", "f_lambda"), parameter("diffuse", "r_s"));
    for (name, expected) in [
        ("specular.m", own_m),
        ("diffuse.alpha", parameter("diffuse", "alpha")),
        ("S", (1.0 - k) * f_lambda),
        ("R", k * r_s),
        ("looks", 4.0),
    ] {
        let estimates = fit["estimates"].as_array().unwrap();
        let estimate = estimates.iter().find(|e| e["name"] == name).unwrap();
        // Four standard deviations: five numbers, one seed.
        let (value, sd) = (number(&estimate["value"]), number(&estimate["sd"]));
        assert!((value - expected).abs() < 4.0 * sd, "{name}: {value} ± {sd} is not {expected}");
        assert!(sd < 0.2 * expected, "{name}: ± {sd}");
    }

    // Rendered from the new revision, the scene is as near to the cloud as speckle lets it be.
    let error = |pose: &str| {
        let run = ["compare", "out/cloud.ply", "--scene", "scene.toml", pose, "-o", "compared"];
        json(at, &run)["pixels"].clone()
    };
    let fitted = error("--pose=measured/pose.json");
    assert!(number(&fitted["bias_db"]).abs() < 0.3, "{fitted}");
    assert!(number(&fitted["rmse_db"]) < 1.6, "{fitted}");
    let by = |fit: &str| {
        let run = ["compare", "out/cloud.ply", "--scene", "scene.toml", "--fit", fit, "-o", "by"];
        json(at, &run)["pixels"]["rmse_db"].clone()
    };
    assert!((number(&by("stated")) / number(&fitted["rmse_db"]) - 1.0).abs() < 0.2);
    let run = ["compare", "out/cloud.ply", "--scene", "scene.toml", "--fit", "no-such", "-o", "by"];
    assert!(refused(matdb(at).args(run)).contains("stated, mixture-censored"));
    assert!(number(&error(rough)["rmse_db"]) > 2.0 * number(&fitted["rmse_db"]));
    assert_eq!(entries(&at.join("compared")), ["error.json", "images.png", "line.png", "line.svg"]);
}

/// A CSV of the measured cloud's every `step`-th point, changed by `change(x, y, z, dBm)`.
fn csv(folder: &Path, step: usize, change: impl Fn([f64; 4]) -> String) -> String {
    let cloud = read_cloud(&folder.join("out/cloud.ply"));
    let rows = (0..cloud["x"].len())
        .step_by(step)
        .map(|i| change(["x", "y", "z", "power_dbm"].map(|column| cloud[column][i])));
    let rows: Vec<String> = rows.collect();
    format!("x_m,y_m,z_m,power_dbm\n{}\n", rows.join("\n"))
}

#[test]
fn clouds_that_cannot_be_used() {
    let folder = measured();
    let at = folder.path();
    let as_is = |[x, y, z, p]: [f64; 4]| format!("{x},{y},{z},{p}");
    let watts = |[x, y, z, p]: [f64; 4]| format!("{x},{y},{z},{:e}", 1e-3 * 10f64.powf(p / 10.0));
    let far = |[x, y, z, p]: [f64; 4]| format!("{},{y},{z},{p}", x + 3.0);
    let refuse = |name: &str, text: &str, parts: &[&str]| {
        fs::write(at.join(name), text).unwrap();
        let before = entries(at);
        let run = ["measure", name, "--scene", "scene.toml", "-o", "measured"];
        let message = refused(matdb(at).args(run));
        parts
            .iter()
            .for_each(|part| assert!(message.contains(part), "`{part}` is not in: {message}"));
        assert_eq!(entries(at), before);
    };
    let faint = |[x, y, z, p]: [f64; 4]| format!("{x},{y},{z},{}", p - 30.0);
    let under = |[x, y, z, _]: [f64; 4]| format!("{x},{y},{z},-100000");
    refuse("faint.csv", &csv(at, 1, faint), &["threshold of -77 dBm", "radar.threshold_dbm"]);
    refuse("under.csv", &csv(at, 10, under), &["-100000 dBm", "-300"]);
    let once = csv(at, 1, as_is);
    let twice = format!("{once}{}", once.split_once('\n').unwrap().1);
    refuse("doubled.csv", &twice, &["share a chirp", "one detection per chirp"]);
    refuse("few.csv", &csv(at, 900, as_is), &["11 points", "50"]);
    refuse("watts.csv", &csv(at, 10, watts), &["watts", "unit"]);
    refuse("far.csv", &csv(at, 10, far), &["overlap"]);
    refuse("nan.csv", "x_m,y_m,z_m,power_dbm\n0,1,0,nan\n", &["line 2", "power_dbm"]);
    refuse("empty.csv", "x_m,y_m,z_m,power_dbm\n", &["no points"]);
    refuse(
        "twice.csv",
        "chirp,x_m,y_m,z_m,power_dbm\n3,0,1,0,-60\n3,0,1.1,0,-61\n",
        &["chirp 3", "one detection per chirp"],
    );
    refuse(
        "cloud.tif",
        "",
        &["has the ending of no format of clouds; convert or rename it: .ply, .csv, .xyz"],
    );
    refuse("millimetres.xyz", "0 1100 100 -60\n100 1200 90 -61\n", &["millimetres"]);
    fs::write(at.join("good.csv"), csv(at, 1, as_is)).unwrap();
    for (more, parts) in [
        (&["--region", "bdy"][..], &["no region `bdy`", "body"][..]),
        (&["--pose", "1,2"], &["`1,2` is not a pose"]),
        (&["--edge-margin", "7"], &["--edge-margin 7"]),
        (
            &["--pose", "auto", "--keep-pose"],
            &["--keep-pose has no pose to keep", "leave out --pose auto"],
        ),
        (&["--save", "no-such", "--kind", "measured", "--source", "x"], &["no-such"]),
        (
            &["--save", "ptfe", "--kind", "measured", "--source", "x"],
            &["--licence CC-BY-4.0", "--instrument", "--frequency 300", "--threshold -77"],
        ),
        (&["--save", "ptfe@1", "--kind", "measured", "--source", "x"], &["`ptfe@1`", "bare name"]),
    ] {
        let run = ["measure", "good.csv", "--scene", "scene.toml", "-o", "measured"];
        let message = refused(matdb(at).args(run).args(more));
        parts
            .iter()
            .for_each(|part| assert!(message.contains(part), "`{part}` is not in: {message}"));
    }
    for line in ["x=1", "bogus=3,y=1.1", "width=abc,y=1.1", "y=1,y=2", "width=0.02"] {
        let run = ["compare", "good.csv", "--scene", "scene.toml", "-o", "c", "--line", line];
        assert!(refused(matdb(at).args(run)).contains("--line y=1.1,width=0.02"), "{line}");
    }
    // A cloud without chirp numbers and without ranges is enough.
    let run = ["measure", "good.csv", "--scene", "scene.toml", "-q", "-o", "measured"];
    matdb(at).args(run).assert().success();
}
