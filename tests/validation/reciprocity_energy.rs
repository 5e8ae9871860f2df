//! Reciprocity and energy of every model that can be stored.

use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec3;
use matdb::brdf::{Brdf, Scattering};
use matdb::frames::{Direction, Surface};
use matdb::material::builtin;
use matdb::radar::random::{Draws, Key, Purpose};
use rayon::prelude::*;

use super::page::{Row, Section, Table, Tolerance::Below};
use super::quadrature::{graded_edges, points, sorted};

/// Rounding of a symmetric formula whose two ways round differ in the order of its operations.
const RECIPROCAL: f64 = 1e-12;

/// One, the 0.35 % of the approximation of Beckmann's G1, and the quadrature.
const ALL_OF_IT: f64 = 1.005;

/// Change of an albedo when every panel gets twice the nodes.
const CONVERGED: f64 = 1e-3;

const NODES: usize = 6;

/// Enough for the ridges of a grain.
const AZIMUTH_PANELS: u32 = 8;

const ANGLES_DEG: [f64; 14] =
    [0.0, 10.0, 20.0, 30.0, 40.0, 50.0, 60.0, 70.0, 75.0, 80.0, 83.0, 85.0, 87.0, 89.0];

const NO_SHADOWING: &str = "The model has no shadowing.";
const BLINN_PHONG: &str = "The paper's model is not normalised; r_s up to 1/4 is safe for any α.";
const MIXED: &str = "Each part keeps energy, but nothing bounds a sum.";

const BUILT_IN: &str = "built-in material";

