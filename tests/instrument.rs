//! Promise: what a scene can switch on beyond the paper's single ray does what its law says: speckle,
//! noise, the range receiver, false alarms, other antennas, second surfaces, a grain.

use std::collections::BTreeMap;
use std::fs;

use crate::support::{matdb, read_cloud};
use serde_json::Value;

type Cloud = BTreeMap<String, Vec<f64>>;

/// A chalky plate that fills the field of view; 2000 chirps.
const PLATE: &str = "
seed = 7
[radar.scan]
pattern = \"raster\"
lines = 40
chirps_per_line = 50
width_m = 0.4
height_m = 0.4
[[mesh]]
name = \"plate\"
file = \"builtin:plate\"
size_m = [1, 1, 0]
translation_m = [0, 1.1, 0]
[[region]]
name = \"all\"
material = \"chalk\"
";

const CHALK: &str = "
slug = \"chalk\"
name = \"Chalk for tests\"
class = \"inert\"
description = \"A Lambert law.\"
licence = \"CC0-1.0\"
frequency_ghz = [200, 400]
theta_deg = [0, 90]
render = \"law\"
[[source]]
key = \"here\"
kind = \"synthetic\"
title = \"Made for tests\"
[[fit]]
name = \"law\"
estimator = \"assumed\"
source = \"here\"
scattering = { model = \"lambert\", albedo = 0.5 }
";

/// Renders a scene made of `PLATE` with more text before its meshes; the clouds by file name.
fn render(more: &str) -> (Value, impl Fn(&str) -> Cloud) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("chalk.toml"), CHALK).unwrap();
    fs::write(
        folder.path().join("scene.toml"),
        PLATE.replace("[[mesh]]", &format!("{more}\n[[mesh]]")),
    )
    .unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "chalk.toml"]).assert().success();
    matdb(folder.path()).args(["render", "-q", "scene.toml", "-o", "out"]).assert().success();
    let json = fs::read(folder.path().join("out/scan.json")).unwrap();
    (serde_json::from_slice(&json).unwrap(), move |name| {
        read_cloud(&folder.path().join("out").join(name))
    })
}

/// An empty cloud has no columns here.
fn points(cloud: &Cloud) -> usize {
    cloud.get("x").map_or(0, Vec::len)
}

fn watts(cloud: &Cloud) -> Vec<f64> {
    cloud["power_dbm"].iter().map(|dbm| 10f64.powf(dbm / 10.0)).collect()
}

fn mean_and_contrast(values: &[f64]) -> (f64, f64) {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let variance = values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64;
    (mean, variance.sqrt() / mean)
}

/// Power over that of the exact scan, chirp by chirp: what speckle and noise did.
fn factors(more: &str) -> Vec<f64> {
    let (_, exact) = render("");
    let (_, speckled) = render(more);
    let (exact, speckled) = (watts(&exact("cloud.ply")), watts(&speckled("cloud.ply")));
    assert_eq!((exact.len(), speckled.len()), (2000, 2000));
    std::iter::zip(speckled, exact).map(|(speckled, exact)| speckled / exact).collect()
}

#[test]
fn speckle_by_its_law_and_by_beat_signals_has_the_contrast_of_its_looks() {
    // The threshold cuts nothing: the plate returns −55 dBm.
    let deep = "[radar]\nthreshold_dbm = -150\n";
    let law = format!("{deep}[radar.speckle]\nlooks = 4\n");
    let beat = format!(
        "{deep}[radar.receiver]\n[radar.chirp]\nsamples = 2048\n[radar.speckle]\nlooks = 4\n[spot]\nrays = 8\n"
    );
    for more in [law, beat] {
        let (mean, contrast) = mean_and_contrast(&factors(&more));
        // Five standard deviations of 2000 Gamma variates of shape 4; picking the strongest of the
        // few range cells that a slanted spot fills raises the mean by less.
        assert!((mean - 1.0).abs() < 5.0 * 0.5 / 2000f64.sqrt(), "{mean}");
        assert!((contrast - 0.5).abs() < 0.05, "{contrast}");
    }
}

