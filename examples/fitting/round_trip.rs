//! Render, measure from a wrong pose, fit, render again.

use matdb::brdf::{Brdf, Scattering};
use matdb::fit::{Fit, FitResult};
use matdb::frames::{Global, Point, Pose};
use matdb::geometry::Mesh;
use matdb::measure::icp::Motion;
use matdb::measure::{Cloud, CloudPoint, Reduction, Registration};
use matdb::radar::random::{Key, Purpose};
use matdb::radar::speckle::standard_deviation_db;
use matdb::radar::{Noise, Radar, Speckle, SpeckleForm};
use matdb::render::{Echo, Observer, Setup, Surface, shade, trace};
use matdb::scene::Scene;
use matdb::trace::{Bvh, ScanGeometry};
use matdb::units::{dbm_from_watts, watts_from_dbm};

use crate::Failure;
use crate::registration::{middle, pushed, scene};
use crate::truth::{TRUTH, start, truth};

const LOOKS: f64 = 4.0;
const RANGE_SD_M: f64 = 2e-3;

struct Trip {
    found: FitResult,
    shift_mm: f64,
    rows: usize,
    silent: usize,
    /// Measured image over the rendered mean, rms in dB: start, fit at the found pose, fit at the true
    /// one, truth.
    errors_db: [f64; 4],
    /// Mean images of the fit and of the truth, rms in dB.
    between_db: f64,
}

/// The section of the page.
pub fn section(seeds: usize) -> Result<String, Failure> {
    let speckle_db = standard_deviation_db(LOOKS);
    let mut text = format!(
        "## The whole way round (synthetic, {seeds} seeds)

The mesh of a scene, made of the known material above, is rendered with speckle of {LOOKS} looks, thermal noise of −112 dBm and 2 mm of range
noise. The detections are registered from 30 mm and 5° off, reduced to a curve with silent chirps as upper limits, and fitted with the default
method, which also estimates L. The mesh is then moved to the found pose and rendered with the fitted parameters, without noise. The mesh is exact, as
with `measure --exact-mesh`: its facets have no error of normal, and rows with an uncertain facet are left out.

- *Image error*: rms over the detected chirps of measured dBm − rendered dBm.
- *Floor*: the same for the true pose and the true parameters. Speckle, noise and the selection by the threshold remain; speckle alone has
  {speckle_db:.2} dB about its mean.
- With the found pose some chirps hit the neighbouring facet, which changes the angle by degrees at once. A smooth surface would not do that.
- *Between*: the mean images of fit and truth at the true pose.
- *None*: the fit did not converge and has no interval, which counts as outside.
"
    );
    for target in ["mannequin", "human"] {
        let scene = scene(target)?;
        let trips: Vec<Trip> =
            (0..seeds as u64).map(|seed| trip(&scene, seed)).collect::<Result<_, Failure>>()?;
        text += &table(target, &trips);
        eprintln!("{target}, round trip");
    }
    Ok(text)
}

fn table(target: &str, trips: &[Trip]) -> String {
    let Some(first) = trips.first() else { return String::new() };
    let mut text = format!(
        "
`{target}`, first seed: {} rows, {} of them silent, pose off by {:.2} mm.

| number | truth | found | 95 % interval | inside | inside, all seeds |
|---|--:|--:|--:|---|--:|
",
        first.rows, first.silent, first.shift_mm
    );
    for (name, value) in TRUTH.into_iter().chain([("looks", LOOKS)]) {
        text += &number(name, value, trips);
    }
    let mean =
        |value: &dyn Fn(&Trip) -> f64| trips.iter().map(value).sum::<f64>() / trips.len() as f64;
    text + &format!(
        "
| image error, mean of all seeds | dB |
|---|--:|
| start parameters, true pose | {:.3} |
| fitted parameters, found pose | {:.3} |
| fitted parameters, true pose | {:.3} |
| floor: true parameters, true pose | {:.3} |
| between the mean images of fit and truth | {:.3} |
",
        mean(&|t| t.errors_db[0]),
        mean(&|t| t.errors_db[1]),
        mean(&|t| t.errors_db[2]),
        mean(&|t| t.errors_db[3]),
        mean(&|t| t.between_db)
    )
}

fn number(name: &str, truth: f64, trips: &[Trip]) -> String {
    let inside = |trip: &Trip| {
        let interval = trip.found.estimate(name).and_then(|e| e.interval_95);
        interval.is_some_and(|[low, high]| low <= truth && truth <= high)
    };
    let all = trips.iter().filter(|trip| inside(trip)).count();
    let Some(estimate) = trips.first().and_then(|trip| trip.found.estimate(name)) else {
        return format!("| {name} | {truth} | not given | | no | {all} of {} |\n", trips.len());
    };
    let interval = estimate
        .interval_95
        .map_or("none".to_owned(), |[low, high]| format!("{} to {}", shown(low), shown(high)));
    let inside = if inside(&trips[0]) { "yes" } else { "no" };
    let value = shown(estimate.value);
    format!("| `{name}` | {truth} | {value} | {interval} | {inside} | {all} of {} |\n", trips.len())
}

