//! Diffuse and rough surfaces as the program renders them, against integrals and closed forms.

use std::f64::consts::PI;

use glam::DVec3;
use serde_json::Value;

use super::fixture::{Beam, number, rows};
use super::page::{Row, Table, Tolerance::Within};
use super::quadrature::points;
use super::smooth::{
    Case, FACET_RAD, MANY, MEAN_DB, MOST, aims, beside, differences, glint_db, half_plane,
    share_db, sphere,
};
use super::stage::{Aim, Keys, Stage, part, plate};

const CHALK: &str = r#"{"model":"lambert","albedo":1}"#;

/// At 60° the beam's radius varies by a hundredth over the spot, which a single ray does not see.
const SLANTED_DB: f64 = 0.02;

/// Closed forms and one ray agree to the figures of a cloud; a numeric convolution of GGX to 0.01 dB.
const LOBE_DB: f64 = 0.01;

/// 4000 rays, up to 2.5 widths of the lobe.
const FLANK_DB: f64 = 0.05;

fn diffuse() -> Vec<Row> {
    let stage = Stage::with(&[("chalk", CHALK)]);
    let (edge, whole): (Vec<Value>, Vec<Value>) =
        rows("diffuse").into_iter().partition(|value| value["edge_w0"].is_number());
    let whole: Vec<Case> = whole.iter().map(whole_case).collect();
    let mut all = Vec::new();
    for (rays, kind) in [(1, "diffuse plate, one ray"), (MANY, "diffuse plate, 4000 rays")] {
        let keys = Keys { rays, ..Keys::default() };
        let found_db = stage.levels_db(&plate("chalk"), &aims(&whole), keys);
        all.extend(differences(&whole, &found_db, kind));
    }
    let edge: Vec<Case> = edge.iter().map(edge_case).collect();
    let keys = Keys { rays: MOST, ..Keys::default() };
    let found_db = stage.levels_db(&half_plane(&stage, "chalk"), &aims(&edge), keys);
    all.extend(differences(&edge, &found_db, "edge of a diffuse half plane"));
    all
}

fn whole_case(value: &Value) -> Case {
    let (z_m, tilt_deg) = (number(value, "z_m"), number(value, "tilt_deg"));
    let aim = Aim { yaw_rad: tilt_deg.to_radians(), ..Aim::facing(z_m) };
    let what = format!("z = {z_m:.2} m, tilt {tilt_deg}°");
    Case::new(aim, what, number(value, "ratio_db"), SLANTED_DB)
}

fn edge_case(value: &Value) -> Case {
    let beam = Beam::of_the_fixture();
    let (z_m, edge) = (number(value, "z_m"), number(value, "edge_w0"));
    let (edge_m, ratio_db) = (edge * beam.waist_m, number(value, "ratio_db"));
    let whole = beam.wavelength_m.powi(2) / (PI * beam.radius_m(z_m)).powi(2);
    Case {
        aim: Aim { at: DVec3::new(-edge_m, 0.0, 0.0), ..Aim::facing(z_m) },
        what: format!("z = {z_m} m, edge {edge} w₀ from the axis"),
        expected_db: ratio_db,
        allowed_db: MEAN_DB + share_db(10f64.powf(0.1 * ratio_db) / whole),
        fails_because: beside(edge_m, z_m),
    }
}

/// P·F·δ_w²/m_eff²·exp(−tan²θ/m_eff²)/cos⁵θ with m_eff² = m² + δ₀², dB.
fn beckmann_db(beam: &Beam, m: f64, z_m: f64, tilt_rad: f64) -> f64 {
    let seen2 = m * m + beam.delta0_rad * beam.delta0_rad;
    let lobe = (-tilt_rad.tan().powi(2) / seen2).exp() / seen2;
    10.0 * (beam.divergence2(z_m) * lobe / tilt_rad.cos().powi(5)).log10()
}

/// The same with the slopes of GGX, m²/(π·(m² + s²)²), convolved with exp(−s²/δ₀²)/(π·δ₀²) by quadrature.
fn ggx_db(beam: &Beam, m: f64, z_m: f64, tilt_rad: f64) -> f64 {
    const TURNS: u32 = 64;
    let (delta2, at) = (beam.delta0_rad * beam.delta0_rad, tilt_rad.tan());
    let width = beam.delta0_rad;
    let edges: Vec<f64> = (-28i32..=28).map(|n| at + 0.25 * width * f64::from(n)).collect();
    let mut density = 0.0;
    // Cartesian: across the tilt and along it, seven widths each way.
    for (x, weight_x) in points(4, &edges) {
        let along = (-(x - at).powi(2) / delta2).exp();
        let sum: f64 = (0..=8 * TURNS)
            .map(|n| {
                let y = 7.0 * width * (f64::from(n) / f64::from(4 * TURNS) - 1.0);
                let slope2 = x * x + y * y;
                (-y * y / delta2).exp() * (m / (m * m + slope2)).powi(2)
            })
            .sum();
        density += weight_x * along * sum * 7.0 * width / f64::from(4 * TURNS);
    }
    let convolved = density / PI / (PI * delta2);
    let smith = 2.0 / (1.0 + (1.0 + (m * at).powi(2)).sqrt());
    let level = PI * beam.divergence2(z_m) * convolved * smith / tilt_rad.cos().powi(5);
    10.0 * level.log10()
}

