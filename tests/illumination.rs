//! Promise: a curve keeps the form of the footprint that it was reduced with and the beam that it was measured with,
//! wherever it goes. Curves of two forms are converted or refused, a fit through a beam finds the surface's own lobe,
//! no beam widens a lobe twice, and a law that reflects more than it receives is named.

use std::f64::consts::PI;
use std::fs;
use std::path::Path;

use crate::support::{self, matdb, refused};
use matdb::brdf::{Brdf, Scattering, ThroughBeam};
use matdb::radar::random::{Key, Purpose};
use serde_json::Value;

/// Divergence of the beam of the curves here, rad.
const BEAM_RAD: f64 = 0.0117;

/// A curve's CSV: σ⁰ as a ratio at every whole degree from 0 to 60, and how its target was lit.
fn curve(sigma0: impl Fn(f64) -> f64, lit: &str) -> String {
    let names = if lit.is_empty() { "" } else { ",footprint,beam_rad" };
    let mut text = format!("theta_deg,sigma0_db{names}\n");
    for degree in 0..=60 {
        let level_db = 10.0 * sigma0(f64::from(degree).to_radians()).log10();
        text += &format!("{degree},{level_db:.6}{lit}\n");
    }
    text
}

/// 4π·f·cos²θ of the paper's diffuse law.
fn paint(theta_rad: f64) -> f64 {
    let f_per_sr = 0.1 * (3.0 + 2.0) / (2.0 * PI) * theta_rad.cos().powi(3);
    4.0 * PI * f_per_sr * theta_rad.cos().powi(2)
}

fn run(folder: &Path, line: &str) -> (String, String) {
    let output = matdb(folder).args(line.split(' ')).output().unwrap();
    let [out, err] = [output.stdout, output.stderr].map(|b| String::from_utf8(b).unwrap());
    assert!(output.status.success(), "{line}: {err}");
    (out, err)
}

fn json(folder: &Path, line: &str) -> Value {
    serde_json::from_str(&run(folder, &format!("{line} --json")).0).unwrap()
}

/// A material of the curve in a file.
fn add(folder: &Path, file: &str, name: &str) {
    let details = "--class paint --licence CC0-1.0 --kind synthetic --source made --frequency 300";
    run(folder, &format!("add -q --from {file} --name {name} {details}"));
}

#[test]
fn a_curve_keeps_its_footprint_and_its_beam_wherever_it_goes() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("scan.csv"), curve(paint, ",projected,0.0117")).unwrap();
    add(at, "scan.csv", "lit");
    let lit = |database: &str, name: &str| {
        let shown = json(at, &format!("show {name} --db {database}"));
        let curve = &shown["material"]["curves"][0];
        assert_eq!(curve["footprint"], "projected", "{database} {name}");
        assert_eq!(curve["beam_rad"], BEAM_RAD, "{database} {name}");
    };
    lit("matdb.sqlite", "lit");
    let (text, _) = run(at, "show lit");
    assert!(text.contains("footprint projected (cos of the incidence once); beam of 11.7 mrad"));
    for (format, file) in [("csv", "out.csv"), ("universal-brdf", "out.brdf")] {
        run(at, &format!("export lit --as {format} -o {file} -q"));
        let name = format!("from-{}", file.rsplit('.').next().unwrap());
        add(at, file, &name);
        lit("matdb.sqlite", &name);
    }
    run(at, "publish site -q");
    run(at, "verify site -q");
    let table = fs::read_to_string(at.join("site/tables/curve_illumination.csv")).unwrap();
    assert!(table.contains("projected,0.0117"), "{table}");
    let points = fs::read_to_string(at.join("site/material/lit.csv")).unwrap();
    assert!(
        points.lines().next().unwrap().ends_with(",footprint,beam_rad,relative,only_detected"),
        "{points}"
    );
    assert!(points.lines().nth(1).unwrap().ends_with(",projected,0.011700,,"), "{points}");
    let page = fs::read_to_string(at.join("site/material/lit.html")).unwrap();
    assert!(page.contains("footprint projected (cos of the incidence once); beam of 11.7 mrad"));
    run(at, "import site --db other.sqlite -q");
    lit("other.sqlite", "lit");
    run(at, "check -q");
}

