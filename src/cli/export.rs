//! `matdb export`.

use std::path::PathBuf;

use serde_json::json;

use super::console::Console;
use crate::catalogue::exchange::{self, Export};
use crate::error::Error;
use crate::files::{folder_of, write_all};
use crate::report::{ExportReport, ExportRequest};
use crate::setup::Database;

/// Write a material in another format, and say what that cannot carry
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb export mannequin-paint --as mitsuba -o paint.xml
  matdb export my-paint@2 --as universal-brdf -o paint.brdf
  matdb export my-paint --as csv --curve spring -o spring.csv
  matdb export ptfe --as open-material -o ptfe.xomp     with its tables beside it")]
pub(super) struct Args {
    /// NAME or NAME@REVISION
    material: String,
    /// The format
    #[arg(long = "as", value_name = "FORMAT")]
    format: Format,
    /// Which curve [default: what scenes render, else the one that was fitted]
    #[arg(long, value_name = "NAME")]
    curve: Option<String>,
    /// The file to write; tables that belong to it get its name and stand beside it
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
}

/// Formats and what they carry.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Format {
    /// One curve with its detection limits, in degrees and dB; `matdb add --from` reads it back
    Csv,
    /// One curve with its detection limits in SI units, typed, with units in its metadata
    Parquet,
    /// EMPIR universal BRDF (.brdf): one curve, its uncertainty and limits; `matdb add --from` reads it
    UniversalBrdf,
    /// ASAM OpenMATERIAL 3D (.xomp): tables of the BRDF and permittivity, roughness
    OpenMaterial,
    /// Mitsuba 3 BSDF (.xml): diffuse and rough facets; other models by the nearest of these
    Mitsuba,
    /// Sionna RT radio material (.py): permittivity and the nearest scattering pattern
    Sionna,
}

impl From<Format> for exchange::Format {
    fn from(format: Format) -> exchange::Format {
        match format {
            Format::Csv => exchange::Format::Csv,
            Format::Parquet => exchange::Format::Parquet,
            Format::UniversalBrdf => exchange::Format::UniversalBrdf,
            Format::OpenMaterial => exchange::Format::OpenMaterial,
            Format::Mitsuba => exchange::Format::Mitsuba,
            Format::Sionna => exchange::Format::Sionna,
        }
    }
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let request = ExportRequest {
        material: &args.material,
        format: args.format.into(),
        curve: args.curve.as_deref(),
        output: &args.output,
    };
    let ExportReport { export: Export { files, lost }, notice } =
        request.run(db.read()?.as_ref())?;
    write_all(folder_of(&args.output), &files)?;
    notice.iter().for_each(|notice| console.notice(notice));
    let written: Vec<String> = files
        .iter()
        .map(|(name, _)| args.output.with_file_name(name).display().to_string())
        .collect();
    let text = format!("wrote {}\n{lost}\n", written.join(", "));
    console.result(&text, &json!({ "files": written, "lost": lost }))
}
