//! `matdb history`.

use serde::Serialize;

use super::console::Console;
use super::database::Database;
use super::materials::{find, unknown};
use super::summary::table;
use crate::catalogue::Diff;
use crate::error::Error;
use crate::material::{Activity, Material, Origin};

/// List the revisions of a material: when, by which command of which files, and what changed
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb history my-paint
  matdb history my-paint --json | jq '.[].activity'

`matdb diff my-paint@1 my-paint@2` says all that changed.")]
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
    console.result(&table(&header, records.iter().map(row)), &records)
}

/// Why there is nothing to tell.
fn none(args: &Args, db: &Database, has_store: bool) -> Result<Error, Error> {
    let store = if has_store { db.read()? } else { None };
    let name = &args.name;
    match find(store.as_ref(), name, "") {
        Ok(_) if name.contains('@') => Ok(Error::Usage {
            problem: format!("`{name}` is one revision"),
            way_out: "give the bare name; `matdb show` shows one revision".to_owned(),
        }),
        Ok(_) => Ok(Error::Usage {
            problem: format!("`{name}` is built in and not in {}", db.path().display()),
            way_out: format!("`matdb add {name}` begins its history"),
        }),
        Err(_) => unknown(store.as_ref(), name, ""),
    }
}

/// The catalogue that a revision was taken from.
fn origin(origin: &Origin) -> String {
    let Origin { title, version, doi, url, revision, added_at, .. } = origin;
    let version = version.as_ref().map_or(String::new(), |version| format!(" {version}"));
    let place = match (doi, url) {
        (Some(doi), _) => format!(", doi:{doi}"),
        (None, Some(url)) => format!(", {url}"),
        (None, None) => String::new(),
    };
    let title = title.as_deref().unwrap_or("a catalogue without a title");
    format!(" ({title}{version}{place}: its revision {revision} of {added_at})")
}

fn row(record: &Record) -> [String; 5] {
    let made = record.activity.as_ref().map_or("not recorded".to_owned(), |activity| {
        let inputs: Vec<&str> = activity.inputs.iter().map(|input| input.name.as_str()).collect();
        let made = match inputs.len() {
            0 => activity.command.clone(),
            1..=3 => format!("{} of {}", activity.command, inputs.join(", ")),
            more => format!("{} of {more} files", activity.command),
        };
        made + &activity.origin.as_ref().map_or(String::new(), origin)
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
