//! Promise: no scene, material or curve file makes the program panic, whatever numbers and words
//! stand in it; what is accepted renders to finite ranges and angles.

use std::path::Path;

use matdb::brdf::{Brdf, Lambert, Scattering};
use matdb::effects::{Level, Receiver, SceneEffects, resolve};
use matdb::formats::ColumnNames;
use matdb::material::file::{parse, points};
use matdb::radar::Pattern;
use matdb::render::{Bounce, Observer, Setup, Surface, power_image, shade, trace, trace_placed};
use matdb::scene::{Scene, SceneFile};
use matdb::trace::{Bvh, ScanGeometry};
use proptest::prelude::*;
use proptest::sample::{Index, select};

const SCENE: &str = r#"
seed = 1
[radar]
preset = "upm-300ghz"
centre_frequency_ghz = 300.0
bandwidth_ghz = 27.0
transmit_power_dbm = 7.0
aperture_m2 = 0.196
system_loss_db = 15.0
threshold_dbm = -77.0
footprint = "paper"
spot_diameter_m = 0.016
reflector_centre_m = [0.0, 0.0, 8.0]
secondary_focus_m = [0.0, 0.0, -8.0]
tau_deg = 0.0
primary_focus_m = [0.0, 1.1, 8.0]
alpha_deg = -90.0
[radar.scan]
pattern = "elliptical"
chirps = 97
field_height_m = 0.9
turns = 5.0
[radar.optics]
ellipse_width_m = 0.5
ellipse_height_m = 0.4
angular_magnification = 0.25
offset_deg = [0.0, 0.0]
[radar.chirp]
duration_s = 1e-5
samples = 2048
[radar.receiver]
window = "hann"
zero_padding = 1
noise_figure_db = 20.0
temperature_k = 290.0
false_alarm_probability = 0.01
gate_m = [6.0, 10.0]
[radar.speckle]
looks = 1.0
coherent_ratio = 0.0
[spot]
rays = 2
[bounce]
rays = 2
outside_spot_db = -20.0
[[receiver]]
name = "left"
position_m = [-1.0, 1.1, 5.0]
aperture_m2 = 0.1
[image]
pixel_m = 0.01
[[mesh]]
name = "a"
file = "builtin:cuboid"
scale = 1.0
size_m = [1.0, 1.0, 1.0]
rotation_deg = [10.0, 20.0, 30.0]
translation_m = [0.0, 1.1, 0.0]
[[region]]
name = "r"
material = "ptfe"
facets = { side = "+z" }
box = { min_m = [-9.0, -9.0, -9.0], max_m = [9.0, 9.0, 9.0] }
[[region]]
name = "s"
material = "ptfe"
sphere = { centre_m = [0.0, 0.0, 0.0], radius_m = 9.0 }
half_space = { point_m = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] }
[[region]]
name = "t"
material = "ptfe"
[[effect]]
name = "foreign-patch"
level_db = 3.0
centre_x_m = 0.1
centre_y_m = 0.1
radius_m = 0.1
[[effect]]
name = "angle-error"
sd_deg = 2.0
[[radar.effect]]
name = "drift"
slope_db = 1.0
waves_per_scan = 2.0
[[radar.effect]]
name = "compression"
saturation_dbm = -30.0
"#;

const MATERIAL: &str = concat!(
    include_str!("../materials/ptfe/material.toml"),
    "\n[[effect]]\nname = \"thin-film\"\ncoverage = 0.3\nthickness_m = 4e-4\nindex = 1.6\n"
);
const CURVE: &str = include_str!("../materials/cotton/backscatter.csv");

/// What a careless or hostile hand writes in place of a number or a word.
const STRANGE: [&str; 24] = [
    "0",
    "-0.0",
    "-1",
    "1e-300",
    "1e300",
    "-1e300",
    "nan",
    "inf",
    "-inf",
    "1e19",
    "1",
    "1e4",
    "2.5",
    "90",
    "9223372036854775807",
    "-9223372036854775808",
    "\"\"",
    "\"ptfe\"",
    "[]",
    "[1.0]",
    "{}",
    "true",
    "1e-5",
    "0.3",
];

/// Byte ranges of the numbers and words of a text.
fn tokens(text: &str) -> Vec<(usize, usize)> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || "+-._\"".contains(c);
    let mut tokens = Vec::new();
    let mut start = None;
    for (at, c) in text.char_indices().chain([(text.len(), ' ')]) {
        match (is_word(c), start) {
            (true, None) => start = Some(at),
            (false, Some(from)) => {
                tokens.push((from, at));
                start = None;
            }
            _ => {}
        }
    }
    tokens
}

