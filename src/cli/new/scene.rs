//! `matdb new scene`.

use std::path::PathBuf;

use serde_json::json;

use crate::cli::cloud::{CloudArgs, ColumnArgs, place};
use crate::cli::console::Console;
use crate::error::Error;
use crate::files::folder_of;
use crate::frames::{Global, Point};
use crate::radar::Radar;
use crate::setup::{NewScene, write_new};

/// Write the scene of your own measurement: where the radar stood, its rays, the mesh
#[derive(Debug, clap::Args)]
#[command(mut_arg("cloud", |cloud| cloud.long("cloud").value_name("FILE")))]
#[command(mut_arg("frame", |frame| frame.hide(true)))]
#[command(after_help = "Examples:
  matdb new scene --cloud cloud.csv --mesh target.ply
  matdb new scene --cloud scan.xyz --columns Intensity=power_dbm --mesh target.ply --radar-at 0,1.2,3
  matdb measure cloud.csv --scene scene.toml -o measured       the next step

Writes the scene and, beside it, a CSV of the ray to each point. Where the radar stood is found from the \
ranges of the points, if the cloud has them.")]
pub(super) struct Args {
    #[command(flatten)]
    cloud: CloudArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    /// Mesh of the target: a .ply, .obj or .stl file, or builtin:NAME
    #[arg(long, value_name = "FILE")]
    mesh: String,
    /// Where the radar stood, m, in the frame of the cloud [default: found from the ranges]
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    radar_at: Option<Point<Global>>,
    /// The middle of the radar's field of view, m, where its spot is narrowest [default: the middle of the points]
    #[arg(long, value_name = "X,Y,Z", value_parser = place, allow_hyphen_values = true)]
    look_at: Option<Point<Global>>,
    /// Centre frequency of the radar
    #[arg(long, value_name = "GHZ", default_value_t = 300.0, allow_negative_numbers = true)]
    frequency: f64,
    /// Scene file to write
    #[arg(long, short, value_name = "FILE", default_value = "scene.toml")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let cloud = args.cloud.read(&args.columns, &Radar::default())?;
    let new = NewScene {
        cloud_file: &args.cloud.cloud,
        cloud: &cloud,
        mesh: &args.mesh,
        scene_file: &args.output,
        radar_at: args.radar_at,
        look_at: args.look_at,
        frequency_ghz: args.frequency,
    };
    let made = new.make()?;
    write_new(folder_of(&args.output), &made.files)?;
    cloud.notices.iter().chain(&made.notices).for_each(|notice| console.notice(notice));
    let [x, y, z] = made.radar_at.xyz.to_array();
    let (how, scene) = (&made.how, args.output.display());
    let names: Vec<&str> = made.files.iter().map(|(name, _)| name.as_str()).collect();
    let text = format!(
        "the radar stood at {x:.3}, {y:.3}, {z:.3} m ({how})\nwrote {}: its power, loss and beam are the preset's until you put in yours; then run\n  \
         matdb measure {} --scene {scene}{} -o measured\n",
        names.join(" and "),
        args.cloud.cloud.display(),
        args.cloud.again(&args.columns),
    );
    let value = json!({ "radar_at_m": [x, y, z], "how": how, "files": names });
    console.result(&text, &value)
}
