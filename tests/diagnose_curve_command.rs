//! Promise: `matdb diagnose --curve` names what a curve's law lacks, in files and on the terminal.

use std::fs;
use std::path::Path;

use crate::support::{entries, matdb, refused};
use matdb::brdf::Scattering;
use matdb::diagnose::curve::{LawAt, Points, base_law, term};
use matdb::material::file::in_plane::InPlane;
use matdb::measure::Curve;
use serde_json::Value;

const FILES: [&str; 5] = ["curve.png", "curve.svg", "report.html", "report.json", "residuals.csv"];

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("no number: {value}"))
}

/// A table in the plane of incidence without noise beyond its digits, of the base law with a term.
fn table(name: &str, numbers: &[f64]) -> String {
    let law = base_law();
    let angles = [20.0f64, 45.0, 65.0];
    let angles = angles.iter().flat_map(|i| (-38..=38).map(move |k| [*i, 2.0 * f64::from(k)]));
    let values = angles.map(|[i, s]| InPlane {
        theta_i_rad: i.to_radians(),
        theta_s_rad: s.to_radians(),
        f_per_sr: 1.0,
    });
    let observations = values.map(|value| value.observation()).collect();
    let curve = Curve { observations, ..Curve::default() };
    let points = Points::of_curve(&curve, &[], None).unwrap().points;
    let mut text = "theta_i_deg,theta_s_deg,brdf_per_sr\n".to_owned();
    for (k, point) in points.iter().enumerate() {
        let f = law.f_per_sr(point.i, point.o);
        let f = term(name).map_or(f, |term| term.scatter(numbers, &LawAt::new(&law, point, f), f));
        // About 0.2 dB of scatter that has no period.
        let scatter = 1.0 + 0.07 * ((k * k) as f64 * 0.754_877_666).fract() - 0.035;
        let [i, s] = [point.theta_i_rad, point.theta_s_rad].map(|x: f64| x.to_degrees().round());
        text += &format!("{i},{s},{:.6e}\n", f * scatter);
    }
    text
}

#[test]
fn a_report_is_complete_and_its_table_gives_its_errors() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("coating.csv"), table("stray-light", &[0.01])).unwrap();
    let command =
        ["--json", "diagnose", "--curve", "coating.csv", "--noise-db", "0.09", "-o", "out"];
    let output = matdb(at).args(command).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(entries(&at.join("out")), FILES);
    let report = json(&at.join("out/report.json"));
    assert_eq!(serde_json::from_slice::<Value>(&output.stdout).unwrap(), report);
    assert_eq!((&report["schema"], &report["verdict"]), (&3.into(), &"explained".into()));
    assert_eq!(report["effects"][0]["name"], "stray-light", "{report}");
    let csv = fs::read_to_string(at.join("out/residuals.csv")).unwrap();
    for (column, model) in [(4, "before"), (5, "after")] {
        let squares: Vec<f64> = csv
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect::<Vec<f64>>())
            .map(|cells| (cells[2] - cells[column]).powi(2))
            .collect();
        let rmse_db = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!((rmse_db - number(&report["error"][model]["rmse_db"])).abs() < 2e-4, "{model}");
    }
    assert_eq!(report["not_tried"], serde_json::json!([]));
    let html = fs::read_to_string(at.join("out/report.html")).unwrap();
    assert!(html.contains("The missing effect is found") && html.contains("(instrument)"));
    assert!(html.contains("stray-light") && html.contains("<svg") && !html.contains("http"));

    // Whoever blames the bench is told what to try before, and what was left out.
    let mut some = command.to_vec();
    some.retain(|word| *word != "--json");
    some.extend(["--effects", "stray-light"]);
    let output = matdb(at).args(some).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(
        said.contains("before stray-light is blamed, measure another sample on the same bench"),
        "{said}"
    );
    let left_out = json(&at.join("out/report.json"))["not_tried"].clone();
    assert_eq!(left_out.as_array().unwrap().len(), 9);
    assert_eq!(left_out[0]["reason"], "not-asked");
    let html = fs::read_to_string(at.join("out/report.html")).unwrap();
    assert!(
        html.contains("Before stray-light is blamed") && html.contains("Left out of the search")
    );

    // Where nobody knows the noise, nothing is called explained.
    let output =
        matdb(at).args(["diagnose", "--curve", "coating.csv", "-o", "out"]).output().unwrap();
    let said = String::from_utf8(output.stdout).unwrap();
    assert!(said.contains("may be ") && said.contains("stray-light"), "{said}");
    assert_eq!(json(&at.join("out/report.json"))["effects"], serde_json::json!([]));

    // What a diagnosis of a cloud left goes, and so does all of this when nothing can be said.
    for name in ["residual-map.png", "unknown-map.svg"] {
        fs::write(at.join("out").join(name), "stale").unwrap();
    }
    matdb(at).args(command).assert().success();
    assert_eq!(entries(&at.join("out")), FILES);
    fs::write(at.join("few.csv"), "theta_deg,sigma0_db\n0,1\n10,0\n").unwrap();
    refused(matdb(at).args(["diagnose", "--curve", "few.csv", "-o", "out"]));
    assert_eq!(entries(&at.join("out")), ["report.html", "report.json"]);
}

