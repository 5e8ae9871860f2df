//! How long the paper's scan takes to be predicted again when a material or an effect changes and the
//! geometry does not, against tracing it anew:
//!
//!     cargo bench --bench reshade
//!     cargo bench --bench reshade -- json     quartiles, a line for each number of threads
//!
//! Ways are taken in turns, and medians are printed.

#[path = "support/clock.rs"]
mod clock;

use std::hint::black_box;
use std::path::Path;

use clock::{quartiles, timed};
use glam::DVec3;
use matdb::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Shadowing};
use matdb::diagnose;
use matdb::effects::{self, Effect, Model, PredictionCache, Receiver, Stage};
use matdb::radar::Link;
use matdb::setup::ReadyScene;
use matdb::trace::Tracer;

const TURNS: usize = 101;

fn main() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/bench.toml");
    let ready = ReadyScene::open(&path, None).expect("the scene");
    let assembly = ready.assemble();
    let (radar, chirps, bvh) = (ready.scene.radar(), &ready.scene.chirps, assembly.bvh());
    let mut stage = Stage {
        geometry: assembly.setup().geometry,
        link: Link::new(radar),
        grain_of_region: &[DVec3::Y],
        seen_lobe_rad: &[],
        on_wavefront: false,
        antenna: None,
        middle: DVec3::ZERO,
    };
    let shots = diagnose::trace_shots(&stage).expect("chirps that meet the target");
    stage.middle = effects::middle(&shots);
    let drift = effects::find("drift").expect("the effect");
    let json = std::env::args().any(|argument| argument == "json");
    if !json {
        println!("{} chirps, {} of them on the target", chirps.rays.len(), shots.len());
    }
    for threads in [1, 2] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let quartiles = pool.install(|| {
            let kept = PredictionCache::default();
            let mut times = [(); 4].map(|()| Vec::new());
            for turn in 0..TURNS {
                let change = turn as f64 / TURNS as f64;
                let predict = |m: f64, drift_db: f64| {
                    model(m, drift, drift_db).predict_with(&stage, &shots, &kept)
                };
                let ways: [&dyn Fn(); 4] = [
                    &|| drop(black_box(Tracer::Pinhole.closest(bvh, &chirps.rays))),
                    &|| drop(black_box(predict(0.2, 1.0))),
                    &|| drop(black_box(predict(0.2 + 0.1 * change, 1.0))),
                    &|| drop(black_box(predict(0.2, 1.0 + change))),
                ];
                for (times, way) in times.iter_mut().zip(ways) {
                    times.push(timed(way).0);
                }
            }
            times.map(quartiles)
        });
        if json {
            let [traced, same, law, effect] = quartiles;
            println!(
                "{}",
                serde_json::json!({
                    "threads": threads, "chirps": chirps.rays.len(), "shots": shots.len(),
                    "traced": traced, "same": same, "law": law, "effect": effect,
                })
            );
            continue;
        }
        let [trace, same, law, effect] = quartiles.map(|[_, median, _]| median);
        println!(
            "{threads} threads: traced anew {trace:.3} ms; predicted again {same:.3} ms, with another \
             law {law:.3} ms, with another effect {effect:.3} ms"
        );
    }
}

/// Paint of a roughness, and a gain that drifts.
fn model(m: f64, drift: &dyn Effect, drift_db: f64) -> Model<'_> {
    let (distribution, shadowing) = (Distribution::Beckmann, Shadowing::Separable);
    let lobe = CookTorrance { f_lambda: 0.2, m, m_across: None, distribution, shadowing };
    let paint = Brdf::Mixture(Mixture {
        k: 0.3,
        diffuse: Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: 0.02, alpha: 4.0 })),
        specular: Box::new(Brdf::CookTorrance(lobe)),
    });
    let values = drift.parameters().iter().map(|parameter| parameter.absent);
    let values = values.enumerate().map(|(k, absent)| if k == 0 { drift_db } else { absent });
    Model {
        laws: vec![paint],
        receiver: Receiver::LINEAR,
        effects: vec![(drift, values.collect())],
        level: 1.0,
    }
}
