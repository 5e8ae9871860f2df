//! `matdb check`.

use indicatif::ProgressBar;

use super::console::Console;
use super::summary::counted;
use crate::adopt::{CheckProgress, CheckReport, DatabaseCheck};
use crate::error::Error;
use crate::setup::Database;

/// Verify the whole database, and fit again what it holds
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb check
  matdb check --json | jq '.findings[].place'
  matdb check --repair                 mend what can be, then verify

Verifies pages, hashes, values, statistics of curves, and fits. The status is 1 when anything is wrong.")]
pub(super) struct Args {
    /// First copy the file and mend indexes, lists, statistics, records and built-in materials; nothing sound changes
    #[arg(long)]
    repair: bool,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let mut bar = None;
    let check = DatabaseCheck { repair: args.repair };
    let report = check.run(db, &mut |progress| match progress {
        CheckProgress::Begin { revisions } => bar = Some(console.progress("checking", revisions)),
        CheckProgress::Revision => bar.iter().for_each(|bar| bar.inc(1)),
    })?;
    bar.iter().for_each(ProgressBar::finish_and_clear);
    let file = db.path().display().to_string();
    report.notices.iter().for_each(|notice| console.notice(notice));
    console.result(&text(&report, &file), &report)?;
    match report.findings.len() {
        0 => Ok(()),
        count => Err(Error::usage(
            format!("{} wrong in {file}", counted(count, "thing")),
            if args.repair {
                "add or remove the damaged materials, or restore the file from a copy"
            } else {
                "`matdb check --repair` mends what can be"
            },
        )),
    }
}

fn text(report: &CheckReport, file: &str) -> String {
    let CheckReport { revisions, curves, fits, surface_lobes, repaired, copy, findings, .. } =
        report;
    let mut text: String = repaired.iter().map(|what| format!("{file}: {what}\n")).collect();
    text.extend(
        copy.iter().map(|copy| format!("{}: as it was before the repair\n", copy.display())),
    );
    text.extend(findings.iter().map(|wrong| format!("{wrong}\n")));
    text += &format!(
        "looked at {} and {} and made {} again in {file}: {}\n",
        counted(*revisions, "revision"),
        counted(*curves, "curve"),
        counted(*fits, "fit"),
        if findings.is_empty() { "all is well" } else { "see above" }
    );
    if *surface_lobes > 0 {
        let materials = counted(*surface_lobes, "material");
        text += &format!("of {materials} scenes render lobes of the surface alone\n");
    }
    text
}