const ROUGHNESSES: [f64; 4] = [0.005, 0.02, 0.05, 0.2];
const PLACES_M: [f64; 5] = [-0.5, -0.2, 0.0, 0.2, 0.5];

/// Level in dB of a beam, m, z and tilt.
type Law = fn(&Beam, f64, f64, f64) -> f64;

fn lobes() -> Vec<Row> {
    let beam = Beam::of_the_fixture();
    let mut all = Vec::new();
    let laws: [(&str, Law); 2] = [("beckmann", beckmann_db), ("ggx", ggx_db)];
    for (distribution, law) in laws {
        for m in ROUGHNESSES {
            let json = format!(
                r#"{{"model":"cook-torrance","f_lambda":1,"m":{m},"distribution":"{distribution}","shadowing":"correlated"}}"#
            );
            let stage = Stage::with(&[("rough", &json)]);
            for (rays, allowed_db) in [(1, LOBE_DB), (MANY, FLANK_DB)] {
                let mut cases = Vec::new();
                for z_m in PLACES_M {
                    for yaw_rad in [0.0, 0.01, 0.02, 0.03] {
                        let aim = Aim { yaw_rad, ..Aim::facing(z_m) };
                        let what = format!("m = {m}, z = {z_m} m, tilt {yaw_rad} rad");
                        cases.push(Case::new(aim, what, law(&beam, m, z_m, yaw_rad), allowed_db));
                    }
                }
                let keys = Keys { rays, ..Keys::default() };
                let found_db = stage.levels_db(&plate("rough"), &aims(&cases), keys);
                let kind = format!("lobe of {distribution}, rays = {rays}");
                all.extend(differences(&cases, &found_db, &kind));
            }
        }
    }
    all
}

