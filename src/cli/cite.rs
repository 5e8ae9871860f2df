//! `matdb cite`.

use serde_json::json;

use super::console::Console;
use crate::catalogue::{Citable, Credit, references};
use crate::error::Error;
use crate::setup::{Database, find_material, later_status_warning};

/// Say how to cite a material, and which source each of its numbers rests on
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb cite mannequin-paint
  matdb cite my-paint@2 --bibtex >> references.bib
  matdb cite my-paint --csl                  CSL-JSON, for reference managers")]
pub(super) struct Args {
    /// NAME or NAME@REVISION
    name: String,
    /// As BibTeX: the entry and each of its sources
    #[arg(long, conflicts_with = "csl")]
    bibtex: bool,
    /// As CSL-JSON: the same
    #[arg(long)]
    csl: bool,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let found = find_material(store.as_ref(), &args.name, "")?;
    let material = &found.material;
    let later = later_status_warning(store.as_ref(), &material.slug, found.revision)?;
    later.iter().for_each(|later| console.notice(later));
    let stored = found.stored(store.as_ref())?;
    let credit = stored.as_ref().map_or(Credit::BuiltIn, Credit::of);
    let year = stored.as_ref().and_then(|stored| credit.year(stored));
    let citable = Citable { material, revision: found.revision, year, credit };
    let csl = citable.csl();
    let text = match (args.bibtex, args.csl) {
        (true, _) => citable.bibtex(),
        (_, true) => format!("{csl:#}\n"),
        _ => citable.text(),
    };
    let record = json!({
        "text": citable.text(),
        "bibtex": citable.bibtex(),
        "csl": csl,
        "references": references(material),
    });
    console.result(&text, &record)
}