#[test]
fn noise_adds_its_power_and_its_range_error() {
    // The echo at −55 dBm in noise at −58 dBm: 1 + 0.5, Rice's spread.
    let more =
        "[radar]\nthreshold_dbm = -150\n[radar.noise]\nlevel_dbm = -58\nrange_sd_m = 0.003\n";
    let factors = factors(more);
    let (_, exact) = render("");
    let (_, noisy) = render(more);
    let ratio = 10f64.powf(-5.8) / watts(&exact("cloud.ply"))[0];
    let (mean, contrast) = mean_and_contrast(&factors);
    // Rice: the variance of the power is N² + 2PN.
    let spread = (ratio * ratio + 2.0 * ratio).sqrt();
    assert!((mean - 1.0 - ratio).abs() < 5.0 * spread / 2000f64.sqrt(), "{mean} for {ratio}");
    assert!((contrast * mean / spread - 1.0).abs() < 0.1, "{contrast} for {spread}");
    let ranges = [exact("cloud.ply"), noisy("cloud.ply")].map(|c| c["range_m"].clone());
    let errors: Vec<f64> = std::iter::zip(&ranges[0], &ranges[1]).map(|(a, b)| b - a).collect();
    let sd_m = (errors.iter().map(|e| e * e).sum::<f64>() / 2000.0).sqrt();
    assert!((sd_m / 0.003 - 1.0).abs() < 0.1, "{sd_m}");
}

#[test]
fn noise_without_a_level_is_the_floor_that_the_threshold_implies() {
    let noise_dbm = |keys: &str| {
        let (scan, _) = render(&format!("[radar.noise]\n{keys}"));
        scan["noise_dbm"].as_f64().unwrap()
    };
    // −77 − 10·lg ln(n·10⁶).
    for (keys, expected_dbm) in [("", -88.404), ("gate_cells = 100\n", -89.653)] {
        assert!((noise_dbm(keys) - expected_dbm).abs() < 1e-3, "{keys}");
    }
    assert!((noise_dbm("level_dbm = -112\n") + 112.0).abs() < 1e-9);
}

#[test]
fn the_range_receiver_reads_range_and_power_of_a_single_ray() {
    let (_, exact) = render("");
    let (_, found) = render("[radar.receiver]\ntemperature_k = 0\n[radar.chirp]\nsamples = 2048\n");
    let (exact, found) = (exact("cloud.ply"), found("cloud.ply"));
    // The detector's documented errors for a Hann window and a padding of 2, and the floats.
    for (a, b) in std::iter::zip(&exact["range_m"], &found["range_m"]) {
        assert!((a - b).abs() < 11e-6, "{a} {b}");
    }
    for (a, b) in std::iter::zip(&exact["power_dbm"], &found["power_dbm"]) {
        assert!((a - b).abs() < 0.015, "{a} {b}");
    }
}

#[test]
fn leakage_is_what_a_receiver_without_a_gate_sees() {
    let ranges_m = |gate: &str| {
        let tables = format!(
            "[radar.receiver]\ntemperature_k = 0\n{gate}[radar.receiver.leakage]\npower_dbm = -30\n\
             range_m = 1.0\n[radar.chirp]\nsamples = 2048\n"
        );
        let (_, cloud) = render(&tables);
        cloud("cloud.ply")["range_m"].clone()
    };
    let (open, gated) = (ranges_m(""), ranges_m("gate_m = [7, 9]\n"));
    assert_eq!((open.len(), gated.len()), (2000, 2000));
    assert!(open.iter().all(|range_m| (range_m - 1.0).abs() < 1e-4));
    assert!(gated.iter().all(|range_m| (range_m - 8.0).abs() < 0.02));
}