#[test]
fn a_curve_that_does_not_say_it_is_stored_as_not_stated() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("scan.csv"), curve(paint, "")).unwrap();
    add(at, "scan.csv", "bare");
    let shown = json(at, "show bare");
    assert!(shown["material"]["curves"][0].get("footprint").is_none(), "{shown}");
    assert!(run(at, "show bare").0.contains("footprint not stated; beam not stated"));
    run(at, "publish site -q");
    let (_, said) = run(at, "import site --db other.sqlite");
    assert!(said.contains("not stated of the curve of `bare`, `scan`"), "{said}");
}

#[test]
fn curves_of_two_footprints_are_converted_and_a_one_sided_statement_is_named_once() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let projected = |theta_rad: f64| paint(theta_rad) * theta_rad.cos();
    fs::write(at.join("paper.csv"), curve(paint, ",paper,")).unwrap();
    fs::write(at.join("projected.csv"), curve(projected, ",projected,")).unwrap();
    fs::write(at.join("unstated.csv"), curve(projected, "")).unwrap();
    add(at, "projected.csv", "stored");
    let nearest = |file: &str| {
        let output = matdb(at).args(["near", "--json", "--curve", file]).output().unwrap();
        let found: Value = serde_json::from_slice(&output.stdout).unwrap();
        let all = found["materials"].as_array().unwrap().clone();
        let own = all.into_iter().find(|near| near["slug"] == "stored").unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        (own["rms_db"].as_f64().unwrap(), said.matches("as they are").count())
    };
    // The same powers in two forms.
    let (rms_db, said) = nearest("paper.csv");
    assert!(rms_db < 1e-3 && said == 0, "{rms_db}");
    let (rms_db, said) = nearest("unstated.csv");
    assert!(rms_db < 1e-3 && said == 1, "{rms_db}: compared as they are, and said so");
    // Other powers, which differ by the cosine: 1.2 dB rms up to 60°.
    fs::write(at.join("other.csv"), curve(projected, ",paper,")).unwrap();
    assert!(nearest("other.csv").0 > 1.0);

    // Two revisions of a material: the same powers reduced in both forms, then in an unstated one.
    fs::copy(at.join("paper.csv"), at.join("scan.csv")).unwrap();
    add(at, "scan.csv", "twice");
    fs::copy(at.join("projected.csv"), at.join("scan.csv")).unwrap();
    add(at, "scan.csv", "twice");
    fs::copy(at.join("unstated.csv"), at.join("scan.csv")).unwrap();
    add(at, "scan.csv", "twice");
    let converted = json(at, "diff twice@1 twice@2");
    for levels in [&converted["curves"][0]["levels"], &converted["rendered"]] {
        assert!(levels["largest_db"].as_f64().unwrap() < 1e-3, "{converted}");
    }
    assert_eq!(converted["notices"].as_array().unwrap().len(), 1, "{converted}");
    let (_, said) = run(at, "diff twice@2 twice@3");
    assert_eq!(said.matches("on one side only: levels are compared as they are").count(), 1);
    assert!(converted["fields"].to_string().contains("curves.scan.footprint"), "{converted}");
}

const PLATE: &str = "
[radar]
FORM
[radar.scan]
pattern = \"raster\"
lines = 8
chirps_per_line = 8
width_m = 0.2
height_m = 0.2
[[mesh]]
name = \"plate\"
file = \"builtin:plate\"
size_m = [0.6, 0.6, 1]
translation_m = [0, 1.1, 0]
[[region]]
name = \"plate\"
material = \"MATERIAL\"
";

/// A scene of a plate that faces the radar.
fn plate(folder: &Path, form: &str, material: &str) {
    let scene = PLATE.replace("FORM", form).replace("MATERIAL", material);
    fs::write(folder.join("plate.toml"), scene).unwrap();
}

