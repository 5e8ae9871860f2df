//! Slabs, sheets in front of one another, and corners by polarisation, against matrices and Fresnel's equations.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use glam::DVec3;
use num_complex::Complex;

use super::fixture::Beam;
use super::page::{Row, Table, Tolerance::Below};
use super::smooth::{BOUNCE, MANY, corner};
use super::stage::{Aim, Echo, Keys, MIRROR, Stage, part, part_at};

const C_M_PER_S: f64 = 299_792_458.0;
const ONE: Complex<f64> = Complex::new(1.0, 0.0);

/// The program leaves out waves that go to and fro between sheets, and tabulates its factors over the angle.
const LEVEL_DB: f64 = 0.01;
const RANGE_UM: f64 = 5.0;

/// Rays at 45° within the lobe's width, and their quadrature.
const CORNER_DB: f64 = 0.1;

/// A layer of ε = ε′ − jε″.
#[derive(Clone, Copy)]
struct Layer {
    thickness_m: f64,
    eps: Complex<f64>,
}

fn layer(thickness_m: f64, real: f64, loss: f64) -> Layer {
    Layer { thickness_m, eps: Complex::new(real, -loss) }
}

fn air(thickness_m: f64) -> Layer {
    layer(thickness_m, 1.0, 0.0)
}

/// Field along the edge or the surface, or across it.
#[derive(Clone, Copy)]
enum Field {
    S,
    P,
}

/// √ε·cos of the refracted angle, on the branch that decays.
fn inner(eps: Complex<f64>, sin2: f64) -> Complex<f64> {
    let root = (eps - sin2).sqrt();
    if root.im > 0.0 { -root } else { root }
}

/// Ratio of the tangential fields H and E of a wave in a medium.
fn admittance(eps: Complex<f64>, sin2: f64, field: Field) -> Complex<f64> {
    match field {
        Field::S => inner(eps, sin2),
        Field::P => eps / inner(eps, sin2),
    }
}

/// Reflection and transmission of layers in air before a half space, by Abelès' characteristic matrices.
fn abeles(
    layers: &[Layer],
    behind: Complex<f64>,
    cos: f64,
    frequency_hz: f64,
    field: Field,
) -> [Complex<f64>; 2] {
    let (sin2, k) = (1.0 - cos * cos, TAU * frequency_hz / C_M_PER_S);
    let mut electric = ONE;
    let mut magnetic = admittance(behind, sin2, field);
    for layer in layers.iter().rev() {
        let own = admittance(layer.eps, sin2, field);
        let phase = inner(layer.eps, sin2) * k * layer.thickness_m;
        let (sin, cos) = (Complex::<f64>::i() * phase.sin(), phase.cos());
        (electric, magnetic) =
            (cos * electric + sin / own * magnetic, sin * own * electric + cos * magnetic);
    }
    let front = admittance(ONE, sin2, field);
    let sum = front * electric + magnetic;
    [(front * electric - magnetic) / sum, 2.0 * front / sum]
}

/// Amplitude at a distance over the sweep of 27 GHz, by Hann's window, for `ways` of the wave.
fn swept(response: &dyn Fn(f64) -> Complex<f64>, ways: f64, x_m: f64) -> Complex<f64> {
    const COUNT: u32 = 400;
    let mut sum = 0.0 * ONE;
    for number in 0..COUNT {
        let share = (f64::from(number) + 0.5) / f64::from(COUNT);
        let frequency_hz = 300e9 + 27e9 * (share - 0.5);
        let weight = 2.0 * (PI * share).sin().powi(2) / f64::from(COUNT);
        let phase = ways * TAU * frequency_hz / C_M_PER_S * x_m;
        sum += weight * response(frequency_hz) * Complex::cis(phase);
    }
    sum
}

/// The highest power about a place, m, and where that is.
fn peak(power: &dyn Fn(f64) -> f64, about_m: f64, half_m: f64) -> (f64, f64) {
    let (mut best, mut middle_m, mut half_m) = ((0.0, about_m), about_m, half_m);
    while half_m > 2e-7 {
        for step in -24..=24 {
            let x_m = middle_m + half_m * f64::from(step) / 24.0;
            let power = power(x_m);
            best = if power > best.0 { (power, x_m) } else { best };
        }
        (middle_m, half_m) = (best.1, half_m / 10.0);
    }
    best
}

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

fn level(what: &str, echo: Echo, expected: f64, allowed_db: f64) -> Row {
    let error_db = (echo.db() - db(expected)).abs();
    Row::new(what, error_db, Below(allowed_db)).unit("dB")
}

