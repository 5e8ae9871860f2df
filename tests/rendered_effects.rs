//! Promise: what a diagnosis finds, the renderer uses. Every effect of the library, declared in a scene,
//! its radar or a material, changes a scan as its model predicts; declared and absent, it changes not a
//! byte.

use std::fs;
use std::path::Path;

use crate::support::{self, entries, matdb, read_cloud, refused};
use glam::{DMat3, DVec3};
use matdb::brdf::Brdf;
use matdb::diagnose;
use matdb::effects::{
    Antenna, Effect, EffectParameter, Level, Model, Receiver, SceneEffects, Setting, Shot, Stage,
    entry, find, library, middle, resolve,
};
use matdb::formats::EffectEntry;
use matdb::frames::Point;
use matdb::material::builtin;
use matdb::radar::Link;
use matdb::render::{Echo, Observer, RenderError, Setup, Surface, shade, trace_placed};
use matdb::scene::{Scene, SceneFile};
use matdb::trace::{Bvh, ScanGeometry};
use matdb::units::{db_from_ratio, dbm_from_watts, watts_from_dbm};

/// Relative to the same formula evaluated elsewhere: rounding alone.
const POWER_DB: f64 = 1e-9;
const RANGE_M: f64 = 1e-9;

/// A corner of two plates beside a ball, of two materials.
const SCENE: &str = r#"
name = "effects"
seed = 5
[radar.scan]
pattern = "raster"
lines = 24
chirps_per_line = 24
width_m = 0.56
height_m = 0.5
[[mesh]]
name = "ball"
file = "builtin:sphere"
size_m = [0.3, 0.3, 0.3]
translation_m = [-0.14, 1.1, 0]
[[mesh]]
name = "left"
file = "builtin:plate"
size_m = [0.3, 0.5, 0]
rotation_deg = [0, 45, 0]
translation_m = [0.04, 1.1, 0.1]
[[mesh]]
name = "right"
file = "builtin:plate"
size_m = [0.3, 0.5, 0]
rotation_deg = [0, -45, 0]
translation_m = [0.25, 1.1, 0.1]
[[region]]
name = "plates"
material = "mannequin-paint"
[[region]]
name = "ball"
material = "ptfe"
mesh = "ball"
grain = [1, 0.3, 0]
"#;

/// A scene with everything that the renderer needs.
struct Bench {
    scene: Scene,
    laws: Vec<Brdf>,
    bvh: Bvh<'static>,
    /// The antenna that receives the echoes; none for the radar's own.
    antenna: Option<Antenna>,
}

impl Bench {
    fn new(text: &str) -> Bench {
        let file = SceneFile::parse(text).unwrap();
        let scene = Scene::resolve(file, Path::new("scene.toml")).unwrap();
        let law = |region: &matdb::scene::Region| {
            builtin::get(&region.material).unwrap().unwrap().scattering().unwrap()
        };
        let laws = scene.target.regions.iter().map(law).collect();
        let bvh = Bvh::new(Box::leak(Box::new(scene.target.mesh.clone())));
        Bench { scene, laws, bvh, antenna: None }
    }

    fn grains(&self) -> Vec<DVec3> {
        self.scene.target.regions.iter().map(|region| region.grain).collect()
    }

