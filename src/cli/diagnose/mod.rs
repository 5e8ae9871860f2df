//! `matdb diagnose`.

mod after;
mod cannot_tell;
mod curve;
mod earlier;
mod findings;
mod html;
mod plots;
mod publish;
mod residuals;
mod takers;
#[cfg(test)]
mod testing;
mod text;
mod tried;
mod words;

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use super::cloud::CloudArgs;
use super::console::Console;
use super::database::{Database, USUAL};
use super::effects::chosen;
use super::output::write_all;
use super::staging::{materials, model, notices};
use crate::brdf::Brdf;
use crate::diagnose::{
    Declared, DiagnoseError, Diagnosis, MeshPose, Report, Subject, looks, matched,
};
use crate::effects::{Effect, Receiver, Stage, middle};
use crate::error::Error;
use crate::measure::{Cloud, CloudError};
use crate::radar::{Link, Pattern, Radar};
use crate::scene::file::MeshEntry;
use crate::scene::{Scene, read_text};
use crate::trace::{Bvh, ScanGeometry};
use crate::units::watts_from_dbm;
use cannot_tell::CannotTell;
use earlier::Earlier;
use plots::Peak;
use publish::{Publication, material_file};
use takers::Cast;
use tried::{Choice, NotTried, Reason, Told};

/// Find the physical effect that a scene lacks to explain a measured cloud, or a law a measured curve
#[derive(Debug, clap::Args)]
#[command(mut_arg("cloud", |cloud| cloud.required(false)))]
#[command(mut_args(of_clouds))]
#[command(after_help = "Examples:
  matdb diagnose cloud.ply --scene scene.toml -o diagnosis
  matdb diagnose cloud.ply --scene scene.toml --effects drift,fov-gain -o diagnosis
  matdb diagnose --curve coating.csv -o diagnosis            theta_i_deg,theta_s_deg,brdf_per_sr
  matdb diagnose cloud.ply --scene scene.toml -o diagnosis --add    store what is found
  matdb effects                                              what is tried, and how to tell it

Writes report.html (all of it, for a person), report.json, residuals.csv (one line per chirp) and
pictures (.svg and .png), and after.toml, the scene with what was found. Too few data: report.html and report.json say so, and the status is not 0.")]
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
    /// Store what is found, and what was tried and not found, as new revisions of the materials; with
    /// something found the scene, too, as SCENE-after.toml beside it
    #[arg(long, conflicts_with = "curve")]
    add: bool,
    /// The material that takes refitted law and effects in [default: all of the scene with enough looks]
    #[arg(long, value_name = "NAME", conflicts_with = "curve")]
    material: Option<String>,
    /// Seed of folds and of everything random
    #[arg(long, default_value_t = 0)]
    seed: u64,
    /// Folder to write into; created when it is not there
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

/// Refuses flags that a curve has no use for.
fn of_clouds(flag: clap::Arg) -> clap::Arg {
    match ["unit", "power", "frame"].contains(&flag.get_id().as_str()) {
        true => flag.conflicts_with("curve"),
        false => flag,
    }
}

/// What a report says beside the diagnosis itself.
struct Context {
    /// Name of the scene.
    scene: String,
    scene_path: String,
    cloud_path: String,
    /// Name and material of every region.
    regions: Vec<(String, String)>,
    /// Sentences on materials that are not to be used, or are extrapolated to the radar's frequency.
    beyond: Vec<String>,
    /// Effects that were left out.
    not_tried: Vec<NotTried>,
    /// Where something unknown is strongest.
    places: Vec<Peak>,
    seed: u64,
    /// This command, as a person would type it again.
    command: String,
    /// The program with the database that it works on, as a person would type it.
    program: String,
    /// The scene with what was found in the folder of the report, as a shell takes it.
    after: String,
    /// The one that `--add` puts beside the old scene.
    beside: String,
    /// Folder of the report.
    folder: PathBuf,
    /// Whether what was found was stored.
    is_added: bool,
    /// Materials that were stored, with their revisions.
    added: Vec<String>,
    /// The revisions that were current before these, where they are new.
    replaced: Vec<String>,
    /// Files of materials that were not.
    material_files: Vec<String>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    match (&args.curve, &args.cloud, &args.scene) {
        (Some(curve), None, None) => curve::run(curve, args, console),
        (None, Some(cloud), Some(scene)) => of_cloud(Asked { cloud, scene, args }, db, console),
        _ => Err(Error::Usage {
            problem: "a diagnosis is of a cloud and its scene, or of a curve".to_owned(),
            way_out: "give CLOUD --scene SCENE, or --curve FILE alone".to_owned(),
        }),
    }
}

