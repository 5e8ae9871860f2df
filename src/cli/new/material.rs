//! `matdb new material`.

use std::path::PathBuf;

use serde_json::json;

use super::write::write_new;
use crate::cli::add::TEMPLATE;
use crate::cli::console::Console;
use crate::error::Error;
use crate::material::Slug;

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

/// Example of the curve that the template names.
const CURVE: &str = "# Replace these rows by yours. Where nothing was detected: censor = left, and the limit in threshold_db.
theta_deg,sigma0_db,censor,threshold_db
0,-2.0,none,
10,-17.5,none,
30,-19.0,none,
60,,left,-30.0
";

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let name = args.name.as_str();
    let folder = args.output.clone().unwrap_or_else(|| PathBuf::from(name));
    let text = TEMPLATE.replacen("my-paint", name, 1);
    let files = [
        ("material.toml".to_owned(), text.into_bytes()),
        ("scan.csv".to_owned(), CURVE.as_bytes().to_vec()),
    ];
    write_new(&folder, &files)?;
    let shown = folder.display();
    let text = format!(
        "wrote material.toml and scan.csv to {shown}: replace their numbers, then run\n  matdb add --from {shown}\n"
    );
    console.result(&text, &json!({ "folder": folder, "files": ["material.toml", "scan.csv"] }))
}