#[test]
fn false_alarms_come_as_often_as_asked_and_have_no_cause() {
    // The plate is replaced by a sliver that only a few chirps meet.
    let folder = tempfile::tempdir().unwrap();
    let scene = PLATE.replace("size_m = [1, 1, 0]", "size_m = [0.02, 0.02, 0]").replace(
        "[[mesh]]",
        "[radar.receiver]\nfalse_alarm_probability = 0.05\n[radar.chirp]\nsamples = 2048\n[[mesh]]",
    );
    fs::write(folder.path().join("scene.toml"), scene.replace("chalk", "ptfe")).unwrap();
    matdb(folder.path()).args(["render", "-q", "scene.toml", "-o", "out"]).assert().success();
    let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
    let facets = &cloud["facet"];
    let alarms = facets.iter().filter(|&&facet| facet == -1.0).count() as f64;
    // 5 % of 2000, within four standard deviations.
    assert!((alarms - 100.0).abs() < 4.0 * 95f64.sqrt(), "{alarms}");
    for (facet, incidence) in std::iter::zip(facets, &cloud["incidence_deg"]) {
        assert_eq!(*facet == -1.0, incidence.is_nan());
    }
    let json = fs::read(folder.path().join("out/scan.json")).unwrap();
    let record: Value = serde_json::from_slice(&json).unwrap();
    assert_eq!(record["counts"]["false_alarms"].as_f64(), Some(alarms));
}

#[test]
fn a_receiver_behind_the_plate_hears_nothing_and_one_beside_it_hears_its_share() {
    let (record, clouds) = render(
        "[[receiver]]\nname = \"behind\"\nposition_m = [0, 1.1, -5]\n\
         [[receiver]]\nname = \"beside\"\nposition_m = [4, 1.1, 6.928203]\naperture_m2 = 0.098\n\
         [radar]\naperture_m2 = 0.196\n",
    );
    assert_eq!(record["receivers"][0]["counts"]["detections"], 0);
    // 30° away, as far as the radar: half the aperture and cos 30° are left of a Lambert echo. The
    // middle of the plate, to 2 % for the field of view's ranges and angles.
    let ratios: Vec<f64> =
        std::iter::zip(watts(&clouds("cloud-beside.ply")), watts(&clouds("cloud.ply")))
            .map(|(there, here)| there / here)
            .collect();
    let (mean, spread) = mean_and_contrast(&ratios);
    assert!((mean / (0.5 * 30f64.to_radians().cos()) - 1.0).abs() < 0.02, "{mean}");
    assert!(spread < 0.05, "{spread}");
}

#[test]
fn the_grain_of_a_region_turns_an_anisotropic_lobe() {
    let brushed = CHALK.replace(
        "{ model = \"lambert\", albedo = 0.5 }",
        "{ model = \"cook-torrance\", f_lambda = 0.9, m = 0.02, m_across = 0.4, \
         distribution = \"beckmann\", shadowing = \"correlated\" }",
    );
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("chalk.toml"), brushed).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "chalk.toml"]).assert().success();
    // Turned by 10° about the upright axis: far outside the narrow lobe, well inside the wide one.
    let turned = PLATE.replace("translation_m", "rotation_deg = [0, 10, 0]\ntranslation_m");
    let strongest_dbm = |grain: &str| {
        let scene = format!("{turned}grain = {grain}\n");
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        matdb(folder.path())
            .args(["render", "-q", "--all", "scene.toml", "-o", "out"])
            .assert()
            .success();
        let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
        cloud["power_dbm"].iter().copied().fold(f64::NEG_INFINITY, f64::max)
    };
    // Wide across an upright grain, that is, for a turn about the upright axis.
    let (upright, level) = (strongest_dbm("[0, 1, 0]"), strongest_dbm("[1, 0, 0]"));
    assert!(upright > level + 30.0, "{upright} dBm, {level} dBm");
    assert!(upright > -60.0, "{upright} dBm");
}

