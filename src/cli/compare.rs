//! `matdb compare`.

use std::path::PathBuf;

use super::cloud::{CloudArgs, ColumnArgs, pose};
use super::console::Console;
use super::summary::grouped;
use crate::error::Error;
use crate::files::write_all;
use crate::measure::compare::{Agreement, Line};
use crate::report::Comparison;
use crate::setup::{Database, ReadyScene};

/// Compare a measured cloud with the rendered scene
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb compare cloud.ply --scene scenes/mannequin.toml -o compared
  matdb compare cloud.ply --scene scene.toml --pose measured/pose.json -o compared
  matdb compare cloud.ply --scene scene.toml --line y=1.1,width=0.02 -o compared
  matdb compare cloud.ply --scene scene.toml --fit mixture-mse -o by-mse    another fit

Writes both images side by side, a line scan, and the error.")]
pub(super) struct Args {
    #[command(flatten)]
    cloud: CloudArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    /// The scene that was measured, with the materials to judge
    #[arg(long, value_name = "SCENE")]
    scene: PathBuf,
    /// Where the target stood: the pose.json of `matdb measure`, or X,Y,Z[,RX,RY,RZ]
    #[arg(long, value_name = "POSE", allow_hyphen_values = true)]
    pose: Option<String>,
    /// Render this fit of the scene's materials instead of what they render
    #[arg(long, value_name = "NAME")]
    fit: Option<String>,
    /// Stripe of the line scan in the global frame
    #[arg(long, value_name = "y=M,width=M", default_value = "y=1.1,width=0.02")]
    line: String,
    /// Folder to write; created if needed
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let line = line(&args.line)?;
    let pose = pose(args.pose.as_deref())?;
    let mut ready = ReadyScene::open_mean(&args.scene, pose, db.read()?.as_ref())?;
    if let Some(name) = &args.fit {
        ready.choose_fit(name)?;
    }
    let unstated = ready.check_footprints()?;
    let cloud = args.cloud.read_absolute(&args.cloud.cloud, &args.columns, ready.scene.radar())?;
    let comparison = Comparison::new(&ready, &cloud)?;
    let notices = [cloud.notices, ready.notices(), Vec::from_iter(unstated)].concat();
    let record = comparison.record(&args.cloud.cloud, &args.scene, &notices);
    write_all(&args.output, &comparison.files(line, &record)?)?;
    notices.iter().for_each(|notice| console.notice(notice));
    console.result(&text(args, &comparison.agreement), &record)
}

/// The stripe that `y=M,width=M` stands for; each once, in any order.
fn line(text: &str) -> Result<Line, Error> {
    let mut line = Line { y_m: f64::NAN, width_m: f64::NAN };
    let mut is_line = true;
    for part in text.split(',') {
        let (key, value) = part.split_once('=').unwrap_or((part, ""));
        let value: f64 = value.trim().parse().unwrap_or(f64::NAN);
        let (slot, is_possible) = match key.trim() {
            "y" => (&mut line.y_m, value.is_finite()),
            _ => (&mut line.width_m, key.trim() == "width" && value.is_finite() && value > 0.0),
        };
        is_line &= is_possible && slot.is_nan();
        *slot = value;
    }
    if !is_line || line.y_m.is_nan() {
        return Err(Error::usage(
            format!("--line {text} is not a line"),
            "write it as --line y=1.1,width=0.02",
        ));
    }
    if line.width_m.is_nan() {
        line.width_m = 0.02;
    }
    Ok(line)
}

fn text(args: &Args, agreement: &Agreement) -> String {
    format!(
        "simulated less measured over {} pixels: mean {:.2} dB, rms {:.2} dB, median size {:.2} dB\n\
         {} pixels are in the measurement alone, {} in the simulation alone\n\
         wrote images.png, line.png, line.svg and error.json to {}\n",
        grouped(agreement.both),
        agreement.bias_db,
        agreement.rmse_db,
        agreement.median_size_db,
        grouped(agreement.only_measured),
        grouped(agreement.only_simulated),
        args.output.display()
    )
}
