//! `matdb man`.

use std::path::PathBuf;

use super::console::Console;
use crate::error::Error;
use crate::files::{FilesError, write_all};

/// Write man pages: one of matdb, and one of each command
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  matdb man -o ~/.local/share/man/man1    then: man matdb-render")]
pub(super) struct Args {
    /// Folder to write; created if needed
    #[arg(long, short, value_name = "DIR")]
    output: PathBuf,
}

/// `command` is the whole command line.
pub(super) fn run(args: &Args, mut command: clap::Command, console: &Console) -> Result<(), Error> {
    command.build();
    let mut pages = vec![page(&command, args)?];
    for one in command.get_subcommands().filter(|one| one.get_name() != "help") {
        pages.push(page(one, args)?);
    }
    write_all(&args.output, &pages)?;
    let names: Vec<&String> = pages.iter().map(|(name, _)| name).collect();
    let text = format!("wrote {} pages to {}\n", pages.len(), args.output.display());
    console.result(&text, &serde_json::json!({ "files": names }))
}

/// Name and bytes of the page of a command.
fn page(command: &clap::Command, args: &Args) -> Result<(String, Vec<u8>), Error> {
    let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
    let mut bytes = Vec::new();
    let page = clap_mangen::Man::new(command.clone());
    page.render(&mut bytes)
        .map_err(|reason| FilesError::unwritable("write", &args.output, reason))?;
    Ok((format!("{name}.1"), bytes))
}