/// The text with some of its tokens replaced.
fn damaged(text: &'static str) -> impl Strategy<Value = String> {
    let change = (any::<Index>(), select(&STRANGE[..]));
    prop::collection::vec(change, 1..4).prop_map(move |changes| {
        changes.into_iter().fold(text.to_owned(), |text, (index, strange)| {
            let tokens = tokens(&text);
            let (from, to) = tokens[index.index(tokens.len())];
            format!("{}{strange}{}", &text[..from], &text[to..])
        })
    })
}

fn render(text: &str) {
    let Ok(file) = SceneFile::parse(text) else { return };
    // Large counts are legal and slow; what they do to memory is bounded elsewhere.
    if matches!(&file.radar.scan, Pattern::Elliptical(e) if e.chirps > 100_000) {
        return;
    }
    let looks = file.radar.speckle.map_or(1.0, |speckle| speckle.looks);
    if looks * file.radar.chirp.samples as f64 > 1e5 {
        return;
    }
    let Ok(scene) = Scene::resolve(file, Path::new("scene.toml")) else { return };
    let bvh = Bvh::new(&scene.target.mesh);
    let rays = scene.file.spot.rays;
    let lambert = Lambert { albedo: 0.3 };
    let surfaces: Vec<Surface> =
        scene.target.regions.iter().map(|_| Surface::new(&lambert)).collect();
    let regions = &scene.target.region_of_facet;
    let bounce =
        scene.file.bounce.map(|b| Bounce { rays: b.rays, outside_spot: 0.1, in_phase: false });
    let geometry = ScanGeometry::new(scene.radar(), &scene.chirps, &bvh, regions);
    let paper = Setup::new(geometry, &surfaces);
    let mut effects = SceneEffects::default();
    let levels = [(&scene.file.effect, Level::Scene), (&scene.radar().effect, Level::Instrument)];
    for (entries, level) in levels {
        let Ok(chosen) = resolve(entries, level) else { return };
        effects.add(chosen);
    }
    let laws = surfaces.iter().map(|_| Brdf::Lambert(lambert)).collect();
    let model = effects.model(laws, Receiver::declared(scene.radar()));
    let setup = Setup { bounce, effects: Some(&model), ..paper };
    let Ok(footprints) = trace_placed(&setup, rays, &|_| {}) else { return };
    let Ok(scan) = shade(&setup, &footprints, Observer::Radar, &|_| {}) else { return };
    for echo in &scan.echoes {
        assert!(echo.range_m.is_finite() && echo.point.xyz.is_finite(), "{text}");
        assert!(!echo.power_w.is_nan(), "{text}");
    }
    let field = scene.chirps.field(&scene.radar().frames());
    let spot_m = scene.radar().spot_diameter_m;
    power_image(&scan, field, spot_m, &vec![0; surfaces.len()], scene.pixel_m());
}

#[test]
fn the_texts_are_good_before_they_are_damaged() {
    let scene = Scene::resolve(SceneFile::parse(SCENE).unwrap(), Path::new("scene.toml")).unwrap();
    let (bvh, regions) = (Bvh::new(&scene.target.mesh), &scene.target.region_of_facet);
    let geometry = ScanGeometry::new(scene.radar(), &scene.chirps, &bvh, regions);
    trace(&geometry, 1, &|_| {}).unwrap();
    parse("material.toml", MATERIAL, |_| Err(String::new())).unwrap();
    assert!(tokens(SCENE).len() > 100);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(1500))]

    #[test]
    fn scenes(text in damaged(SCENE)) {
        render(&text);
    }

    #[test]
    fn materials(text in damaged(MATERIAL)) {
        if let Ok(material) = parse("material.toml", &text, |_| Err(String::new())) {
            let brdf = material.scattering().expect("what was accepted can be rendered");
            for theta_deg in [0.0, 1.0, 45.0, 89.0, 90.0] {
                let sigma0 = brdf.sigma0(f64::to_radians(theta_deg));
                prop_assert!(sigma0.is_finite() && sigma0 >= 0.0, "{theta_deg}°: {sigma0} {text}");
            }
        }
    }

    #[test]
    fn curves(text in damaged(CURVE)) {
        let _ = points(text.as_bytes(), &ColumnNames::default());
    }
}