/// Said of a scene by which every chirp would tell its power exactly.
const NO_SPECKLE: &str = "the scene declares no speckle, so that any scatter of the powers is an effect to be found; a \
                          measured cloud has some: state `looks` under [radar.speckle]";

/// What is asked of a cloud.
#[derive(Clone, Copy)]
struct Asked<'a> {
    cloud: &'a CloudArgs,
    scene: &'a Path,
    args: &'a Args,
}

impl Asked<'_> {
    /// The files that are read.
    fn read(&self) -> [&Path; 2] {
        [&self.cloud.cloud, self.scene]
    }
}

fn of_cloud(asked: Asked, db: &Database, console: &Console) -> Result<(), Error> {
    let Asked { cloud, scene: path, args } = asked;
    let given = read_text(path)?;
    let scene = Scene::load(path)?;
    check_declared(&scene, path)?;
    let effects = chosen(&args.effects)?;
    let (used, material_of_region) = materials(&scene, path, db)?;
    let names: Vec<String> = scene.target.regions.iter().map(|r| r.material.clone()).collect();
    let cast = Cast { used: &used, names: &names, of_region: &material_of_region };
    // A diagnosis takes a while: what hinders its storing is said before.
    let inputs = names.iter().map(|name| material_file(name)).chain([after::AFTER.to_owned()]);
    let named = files_of(&scene, path);
    let read = asked.read().into_iter().chain(named.iter().map(PathBuf::as_path));
    earlier::check(&args.output, &read.collect::<Vec<_>>(), &inputs.collect::<Vec<_>>())?;
    let wanted = cast.wanted(args.material.as_deref())?;
    if args.add {
        after::check_beside(path)?;
        cast.check()?;
    }
    let declared = super::staging::effects(&scene, path, cast.used, cast.of_region)?;
    let at_work = model(&declared, &scene, cast.used, cast.of_region);
    let at_work = at_work.as_ref().map_or(&[][..], |model| &model.effects);
    let (_, Declared { range_sd_m, .. }) = receiver(scene.radar());
    let told = Told { times: scene.chirps.is_timed(), ranges: range_sd_m > 0.0 };
    let choice = Choice::new(&effects, at_work, told);
    let asked_for = |reason: Reason| {
        let names = choice.left_out(reason);
        (!names.is_empty() && !args.effects.is_empty()).then(|| names.join(" and "))
    };
    if let Some(effects) = asked_for(Reason::NoTimes) {
        return refuse(DiagnoseError::Untimed { effects }, asked, console);
    }
    if let Some(effects) = asked_for(Reason::NoRanges) {
        return refuse(DiagnoseError::Unranged { effects }, asked, console);
    }
    if choice.tried.is_empty() {
        return Err(Error::Usage {
            problem: format!("the scene declares {} already", args.effects.join(", ")),
            way_out: "name other effects, or diagnose with the scene that lacks them".to_owned(),
        });
    }
    choice.tell(console);
    let cloud = match cloud.read(scene.radar()) {
        // That nothing was detected is an answer, too.
        Err(Error::Cloud { error: CloudError::Empty, .. }) => {
            return refuse(DiagnoseError::TooFew { detected: 0 }, asked, console);
        }
        read => read?,
    };
    let laws: Vec<Brdf> =
        material_of_region.iter().map(|&m| used[usize::from(m)].scattering.clone()).collect();
    let mut beyond = notices(&used, scene.radar());
    if scene.radar().speckle.is_none() {
        beyond.push(NO_SPECKLE.to_owned());
    }
    cloud.notices.iter().chain(&beyond).for_each(|notice| console.notice(notice));
    let bar = console.spinner("diagnosing");
    let hear = |what: &str| bar.set_message(format!("diagnosing: {what}"));
    let answer = diagnosed(&scene, &cloud, &laws, at_work, args.seed, &choice.tried, &hear);
    bar.finish_and_clear();
    match answer {
        Ok(report) => {
            let not_tried = choice.not_tried;
            let context = Context { beyond, not_tried, ..context(asked, &scene, db) };
            let (given, report) = (given.as_str(), &report);
            Publication { asked, scene: &scene, given, cast, wanted, report }
                .publish(context, db, console)
        }
        Err(error) => refuse(error, asked, console),
    }
}

