//! `matdb rm`.

use super::console::Console;
use super::summary::counted;
use crate::adopt::{Removal, remove_materials};
use crate::error::Error;
use crate::setup::Database;

/// Remove materials from the database, with all their revisions
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  matdb rm my-paint")]
pub(super) struct Args {
    /// Names of the materials
    #[arg(required = true)]
    names: Vec<String>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let removals = remove_materials(&args.names, db)?;
    let mut lines = String::new();
    for Removal { slug, revisions } in &removals {
        lines += &format!(
            "removed {slug}, {}, from {}\n",
            counted(*revisions as usize, "revision"),
            db.path().display()
        );
    }
    console.result(&lines, &removals)
}