#[test]
fn a_comparison_refuses_another_footprint_than_that_of_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("scan.csv"), curve(paint, ",projected,")).unwrap();
    add(at, "scan.csv", "lit");
    plate(at, "", "lit");
    let (_, said) = run(at, "render plate.toml -o out");
    assert!(said.contains("`lit` was reduced with footprint projected"), "{said}");
    let compare = ["compare", "out/cloud.ply", "--scene", "plate.toml", "-o", "compared"];
    let said = refused(matdb(at).args(compare));
    assert!(
        said.contains("the scene has footprint paper") && said.contains("3 dB at 60°"),
        "{said}"
    );
    assert!(!at.join("compared").exists());
    plate(at, "footprint = \"projected\"", "lit");
    run(at, "render -q plate.toml -o out");
    run(at, "compare -q out/cloud.ply --scene plate.toml -o compared");
}

#[test]
fn measure_states_how_its_curve_was_lit() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // A sphere, since the clouds of a plate leave its pose open.
    plate(at, "footprint = \"projected\"", "spectralon");
    let scene = fs::read_to_string(at.join("plate.toml")).unwrap();
    let scene = scene.replace("builtin:plate", "builtin:sphere").replace("= 8", "= 40");
    fs::write(at.join("ball.toml"), scene.replace("size_m = [0.6, 0.6, 1]", "scale = 0.4"))
        .unwrap();
    run(at, "add -q spectralon");
    run(at, "render -q ball.toml -o out");
    let line = "measure out/cloud.ply --scene ball.toml --exact-mesh -o measured --save spectralon \
                --kind synthetic --source made";
    let (text, _) = run(at, &line.split_whitespace().collect::<Vec<_>>().join(" "));
    assert!(text.contains("footprint projected"), "{text}");
    let csv = fs::read_to_string(at.join("measured/curve.csv")).unwrap();
    assert!(csv.lines().next().unwrap().ends_with(",footprint,beam_rad"), "{csv}");
    let pose: Value =
        serde_json::from_slice(&fs::read(at.join("measured/pose.json")).unwrap()).unwrap();
    let stored = &json(at, "show spectralon")["material"]["curves"];
    let stored = stored.as_array().unwrap().last().unwrap();
    for lit in [&pose["curve"], stored] {
        assert_eq!(lit["footprint"], "projected", "{lit}");
        // λ/(2π·w₀) with w₀ = 13.589 mm at the focus, and less where the beam has spread.
        let beam_rad = lit["beam_rad"].as_f64().unwrap();
        assert!((0.0110..0.0118).contains(&beam_rad), "{beam_rad}");
    }
}

/// A ball of 0.15 m between cuboids that hold its pose, seen with so many rays per spot.
fn ball(folder: &Path, name: &str, rays: usize) {
    let mut scene = format!(
        "[radar.scan]\npattern = \"raster\"\nlines = 80\nchirps_per_line = 80\nwidth_m = 0.4\nheight_m = 0.4\n\
         [spot]\nrays = {rays}\n[radar.speckle]\nlooks = 16\nform = \"independent\"\n"
    );
    for (mesh, shape) in [
        ("ball", "sphere\"\nsize_m = [0.3, 0.3, 0.3]\ntranslation_m = [-0.03, 1.1, -0.15]"),
        (
            "brick",
            "cuboid\"\nsize_m = [0.1, 0.3, 0.1]\ntranslation_m = [0.18, 1.1, -0.15]\nrotation_deg = [10, 20, 30]",
        ),
    ] {
        scene += &format!("[[mesh]]\nname = \"{mesh}\"\nfile = \"builtin:{shape}\n");
        scene += &format!("[[region]]\nname = \"{mesh}\"\nmesh = \"{mesh}\"\nmaterial = \"own\"\n");
    }
    fs::write(folder.join(name), scene).unwrap();
}