/// Files that a scene names: meshes and a scan.
fn files_of(scene: &Scene, path: &Path) -> Vec<PathBuf> {
    let meshes = scene.file.mesh.iter().map(|mesh| mesh.file.as_str());
    let scan = match &scene.radar().scan {
        Pattern::Rays(explicit) | Pattern::Angles(explicit) => Some(explicit.file.as_str()),
        _ => None,
    };
    let files = meshes.filter(|file| !file.starts_with("builtin:")).chain(scan);
    files.map(|file| after::folder_of(path).join(file)).collect()
}

/// Refuses what a scene declares and no diagnosis predicts: it would be found as an effect.
fn check_declared(scene: &Scene, path: &Path) -> Result<(), Error> {
    let radar = scene.radar();
    let (what, way_out) = if scene.file.spot.rays > 1 {
        ("several rays in a spot", "set spot.rays = 1 and declare [[radar.effect]] `finite-spot`")
    } else if scene.file.bounce.is_some() {
        ("a second bounce", "replace [bounce] by [[effect]] `multi-bounce`")
    } else if radar.speckle.is_some_and(|speckle| speckle.coherent_ratio > 0.0) {
        (
            "a coherent share of an echo",
            "leave `coherent_ratio` under [radar.speckle] at 0 and state the `looks` that scatter as much",
        )
    } else if radar.receiver.is_some() {
        ("a range receiver", "replace [radar.receiver] by [radar.noise] and [radar.speckle]")
    } else if !scene.file.receiver.is_empty() {
        ("other antennas", "remove [[receiver]]; a diagnosis is of the radar's own echoes")
    } else {
        return Ok(());
    };
    let problem = format!("{}: no diagnosis predicts {what}", path.display());
    Err(Error::Usage { problem, way_out: way_out.to_owned() })
}

/// Effects with their values.
type AtWork<'a> = [(&'a dyn Effect, Vec<f64>)];

fn diagnosed(
    scene: &Scene,
    cloud: &Cloud,
    laws: &[Brdf],
    at_work: &AtWork,
    seed: u64,
    effects: &[&dyn Effect],
    hear: &(dyn Fn(&str) + Sync),
) -> Result<Report, DiagnoseError> {
    let bvh = Bvh::new(&scene.target.mesh);
    let grain_of_region: Vec<_> = scene.target.regions.iter().map(|region| region.grain).collect();
    let radar = scene.radar();
    let mut stage = Stage {
        geometry: ScanGeometry::new(radar, &scene.chirps, &bvh, &scene.target.region_of_facet),
        link: Link::new(radar),
        grain_of_region: &grain_of_region,
        middle: glam::DVec3::ZERO,
    };
    let looks = looks(&stage, radar, &scene.chirps)?;
    stage.middle = middle(&looks);
    let matched = matched(cloud, &scene.chirps, &looks)?;
    let (receiver, declared) = receiver(radar);
    let pose: Vec<MeshPose> = scene.file.mesh.iter().map(pose).collect();
    let subject = Subject {
        stage: &stage,
        laws,
        at_work,
        receiver,
        declared,
        looks: &looks,
        observations: &matched.observations,
        strays: &matched.strays,
        pose: &pose,
    };
    Diagnosis { seed, ..Diagnosis::for_spot(radar.spot_diameter_m) }
        .run_with(&subject, effects, hear)
}

fn pose(mesh: &MeshEntry) -> MeshPose {
    let MeshEntry { name, rotation_deg, translation_m, .. } = mesh;
    let (rotation_deg, translation_m) = (*rotation_deg, *translation_m);
    MeshPose { mesh: name.clone(), rotation_deg, translation_m }
}