#[test]
fn beat_signals_are_an_array_that_holds_the_echo() {
    let folder = tempfile::tempdir().unwrap();
    let more = "[radar.receiver]\ntemperature_k = 0\n[radar.chirp]\nsamples = 2048\n[[mesh]]";
    let scene =
        PLATE.replace("[[mesh]]", more).replace("chalk", "ptfe").replace("lines = 40", "lines = 2");
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let run = ["render", "-q", "--beat", "scene.toml", "-o", "out"];
    matdb(folder.path()).args(run).assert().success();
    let bytes = fs::read(folder.path().join("out/beat.npy")).unwrap();
    let text = String::from_utf8_lossy(&bytes[..128]);
    assert!(text.contains("'shape': (100, 2048)") && text.contains("'<c8'"), "{text}");
    let samples = &bytes[bytes.len() - 100 * 2048 * 8..];
    // A single tone: every sample has the amplitude √P.
    let float = |at: usize| f64::from(f32::from_le_bytes(samples[at..at + 4].try_into().unwrap()));
    let power_w = |sample: usize| float(8 * sample).powi(2) + float(8 * sample + 4).powi(2);
    let expected_w = 1e-3 * watts(&read_cloud(&folder.path().join("out/cloud.ply")))[0];
    for sample in [0, 1, 1000, 2047] {
        assert!((power_w(sample) / expected_w - 1.0).abs() < 4e-3);
    }
}

/// Renders a scene text in a folder of its own.
fn rendered(scene: &str) -> (tempfile::TempDir, Cloud) {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("chalk.toml"), CHALK).unwrap();
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    matdb(folder.path()).args(["add", "-q", "--from", "chalk.toml"]).assert().success();
    matdb(folder.path()).args(["render", "-q", "scene.toml", "-o", "out"]).assert().success();
    let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
    (folder, cloud)
}

#[test]
fn an_obstacle_shades_a_receiver_and_not_the_radar() {
    // A block beside the beam, half way to the receiver.
    let scene = PLATE.replace(
        "[[region]]",
        "[[mesh]]\nname = \"block\"\nfile = \"builtin:cuboid\"\nsize_m = [1, 2, 1]\n\
         translation_m = [2, 1.1, 3.5]\n[[receiver]]\nname = \"beside\"\nposition_m = [4, 1.1, 7]\n\
         [[receiver]]\nname = \"other-side\"\nposition_m = [-4, 1.1, 7]\n[[region]]",
    );
    let (folder, cloud) = rendered(&scene);
    let count = |name: &str| points(&read_cloud(&folder.path().join("out").join(name)));
    assert_eq!(cloud["x"].len(), 2000);
    assert_eq!((count("cloud-beside.ply"), count("cloud-other-side.ply")), (0, 2000));
}

#[test]
fn files_of_an_antenna_that_is_gone_are_named() {
    let receiver = "[[receiver]]\nname = \"beside\"\nposition_m = [4, 1.1, 7]\n[[region]]";
    let (folder, _) = rendered(&PLATE.replace("[[region]]", receiver));
    fs::write(folder.path().join("scene.toml"), PLATE).unwrap();
    fs::write(folder.path().join("out/notes.txt"), "mine").unwrap();
    let again = matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).output().unwrap();
    let notes = String::from_utf8(again.stderr).unwrap();
    let left = "out also holds cloud-beside.ply, power-beside.exr, power-beside.png, which this rendering \
                did not write";
    assert!(again.status.success() && notes.contains(left), "{notes}");
}

