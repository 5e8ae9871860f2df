//! `matdb diagnose`.

use std::path::PathBuf;

use super::cloud::CloudArgs;
use super::console::Console;
use super::database::Database;
use super::output::write_all;
use super::staging::materials;
use crate::brdf::Brdf;
use crate::diagnose::{Declared, Diagnosis, Subject, looks, matched};
use crate::effects::{Effect, Receiver, Stage, find, library, middle};
use crate::error::Error;
use crate::formats::text::nearest;
use crate::radar::{Link, Radar};
use crate::scene::Scene;
use crate::trace::Bvh;
use crate::units::watts_from_dbm;

/// Find the physical effect that a scene lacks to explain a measured cloud
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb diagnose cloud.ply --scene scene.toml -o diagnosis
  matdb diagnose cloud.ply --scene scene.toml --effects drift,fov-gain -o diagnosis
  matdb effects                                              what is tried, and how to tell it")]
pub(super) struct Args {
    #[command(flatten)]
    cloud: CloudArgs,
    /// The scene that was measured: its mesh, materials, radar and scan
    #[arg(long, value_name = "SCENE")]
    scene: PathBuf,
    /// Try only these effects [default: all]
    #[arg(long, value_name = "NAMES", value_delimiter = ',')]
    effects: Vec<String>,
    /// Seed of folds and of everything random
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write into; created when it is not there
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let scene = Scene::load(&args.scene)?;
    let effects = effects(&args.effects)?;
    let (used, material_of_region) = materials(&scene, &args.scene, db)?;
    let cloud = args.cloud.read(scene.radar())?;
    let laws: Vec<Brdf> =
        material_of_region.iter().map(|&m| used[usize::from(m)].scattering.clone()).collect();
    let bvh = Bvh::new(&scene.target.mesh);
    let grain_of_region: Vec<_> = scene.target.regions.iter().map(|region| region.grain).collect();
    let radar = scene.radar();
    let mut stage = Stage {
        radar,
        link: Link::new(radar),
        bvh: &bvh,
        region_of_facet: &scene.target.region_of_facet,
        grain_of_region: &grain_of_region,
        middle: glam::DVec3::ZERO,
    };
    let looks = looks(&stage, radar, &scene.chirps)?;
    stage.middle = middle(&looks);
    let matched = matched(&cloud, &looks, GATE_M)?;
    let (receiver, declared) = receiver(radar);
    let subject = Subject {
        stage: &stage,
        laws: &laws,
        receiver,
        declared,
        looks: &looks,
        observations: &matched.observations,
    };
    let report = Diagnosis { seed: args.seed, ..Diagnosis::default() }.run(&subject, &effects)?;
    let mut json = serde_json::to_vec_pretty(&report)?;
    json.push(b'\n');
    write_all(&args.output, &[("report.json", json)])?;
    console.result(&format!("{:?}\n", report.verdict), &report)
}

/// A detection further than this from where its chirp meets the target is a false alarm, m.
const GATE_M: f64 = 0.1;

fn receiver(radar: &Radar) -> (Receiver, Declared) {
    let looks = radar.speckle.map_or(1e4, |speckle| speckle.looks);
    let noise_w = radar.noise.map_or(0.0, |noise| watts_from_dbm(noise.level_dbm));
    let range_sd_m = radar.noise.map_or(0.0, |noise| noise.range_sd_m);
    let threshold_w = watts_from_dbm(radar.threshold_dbm);
    (Receiver { looks, noise_w, tilt_sd_rad: 0.0 }, Declared { threshold_w, range_sd_m })
}

/// The effects to try.
fn effects(names: &[String]) -> Result<Vec<&'static dyn Effect>, Error> {
    if names.is_empty() {
        return Ok(library().to_vec());
    }
    names.iter().map(|name| find(name).ok_or_else(|| unknown(name))).collect()
}

fn unknown(name: &str) -> Error {
    let known = library().map(|effect| effect.name());
    let way_out = match nearest(name, known) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "`matdb effects` lists them".to_owned(),
    };
    Error::Usage { problem: format!("there is no effect `{name}`"), way_out }
}
