//! `matdb render`.

mod beat;
mod files;
mod record;
mod report;
mod stages;
mod tracer;
mod views;

use std::path::PathBuf;

use super::console::Console;
use super::database::Database;
use super::output::write_all;
use super::staging::{effects, materials, model, setup, surfaces};
use crate::error::Error;
use crate::formats::exr::Packing;
use crate::geometry::Raster;
use crate::render::{RenderError, trace_placed};
use crate::scene::Scene;
use crate::trace::{Bvh, GpuError};
use record::Record;
use stages::Stages;
use tracer::{Rays, gpu, tracer};

/// Render a scene: power.exr, power.png, cloud.ply and scan.json
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb render scenes/mannequin.toml -o out
  matdb render scenes/mannequin.toml -o out --all --json
  matdb render scenes/showcase.toml -o out      spot, speckle, noise, two receivers, second bounce")]
pub(super) struct Args {
    /// The scene file
    scene: PathBuf,
    /// Folder to write into; created when it is not there
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Put every hit into cloud.ply, not only those above the threshold
    #[arg(long)]
    all: bool,
    /// Write the sampled beat signals, too: beat.npy, chirps x samples; needs [radar.receiver]
    #[arg(long)]
    beat: bool,
    /// Do not compress power.exr, for programs that cannot unpack it
    #[arg(long)]
    uncompressed: bool,
    /// How the rays of the scan are traced; all find the same, `brute` to its rounding [default: pinhole
    /// where they share their origin, else bvh]
    #[arg(long, value_name = "NAME")]
    tracer: Option<Rays>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let mut stages = Stages::start();
    let scene = Scene::load(&args.scene)?;
    let (used, material_of_region) = materials(&scene, &args.scene, db)?;
    let surfaces = surfaces(&scene, &used, &material_of_region);
    let effects = effects(&scene, &args.scene, &used, &material_of_region)?;
    let model = model(&effects, &scene, &used, &material_of_region);
    let at = |(antenna, error): (String, RenderError)| Error::Render {
        scene: args.scene.clone(),
        antenna,
        error: Box::new(error),
    };
    let beat = args.beat.then(|| beat::Shape::new(&scene)).transpose()?;
    stages.end("load", console);

    let bvh = Bvh::new(&scene.target.mesh);
    let failed = |error: GpuError| at((String::new(), RenderError::Tracer(error.into())));
    let gpu = gpu(args.tracer, console).map_err(failed)?;
    let held = gpu.as_ref().map(|gpu| gpu.hold(&bvh)).transpose().map_err(failed)?;
    let tracer = tracer(args.tracer, held.as_ref());
    let mut setup = setup(&scene, &bvh, &surfaces, model.as_ref());
    setup.geometry.tracer = tracer;
    let bar = console.progress("tracing", scene.chirps.rays.len());
    let rays = scene.file.spot.rays;
    let footprints = trace_placed(&setup, rays, &|chirps| bar.inc(chirps as u64));
    bar.finish_and_clear();
    let footprints = footprints.map_err(|error| at((String::new(), error)))?;
    stages.end("trace", console);

    let views = views::all(&setup, &footprints, &scene, console).map_err(at)?;
    stages.end("power", console);
    let images: Vec<Raster> =
        views.iter().map(|view| view.image(&scene, &material_of_region)).collect();
    stages.end("image", console);

    let packing = if args.uncompressed { Packing::Uncompressed } else { Packing::Zip16 };
    let regions = &material_of_region;
    let record = Record::new(&scene, &used, model.as_ref(), regions, &views, &images, args.all);
    let mut files =
        files::encode((args.all, packing), &scene, &views, &images, &record, &material_of_region)?;
    if let Some(shape) = beat {
        files.extend(beat::encode(&args.scene, shape, &setup, &footprints, &views)?);
    }
    stages.end("encode", console);

    write_all(&args.output, &files)?;
    stages.end("write", console);
    report::print(&args.output, &record, &stages, console)
}
