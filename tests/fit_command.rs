//! Promise: `matdb fit` turns a curve into parameters with intervals and a verdict, stores them as a
//! revision that scenes render, and gives a sentence instead of a number where the data do not suffice.

use std::fs;
use std::path::Path;

use crate::support::{self, entries, matdb, refused, scene};
use matdb::brdf::{Brdf, Scattering};
use matdb::radar::random::{Key, Purpose};
use matdb::units::db_from_ratio;
use serde_json::Value;

const HEADER: &str = "theta_deg,theta_sd_deg,power_dbm,sigma0_db,range_m,chirp,censored\n";
/// σ⁰ of 0 dB in this radar, dBm.
const OFFSET_DB: f64 = -45.0;
const THRESHOLD_DB: f64 = -27.0;
const LOOKS: f64 = 4.0;
const M: f64 = 0.1;
const ALPHA: f64 = 5.0;

fn truth() -> Brdf {
    let text = format!(
        r#"{{"model": "mixture", "k": 0.1,
            "specular": {{"model": "cook-torrance", "f_lambda": 0.06, "m": {M}}},
            "diffuse": {{"model": "blinn-phong", "r_s": 0.05, "alpha": {ALPHA}}}}}"#
    );
    serde_json::from_str(&text).unwrap()
}

/// A curve of a known mixture with speckle of four looks, tilted by 1°, cut off at a threshold.
fn curve(from_deg: f64, to_deg: f64, rows: u32) -> String {
    let truth = truth();
    let row = |chirp: u32| {
        let key = Key { seed: 5, chirp: u64::from(chirp), sub_ray: 0, purpose: Purpose::Speckle };
        let mut draws = key.draws();
        let theta_deg = from_deg + (to_deg - from_deg) * draws.uniform();
        let tilt_deg = draws.complex_gaussian() * std::f64::consts::SQRT_2;
        let true_deg = (theta_deg + tilt_deg.re).hypot(tilt_deg.im).min(89.0);
        let sigma0 = truth.sigma0(true_deg.to_radians()) * draws.gamma(LOOKS);
        let level_db = db_from_ratio(sigma0).max(THRESHOLD_DB);
        let censored = u8::from(level_db == THRESHOLD_DB);
        let power_dbm = level_db + OFFSET_DB;
        format!("{theta_deg:.4},1,{power_dbm:.3},{level_db:.3},8,{chirp},{censored}\n")
    };
    HEADER.to_owned() + &(0..rows).map(row).collect::<String>()
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    let output = matdb(folder).args(arguments).arg("--json").output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}

