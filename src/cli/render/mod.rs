//! `matdb render`.

mod beat;
mod files;
mod report;
mod stages;
mod tracer;

use std::path::PathBuf;

use super::console::Console;
use crate::error::Error;
use crate::files::write_all;
use crate::formats::exr::Packing;
use crate::geometry::Raster;
use crate::render::{RenderError, trace_placed};
use crate::report::ScanRecord;
use crate::setup::Database;
use crate::setup::ReadyScene;
use crate::trace::GpuError;
use stages::Stages;
use tracer::{Rays, gpu, tracer};

/// Render a scene: power.exr, power.png, cloud.ply and scan.json
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb render scenes/mannequin.toml -o out
  matdb render scenes/mannequin.toml -o out --all --json
  matdb render scenes/showcase.toml -o out    spot, speckle, noise, receivers, second bounce")]
pub(super) struct Args {
    /// The scene file
    scene: PathBuf,
    /// Folder to write; created if needed
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Put every hit into cloud.ply, not only those above the threshold
    #[arg(long)]
    all: bool,
    /// Also write the beat signals: beat.npy, chirps x samples; needs [radar.receiver]
    #[arg(long)]
    beat: bool,
    /// Do not compress power.exr, for programs that cannot unpack it
    #[arg(long)]
    uncompressed: bool,
    /// How rays are traced; all give the same hits, `brute` to rounding [default: pinhole where
    /// rays share their origin, else bvh]
    #[arg(long, value_name = "NAME")]
    tracer: Option<Rays>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let mut stages = Stages::start();
    let ready = ReadyScene::open(&args.scene, db.read()?.as_ref())?;
    let beat = args.beat.then(|| beat::Shape::new(&ready.scene)).transpose()?;
    stages.end("load", console);

    let assembly = ready.assemble();
    let failed = |error: GpuError| ready.render_error("", RenderError::Tracer(error.into()));
    let gpu = gpu(args.tracer, console).map_err(failed)?;
    let held = gpu.as_ref().map(|gpu| gpu.hold(assembly.bvh())).transpose().map_err(failed)?;
    let mut setup = assembly.setup();
    setup.geometry.tracer = tracer(args.tracer, held.as_ref());
    let chirps = ready.scene.chirps.rays.len();
    let bar = console.progress("tracing", chirps);
    let rays = ready.scene.file.spot.rays;
    let footprints = trace_placed(&setup, rays, &|chirps| bar.inc(chirps as u64));
    bar.finish_and_clear();
    let footprints = footprints.map_err(|error| ready.render_error("", error))?;
    stages.end("trace", console);

    let bar = console.progress("receiving", (1 + ready.scene.file.receiver.len()) * chirps);
    let views = assembly.views(&setup, &footprints, &|chirps| bar.inc(chirps as u64));
    bar.finish_and_clear();
    let views = views?;
    stages.end("power", console);
    let images: Vec<Raster> = views.iter().map(|view| ready.image(&view.scan)).collect();
    stages.end("image", console);

    let packing = if args.uncompressed { Packing::Uncompressed } else { Packing::Zip16 };
    let record = ScanRecord::new(&ready, assembly.model(), &views, &images, args.all);
    let mut files = files::encode(args.all, packing, &ready, &views, &images, &record)?;
    if let Some(shape) = beat {
        files.extend(beat::encode(&args.scene, shape, &setup, &footprints, &views)?);
    }
    stages.end("encode", console);

    write_all(&args.output, &files)?;
    stages.end("write", console);
    report::print(&args.output, &record, &stages, console)
}
