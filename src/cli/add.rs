//! `matdb add`.

mod foreign;

use std::path::PathBuf;

use serde_json::json;

use super::console::Console;
use crate::adopt::NewMaterials;
use crate::error::Error;
use crate::material::builtin;
use crate::setup::{Database, MATERIAL_TEMPLATE};
use crate::store::Addition;

/// Put materials into the database: built-in ones or your own
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb add mannequin-paint ptfe       two built-in materials
  matdb add --all                      every built-in material
  matdb add --from my-paint/           the folder's material.toml, or that of each subfolder
  matdb add --from my-paint/material.toml
  matdb add --template > my-paint/material.toml    a complete entry to change
  matdb add --from water.yml --name water --class liquid    a page of refractiveindex.info
  matdb add --from paint.brdf --name my-paint --class paint       a universal BRDF file
  matdb add --from scan.csv --name my-paint --class paint \\
    --kind measured --source 'Our bench, 2026' --licence CC-BY-4.0 \\
    --instrument 'Our radar' --frequency 300 --threshold -77      a bare curve

A bare curve has the columns theta_deg and sigma0_db; where nothing was detected sigma0_db is empty, \
censor is left and threshold_db the limit in dB. docs/materials.md has the other columns.")]
#[command(group = clap::ArgGroup::new("what").required(true).multiple(true))]
pub(super) struct Args {
    /// Names of built-in materials
    #[arg(group = "what")]
    names: Vec<String>,
    /// Every built-in material
    #[arg(long, group = "what")]
    all: bool,
    /// A material.toml, or a folder with one or with subfolders that have one; or a curve (.csv, .bsdf), a
    /// universal BRDF (.brdf, .json) or a page of refractiveindex.info's database (.yml)
    #[arg(long, value_name = "FILE|DIR", group = "what")]
    from: Vec<PathBuf>,
    /// Print a complete material.toml with comments, to be changed
    #[arg(long, group = "what", conflicts_with_all = ["names", "all", "from"])]
    template: bool,
    #[command(flatten)]
    foreign: foreign::DetailArgs,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    if args.template {
        return console.result(MATERIAL_TEMPLATE, &json!({ "material_toml": MATERIAL_TEMPLATE }));
    }
    args.foreign.check(&args.from)?;
    let mut names = args.names.clone();
    if args.all {
        names.extend(builtin::names().map(str::to_owned));
    }
    let new = NewMaterials::read(&names, &args.from, &args.foreign.given()?, db)?;
    new.notices.iter().for_each(|notice| console.notice(notice));
    let (mut lines, mut records) = (String::new(), Vec::new());
    for material in new.store(db)? {
        let (slug, revision) = (&material.slug, material.added.revision());
        let what = match material.added {
            Addition::New => "added",
            Addition::Revision(_) => "revised",
            Addition::Unchanged(_) => "unchanged",
            Addition::Repaired(_) => "repaired",
        };
        lines += &format!("{what} {slug}, revision {revision}, in {}\n", db.path().display());
        material.notice.iter().for_each(|notice| console.notice(notice));
        if let Some(line) = &material.differs {
            lines += &format!("  what differs: {line}\n");
        }
        records.push(json!({
            "slug": slug, "result": what, "revision": revision, "differs": material.differs,
        }));
    }
    console.result(&lines, &records)
}