    fn geometry(&self) -> ScanGeometry<'_> {
        let Scene { chirps, target, .. } = &self.scene;
        ScanGeometry::new(self.scene.radar(), chirps, &self.bvh, &target.region_of_facet)
    }

    fn with_stage<T>(&self, then: impl FnOnce(&Stage, &[Shot]) -> T) -> T {
        let (radar, grains) = (self.scene.radar(), self.grains());
        let mut stage = Stage {
            geometry: self.geometry(),
            link: Link::new(radar),
            grain_of_region: &grains,
            seen_lobe_rad: &[],
            on_wavefront: false,
            antenna: self.antenna,
            middle: DVec3::ZERO,
        };
        let shots = diagnose::trace_shots(&stage).unwrap();
        stage.middle = middle(&shots);
        then(&stage, &shots)
    }

    fn model<'a>(&self, effects: &'a SceneEffects) -> Model<'a> {
        effects.model(self.laws.clone(), Receiver::declared(self.scene.radar()))
    }

    fn render(&self, model: &Model, rays: usize) -> Result<Vec<Echo>, RenderError> {
        let surface = |(law, grain)| Surface { grain, ..Surface::new(law as &Brdf) };
        let surfaces: Vec<Surface> =
            std::iter::zip(&self.laws, self.grains()).map(surface).collect();
        let paper = Setup::new(self.geometry(), &surfaces);
        let setup = Setup { effects: Some(model), seed: self.scene.file.seed, ..paper };
        let footprints = trace_placed(&setup, rays, &|_| {})?;
        let observer = match self.antenna {
            None => Observer::Radar,
            Some(Antenna { position, aperture_m2 }) => {
                Observer::Receiver { number: 1, position, aperture_m2 }
            }
        };
        Ok(shade(&setup, &footprints, observer, &|_| {})?.echoes)
    }

    fn with(&self, name: &str, values: &[f64]) -> Vec<Echo> {
        self.render(&self.model(&one(name, values)), 1).unwrap()
    }

    fn bare(&self) -> Vec<Echo> {
        self.render(&self.model(&SceneEffects::default()), 1).unwrap()
    }
}

/// One effect, through the form in which files hold it.
fn one(name: &str, values: &[f64]) -> SceneEffects {
    let effect = find(name).unwrap();
    let mut effects = SceneEffects::default();
    effects.add(resolve(&[entry(effect, values)], effect.level()).unwrap());
    effects
}

fn agrees(bench: &Bench, effects: &SceneEffects, case: &str) -> usize {
    let model = bench.model(effects);
    let echoes = bench.render(&model, 1).unwrap();
    bench.with_stage(|stage, shots| {
        let predicted = model.predict(stage, shots);
        let mut missed = 0;
        for ((number, shot), arrived) in shots.iter().enumerate().zip(&predicted.arrived) {
            let echo = echoes.iter().find(|echo| echo.chirp == shot.chirp);
            let (Some(arrived), Some(echo)) = (arrived, echo) else {
                assert!(arrived.is_none() && echo.is_none(), "{case}, chirp {}", shot.chirp);
                missed += 1;
                continue;
            };
            let power_dbm = dbm_from_watts(predicted.passed_w(number));
            let echo_dbm = dbm_from_watts(echo.power_w);
            let off_db = (echo_dbm - power_dbm).abs();
            assert!(off_db < POWER_DB || echo_dbm == power_dbm, "{case}: {off_db} dB");
            assert!((echo.range_m - arrived.range_m).abs() < RANGE_M, "{case}: {echo:?}");
        }
        shots.len() - missed
    })
}

#[test]
fn every_effect_changes_every_echo_as_its_model_predicts() {
    for text in [SCENE.to_owned(), with_air()] {
        every_effect_agrees(&text);
    }
}

/// The scene in air with a loss.
fn with_air() -> String {
    SCENE.replace("[radar.scan]", "[radar]\nair_loss_db_per_m = 0.4\n[radar.scan]")
}

fn every_effect_agrees(text: &str) {
    let mut bench = Bench::new(text);
    // Only a rough surface shadows itself.
    assert!(bench.laws[0].set_parameter("specular.m", 0.8));
    let bare = bench.bare();
    for effect in library() {
        // What the receiver adds at random has its own laws below.
        if ["speckle", "noise-floor", "angle-error"].contains(&effect.name()) {
            continue;
        }
        let starts = bench.with_stage(|stage, shots| effect.starts(stage, shots));
        let mut felt = 0;
        for start in starts {
            // A search may begin from nothing; a step from there is an effect.
            let parameters = effect.parameters();
            let is_absent =
                start.iter().zip(parameters).all(|(value, parameter)| *value == parameter.absent);
            let step = |parameter: &EffectParameter| if is_absent { parameter.step } else { 0.0 };
            let values: Vec<f64> = start.iter().zip(parameters).map(|(v, k)| v + step(k)).collect();
            let case = format!("{} at {values:?}", effect.name());
            let effects = one(effect.name(), &values);
            assert!(agrees(&bench, &effects, &case) > 300, "{case}: few shots are left");
            felt += usize::from(bench.render(&bench.model(&effects), 1).unwrap() != bare);
        }
        assert!(felt > 0, "{} changes nothing here", effect.name());
    }
}

