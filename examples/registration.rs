//! How well a mesh is registered to a cloud: `cargo run --release --example registration -- 50`
//!
//! Each seed measures a target with the paper's scan, a range noise of 2 mm, the scattering of
//! painted fibreglass (a built-in, modelled material) and the threshold of −77 dBm; pushes the mesh
//! 30 mm and 5° off, in random directions; and registers it. Errors of the pose are the shift of the
//! middle of the measured points and the turn. Prints a Markdown table. All is synthetic.

use std::path::Path;
use std::time::Instant;

use glam::DVec3;
use matdb::brdf::Scattering;
use matdb::frames::{Global, Point, Pose};
use matdb::geometry::Mesh;
use matdb::measure::icp::Motion;
use matdb::measure::placed::Traced;
use matdb::measure::{Cloud, CloudPoint, Registered, Registration, Start};
use matdb::radar::random::{Draws, Key, Purpose};
use matdb::radar::{Chirps, Link, Radar};
use matdb::scene::Scene;
use matdb::units::dbm_from_watts;

const RANGE_SD_M: f64 = 2e-3;
const PUSH_M: f64 = 0.030;
const PUSH_DEG: f64 = 5.0;
const NEAR_M: f64 = 0.5e-3;
const NEAR_DEG: f64 = 0.05;

struct Run {
    shift_m: f64,
    turn_deg: f64,
    seconds: f64,
    found: Registered,
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(10), |count| count.parse())?;
    println!(
        "| target | points | seeds | within {} mm and {NEAR_DEG}° | median shift, mm \
              | worst | median turn, ° | worst | predicted sd, mm and ° | median time, ms |",
        1e3 * NEAR_M
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let methods = [("", Registration::default()), (", the paper's", Registration::paper())];
    for scene in ["mannequin", "human"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
        let scene_data = Scene::load(&path.with_extension("toml"))?;
        for (method, settings) in methods {
            let runs: Result<Vec<Run>, _> =
                (0..seeds).map(|seed| run(&scene_data, settings, seed)).collect();
            print_row(&format!("{scene}{method}"), &runs?);
        }
    }
    Ok(())
}

fn run(
    scene: &Scene,
    settings: Registration,
    seed: u64,
) -> Result<Run, Box<dyn std::error::Error>> {
    let (mesh, radar) = (&scene.target.mesh, scene.radar());
    let mut draws = Key { seed, chirp: 0, sub_ray: 0, purpose: Purpose::Noise }.draws();
    let cloud = measured(mesh, radar, &scene.chirps, &mut draws)?;
    let points = cloud.points();
    let middle = points.iter().map(|p| p.point.xyz).sum::<DVec3>() / points.len() as f64;
    let push = Motion {
        shift_m: PUSH_M * direction(&mut draws),
        turn_rad: PUSH_DEG.to_radians() * direction(&mut draws),
    };
    let start = Start::Given(push.about(middle));
    let begun = Instant::now();
    let found = Registration { start, ..settings }.run(mesh, radar, &scene.chirps, &cloud)?;
    let seconds = begun.elapsed().as_secs_f64();
    // The mesh of the scene is where it was measured: the true pose is to stay.
    let error = Motion::of(&found.pose, middle);
    let (shift_m, turn_deg) = (error.shift_m.length(), error.turn_rad.length().to_degrees());
    Ok(Run { shift_m, turn_deg, seconds, found })
}

fn measured(
    mesh: &Mesh,
    radar: &Radar,
    chirps: &Chirps,
    draws: &mut Draws,
) -> Result<Cloud, Box<dyn std::error::Error>> {
    let paint = matdb::material::builtin::get("mannequin-paint").ok_or("no such material")??;
    let paint = paint.scattering()?;
    let link = Link::new(radar);
    let here = Pose::<Global, Global>::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
    let seen = Traced::new(mesh).scan(&here, &chirps.rays);
    let mut points = Vec::new();
    for ((seen, ray), number) in seen.into_iter().zip(&chirps.rays).zip(&chirps.number) {
        let Some(hit) = seen.map(|seen| seen.hit) else { continue };
        let f_per_sr = paint.retro_per_sr(hit.theta_rad());
        let power_dbm = dbm_from_watts(link.power_w(hit.range_m, hit.cos_theta, f_per_sr));
        let range_m = hit.range_m + RANGE_SD_M * normal(draws);
        let point = Point::from(ray.origin.xyz + range_m * ray.direction.xyz());
        if power_dbm >= radar.threshold_dbm {
            points.push(CloudPoint {
                chirp: Some(*number),
                point,
                range_m: Some(range_m),
                power_dbm,
            });
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

fn print_row(name: &str, runs: &[Run]) {
    let sorted = |value: &dyn Fn(&Run) -> f64| {
        let mut values: Vec<f64> = runs.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values
    };
    let median = |values: &[f64]| values.get(values.len() / 2).copied().unwrap_or(f64::NAN);
    let worst = |values: &[f64]| values.last().copied().unwrap_or(f64::NAN);
    let shifts_mm = sorted(&|run| 1e3 * run.shift_m);
    let turns_deg = sorted(&|run| run.turn_deg);
    let trace = |run: &Run, first: usize| -> f64 {
        (first..first + 3).map(|i| run.found.covariance[i][i]).sum::<f64>().sqrt()
    };
    let near =
        |run: &&Run| run.found.converged && run.shift_m <= NEAR_M && run.turn_deg <= NEAR_DEG;
    println!(
        "| {name} | {} | {} | {} | {:.3} | {:.3} | {:.4} | {:.4} | {:.3}, {:.4} | {:.0} |",
        runs.first().map_or(0, |run| run.found.points),
        runs.len(),
        runs.iter().filter(near).count(),
        median(&shifts_mm),
        worst(&shifts_mm),
        median(&turns_deg),
        worst(&turns_deg),
        median(&sorted(&|run| 1e3 * trace(run, 0))),
        median(&sorted(&|run| trace(run, 3).to_degrees())),
        median(&sorted(&|run| 1e3 * run.seconds)),
    );
}
