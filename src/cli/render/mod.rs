//! `matdb render`.

mod files;
mod record;
mod report;
mod stages;

use std::path::{Path, PathBuf};

use super::console::Console;
use super::database::Database;
use super::materials::find;
use super::output::write_all;
use crate::brdf::Scattering;
use crate::error::Error;
use crate::render::{power_image, shade, trace};
use crate::scene::Scene;
use record::{Record, Used};
use stages::Stages;

/// Render a scene: power.exr, power.png, cloud.ply and scan.json
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb render scenes/mannequin.toml -o out
  matdb render scenes/mannequin.toml -o out --all --json")]
pub(super) struct Args {
    /// The scene file
    scene: PathBuf,
    /// Folder to write into; created when it is not there
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
    /// Put every hit into cloud.ply, not only those above the threshold
    #[arg(long)]
    all: bool,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let mut stages = Stages::start();
    let scene = Scene::load(&args.scene)?;
    let (used, material_of_region) = materials(&scene, &args.scene, db)?;
    stages.end("load", console);

    let (radar, Scene { chirps, target, .. }) = (scene.radar(), &scene);
    let bar = console.progress("tracing", chirps.rays.len());
    let rays = scene.file.spot.rays;
    let hits = trace(radar, chirps, &target.mesh, rays, &|chirps| bar.inc(chirps as u64));
    bar.finish_and_clear();
    let hits = hits.map_err(|error| Error::Render { scene: args.scene.clone(), error })?;
    stages.end("trace", console);

    let surface = |number: &u16| &used[usize::from(*number)].scattering as &dyn Scattering;
    let surfaces: Vec<&dyn Scattering> = material_of_region.iter().map(surface).collect();
    let scan = shade(radar, chirps, &hits, &target.region_of_facet, &surfaces);
    stages.end("power", console);

    let (field, spot_m) = (chirps.field(&radar.frames()), radar.spot_diameter_m);
    let image = power_image(&scan, field, spot_m, &material_of_region, scene.pixel_m());
    stages.end("image", console);

    let record = Record::new(&scene, &used, &material_of_region, &scan, &image, args.all);
    let files = files::encode(args.all, &scene, &scan, &image, &record, &material_of_region)?;
    stages.end("encode", console);

    write_all(&args.output, &files)?;
    stages.end("write", console);
    report::print(&args.output, &record, &stages, console)
}

/// The scene's materials, each once, and for every region the number of its material.
fn materials(scene: &Scene, path: &Path, db: &Database) -> Result<(Vec<Used>, Vec<u16>), Error> {
    let store = db.read()?;
    let mut names: Vec<&str> = Vec::new();
    let mut used = Vec::new();
    let mut of_region = Vec::new();
    for region in &scene.target.regions {
        let known = names.iter().position(|name| *name == region.material);
        if known.is_none() {
            let asked_by = format!("{}: region `{}`: ", path.display(), region.name);
            let found = find(store.as_ref(), &region.material, &asked_by)?;
            let scattering = found.material.scattering()?;
            used.push(Used { found, scattering });
            names.push(&region.material);
        }
        of_region.push(known.unwrap_or(names.len() - 1) as u16);
    }
    Ok((used, of_region))
}
