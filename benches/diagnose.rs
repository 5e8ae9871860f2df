//! How long a whole diagnosis of a scan of 18 529 chirps takes, for several hidden effects:
//!
//!     cargo bench --bench diagnose
//!     cargo bench --bench diagnose -- json     a line for each
//!
//! Every scan is rendered first, and the time of that, in the same run, is the measure: machines
//! differ, and their clocks drift. The goal is 60 s on two cores.

use std::path::Path;
use std::process::Command;
use std::time::Instant;

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

fn main() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let bench = std::fs::read_to_string(root.join("scenes/bench.toml")).expect("the scene");
    let json = std::env::args().any(|argument| argument == "json");
    if !json {
        println!("hidden          diagnosis     render      ratio   verdict");
    }
    for (name, effect) in HIDDEN {
        let scene = folder.path().join(format!("{name}.toml"));
        std::fs::write(&scene, format!("{bench}\n{effect}")).expect("room for a scene");
        let (made, why) = (folder.path().join(name), folder.path().join(format!("why-{name}")));
        let render_s = seconds(&["render".as_ref(), scene.as_ref(), "-o".as_ref(), made.as_ref()]);
        let (cloud, declared) = (made.join("cloud.ply"), root.join("scenes/bench.toml"));
        let diagnose_s = seconds(&[
            "diagnose".as_ref(),
            cloud.as_ref(),
            "--scene".as_ref(),
            declared.as_ref(),
            "-o".as_ref(),
            why.as_ref(),
        ]);
        let ratio = diagnose_s / render_s;
        let said = verdict(&why.join("report.json"));
        match json {
            true => println!(
                "{}",
                serde_json::json!({
                    "hidden": name, "diagnose_s": diagnose_s, "render_s": render_s, "said": said,
                })
            ),
            false => {
                println!("{name:<14} {diagnose_s:>8.1} s {render_s:>8.2} s {ratio:>10.0}   {said}")
            }
        }
    }
}

fn seconds(arguments: &[&std::ffi::OsStr]) -> f64 {
    let begun = Instant::now();
    let mut matdb = Command::new(env!("CARGO_BIN_EXE_matdb"));
    let status = matdb.env_remove("MATDB").arg("--quiet").args(arguments).status();
    assert!(status.expect("the program runs").success(), "{arguments:?}");
    begun.elapsed().as_secs_f64()
}

/// The verdict and the names of a report.
fn verdict(report: &Path) -> String {
    let bytes = std::fs::read(report).expect("a report");
    let report: serde_json::Value = serde_json::from_slice(&bytes).expect("JSON");
    let names = report["effects"].as_array().into_iter().flatten();
    let names: Vec<&str> = names.filter_map(|effect| effect["name"].as_str()).collect();
    format!("{}: {}", report["verdict"].as_str().unwrap_or("none"), names.join(", "))
}
