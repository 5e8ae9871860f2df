//! Promise: `matdb export` writes a material in other people's formats and says what got lost; what
//! the format can carry comes back the same; `matdb add --from` takes curves and optical constants in
//! and names every thing that is missing; nothing in a name or a damaged file gets out of its place.
//!
//! What the peers themselves say of every built-in material's exports, `tests/peers/check_exports.py` asks them;
//! docs/exchange.md has the answers. Their files are not kept here.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use crate::support::database::{complete, sample};
use crate::support::{matdb, refused, root};
use matdb::brdf::{Brdf, CookTorrance, Distribution, Lambert, Mixture, Scattering, Shadowing};
use matdb::catalogue::exchange::{Details, Foreign, Format, Subject, export};
use matdb::material::{Censor, Material, Observation, SourceKind, builtin};
use proptest::prelude::*;
use proptest::sample::Index;
use serde_json::Value;

const WATER: &str = "# this file is part of refractiveindex.info database
# copyright and related rights waived via CC0 1.0

REFERENCES: |
    M. N. Afsar and J. B. Hasted.
    <a href=\"https://doi.org/10.1364/JOSA.67.000902\"><i>J. Opt. Soc. Am.</i> <b>67</b>, 902 (1977)</a>
COMMENTS: |
    Heavy water (D<sub>2</sub>O) at 19.5 °C
DATA:
  - type: tabulated nk
    data: |
        666.7 2.28 0.722
        1000 2.43 0.915
        2000 3.02 1.146
CONDITIONS:
    temperature: 292.65
";

const CURVE: &str =
    "theta_deg,sigma0_db,censor,threshold_db\n0,-5,none,-33\n10,-12,none,-33\n30,,left,-33\n";

fn text(subject: &Subject, format: Format) -> String {
    let exported = export(subject, format, "out.file").unwrap();
    assert!(exported.lost.len() > 10 && !exported.lost.contains('\n'), "{}", exported.lost);
    String::from_utf8(exported.files[0].1.clone()).unwrap()
}

fn bare(material: &Material) -> Subject<'_> {
    let added_at = Some("2026-03-14T10:00:00Z");
    Subject { material, revision: Some(3), added_at, origin: None, curve: None }
}

fn given() -> Details {
    Details {
        slug: Some("water".parse().unwrap()),
        class: Some("liquid".to_owned()),
        ..Details::default()
    }
}

fn water(text: &str, given: &Details) -> Result<Material, String> {
    let read = Foreign::OpticalConstants.read("water.yml", text.as_bytes(), given);
    read.map(|(material, _)| material).map_err(|e| e.to_string())
}

#[test]
fn a_page_of_optical_constants_becomes_a_half_space() {
    let material = water(WATER, &given()).unwrap();
    // Of 449.67, 299.79 and 149.90 GHz one lies within a third of 300 GHz.
    let [entry] = material.permittivities.as_slice() else { panic!("{material:?}") };
    assert!((entry.frequency_hz - 299.792_458e9).abs() < 1.0);
    assert_eq!(entry.temperature_k, Some(292.65));
    assert_eq!(
        material.frequency_hz, [entry.frequency_hz; 2],
        "nothing is claimed where nothing was"
    );
    assert_eq!(material.theta_rad, [0.0, 5f64.to_radians()], "a mirror, near its normal");
    assert!((entry.real - (2.43f64.powi(2) - 0.915f64.powi(2))).abs() < 1e-12);
    assert!((entry.imaginary - 2.0 * 2.43 * 0.915).abs() < 1e-12);
    let n = num_complex::Complex::new(2.43, -0.915);
    let reflectance = ((n - 1.0) / (n + 1.0)).norm_sqr();
    let Brdf::Fresnel(mirror) = material.scattering().unwrap() else { panic!("not Fresnel") };
    assert!((mirror.reflectance(0.0) - reflectance).abs() < 1e-12);
    let source = &material.sources[0];
    assert_eq!(source.doi.as_deref(), Some("10.1364/JOSA.67.000902"));
    assert_eq!(source.licence.as_deref(), Some("CC0-1.0"));
    assert!(source.title.starts_with("M. N. Afsar and J. B. Hasted. J. Opt. Soc. Am. 67"));
    assert!(source.note.as_ref().unwrap().contains("Heavy water (D2O) at 19.5 °C"));
    assert!(material.unknown[0].contains("0.207542 GHz away"), "{}", material.unknown[0]);
}

