//! Scans of a scene's target as it turns about the vertical through the origin, many at once, each with speckle of its own: on a
//! graphics processor where there is one and the program is built for it, else on the processor.
//!
//!     cargo run --release --features gpu --example batch -- scenes/mannequin.toml [SCANS] [RAYS]

use std::path::PathBuf;

use glam::DVec3;
use matdb::frames::Pose;
use matdb::render::{Batch, Take};
use matdb::setup::ReadyScene;
use matdb::trace::{Gpu, ScanGeometry, Tracer};
use matdb::units::dbm_from_watts;

type Answer<T> = Result<T, Box<dyn std::error::Error>>;

fn main() -> Answer<()> {
    let mut arguments = std::env::args().skip(1);
    let scene =
        PathBuf::from(arguments.next().ok_or("give a scene, such as scenes/mannequin.toml")?);
    let mut number = |usual: usize| arguments.next().map_or(Ok(usual), |text| text.parse());
    let (scans, rays_per_chirp) = (number(12)?, number(1)?);
    let ready = ReadyScene::open(&scene, None)?;
    let scene = &ready.scene;
    if scene.file.bounce.is_some() || !ready.effects.is_empty() {
        return Err(
            "a batch has neither second bounces nor effects; take them out of the scene".into()
        );
    }
    let assembly = ready.assemble();
    let setup = assembly.setup();

    let turn_deg = |scan: usize| 360.0 * scan as f64 / scans as f64;
    let take = |scan: usize| {
        let turn_rad = DVec3::new(0.0, turn_deg(scan).to_radians(), 0.0);
        let target = Pose::from_euler_xyz(turn_rad, DVec3::ZERO);
        Take { target, surfaces: setup.surfaces, seed: scan as u64, noise_seed: None }
    };
    let takes: Vec<Take> = (0..scans).map(take).collect();

    let gpu = match Gpu::new() {
        Ok(gpu) => Some(gpu),
        Err(reason) => {
            eprintln!("note: {reason}; on the processor instead");
            None
        }
    };
    let held = gpu.as_ref().map(|gpu| gpu.hold(setup.geometry.bvh)).transpose()?;
    let batch = Batch {
        geometry: ScanGeometry {
            tracer: held.as_ref().map_or(Tracer::Automatic, Tracer::Gpu),
            ..setup.geometry
        },
        rays_per_chirp,
    };
    if let Some(gpu) = &gpu {
        eprintln!("note: on {}", gpu.adapter());
    }
    let found = batch.run(&takes)?;

    println!("turn_deg,detections,strongest_dbm");
    for (scan, echoes) in found.echoes.iter().enumerate() {
        let powers_dbm = || echoes.iter().flatten().map(|echo| dbm_from_watts(echo.power_w));
        let detections = powers_dbm().filter(|&dbm| dbm >= scene.radar().threshold_dbm).count();
        let strongest_dbm = powers_dbm().fold(f64::NEG_INFINITY, f64::max);
        println!("{:.3},{detections},{strongest_dbm:.2}", turn_deg(scan));
    }
    eprintln!("{} of {} rays on the processor", found.rays_on_processor, found.rays);
    Ok(())
}