#[test]
fn what_means_nothing_is_refused_in_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("coating.csv"), table("", &[])).unwrap();
    fs::write(at.join("bad.csv"), "theta_i_deg,theta_s_deg,brdf_per_sr\n10,20,-1\n").unwrap();
    fs::write(at.join("bad.bsdf"), "Source Measured\n").unwrap();
    fs::write(at.join("few.csv"), "theta_deg,sigma0_db\n0,1\n10,0\n").unwrap();
    let sweep = (1..40).map(|k| format!("{0},{0},{1}\n", 2 * k, 0.3 + 0.001 * f64::from(k * k)));
    let head = "theta_i_deg,theta_s_deg,brdf_per_sr\n".to_owned();
    fs::write(at.join("sweep.csv"), head + &sweep.collect::<String>()).unwrap();
    for (arguments, says) in [
        (
            vec!["x.ply", "--curve", "coating.csv"],
            "give CLOUD --scene SCENE, or --curve FILE alone",
        ),
        (vec!["x.ply"], "give CLOUD --scene SCENE, or --curve FILE alone"),
        (vec!["--curve", "bad.csv"], "line 2, column brdf_per_sr"),
        (vec!["--curve", "bad.bsdf"], "there is no `DataBegin`"),
        (vec!["--curve", "coating.csv", "--model", "lamber"], "did you mean `lambert`?"),
        (vec!["--curve", "coating.csv", "--effects", "stray"], "no effect `stray`"),
        (vec!["--curve", "coating.csv", "--noise-db", "0"], "above 0 and up to 100"),
        (vec!["--curve", "sweep.csv"], "the levels do not determine the noise"),
        (vec!["--curve", "few.csv"], "2 detected levels"),
    ] {
        let mut command = vec!["diagnose", "-o", "out"];
        command.extend(arguments);
        let message = refused(matdb(at).args(&command));
        assert!(message.contains(says), "{message}");
    }
    assert_eq!(json(&at.join("out/report.json"))["verdict"], "cannot-tell");
    // What only a cloud has a use for is refused before anything is read.
    for flag in ["--add", "--material paint", "--unit mm", "--power w", "--frame target"] {
        let command = format!("diagnose --curve coating.csv -o more {flag}");
        let output = matdb(at).args(command.split(' ')).output().unwrap();
        let message = String::from_utf8(output.stderr).unwrap();
        assert_eq!(output.status.code(), Some(2), "{flag}: {message}");
        let (first, flag) = (message.lines().next().unwrap(), flag.split(' ').next().unwrap());
        assert!(first.contains(flag) && first.contains("cannot be used with"), "{message}");
        assert!(!at.join("more").exists());
    }
}

#[test]
fn a_level_at_a_right_angle_is_left_out_and_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut text = "theta_deg,sigma0_db\n".to_owned();
    for k in 0..=45u32 {
        let theta_deg = 2.0 * f64::from(k);
        let level_db = 20.0 * theta_deg.to_radians().cos().max(1e-4).log10();
        text += &format!("{theta_deg},{:.2}\n", level_db + 0.1 * f64::from(k % 3));
    }
    fs::write(at.join("curve.csv"), text).unwrap();
    let command = ["diagnose", "--curve", "curve.csv", "--noise-db", "0.2", "-o", "out"];
    let output = matdb(at).args(command).output().unwrap();
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{said}");
    assert!(said.contains("levels at 89.9° or more are not used: 1"), "{said}");
    assert_eq!(json(&at.join("out/report.json"))["curve"]["points"], 45);
}

#[test]
fn the_next_step_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let light = table("stray-light", &[0.01]);
    // Counts, or another unit.
    let counts = light.lines().map(|line| match line.rsplit_once(',') {
        Some((angles, f)) if f != "brdf_per_sr" => {
            format!("{angles},{}\n", 1000.0 * f.parse::<f64>().unwrap())
        }
        _ => format!("{line}\n"),
    });
    fs::write(at.join("counts.csv"), counts.collect::<String>()).unwrap();
    fs::write(at.join("light.csv"), &light).unwrap();
    for (command, sentence) in [
        ("light.csv --noise-db 0.09", "before stray-light is blamed, measure another sample"),
        ("light.csv", "state the noise with --noise-db, or repeat some angles"),
        ("light.csv", "but has no name: the noise of a level is not known"),
        ("counts.csv --noise-db 0.09", "dB: look at the unit of the levels"),
    ] {
        let command = format!("diagnose -o out --curve {command}");
        let output = matdb(at).args(command.split(' ')).output().unwrap();
        let said = String::from_utf8(output.stdout).unwrap();
        assert!(output.status.success() && said.contains(sentence), "{command}: {said}");
    }
}
