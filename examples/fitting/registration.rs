//! How well a mesh is registered to a cloud, from a wrong start.

use std::path::Path;

use glam::DVec3;
use matdb::brdf::Scattering;
use matdb::frames::{Global, Point, Pose};
use matdb::measure::icp::Motion;
use matdb::measure::tracer::{RaySet, Tracer};
use matdb::measure::{Cloud, CloudPoint, Registration, RegistrationResult, Start};
use matdb::radar::Link;
use matdb::radar::random::{Draws, Key, Purpose};
use matdb::scene::Scene;
use matdb::units::watts_from_dbm;
use rayon::prelude::*;

use crate::Failure;

const RANGE_SD_M: f64 = 2e-3;
const PUSH_M: f64 = 0.030;
const PUSH_DEG: f64 = 5.0;
const NEAR_M: f64 = 0.5e-3;
const NEAR_DEG: f64 = 0.05;

struct Run {
    shift_mm: f64,
    turn_deg: f64,
    found: RegistrationResult,
}

/// A scene that comes with the program.
pub fn scene(name: &str) -> Result<Scene, Failure> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes");
    Ok(Scene::load(&folder.join(name).with_extension("toml"))?)
}

/// A start that is 30 mm and 5° off, in directions of the draws' choice.
pub fn pushed(draws: &mut Draws, middle: DVec3) -> Start {
    let push = Motion {
        shift_m: PUSH_M * direction(draws),
        turn_rad: PUSH_DEG.to_radians() * direction(draws),
    };
    Start::Given(push.about(middle))
}

/// Middle of the points, m.
pub fn middle(cloud: &Cloud) -> DVec3 {
    let points = cloud.points();
    points.iter().map(|p| p.point.xyz).sum::<DVec3>() / points.len().max(1) as f64
}

/// The section of the page.
pub fn section(seeds: usize) -> Result<String, Failure> {
    let mut text = format!(
        "## Registration (synthetic, {seeds} seeds)

Each seed measures a target with the paper's scan, 2 mm of range noise, the scattering of `mannequin-paint` (a
modelled built-in) and the threshold of −77 dBm. It displaces the mesh by 30 mm and 5° in random directions and registers
it. The error is the shift of the middle of the measured points, and the rotation. *Good* is within 0.5 mm and 0.05°; the
goal is 48 of 50. “The paper's” is point-to-point ICP as in its Sec. V-B. *Predicted* is the standard deviation that the
result states (square root of the trace over three axes). A median error should be slightly below it.

| target | method | points | good | median shift, mm | worst | median turn, ° | worst | predicted, mm and ° |
|---|---|--:|--:|--:|--:|--:|--:|--:|
"
    );
    for target in ["mannequin", "human"] {
        let scene = scene(target)?;
        for (name, settings) in [
            ("along the rays (default)", Registration::default()),
            ("the paper's", Registration::paper()),
        ] {
            let runs: Vec<Result<Run, String>> = (0..seeds as u64)
                .into_par_iter()
                .map(|seed| run(&scene, settings, seed).map_err(|error| error.to_string()))
                .collect();
            let runs: Vec<Run> = runs.into_iter().collect::<Result<_, _>>()?;
            text += &row(target, name, &runs);
            eprintln!("{target}, {name}");
        }
    }
    text += "
The paper's metric is biased by construction. The measured and the virtual cloud have different borders, and nearest neighbours pull
the mesh along its surface by a part of the point spacing.
";
    Ok(text)
}

fn run(scene: &Scene, settings: Registration, seed: u64) -> Result<Run, Failure> {
    let mut draws = Key { seed, chirp: 0, sub_ray: 0, purpose: Purpose::Noise }.draws();
    let cloud = measured(scene, &mut draws)?;
    let middle = middle(&cloud);
    let start = pushed(&mut draws, middle);
    let settings = Registration { start, ..settings };
    let found = settings.run(&scene.target.mesh, scene.radar(), &scene.chirps, &cloud)?;
    // The mesh of the scene is where it was measured: the true pose is to stay.
    let error = Motion::of(&found.pose, middle);
    let (shift_mm, turn_deg) = (1e3 * error.shift_m.length(), error.turn_rad.length().to_degrees());
    Ok(Run { shift_mm, turn_deg, found })
}

fn measured(scene: &Scene, draws: &mut Draws) -> Result<Cloud, Failure> {
    let paint = matdb::material::builtin::get("mannequin-paint").ok_or("no such material")??;
    let paint = paint.scattering()?;
    let radar = scene.radar();
    let link = Link::new(radar);
    let here = Pose::<Global, Global>::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
    let seen = Tracer::new(&scene.target.mesh)
        .scan(&here, &RaySet::new(&scene.target.mesh, &scene.chirps.rays));
    let mut points = Vec::new();
    for ((seen, ray), number) in seen.into_iter().zip(&scene.chirps.rays).zip(&scene.chirps.number)
    {
        let Some(hit) = seen.map(|seen| seen.hit) else { continue };
        let f_per_sr = paint.retro_per_sr(hit.theta_rad());
        let power_w = link.power_w(&link.beam.along(ray), hit.range_m, hit.cos_theta, f_per_sr);
        let range_m = hit.range_m + RANGE_SD_M * normal(draws);
        let point = Point::from(ray.origin.xyz + range_m * ray.direction.xyz());
        if power_w >= watts_from_dbm(radar.threshold_dbm) {
            let chirp = Some(*number);
            points.push(CloudPoint { chirp, point, range_m: Some(range_m), power_w });
        }
    }
    Ok(Cloud::new(points)?)
}

fn normal(draws: &mut Draws) -> f64 {
    draws.complex_gaussian().re * std::f64::consts::SQRT_2
}

fn direction(draws: &mut Draws) -> DVec3 {
    DVec3::new(normal(draws), normal(draws), normal(draws)).normalize_or(DVec3::X)
}

fn row(target: &str, method: &str, runs: &[Run]) -> String {
    let sorted = |value: &dyn Fn(&Run) -> f64| {
        let mut values: Vec<f64> = runs.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let median = |values: &[f64]| values.get(values.len() / 2).copied().unwrap_or(f64::NAN);
    let worst = |values: &[f64]| values.last().copied().unwrap_or(f64::NAN);
    let shifts_mm = sorted(&|run| run.shift_mm);
    let turns_deg = sorted(&|run| run.turn_deg);
    let trace = |run: &Run, first: usize| -> f64 {
        (first..first + 3).map(|i| run.found.covariance[i][i]).sum::<f64>().sqrt()
    };
    let good = |run: &&Run| {
        run.found.converged && run.shift_mm <= 1e3 * NEAR_M && run.turn_deg <= NEAR_DEG
    };
    format!(
        "| {target} | {method} | {} | {} of {} | {:.3} | {:.3} | {:.4} | {:.4} | {:.3}, {:.4} |\n",
        runs.first().map_or(0, |run| run.found.points),
        runs.iter().filter(good).count(),
        runs.len(),
        median(&shifts_mm),
        worst(&shifts_mm),
        median(&turns_deg),
        worst(&turns_deg),
        median(&sorted(&|run| 1e3 * trace(run, 0))),
        median(&sorted(&|run| trace(run, 3).to_degrees())),
    )
}