/// f(i, o), the field that facets turn, the way back past the target, and half of the whole way as the range.
#[test]
fn an_antenna_apart_receives_what_the_model_predicts() {
    for (text, x_m, aperture_m2) in
        [(SCENE, -3.0, None), (SCENE, 6.0, Some(0.02)), (&with_air(), 6.0, None)]
    {
        let mut bench = Bench::new(text);
        bench.antenna = Some(Antenna { position: Point::new(x_m, 1.4, 4.0), aperture_m2 });
        for effect in library() {
            let conflicts = effect.about().conflicts;
            let is_random = ["speckle", "noise-floor"].contains(&effect.name());
            if is_random || conflicts.iter().any(|one| one.with == Setting::OtherAntenna) {
                continue;
            }
            let starts = bench.with_stage(|stage, shots| effect.starts(stage, shots));
            let known = starts[0].iter().zip(effect.parameters());
            let values: Vec<f64> =
                known.map(|(value, known)| (value + known.step).min(known.max)).collect();
            let case = format!("{} at {values:?}", effect.name());
            assert!(agrees(&bench, &one(effect.name(), &values), &case) > 300, "{case}");
        }
    }
}

#[test]
fn several_effects_act_together_as_their_model_predicts() {
    let bench = Bench::new(SCENE);
    let mut effects = one("pose", &[0.01, 0.0, 0.02, 1.0, 2.0, 3.0]);
    for (name, values) in [
        ("motion", &[2e-3, -1e-3, 3e-3][..]),
        ("compression", &[-45.0]),
        ("drift", &[1.0, 0.3, 0.0, 2.0]),
        ("multi-bounce", &[0.0]),
        ("foreign-patch", &[4.0, 0.1, 0.0, 0.05, 0.016]),
    ] {
        let effect = find(name).unwrap();
        effects.add(resolve(&[entry(effect, values)], effect.level()).unwrap());
    }
    let film = find("thin-film").unwrap();
    let film = resolve(&[entry(film, &[0.5, 3e-4, 1.6, 0.6, 1.2])], Level::Material).unwrap();
    effects.add_to_regions(film, &[false, true]);
    assert!(agrees(&bench, &effects, "together") > 300);
}

#[test]
fn an_effect_of_a_material_leaves_the_others_as_they_are() {
    let bench = Bench::new(SCENE);
    let rough = find("subsurface").unwrap();
    let mut effects = SceneEffects::default();
    effects.add_to_regions(vec![(rough, vec![0.02, 0.0])], &[false, true]);
    let with = bench.render(&bench.model(&effects), 1).unwrap();
    let mut changed = 0;
    for (bare, with) in std::iter::zip(bench.bare(), with) {
        match bare.truth.unwrap().region {
            0 => assert_eq!(bare, with),
            _ => changed += usize::from(with.power_w > bare.power_w),
        }
    }
    assert!(changed > 50, "{changed}");
}

/// The scene with a plate that `pose` moves, and with one that stands there at once.
fn moved_plates() -> [(Bench, SceneEffects); 2] {
    let (plate, rest) = SCENE.split_once("[[mesh]]").unwrap();
    let region = rest.split_once("[[region]]").unwrap().1.split_once("[[region]]").unwrap().0;
    let at = |place: DVec3, turn_deg: f64| {
        let DVec3 { x, y, z } = place;
        Bench::new(&format!(
            "{plate}[[mesh]]\nname = \"ball\"\nfile = \"builtin:plate\"\nsize_m = [0.3, 0.2, 0]\n\
             rotation_deg = [0, {turn_deg}, 0]\ntranslation_m = [{x}, {y}, {z}]\n[[region]]{region}"
        ))
    };
    let start = DVec3::new(0.02, 1.12, 0.0);
    let bench = at(start, 0.0);
    let pivot = bench.with_stage(|stage, _| stage.middle);
    let shift = DVec3::new(0.03, -0.02, 0.05);
    let there = DMat3::from_rotation_y(20f64.to_radians()) * (start - pivot) + pivot + shift;
    let pose = one("pose", &[shift.x, shift.y, shift.z, 0.0, 20.0, 0.0]);
    [(bench, pose), (at(there, 20.0), SceneEffects::default())]
}