#[test]
fn nothing_is_extrapolated_and_what_is_missing_is_named() {
    let far = Details { frequency_hz: Some(30e9), ..given() };
    let message = water(WATER, &far).unwrap_err();
    assert!(message.contains("ask for the frequency 149.89623 GHz"));
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("water.yml"), WATER).unwrap();
    let add = ["add", "--from", "water.yml", "--name", "water", "--class", "liquid"];
    let message = refused(matdb(folder.path()).args(add).args(["--frequency", "30"]));
    assert!(message.contains("(--frequency 149.89623)"), "{message}");
    matdb(folder.path()).args(add).args(["--frequency", "149.89623"]).assert().success();
    let message = water(&WATER.replace("CC0", "CC9"), &Details::default()).unwrap_err();
    for detail in ["name (my-paint)", "class (paint)", "licence (CC-BY-4.0)"] {
        assert!(message.contains(detail), "{message}");
    }
    for (from, to, expected) in [
        ("tabulated nk", "tabulated n", "3 numbers in a row"),
        ("tabulated nk", "formula 11", "formula 1 to 9"),
        ("1000 2.43 0.915", "1000 2.43 x", "line 13: \"x\" is not a finite number"),
        ("1000 2.43 0.915", "0 2.43 0.915", "line 13: a wavelength must be above 0"),
        ("DATA:", "DOTA:", "there is no DATA"),
        ("292.65", "-5", "cannot be"),
    ] {
        let message = water(&WATER.replacen(from, to, 1), &given()).unwrap_err();
        assert!(message.starts_with("water.yml: ") && message.contains(expected), "{message}");
    }
    let only_n = "DATA:\n  - type: tabulated n\n    data: |\n        1000 1.5\n";
    let cc0 = Details { licence: Some("CC0-1.0".to_owned()), ..given() };
    assert!(water(only_n, &cc0).unwrap_err().contains("n once and k once"));
}

#[test]
fn dispersion_formulas_are_theirs() {
    // By hand at 2 µm; each row is a formula, its coefficients and n.
    for (formula, coefficients, expected) in [
        (1, "0 1.2 0.1", (1.0f64 + 1.2 * 4.0 / (4.0 - 0.01)).sqrt()),
        (2, "0.1 1.2 0.1", (1.1f64 + 1.2 * 4.0 / (4.0 - 0.1)).sqrt()),
        (3, "2 0.1 2 0.4 -2", (2.0f64 + 0.4 + 0.1).sqrt()),
        (4, "2 1 2 0.5 2 0 0 0 0 0.25 2", (2.0f64 + 4.0 / (4.0 - 0.25) + 1.0).sqrt()),
        (5, "1.5 0.04 -2", 1.51),
        (6, "0.001 0.1 10.25", 1.011),
        (7, "1.4 0 0 0.01 0.001 0", 1.4 + 0.04 + 0.016),
        (8, "0.2 0 0 0.01", (1.48f64 / 0.76).sqrt()),
        (9, "2 1 3 0 0 0", 3f64.sqrt()),
    ] {
        let page = format!(
            "DATA:\n  - type: formula {formula}\n    wavelength_range: 1 3\n    coefficients: \
             {coefficients}\n  - type: tabulated k\n    data: |\n        2 0.5\n        4 0.5\n"
        );
        let given =
            Details { licence: Some("CC0-1.0".to_owned()), frequency_hz: Some(150e12), ..given() };
        let material = water(&page, &given).unwrap();
        let found = (material.permittivities[0].real + 0.25).sqrt();
        assert!((found - expected).abs() < 1e-12, "formula {formula}: {found} is not {expected}");
        assert_eq!(material.permittivities.len(), 1, "4 µm lies beyond the formula");
    }
}