/// A radar sees a ball's lobe wider by the curvature within its spot, w/2a = 0.045 rad, which is as much as the roughness.
#[test]
fn a_fit_of_a_curved_target_finds_the_surfaces_own_lobe() {
    const M: f64 = 0.05;
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    stated(at, "own", "lobes = \"surface\"", &toml_law(M));
    let found = |rays: usize, measured_with: usize| {
        ball(at, "scene.toml", rays);
        run(at, "render -q scene.toml -o out");
        ball(at, "scene.toml", measured_with);
        let (_, said) =
            run(at, "measure out/cloud.ply --scene scene.toml --region ball -o measured");
        let fit = json(at, "fit measured/curve.csv --model mixture --looks 16 --starts 1");
        let estimates = fit["estimates"].as_array().unwrap();
        let m = estimates.iter().find(|estimate| estimate["name"] == "specular.m").unwrap();
        (m["value"].as_f64().unwrap(), said.matches("curved within the spot").count(), said)
    };
    // Four deviations, and a twentieth of m for facets of 7 mm and the rays of a spot.
    for rays in [1, 32] {
        let (m, said, text) = found(rays, rays);
        assert!((m / M - 1.0).abs() < 0.1, "{rays} rays: {m}");
        assert_eq!(said, 1, "{text}");
        assert_eq!(text.contains("write rays = 16 under [spot]"), rays == 1, "{text}");
    }
    // Without its curvature the target seems rougher: √(m² + (w/2a)²) = 0.0675.
    let (m, _, _) = found(32, 1);
    assert!((m / 0.0675 - 1.0).abs() < 0.05, "{m}");
}

/// A lobe of this width over a diffuse floor, as a `material.toml` states it.
fn toml_law(m: f64) -> String {
    format!(
        "{{ model = \"mixture\", k = 0.1, specular = {{ model = \"cook-torrance\", f_lambda = 0.2, m = {m} }}, \
         diffuse = {{ model = \"blinn-phong\", r_s = 0.1, alpha = 3 }} }}"
    )
}

/// A lobe of this width over a diffuse floor.
fn lobe(m: f64) -> Brdf {
    let text = format!(
        r#"{{"model": "mixture", "k": 0.1,
            "specular": {{"model": "cook-torrance", "f_lambda": 0.2, "m": {m}}},
            "diffuse": {{"model": "blinn-phong", "r_s": 0.1, "alpha": 3}}}}"#
    );
    serde_json::from_str(&text).unwrap()
}

/// A curve of that lobe as the beam sees it, a point every tenth of a degree, with a scatter of 0.5 dB.
fn seen(m: f64, lit: &str) -> String {
    let law = lobe(m);
    let through = ThroughBeam { law: &law, beam_rad: BEAM_RAD };
    let names = if lit.is_empty() { "" } else { ",footprint,beam_rad" };
    let mut text = format!("theta_deg,sigma0_db{names}\n");
    for step in 0..500u32 {
        let theta_deg = f64::from(step) / 10.0;
        let key = Key { seed: 3, chirp: u64::from(step), sub_ray: 0, purpose: Purpose::Speckle };
        let level_db = 10.0 * through.sigma0(theta_deg.to_radians()).log10();
        text += &format!("{theta_deg},{:.4}{lit}\n", level_db + 0.5 * key.draws().gaussian());
    }
    text
}

/// The estimate of m, its deviation, and the verdict of a fit of the curve in a file.
fn fitted(folder: &Path, file: &str) -> (f64, Option<f64>, String) {
    let found = json(folder, &format!("fit {file} --model mixture --starts 2"));
    let estimates = found["estimates"].as_array().unwrap();
    let m = estimates.iter().find(|estimate| estimate["name"] == "specular.m").unwrap();
    (m["value"].as_f64().unwrap(), m["sd"].as_f64(), found["sentences"].to_string())
}