#[test]
fn a_moved_target_is_rendered_where_it_stands_with_its_edges_and_all_rays_of_the_spot() {
    for rays in [1, 16] {
        let [moved, there] =
            moved_plates().map(|(bench, effects)| bench.render(&bench.model(&effects), rays));
        let (moved, there) = (moved.unwrap(), there.unwrap());
        assert!(moved.len() > 100);
        assert_eq!(moved.len(), there.len());
        for (a, b) in std::iter::zip(&moved, &there) {
            assert_eq!(a.chirp, b.chirp);
            assert!(db_from_ratio(a.power_w / b.power_w).abs() < 1e-6, "{a:?} {b:?}");
            assert!(a.point.distance_m(b.point) < 1e-9);
            let (a, b) = (a.truth.unwrap(), b.truth.unwrap());
            assert!((a.edge_m - b.edge_m).abs() < 1e-9);
            assert!((a.hit.theta_rad() - b.hit.theta_rad()).abs() < 1e-6);
            assert!((a.specular_share - b.specular_share).abs() < 1e-6);
        }
    }
}

#[test]
fn several_rays_of_a_spot_have_the_gain_of_one() {
    let bench = Bench::new(SCENE);
    let bare = bench.render(&bench.model(&SceneEffects::default()), 8).unwrap();
    let drift = one("drift", &[3.0, 0.0, 0.0, 1.0]);
    let with = bench.render(&bench.model(&drift), 8).unwrap();
    for (bare, with) in std::iter::zip(bare, with) {
        let progress = f64::from(bare.chirp) / (24.0 * 24.0 - 1.0);
        let expected_db = 3.0 * (progress - 0.5);
        let found_db = db_from_ratio(with.power_w / bare.power_w);
        assert!(
            (found_db - expected_db).abs() < POWER_DB,
            "{found_db} is not {expected_db}: {bare:?}"
        );
        assert!((with.range_m - bare.range_m).abs() < RANGE_M);
    }
}

/// Mean and variance of many numbers.
fn moments(numbers: &[f64]) -> [f64; 2] {
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    [mean, numbers.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / numbers.len() as f64]
}

/// A large plate that is seen at 40°, all of it alike.
fn slanted() -> Bench {
    let (head, _) = SCENE.split_once("[[mesh]]").unwrap();
    let head = head.replace("lines = 24", "lines = 100").replace("_line = 24", "_line = 100");
    Bench::new(&format!(
        "{head}[[mesh]]\nname = \"plate\"\nfile = \"builtin:plate\"\nsize_m = [4, 4, 0]\n\
         rotation_deg = [0, 40, 0]\ntranslation_m = [0, 1.1, 0]\n[[region]]\nname = \"all\"\n\
         material = \"mannequin-paint\"\n"
    ))
}

fn powers_w(echoes: &[Echo]) -> Vec<f64> {
    echoes.iter().map(|echo| echo.power_w).collect()
}

#[test]
fn speckle_and_noise_have_their_laws() {
    let bench = slanted();
    let bare = powers_w(&bench.bare());
    let ratios = |with: &[f64]| -> Vec<f64> {
        std::iter::zip(with, &bare).map(|(with, bare)| with / bare).collect()
    };
    // Of 10 000 echoes the mean is good to 0.005 and the variance of Gamma(4, 1/4) to 0.005.
    let [mean, variance] = moments(&ratios(&powers_w(&bench.with("speckle", &[4.0]))));
    assert!((mean - 1.0).abs() < 0.02 && (variance - 0.25).abs() < 0.02, "{mean} {variance}");
    let level_dbm = -85.0;
    let noisy = powers_w(&bench.with("noise-floor", &[level_dbm]));
    let added: Vec<f64> = std::iter::zip(&noisy, &bare).map(|(noisy, bare)| noisy - bare).collect();
    let [added_w, _] = moments(&added);
    let noise_w = watts_from_dbm(level_dbm);
    // 2·√(P·N)·Re w averages out: its deviation is some 5 N over 10 000 echoes' root.
    assert!((added_w / noise_w - 1.0).abs() < 0.3, "{}", added_w / noise_w);
}

