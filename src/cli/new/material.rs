//! `matdb new material`.

use std::path::PathBuf;

use serde_json::json;

use crate::cli::console::Console;
use crate::error::Error;
use crate::material::Slug;
use crate::setup::{new_material, write_new};

/// Write a folder with a complete, commented material.toml and the curve that it names
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb new material my-paint
  matdb add --from my-paint            once its numbers are yours")]
pub(super) struct Args {
    /// Short name of the material
    name: Slug,
    /// Folder to write; created if needed [default: the name]
    #[arg(long, short, value_name = "DIR")]
    output: Option<PathBuf>,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(args.name.as_str()));
    write_new(&folder, &new_material(&args.name))?;
    let shown = folder.display();
    let text = format!(
        "wrote material.toml and scan.csv to {shown}: replace their numbers, then run\n  matdb add --from {shown}\n"
    );
    console.result(&text, &json!({ "folder": folder, "files": ["material.toml", "scan.csv"] }))
}
