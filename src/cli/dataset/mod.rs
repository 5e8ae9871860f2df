//! `matdb dataset`.

mod check;
mod plan;
mod publish;
mod run;
mod source;

use clap::Subcommand;

use super::console::Console;
use crate::error::Error;
use crate::setup::Database;

/// Labelled data sets: many scans of a scene in which something varies
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb dataset run concealed.toml -o ds      plan it, make what is missing, and say when it will be done
  matdb dataset plan concealed.toml -o ds     only plan it: files, time and bytes that it will take
  matdb dataset shard ds 3/64                 the fourth of 64 parts, on a machine of its own
  matdb dataset check ds                      whether all of it is there and sound
  matdb dataset publish ds                    describe it for others")]
pub(super) struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Plan(plan::Args),
    Run(run::RunArgs),
    Shard(run::ShardArgs),
    Check(check::Args),
    Publish(publish::Args),
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    match &args.command {
        Command::Plan(args) => plan::run(args, db, console),
        Command::Run(args) => run::run(args, db, console),
        Command::Shard(args) => run::shard(args, console),
        Command::Check(args) => check::run(args, console),
        Command::Publish(args) => publish::run(args, console),
    }
}