fn text(folder: &Path, arguments: &[&str]) -> String {
    let output = matdb(folder).args(arguments).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

const SAVE: [&str; 6] =
    ["--save", "human-skin-300-ghz", "--kind", "synthetic", "--source", "A test"];

#[test]
fn a_curve_is_fitted_stored_rendered_and_listed() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scan.csv"), curve(0.0, 60.0, 400)).unwrap();
    let drawn = ["fit", "scan.csv", "--starts", "2", "-o", "fit.svg"];
    let found = json(folder, &[&drawn[..], &SAVE].concat());
    for (name, truth) in [("specular.m", M), ("diffuse.alpha", ALPHA), ("looks", LOOKS)] {
        let estimates = found["estimates"].as_array().unwrap();
        let estimate = estimates.iter().find(|estimate| estimate["name"] == name).unwrap();
        let [value, sd] = ["value", "sd"].map(|key| estimate[key].as_f64().unwrap());
        // Four deviations: chance passes it once in 16 000 times.
        assert!((value - truth).abs() < 4.0 * sd && sd < 0.5 * truth, "{estimate}");
    }
    let sentences = found["sentences"].to_string();
    assert!(sentences.contains("S = (1 - k) f_lambda") && sentences.contains("R = k r_s"));
    let saved = &found["saved"];
    assert_eq!((&saved["revision"], &saved["fit"]), (&1.into(), &"mixture-censored".into()));
    assert!(fs::read_to_string(folder.join("fit.svg")).unwrap().contains("95 % band"));

    let listed = &json(folder, &["list"])[0];
    assert_eq!(
        (&listed["slug"], &listed["render_kind"]),
        (&"human-skin-300-ghz".into(), &"synthetic".into())
    );
    assert_eq!((&listed["curves"], &listed["observations"]), (&1.into(), &400.into()));
    let shown = text(folder, &["show", "human-skin-300-ghz"]);
    assert!(shown.contains("method censored: converged") && shown.contains("verdict:"), "{shown}");
    let score = found["held_out"]["score"].as_f64().unwrap();
    let held = format!(
        "held out in 5 turns (20 runs of chirps): {:.2} dB rms, ln p {score:.4} ± ",
        found["held_out"]["rms_db"].as_f64().unwrap()
    );
    assert!(shown.contains(&held), "{held}: {shown}");
    let fitted = shown.split("fit mixture-censored").nth(1).unwrap();
    for path in ["k ", "specular.f_lambda", "diffuse.r_s"] {
        let line = fitted.lines().find(|line| line.starts_with(path)).unwrap();
        assert!(line.ends_with("a convention, not measured"), "{line}");
    }
    text(folder, &["plot", "human-skin-300-ghz", "-o", "plot.svg"]);
    let plot = fs::read_to_string(folder.join("plot.svg")).unwrap();
    assert!(plot.contains("scan, below the threshold here") && plot.contains("mixture-censored"));

    // The stored law with its band, within which the truth lies at angles that the curve has.
    let predict = ["predict", "human-skin-300-ghz", "--angles", "0:50:10", "-o", "levels.csv"];
    let predicted = json(folder, &predict);
    assert_eq!(
        (&predicted["law"], &predicted["no_band"]),
        (&"mixture-censored".into(), &Value::Null)
    );
    let levels = predicted["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 6);
    for level in levels {
        let theta_rad = level["theta_deg"].as_f64().unwrap().to_radians();
        let [low_db, high_db] = [0, 1].map(|end| level["band_db"][end].as_f64().unwrap());
        let sigma0_db = level["sigma0_db"].as_f64().unwrap();
        let true_db = db_from_ratio(truth().sigma0(theta_rad));
        // Half as wide again: six angles of one fit may lie off together.
        let slack_db = 0.25 * (high_db - low_db);
        assert!((low_db..high_db).contains(&sigma0_db), "{level}");
        assert!((low_db - slack_db..high_db + slack_db).contains(&true_db), "{true_db}: {level}");
    }
    let csv = fs::read_to_string(folder.join("levels.csv")).unwrap();
    assert!(
        csv.starts_with("theta_deg,sigma0_db,below_db,low_db,high_db,outside_deg\n0,"),
        "{csv}"
    );
    assert_eq!(csv.lines().count(), 7);

    // Through a beam, too, a level lies within its band.
    let lit = curve(0.0, 60.0, 400).lines().enumerate().fold(String::new(), |text, (row, line)| {
        text + line + if row == 0 { ",beam_rad\n" } else { ",0.03\n" }
    });
    fs::write(folder.join("lit.csv"), lit).unwrap();
    let [saved, predict] = [
        "fit lit.csv --starts 1 --save concrete --kind synthetic --source T --instrument T --frequency 300 --threshold -77",
        "predict concrete --angles 0:20:2",
    ];
    json(folder, &saved.split(' ').collect::<Vec<&str>>());
    let predicted = json(folder, &predict.split(' ').collect::<Vec<&str>>());
    for level in predicted["levels"].as_array().unwrap() {
        let [low_db, high_db] = [0, 1].map(|end| level["band_db"][end].as_f64().unwrap());
        let sigma0_db = level["sigma0_db"].as_f64().unwrap();
        assert!((low_db..high_db).contains(&sigma0_db), "{level}");
    }

    json(folder, &["render", scene("human.toml").to_str().unwrap(), "-o", "out"]);
    let record: Value =
        serde_json::from_slice(&fs::read(folder.join("out/scan.json")).unwrap()).unwrap();
    assert_eq!(record["materials"][0]["scattering"], found["model"]);
    assert_eq!(record["materials"][0]["origin"], "database");

    // The stored curve gives what the file gave, and a second fit leaves the first in its revision.
    let again = ["fit", "human-skin-300-ghz", "--method", "tls-tail", "--alpha", "4", "--save"];
    let again = json(folder, &[&again[..], &["--keep-render", "--starts", "1"]].concat());
    assert_eq!(again["data_hash"], found["data_hash"]);
    assert_eq!(again["saved"]["fit"], "mixture-tls-tail");
    assert_eq!(again["saved"]["render"], "mixture-censored");
    let shown = json(folder, &["show", "human-skin-300-ghz@2"]);
    let fits = shown["material"]["fits"].as_array().unwrap();
    assert_eq!(fits.len(), 3);
    let report = &fits[2]["report"];
    assert_eq!(report["given"][0]["name"], "diffuse.alpha");
    assert!(report["verdict"].to_string().contains("least squares ignores them"), "{report}");
    let held = fits[2]["parameter_sources"][0][1].as_str().unwrap();
    let sources = shown["material"]["sources"].as_array().unwrap();
    let held = sources.iter().find(|source| source["key"] == held).unwrap();
    assert_eq!(held["kind"], "synthetic", "a number that somebody chose is not measured");
}

#[test]
fn too_little_data_gives_a_verdict_and_no_confident_number() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("near.csv"), curve(0.0, 5.0, 150)).unwrap();
    let near = text(folder, &["fit", "near.csv", "--starts", "1"]);
    assert!(near.contains("the data do not show the diffuse part"), "{near}");
    fs::write(folder.join("scan.csv"), curve(0.0, 60.0, 150)).unwrap();
    let arguments = ["fit", "scan.csv", "--model", "kirchhoff-go", "--starts", "1"];
    let go = json(folder, &arguments);
    // The two act only together, or the search leaves them at a bound; either is said.
    let verdict = go["verdict"].to_string();
    assert!(verdict.contains("eps_real") && verdict.contains("eps_imag"), "{go}");
    let silent = go["estimates"].as_array().unwrap().iter().filter(|e| e["sd"].is_null()).count();
    assert_eq!(silent, 2, "eps_real and eps_imag only scale the curve: {go}");
}

