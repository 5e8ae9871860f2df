//! `matdb dataset publish`.

use std::path::PathBuf;

use crate::cli::console::Console;
use crate::cli::summary::counted;
use crate::dataset::Dataset;
use crate::error::Error;

/// Describe a complete data set for others: croissant.json, README.md and boxes for COCO and Pascal VOC
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb dataset publish ds")]
pub(super) struct Args {
    /// Folder of the data set
    folder: PathBuf,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let published = Dataset::open(&args.folder)?.publish()?;
    published.notices.iter().for_each(|notice| console.notice(notice));
    let text = format!(
        "described {} in {} of {}\n",
        counted(published.scans as usize, "scan"),
        counted(published.files.len(), "file"),
        args.folder.display()
    );
    console.result(&text, &published)
}