#[test]
fn the_measured_constants_agree_with_their_summary() {
    let folder = root().join("../shared/data/thz-optical-constants");
    let Ok(summary) = fs::read_to_string(folder.join("summary_300GHz.csv")) else {
        eprintln!("skipped: the measured optical constants are not here");
        return;
    };
    let mut reader = csv::Reader::from_reader(summary.as_bytes());
    let mut seen = 0;
    for row in reader.records().map(Result::unwrap) {
        let Ok(bytes) = fs::read(folder.join(format!("source-yml/{}.yml", &row[0]))) else {
            continue;
        };
        let number = |column: usize| row[column].parse::<f64>().unwrap();
        let (material, _) = Foreign::OpticalConstants.read("page.yml", &bytes, &given()).unwrap();
        let Brdf::Fresnel(mirror) = material.scattering().unwrap() else { panic!("not Fresnel") };
        let [low, high] = material.frequency_hz.map(|hz| hz / 1e9);
        let nearest_ghz = if high == 300.0 { low } else { high };
        assert!((nearest_ghz - number(10)).abs() < 0.06, "{}: {nearest_ghz}", &row[0]);
        // The summary interpolates to 300 GHz, and nothing does here: what is far differs.
        let near = (nearest_ghz - 300.0).abs() < 0.7;
        let reflectance_db = 10.0 * mirror.reflectance(0.0).log10();
        let tolerance_db = if near { 0.02 } else { 0.2 };
        assert!((reflectance_db - number(5)).abs() < tolerance_db, "{}: {reflectance_db}", &row[0]);
        let ratio = mirror.eps_imag / number(4);
        assert!(!near || (ratio - 1.0).abs() < 0.01, "{}: {ratio}", &row[0]);
        seen += 1;
    }
    assert_eq!(seen, 13);
}

#[test]
fn a_curve_survives_csv_and_universal_brdf() {
    let material = complete("paint");
    let curve = &material.curves[0].observations;
    for (format, foreign) in
        [(Format::Csv, Foreign::Csv), (Format::UniversalBrdf, Foreign::UniversalBrdf)]
    {
        let text = text(&bare(&material), format);
        let given = Details {
            licence: Some("CC0-1.0".to_owned()),
            source: Some("bench".to_owned()),
            kind: Some(SourceKind::Measured),
            instrument: Some("Bench".to_owned()),
            frequency_hz: Some(300e9),
            threshold_w: Some(2e-11),
            ..given()
        };
        let (back, _) = foreign.read("back", text.as_bytes(), &given).unwrap();
        let back = &back.curves[0].observations;
        assert_eq!(back.len(), curve.len());
        for (a, b) in curve.iter().zip(back) {
            assert!((a.theta_i_rad - b.theta_i_rad).abs() < 1e-12 && b.is_retro());
            assert_eq!(a.censor, b.censor);
            let all = format == Format::Csv;
            let details = |o: &Observation| {
                let [xt_m, yt_m] = [0, 1].map(|axis| o.target_m.map(|place| place[axis]));
                [o.theta_sd_rad, o.power_w, o.range_m, o.chirp.map(f64::from), xt_m, yt_m]
            };
            let kept = details(a).into_iter().zip(details(b)).filter(|_| all);
            for (x, y) in [(a.sigma0, b.sigma0), (a.threshold_sigma0, b.threshold_sigma0)]
                .into_iter()
                .chain(kept)
            {
                assert_eq!(x.is_some(), y.is_some());
                assert!(x.zip(y).is_none_or(|(x, y)| (x - y).abs() <= 1e-12 * x.abs()));
            }
        }
    }
}

#[test]
fn a_universal_brdf_says_f_in_per_steradian_and_its_limits() {
    let material = complete("paint");
    let json: Value = serde_json::from_str(&text(&bare(&material), Format::UniversalBrdf)).unwrap();
    let data = &json["data"];
    let value = |key: &str, row: usize| data[key]["values"][row].as_f64().unwrap();
    for (row, point) in material.curves[0].observations.iter().enumerate() {
        assert!((value("wavelength_i", row) - 999.308_193).abs() < 1e-6);
        assert_eq!(value("theta_i", row), point.theta_i_rad);
        let per_f = 4.0 * PI * point.theta_i_rad.cos().powi(2);
        let f = value("BRDF", row);
        assert!((f - point.sigma0.unwrap_or(0.0) / per_f).abs() <= 1e-12 * f);
        // Calibration to 25 %, and speckle of 1.5 looks.
        let deviation = match point.censor {
            Censor::None => f * 0.25f64.hypot(1.0 / 1.5f64.sqrt()),
            _ => point.threshold_sigma0.unwrap() / per_f,
        };
        assert!((value("uBRDF", row) - deviation).abs() <= 1e-12 * deviation);
    }
    assert_eq!(data["adhoc_variables"]["censor"]["values"][2], "left");
    assert_eq!(json["metadata"]["timestamp"], "2026-03-14T00:00:00Z");
    // What nobody measured is a simulation.
    let stated = builtin::get("ptfe").unwrap().unwrap();
    let json: Value = serde_json::from_str(&text(&bare(&stated), Format::UniversalBrdf)).unwrap();
    assert_eq!(json["metadata"]["method"], "simulation");
    assert_eq!(json["metadata"]["software"]["name"], "matdb");
}

