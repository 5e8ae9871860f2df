//! `matdb calibrate`.

use std::path::PathBuf;

use super::cloud::{CloudArgs, ColumnArgs};
use super::console::Console;
use crate::error::Error;
use crate::measure::Calibration;
use crate::report::CalibrationReport;
use crate::setup::{Database, ReadyScene};

/// Find a radar's loss and beam from the cloud of a plate, a sphere or a corner of metal
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb calibrate cloud.ply --scene builtin:calibration-plate
  matdb calibrate cloud.csv --scene my-sphere.toml --json

Built-in scenes: builtin:calibration-plate, builtin:calibration-sphere, builtin:calibration-trihedral.")]
pub(super) struct Args {
    #[command(flatten)]
    cloud: CloudArgs,
    #[command(flatten)]
    columns: ColumnArgs,
    /// The scene that was measured: its radar, its scan and a single target
    #[arg(long, value_name = "SCENE")]
    scene: PathBuf,
    /// Use points within this of the peak, dB
    #[arg(long, value_name = "DB", allow_negative_numbers = true, default_value_t = Calibration::default().within_db)]
    within: f64,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    if !(6.0..=60.0).contains(&args.within) {
        return Err(Error::usage(
            format!("--within {} is not a span", args.within),
            "give dB from 6 to 60",
        ));
    }
    let ready = ReadyScene::open(&args.scene, db.read()?.as_ref())?;
    let cloud = args.cloud.read_absolute(&args.cloud.cloud, &args.columns, ready.scene.radar())?;
    let calibration = Calibration { within_db: args.within };
    let report = CalibrationReport::new(&ready, &cloud, &args.cloud.cloud, calibration)?;
    let notices = [cloud.notices, ready.notices(), report.notices()].concat();
    notices.iter().for_each(|notice| console.notice(notice));
    console.result(&report.text(), &report.record(&args.cloud.cloud, &args.scene, &notices))
}