#[test]
fn data_that_leave_every_number_at_a_bound_are_told_so() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let bright = "theta_deg,sigma0_db\n0,10\n1,10\n2,10\n3,10\n";
    fs::write(folder.join("bright.csv"), bright).unwrap();
    for method in ["censored", "tls", "mse"] {
        let run = ["fit", "bright.csv", "--model", "lambert", "--method", method, "--starts", "1"];
        let output = matdb(folder).args(run).output().unwrap();
        assert!(matches!(output.status.code(), Some(0 | 1)), "{method}: {output:?}");
        let said = String::from_utf8_lossy(&output.stdout).into_owned();
        assert!(said.contains("bound") || output.status.code() == Some(1), "{method}: {said}");
    }
    fs::write(folder.join("four.csv"), curve(0.0, 60.0, 4)).unwrap();
    let exact = support::refused(matdb(folder).args(["fit", "four.csv", "--method", "tls"]));
    assert!(exact.contains("4 unknowns and their errors"), "{exact}");
}

#[test]
fn a_fit_that_did_not_converge_is_printed_and_not_stored() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Levels without any order, for which least squares finds no way on.
    let rows = "6,-25 11,-30 19,-17 20,-6 22,-25 37,-37 50,-27 50,-46 52,-21 64,-36 67,-46 67,-55";
    let rows = rows.split(' ').fold("theta_deg,sigma0_db".to_owned(), |all, row| all + "\n" + row);
    fs::write(folder.join("scan.csv"), rows).unwrap();
    let model = ["--model", "kirchhoff-go", "--method", "tls", "--starts", "1"];
    let fit = [&["fit", "scan.csv", "-o", "fit.svg"][..], &model].concat();
    let output = matdb(folder).args(fit).args(SAVE).output().unwrap();
    let [out, error] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap());
    assert_eq!(output.status.code(), Some(1), "{out}");
    assert!(out.contains("did not converge") && out.contains("do not use the numbers"), "{out}");
    assert!(error.starts_with("error: scan.csv: the fit did not converge"), "{error}");
    assert_eq!(entries(folder), ["scan.csv"]);
}