fn context(asked: Asked, scene: &Scene, db: &Database) -> Context {
    let Asked { cloud, scene: path, args } = asked;
    let regions = &scene.target.regions;
    Context {
        scene: scene.file.name.clone(),
        scene_path: path.display().to_string(),
        cloud_path: cloud.cloud.display().to_string(),
        regions: regions.iter().map(|r| (r.name.clone(), r.material.clone())).collect(),
        beyond: Vec::new(),
        not_tried: Vec::new(),
        places: Vec::new(),
        seed: args.seed,
        program: program(db),
        command: command(db, std::env::args_os().skip(1).collect()),
        after: typed(&args.output.join(after::AFTER)),
        beside: typed(&path.with_file_name(after::name_beside(path))),
        folder: args.output.clone(),
        is_added: false,
        added: Vec::new(),
        replaced: Vec::new(),
        material_files: Vec::new(),
    }
}

/// The program with its database, where that is not the usual one.
fn program(db: &Database) -> String {
    match db.path() == Path::new(USUAL) {
        true => "matdb".to_owned(),
        false => format!("matdb --db {}", typed(db.path())),
    }
}

/// The program with these arguments, as a shell takes it, and with its database, which a variable may have named.
fn command(db: &Database, arguments: Vec<OsString>) -> String {
    let names_it = |argument: &OsString| argument.to_string_lossy().starts_with("--db");
    let program = match arguments.iter().any(names_it) {
        true => "matdb".to_owned(),
        false => program(db),
    };
    let arguments = arguments.iter().map(|argument| typed(Path::new(argument)));
    std::iter::once(program).chain(arguments).collect::<Vec<_>>().join(" ")
}

/// A path as a shell takes it.
fn typed(path: &Path) -> String {
    let text = path.display().to_string();
    let plain = |c: char| c.is_alphanumeric() || "_-./+,:@%=".contains(c);
    match text.chars().all(plain) {
        true => text,
        false => format!("'{}'", text.replace('\'', "'\\''")),
    }
}

/// Writes that nothing can be said, and why; the error is the way out.
fn refuse(error: DiagnoseError, asked: Asked, console: &Console) -> Result<(), Error> {
    let Asked { cloud, scene, args } = asked;
    let answer = CannotTell::of_cloud(&error);
    let of = format!("{} with {}", cloud.cloud.display(), scene.display());
    let html = html::cannot_tell(&answer, &of);
    let files = [("report.html", html), ("report.json", json(&answer)?)];
    let earlier = Earlier::in_folder(&args.output, &asked.read());
    write_all(&args.output, &files)?;
    earlier.remove_all_but(&files, console);
    if console.json {
        console.result("", &answer)?;
    }
    Err(error.into())
}

/// What `report.json` holds of an answer: all of it, and what was not tried.
#[derive(serde::Serialize)]
struct Record<'a, Report> {
    #[serde(flatten)]
    report: &'a Report,
    not_tried: &'a [NotTried],
}

fn json(value: &impl serde::Serialize) -> Result<Vec<u8>, Error> {
    let mut json = serde_json::to_vec_pretty(value)?;
    json.push(b'\n');
    Ok(json)
}

/// Looks that stand for a radar without speckle: a likelihood needs some spread.
const MOST_LOOKS: f64 = 1e4;

fn receiver(radar: &Radar) -> (Receiver, Declared) {
    let receiver = Receiver::declared(radar);
    let receiver = Receiver { looks: receiver.looks.min(MOST_LOOKS), ..receiver };
    let range_sd_m = radar.noise.map_or(0.0, |noise| noise.range_sd_m);
    let threshold_w = watts_from_dbm(radar.threshold_dbm);
    (receiver, Declared { threshold_w, range_sd_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_can_be_typed_again() {
        assert_eq!(typed(Path::new("out/a-1.ply")), "out/a-1.ply");
        let db = Database::new(Some(Path::new("a.sqlite")));
        let typed_again =
            |arguments: &[&str]| command(&db, arguments.iter().map(Into::into).collect());
        assert_eq!(typed_again(&["a b", "-o"]), "matdb --db a.sqlite 'a b' -o");
        assert_eq!(typed_again(&["--db=a.sqlite", "x"]), "matdb --db=a.sqlite x");
        assert_eq!(typed(Path::new("my cloud.ply")), "'my cloud.ply'");
        assert_eq!(typed(Path::new("it's;rm")), "'it'\\''s;rm'");
    }
}