#[test]
fn tilts_that_vary_scatter_the_power_where_the_curve_is_steep() {
    let bench = slanted();
    let sd_deg = 0.5;
    let effects = one("angle-error", &[sd_deg]);
    let model = bench.model(&effects);
    let predicted = bench.with_stage(|stage, shots| model.predict(stage, shots));
    let (bare, with) = (bench.bare(), bench.render(&model, 1).unwrap());
    let shift = |(with, bare): (&Echo, &Echo)| (with.power_w / bare.power_w).ln();
    let shifts: Vec<f64> = std::iter::zip(&with, &bare).map(shift).collect();
    let spread = |shot: usize| predicted.tilt_spread(shot).powi(2);
    let expected = (0..shifts.len()).map(spread).sum::<f64>() / shifts.len() as f64;
    let [mean, variance] = moments(&shifts);
    // The deviation of a variance over 10 000 draws is 1.4 %, and second order adds about as much.
    assert!((variance / expected - 1.0).abs() < 0.08, "{variance} {expected}");
    assert!(mean.abs() < 0.1 * variance.sqrt(), "{mean}");
    let same = |(a, b): (&Echo, &Echo)| (a.range_m - b.range_m).abs() < RANGE_M;
    assert!(std::iter::zip(&with, &bare).all(same), "a tilt is no step in range");
}

/// `[[effect]]` or `[[radar.effect]]` tables of effects at their absent values.
fn absent(names: &[&str]) -> String {
    let table = |name: &&str| {
        let effect = find(name).unwrap();
        let head = match effect.level() {
            Level::Instrument => "radar.effect",
            _ => "effect",
        };
        let EffectEntry { parameters, .. } =
            entry(effect, &effect.parameters().iter().map(|k| k.absent).collect::<Vec<_>>());
        let lines: String = parameters.iter().map(|(k, v)| format!("{k} = {v:?}\n")).collect();
        format!("[[{head}]]\nname = \"{name}\"\n{lines}")
    };
    names.iter().map(table).collect()
}

/// All files that the program writes for a scene, and `scan.json`.
fn rendered(
    folder: &Path,
    text: &str,
    threads: &str,
) -> (Vec<(String, Vec<u8>)>, serde_json::Value) {
    fs::write(folder.join("scene.toml"), text).unwrap();
    let mut command = matdb(folder);
    command.env("RAYON_NUM_THREADS", threads);
    command.args(["render", "-q", "scene.toml", "-o", "out", "--all"]).assert().success();
    let out = folder.join("out");
    let read = |name: String| (name.clone(), fs::read(out.join(name)).unwrap());
    let files = entries(&out).into_iter().map(read).collect();
    (files, serde_json::from_slice(&fs::read(out.join("scan.json")).unwrap()).unwrap())
}

fn names(levels: &[Level]) -> Vec<&'static str> {
    let at = |effect: &&dyn Effect| levels.contains(&effect.level());
    library().iter().filter(|effect| at(effect)).map(|effect| effect.name()).collect()
}

/// A copy of a built-in material with effects, in the folder's database.
fn add_material(folder: &Path, name: &str, effects: &str) {
    let text =
        fs::read_to_string(support::root().join("materials").join(name).join("material.toml"));
    let place = folder.join(name);
    fs::create_dir_all(&place).unwrap();
    fs::write(place.join("material.toml"), text.unwrap() + "\n" + effects).unwrap();
    matdb(folder).args(["add", "--from", name]).assert().success();
}

#[test]
fn what_is_absent_changes_no_byte_of_cloud_and_images() {
    let many = "[spot]\nrays = 4\n[bounce]\nrays = 4\n[radar.speckle]\nlooks = 2\n[radar.noise]\n";
    let all = names(&[Level::Scene, Level::Instrument]);
    let twice = ["finite-spot", "multi-bounce", "pose", "motion"];
    let some: Vec<&str> = all.iter().copied().filter(|name| !twice.contains(name)).collect();
    for (tables, declared) in [("", all), (many, some)] {
        let text = SCENE.replacen("[[mesh]]", &format!("{tables}[[mesh]]"), 1);
        let [bare, with] = [false, true].map(|declare| {
            let folder = tempfile::tempdir().unwrap();
            let (material, scene) = if declare {
                (absent(&names(&[Level::Material])), absent(&declared))
            } else {
                (String::new(), String::new())
            };
            add_material(folder.path(), "ptfe", &material);
            rendered(folder.path(), &(text.clone() + &scene), "2")
        });
        for ((name, bare), (_, with)) in std::iter::zip(&bare.0, &with.0) {
            assert!(name == "scan.json" || bare == with, "{name} differs, {} tables", tables.len());
        }
        assert_eq!(with.1["effects"].as_array().unwrap().len(), declared.len());
        assert_eq!(bare.1.get("effects"), None);
    }
}

