//! Nothing returns more than its law reflects: every built-in material and many models, as the program renders them.

use std::fmt::Write;

use glam::DVec3;
use matdb::brdf::Brdf;
use matdb::material::builtin;

use super::page::{Row, Table, Tolerance::Below};
use super::reciprocity_energy::albedo;
use super::smooth::sphere;
use super::stage::{Aim, Keys, MIRROR, Stage, part_at};

/// Quadrature of the albedo, and of the rays.
const ALL_OF_IT: f64 = 1.005;

/// Between the middles of two targets, m.
const PITCH_M: f64 = 0.5;

/// Targets in a row.
const COLUMNS: usize = 8;

/// Between two facets of a sphere, rad: under half of δ₀. Coarser facets hide part of a highlight, which would be no test.
const FACET_RAD: f64 = 0.005;

/// Shares that differ by less are equal: rounding must not choose whose is named.
const SAME: f64 = 1e-4;

/// Nodes of each panel of an albedo.
const NODES: usize = 6;

const ROUGHNESSES: [f64; 5] = [0.001, 0.005, 0.02, 0.1, 0.4];

/// A law, the name of its material, and the most that it reflects.
struct Judged {
    material: String,
    reflects: f64,
}

/// Mirrors and lobes of perfect reflectors, from smooth to rough.
fn models() -> Vec<(String, String)> {
    let metal = "\"eps_real\":1,\"eps_imag\":1e9";
    let mut all = vec![("smooth".to_owned(), MIRROR.to_owned())];
    all.push(("white".to_owned(), r#"{"model":"lambert","albedo":1}"#.to_owned()));
    all.push(("layers".to_owned(), format!(r#"{{"model":"layered","layers":[],{metal}}}"#)));
    for (number, alpha) in [1.0, 30.0, 1000.0].into_iter().enumerate() {
        // Blinn and Phong's law reflects at most what it receives up to this level, whatever α.
        let r_s = 0.25;
        let law = format!(r#"{{"model":"blinn-phong","r_s":{r_s},"alpha":{alpha}}}"#);
        all.push((format!("blinn-phong-{number}"), law));
    }
    for (number, alpha) in [1, 30, 200].into_iter().enumerate() {
        let law = format!(r#"{{"model":"directive","s":1,"alpha_r":{alpha}}}"#);
        all.push((format!("directive-{number}"), law));
    }
    for correlation in ["gaussian", "exponential"] {
        for um in [20, 80, 300] {
            let law = format!(
                r#"{{"model":"kirchhoff","rms_height_m":{um}e-6,"correlation_length_m":0.1,"correlation":"{correlation}",{metal}}}"#
            );
            all.push((format!("kirchhoff-{correlation}-{um}"), law));
        }
    }
    for (number, m) in ROUGHNESSES.into_iter().enumerate() {
        let law = format!(r#"{{"model":"kirchhoff-go","rms_slope":{m},{metal}}}"#);
        all.push((format!("slopes-{number}"), law));
        for distribution in ["beckmann", "ggx"] {
            for (kind, across) in [("round", ""), ("grained", ",\"m_across\":0.002")] {
                let law = format!(
                    r#"{{"model":"cook-torrance","f_lambda":1,"m":{m},"distribution":"{distribution}","shadowing":"correlated"{across}}}"#
                );
                all.push((format!("{distribution}-{kind}-{number}"), law));
            }
        }
    }
    all
}

/// The largest albedo at incidences up to the largest tilt.
fn reflects(law: &Brdf) -> f64 {
    let angles = [0.0f64, 20.0, 40.0, 60.0];
    angles.map(|degrees| albedo(law, degrees.to_radians(), NODES)).into_iter().fold(0.0, f64::max)
}

fn built_in() -> Vec<Judged> {
    let judged = |name: &str| {
        let law = builtin::get(name).unwrap().unwrap().scattering().unwrap();
        Judged { material: name.to_owned(), reflects: reflects(&law) }
    };
    builtin::names().map(judged).collect()
}

/// A target of each material; no material of one is seen through another.
fn parts(judged: &[Judged], file: &str, mesh: &str) -> (String, Vec<DVec3>) {
    let (mut text, mut places) = (String::new(), Vec::new());
    for (number, one) in judged.iter().enumerate() {
        let (row, column) = ((number / COLUMNS) as f64, (number % COLUMNS) as f64);
        let place = PITCH_M * DVec3::new(column, row, 0.0);
        let name = format!("target-{number}");
        write!(text, "{}", part_at(&name, file, place, mesh, &one.material, "")).unwrap();
        places.push(place);
    }
    (text, places)
}

/// The largest share of what its law reflects that a material returns, and that material.
fn most(
    stage: &Stage,
    judged: &[Judged],
    file: &str,
    mesh: &str,
    tilts: &[f64],
    rays: usize,
) -> (f64, String) {
    let (text, places) = parts(judged, file, mesh);
    let mut aims = Vec::new();
    let mut of_whom = Vec::new();
    for (number, at) in places.iter().enumerate() {
        for z_m in [-0.5, -0.2, 0.0, 0.2, 0.5] {
            for &yaw_rad in tilts {
                aims.push(Aim { at: *at, yaw_rad, ..Aim::facing(z_m) });
                of_whom.push(number);
            }
        }
    }
    let found_db = stage.levels_db(&text, &aims, Keys { rays, ..Keys::default() });
    let mut most = (0.0, String::new());
    for (number, found_db) in std::iter::zip(of_whom, found_db) {
        let share = 10f64.powf(0.1 * found_db) / judged[number].reflects;
        if share > most.0 + SAME {
            most = (share, judged[number].material.clone());
        }
    }
    most
}

fn rows(stage: &Stage, judged: &[Judged], whose: &str) -> Vec<Row> {
    let mut all = Vec::new();
    let plate = "size_m = [0.45, 0.45, 0]";
    let tilts = [0.0, 0.003, 0.02, 0.2, 1.0];
    let mut shapes = vec![("builtin:plate".to_owned(), plate, "plates".to_owned(), &tilts[..])];
    for radius_m in [0.05, 0.5, -1.2] {
        let file = sphere(stage, radius_m, FACET_RAD);
        shapes.push((file, "", format!("spheres of {radius_m} m"), &tilts[..3]));
    }
    for (file, mesh, what, tilts) in shapes {
        for rays in [1, 64] {
            let (share, material) = most(stage, judged, &file, mesh, tilts, rays);
            let what = format!(
                "{what}, rays = {rays}, most by `{material}`: returned over reflected by {whose}"
            );
            all.push(Row::new(what, share, Below(ALL_OF_IT)).digits(3));
        }
    }
    all
}

pub fn tables() -> Vec<Table> {
    let mut all = rows(&Stage::with(&[]), &built_in(), "built-in materials");
    let models = models();
    let materials: Vec<(&str, &str)> =
        models.iter().map(|(name, law)| (name.as_str(), law.as_str())).collect();
    let judged: Vec<Judged> =
        models.iter().map(|(name, _)| Judged { material: name.clone(), reflects: 1.0 }).collect();
    all.extend(rows(&Stage::with(&materials), &judged, "models"));
    let text = "The passive bound, over five distances from the focus, plates tilted by up to 1 rad and spheres by up to \
                0.02 rad: the largest ratio of received to sent power, divided by what the law reflects. For a built-in material that is the \
                largest ∫ f cos θ_o dω_o at 0, 20, 40 and 60 degrees; the models reflect everything. A concave sphere of \
                1.2 m fits the wavefront at 0.5 m, so that a mirror returns nearly all. The tolerance covers quadrature.";
    vec![Table { text: text.to_owned(), rows: all }]
}
