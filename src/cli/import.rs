//! `matdb import`.

use std::path::PathBuf;

use super::console::Console;
use super::summary::counted;
use crate::adopt::CatalogueImport;
use crate::catalogue::{ImportSummary, MaterialPlan, Outcome};
use crate::error::Error;
use crate::setup::Database;

/// Take over another laboratory's published catalogue
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb import site --dry-run                  see what would be added
  matdb import site                            add what is not there, report conflicts
  matdb import site --as-prefix roe-           add conflicting materials as roe-NAME

The catalogue is verified first. All of it is added, or nothing, and nothing of yours is overwritten. \
A material that was imported before and is unchanged gets the newer revisions; one that was changed here \
is a conflict. `matdb history` names the catalogue of a revision.")]
pub(super) struct Args {
    /// A published folder, or its catalogue.sqlite
    bundle: PathBuf,
    /// Put this before the names of materials that differ from yours of the same name
    #[arg(long, value_name = "PREFIX")]
    as_prefix: Option<String>,
    /// Say what would be done, and change nothing
    #[arg(long)]
    dry_run: bool,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let import = CatalogueImport {
        bundle: &args.bundle,
        prefix: args.as_prefix.as_deref(),
        dry_run: args.dry_run,
    };
    let imported = import.run(db)?;
    imported.notices.iter().for_each(|notice| console.notice(notice));
    console.result(&text(&imported, db), &imported)
}

fn text(imported: &ImportSummary, db: &Database) -> String {
    let mut text = String::new();
    let add = if imported.dry_run { "would add" } else { "added" };
    let mut counts = [0; 4];
    for MaterialPlan { slug, name, outcome } in &imported.materials {
        let of = if slug == name { String::new() } else { format!(", their {slug}") };
        match outcome {
            Outcome::Added { revisions } => {
                counts[0] += 1;
                text += &format!("{add} {name}{of}, {}\n", counted(*revisions, "revision"));
            }
            Outcome::Continued { revisions, after } => {
                counts[1] += 1;
                let newer = counted(*revisions, "newer revision");
                text += &format!("{add} to {name}@{after}{of}, {newer}\n");
            }
            Outcome::Unchanged => counts[2] += 1,
            Outcome::Conflict { ours, theirs } => {
                counts[3] += 1;
                let [ours, theirs] = [ours, theirs].map(|hash| hash.get(..12).unwrap_or(hash));
                text += &format!(
                    "conflict {name}{of}: yours has content {ours}, theirs {theirs}; yours stays, \
                     --as-prefix adds theirs beside it\n"
                );
            }
        }
    }
    let [new, continued, same, conflicts] = counts;
    text + &format!(
        "{add} {} to {}, and newer revisions to {continued}; there already: {same}, in conflict: \
         {conflicts}\n",
        counted(new, "material"),
        db.path().display()
    )
}
