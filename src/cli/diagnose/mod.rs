//! `matdb diagnose`.

mod cannot_tell;
mod curve;
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

/// Find the physical effect that a scene lacks to explain a measured cloud, or a law a measured curve
#[derive(Debug, clap::Args)]
#[command(mut_arg("cloud", |cloud| cloud.required(false)))]
#[command(after_help = "Examples:
  matdb diagnose cloud.ply --scene scene.toml -o diagnosis
  matdb diagnose cloud.ply --scene scene.toml --effects drift,fov-gain -o diagnosis
  matdb diagnose --curve coating.csv -o diagnosis            theta_i_deg,theta_s_deg,brdf_per_sr
  matdb effects                                              what is tried, and how to tell it

Writes report.html (all of it, for a person), report.json, residuals.csv (one line per chirp) and
pictures (.svg and .png). Too few data: report.html and report.json say so, and the status is not 0.")]
pub(super) struct Args {
    #[command(flatten)]
    cloud: Option<CloudArgs>,
    /// The scene that was measured: its mesh, materials, radar and scan
    #[arg(long, value_name = "SCENE")]
    scene: Option<PathBuf>,
    /// Instead of a cloud: a backscatter curve (.csv of `matdb measure`), a table in the plane of
    /// incidence (.csv: theta_i_deg,theta_s_deg,brdf_per_sr) or a .bsdf
    #[arg(long, value_name = "FILE")]
    curve: Option<PathBuf>,
    /// Law that a curve is held against [default: one GGX lobe over Lambert]
    #[arg(long, value_name = "MODEL", requires = "curve")]
    model: Option<String>,
    /// Noise of a curve's levels, dB [default: from repeats, the file, or neighbouring angles]
    #[arg(long, value_name = "DB", requires = "curve")]
    noise_db: Option<f64>,
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
    match (&args.curve, &args.cloud, &args.scene) {
        (Some(curve), None, None) => curve::run(curve, args, console),
        (None, Some(cloud), Some(scene)) => of_cloud(cloud, scene, args, db, console),
        _ => Err(Error::Usage {
            problem: "a diagnosis is of a cloud and its scene, or of a curve".to_owned(),
            way_out: "give CLOUD --scene SCENE, or --curve FILE alone".to_owned(),
        }),
    }
}

fn of_cloud(
    cloud_args: &CloudArgs,
    scene_path: &Path,
    args: &Args,
    db: &Database,
    console: &Console,
) -> Result<(), Error> {
    let scene = Scene::load(scene_path)?;
    let effects = chosen(&args.effects)?;
    let (used, material_of_region) = materials(&scene, scene_path, db)?;
    let cloud = cloud_args.read(scene.radar())?;
    let laws: Vec<Brdf> =
        material_of_region.iter().map(|&m| used[usize::from(m)].scattering.clone()).collect();
    cloud.notices.iter().for_each(|notice| console.notice(notice));
    let bar = console.spinner("diagnosing");
    let answer = diagnosed(&scene, &cloud, &laws, args.seed, &effects);
    bar.finish_and_clear();
    match answer {
        Ok((report, false_alarms)) => {
            let context = context([&cloud_args.cloud, scene_path], args, &scene, false_alarms);
            publish(&report, &context, scene.radar().spot_diameter_m, &args.output, console)
        }
        Err(error) => refuse(error, [&cloud_args.cloud, scene_path], args, console),
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

fn context(
    [cloud_path, scene_path]: [&Path; 2],
    args: &Args,
    scene: &Scene,
    false_alarms: usize,
) -> Context {
    let regions = &scene.target.regions;
    let [cloud, path, output] = [cloud_path, scene_path, &args.output].map(typed);
    Context {
        scene: scene.file.name.clone(),
        scene_path: scene_path.display().to_string(),
        cloud_path: cloud_path.display().to_string(),
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
fn refuse(
    error: DiagnoseError,
    paths: [&Path; 2],
    args: &Args,
    console: &Console,
) -> Result<(), Error> {
    let answer = CannotTell::new(&error);
    let [cloud, scene] = paths.map(|path| path.display().to_string());
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
