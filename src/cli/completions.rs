//! `matdb completions`.

use clap_complete::Shell;

use super::console::write_out;
use crate::error::Error;

/// Print a completion script for a shell
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  matdb completions bash > ~/.local/share/bash-completion/completions/matdb")]
pub(super) struct Args {
    /// The shell
    shell: Shell,
}

/// `command` is the whole command line.
pub(super) fn run(args: &Args, mut command: clap::Command) -> Result<(), Error> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, "matdb", &mut script);
    write_out(&String::from_utf8_lossy(&script))
}
