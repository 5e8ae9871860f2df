//! Scenes and what they name: rays and poses.

use std::path::Path;

use glam::DMat3;
use matdb::radar::{Chirps, Pattern, Radar};
use matdb::scene::{Scene, SceneFile};
use matdb::setup::{ReadyScene, read_pose};
use tempfile::TempDir;

/// Larger scans are not drawn and larger scenes not rendered, to save time.
const MOST_CHIRPS: usize = 20_000;
const MOST_RAYS: usize = 400;
const MOST_FACETS: usize = 5_000;
/// A mesh that takes half a second to make.
const SLOW_MESH: &str = "builtin:mannequin";

/// A scene that is read can be written. One that is loaded and small can be rendered, and its echoes are finite.
pub fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let Ok(file) = SceneFile::parse(text) else { return };
    let written = file.write(text).expect("a scene that was read can be written");
    let again = SceneFile::parse(&written).expect("a scene that was written can be read");
    // Not a number differs from itself.
    assert_eq!(format!("{again:?}"), format!("{file:?}"), "{written}");
    let is_slow = file.mesh.iter().any(|mesh| mesh.file == SLOW_MESH);
    if is_slow || chirps(&file.radar.scan) > MOST_CHIRPS {
        return;
    }
    let Ok(scene) = Scene::resolve(file, Path::new("scene.toml")) else { return };
    assert!(scene.chirps.rays.iter().all(|ray| ray.direction.xyz().is_finite()));
    let bounces = scene.file.bounce.map_or(1, |bounce| bounce.rays);
    let rays = scene.chirps.rays.len().saturating_mul(scene.file.spot.rays).saturating_mul(bounces);
    if rays > MOST_RAYS || scene.target.mesh.facets.len() > MOST_FACETS {
        return;
    }
    let Ok(ready) = ReadyScene::new(scene, Path::new("scene.toml"), None) else { return };
    let _ = ready.notices();
    let assembly = ready.assemble();
    let setup = assembly.setup();
    let Ok(footprints) = assembly.trace(&setup, &|_| ()) else { return };
    let Ok(views) = assembly.views(&setup, &footprints, &|_| ()) else { return };
    for echo in views.iter().flat_map(|view| &view.scan.echoes) {
        assert!(echo.power_w.is_finite() && echo.power_w >= 0.0, "{} W", echo.power_w);
        assert!(echo.range_m.is_finite(), "{} m", echo.range_m);
    }
}

/// Number of chirps that a pattern asks for.
fn chirps(pattern: &Pattern) -> usize {
    match pattern {
        Pattern::Elliptical(scan) => scan.chirps,
        Pattern::Raster(scan) => scan.lines.saturating_mul(scan.chirps_per_line),
        Pattern::AngularRaster(scan) => scan.lines.saturating_mul(scan.chirps_per_line),
        Pattern::Lissajous(scan) => scan.chirps,
        Pattern::Spiral(scan) => scan.chirps,
        Pattern::Rays(_) | Pattern::Angles(_) => 0,
    }
}

/// Rays or mirror angles of a scan: one finite ray for every chirp, each with a number and a time.
pub fn rays(bytes: &[u8]) {
    let Some((variant, table)) = super::choice(bytes) else { return };
    let pattern = ["rays", "angles"][variant % 2];
    let scan = format!("pattern = \"{pattern}\"\nfile = \"scan.csv\"\n");
    let scan: Pattern = toml::from_str(&scan).expect("a pattern");
    let radar = Radar { scan, ..Radar::default() };
    let Ok(chirps) = Chirps::draw(&radar, |_| Ok(table.to_vec())) else { return };
    let count = chirps.rays.len();
    assert!(count > 0 && chirps.number.len() == count && chirps.time_s.len() == count);
    for ray in &chirps.rays {
        assert!((ray.direction.xyz().length() - 1.0).abs() < 1e-9);
        assert!(ray.origin.xyz.is_finite());
    }
    assert!(chirps.progress().iter().all(|share| (0.0..=1.0).contains(share)));
    let field = chirps.field(&radar.frames());
    assert!(field.sides_m().iter().all(|side_m| *side_m >= 0.0));
}

thread_local! {
    static FOLDER: TempDir = tempfile::tempdir().expect("a folder");
}

/// A pose is a rotation with a finite shift.
pub fn pose(bytes: &[u8]) {
    FOLDER.with(|folder| {
        let path = folder.path().join("pose.json");
        std::fs::write(&path, bytes).expect("room for a file");
        let Ok(pose) = read_pose(&path) else { return };
        let rotation = pose.rotation();
        let error = rotation * rotation.transpose() - DMat3::IDENTITY;
        assert!(error.to_cols_array().iter().all(|entry| entry.abs() < 1e-5));
        assert!(pose.translation_m().is_finite());
    });
}
