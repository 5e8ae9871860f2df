//! `matdb check`.

use serde::Serialize;

use super::console::Console;
use super::summary::counted;
use crate::catalogue::{CheckCount, Problem, Refit, StoreCheck};
use crate::error::Error;
use crate::material::builtin;
use crate::setup::Database;
use crate::store::Repair;

/// Verify the whole database, and fit again what it holds
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb check
  matdb check --json | jq '.findings[].place'
  matdb check --repair                 mend what can be, then verify

Verifies pages, hashes, values, statistics of curves, and fits. The status is 1 when anything is wrong.")]
pub(super) struct Args {
    /// First rebuild indexes, lists, statistics and damaged built-in materials; nothing sound changes
    #[arg(long)]
    repair: bool,
}

/// What was looked at, and what is wrong.
#[derive(Serialize)]
struct Record {
    revisions: usize,
    curves: usize,
    fits: usize,
    /// What `--repair` has mended, a sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    repaired: Vec<String>,
    findings: Vec<Problem>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let mut repair = Repair::default();
    if args.repair && db.read()?.is_some() {
        repair = db.write()?.repair(&builtin::all()?)?;
    }
    let Some(store) = db.read()? else {
        return Err(Error::NoDatabase { path: db.path().to_owned() });
    };
    let file = db.path().display().to_string();
    let revisions = store.list()?.iter().map(|material| material.revision as usize).sum();
    let progress = console.progress("checking", revisions);
    let failed = repair.failed.into_iter();
    let mut findings: Vec<Problem> =
        failed.map(|problem| Problem { place: file.clone(), problem }).collect();
    let count = StoreCheck {
        name: &file,
        refit: Refit::All,
        report: &mut |found| findings.push(found),
        advance: &mut || progress.inc(1),
    }
    .run(&store);
    progress.finish_and_clear();
    let CheckCount { revisions, curves, fits, .. } = count;
    let record = Record { revisions, curves, fits, repaired: repair.mended, findings };
    console.result(&text(&record, &file), &record)?;
    match record.findings.len() {
        0 => Ok(()),
        count => Err(Error::usage(
            format!("{} wrong in {file}", counted(count, "thing")),
            if args.repair {
                "add the damaged materials again, or restore the file from a copy"
            } else {
                "`matdb check --repair` mends what can be"
            },
        )),
    }
}

fn text(record: &Record, file: &str) -> String {
    let Record { revisions, curves, fits, repaired, findings } = record;
    let mut text: String = repaired.iter().map(|what| format!("{file}: {what}\n")).collect();
    text.extend(findings.iter().map(|wrong| format!("{wrong}\n")));
    text += &format!(
        "looked at {} and {} and made {} again in {file}: {}\n",
        counted(*revisions, "revision"),
        counted(*curves, "curve"),
        counted(*fits, "fit"),
        if findings.is_empty() { "all is well" } else { "see above" }
    );
    text
}
