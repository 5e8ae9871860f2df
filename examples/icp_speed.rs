//! Milliseconds and errors of a registration of some 20 000 points, one JSON line for every line on stdin:
//! the half that `benches/rivals/icp.py` starts. The clouds and the push go into the folder that is given.
//!
//!     cargo run --release --example icp_speed -- DIR

#[path = "support/turns.rs"]
mod turns;

use std::fmt::Write;
use std::path::Path;

use glam::DVec3;
use matdb::frames::{Global, Point, Pose};
use matdb::measure::icp::Motion;
use matdb::measure::tracer::{RaySet, Tracer};
use matdb::measure::{Cloud, CloudPoint, Registration, Start};
use matdb::radar::random::{Key, Purpose};
use matdb::scene::{Scene, SceneFile};
use turns::{Answer, join_pool, serve, timed};

const RANGE_SD_M: f64 = 2e-3;
const PUSH_M: f64 = 0.032;
const PUSH_DEG: f64 = 5.0;
/// So many that some 20 000 of them meet the target.
const CHIRPS: usize = 42_000;

fn main() -> Answer<()> {
    join_pool()?;
    let folder = std::env::args().nth(1).ok_or("give a folder for the clouds")?;
    let scene = scene()?;
    let cloud = measured(&scene)?;
    assert!((19_000..=21_000).contains(&cloud.points().len()), "{} points", cloud.points().len());
    let middle =
        cloud.points().iter().map(|p| p.point.xyz).sum::<DVec3>() / cloud.points().len() as f64;
    let axis = DVec3::new(0.3, 1.0, 0.2).normalize();
    let push = Motion {
        shift_m: PUSH_M * axis.any_orthonormal_vector(),
        turn_rad: PUSH_DEG.to_radians() * axis,
    };
    let rough = push.about(middle);
    write_clouds(Path::new(&folder), &scene, &cloud, &rough)?;

    let settings = Registration { start: Start::Given(rough), ..Registration::default() };
    let run = || settings.run(&scene.target.mesh, scene.radar(), &scene.chirps, &cloud);
    serve(|| {
        let (ms, found) = timed(run);
        let error = Motion::of(&found?.pose, middle);
        Ok(serde_json::json!({
            "points": cloud.points().len(),
            "ms": ms,
            "shift_mm": 1e3 * error.shift_m.length(),
            "turn_deg": error.turn_rad.length().to_degrees(),
        }))
    })
}

/// The human scene with more chirps than the paper's.
fn scene() -> Answer<Scene> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/human.toml");
    let text = std::fs::read_to_string(&path)?;
    let scan = format!("[radar.scan]\npattern = \"elliptical\"\nchirps = {CHIRPS}\n\n[[mesh]]");
    Ok(Scene::resolve(SceneFile::parse(&text.replacen("[[mesh]]", &scan, 1))?, &path)?)
}

/// Every hit with noise in range; its power plays no part.
fn measured(scene: &Scene) -> Answer<Cloud> {
    let here = Pose::<Global, Global>::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
    let seen = Tracer::new(&scene.target.mesh)
        .scan(&here, &RaySet::new(&scene.target.mesh, &scene.chirps.rays));
    let mut draws = Key { seed: 5, chirp: 0, sub_ray: 0, purpose: Purpose::Range }.draws();
    let mut points = Vec::new();
    for ((seen, ray), chirp) in seen.into_iter().zip(&scene.chirps.rays).zip(&scene.chirps.number) {
        let Some(seen) = seen else { continue };
        let range_m = seen.hit.range_m + RANGE_SD_M * draws.gaussian();
        let point = Point::from(ray.origin.xyz + range_m * ray.direction.xyz());
        points.push(CloudPoint {
            chirp: Some(*chirp),
            point,
            range_m: Some(range_m),
            power_w: 1e-9,
        });
    }
    Ok(Cloud::new(points)?)
}

/// `measured.xyz`, and `virtual.xyz`: what the scan sees of the pushed mesh, with normals.
fn write_clouds(
    folder: &Path,
    scene: &Scene,
    cloud: &Cloud,
    rough: &Pose<Global, Global>,
) -> std::io::Result<()> {
    let mut measured = String::new();
    for point in cloud.points() {
        let [x, y, z] = point.point.xyz.to_array();
        let _ = writeln!(measured, "{x} {y} {z}");
    }
    let mut seen_text = String::new();
    let seen = Tracer::new(&scene.target.mesh)
        .scan(rough, &RaySet::new(&scene.target.mesh, &scene.chirps.rays));
    for seen in seen.into_iter().flatten() {
        let ([x, y, z], [u, v, w]) = (seen.hit.point.xyz.to_array(), seen.normal.to_array());
        let _ = writeln!(seen_text, "{x} {y} {z} {u} {v} {w}");
    }
    let rows: Vec<String> =
        (0..3).map(|row| format!("{:?}", rough.rotation().row(row).to_array())).collect();
    let shift = rough.translation_m().to_array();
    std::fs::write(folder.join("measured.xyz"), measured)?;
    std::fs::write(folder.join("virtual.xyz"), seen_text)?;
    let push = format!("{{\"rotation\": [{}], \"shift_m\": {shift:?}}}", rows.join(", "));
    std::fs::write(folder.join("push.json"), push)
}
