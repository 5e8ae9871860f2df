//! Promise: `scan.json` and `cloud.ply` are enough to recompute the power of every point by hand.
//!
//! Nothing of the library is used here: the files are parsed and equation (11) is evaluated anew.

use std::f64::consts::PI;

use crate::support::{matdb, read_cloud, scene};
use serde_json::Value;

/// The cloud keeps power and incidence as 32-bit floats; on the steepest lobe that is 1e-4 dB.
const POWER_DB: f64 = 1e-3;

fn number(value: &Value, key: &str) -> f64 {
    value[key].as_f64().unwrap_or_else(|| panic!("{key} is missing in {value}"))
}

/// f in backscatter from a model's JSON, 1/sr, as a beam of the divergence `delta`, rad, sees it.
fn f_per_sr(model: &Value, theta: f64, delta: f64) -> f64 {
    match model["model"].as_str().unwrap() {
        "lambert" => number(model, "albedo") / PI,
        "blinn-phong" => {
            // The lobe cosᵅ has the slopes m² = 2/α, to which δ² is added.
            let (alpha, wider) =
                (number(model, "alpha"), 1.0 + 0.5 * number(model, "alpha") * delta * delta);
            number(model, "r_s") * (alpha + 2.0) / (2.0 * PI) * theta.cos().powf(alpha / wider)
                / wider
        }
        "cook-torrance" => cook_torrance(model, theta, delta),
        "mixture" => {
            let k = number(model, "k");
            let [diffuse, specular] =
                ["diffuse", "specular"].map(|part| f_per_sr(&model[part], theta, delta));
            k * diffuse + (1.0 - k) * specular
        }
        "tabulated" => {
            let sigma0_db =
                pchip(&list(&model["theta_deg"]), &list(&model["sigma0_db"]), theta.to_degrees());
            10f64.powf(sigma0_db / 10.0) / (4.0 * PI * theta.cos().powi(2))
        }
        other => panic!("unknown model {other}"),
    }
}

/// F·D·G/(4 cos²θ) with i = o = h: F = f_λ. The beam widens D alone.
fn cook_torrance(model: &Value, theta: f64, delta: f64) -> f64 {
    assert_eq!(model["distribution"], "beckmann");
    assert_eq!(model["shadowing"], "separable");
    let m = number(model, "m");
    let (cos, tan) = (theta.cos(), theta.tan());
    let seen2 = m * m + delta * delta;
    let d = (-tan * tan / seen2).exp() / (PI * seen2 * cos.powi(4));
    let a = 1.0 / (m * tan);
    let g1 =
        if a < 1.6 { (3.535 * a + 2.181 * a * a) / (1.0 + 2.276 * a + 2.577 * a * a) } else { 1.0 };
    number(model, "f_lambda") * d * g1 * g1 / (4.0 * cos * cos)
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect()
}

/// Monotone cubic through (x, y), ends held: Fritsch and Butland's slopes, one-sided at the ends.
fn pchip(x: &[f64], y: &[f64], at: f64) -> f64 {
    let n = x.len();
    if at <= x[0] {
        return y[0];
    }
    if at >= x[n - 1] {
        return y[n - 1];
    }
    let h: Vec<f64> = x.windows(2).map(|w| w[1] - w[0]).collect();
    let s: Vec<f64> = (0..n - 1).map(|i| (y[i + 1] - y[i]) / h[i]).collect();
    let slope = |i: usize| {
        if i == 0 {
            return s[0];
        }
        if i == n - 1 {
            return s[n - 2];
        }
        if s[i - 1] * s[i] <= 0.0 {
            return 0.0;
        }
        let (w1, w2) = (2.0 * h[i] + h[i - 1], h[i] + 2.0 * h[i - 1]);
        (w1 + w2) / (w1 / s[i - 1] + w2 / s[i])
    };
    let i = (0..n - 1).find(|&i| at < x[i + 1]).unwrap();
    let t = (at - x[i]) / h[i];
    let (m0, m1) = (slope(i) * h[i], slope(i + 1) * h[i]);
    y[i] + t * m0
        + t * t * (3.0 * (y[i + 1] - y[i]) - 2.0 * m0 - m1)
        + t * t * t * (2.0 * (y[i] - y[i + 1]) + m0 + m1)
}

