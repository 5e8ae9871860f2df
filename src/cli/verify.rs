//! `matdb verify`.

use std::path::PathBuf;

use super::console::Console;
use super::summary::counted;
use crate::adopt::verify;
use crate::catalogue::Verification;
use crate::error::Error;

/// Check a published catalogue, and fit again what it holds
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb verify site                            a published folder
  matdb verify site/catalogue.sqlite           a database by itself

Asks nothing outside the folder. Exits with status 1 if anything is wrong.")]
pub(super) struct Args {
    /// A published folder, or a database
    bundle: PathBuf,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let verified = verify(&args.bundle)?;
    let Verification { files, checked, notes, problems } = &verified;
    notes.iter().for_each(|note| console.notice(note));
    let mut text: String = problems.iter().map(|problem| format!("{problem}\n")).collect();
    if problems.is_empty() {
        text += &format!(
            "{} is sound: {}, {} in {}, {} made again\n",
            args.bundle.display(),
            counted(*files, "file"),
            counted(checked.materials, "material"),
            counted(checked.revisions, "revision"),
            counted(checked.fits, "fit")
        );
    }
    console.result(&text, &verified)?;
    match problems.len() {
        0 => Ok(()),
        number => Err(Error::usage(
            format!("{} has {}", args.bundle.display(), counted(number, "problem")),
            "get a sound copy, or publish it again",
        )),
    }
}
