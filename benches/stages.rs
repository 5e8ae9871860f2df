//! How long each stage takes on the way from a mesh to a fitted law, each from what the one before it gave:
//!
//!     cargo bench --bench stages
//!     cargo bench --bench stages -- power image     these alone
//!     cargo bench --bench stages -- fit 3           in three turns, to see that it runs
//!
//! The ways of a stage are taken in turns after a first one that does not count. A line has the median, the
//! quartiles and how much was done. The scan is that of `scenes/bench.toml`, of the paper's size. Stages with
//! benches of their own: closest hits (`trace`), the same scan again (`reshade`), the database (`store`) and the diagnosis
//! (`diagnose`). `RAYON_NUM_THREADS` sets the threads.

#[path = "support/clock.rs"]
mod clock;

use std::fmt::Write;
use std::path::Path;

use clock::{quartiles, timed};
use glam::DVec3;
use matdb::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Scattering, Shadowing};
use matdb::fit::{Fit, FitResult, Method};
use matdb::formats::exr::{self, Packing};
use matdb::formats::figure::{Figure, Scale};
use matdb::formats::{MeshFormat, ply};
use matdb::frames::{Global, Ray};
use matdb::geometry::{Mesh, Raster};
use matdb::measure::icp::Motion;
use matdb::measure::{
    Cloud, CloudPoint, Curve, Metric, Reduction, ReductionResult, Registration, RegistrationResult,
    Start,
};
use matdb::radar::random::{Key, Purpose};
use matdb::radar::{Link, Radar, Speckle, SpeckleForm};
use matdb::render::{
    Echo, Footprints, Observer, Scan, Setup, cloud_table, power_image, shade, trace_placed,
};
use matdb::scene::solids;
use matdb::setup::ReadyScene;
use matdb::trace::{Hit, ScanGeometry};
use rayon::prelude::*;

const TURNS: usize = 15;
/// Rays of a finite spot.
const SPOT_RAYS: usize = 16;
/// What a registration starts from is so far off.
const PUSH: Motion =
    Motion { shift_m: DVec3::new(0.02, 0.01, -0.02), turn_rad: DVec3::splat(0.05) };
/// Points of the curve that is fitted, and curves drawn from it in a turn.
const FITTED: usize = 5000;
const REFITS: u64 = 100;

/// A scan of a scene, and what leads to it.
#[derive(Clone, Copy)]
struct Rendering<'a> {
    ready: &'a ReadyScene,
    setup: &'a Setup<'a>,
    footprints: &'a Footprints,
    scan: &'a Scan,
}

/// One way through a stage, with the times of all turns and how much was done in the last.
struct Way<'a> {
    name: &'static str,
    turn: Box<dyn FnMut() -> (f64, String) + 'a>,
    times_ms: Vec<f64>,
    done: String,
}

impl<'a> Way<'a> {
    /// `done` is asked when the clock has stopped.
    fn new<T>(
        name: &'static str,
        mut run: impl FnMut() -> T + 'a,
        done: impl Fn(&T) -> String + 'a,
    ) -> Way<'a> {
        let turn = move || {
            let (ms, made) = timed(&mut run);
            (ms, done(&made))
        };
        Way { name, turn: Box::new(turn), times_ms: Vec::new(), done: String::new() }
    }
}

type Stage = for<'a> fn(Rendering<'a>) -> Vec<Way<'a>>;
const STAGES: [(&str, Stage); 8] = [
    ("mesh", mesh),
    ("power", power),
    ("spot", spot),
    ("image", image),
    ("files", files),
    ("register", register),
    ("curve", curve),
    ("fit", fit),
];

fn main() {
    let (wanted, turns) = arguments();
    let ready = scene();
    let assembly = ready.assemble();
    let setup = assembly.setup();
    let footprints = traced(&setup, 1);
    let scan = shaded(&setup, &footprints);
    let given = Rendering { ready: &ready, setup: &setup, footprints: &footprints, scan: &scan };
    println!(
        "{} threads, medians and quartiles of {turns} turns, ms",
        rayon::current_num_threads()
    );
    for (name, ways) in STAGES {
        if wanted.is_empty() || wanted.iter().any(|word| *word == name) {
            println!("{name}");
            tell(ways(given), turns);
        }
    }
}

/// Stages that are wanted, all where none is, and the number of turns.
fn arguments() -> (Vec<String>, usize) {
    // Cargo's own begin with a dash.
    let words = std::env::args().skip(1).filter(|word| !word.starts_with('-'));
    let (numbers, names): (Vec<_>, Vec<_>) = words.partition(|word| word.parse::<usize>().is_ok());
    for name in &names {
        let known = STAGES.map(|(known, _)| known);
        assert!(
            known.contains(&name.as_str()),
            "no stage `{name}`; there are {}",
            known.join(", ")
        );
    }
    let turns = numbers.first().and_then(|number| number.parse().ok());
    (names, turns.unwrap_or(TURNS).max(1))
}

