//! `matdb check`.

use serde::Serialize;

use super::console::Console;
use super::summary::counted;
use crate::catalogue::{OTHER_UNITS, derived, without_report};
use crate::error::Error;
use crate::fit::again::{lacks_report, problems};
use crate::material::builtin;
use crate::setup::Database;
use crate::store::{Again, Store, StoreError, Stored, Summary};

/// Verify the whole database: pages, hashes, values, statistics of curves, and fits by fitting again
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb check
  matdb check --json | jq '.findings[].place'
  matdb check --repair                 mend what can be, then verify

Ends with status 1 when anything is wrong.")]
pub(super) struct Args {
    /// First make indexes, lists and statistics anew, and damaged built-in materials; nothing that is sound changes
    #[arg(long)]
    repair: bool,
}

/// What was looked at, and what is wrong.
#[derive(Default, Serialize)]
struct Record {
    revisions: usize,
    curves: usize,
    fits: usize,
    /// What `--repair` has mended, a sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    repaired: Vec<String>,
    findings: Vec<Wrong>,
}

/// One thing that is wrong.
#[derive(Serialize)]
struct Wrong {
    /// The file, or the revision and what in it.
    place: String,
    problem: String,
}

impl Record {
    fn wrong(&mut self, place: &str, problem: impl ToString) {
        self.findings.push(Wrong { place: place.to_owned(), problem: problem.to_string() });
    }
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let mut record = Record::default();
    if args.repair && db.read()?.is_some() {
        record.repaired = db.write()?.repair(&builtin::all()?)?;
    }
    let Some(store) = db.read()? else {
        return Err(Error::Usage {
            problem: format!("there is no database {}", db.path().display()),
            way_out: "name one with --db; `matdb add NAME` makes one".to_owned(),
        });
    };
    let file = db.path().display().to_string();
    store.damage()?.iter().for_each(|problem| record.wrong(&file, problem));
    for changed in store.changed_schema()? {
        record.wrong(&file, changed);
    }
    let mut again = Again::new()?;
    if !again.has_own_units(&store)? {
        record.wrong(&file, OTHER_UNITS);
    }
    let materials = store.list()?;
    let total = materials.iter().map(|material| material.revision as usize).sum();
    let progress = console.progress("checking", total);
    for Summary { slug, .. } in &materials {
        let history = match store.history(slug) {
            Err(StoreError::Corrupt { problem, .. }) => {
                record.wrong(slug.as_str(), problem);
                continue;
            }
            history => history?,
        };
        for summary in history {
            let place = format!("{slug}@{}", summary.revision);
            match store.get(slug, Some(summary.revision)) {
                Ok(Some(stored)) => {
                    revision(&mut record, &mut again, &store, &stored, &place)?;
                }
                Ok(None) => record.wrong(&place, "is not there"),
                Err(StoreError::Corrupt { problem, .. }) => record.wrong(&place, problem),
                Err(error) => return Err(error.into()),
            }
            progress.inc(1);
        }
    }
    progress.finish_and_clear();
    console.result(&text(&record, &file), &record)?;
    match record.findings.len() {
        0 => Ok(()),
        count => Err(Error::Usage {
            problem: format!("{} wrong in {file}", counted(count, "thing")),
            way_out: if args.repair {
                "add the damaged materials again, or restore the file from a copy".to_owned()
            } else {
                "`matdb check --repair` mends what can be".to_owned()
            },
        }),
    }
}

fn text(record: &Record, file: &str) -> String {
    let Record { revisions, curves, fits, repaired, findings } = record;
    let mut text: String = repaired.iter().map(|what| format!("{file}: {what}\n")).collect();
    text.extend(findings.iter().map(|wrong| format!("{}: {}\n", wrong.place, wrong.problem)));
    text += &format!(
        "looked at {} and {} and made {} again in {file}: {}\n",
        counted(*revisions, "revision"),
        counted(*curves, "curve"),
        counted(*fits, "fit"),
        if findings.is_empty() { "all is well" } else { "see above" }
    );
    text
}

/// The content hash was compared when the revision was read.
fn revision(
    record: &mut Record,
    again: &mut Again,
    store: &Store,
    stored: &Stored,
    place: &str,
) -> Result<(), Error> {
    record.revisions += 1;
    let material = &stored.material;
    record.curves += material.curves.len();
    match material.validate() {
        Ok(()) => {
            let wrong = derived(again, store, stored)?;
            wrong.iter().for_each(|found| record.wrong(&found.place, &found.problem));
        }
        Err(error) => record.wrong(place, error),
    }
    for fit in &material.fits {
        if lacks_report(fit) {
            record.wrong(&format!("{place}, fit {}", fit.name), without_report(fit));
        }
        let Some(wrong) = problems(material, fit) else { continue };
        record.fits += 1;
        let place = format!("{place}, fit {}", fit.name);
        wrong.iter().for_each(|problem| record.wrong(&place, problem));
    }
    Ok(())
}