#[test]
fn universal_brdf_files_that_cannot_be_read_are_refused_in_place() {
    let material = complete("paint");
    let text = text(&bare(&material), Format::UniversalBrdf);
    for (from, to, expected) in [
        ("\"rad\"", "\"grad\"", "data.theta_i: has no unit"),
        ("\"μm\"", "\"miles\"", "data.wavelength_i: has no unit"),
        ("\"left\"", "\"gone\"", "data.censor: has another word"),
        ("\"data\": {", "\"data\": [", "not JSON"),
        ("\"data\"", "\"date\"", "data.theta_i"),
    ] {
        assert!(text.contains(from), "{from}");
        let damaged = text.replacen(from, to, 1);
        let message = Foreign::UniversalBrdf
            .read("paint.brdf", damaged.as_bytes(), &given())
            .unwrap_err()
            .to_string();
        assert!(message.starts_with("paint.brdf: ") && message.contains(expected), "{message}");
    }
}

#[test]
fn an_open_material_has_sorted_tables_of_our_model() {
    let mut material = complete("paint");
    material.status = matdb::material::Status::Active;
    let exported = export(&bare(&material), Format::OpenMaterial, "paint.xomp").unwrap();
    let names: Vec<&str> = exported.files.iter().map(|(name, _)| name.as_str()).collect();
    assert_eq!(names, ["paint.xomp", "paint_brdf.xompt", "paint_emp.xompt"]);
    let json = |file: usize| serde_json::from_slice::<Value>(&exported.files[file].1).unwrap();
    let (head, brdf, emp) = (json(0), json(1), json(2));
    assert_eq!(head["materialProperties"]["brdfUris"][0], "paint_brdf.xompt");
    assert_eq!(head["materialProperties"]["electromagneticPropertiesUri"], "paint_emp.xompt");
    assert_eq!(head["materialProperties"]["surfaceRoughness"]["surfaceHeightRms"], 2e-5);
    assert_eq!(head["metadata"]["materialVersion"], "3.0.0");
    let uuid = head["metadata"]["uuid"].as_str().unwrap();
    assert_eq!(uuid.split('-').map(str::len).collect::<Vec<_>>(), [8, 4, 4, 4, 12]);
    let rows = |table: &Value| -> Vec<Vec<f64>> {
        let numbers =
            |row: &Value| row.as_array().unwrap().iter().filter_map(Value::as_f64).collect();
        table.as_array().unwrap().iter().map(numbers).collect()
    };
    let table = rows(&brdf["brdf"]["lookupTable"]);
    assert!(table.len() > 100 && table.is_sorted());
    let model = material.scattering().unwrap();
    for row in table.iter().filter(|row| row[1] == row[2] && row[3] == 0.0) {
        assert!((row[4] / model.retro_per_sr(row[1]) - 1.0).abs() < 1e-9, "{row:?}");
    }
    let permittivities = rows(&emp["electromagneticProperties"]);
    assert!(permittivities.is_sorted() && permittivities.len() == 2);
    assert_eq!(permittivities[0][2..], [1.0, 0.0, 2.62, 0.0987]);
    // Of a curve only what was seen is known.
    material.render = "scan".to_owned();
    let exported = export(&bare(&material), Format::OpenMaterial, "paint.xomp").unwrap();
    let brdf: Value = serde_json::from_slice(&exported.files[1].1).unwrap();
    assert_eq!(brdf["brdf"]["lookupTable"].as_array().unwrap().len(), 2);
    assert!(exported.lost.contains("1 censored"), "{}", exported.lost);
}