/// P·F·δ_w²/(m² + δ_w² + (w²/4)·(1/a + 1/R_c)²) at a sphere's apex.
fn rough_spheres() -> Vec<Row> {
    let beam = Beam::of_the_fixture();
    let mut all = Vec::new();
    for m in [0.02, 0.05] {
        let json = format!(r#"{{"model":"cook-torrance","f_lambda":1,"m":{m}}}"#);
        let stage = Stage::with(&[("rough", &json)]);
        for radius_m in [0.15, 0.5, -0.5] {
            let case = |z_m: f64| {
                let bend = 1.0 / radius_m + beam.curvature_per_m(z_m);
                let (delta2, half) = (beam.divergence2(z_m), 0.5 * beam.radius_m(z_m) * bend);
                let expected_db = 10.0 * (delta2 / (m * m + delta2 + half * half)).log10();
                let what = format!("a = {radius_m} m, m = {m}, z = {z_m} m");
                Case::new(Aim::facing(z_m), what, expected_db, glint_db(expected_db))
            };
            let cases = PLACES_M.map(case);
            let file = sphere(&stage, radius_m, FACET_RAD);
            let keys = Keys { rays: MOST, ..Keys::default() };
            let found_db = stage.levels_db(&part(&file, "", "rough", ""), &aims(&cases), keys);
            all.extend(differences(&cases, &found_db, "rough sphere"));
        }
    }
    all
}

/// The fixture's Monte Carlo leaves its own error; a height map has no cosines, which the law has.
fn screen_db(value: &Value) -> f64 {
    let cosines_db = 10.0 * 5.0 * (1.0 + number(value, "slope").powi(2)).sqrt().log10();
    0.1 + cosines_db
}

/// Surfaces whose heights the fixture draws, by `kirchhoff` and, where they are rough, by Beckmann's lobe.
fn drawn_heights() -> Vec<Row> {
    let mut all = Vec::new();
    let mut values = rows("rough");
    while let Some(first) = values.first().cloned() {
        let same = |value: &Value| {
            ["m", "correlation_length_m"].iter().all(|key| value[*key] == first[*key])
        };
        let (these, others): (Vec<Value>, Vec<Value>) = values.into_iter().partition(same);
        values = others;
        let [m, sd_m, length_m, g] =
            ["m", "rms_height_m", "correlation_length_m", "phase_variance"]
                .map(|key| number(&first, key));
        let kirchhoff = format!(
            r#"{{"model":"kirchhoff","rms_height_m":{sd_m},"correlation_length_m":{length_m},"correlation":"gaussian","eps_real":1,"eps_imag":1e9,"frequency_hz":300e9}}"#
        );
        let facets = format!(r#"{{"model":"cook-torrance","f_lambda":1,"m":{m}}}"#);
        let stage = Stage::with(&[("kirchhoff", &kirchhoff), ("facets", &facets)]);
        let case = |value: &Value| {
            let (z_m, slope) = (number(value, "z_m"), number(value, "slope"));
            let aim = Aim { yaw_rad: slope.atan(), ..Aim::facing(z_m) };
            let what = format!("m = {m}, l = {} mm, z = {z_m} m, slope {slope:.4}", 1e3 * length_m);
            Case::new(aim, what, number(value, "screen_total_db"), screen_db(value))
        };
        let cases: Vec<Case> = these.iter().map(case).collect();
        let keys = Keys { rays: 1, ..Keys::default() };
        let found_db = stage.levels_db(&plate("kirchhoff"), &aims(&cases), keys);
        all.extend(differences(&cases, &found_db, "`kirchhoff` on drawn heights"));
        // Below a phase variance of ten the geometric limit does not hold.
        if g > 10.0 {
            let found_db = stage.levels_db(&plate("facets"), &aims(&cases), keys);
            let wider = |case: Case| Case { allowed_db: case.allowed_db + 0.2, ..case };
            let cases: Vec<Case> = cases.into_iter().map(wider).collect();
            all.extend(differences(&cases, &found_db, "Beckmann's lobe on drawn heights"));
        }
    }
    all
}

/// What the program says of single rays on a sphere whose curvature they cannot know.
fn reported() -> Vec<Row> {
    let rough = r#"{"model":"cook-torrance","f_lambda":1,"m":0.02}"#;
    let stage = Stage::with(&[("rough", rough)]);
    let parts = part(&sphere(&stage, 0.15, FACET_RAD), "", "rough", "");
    let scan =
        "pattern = \"raster\"\nlines = 12\nchirps_per_line = 12\nwidth_m = 0.05\nheight_m = 0.05";
    let row = |(rays, expected): (usize, f64)| {
        stage.render_by(scan, &parts, Keys { rays, ..Keys::default() }, 144);
        let what = format!("sphere of 0.15 m, m = 0.02, rays = {rays}: limits that are reported");
        Row::new(what, stage.validity() as f64, Within(expected, expected)).digits(1)
    };
    [(1, 1.0), (16, 0.0)].map(row).into()
}

pub fn tables() -> Vec<Table> {
    let chalk = "An extended white diffuse plate against λ²·∫f·cos θ·u² by quadrature. At 60° one ray misses 0.02 dB, because the \
                 beam's radius varies through the depth of the spot. The straight edge of such a plate, −3.01 dB on the axis: N evenly spread \
                 rays misjudge a share by at most N^(−3/4)/2, as for sub-rays above.";
    let lobe = "Plates with a lobe of facets against P·δ_w²/m_eff²·exp(−tan²θ/m_eff²)/cos⁵θ, m_eff² = m² + δ₀²; for GGX \
                the slopes are convolved with exp(−s²/δ₀²)/(πδ₀²) by quadrature here. The tolerance is 0.01 dB for one ray, which \
                the program claims for its own convolution, and 0.05 dB for 4000 rays at tilts up to 2.5 δ₀. The apex of rough spheres \
                against P·δ_w²/(m² + δ_w² + (w²/4)(1/a + 1/R_c)²), with 10 000 rays and the tolerance of smooth spheres. A single ray \
                does not resolve the curvature: the program has to report that once.";
    let drawn = "Random heights with Gaussian correlation of length l and slope m = 2·(rms height)/l. The fixture draws \
                 such surfaces and integrates the beam over each; it asserts that the mean power is that of an integral over the \
                 correlation, which is the reference here. Its heights are along the beam, without cosines: the tolerance is 0.1 \
                 dB plus five cosines. `kirchhoff` gives the coherent and the incoherent part. Where the \
                 variance of the phase is 25, the lobe of facets must agree as well, within another 0.2 dB. Below 10 geometric \
                 optics does not hold.";
    let mut lobes = lobes();
    lobes.extend(rough_spheres());
    lobes.extend(reported());
    let tables = [(chalk, diffuse()), (lobe, lobes), (drawn, drawn_heights())];
    tables.map(|(text, rows)| Table { text: text.to_owned(), rows }).into()
}
