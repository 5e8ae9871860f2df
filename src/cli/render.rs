//! `matdb render`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Map, Value, json};

use super::console::Console;
use super::materials::find;
use super::output::write_all;
use super::record::{Record, Used};
use super::summary::{grouped, table};
use crate::brdf::Scattering;
use crate::error::Error;
use crate::formats::exr::{self, Attribute};
use crate::formats::figure::Figure;
use crate::formats::ply;
use crate::geometry::Raster;
use crate::render::{Echo, Scan, cloud_table, power_image, shade, trace};
use crate::scene::Scene;
use crate::store::Store;

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

/// Wall-clock time of each stage so far.
struct Stages {
    since: Instant,
    done: Vec<(&'static str, f64)>,
}

impl Stages {
    fn end(&mut self, stage: &'static str, console: &Console) {
        let ms = self.since.elapsed().as_secs_f64() * 1e3;
        console.detail(&format!("{stage:>8} {ms:8.1} ms"));
        self.done.push((stage, ms));
        self.since = Instant::now();
    }
}

pub(super) fn run(args: &Args, db: &Path, console: &Console) -> Result<(), Error> {
    let start = Instant::now();
    let mut stages = Stages { since: start, done: Vec::new() };
    let scene = Scene::load(&args.scene)?;
    let (used, material_of_region) = materials(&scene, &args.scene, db)?;
    stages.end("load", console);

    let bar = console.progress("tracing", scene.radar.scan.chirps());
    let hits = trace(&scene.radar, &scene.target.mesh, &|chirps| bar.inc(chirps as u64))?;
    bar.finish_and_clear();
    stages.end("trace", console);

    let surfaces: Vec<&dyn Scattering> = material_of_region
        .iter()
        .map(|&number| &used[usize::from(number)].scattering as &dyn Scattering)
        .collect();
    let scan = shade(&scene.radar, &hits, &scene.target.region_of_facet, &surfaces);
    stages.end("power", console);

    let image = power_image(&scan, &scene.radar, &material_of_region, scene.pixel_m);
    stages.end("image", console);

    let record = Record::new(&scene, &used, &material_of_region, &scan, &image);
    let files = encode(args, &scene, &scan, &image, &record, &material_of_region)?;
    stages.end("encode", console);

    write_all(&args.output, &files)?;
    stages.end("write", console);

    record.notices().iter().for_each(|notice| console.notice(notice));
    report(args, &record, &stages, start, console)
}

/// The scene's materials, each once, and for every region the number of its material.
fn materials(scene: &Scene, path: &Path, db: &Path) -> Result<(Vec<Used>, Vec<u16>), Error> {
    let store = Store::open_existing(db)?;
    let mut names: Vec<&str> = Vec::new();
    let mut used = Vec::new();
    let mut of_region = Vec::new();
    for region in &scene.target.regions {
        let known = names.iter().position(|name| *name == region.material);
        let number = known.map_or_else(
            || {
                let asked_by = format!("{}: region `{}`: ", path.display(), region.name);
                let found = find(store.as_ref(), &region.material, &asked_by)?;
                let scattering = found.material.scattering()?;
                used.push(Used { found, scattering });
                names.push(&region.material);
                Ok::<_, Error>(names.len() - 1)
            },
            Ok,
        )?;
        of_region.push(number as u16);
    }
    Ok((used, of_region))
}

fn encode(
    args: &Args,
    scene: &Scene,
    scan: &Scan,
    image: &Raster,
    record: &Record,
    material_of_region: &[u16],
) -> Result<Vec<(&'static str, Vec<u8>)>, Error> {
    let regions: Vec<&str> = scene.target.regions.iter().map(|r| r.name.as_str()).collect();
    let materials = record.material_names();
    let echoes: Vec<&Echo> =
        if args.all { scan.echoes.iter().collect() } else { scan.detections().collect() };
    let cloud = cloud_table(&echoes, material_of_region, &regions, &materials);
    let mut json = serde_json::to_vec_pretty(record).unwrap_or_default();
    json.push(b'\n');
    Ok(vec![
        ("power.exr", exr::write(image, &exr_attributes(&materials))?),
        ("power.png", power_figure(scene, scan, image)?),
        ("cloud.ply", ply::write_table(&cloud)?),
        ("scan.json", json),
    ])
}

/// Names for the numbers of the `material` channel.
fn exr_attributes(materials: &[&str]) -> Vec<(String, Attribute)> {
    let named = |(number, name): (usize, &&str)| {
        (format!("material{number}"), Attribute::Text((*name).to_owned()))
    };
    materials.iter().enumerate().map(named).collect()
}

fn power_figure(scene: &Scene, scan: &Scan, image: &Raster) -> Result<Vec<u8>, Error> {
    let radar = &scene.radar;
    let subtitle = format!(
        "{}, {} of {} chirps above {} dBm",
        radar.preset,
        grouped(scan.detections().count()),
        grouped(scan.chirps),
        radar.threshold_dbm
    );
    let figure = Figure {
        raster: image,
        channel: "power_dbm",
        title: &scene.name,
        subtitle: &subtitle,
        colour_label: "received power, dBm",
        range: None,
        x_label: "x_t, m",
        y_label: "y_t, m",
    };
    Ok(figure.png()?)
}

fn report(
    args: &Args,
    record: &Record,
    stages: &Stages,
    start: Instant,
    console: &Console,
) -> Result<(), Error> {
    let counts = record.counts();
    let folder = args.output.display();
    let materials = record.material_names();
    let mut text = table(
        &["region", "material", "facets", "hits", "detections", "strongest dBm"],
        record.regions().iter().map(|region| {
            [
                region.name.to_owned(),
                materials[usize::from(region.material)].to_owned(),
                grouped(region.facets),
                grouped(region.hits),
                grouped(region.detections),
                region.strongest_dbm.map_or("–".to_owned(), |p| format!("{p:.1}")),
            ]
        }),
    );
    text += &format!(
        "{} chirps, {} hits, {} detections, {} below the threshold\n",
        grouped(counts.chirps),
        grouped(counts.hits),
        grouped(counts.detections),
        grouped(counts.below_threshold),
    );
    let seconds = start.elapsed().as_secs_f64();
    text += &format!(
        "wrote power.exr, power.png, cloud.ply and scan.json to {folder} in {seconds:.2} s\n"
    );
    let timings: Map<String, Value> =
        stages.done.iter().map(|(stage, ms)| ((*stage).to_owned(), json!(ms))).collect();
    let value = json!({
        "output": args.output,
        "counts": counts,
        "power_dbm": record.power_dbm(),
        "regions": record.regions(),
        "notices": record.notices(),
        "timings_ms": timings,
    });
    console.result(&text, &value)
}
