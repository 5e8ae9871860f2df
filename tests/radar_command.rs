//! Promise: `matdb radar` writes files that close the circle: the coefficients it prints give the same
//! scan when pasted into a scene, and so do the rays and the mirror angles it lists.

use std::fs;
use std::path::Path;

use crate::support::{entries, matdb};
use serde_json::Value;

const FILES: [&str; 6] = ["f5.toml", "scan.csv", "scan.png", "scan.svg", "spot.csv", "spot.png"];

fn radar(folder: &Path, what: &str, out: &str) -> Value {
    let output = matdb(folder).args(["radar", what, "-o", out, "--json"]).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(entries(&folder.join(out)), FILES);
    serde_json::from_slice(&output.stdout).unwrap()
}

/// Columns of a CSV by name.
fn columns(path: &Path, names: &[&str]) -> Vec<Vec<f64>> {
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &&str| header.iter().position(|h| h == name).unwrap();
    let wanted: Vec<usize> = names.iter().map(at).collect();
    let row = |line: &str| -> Vec<f64> {
        let cells: Vec<&str> = line.split(',').collect();
        wanted.iter().map(|&i| cells[i].parse().unwrap()).collect()
    };
    lines.map(row).collect()
}

fn farthest_m(a: &Path, b: &Path) -> f64 {
    let points = |path: &Path| columns(path, &["xt_m", "yt_m"]);
    let (a, b) = (points(a), points(b));
    assert_eq!(a.len(), b.len());
    let apart = |(a, b): (&Vec<f64>, &Vec<f64>)| (a[0] - b[0]).hypot(a[1] - b[1]);
    std::iter::zip(&a, &b).map(apart).fold(0.0, f64::max)
}

#[test]
fn the_polynomial_is_far_below_the_spot_and_can_be_given_back() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let preset = radar(folder, "upm-300ghz", "preset");
    // The goal is 0.2 mm; the spot is 16 mm.
    assert!(preset["f5_error"]["worst_mm"].as_f64().unwrap() < 0.2);
    assert_eq!(preset["chirps"], 18_529);
    fs::copy(folder.join("preset/f5.toml"), folder.join("own.toml")).unwrap();
    radar(folder, "own.toml", "own");
    assert!(farthest_m(&folder.join("preset/scan.csv"), &folder.join("own/scan.csv")) < 1e-12);
}

#[test]
fn listed_rays_and_angles_give_the_same_scan() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    radar(folder, "upm-300ghz", "preset");
    let scan = folder.join("preset/scan.csv");
    for pattern in ["rays", "angles"] {
        let scene = format!("[radar.scan]\npattern = \"{pattern}\"\nfile = \"preset/scan.csv\"\n");
        fs::write(folder.join("scene.toml"), scene).unwrap();
        radar(folder, "scene.toml", pattern);
        let again = folder.join(pattern).join("scan.csv");
        match pattern {
            "rays" => {
                let text = fs::read_to_string(&again).unwrap();
                assert!(text.lines().nth(1).unwrap().starts_with("0,0,,,"), "no mirror, no angles");
                let points = |path: &Path| columns_of(path);
                let apart = std::iter::zip(points(&scan), points(&again));
                assert!(apart.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) < 1e-12);
            }
            _ => assert!(farthest_m(&scan, &again) < 1e-12),
        }
    }
}

/// x_t of every chirp; the columns before it may be empty.
fn columns_of(path: &Path) -> Vec<f64> {
    let text = fs::read_to_string(path).unwrap();
    text.lines().skip(1).map(|line| line.split(',').nth(4).unwrap().parse().unwrap()).collect()
}

#[test]
fn every_pattern_can_be_drawn_and_the_pattern_key_may_be_left_out() {
    let folder = tempfile::tempdir().unwrap();
    for (scan, chirps) in [
        ("pattern = \"raster\"\nlines = 9\nchirps_per_line = 11", 99),
        ("pattern = \"lissajous\"\nchirps = 50", 50),
        ("pattern = \"spiral\"\nchirps = 60", 60),
        ("chirps = 70", 70),
    ] {
        fs::write(folder.path().join("scene.toml"), format!("[radar.scan]\n{scan}\n")).unwrap();
        assert_eq!(radar(folder.path(), "scene.toml", "out")["chirps"], chirps, "{scan}");
    }
}
