//! `matdb dataset plan`.

use super::source::Source;
use crate::cli::console::Console;
use crate::cli::summary::counted;
use crate::dataset::{Dataset, Plan};
use crate::error::Error;
use crate::formats::words::grouped;
use crate::setup::Database;

/// Plan a data set: its folder then has everything that it is made of
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb dataset plan concealed.toml -o ds

A few scans are made to see whether they can be, how long they take and how large they are.")]
pub(super) struct Args {
    #[command(flatten)]
    source: Source,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let dataset = planned(&args.source, db, console)?;
    console.result(&words(&dataset), dataset.plan())
}

/// Plans, or opens the plan that is there.
pub(super) fn planned(source: &Source, db: &Database, console: &Console) -> Result<Dataset, Error> {
    let activity = console.activity("plan");
    let dataset = Dataset::make_plan(&source.spec, &source.output, db.read()?.as_ref());
    activity.end();
    dataset
}

/// What a plan will take.
pub(super) fn words(dataset: &Dataset) -> String {
    let Plan { scans, shards, seconds_per_scan, bytes_per_scan, split, .. } = dataset.plan();
    let splits = split.iter().map(|one| format!("{} {}", grouped(one.scans as usize), one.name));
    let splits: Vec<String> = splits.collect();
    let cores = rayon::current_num_threads();
    format!(
        "{} ({}) in {}, {}: about {} on {} and {} MB\n",
        counted(*scans as usize, "scan"),
        splits.join(", "),
        counted(*shards as usize, "shard"),
        dataset.folder().display(),
        duration(seconds_per_scan * f64::from(*scans) / cores as f64),
        counted(cores, "core"),
        grouped((u64::from(*scans) * bytes_per_scan).div_ceil(1_000_000) as usize)
    )
}

/// A time as a person says it.
pub(super) fn duration(seconds: f64) -> String {
    match seconds {
        _ if seconds < 99.5 => format!("{} s", seconds.ceil().max(1.0)),
        _ if seconds < 99.5 * 60.0 => format!("{:.0} min", seconds / 60.0),
        _ => format!("{:.1} h", seconds / 3600.0),
    }
}
