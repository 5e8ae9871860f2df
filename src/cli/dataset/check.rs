//! `matdb dataset check`.

use std::path::PathBuf;

use crate::cli::console::Console;
use crate::dataset::Dataset;
use crate::error::Error;

/// Check that a data set is complete, sound, and leaks nothing between its splits
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb dataset check ds

It reads every file, and removes temporary ones that interrupted work has left.")]
pub(super) struct Args {
    /// Folder of the data set
    folder: PathBuf,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let found = Dataset::open(&args.folder)?.check();
    let mut text = format!("{} of {} shards, {} scans\n", found.done, found.shards, found.scans);
    for problem in &found.problems {
        text += &format!("  {problem}\n");
    }
    if found.complete {
        text += "complete\n";
    }
    console.result(&text, &found)?;
    if found.complete {
        return Ok(());
    }
    Err(Error::usage(
        format!("{} is not complete", args.folder.display()),
        format!("`matdb dataset run {}` makes what is missing or damaged", args.folder.display()),
    ))
}