#[test]
fn bad_input_is_refused_with_a_sentence_and_nothing_is_stored() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let whole = curve(0.0, 60.0, 40);
    let censored = "60,1,-80,-35,8,1,1\n61,1,-80,-35,8,2,1\n";
    fs::write(folder.join("scan.csv"), &whole).unwrap();
    fs::write(folder.join("censored.csv"), HEADER.to_owned() + censored).unwrap();
    fs::write(folder.join("few.csv"), "theta_deg,sigma0_db\n1,-3\n20,-20\n40,-25\n").unwrap();
    fs::write(folder.join("empty.csv"), HEADER).unwrap();
    fs::write(folder.join("bad.csv"), "theta_deg,sigma0_db\n1,-3\n120,-20\n").unwrap();
    let before = entries(folder);
    for (arguments, expected) in [
        ("censored.csv", "all 2 rows are censored"),
        ("few.csv", "3 detections cannot give 5 unknowns"),
        ("empty.csv", "no rows"),
        ("bad.csv", "line 3"),
        ("absent.csv", "cannot read absent.csv"),
        ("few.csv --model lambert --noise-dbm -90", "3 of 3 rows of few.csv have no power"),
        ("ptfe", "`ptfe` has no curve that could be fitted"),
        ("cotton --curve other", "`cotton` has no curve `other`; there are:"),
        ("coton", "did you mean `cotton`?"),
        ("scan.csv --model mixtur", "did you mean `mixture`?"),
        ("scan.csv --model qqqqqq", "name a material or one of blinn-phong"),
        ("scan.csv --model cotton", "nothing is left to fit"),
        (
            "scan.csv --method tls-tail",
            "hold it, or use the method tls to find it (--alpha, --method)",
        ),
        ("scan.csv --model lambert --alpha 3", "this model has no alpha"),
        ("scan.csv --fix alpha", "write it as --fix diffuse.alpha=3"),
        ("scan.csv --fix diffuse.alpa=3", "there are: k"),
        ("scan.csv --fix diffuse.alpha=-3", "diffuse.alpha = -3 is out of range"),
        ("scan.csv --alpha 3 --fix diffuse.alpha=3", "held twice"),
        ("scan.csv --starts 0", "fit.starts = 0"),
        ("scan.csv --looks 0", "fit.looks = 0"),
        ("scan.csv --save", "belongs to no material yet"),
        (
            "scan.csv --save ptfe",
            "a curve that is stored needs more; add --kind measured, --source \"who measured it, where, when\", \
             --licence CC-BY-4.0, --instrument \"name of the radar\", --frequency 300, --threshold -77",
        ),
        (
            "scan.csv --save ptfe --kind synthetic",
            "a curve that is stored needs more; add --source \"who measured it, where, when\"",
        ),
        ("scan.csv --alpha -3", "diffuse.alpha = -3 is out of range"),
        ("scan.csv --looks -3", "fit.looks = -3"),
        ("scan.csv --split-deg -3 --method mse", "split"),
        ("scan.csv --theta-sd-deg -3 --method tls", "theta_sd"),
        ("scan.csv --level-sd-db -3 --method tls", "level_sd"),
        (
            "scan.csv --save my-paint --kind measured --source x",
            "`matdb add --from scan.csv --name my-paint --class CLASS …` makes one of the curve",
        ),
        ("scan.csv --save ptf --kind measured --source x", "did you mean `ptfe`?"),
        (
            "scan.csv --save ptfe --kind measured --source x --licence CC0-1.0",
            "add --instrument \"name of the radar\", --frequency 300, --threshold -77",
        ),
        (
            "scan.csv --save ptfe --kind measured --source x --licence free/for/all",
            "--licence is not an SPDX expression",
        ),
        ("scan.csv --save ptfe@1 --kind measured --source x", "a revision never changes"),
        ("scan.csv -o fit.pdf", "does not end in .svg or .png"),
        ("cotton --model mixture --save ptfe", "belongs to `cotton`"),
    ] {
        let arguments: Vec<&str> = arguments.split(' ').collect();
        let sentence = refused(matdb(folder).arg("fit").args(&arguments));
        assert!(sentence.contains(expected), "{arguments:?}: {sentence}");
        assert_eq!(entries(folder), before, "{arguments:?}");
    }
}