const DECLARED: &str = r#"
[[effect]]
name = "motion"
x1_m = 0.01
z2_m = 0.004
[[effect]]
name = "angle-error"
sd_deg = 1.5
[[effect]]
name = "foreign-patch"
level_db = 5
centre_x_m = 0.1
[[radar.effect]]
name = "compression"
saturation_dbm = -50
[[radar.effect]]
name = "speckle"
looks = 3
[[radar.effect]]
name = "noise-floor"
level_dbm = -90
"#;

#[test]
fn with_effects_one_thread_and_two_write_the_same_files() {
    let render = |threads: &str| {
        let folder = tempfile::tempdir().unwrap();
        add_material(folder.path(), "ptfe", "[[effect]]\nname = \"subsurface\"\nsigma_v = 0.01\n");
        rendered(folder.path(), &(SCENE.to_owned() + DECLARED), threads)
    };
    let ((one, record), (two, _)) = (render("1"), render("2"));
    for ((name, one), (_, two)) in std::iter::zip(&one, &two) {
        assert!(one == two, "{name}");
    }
    let names: Vec<&str> = record["effects"]
        .as_array()
        .unwrap()
        .iter()
        .map(|effect| effect["name"].as_str().unwrap())
        .collect();
    let expected =
        ["motion", "foreign-patch", "compression", "angle-error", "speckle", "noise-floor"];
    assert_eq!(names, expected);
    assert_eq!(record["effects"][1]["radius_m"], 0.05, "what is not given is told, too");
    assert_eq!(record["effects"][1]["level"], "scene");
    assert_eq!(record["materials"][1]["effects"][0]["sigma_v"], 0.01);
    assert_eq!(record["radar"]["effect"][0]["saturation_dbm"], -50.0);
    assert_eq!(record["noise_dbm"], -90.0);
}

#[test]
fn a_material_keeps_its_effect_and_scenes_render_it() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let bare = rendered(folder, SCENE, "2");
    let cloud = || read_cloud(&folder.join("out/cloud.ply"));
    let before = cloud();
    add_material(folder, "ptfe", "");
    add_material(folder, "ptfe", "[[effect]]\nname = \"subsurface\"\nsigma_v = 0.05\n");
    let output = matdb(folder).args(["show", "ptfe"]).output().unwrap();
    let shown = String::from_utf8(output.stdout).unwrap();
    assert!(shown.contains("effect subsurface") && shown.contains("sigma_v"), "{shown}");
    let output = matdb(folder).args(["show", "ptfe", "--json"]).output().unwrap();
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["revision"], 2);
    assert_eq!(json["material"]["effects"][0]["sigma_v"], 0.05);
    let output = matdb(folder).args(["show", "ptfe@1"]).output().unwrap();
    assert!(!String::from_utf8(output.stdout).unwrap().contains("effect"));
    rendered(folder, SCENE, "2");
    let after = cloud();
    let mut raised = 0;
    for row in 0..before["x"].len() {
        let ball = before["region"][row] == 1.0;
        let (was, is) = (before["power_dbm"][row], after["power_dbm"][row]);
        assert!(ball || was == is, "the plates are of another material");
        raised += usize::from(ball && is > was);
    }
    assert!(raised > 50, "{raised}");
    let text = SCENE.replace("material = \"ptfe\"", "material = \"ptfe@1\"");
    let again = rendered(folder, &text, "2");
    let clouds = |files: &[(String, Vec<u8>)]| files[0].1.len();
    assert_eq!(clouds(&bare.0), clouds(&again.0));
    assert_eq!(cloud()["power_dbm"], before["power_dbm"]);
}

