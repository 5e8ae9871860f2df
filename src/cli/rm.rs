//! `matdb rm`.

use serde_json::json;

use super::console::Console;
use super::summary::counted;
use crate::error::Error;
use crate::formats::text::nearest;
use crate::setup::Database;
use crate::store::{Removal, Store};

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
            return Err(Error::usage(format!("`{name}` is named twice"), way_out));
        }
        let slug = name.parse().ok();
        match (slug, &known) {
            (Some(slug), Some(store)) if store.holds(&slug)? => slugs.push(slug),
            _ => return Err(absent(name, known.as_ref(), db)?),
        }
    }
    drop(known);
    let removed = db.write()?.remove(&slugs)?;
    let (mut lines, mut records) = (String::new(), Vec::new());
    for (name, removed) in std::iter::zip(&args.names, removed) {
        let revisions = removed.map_or(0, |Removal { revisions }| revisions);
        lines += &format!(
            "removed {name}, {}, from {}\n",
            counted(revisions as usize, "revision"),
            db.path().display()
        );
        records.push(json!({ "slug": name, "revisions": revisions }));
    }
    console.result(&lines, &records)
}

fn absent(name: &str, store: Option<&Store>, db: &Database) -> Result<Error, Error> {
    let stored = store.map_or(Ok(Vec::new()), Store::list)?;
    let near = nearest(name, stored.iter().map(|summary| summary.slug.as_str()));
    let way_out = match (name.split_once('@'), near) {
        (Some((slug, _)), _) => format!("all revisions go together: `matdb rm {slug}`"),
        (None, Some(near)) => format!("did you mean `{near}`?"),
        (None, None) => "`matdb list` shows what it holds".to_owned(),
    };
    let problem = format!("{} holds no material `{name}`", db.path().display());
    Ok(Error::usage(problem, way_out))
}