fn check(scene_name: &str, changes: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path())
        .args(["render", "-q", "-o", "out"])
        .arg(scene(scene_name))
        .args(changes)
        .assert()
        .success();
    let record: Value =
        serde_json::from_slice(&std::fs::read(folder.path().join("out/scan.json")).unwrap())
            .unwrap();
    let cloud = read_cloud(&folder.path().join("out/cloud.ply"));
    let radar = &record["radar"];
    assert_eq!(radar["footprint"], "paper");
    let air_db_per_m = radar.get("air_loss_db_per_m").map_or(0.0, |loss| loss.as_f64().unwrap());
    let equation = record["equation"].as_str().unwrap();
    assert_eq!(equation.contains("air_loss_db_per_m"), air_db_per_m > 0.0);
    let origin = list(&record["frames"]["origin_global_m"]);
    // The scenes' radar looks along −z from the middle of its target plane, so that x_t and y_t, carried out to
    // 8 m, are where the axis passes there.
    let wavelength_m = number(&record["beam"], "wavelength_m");
    let waist_m = |xt_m: f64, yt_m: f64, range_m: f64| {
        let out = 8.0 / range_m;
        let growth = number(&radar["beam"], "edge_growth") - 1.0;
        let off_centre = (xt_m.powi(2) + yt_m.powi(2)) * out * out;
        number(&record["beam"], "waist_m")
            * (1.0 + growth * off_centre / number(&radar["beam"], "edge_m").powi(2))
    };
    let solid_angle_sr = |w0: f64, range_m: f64| {
        let off_focus_m = range_m - number(&radar["beam"], "focus_m");
        let w2 = w0 * w0 + (wavelength_m * off_focus_m / (PI * w0)).powi(2);
        wavelength_m * wavelength_m / (PI * w2)
    };
    let points = cloud["x"].len();
    assert_eq!(points as u64, record["counts"]["detections"].as_u64().unwrap());
    assert!(points > 1000, "{points} points say little");
    let mut together = 0;
    for i in 0..points {
        let theta = cloud["incidence_deg"][i].to_radians();
        let range_m = ["x", "y", "z"]
            .iter()
            .zip(&origin)
            .map(|(axis, o)| (cloud[*axis][i] - o).powi(2))
            .sum::<f64>()
            .sqrt();
        assert!((range_m - cloud["range_m"][i]).abs() < 1e-6);
        let material = &record["materials"][cloud["material"][i] as usize];
        let w0 = waist_m(cloud["xt_m"][i], cloud["yt_m"][i], range_m);
        let delta = wavelength_m / (2.0 * PI * w0);
        // Lobes that were seen by a beam are not widened again; those of the scenes here are wider than this one.
        let delta = if material["lobes"] == "surface" { delta } else { 0.0 };
        let passed_db = cloud.get("passed_db").map_or(0.0, |passed| passed[i]);
        let expected = passed_db + number(radar, "transmit_power_dbm")
            - number(radar, "system_loss_db")
            - air_db_per_m * 2.0 * range_m
            + 10.0 * solid_angle_sr(w0, range_m).log10()
            + 10.0 * f_per_sr(&material["scattering"], theta, delta).log10()
            + 20.0 * theta.cos().log10();
        let power = cloud["power_dbm"][i];
        if cloud.contains_key("sheets") && power > expected + POWER_DB {
            // What lies within a range cell behind a sheet is one echo with it.
            together += 1;
        } else {
            assert!((power - expected).abs() < POWER_DB, "point {i}: {power} is not {expected}");
        }
        assert!(power >= number(radar, "threshold_dbm"));
        let region = &record["regions"][cloud["region"][i] as usize];
        assert_eq!(region["material"].as_f64().unwrap(), cloud["material"][i]);
    }
    assert!(50 * together < points, "{together} of {points} points are echoes of two surfaces");
}

#[test]
fn every_point_of_the_mannequin() {
    check("mannequin.toml", &[]);
}

#[test]
fn every_point_of_the_human() {
    check("human.toml", &[]);
}

#[test]
fn every_point_through_air_with_a_loss() {
    let changes = ["--set", "radar.air_loss_db_per_m=0.4", "--set", "radar.threshold_dbm=-84"];
    check("mannequin.toml", &changes);
}
