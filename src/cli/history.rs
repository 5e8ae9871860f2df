//! `matdb history`.

use serde::Serialize;

use super::console::Console;
use super::summary::table;
use crate::catalogue::Diff;
use crate::error::Error;
use crate::material::{Activity, Material, Origin};
use crate::setup::Database;
use crate::setup::{find_material, unknown_material};

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

/// A revision and what made it.
#[derive(Serialize)]
struct Record {
    revision: u32,
    added_at: String,
    program_version: String,
    content_hash: String,
    /// None where an older program did not record it.
    activity: Option<Activity>,
    changed: String,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let store = db.read()?;
    let (Some(known), Ok(slug)) = (&store, args.name.parse()) else {
        return Err(none(args, db, store.as_ref().is_some())?);
    };
    let mut records = Vec::new();
    let mut last: Option<Material> = None;
    for summary in known.history(&slug)? {
        let Some(stored) = known.get(&slug, Some(summary.revision))? else { continue };
        let changed = match &last {
            None => "first".to_owned(),
            Some(last) => Diff::new(last, &stored.material).line(),
        };
        records.push(Record {
            revision: stored.revision,
            added_at: stored.added_at,
            program_version: stored.program_version,
            content_hash: stored.content_hash,
            activity: stored.activity,
            changed,
        });
        last = Some(stored.material);
    }
    if records.is_empty() {
        return Err(none(args, db, true)?);
    }
    let header = ["rev", "added", "content", "made by", "changed"];
    let mut text = table(&header, records.iter().map(row));
    let mut catalogues: Vec<String> = origins(&records).map(Origin::credit).collect();
    catalogues.dedup();
    catalogues.iter().for_each(|from| text += &format!("imported from {from}\n"));
    console.result(&text, &records)
}

fn origins(records: &[Record]) -> impl Iterator<Item = &Origin> {
    records.iter().filter_map(|record| record.activity.as_ref()?.origin.as_ref())
}

/// Why there is nothing to tell.
fn none(args: &Args, db: &Database, has_store: bool) -> Result<Error, Error> {
    let store = if has_store { db.read()? } else { None };
    let name = &args.name;
    match find_material(store.as_ref(), name, "") {
        Ok(_) if name.contains('@') => Ok(Error::usage(
            format!("`{name}` is one revision"),
            "give the bare name; `matdb show` shows one revision",
        )),
        Ok(_) => Ok(Error::usage(
            format!("`{name}` is built in and not in {}", db.path().display()),
            format!("`matdb add {name}` begins its history"),
        )),
        Err(_) => unknown_material(store.as_ref(), name, ""),
    }
}

fn row(record: &Record) -> [String; 5] {
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