fn tell(mut ways: Vec<Way>, turns: usize) {
    for _ in 0..=turns {
        for way in &mut ways {
            let (ms, done) = (way.turn)();
            way.times_ms.push(ms);
            way.done = done;
        }
    }
    for Way { name, times_ms, done, .. } in ways {
        let [low, median, high] = quartiles(times_ms[1..].to_vec());
        println!("  {name:<24} {median:>9.3} ({low:.3}–{high:.3})  {done}");
    }
}

fn scene() -> ReadyScene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bench.toml");
    ReadyScene::open(&path, None).expect("the scene")
}

fn traced(setup: &Setup, rays: usize) -> Footprints {
    trace_placed(setup, rays, &|_| {}).expect("chirps that meet the target")
}

fn shaded(setup: &Setup, footprints: &Footprints) -> Scan {
    shade(setup, footprints, Observer::Radar, &|_| {}).expect("echoes")
}

/// Bytes to a mesh that has been checked, and a scene file to a target and a scan.
fn mesh(_: Rendering<'_>) -> Vec<Way<'_>> {
    let ball = solids::icosphere(0.5, 8);
    let (ply, obj) = (binary_ply(&ball), obj(&ball));
    let read = |name, format: MeshFormat, bytes: Vec<u8>| {
        let size = bytes.len();
        let done = move |mesh: &Mesh| format!("{} facets, {size} bytes", mesh.facets.len());
        Way::new(name, move || format.read(&bytes).expect("a mesh"), done)
    };
    vec![
        read("binary PLY", MeshFormat::Ply, ply),
        read("OBJ", MeshFormat::Obj, obj),
        Way::new("scene", scene, |ReadyScene { scene, .. }| {
            let (facets, chirps) = (scene.target.mesh.facets.len(), scene.chirps.rays.len());
            format!("{facets} facets from formulas, {chirps} chirps")
        }),
    ]
}

fn binary_ply(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\n\
         property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
        mesh.vertices.len(),
        mesh.facets.len()
    )
    .into_bytes();
    for vertex in &mesh.vertices {
        vertex.to_array().iter().for_each(|&x| bytes.extend((x as f32).to_le_bytes()));
    }
    for facet in &mesh.facets {
        bytes.push(3);
        facet.iter().for_each(|vertex| bytes.extend(vertex.to_le_bytes()));
    }
    bytes
}