/// A material that renders this model between 0 and 60°.
fn rendering(model: Brdf) -> Material {
    let mut material = sample("paint");
    material.theta_rad = [0.0, 60f64.to_radians()];
    material.fits[0].model = model;
    material.fits[0].covariance = None;
    material
}

#[test]
fn models_that_mitsuba_has_are_written_as_they_are() {
    let facets = Brdf::CookTorrance(CookTorrance {
        f_lambda: 0.25,
        m: 0.125,
        m_across: None,
        distribution: Distribution::Ggx,
        shadowing: Shadowing::Separable,
    });
    let diffuse = Box::new(Brdf::Lambert(Lambert { albedo: 0.5 }));
    let material =
        rendering(Brdf::Mixture(Mixture { k: 0.375, diffuse, specular: Box::new(facets) }));
    let xml = text(&bare(&material), Format::Mitsuba);
    // √0.25 = 1/2, so that the index is (1 + 1/2)/(1 − 1/2) = 3.
    let expected = "<bsdf type=\"blendbsdf\" version=\"3.0.0\" id=\"paint\">
    <float name=\"weight\" value=\"0.375\"/>
    <bsdf type=\"roughconductor\">
        <string name=\"distribution\" value=\"ggx\"/>
        <float name=\"alpha\" value=\"0.125\"/>
        <spectrum name=\"eta\" value=\"3\"/>
        <spectrum name=\"k\" value=\"0\"/>
    </bsdf>
    <bsdf type=\"diffuse\">
        <spectrum name=\"reflectance\" value=\"0.5\"/>
    </bsdf>
</bsdf>
";
    assert!(xml.ends_with(expected), "{xml}");
    assert!(!xml.contains("stand-ins"), "nothing was approximated: {xml}");
}

#[test]
fn other_models_get_the_nearest_and_its_error_is_said() {
    let paint = builtin::get("mannequin-paint").unwrap().unwrap();
    let lost = export(&bare(&paint), Format::Mitsuba, "paint.xml").unwrap().lost;
    let rms_db = lost.split(" by ").nth(1).unwrap().split(' ').next().unwrap();
    let rms_db: f64 = rms_db.parse().unwrap();
    assert!(rms_db > 0.0 && rms_db < 5.0, "{lost}");
    let lost = export(&bare(&paint), Format::Sionna, "paint.py").unwrap().lost;
    assert!(lost.contains("pattern misses the diffuse part of the backscatter by"), "{lost}");
    let water = water(WATER, &given()).unwrap();
    let python = text(&bare(&water), Format::Sionna);
    assert!(python.contains("scattering_coefficient=0.0"), "a mirror scatters nothing: {python}");
}

#[test]
fn a_lambertian_surface_is_sionnas_lambertian_pattern() {
    let mut material = rendering(Brdf::Lambert(Lambert { albedo: 0.04 }));
    let source = material.sources[0].key.clone();
    material.permittivities = complete("paint").permittivities;
    material.permittivities.truncate(1);
    let entry = &mut material.permittivities[0];
    (entry.frequency_hz, entry.source) = (300e9, source);
    // A good conductor reflects all of it: S² is the albedo.
    (entry.real, entry.imaginary) = (1.0, 1e8);
    material.frequency_hz = [300e9, 300e9];
    let python = text(&bare(&material), Format::Sionna);
    let value = |key: &str| -> f64 {
        let (_, rest) = python.split_once(&format!("    {key}=")).unwrap();
        rest.split(',').next().unwrap().parse().unwrap()
    };
    assert!((value("scattering_coefficient") - 0.2).abs() < 1e-3, "{python}");
    assert!(python.contains("scattering_pattern=\"lambertian\""), "{python}");
    // σ = ε″·2πf·ε₀ by hand: 1e8 · 16.6898 S/m.
    assert!((value("conductivity") / 1.668_97e9 - 1.0).abs() < 1e-4, "{python}");
}

