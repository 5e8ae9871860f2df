//! How long a whole diagnosis of a scan of 18 529 chirps takes, for several hidden effects:
//!
//!     cargo bench --bench diagnose
//!     cargo bench --bench diagnose -- json     a line for each
//!
//! Every scan is rendered first, and the time of that, without its files, in the same run, is the measure: machines
//! differ, and their clocks drift. The goal is 60 s on two cores.

use std::path::Path;
use std::time::Instant;

use matdb::diagnose::{MeasuredScene, Options, Report};
use matdb::effects::library;
use matdb::measure::{Cloud, CloudPoint};
use matdb::setup::ReadyScene;

/// What is hidden in a scan: its name, and what the scene that made it says of it.
const HIDDEN: [(&str, &str); 8] = [
    ("nothing", ""),
    ("drift", "[[radar.effect]]\nname = 'drift'\nslope_db = 2.0\n"),
    ("foreign-patch", "[[effect]]\nname = 'foreign-patch'\nlevel_db = 6.0\ncentre_y_m = 0.2\n"),
    ("pose", "[[effect]]\nname = 'pose'\nrotation_y_deg = 0.3\n"),
    ("motion", "[[effect]]\nname = 'motion'\nz1_m = 0.02\nx2_m = -0.01\ny3_m = 0.005\n"),
    (
        "motion, fov-gain",
        "[[effect]]\nname = 'motion'\nz1_m = 0.02\nx2_m = -0.01\n\
         [[radar.effect]]\nname = 'fov-gain'\nedge_db = -3.0\n",
    ),
    ("finite-spot", "[[radar.effect]]\nname = 'finite-spot'\ndiameter_m = 0.03\n"),
    ("multi-bounce", "[[effect]]\nname = 'multi-bounce'\ncoupling_db = 10.0\n"),
];

/// Whatever a scene or a scan is refused for.
type Failure = Box<dyn std::error::Error>;

fn main() -> Result<(), Failure> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let declared = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bench.toml");
    let bench = std::fs::read_to_string(&declared).expect("the scene");
    let json = std::env::args().any(|argument| argument == "json");
    if !json {
        println!("hidden          diagnosis     render      ratio   verdict");
    }
    for (name, effect) in HIDDEN {
        let scene = folder.path().join(format!("{name}.toml"));
        std::fs::write(&scene, format!("{bench}\n{effect}")).expect("room for a scene");
        let begun = Instant::now();
        let cloud = rendered(&scene)?;
        let render_s = begun.elapsed().as_secs_f64();
        let begun = Instant::now();
        let report = diagnosed(&declared, &cloud)?;
        let diagnose_s = begun.elapsed().as_secs_f64();
        let ratio = diagnose_s / render_s;
        let said = verdict(&report);
        if json {
            let row = serde_json::json!({
                "hidden": name, "diagnose_s": diagnose_s, "render_s": render_s, "said": said,
            });
            println!("{row}");
        } else {
            println!("{name:<14} {diagnose_s:>8.1} s {render_s:>8.2} s {ratio:>10.0}   {said}");
        }
    }
    Ok(())
}

/// The detections of a scene as a cloud.
fn rendered(scene: &Path) -> Result<Cloud, Failure> {
    let ready = ReadyScene::open(scene, None)?;
    let assembly = ready.assemble();
    let setup = assembly.setup();
    let footprints = assembly.trace(&setup, &|_| ())?;
    let scan = assembly.shade(&setup, &footprints, &|_| ())?;
    Ok(Cloud::new(scan.detections().map(CloudPoint::from).collect())?)
}

/// What a scene lacks to explain a cloud.
fn diagnosed(scene: &Path, cloud: &Cloud) -> Result<Report, Failure> {
    let ready = ReadyScene::open(scene, None)?;
    let model = ready.model();
    let measured = MeasuredScene {
        seen_lobe_rad: &ready.seen_lobe_rad(),
        scene: &ready.scene,
        cloud,
        antenna: None,
        laws: &ready.laws(),
        sheets: &ready.sheets,
        declared_effects: model.as_ref().map_or(&[][..], |model| &model.effects),
    };
    Ok(measured.diagnose(Options { seed: 0, controls: true }, &library(), &|_| ())?)
}

/// The verdict and the names of a report.
fn verdict(report: &Report) -> String {
    let report = serde_json::json!(report);
    let names = report["effects"].as_array().into_iter().flatten();
    let names: Vec<&str> = names.filter_map(|effect| effect["name"].as_str()).collect();
    format!("{}: {}", report["verdict"].as_str().unwrap_or("none"), names.join(", "))
}
