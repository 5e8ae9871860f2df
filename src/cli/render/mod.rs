//! `matdb render`.

mod beat;
mod files;
mod record;
mod report;
mod stages;
mod views;

use std::path::PathBuf;

use super::console::Console;
use super::database::Database;
use super::output::write_all;
use super::staging::{effects, materials, model, setup, surfaces};
use crate::error::Error;
use crate::geometry::Raster;
use crate::render::{RenderError, Setup, trace_placed};
use crate::scene::Scene;
use crate::trace::{Bvh, Tracer};
use record::Record;
use stages::Stages;

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
    /// How the rays of the scan are traced; all give the same [default: pinhole where they share their
    /// origin, else bvh]
    #[arg(long, value_name = "NAME")]
    tracer: Option<Rays>,
}

/// Ways to trace the rays of a scan.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Rays {
    /// Rays of one origin as points of a picture; nothing is built
    Pinhole,
    /// A hierarchy of boxes, for any rays
    Bvh,
    /// Every facet for every ray
    Brute,
}

impl Rays {
    fn tracer(self) -> Tracer {
        match self {
            Rays::Pinhole => Tracer::Pinhole,
            Rays::Bvh => Tracer::Bvh,
            Rays::Brute => Tracer::Brute,
        }
    }
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
    let tracer = args.tracer.map_or(Tracer::Automatic, Rays::tracer);
    let setup = Setup { tracer, ..setup(&scene, &bvh, &surfaces, model.as_ref()) };
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

    let regions = &material_of_region;
    let record = Record::new(&scene, &used, model.as_ref(), regions, &views, &images, args.all);
    let mut files = files::encode(args.all, &scene, &views, &images, &record, &material_of_region)?;
    if let Some(shape) = beat {
        files.extend(beat::encode(&args.scene, shape, &setup, &footprints, &views)?);
    }
    stages.end("encode", console);

    write_all(&args.output, &files)?;
    stages.end("write", console);
    report::print(&args.output, &record, &stages, console)
}
