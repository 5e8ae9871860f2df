//! `matdb new`: files to begin with.

mod material;
mod scene;

use clap::Subcommand;

use super::console::Console;
use crate::error::Error;

/// Write a commented scene or material to begin with
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb new scene --cloud cloud.csv --mesh target.ply          the scene of your own measurement
  matdb new scene --cloud scan.xyz --columns Intensity=power_dbm --mesh builtin:sphere --radar-at 0,1.2,3
  matdb new material my-paint                                  a folder with a material.toml and its curve")]
pub(super) struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Debug, Subcommand)]
enum What {
    Scene(scene::Args),
    Material(material::Args),
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    match &args.what {
        What::Scene(args) => scene::run(args, console),
        What::Material(args) => material::run(args, console),
    }
}
