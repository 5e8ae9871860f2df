//! `matdb export`.

use std::path::PathBuf;

use serde_json::json;

use super::console::Console;
use crate::catalogue::Credit;
use crate::catalogue::exchange::{self, Export, Subject};
use crate::error::Error;
use crate::files::{folder_of, write_all};
use crate::setup::{
    Database, MaterialRevision, find_material, later_status_warning, status_warning,
};

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
    let store = db.read()?;
    let found = find_material(store.as_ref(), &args.material, "")?;
    let stored = found.stored(store.as_ref())?;
    let MaterialRevision { material, revision } = found;
    let added_at = stored.as_ref().map(|stored| stored.added_at.as_str());
    let origin = stored.as_ref().and_then(|stored| Credit::of(stored).origin());
    let curve = args.curve.as_deref();
    if let Some(name) = curve.filter(|name| material.curves.iter().all(|c| c.name != *name)) {
        let names: Vec<&str> = material.curves.iter().map(|curve| curve.name.as_str()).collect();
        return Err(Error::usage(
            format!("`{}` has no curve `{name}`", args.material),
            if names.is_empty() {
                "leave --curve out: its model is written".to_owned()
            } else {
                format!("there are: {}", names.join(", "))
            },
        ));
    }
    let subject = Subject { material: &material, revision, added_at, origin, curve };
    let Some(name) = args.output.file_name().and_then(|name| name.to_str()) else {
        return Err(Error::usage(
            format!("{} names no file", args.output.display()),
            "name one with -o, such as -o paint.brdf",
        ));
    };
    let Export { files, lost } = exchange::export(&subject, args.format.into(), name)?;
    write_all(folder_of(&args.output), &files)?;
    let later = later_status_warning(store.as_ref(), &material.slug, revision)?;
    let notices = later.or_else(|| status_warning(&material));
    notices.iter().for_each(|notice| console.notice(notice));
    let written: Vec<String> = files
        .iter()
        .map(|(name, _)| args.output.with_file_name(name).display().to_string())
        .collect();
    let text = format!("wrote {}\n{lost}\n", written.join(", "));
    console.result(&text, &json!({ "files": written, "lost": lost }))
}