/// A sheet's region and its place on the axis, m behind the focus.
fn sheet(name: &str, z_m: f64, turn_deg: f64, thickness_m: f64) -> String {
    let mesh = format!("size_m = [2, 2, 0]\nrotation_deg = [0, {turn_deg}, 0]");
    let region = format!("thickness_m = {thickness_m}");
    part_at(name, "builtin:plate", DVec3::new(0.0, 0.0, -z_m), &mesh, name, &region)
}

fn opaque(name: &str, z_m: f64) -> String {
    part_at(name, "builtin:plate", DVec3::new(0.0, 0.0, -z_m), "size_m = [4, 4, 0]", name, "")
}

fn materials() -> Stage {
    Stage::with(&[
        ("glassy", r#"{"model":"fresnel","eps_real":2.56,"eps_imag":0}"#),
        ("cloth", r#"{"model":"fresnel","eps_real":1.6,"eps_imag":0.08}"#),
        ("film", r#"{"model":"fresnel","eps_real":3.4248,"eps_imag":0.02181}"#),
        ("board", r#"{"model":"fresnel","eps_real":2.0,"eps_imag":0.05}"#),
        ("mirror", MIRROR),
        ("chalk", r#"{"model":"lambert","albedo":1}"#),
    ])
}

const KEYS: Keys<'static> = Keys { top: "", rays: 1, radar: "returns = \"all\"", more: "" };
const CLOTH_M: f64 = 0.5e-3;
const METAL: Complex<f64> = Complex::new(1.0, -1e9);

fn sheets() -> Vec<Row> {
    let stage = materials();
    let beam = Beam::of_the_fixture();
    let mut all = Vec::new();
    for (what, name, layer) in [
        ("slab of n = 1.6, 8 mm: level of the echo", "glassy", layer(8e-3, 2.56, 0.0)),
        ("cloth, 0.5 mm: level of the echo", "cloth", layer(CLOTH_M, 1.6, 0.08)),
    ] {
        let reflected = |f: f64| abeles(&[layer], ONE, 1.0, f, Field::S)[0];
        let (expected, _) = peak(&|x_m| swept(&reflected, 2.0, x_m).norm_sqr(), 0.0, 6e-3);
        let parts = sheet(name, 0.0, 0.0, layer.thickness_m);
        let echoes = stage.render(&parts, &[Aim::facing(0.0)], KEYS);
        all.push(level(what, echoes[0][0], expected, LEVEL_DB));
    }
    // Three surfaces, one matrix: the meshes are the front faces.
    let z_m = [-0.17, -0.07, 0.06];
    let layers =
        [layer(CLOTH_M, 1.6, 0.08), air(0.1 - CLOTH_M), layer(3e-3, 2.0, 0.05), air(0.13 - 3e-3)];
    let parts = sheet("cloth", z_m[0], 0.0, CLOTH_M)
        + &sheet("board", z_m[1], 0.0, 3e-3)
        + &opaque("mirror", z_m[2]);
    // The distance is that of the middle of the target, where the focus lies here.
    let echoes = &stage.render(&parts, &[Aim::facing(0.0)], KEYS)[0];
    assert_eq!(echoes.len(), 3);
    let reflected = |f: f64| abeles(&layers, METAL, 1.0, f, Field::S)[0];
    for ((echo, z_m), name) in echoes.iter().zip(z_m).zip(["cloth", "board", "metal"]) {
        let from_front_m = z_m + 0.17;
        let (power, range_m) =
            peak(&|x_m| swept(&reflected, 2.0, x_m).norm_sqr(), from_front_m + 2e-3, 9e-3);
        let expected = power / (1.0 + beam.zeta2(z_m));
        let what = format!("cloth, board and metal, the {name}: level of the echo");
        all.push(level(&what, *echo, expected, LEVEL_DB));
        let error_um = 1e6 * (echo.range_m - (8.0 - 0.17) - range_m).abs();
        let what = format!("cloth, board and metal, the {name}: apparent range");
        all.push(Row::new(what, error_um, Below(RANGE_UM)).unit("µm"));
    }
    all.extend(slanted(&stage));
    all
}

/// What chalk behind a slanting sheet loses there and back, for a field along s, along p, and between both.
fn slanted(stage: &Stage) -> Vec<Row> {
    let bare = stage.render(&opaque("chalk", 0.3), &[Aim::facing(0.0)], KEYS)[0][0];
    let mut all = Vec::new();
    for (name, sheet_of) in
        [("cloth", layer(CLOTH_M, 1.6, 0.08)), ("film", layer(125e-6, 3.4248, 0.02181))]
    {
        for degrees in [0.0f64, 20.0, 40.0, 60.0] {
            let [t_s, t_p] = passed(sheet_of, degrees.to_radians().cos());
            // Turned about the vertical, the sheet is met in a level plane: an upright field is s.
            let parts = sheet(name, -0.3, degrees, sheet_of.thickness_m) + &opaque("chalk", 0.3);
            for (turn_deg, amplitude) in
                [(0, t_s * t_s), (90, t_p * t_p), (45, 0.5 * (t_s * t_s + t_p * t_p))]
            {
                let radar = format!("returns = \"all\"\npolarisation.turn_deg = {turn_deg}");
                let keys = Keys { radar: &radar, ..KEYS };
                let echoes = &stage.render(&parts, &[Aim::facing(0.0)], keys)[0];
                let behind = echoes.last().unwrap();
                let error_db = (behind.db() - bare.db() - db(amplitude.norm_sqr())).abs();
                let what = format!(
                    "chalk behind {name} at {degrees}°, field {turn_deg}° from upright: loss there and back"
                );
                all.push(Row::new(what, error_db, Below(LEVEL_DB)).unit("dB"));
            }
        }
    }
    all
}

/// Amplitudes of s and p one way through a layer, relative to air, where their power together is highest.
fn passed(layer: Layer, cos: f64) -> [Complex<f64>; 2] {
    let response = |frequency_hz: f64, field: Field| {
        let k = TAU * frequency_hz / C_M_PER_S;
        abeles(&[layer], ONE, cos, frequency_hz, field)[1]
            * Complex::cis(k * cos * layer.thickness_m)
    };
    let at = |x_m: f64| [Field::S, Field::P].map(|field| swept(&|f| response(f, field), 1.0, x_m));
    let (_, x_m) = peak(&|x_m| at(x_m).iter().map(Complex::norm_sqr).sum(), 0.0, 8e-3);
    at(x_m)
}

/// |r|² of a half space, by Fresnel's equations.
fn reflectance(eps: Complex<f64>, cos: f64, field: Field) -> f64 {
    abeles(&[], eps, cos, 300e9, field)[0].norm_sqr()
}

fn corners() -> Vec<Row> {
    let glass = Complex::new(5.8, 0.0);
    let water = Complex::new(4.67, -5.0);
    let stage = Stage::with(&[
        ("glass", r#"{"model":"fresnel","eps_real":5.8,"eps_imag":0}"#),
        ("water", r#"{"model":"fresnel","eps_real":4.67,"eps_imag":5}"#),
        ("mirror", MIRROR),
    ]);
    let file = corner(&stage);
    let mut all = Vec::new();
    for (name, eps) in [("glass", glass), ("water", water), ("mirror", METAL)] {
        for (sent, field, what) in [("vertical", Field::S, "VV"), ("horizontal", Field::P, "HH")] {
            let radar = format!("polarisation.transmit = \"{sent}\"");
            let keys = Keys { rays: MANY, radar: &radar, more: BOUNCE, ..KEYS };
            let parts = part(&file, "", name, "");
            let echo = stage.render(&parts, &[Aim::facing(0.0)], keys)[0][0];
            let expected = reflectance(eps, FRAC_PI_4.cos(), field).powi(2);
            let what = format!("{name}, {what}: level of a corner");
            all.push(level(&what, echo, expected, CORNER_DB));
        }
    }
    // S_vv = −S_hh: at 45° all is crossed.
    let radar = "polarisation.turn_deg = 45\npolarisation.receive = \"both\"";
    let keys = Keys { rays: MANY, radar, more: BOUNCE, ..KEYS };
    let co = stage.render(&part(&file, "", "mirror", ""), &[Aim::facing(0.0)], keys);
    let cross = stage.cloud("out/cross-cloud.ply", 1);
    all.push(level(
        "mirror, field at 45° to the edge, crossed: level of a corner",
        cross[0][0],
        1.0,
        CORNER_DB,
    ));
    let kept = co[0].first().map_or(0.0, |echo| echo.ratio);
    all.push(Row::new(
        "mirror, field at 45° to the edge: share that is not crossed",
        kept,
        Below(1e-3),
    ));
    all
}

pub fn tables() -> Vec<Table> {
    let sheets = "Sheets against one characteristic matrix (Abelès) of the whole stack, transformed over the sweep of 27 GHz \
                  with a Hann window. Chalk behind a slanting sheet of cloth or of 125 µm polyimide: |t_s|⁴, |t_p|⁴, and |t_s² + t_p²|²/4 \
                  for a field at 45°. The program leaves out waves that go to and fro between two sheets and interpolates \
                  over the angle: the tolerances are 0.01 dB and 5 µm.";
    let corners = "Two smooth plates at right angles with an upright edge on the axis, against Fresnel at 45°: |r_s|⁴ for VV, \
                   |r_p|⁴ for HH. For a metal S_vv = −S_hh, so that a field at 45° to the edge is crossed. The finite \
                   number of rays costs 0.02 dB; the tolerance is 0.1 dB.";
    let tables = [(sheets, self::sheets()), (corners, self::corners())];
    tables.map(|(text, rows)| Table { text: text.to_owned(), rows }).into()
}