#[test]
fn a_substance_of_two_sources_is_written_with_the_one_that_is_rendered() {
    let glass = builtin::get("glass").unwrap().unwrap();
    let sionna = text(&bare(&glass), Format::Sionna);
    let conductivity = sionna.split("conductivity=").nth(1).unwrap().split(',').next().unwrap();
    // 17.98 sigma/f = eps'', f in GHz.
    let expected = 0.30676 * 300.0 / 17.98;
    assert!((conductivity.parse::<f64>().unwrap() / expected - 1.0).abs() < 1e-2, "{sionna}");
    assert!(sionna.contains("relative_permittivity=5.79,"), "{sionna}");
    for slug in ["ceiling-board", "marble", "plasterboard", "plywood", "pmma", "wood"] {
        let material = builtin::get(slug).unwrap().unwrap();
        let lost = export(&bare(&material), Format::OpenMaterial, "a.xomp").unwrap().lost;
        assert!(!lost.contains("permittivity"), "{slug}: {lost}");
    }
    let nobody_says = Material { layers: Vec::new(), ..glass.clone() };
    let nothing = Material { permittivities: Vec::new(), ..nobody_says.clone() };
    for (material, expected) in
        [(nobody_says, "several permittivities"), (nothing, "no permittivity")]
    {
        for format in [Format::Sionna, Format::OpenMaterial] {
            let lost = export(&bare(&material), format, "a").unwrap().lost;
            assert!(lost.contains(expected), "{lost}");
        }
    }
}

#[test]
fn hostile_names_stay_in_their_place() {
    let mut material = sample("paint");
    let hostile = "--></bsdf>\"\"\"\r\nimport os # <script>&'\u{202e}\u{2028}\u{0}\\";
    material.name = hostile.to_owned();
    material.description = hostile.to_owned();
    material.unknown = vec![hostile.to_owned()];
    material.sources[0].title = hostile.to_owned();
    let xml = text(&bare(&material), Format::Mitsuba);
    assert!(
        xml.lines().filter(|line| !line.starts_with("<!--")).all(|line| !line.contains("script"))
    );
    for line in xml.lines().filter(|line| line.starts_with("<!--")) {
        let inner = line.strip_prefix("<!--").unwrap().strip_suffix("-->").unwrap();
        assert!(!inner.contains("--") && !inner.contains('\u{202e}'), "{line}");
    }
    let python = text(&bare(&material), Format::Sionna);
    for line in python.lines().filter(|line| line.contains("import os")) {
        assert!(line.starts_with('#'), "{line}");
    }
    assert!(!python.contains(['\r', '\u{2028}', '\u{202e}', '\u{0}']));
    let csv = text(&bare(&material), Format::Csv);
    assert!(
        csv.lines().filter(|line| line.contains("import os")).all(|line| line.starts_with('#'))
    );
    let json: Value = serde_json::from_str(&text(&bare(&material), Format::UniversalBrdf)).unwrap();
    assert_eq!(json["metadata"]["sample"]["name"], hostile);
}

#[test]
fn the_same_material_gives_the_same_bytes() {
    let material = complete("paint");
    for format in [Format::Csv, Format::UniversalBrdf, Format::OpenMaterial, Format::Sionna] {
        let once = export(&bare(&material), format, "x").unwrap();
        assert_eq!(once, export(&bare(&material), format, "x").unwrap());
    }
}

