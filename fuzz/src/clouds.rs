//! Measured clouds.

use std::path::Path;

use glam::DVec3;
use matdb::diagnose::{DiagnoseError, MeasuredScene, Options};
use matdb::effects::Effect;
use matdb::formats::PointFormat;
use matdb::frames::Pose;
use matdb::measure::{Calibration, Cloud, CloudReading, Reduction, Registration, Start};
use matdb::report::CalibrationReport;
use matdb::scene::{Scene, SceneFile};
use matdb::setup::ReadyScene;

/// A plate in the focus that 63 chirps look at, too few for a diagnosis.
const SCENE: &str = "
[radar]
preset = \"upm-300ghz\"
[radar.scan]
pattern = \"raster\"
lines = 7
chirps_per_line = 9
width_m = 0.16
height_m = 0.12
[radar.speckle]
looks = 4
[radar.noise]
range_sd_m = 0.002
[[mesh]]
name = \"plate\"
file = \"builtin:plate\"
size_m = [0.5, 0.5, 0.0]
translation_m = [0.0, 1.1, 0.0]
[[region]]
name = \"metal\"
material = \"steel\"
";

thread_local! {
    static READY: ReadyScene = {
        let file = SceneFile::parse(SCENE).expect("a scene file");
        let scene = Scene::resolve(file, Path::new("scene.toml")).expect("a scene");
        ReadyScene::new(scene, Path::new("scene.toml"), None).expect("materials that are built in")
    };
}

/// A cloud in any of its formats, which the first byte chooses: finite points.
pub fn cloud(bytes: &[u8]) {
    let Some((variant, rest)) = super::choice(bytes) else { return };
    let formats =
        [PointFormat::Ply, PointFormat::Csv, PointFormat::Xyz, PointFormat::Pcd, PointFormat::Las];
    let format = formats[variant % formats.len()];
    if let Ok(cloud) = CloudReading::default().read(format, rest) {
        assert!(cloud.points().iter().all(|p| p.point.xyz.is_finite() && p.power_w.is_finite()));
    }
}

/// A cloud as PLY or CSV against a scene: a calibration, a curve or a diagnosis of it has finite numbers.
pub fn measured(bytes: &[u8]) {
    let Some((variant, rest)) = super::choice(bytes) else { return };
    let format = [PointFormat::Ply, PointFormat::Csv][variant % 2];
    let Ok(cloud) = CloudReading::default().read(format, rest) else { return };
    READY.with(|ready| {
        calibrate(ready, &cloud);
        reduce(ready, &cloud);
        diagnose(ready, &cloud);
    });
}

fn calibrate(ready: &ReadyScene, cloud: &Cloud) {
    let report = CalibrationReport::new(ready, cloud, Path::new("cloud"), Calibration::default());
    if let Ok(report) = report {
        let loss_db = report.result.system_loss_db;
        assert!(loss_db.value.is_finite() && loss_db.sd >= 0.0, "{loss_db:?}");
        let [low, high] = report.result.waist_ratio.interval_95;
        assert!(low <= high, "{low} to {high}");
    }
}

/// The curve at the pose of the scene.
fn reduce(ready: &ReadyScene, cloud: &Cloud) {
    let scene = &ready.scene;
    let (target, radar, chirps) = (&scene.target, scene.radar(), &scene.chirps);
    let pose = Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
    let registration = Registration {
        start: Start::Given(pose),
        keep: true,
        least_points: 3,
        ..Registration::default()
    };
    let Ok(registered) = registration.run(&target.mesh, radar, chirps, cloud) else { return };
    assert!(registered.rms_m.is_finite() && registered.rms_m >= 0.0, "{} m", registered.rms_m);
    let Ok(reduced) = Reduction::default().run(target, radar, chirps, cloud, &registered) else {
        return;
    };
    for row in &reduced.curve.observations {
        assert!(row.level_sigma0().is_some_and(|sigma0| sigma0.is_finite() && sigma0 > 0.0));
        assert!(row.theta_i_rad.cos() > 0.0);
    }
}

/// Chirps and points are assigned to each other; then the points are too few.
fn diagnose(ready: &ReadyScene, cloud: &Cloud) {
    let (laws, seen_lobe_rad) = (ready.laws(), ready.seen_lobe_rad());
    let measured = MeasuredScene {
        scene: &ready.scene,
        cloud,
        antenna: None,
        laws: &laws,
        sheets: &ready.sheets,
        seen_lobe_rad: &seen_lobe_rad,
        declared_effects: &[],
    };
    let effects: [&dyn Effect; 0] = [];
    let options = Options { seed: 0, controls: false };
    let error = measured.diagnose(options, &effects, &|_| ()).err();
    if let Some(DiagnoseError::TooFew { detected }) = error {
        assert!(detected <= ready.scene.chirps.rays.len());
    } else {
        assert!(error.is_some(), "so few points are no answer");
    }
}
