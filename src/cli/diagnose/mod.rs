//! `matdb diagnose`.

mod cannot_tell;
mod html;
mod plots;
mod residuals;
#[cfg(test)]
mod testing;
mod text;
mod words;

use std::path::{Path, PathBuf};

use super::cloud::CloudArgs;
use super::console::Console;
use super::database::Database;
use super::effects::chosen;
use super::output::write_all;
use super::staging::materials;
use crate::brdf::Brdf;
use crate::diagnose::{Declared, DiagnoseError, Diagnosis, Report, Subject, looks, matched};
use crate::effects::{Effect, Receiver, Stage, middle};
use crate::error::Error;
use crate::measure::Cloud;
use crate::radar::{Link, Radar};
use crate::scene::Scene;
use crate::trace::Bvh;
use crate::units::watts_from_dbm;
use cannot_tell::CannotTell;

/// Find the physical effect that a scene lacks to explain a measured cloud
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb diagnose cloud.ply --scene scene.toml -o diagnosis
  matdb diagnose cloud.ply --scene scene.toml --effects drift,fov-gain -o diagnosis
  matdb effects                                              what is tried, and how to tell it

Writes report.html (all of it, for a person), report.json, residuals.csv (one line per chirp) and
pictures (.svg and .png). Too few data: report.html and report.json say so, and the status is not 0.")]
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

/// What a report says beside the diagnosis itself.
struct Context {
    /// Name of the scene.
    scene: String,
    scene_path: String,
    cloud_path: String,
    /// Name and material of every region.
    regions: Vec<(String, String)>,
    /// Detections that were set aside.
    false_alarms: usize,
    seed: u64,
    /// This command, as a person would type it again.
    command: String,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let scene = Scene::load(&args.scene)?;
    let effects = chosen(&args.effects)?;
    let (used, material_of_region) = materials(&scene, &args.scene, db)?;
    let cloud = args.cloud.read(scene.radar())?;
    let laws: Vec<Brdf> =
        material_of_region.iter().map(|&m| used[usize::from(m)].scattering.clone()).collect();
    cloud.notices.iter().for_each(|notice| console.notice(notice));
    let bar = console.spinner("diagnosing");
    let answer = diagnosed(&scene, &cloud, &laws, args.seed, &effects);
    bar.finish_and_clear();
    match answer {
        Ok((report, false_alarms)) => {
            let context = context(args, &scene, false_alarms);
            publish(&report, &context, scene.radar().spot_diameter_m, &args.output, console)
        }
        Err(error) => refuse(error, args, console),
    }
}

/// The diagnosis, and how many detections were set aside.
fn diagnosed(
    scene: &Scene,
    cloud: &Cloud,
    laws: &[Brdf],
    seed: u64,
    effects: &[&dyn Effect],
) -> Result<(Report, usize), DiagnoseError> {
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
    let matched = matched(cloud, &scene.chirps, &looks, GATE_M)?;
    let (receiver, declared) = receiver(radar);
    let subject = Subject {
        stage: &stage,
        laws,
        receiver,
        declared,
        looks: &looks,
        observations: &matched.observations,
        false_alarms: matched.false_alarms,
    };
    let report = Diagnosis { seed, ..Diagnosis::default() }.run(&subject, effects)?;
    Ok((report, matched.false_alarms))
}

fn context(args: &Args, scene: &Scene, false_alarms: usize) -> Context {
    let regions = &scene.target.regions;
    let [cloud, path, output] = [&args.cloud.cloud, &args.scene, &args.output].map(|p| typed(p));
    Context {
        scene: scene.file.name.clone(),
        scene_path: args.scene.display().to_string(),
        cloud_path: args.cloud.cloud.display().to_string(),
        regions: regions.iter().map(|r| (r.name.clone(), r.material.clone())).collect(),
        false_alarms,
        seed: args.seed,
        command: format!("matdb diagnose {cloud} --scene {path} -o {output}"),
    }
}

/// A path as a shell takes it.
fn typed(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "_-./+,:@%".contains(c);
    match text.chars().all(plain) {
        true => text,
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

/// Writes everything and says what matters.
fn publish(
    report: &Report,
    context: &Context,
    spot_m: f64,
    folder: &Path,
    console: &Console,
) -> Result<(), Error> {
    let (pictures, notices) = plots::pictures(report, spot_m);
    let mut files = vec![
        ("report.html".to_owned(), html::report(report, context, &pictures)?),
        ("report.json".to_owned(), json(report)?),
        ("residuals.csv".to_owned(), residuals::csv(&report.rows)),
    ];
    for picture in &pictures {
        files.extend(picture.files()?);
    }
    write_all(folder, &files)?;
    notices.iter().for_each(|notice| console.notice(notice));
    let names: Vec<String> = files.into_iter().map(|(name, _)| name).collect();
    console.result(&text::text(report, &names, folder), report)
}

/// Writes that nothing can be said, and why; the error is the way out.
fn refuse(error: DiagnoseError, args: &Args, console: &Console) -> Result<(), Error> {
    let answer = CannotTell::new(&error);
    let [cloud, scene] = [&args.cloud.cloud, &args.scene].map(|path| path.display().to_string());
    let html = html::cannot_tell(&answer, &scene, &cloud);
    write_all(&args.output, &[("report.html", html), ("report.json", json(&answer)?)])?;
    if console.json {
        console.result("", &answer)?;
    }
    Err(error.into())
}

fn json(value: &impl serde::Serialize) -> Result<Vec<u8>, Error> {
    let mut json = serde_json::to_vec_pretty(value)?;
    json.push(b'\n');
    Ok(json)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_can_be_typed_again() {
        assert_eq!(typed(Path::new("out/a-1.ply")), "out/a-1.ply");
        assert_eq!(typed(Path::new("my cloud.ply")), "'my cloud.ply'");
        assert_eq!(typed(Path::new("it's;rm")), "'it'\\''s;rm'");
    }
}