#[test]
fn the_commands_go_there_and_back() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::write(file("scan.csv"), CURVE).unwrap();
    fs::write(file("water.yml"), WATER).unwrap();
    let mut add = matdb(folder.path());
    add.args(["add", "--from", "water.yml", "--name", "water", "--class", "liquid"]);
    add.assert().success();
    let message =
        refused(matdb(folder.path()).args(["add", "--from", "scan.csv", "--name", "scan"]));
    // Every row says its threshold.
    for flag in ["--class", "--licence", "--source", "--kind", "--frequency", "--instrument"] {
        assert!(message.contains(flag) && !message.contains("--name"), "{message}");
    }
    fs::write(file("bare.csv"), "theta_deg,sigma0_db\n0,-5\n10,-12\n").unwrap();
    let message = refused(matdb(folder.path()).args(["add", "--from", "bare.csv"]));
    assert!(message.contains("--kind") && message.contains("--threshold"), "{message}");
    let known =
        ["--class", "paint", "--licence", "CC0-1.0", "--source", "bench", "--frequency", "300"];
    let measured = ["--kind", "measured", "--instrument", "radar", "--threshold", "-77"];
    let mut add = matdb(folder.path());
    add.args(["add", "--from", "scan.csv", "--name", "scan"]).args(known).args(measured);
    add.assert().success();
    for (format, name) in [
        ("csv", "a.csv"),
        ("universal-brdf", "a.brdf"),
        ("open-material", "a.xomp"),
        ("mitsuba", "a.xml"),
    ] {
        let mut command = matdb(folder.path());
        command.args(["export", "scan", "--as", format, "-o", name]).assert().success();
        assert!(file(name).exists());
    }
    for command in [&["near", "--curve", "a.csv"][..], &["near", "--curve", "scan.csv"]] {
        matdb(folder.path()).args(command).assert().success();
    }
    for curve in ["a.csv", "scan.csv"] {
        let arguments = ["fit", curve, "--model", "lambert", "--looks", "1"];
        matdb(folder.path()).args(arguments).assert().success();
    }
    for name in ["a.csv", "a.brdf"] {
        let slug = name.replace('.', "-");
        let mut command = matdb(folder.path());
        command.args(["add", "--from", name, "--name", &slug]).args(known).args(measured);
        command.assert().success();
    }
    let message =
        refused(matdb(folder.path()).args(["export", "scan", "--as", "sionna", "-o", "x.py"]));
    assert!(message.contains("permittivity") && !Path::new(&file("x.py")).exists(), "{message}");
    let message = refused(matdb(folder.path()).args(["add", "ptfe", "--class", "polymer"]));
    assert!(message.contains("foreign"), "{message}");
    matdb(folder.path())
        .args(["export", "water", "--as", "sionna", "-o", "x.py"])
        .assert()
        .success();
}

#[test]
fn a_curve_in_other_units_is_taken_with_a_word_about_it() {
    let folder = tempfile::tempdir().unwrap();
    let notes = |name: &str, rows: &str| {
        fs::write(
            folder.path().join("curve.csv"),
            format!("theta_deg,sigma0_db,threshold_db\n{rows}"),
        )
        .unwrap();
        let add = "add --from curve.csv --class paint --kind synthetic --source model --licence CC0-1.0 \
                   --frequency 300";
        let mut command = matdb(folder.path());
        let output = command.args(add.split_whitespace()).args(["--name", name]).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stderr).unwrap()
    };
    let radians = "0,-3,-40\n0.3,-8,-40\n0.6,-15,-40\n0.9,-20,-40\n1.2,-30,-40\n";
    assert!(notes("radians", radians).contains("above 1.2°; are they in degrees?"));
    let weak = "0,-3,-40\n20,-8,-4\n40,-15,-40\n60,-39.5,-39\n";
    let said = notes("weak", weak);
    assert!(said.contains("1 detection of curve `curve` lies below"), "{said}");
    assert!(said.contains("by up to 4.0 dB"), "{said}");
    let plain = "0,-3,-40\n20,-8,-40\n40,-15,-40\n50,-16,-40\n60,-39.5,-40\n";
    let said = notes("plain", plain);
    assert!(!said.contains("degrees?") && !said.contains("detection"), "{said}");
}

#[test]
fn a_threshold_without_its_instrument_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("curve.csv"), CURVE).unwrap();
    let add = "add --from curve.csv --name paint --class paint --kind synthetic --source model \
               --licence CC0-1.0 --frequency 300 --threshold -77";
    let add = || {
        let mut command = matdb(folder.path());
        command.args(add.split_whitespace());
        command
    };
    assert!(refused(&mut add()).contains("--instrument"));
    add().args(["--instrument", "Bench"]).assert().success();
    let shown = matdb(folder.path()).args(["show", "paint"]).output().unwrap();
    let shown = String::from_utf8(shown.stdout).unwrap();
    assert!(shown.contains("threshold -77 dBm") || shown.contains("threshold −77 dBm"), "{shown}");
}