/// Four digits.
fn shown(value: f64) -> String {
    let digits = (3.0 - value.abs().max(1e-9).log10().floor()).clamp(0.0, 9.0) as usize;
    format!("{value:.digits$}")
}

fn trip(scene: &Scene, seed: u64) -> Result<Trip, Failure> {
    let quiet = Radar { speckle: None, noise: None, ..scene.radar().clone() };
    let noise = Noise { level_dbm: Some(-112.0), range_sd_m: RANGE_SD_M, ..Noise::default() };
    let speckle =
        Speckle { looks: LOOKS, form: Some(SpeckleForm::Independent), ..Default::default() };
    let noisy = Radar { speckle: Some(speckle), noise: Some(noise), ..quiet.clone() };
    let mesh = &scene.target.mesh;
    let echoes = rendered(scene, &noisy, mesh, &truth(), seed)?;
    let threshold_w = watts_from_dbm(noisy.threshold_dbm);
    let seen: Vec<Echo> = echoes.into_iter().filter(|echo| echo.power_w >= threshold_w).collect();

    let cloud = Cloud::new(seen.iter().map(CloudPoint::from).collect())?;
    let mut draws = Key { seed, chirp: 0, sub_ray: 7, purpose: Purpose::Noise }.draws();
    let middle = middle(&cloud);
    let begin = pushed(&mut draws, middle);
    let registration = Registration { start: begin, ..Registration::default() };
    let registered = registration.run(mesh, &noisy, &scene.chirps, &cloud)?;
    let reduction = Reduction { exact_mesh: true, ..Reduction::default() };
    let reduced = reduction.run(&scene.target, &noisy, &scene.chirps, &cloud, &registered)?;
    let fit = Fit { noise_w: Some(noisy.noise_w()), ..Fit::default() };
    let found = fit.run(&start(), &reduced.curve)?;

    let moved = moved(mesh, &registered.pose);
    let again = rendered(scene, &quiet, &moved, &found.model, seed)?;
    let unmoved = rendered(scene, &quiet, mesh, &found.model, seed)?;
    let exact = rendered(scene, &quiet, mesh, &truth(), seed)?;
    let before = rendered(scene, &quiet, mesh, &start(), seed)?;
    Ok(Trip {
        shift_mm: 1e3 * Motion::of(&registered.pose, middle).shift_m.length(),
        rows: reduced.curve.observations.len(),
        silent: reduced.curve.observations.len() - reduced.curve.detected().count(),
        errors_db: [&before, &again, &unmoved, &exact].map(|image| rms_db(&seen, image)),
        between_db: rms_db(&unmoved, &exact),
        found,
    })
}

fn moved(mesh: &Mesh, pose: &Pose<Global, Global>) -> Mesh {
    let mut moved = mesh.clone();
    moved.vertices.iter_mut().for_each(|v| *v = (*pose * Point::from(*v)).xyz);
    moved
}

fn rendered(
    scene: &Scene,
    radar: &Radar,
    mesh: &Mesh,
    material: &Brdf,
    seed: u64,
) -> Result<Vec<Echo>, Failure> {
    let bvh = Bvh::new(mesh);
    let surfaces = vec![Surface::new(material as &dyn Scattering); scene.target.regions.len()];
    let regions = &scene.target.region_of_facet;
    let geometry = ScanGeometry::new(radar, &scene.chirps, &bvh, regions);
    let setup = Setup { seed, ..Setup::new(geometry, &surfaces) };
    let footprints = trace(&geometry, 1, &|_| {})?;
    Ok(shade(&setup, &footprints, Observer::Radar, &|_| {})?.echoes)
}

/// Rms of the difference of two images in the chirps that both show.
fn rms_db(a: &[Echo], b: &[Echo]) -> f64 {
    let of_chirp: std::collections::HashMap<u32, f64> =
        b.iter().map(|echo| (echo.chirp, dbm_from_watts(echo.power_w))).collect();
    let gap = |echo: &Echo| Some(dbm_from_watts(echo.power_w) - of_chirp.get(&echo.chirp)?);
    let gaps_db: Vec<f64> = a.iter().filter_map(gap).filter(|gap| gap.is_finite()).collect();
    (gaps_db.iter().map(|gap| gap * gap).sum::<f64>() / gaps_db.len().max(1) as f64).sqrt()
}
