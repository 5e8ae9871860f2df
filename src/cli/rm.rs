//! `matdb rm`.

use serde_json::json;

use super::console::Console;
use super::database::Database;
use super::materials::unknown;
use crate::error::Error;
use crate::store::Removed;

/// Remove materials from the database, with all their revisions
#[derive(Debug, clap::Args)]
#[command(after_help = "Example:
  matdb rm my-paint")]
pub(super) struct Args {
    /// Names of the materials
    #[arg(required = true)]
    names: Vec<String>,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    // Opening for reading first: removing from a database that is not there must not create it.
    let known = db.read()?;
    let mut slugs = Vec::new();
    for name in &args.names {
        if args.names.iter().filter(|other| *other == name).count() > 1 {
            let way_out = "name each material once".to_owned();
            return Err(Error::Usage { problem: format!("`{name}` is named twice"), way_out });
        }
        let slug = name.parse().ok();
        match (slug, &known) {
            (Some(slug), Some(store)) if store.get(&slug, None)?.is_some() => slugs.push(slug),
            _ => return Err(unknown(known.as_ref(), name, "")?),
        }
    }
    drop(known);
    let removed = db.write()?.remove(&slugs)?;
    let (mut lines, mut records) = (String::new(), Vec::new());
    for (name, removed) in std::iter::zip(&args.names, removed) {
        let revisions = removed.map_or(0, |Removed { revisions }| revisions);
        lines +=
            &format!("removed {name}, {revisions} revision(s), from {}\n", db.path().display());
        records.push(json!({ "slug": name, "revisions": revisions }));
    }
    console.result(&lines, &records)
}