#[test]
fn what_no_numbers_in_range_explain_is_said_once_and_not_stored() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let rows: String = (0..12).map(|i| format!("{i},12\n")).collect();
    fs::write(folder.join("bright.csv"), format!("theta_deg,sigma0_db\n{rows}")).unwrap();
    let fit = ["fit", "bright.csv", "--fix", "specular.m=0.5", "--looks", "4", "--starts", "1"];
    let said = text(folder, &fit);
    let sentence = "no parameters in their ranges give this level";
    assert_eq!(said.matches(sentence).count(), 1, "{said}");
    assert!(said.contains("let go of specular.m, or check the calibration"), "{said}");
    for wrong in ["was chosen", "S stopped", "R stopped"] {
        assert!(!said.contains(wrong), "{said}");
    }
    let output = matdb(folder).args(fit).args(SAVE).output().unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    assert!(error.contains("nothing is stored, since the fit is out of range"), "{error}");
    assert_eq!(entries(folder), ["bright.csv"]);
}

#[test]
fn points_that_are_there_already_are_not_stored_twice() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scan.csv"), "theta_deg,sigma0_db\n0,-3\n20,-4\n50,-6\n60,-8\n").unwrap();
    let said = "--kind measured --source bench --licence CC0-1.0 --instrument Radar --frequency 300 \
                --threshold -77";
    let said: Vec<&str> = said.split_whitespace().collect();
    let add = ["add", "--from", "scan.csv", "--name", "my-paint", "--class", "paint"];
    matdb(folder).args(add).args(&said).assert().success();
    let fit = ["fit", "scan.csv", "--model", "lambert", "--save", "my-paint"];
    let other_name = ["--curve", "second"];
    matdb(folder).args(fit).args(&said).args(other_name).assert().success();
    let curves = &json(folder, &["show", "my-paint"])["material"]["curves"];
    assert_eq!((curves.as_array().unwrap().len(), &curves[0]["name"]), (1, &"scan".into()));

    let others: Vec<&str> =
        said.iter().map(|s| if *s == "bench" { "elsewhere" } else { s }).collect();
    let refusal = refused(matdb(folder).args(fit).args(&others));
    assert!(
        refusal.contains("has these points already, as the curve `scan` from bench"),
        "{refusal}"
    );
    fs::write(folder.join("scan.csv"), "theta_deg,sigma0_db\n0,-3\n20,-4\n50,-6\n61,-8\n").unwrap();
    let refusal = refused(matdb(folder).args(fit).args(&said));
    assert!(refusal.contains("has another curve `scan`, from bench; give this curve"), "{refusal}");
    let slow = |s| match s {
        "Radar" => "Slow",
        "300" => "77",
        other => other,
    };
    let slow: Vec<&str> = said.iter().copied().map(slow).collect();
    let refusal = refused(matdb(folder).args(fit).args(&slow).args(["--curve", "third"]));
    assert!(refusal.contains("was measured at 77 GHz and `my-paint` claims 300 GHz"), "{refusal}");
}

#[test]
fn a_measured_curve_is_stored_with_its_circumstances() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    fs::write(folder.join("scan.csv"), curve(0.0, 60.0, 400)).unwrap();
    for _ in ["once", "again"] {
        let mut command = matdb(folder);
        let said = "fit scan.csv --save cotton --kind measured --starts 1 --source bench \
                    --licence CC0-1.0 --instrument Radar --frequency 300 --threshold -77";
        command.args(said.split_whitespace()).assert().success();
    }
    let store = matdb::store::Store::open_existing(folder.join("matdb.sqlite")).unwrap().unwrap();
    let material = store.get(&"cotton".parse().unwrap(), None).unwrap().unwrap().material;
    let curve = material.curves.iter().find(|curve| curve.name == "scan").unwrap();
    assert_eq!(material.instruments.iter().filter(|known| known.name == "Radar").count(), 1);
    let named = |i: &&matdb::material::Instrument| Some(&i.key) == curve.instrument.as_ref();
    let instrument = material.instruments.iter().find(named).unwrap();
    assert_eq!((instrument.name.as_str(), instrument.centre_frequency_hz), ("Radar", 300e9));
    assert!((instrument.threshold_w.unwrap() / 1.995e-11 - 1.0).abs() < 1e-3, "-77 dBm");
    let source = material.sources.iter().find(|source| source.key == curve.source).unwrap();
    assert_eq!(source.licence.as_deref(), Some("CC0-1.0"));
}