#[test]
fn a_bare_curve_is_named_by_its_file_and_says_what_it_is_found_and_cited_by() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let output = matdb(folder.path()).args(arguments).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        [output.stdout, output.stderr].map(|text| String::from_utf8(text).unwrap())
    };
    fs::write(folder.path().join("spring.csv"), CURVE).unwrap();
    let add = "add --from spring.csv --name paint --class paint --tag matt --year 2026 --kind measured \
               --licence CC-BY --instrument Bench --frequency 3e11 --threshold 77 --source bench";
    let mut add: Vec<&str> = add.split_whitespace().collect();
    add.extend(["--author", "Doe, Jane", "--description", "Grey. Not known: its age"]);
    let [_, notes] = run(&add);
    for note in ["3e11 GHz; is that in GHz?", "below 77 dBm", "did you mean `CC-BY-4.0`?"] {
        assert!(notes.contains(note), "{note}: {notes}");
    }
    assert!(run(&["list", "--tag", "matt"])[0].contains("paint"));
    let [cited, _] = run(&["cite", "paint"]);
    for said in
        ["spring (measured): Doe, Jane: bench. 2026", "curve spring", "instrument radar, thr"]
    {
        assert!(cited.contains(said), "{said}: {cited}");
    }
    let [shown, _] = run(&["show", "paint"]);
    assert!(shown.contains("source spring (measured): Doe, Jane (2026): bench"), "{shown}");
    run(&["export", "paint", "--as", "csv", "-o", "own.csv"]);
    run(&["export", "paint", "--as", "mitsuba", "-o", "own.xml"]);
    run(&["publish", "site"]);
    for file in ["own.csv", "own.xml", "site/material/paint.html"] {
        let text = fs::read_to_string(folder.path().join(file)).unwrap();
        assert!(text.contains("Doe, Jane (2026): bench"), "{file}: {text}");
    }
    assert!(shown.contains("instrument radar: Bench, 3e11 GHz, threshold 77 dBm"), "{shown}");
    assert!(shown.contains("curve spring: 3 points, 1 of them below the threshold, from spring"));
    assert!(shown.contains("30°  < -33.0"), "{shown}");
    assert!(shown.contains("45°  nothing    15° outside"), "{shown}");

    let second = "theta_deg,sigma0_db\n0,-4\n10,-13\n20,-20\n25,-24\n";
    fs::write(folder.path().join("second.csv"), second).unwrap();
    run(&[
        "fit",
        "second.csv",
        "--model",
        "lambert",
        "--save",
        "paint",
        "--kind",
        "synthetic",
        "--source",
        "chosen",
        "--keep-render",
    ]);
    let [said, _] = run(&["export", "paint", "--as", "csv", "--curve", "second", "-o", "out.csv"]);
    assert!(said.contains("the curve `second` and not spring"), "{said}");
    let exported = fs::read_to_string(folder.path().join("out.csv")).unwrap();
    assert!(exported.contains("\n25,-24"));
    // What the file did not state is not made up.
    assert!(
        exported.contains("\ntheta_deg,sigma0_db,censor,threshold_db,theta_r_deg,delta_phi_deg\n")
    );
    let wrong = ["export", "paint", "--as", "csv", "--curve", "third", "-o", "out.csv"];
    let said = refused(matdb(folder.path()).args(wrong));
    assert!(said.contains("no curve `third`; there are: spring, second"), "{said}");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn damaged_bytes_never_panic(
        which in 0usize..3, changes in prop::collection::vec((any::<Index>(), any::<u8>()), 1..6),
    ) {
        let brdf = text(&bare(&complete("paint")), Format::UniversalBrdf);
        let (foreign, text) = [
            (Foreign::OpticalConstants, WATER),
            (Foreign::Csv, CURVE),
            (Foreign::UniversalBrdf, brdf.as_str()),
        ][which];
        let mut bytes = text.as_bytes().to_vec();
        for (index, byte) in changes {
            let at = index.index(bytes.len());
            bytes[at] = byte;
        }
        let given = Details {
            licence: Some("CC0-1.0".to_owned()),
            source: Some("bench".to_owned()),
            kind: Some(SourceKind::Synthetic),
            frequency_hz: Some(300e9),
            ..given()
        };
        if let Ok((material, _)) = foreign.read("file", &bytes, &given) {
            let model = material.scattering().unwrap();
            prop_assert!(model.sigma0(0.3).is_finite());
        }
    }
}
