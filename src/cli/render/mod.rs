//! `matdb render`.

mod report;
mod stages;
mod tracer;

use std::path::PathBuf;

use super::console::Console;
use super::hint::or_else;
use crate::error::Error;
use crate::files::write_all;
use crate::formats::exr::Packing;
use crate::render::RenderError;
use crate::report::{BeatShape, RenderRequest};
use crate::scene::KeyChange;
use crate::setup::{Database, ReadyScene};
use crate::trace::Tracer;
use stages::Stages;
use tracer::{Rays, gpu};

/// Render a scene: power.exr, power.png, cloud.ply and scan.json
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb render scenes/mannequin.toml -o out
  matdb render scenes/mannequin.toml -o out --all --json
  matdb render scenes/mannequin.toml -o out --seed 3 --set radar.speckle.looks=4
  matdb render scenes/mannequin.toml -o out --set 'mesh.mannequin.rotation_deg=[0, 20, 0]'
  matdb render scenes/showcase.toml -o out    spot, speckle, noise, receivers, second bounce")]
pub(super) struct Args {
    /// The scene file
    scene: PathBuf,
    /// Folder to write; created if needed
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Seed of everything random in place of the scene's: --set seed=N
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(i64).range(0..))]
    seed: Option<i64>,
    /// Change a key of the scene file for this run; repeatable. Tables in lists have names, as in
    /// mesh.NAME.scale=2; VALUE is TOML or a word without quotes
    #[arg(long = "set", value_name = "KEY=VALUE")]
    changes: Vec<KeyChange>,
    /// Put every hit into cloud.ply, not only those above the threshold
    #[arg(long)]
    all: bool,
    /// Also write view.html: the cloud in three dimensions, with target, radar and image, for a browser
    #[arg(long)]
    view: bool,
    /// Also write cloud.glb: the cloud and the target as glTF, for Blender, three.js and other programs
    #[arg(long)]
    glb: bool,
    /// Also write the beat signals: beat.npy, chirps x samples; needs [radar.receiver]
    #[arg(long)]
    beat: bool,
    /// Cut the images: `auto` ends them a spot beyond what any antenna detected
    #[arg(long, value_name = "auto", value_parser = ["auto"])]
    crop: Option<String>,
    /// Do not compress power.exr, for programs that cannot unpack it
    #[arg(long)]
    uncompressed: bool,
    /// How rays are traced; all give the same hits, `brute` to rounding [default: pinhole where
    /// rays share their origin, else bvh]
    #[arg(long, value_name = "NAME")]
    tracer: Option<Rays>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let stages = Stages::start("load", console);
    let seed = args.seed.map(|seed| KeyChange::new("seed", seed)).transpose()?;
    let changes: Vec<KeyChange> = seed.into_iter().chain(args.changes.iter().cloned()).collect();
    let ready = ReadyScene::open_changed(&args.scene, &changes, db.read()?.as_ref())?;
    let beat = args.beat.then(|| BeatShape::new(&ready.scene)).transpose();
    let beat = beat.map_err(|error| or_else(error, "leave --beat out"))?;
    let gpu = gpu(args.tracer, console);
    let gpu = gpu.map_err(|error| ready.render_error("", RenderError::Tracer(error.into())))?;
    let request = RenderRequest {
        tracer: args.tracer.map_or(Tracer::Automatic, Rays::tracer),
        gpu: gpu.as_ref(),
        all_hits: args.all,
        beat,
        view: args.view,
        glb: args.glb,
        crop: args.crop.is_some(),
        packing: if args.uncompressed { Packing::Uncompressed } else { Packing::Zip16 },
        ..RenderRequest::new(&ready)
    };
    let (chirps, antennas) = (ready.scene.chirps.rays.len(), 1 + ready.scene.file.receiver.len());
    let rendered =
        request.render(&|progress| stages.show(progress, [chirps, antennas * chirps]))?;
    stages.begin("write", None);
    write_all(&args.output, &rendered.files)?;
    report::print(&args.output, &rendered, stages, console)?;
    let left = rendered.left_behind(&args.output);
    if !left.is_empty() {
        let folder = args.output.display();
        console.notice(&format!(
            "{folder} also holds {}, which this rendering did not write",
            left.join(", ")
        ));
    }
    Ok(())
}