#[test]
fn a_fit_through_a_beam_finds_the_surfaces_own_lobe() {
    const M: f64 = 0.02;
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("lit.csv"), seen(M, ",paper,0.0117")).unwrap();
    fs::write(at.join("bare.csv"), seen(M, "")).unwrap();
    let (m, sd, verdict) = fitted(at, "lit.csv");
    // Four deviations: chance passes it once in 16 000 times.
    assert!((m - M).abs() < 4.0 * sd.unwrap(), "{m} ± {sd:?}");
    assert!(!verdict.contains("not resolved"), "{verdict}");
    let (seen_m, sd, _) = fitted(at, "bare.csv");
    let together = ThroughBeam { law: &lobe(M), beam_rad: BEAM_RAD }.sigma0(0.0);
    assert!((lobe(seen_m).sigma0(0.0) / together - 1.0).abs() < 0.2, "{seen_m} ± {sd:?}");

    run(at, "add -q cotton");
    for (file, name, lobes) in [("lit", "own", Some("surface")), ("bare", "both", None)] {
        let fit =
            format!("fit {file}.csv --model mixture --starts 1 --save cotton --fit-name {name}");
        let (text, _) = run(at, &format!("{fit} --kind synthetic --source made"));
        let words = match lobes {
            Some(_) => "lobes of the surface alone",
            None => "lobes of radar and surface together",
        };
        assert!(text.contains(words), "{text}");
        let shown = json(at, "show cotton");
        let fits = shown["material"]["fits"].as_array().unwrap();
        let stored = fits.iter().find(|fit| fit["name"] == name).unwrap();
        assert_eq!(stored.get("lobes").and_then(Value::as_str), lobes, "{stored}");
        assert!(run(at, "show cotton").0.contains(words));
        run(at, "export cotton --as csv -o out.csv -q");
        assert!(fs::read_to_string(at.join("out.csv")).unwrap().contains(words));
    }
    // Both describe one curve. Without the beam the surface's own lobe is 10·lg(1 + δ²/m²) = 1.3 dB higher.
    let changed = json(at, "diff cotton@2 cotton@3");
    assert!(changed["rendered"]["largest_db"].as_f64().unwrap() < 0.4, "{changed}");
    let (text, _) = run(at, "check");
    assert!(text.contains("all is well"), "{text}");
    run(at, "publish site -q");
    run(at, "verify site -q");
    let page = fs::read_to_string(at.join("site/material/cotton.html")).unwrap();
    assert!(page.contains("It has the lobes of the surface alone"), "{page}");
    let lobes = fs::read_to_string(at.join("site/tables/fit_lobes.csv")).unwrap();
    assert!(lobes.contains("own,surface") && !lobes.contains("both"), "{lobes}");
}

#[test]
fn a_lobe_within_its_error_of_zero_is_not_resolved() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    fs::write(at.join("lit.csv"), seen(0.001, ",paper,0.0117")).unwrap();
    let (_, _, verdict) = fitted(at, "lit.csv");
    assert_eq!(verdict.matches("specular.m is not resolved by this radar").count(), 1, "{verdict}");
}

/// A stated law with the mark of its lobes.
fn stated(folder: &Path, name: &str, lobes: &str, scattering: &str) {
    fs::create_dir_all(folder.join(name)).unwrap();
    let text = format!(
        "slug = \"{name}\"\nname = \"Stated\"\nclass = \"metal\"\nlicence = \"CC0-1.0\"\n\
         frequency_ghz = [290, 310]\ntheta_deg = [0, 80]\nrender = \"stated\"\n\
         [[source]]\nkey = \"made\"\nkind = \"synthetic\"\ntitle = \"Made\"\n\
         [[fit]]\nname = \"stated\"\nsource = \"made\"\n{lobes}\nscattering = {scattering}\n"
    );
    fs::write(folder.join(name).join("material.toml"), text).unwrap();
    run(folder, &format!("add -q --from {name}"));
}

