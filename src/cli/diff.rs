//! `matdb diff`.

use super::console::Console;
use super::summary::{counted, table};
use crate::catalogue::{CurveChange, Diff, Field, Levels};
use crate::error::Error;
use crate::formats::words::shortened;
use crate::setup::Database;
use crate::setup::find_material;

/// Show what differs between two revisions or two materials
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb diff my-paint@1 my-paint@2
  matdb diff my-paint mannequin-paint
  matdb diff my-paint@1 my-paint --all          every number of every fit, too
  matdb diff my-paint@1 my-paint --json | jq '.fields[].path'

Curves are compared at the angles that both have, in dB: the second minus the first.")]
pub(super) struct Args {
    /// NAME or NAME@REVISION
    before: String,
    /// NAME or NAME@REVISION
    after: String,
    /// Every field of fits that are new, gone or made again, and not only their parameters
    #[arg(long)]
    all: bool,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let before = find_material(store.as_ref(), &args.before, "")?.material;
    let after = find_material(store.as_ref(), &args.after, "")?.material;
    let diff = Diff::new(&before, &after);
    diff.notices.iter().for_each(|notice| console.notice(notice));
    let names = [&args.before, &args.after];
    let text = if args.all {
        text(&diff, diff.fields.iter(), names)
    } else {
        let fields = diff.fields.iter().filter(|field| !is_of_report(&field.path));
        text(&diff, fields, names) + &left_out(&diff)
    };
    console.result(&text, &diff)
}

/// Whether a field says how a fit was made, and not what it found: its report, its covariance, whence each
/// parameter is.
fn is_of_report(path: &str) -> bool {
    let parts: Vec<&str> = path.split('.').collect();
    parts.first() == Some(&"fits")
        && ["report", "covariance", "parameter_sources"].iter().any(|part| parts.contains(part))
}

fn left_out(diff: &Diff) -> String {
    match diff.fields.iter().filter(|field| is_of_report(&field.path)).count() {
        0 => String::new(),
        more => format!("and {} of how fits were made: --all shows them\n", counted(more, "field")),
    }
}

fn text<'a>(diff: &Diff, fields: impl Iterator<Item = &'a Field>, names: [&String; 2]) -> String {
    if diff.is_empty() {
        return format!("{} and {} say the same\n", names[0], names[1]);
    }
    let mut text = String::new();
    let mut rows =
        fields.map(|f| [f.place(), on_a_line(&f.before()), on_a_line(&f.after())]).peekable();
    if rows.peek().is_some() {
        text += &table(&["field", names[0], names[1]], rows);
    }
    for CurveChange { curve, points, levels, limits } in &diff.curves {
        let number =
            |side: usize| points[side].map_or("none".to_owned(), |n| format!("{n} points"));
        text += &format!("curve {curve}: {} → {}", number(0), number(1));
        text += &levels.as_ref().map_or(String::new(), |levels| format!("; {}", words(levels)));
        text += &limits.as_ref().map_or(String::new(), |l| format!("; its limits {}", words(l)));
        text += "\n";
    }
    if let Some(levels) = &diff.rendered {
        text += &format!("what scenes render: {}\n", words(levels));
    }
    text
}

fn words(levels: &Levels) -> String {
    let Levels { angles, mean_db, rms_db, largest_db } = levels;
    format!(
        "{mean_db:+.2} dB in the mean, {rms_db:.2} dB rms, {largest_db:.2} dB at most, \
         at {angles} common angles"
    )
}

/// A text on one line of a table.
fn on_a_line(text: &str) -> String {
    shortened(&text.split_whitespace().collect::<Vec<_>>().join(" "), 48)
}
