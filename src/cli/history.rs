//! `matdb history`.

use super::console::Console;
use super::summary::table;
use crate::error::Error;
use crate::material::Origin;
use crate::report::{RevisionRecord, revision_records};
use crate::setup::Database;

/// List the revisions of a material: when, by which command, what changed
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb history my-paint
  matdb history my-paint --json | jq '.[].activity'

`matdb diff my-paint@1 my-paint@2` shows every change.")]
pub(super) struct Args {
    /// Name of the material
    name: String,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let records = revision_records(&args.name, db)?;
    let header = ["rev", "added", "content", "made by", "changed"];
    let mut text = table(&header, records.iter().map(row));
    let mut catalogues: Vec<String> = origins(&records).map(Origin::credit).collect();
    catalogues.dedup();
    catalogues.iter().for_each(|from| text += &format!("imported from {from}\n"));
    console.result(&text, &records)
}

fn origins(records: &[RevisionRecord]) -> impl Iterator<Item = &Origin> {
    records.iter().filter_map(|record| record.activity.as_ref()?.origin.as_ref())
}

fn row(record: &RevisionRecord) -> [String; 5] {
    let made = record.activity.as_ref().map_or("not recorded".to_owned(), |activity| {
        if let Some(Origin { revision, added_at, .. }) = &activity.origin {
            let day = added_at.get(..10).unwrap_or(added_at);
            return format!("{}, their revision {revision} of {day}", activity.command);
        }
        let inputs: Vec<&str> = activity.inputs.iter().map(|input| input.name.as_str()).collect();
        match inputs.len() {
            0 => activity.command.clone(),
            1..=3 => format!("{} of {}", activity.command, inputs.join(", ")),
            more => format!("{} of {more} files", activity.command),
        }
    });
    let hash = record.content_hash.get(..12).unwrap_or(&record.content_hash);
    [
        record.revision.to_string(),
        record.added_at.clone(),
        hash.to_owned(),
        made,
        record.changed.clone(),
    ]
}