/// Model as a material file has it (in JSON), what to call it, and why it breaks energy if it does.
type Entry = (&'static str, &'static str, Option<&'static str>);

/// Metals that keep next to nothing, white diffusers and mirrors: the most that can come back.
const MODELS: [Entry; 33] = [
    ("white", r#"{"model":"lambert","albedo":1}"#, None),
    ("r_s = 0.25, α = 0", r#"{"model":"blinn-phong","r_s":0.25,"alpha":0}"#, None),
    ("r_s = 0.25, α = 1000", r#"{"model":"blinn-phong","r_s":0.25,"alpha":1000}"#, None),
    ("r_s = 1, α = 3", r#"{"model":"blinn-phong","r_s":1,"alpha":3}"#, Some(BLINN_PHONG)),
    ("r_s = 1, α = 1000", r#"{"model":"blinn-phong","r_s":1,"alpha":1000}"#, Some(BLINN_PHONG)),
    ("Beckmann, m = 0.03", r#"{"model":"cook-torrance","f_lambda":1,"m":0.03}"#, None),
    ("Beckmann, m = 0.3", r#"{"model":"cook-torrance","f_lambda":1,"m":0.3}"#, None),
    ("Beckmann, m = 1", r#"{"model":"cook-torrance","f_lambda":1,"m":1}"#, None),
    (
        "Beckmann, m = 0.3, correlated",
        r#"{"model":"cook-torrance","f_lambda":1,"m":0.3,"shadowing":"correlated"}"#,
        None,
    ),
    (
        "Beckmann, m = 1, correlated",
        r#"{"model":"cook-torrance","f_lambda":1,"m":1,"shadowing":"correlated"}"#,
        None,
    ),
    (
        "Beckmann, m = 0.1 and 0.6 across",
        r#"{"model":"cook-torrance","f_lambda":1,"m":0.1,"m_across":0.6}"#,
        None,
    ),
    ("Beckmann, m = 0.3, f_λ = 0.04", r#"{"model":"cook-torrance","f_lambda":0.04,"m":0.3}"#, None),
    (
        "GGX, m = 0.03",
        r#"{"model":"cook-torrance","f_lambda":1,"m":0.03,"distribution":"ggx"}"#,
        None,
    ),
    (
        "GGX, m = 0.3",
        r#"{"model":"cook-torrance","f_lambda":1,"m":0.3,"distribution":"ggx"}"#,
        None,
    ),
    (
        "GGX, m = 0.3, correlated",
        r#"{"model":"cook-torrance","f_lambda":1,"m":0.3,"distribution":"ggx","shadowing":"correlated"}"#,
        None,
    ),
    (
        "GGX, m = 0.1 and 0.6 across",
        r#"{"model":"cook-torrance","f_lambda":1,"m":0.1,"m_across":0.6,"distribution":"ggx"}"#,
        None,
    ),
    (
        "−10 dB at 0°, −20 dB from 20° on",
        r#"{"model":"tabulated","theta_deg":[0,20],"sigma0_db":[-10,-20]}"#,
        None,
    ),
    (
        "0 dB at all angles",
        r#"{"model":"tabulated","theta_deg":[0,20],"sigma0_db":[0,0]}"#,
        Some("f = σ⁰/(4π·cos²θ) grows without bound where a level is held towards 90°."),
    ),
    (
        "half white, half mirror of m = 0.3",
        r#"{"model":"mixture","k":0.5,"diffuse":{"model":"lambert","albedo":1},
            "specular":{"model":"cook-torrance","f_lambda":1,"m":0.3}}"#,
        None,
    ),
    (
        "white and a mirror of m = 0.3, not weighted",
        r#"{"model":"sum","parts":[{"model":"lambert","albedo":1},
            {"model":"cook-torrance","f_lambda":1,"m":0.3}]}"#,
        Some(MIXED),
    ),
    (
        "metal, lobe 0.02 rad",
        r#"{"model":"fresnel","eps_real":1,"eps_imag":1e9,"lobe_rad":0.02}"#,
        None,
    ),
    (
        "water, lobe 0.1 rad",
        r#"{"model":"fresnel","eps_real":4.67,"eps_imag":5,"lobe_rad":0.1}"#,
        None,
    ),
    (
        "paint on metal, lobe 0.05 rad",
        r#"{"model":"layered","eps_real":1,"eps_imag":1e9,"lobe_rad":0.05,
            "layers":[{"thickness_m":2e-4,"eps_real":2.6}]}"#,
        None,
    ),
    (
        "Gaussian, s = 50 µm, l = 1 mm",
        r#"{"model":"kirchhoff","rms_height_m":5e-5,"correlation_length_m":1e-3,
            "eps_real":1,"eps_imag":1e9}"#,
        Some(NO_SHADOWING),
    ),
    (
        "Gaussian, s = 0.3 mm, l = 2 mm",
        r#"{"model":"kirchhoff","rms_height_m":3e-4,"correlation_length_m":2e-3,
            "eps_real":1,"eps_imag":1e9}"#,
        Some(NO_SHADOWING),
    ),
    (
        "exponential, s = 0.3 mm, l = 2 mm",
        r#"{"model":"kirchhoff","rms_height_m":3e-4,"correlation_length_m":2e-3,
            "correlation":"exponential","eps_real":1,"eps_imag":1e9}"#,
        Some(NO_SHADOWING),
    ),
    (
        "slope 0.1",
        r#"{"model":"kirchhoff-go","rms_slope":0.1,"eps_real":1,"eps_imag":1e9}"#,
        Some(NO_SHADOWING),
    ),
    (
        "slope 0.2",
        r#"{"model":"kirchhoff-go","rms_slope":0.2,"eps_real":1,"eps_imag":1e9}"#,
        Some(NO_SHADOWING),
    ),
    (
        "slope 0.4",
        r#"{"model":"kirchhoff-go","rms_slope":0.4,"eps_real":1,"eps_imag":1e9}"#,
        Some(NO_SHADOWING),
    ),
    ("S = 1, α_R = 1", r#"{"model":"directive","s":1,"alpha_r":1}"#, None),
    ("S = 1, α_R = 50", r#"{"model":"directive","s":1,"alpha_r":50}"#, None),
    ("S = 1, α_R = 200", r#"{"model":"directive","s":1,"alpha_r":200}"#, None),
    (
        "S = 1, Λ = 0.5, α_R = 10, α_i = 30",
        r#"{"model":"directive","s":1,"alpha_r":10,"lambda":0.5,"alpha_i":30}"#,
        None,
    ),
];

/// A model with its name in the page's tables.
struct Judged {
    kind: String,
    name: String,
    model: Brdf,
    fails_because: Option<&'static str>,
}

impl Judged {
    /// What returns the energy, for the page.
    fn of_what(&self) -> &'static str {
        if self.kind == BUILT_IN { " by a built-in material" } else { "" }
    }
}

fn judged() -> Vec<Judged> {
    let stored = MODELS.iter().map(|(name, json, fails_because)| {
        let value: serde_json::Value = serde_json::from_str(json).unwrap();
        let kind = value["model"].as_str().unwrap().to_owned();
        let model: Brdf = serde_json::from_value(value).unwrap();
        model.validate().unwrap();
        let name = format!("`{kind}`, {name},");
        Judged { kind, name, model, fails_because: *fails_because }
    });
    let built_in = builtin::names().map(|name| {
        let model = builtin::get(name).unwrap().unwrap().scattering().unwrap();
        let kind = BUILT_IN.to_owned();
        Judged { kind, name: format!("`{name}`"), model, fails_because: None }
    });
    stored.chain(built_in).collect()
}

fn anywhere(draws: &mut Draws) -> Direction<Surface> {
    let theta_rad = draws.uniform().acos();
    Direction::from_angles(theta_rad, 2.0 * PI * draws.uniform())
}

/// Mirrored by a facet whose slopes are up to 0.1.
fn mirrored(i: Direction<Surface>, draws: &mut Draws) -> Direction<Surface> {
    let mut slope = || 0.2 * (draws.uniform() - 0.5);
    let facet = DVec3::new(slope(), slope(), 1.0).normalize();
    Direction::new(2.0 * i.xyz().dot(facet) * facet - i.xyz()).unwrap()
}

/// Worst |f(i, o) − f(o, i)|/f over pairs of random directions.
fn worst_asymmetry(model: &Brdf, seed: u64) -> f64 {
    const PAIRS: u64 = 5000;
    let asymmetry = |chirp: u64| {
        let mut draws = Key { seed, chirp, sub_ray: 0, purpose: Purpose::Speckle }.draws();
        let i = anywhere(&mut draws);
        // Lobes are narrow: half of the pairs lie near the mirror direction.
        let o =
            if chirp.is_multiple_of(2) { anywhere(&mut draws) } else { mirrored(i, &mut draws) };
        let (there, back) = (model.f_per_sr(i, o), model.f_per_sr(o, i));
        if there == back { 0.0 } else { (there - back).abs() / there.max(back) }
    };
    (0..PAIRS).into_par_iter().map(asymmetry).reduce(|| 0.0, f64::max)
}

/// ∫ f cos θ_o dω_o over the hemisphere: panels that narrow towards the mirror direction, where
/// lobes are as narrow as cos θ_i across, and towards the horizon. Every model here is even in azimuth.
pub fn albedo(model: &Brdf, theta_i_rad: f64, nodes: usize) -> f64 {
    let i = Direction::from_angles(theta_i_rad, 0.0);
    let mut theta_edges = graded_edges((0.0, FRAC_PI_2), theta_i_rad, 4e-3);
    theta_edges.extend(graded_edges((0.0, FRAC_PI_2), FRAC_PI_2, 0.01));
    let thetas = points(nodes, &sorted(theta_edges));
    let mut azimuth_edges = graded_edges((0.0, PI), PI, 3e-4);
    azimuth_edges
        .extend((1..AZIMUTH_PANELS).map(|n| PI * f64::from(n) / f64::from(AZIMUTH_PANELS)));
    let azimuths = points(nodes, &sorted(azimuth_edges));
    let ring = |&(theta, weight): &(f64, f64)| {
        let around = azimuths.iter().map(|&(azimuth, weight)| {
            weight * model.f_per_sr(i, Direction::from_angles(theta, azimuth))
        });
        2.0 * weight * theta.cos() * theta.sin() * around.sum::<f64>()
    };
    thetas.iter().map(ring).sum()
}

/// What a model reflects at each of the angles.
fn albedos(model: &Brdf) -> Vec<f64> {
    ANGLES_DEG.par_iter().map(|deg| albedo(model, deg.to_radians(), NODES)).collect()
}

/// Angle in degrees and value of the largest.
fn largest(albedos: &[f64]) -> (f64, f64) {
    // The first of equals, which rounding must not choose.
    let pairs = std::iter::zip(ANGLES_DEG, albedos.iter().copied());
    pairs.fold((0.0, 0.0), |most, next| if next.1 > most.1 + 1e-6 { next } else { most })
}

fn reciprocity(models: &[Judged]) -> Vec<Row> {
    let mut worst: BTreeMap<&str, f64> = BTreeMap::new();
    for (seed, judged) in std::iter::zip(0.., models) {
        let found = worst.entry(&judged.kind).or_default();
        *found = found.max(worst_asymmetry(&judged.model, seed));
    }
    let row = |(kind, value): (&&str, &f64)| {
        Row::new(format!("`{kind}`: asymmetry"), *value, Below(RECIPROCAL))
    };
    worst.iter().map(row).collect()
}

/// The incidences of too large albedos, which are neighbours.
fn where_above(albedos: &[f64]) -> String {
    let above =
        |deg: &&f64| albedos[ANGLES_DEG.iter().position(|d| d == *deg).unwrap()] > ALL_OF_IT;
    let first = ANGLES_DEG.iter().find(above);
    let last = ANGLES_DEG.iter().rev().find(above);
    match (first, last) {
        (Some(first), Some(last)) => format!("from {first}° to {last}°"),
        _ => "nowhere".to_owned(),
    }
}

/// Rows of the energy table, and the change of the worst albedo with twice the nodes.
fn energy(models: &[Judged]) -> (Vec<Row>, f64) {
    let mut change: f64 = 0.0;
    let mut rows = Vec::new();
    for judged in models {
        let albedos = albedos(&judged.model);
        let (worst_deg, worst) = largest(&albedos);
        let finer = albedo(&judged.model, worst_deg.to_radians(), 2 * NODES);
        change = change.max((worst - finer).abs());
        let what = format!("{} at {worst_deg}°: energy returned{}", judged.name, judged.of_what());
        let row = Row::new(what, worst, Below(ALL_OF_IT)).digits(3);
        rows.push(match judged.fails_because {
            None => row,
            Some(reason) => {
                row.fails_because(format!("Above 1 {}. {reason}", where_above(&albedos)))
            }
        });
    }
    (rows, change)
}

pub fn section() -> Section {
    let models = judged();
    let (energy, change) = energy(&models);
    let angles = ANGLES_DEG.map(|deg| format!("{deg}")).join(", ");
    let tables = vec![
        Table {
            text: "Reciprocity: the worst |f(i, o) − f(o, i)|/f over 5000 pairs of directions for each set of \
                   parameters below, half of them near each other's mirror direction. The formulas are symmetric, so only rounding may remain."
                .to_owned(),
            rows: reciprocity(&models),
        },
        Table {
            text: format!(
                "Energy: the largest ∫ f cos θ_o dω_o over incidences of {angles} degrees, with parameters \
                 that reflect the most. Above 1 a surface reflects more than it receives. The tolerance allows 0.35 % \
                 for the approximation \
                 of Beckmann's G1, the rest for quadrature."
            ),
            rows: energy,
        },
        Table {
            text: "The quadrature: Gauss and Legendre's rule on panels that narrow towards the mirror \
                   direction and the horizon. The steps in Beckmann's G1 and in tabulated curves remain."
                .to_owned(),
            rows: vec![Row::new(
                "largest change of a number above with twice the nodes",
                change,
                Below(CONVERGED),
            )],
        },
    ];
    let title = "Reciprocity and energy";
    Section { title, tables, not_covered: vec!["Incidences beyond 89°."] }
}