fn obj(mesh: &Mesh) -> Vec<u8> {
    let mut text = String::new();
    for DVec3 { x, y, z } in &mesh.vertices {
        let _ = writeln!(text, "v {} {} {}", *x as f32, *y as f32, *z as f32);
    }
    for [a, b, c] in mesh.facets.iter().map(|facet| facet.map(|vertex| vertex + 1)) {
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text.into_bytes()
}

/// Hits to echoes: by the paper's receiver, which takes the power as it is, and by that of the scene; and what of
/// it the law and the power balance take by themselves, on one thread.
fn power(given: Rendering<'_>) -> Vec<Way<'_>> {
    let paper = Radar::default();
    let (link, paint) = (Link::new(&paper), &given.ready.materials[0].scattering);
    let alone = move || {
        let power_w = |(axis, hit): (&Ray<Global>, &Option<Hit>)| {
            let hit = (*hit)?;
            let f_per_sr = paint.retro_per_sr(hit.theta_rad());
            Some(link.power_w(&link.beam.along(axis), hit.range_m, hit.cos_theta, f_per_sr))
        };
        let axes = &given.setup.geometry.chirps.rays;
        axes.iter().zip(&given.footprints.hits).filter_map(power_w).collect::<Vec<f64>>()
    };
    let paper = move || {
        let geometry = ScanGeometry { radar: &paper, ..given.setup.geometry };
        shaded(&Setup { geometry, ..*given.setup }, given.footprints)
    };
    vec![
        Way::new("law and link alone", alone, |powers_w| format!("{} hits", powers_w.len())),
        Way::new("paper's receiver", paper, echoes),
        Way::new("noise", speckled(given, None), echoes),
        Way::new(
            "noise, independent speckle",
            speckled(given, Some(SpeckleForm::Independent)),
            echoes,
        ),
        Way::new("noise, speckle by its law", speckled(given, Some(SpeckleForm::Law)), echoes),
        Way::new("noise, scatterers", speckled(given, Some(SpeckleForm::Scatterers)), echoes),
    ]
}

/// The echoes with noise, and with a single look of speckle of a form.
fn speckled(given: Rendering<'_>, form: Option<SpeckleForm>) -> impl Fn() -> Scan + '_ {
    let mut radar = given.setup.geometry.radar.clone();
    radar.speckle = form.map(|form| Speckle { looks: 1.0, form: Some(form), ..Default::default() });
    move || {
        let geometry = ScanGeometry { radar: &radar, ..given.setup.geometry };
        shaded(&Setup { geometry, ..*given.setup }, given.footprints)
    }
}

fn echoes(scan: &Scan) -> String {
    let detected = scan.detections().count();
    format!("{} chirps, {} echoes, {detected} detections", scan.chirps, scan.echoes.len())
}

/// Hits and echoes of a finite spot.
fn spot(given: Rendering<'_>) -> Vec<Way<'_>> {
    let footprints = traced(given.setup, SPOT_RAYS);
    let rays = footprints.hits.len();
    let met = |footprints: &Footprints| {
        let hits = footprints.hits.iter().flatten().count();
        format!("{} rays, {hits} hits", footprints.hits.len())
    };
    vec![
        Way::new("closest hits", || traced(given.setup, SPOT_RAYS), met),
        Way::new(
            "echoes",
            move || shaded(given.setup, &footprints),
            move |scan| format!("{rays} rays, {}", echoes(scan)),
        ),
    ]
}

/// Detections to the image's grid.
fn image(given: Rendering<'_>) -> Vec<Way<'_>> {
    let gridded = |name, finer: f64| {
        Way::new(
            name,
            move || raster(given, finer),
            move |raster| {
                let detections = given.scan.detections().count();
                format!("{detections} detections on {} × {} pixels", raster.width, raster.height)
            },
        )
    };
    vec![gridded("the scene's pixels", 1.0), gridded("four times finer", 4.0)]
}

fn raster(given: Rendering, finer: f64) -> Raster {
    let Rendering { ready: ReadyScene { scene, .. }, scan, .. } = given;
    let field = scene.chirps.field(&scene.radar().frames());
    power_image(scan, field, scene.radar().spot_diameter_m, &[0], scene.pixel_m() / finer)
}

/// Image and cloud to bytes, and these into a folder.
fn files(given: Rendering<'_>) -> Vec<Way<'_>> {
    let raster = raster(given, 1.0);
    let exr = |raster: &Raster, packing| {
        exr::write_packed(raster, &[], None, packing).expect("a picture")
    };
    let cloud = move || {
        let echoes: Vec<&Echo> = given.scan.detections().collect();
        ply::write_table(&cloud_table(&echoes, &[0], &["body"], &["paint"], false))
            .expect("a cloud")
    };
    let written = [exr(&raster, Packing::Zip16), png(&raster), cloud()];
    let folder = tempfile::tempdir().expect("a temporary folder");
    let store = move || {
        for (name, bytes) in ["power.exr", "power.png", "cloud.ply"].iter().zip(&written) {
            std::fs::write(folder.path().join(name), bytes).expect("room for a file");
        }
        written.iter().map(Vec::len).sum::<usize>()
    };
    let (packed, plain, drawn) = (raster.clone(), raster.clone(), raster);
    let bytes = |bytes: &Vec<u8>| format!("{} bytes", bytes.len());
    let pixels = format!("{} × {} pixels", drawn.width, drawn.height);
    let of_pixels = move |bytes: &Vec<u8>| format!("{pixels}, {} bytes", bytes.len());
    vec![
        Way::new("EXR", move || exr(&packed, Packing::Zip16), of_pixels.clone()),
        Way::new(
            "EXR, uncompressed",
            move || exr(&plain, Packing::Uncompressed),
            of_pixels.clone(),
        ),
        Way::new("PNG", move || png(&drawn), of_pixels),
        Way::new("PLY", cloud, bytes),
        Way::new("EXR, PNG, PLY to the disk", store, |bytes| format!("{bytes} bytes")),
    ]
}

fn png(raster: &Raster) -> Vec<u8> {
    let figure = Figure {
        raster,
        channel: "power_dbm",
        title: "Scan",
        subtitle: "",
        colour_label: "received power, dBm",
        range: None,
        scale: Scale::Sequential,
        gaps: "no detection",
        x_label: "x, m",
        y_label: "y, m",
    };
    figure.png().expect("a figure")
}

/// A cloud and a rough pose to a pose.
fn register(given: Rendering<'_>) -> Vec<Way<'_>> {
    let found = |registered: &RegistrationResult| {
        let RegistrationResult { points, scans, iterations, .. } = registered;
        format!("{points} points, {scans} virtual scans, {iterations} steps")
    };
    let cloud = cloud(given);
    let middle = cloud.points().iter().map(|point| point.point.xyz).sum::<DVec3>()
        / cloud.points().len() as f64;
    let start = Start::Given(PUSH.about(middle));
    let by = |name, metric| {
        let (settings, cloud) =
            (Registration { start, metric, ..Registration::default() }, cloud.clone());
        Way::new(name, move || registered(given, &settings, &cloud), found)
    };
    vec![by("along the rays", Metric::AlongRay), by("point to plane", Metric::PointToPlane)]
}

fn registered(given: Rendering, settings: &Registration, cloud: &Cloud) -> RegistrationResult {
    let scene = &given.ready.scene;
    settings.run(&scene.target.mesh, scene.radar(), &scene.chirps, cloud).expect("a pose")
}

/// The detections as a radar that was not here would tell them.
fn cloud(given: Rendering) -> Cloud {
    Cloud::new(given.scan.detections().map(CloudPoint::from).collect()).expect("a cloud")
}

/// A registered cloud to a curve.
fn curve(given: Rendering<'_>) -> Vec<Way<'_>> {
    let cloud = cloud(given);
    let registered = registered(given, &Registration::default(), &cloud);
    let run = move || reduced(given, &cloud, &registered);
    vec![Way::new("reduction", run, move |reduced| {
        let (points, rows) = (given.scan.detections().count(), reduced.curve.observations.len());
        format!("{points} points, {rows} rows")
    })]
}

fn reduced(given: Rendering, cloud: &Cloud, registered: &RegistrationResult) -> ReductionResult {
    let scene = &given.ready.scene;
    let reduction = Reduction { exact_mesh: true, ..Reduction::default() };
    let (radar, chirps) = (scene.radar(), &scene.chirps);
    reduction.run(&scene.target, radar, chirps, cloud, registered).expect("a curve")
}

/// A curve to a law: squares of levels, of distances, the Gamma law of speckle, and squares of curves drawn from this
/// one.
fn fit(given: Rendering<'_>) -> Vec<Way<'_>> {
    let cloud = cloud(given);
    let registered = registered(given, &Registration::default(), &cloud);
    let ReductionResult { mut curve, .. } = reduced(given, &cloud, &registered);
    // Every n-th, so that all angles are there.
    let step = (curve.observations.len() / FITTED).max(1);
    curve.observations = curve.observations.into_iter().step_by(step).take(FITTED).collect();
    let squares = |theta_sd_rad| Fit {
        method: Method::Tls { theta_sd_rad, level_sd_db: 2.0 },
        starts: 1,
        ..Fit::default()
    };
    let noise_w = given.scan.noise_w;
    let gamma = Fit { noise_w, starts: 1, ..Fit::default() };
    let fitted = |fit: &Fit, start: &Brdf, curve: &Curve| fit.run(start, curve).expect("a fit");
    let best = fitted(&squares(0.0), &guess(), &curve).model;
    let by = |name, settings: Fit| {
        let curve = curve.clone();
        let size = curve.observations.len();
        let done = move |found: &FitResult| format!("{size} points, {} steps", found.iterations);
        Way::new(name, move || fitted(&settings, &guess(), &curve), done)
    };
    let mut ways = vec![
        by("least squares", squares(0.0)),
        by("orthogonal distance", squares(1f64.to_radians())),
        by("Gamma law", gamma),
    ];
    let (size, again) = (curve.observations.len(), squares(0.0));
    let refits = move || {
        let converged =
            |number: &u64| again.run(&best, &drawn(&curve, *number)).is_ok_and(|fit| fit.converged);
        (0..REFITS).into_par_iter().filter(converged).count()
    };
    ways.push(Way::new("refits of drawn curves", refits, move |converged| {
        format!("{REFITS} curves of {size} points, {converged} converged")
    }));
    ways
}

/// As many rows as the curve has, drawn with replacement.
fn drawn(curve: &Curve, number: u64) -> Curve {
    let mut draws = Key { seed: number, chirp: 0, sub_ray: 0, purpose: Purpose::Bootstrap }.draws();
    let count = curve.observations.len();
    let row = |_| curve.observations[(count as f64 * draws.uniform()) as usize];
    Curve { observations: (0..count).map(row).collect(), ..Curve::default() }
}

/// Where a fit starts.
fn guess() -> Brdf {
    let (distribution, shadowing) = (Distribution::Beckmann, Shadowing::Separable);
    let lobe = CookTorrance { f_lambda: 0.1, m: 0.1, m_across: None, distribution, shadowing };
    Brdf::Mixture(Mixture {
        k: 0.3,
        diffuse: Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.02, alpha: 2.0 })),
        specular: Box::new(Brdf::CookTorrance(lobe)),
    })
}