#[test]
fn the_cloud_knows_azimuth_edges_and_shares_of_a_plate() {
    // A plate of 0.2 m, turned by 30° about the upright axis, so that the radar stands at 90° from an
    // upright grain.
    let scene = PLATE
        .replace("size_m = [1, 1, 0]", "size_m = [0.2, 0.2, 0]\nrotation_deg = [0, 30, 0]")
        .replace("chalk", "ptfe")
        .replace("[[mesh]]", "[radar]\nthreshold_dbm = -100\n[spot]\nrays = 9\n[[mesh]]");
    let (_folder, cloud) = rendered(&scene);
    let column = |name: &str| cloud[name].iter().copied();
    assert!(cloud["x"].len() > 200);
    for azimuth in column("azimuth_deg") {
        assert!((azimuth.abs() - 90.0).abs() < 2.0, "{azimuth}");
    }
    // 40 × 50 looks over 0.4 m: a spacing of 9 mm.
    let half_width_m = 0.1 * 30f64.to_radians().cos();
    for ((x, y), edge_m) in column("xt_m").zip(column("yt_m")).zip(column("edge_m")) {
        let (dx, dy) = (x.abs() - half_width_m, y.abs() - 0.1);
        let outside_m = dx.max(0.0).hypot(dy.max(0.0));
        let exact_m = if outside_m > 0.0 { outside_m } else { -dx.max(dy) }.min(0.048);
        assert!((edge_m - exact_m).abs() < 0.009, "{x} {y}: {edge_m} {exact_m}");
    }
    // Built-in PTFE at 30°: the specular lobe of m = 0.05 is long gone.
    assert!(column("specular_share").all(|share| share < 1e-9));
    assert!(column("surfaces").all(|surfaces| surfaces == 1.0));
    // A plane has one incidence but for the wavefront, which is flat at the focus and turns by 0.04° within the
    // spot 5 cm from it.
    assert!(column("incidence_sd_deg").all(|sd| sd < 0.1));
    assert!(column("incidence_sd_deg").any(|sd| sd > 0.01));
}

#[test]
fn a_corner_returns_by_two_surfaces_from_the_range_of_its_edge() {
    let wing = |name: &str, turn: i32, x: &str| {
        format!(
            "[[mesh]]\nname = \"{name}\"\nfile = \"builtin:plate\"\nsize_m = [0.1, 0.4, 0]\n\
             rotation_deg = [0, {turn}, 0]\ntranslation_m = [{x}, 1.1, 0.035355]\n"
        )
    };
    let scene = format!(
        "{}{}{}{}",
        "[radar.scan]\npattern = \"raster\"\nlines = 1\nchirps_per_line = 15\nwidth_m = 0.12\nheight_m = 1e-4\n\
         [bounce]\nrays = 2000\noutside_spot_db = 0\n",
        wing("left", 45, "-0.035355"),
        wing("right", -45, "0.035355"),
        "[[region]]\nname = \"all\"\nmaterial = \"aluminium\"\n"
    );
    let (_folder, cloud) = rendered(&scene);
    // From the very ends of the wings no way leads over both.
    assert!(points(&cloud) >= 13);
    assert!(cloud["surfaces"].iter().all(|&surfaces| surfaces == 2.0));
    assert!(cloud["specular_share"].iter().all(|&share| share > 0.99));
    // Every way over both wings is as long as one to the edge, 8 m away; the lobe spreads it.
    for (x, range_m) in std::iter::zip(&cloud["xt_m"], &cloud["range_m"]) {
        assert!((range_m - 8.0).abs() < 0.003, "{x}: {range_m}");
    }
}

#[test]
fn chirps_that_hit_stay_hits_however_little_comes_back() {
    let deaf = "[radar]\nsystem_loss_db = 150\n[radar.receiver]\n[radar.chirp]\nsamples = 2048\n";
    let (record, clouds) = render(deaf);
    assert_eq!(record["counts"]["hits"], 2000);
    assert_eq!(record["counts"]["misses"], 0);
    assert!(points(&clouds("cloud.ply")) < 3);
    let (record, _) =
        render("[radar.receiver]\nfalse_alarm_probability = 1e-3\n[radar.chirp]\nsamples = 2048\n");
    let threshold_dbm = record["threshold_dbm"].as_f64().unwrap();
    let noise_dbm = record["noise_dbm"].as_f64().unwrap();
    assert!(threshold_dbm > noise_dbm + 8.0 && threshold_dbm < noise_dbm + 16.0, "{threshold_dbm}");
}