#[test]
fn mistakes_are_named_with_their_place_and_the_way_out() {
    let table =
        |table: &str, name: &str, more: &str| format!("[[{table}]]\nname = \"{name}\"\n{more}\n");
    let beside = "[[receiver]]\nname = \"left\"\nposition_m = [-1, 1.1, 5]\n";
    for (more, parts) in [
        (table("effect", "foreign-pach", ""), &["[[effect]]: there is no", "`foreign-patch`?"][..]),
        (table("effect", "pose", "yaw = 3"), &["no parameter `yaw`", "rotation_z_deg"]),
        (table("effect", "pose", "rotation_z_dg = 3"), &["did you mean `rotation_z_deg`?"]),
        (table("effect", "pose", "rotation_z_deg = 30"), &["rotation_z_deg = 30", "-20 to 20"]),
        (table("effect", "pose", "rotation_z_deg = nan"), &["rotation_z_deg = NaN", "-20 to 20"]),
        (table("effect", "pose", "rotation_z_deg = \"3\""), &["scene.toml", "a number"]),
        (table("effect", "pose", "") + &table("effect", "pose", ""), &["given twice"]),
        (table("effect", "drift", ""), &["[[effect]]: effect `drift`", "[[radar.effect]]"]),
        (
            table("radar.effect", "pose", ""),
            &["[[radar.effect]]: effect `pose`", "[[effect]] of a"],
        ),
        (table("radar.effect", "subsurface", ""), &["of a material.toml"]),
        ("[[effect]]\nlevel_db = 3\n".to_owned(), &["missing field `name`"]),
        ("[effect]\nname = \"pose\"\n".to_owned(), &["double brackets"]),
        (table("efect", "pose", ""), &["did you mean `effect`?"]),
        (
            table("radar.effect", "finite-spot", "") + "[spot]\nrays = 4\n",
            &["`finite-spot` averages", "spot.rays = 1"],
        ),
        (table("effect", "multi-bounce", "") + "[bounce]\n", &["`multi-bounce`", "one of the two"]),
        (table("effect", "pose", "") + "[bounce]\n", &["`pose` moves", "translation_m"]),
        (
            table("radar.effect", "noise-floor", "") + "[radar.receiver]\n",
            &["[radar.receiver] makes", "noise_figure_db"],
        ),
        (
            table("radar.effect", "speckle", "") + "[radar.receiver]\n",
            &["[radar.receiver] averages", "radar.speckle.looks"],
        ),
        (table("effect", "covering-layer", "") + beside, &["receiver `left`", "another antenna"]),
    ] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("scene.toml"), SCENE.to_owned() + &more).unwrap();
        let message = refused(matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]));
        for part in parts {
            assert!(message.contains(part), "`{part}` is not in: {message}");
        }
        assert!(message.contains("scene.toml"), "{message}");
        assert_eq!(entries(folder.path()), ["scene.toml"], "{message}");
    }
}

#[test]
fn a_material_with_an_effect_that_means_nothing_is_not_added() {
    let ptfe = fs::read_to_string(support::root().join("materials/ptfe/material.toml")).unwrap();
    for (effect, part) in [
        ("name = \"subsurfac\"", "did you mean `subsurface`?"),
        ("name = \"subsurface\"\nsigma_v = 2", "from 0 to 1"),
        ("name = \"subsurface\"\nsigma_v = inf", "sigma_v = inf"),
        ("name = \"subsurface\"\ndepth = 0.1", "its parameters are sigma_v"),
        ("name = \"subsurface\"\n[[effect]]\nname = \"subsurface\"", "defined twice"),
        ("name = \"drift\"", "[[radar.effect]]"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("material.toml"), format!("{ptfe}\n[[effect]]\n{effect}\n"))
            .unwrap();
        let message = refused(matdb(folder.path()).args(["add", "--from", "."]));
        assert!(message.contains(part) && message.contains("material.toml"), "{message}");
        assert_eq!(entries(folder.path()), ["material.toml"]);
    }
}

#[test]
fn the_docs_say_where_every_effect_is_written() {
    let text = fs::read_to_string(support::root().join("docs/scenes.md")).unwrap();
    for effect in library() {
        let start = match effect.level() {
            Level::Scene => "| `[[effect]]` of the scene |",
            Level::Instrument => "| `[[radar.effect]]` of the scene |",
            Level::Material => "| `[[effect]]` of a [material]",
        };
        let row = text.lines().find(|line| line.starts_with(start)).unwrap();
        assert!(row.contains(&format!("`{}`", effect.name())), "{}", effect.name());
    }
}