/// The strongest echo of a plate over the power that a mirror would return, dB, and what was said.
fn strongest_db(folder: &Path, material: &str) -> (f64, String) {
    plate(folder, "footprint = \"projected\"\nsystem_loss_db = 0", material);
    let (_, said) = run(folder, "render plate.toml -o out");
    let record: Value =
        serde_json::from_slice(&fs::read(folder.join("out/scan.json")).unwrap()).unwrap();
    let sent_dbm = record["radar"]["transmit_power_dbm"].as_f64().unwrap();
    (record["power_dbm"]["strongest"].as_f64().unwrap() - sent_dbm, said)
}

#[test]
fn a_beam_widens_the_surfaces_own_lobe_and_no_other_lobe_again() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let narrow = "{ model = \"cook-torrance\", f_lambda = 1.0, m = 0.002 }";
    stated(at, "own", "lobes = \"surface\"", narrow);
    stated(at, "both", "lobes = \"radar-and-surface\"", narrow);
    let (own_db, said) = strongest_db(at, "own");
    assert!((-1.0..0.05).contains(&own_db), "a mirror returns what it was sent: {own_db} dB");
    assert!(!said.contains("narrower than this radar's beam"), "{said}");
    let (both_db, said) = strongest_db(at, "both");
    // It cannot be narrower than the beam that is a part of it, so that no more returns than was sent.
    assert!((-1.0..0.05).contains(&both_db), "{both_db} dB");
    assert_eq!(said.matches("narrower than this radar's beam").count(), 1, "{said}");
    let (text, _) = run(at, "check");
    assert!(text.contains("of 1 material scenes render lobes of the surface alone"), "{text}");
}

#[test]
fn a_law_that_reflects_more_than_it_receives_is_named_once() {
    const EXCESS: &str = "reflects 258 % of what it receives at an incidence of 0°, 158 % too much";
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    // 4·r_s·(α + 2^(−α/2))/(α + 4) at normal incidence.
    stated(at, "bright", "", "{ model = \"blinn-phong\", r_s = 0.9, alpha = 10 }");
    stated(at, "dim", "", "{ model = \"blinn-phong\", r_s = 0.3, alpha = 10 }");
    for material in ["bright", "dim"] {
        let (_, said) = strongest_db(at, material);
        assert_eq!(said.matches(EXCESS).count(), usize::from(material == "bright"), "{said}");
        assert_eq!(said.contains("reflects"), material == "bright", "{said}");
    }
    let (_, said) = run(at, "check");
    assert_eq!(said.matches(EXCESS).count(), 1, "{said}");
    assert!(!said.contains("`dim`"), "{said}");
    let law: Brdf =
        serde_json::from_str(r#"{"model": "blinn-phong", "r_s": 0.9, "alpha": 10}"#).unwrap();
    let mut scattered = String::from("theta_deg,sigma0_db\n");
    for degree in 0..=60u32 {
        let key = Key { seed: 7, chirp: u64::from(degree), sub_ray: 0, purpose: Purpose::Speckle };
        let level_db = 10.0 * law.sigma0(f64::from(degree).to_radians()).log10();
        scattered += &format!("{degree},{:.4}\n", level_db + 0.4 * key.draws().gaussian());
    }
    fs::write(at.join("bright.csv"), scattered).unwrap();
    let (text, _) = run(at, "fit bright.csv --model blinn-phong --looks 100");
    assert_eq!(text.matches("too much; nothing is cut off").count(), 1, "{text}");
}

#[test]
fn a_publication_of_an_older_program_is_sound_and_says_that_no_footprint_is_stated() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let site = support::root().join("tests/fixtures/publication-of-schema-0011");
    let site = site.to_str().unwrap();
    let (text, said) = run(at, &format!("verify {site}"));
    assert!((text + &said).contains("whose schema is an older one"), "{said}");
    let (_, said) = run(at, &format!("import {site}"));
    assert_eq!(said.matches("not stated of the curve of `cotton`, `backscatter`").count(), 1);
    assert!(run(at, "show cotton").0.contains("footprint not stated; beam not stated"));
    run(at, "check -q");
}
