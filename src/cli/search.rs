//! `matdb search`.

use serde::Serialize;

use super::console::Console;
use super::summary::{table, with_status};
use crate::error::Error;
use crate::setup::Database;
use crate::setup::store_of_not_added;
use crate::store::{Hit, Store};

/// Search materials for words
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb search matt pai          all words must be there; the last may be a beginning
  matdb search piesiewicz        by an author of a source
  matdb search skin --json | jq '.[].slug'

Searches name, tags, class, description, finish, unknowns and sources, also of built-in materials that \
are not in the database.")]
pub(super) struct Args {
    /// Words to look for
    #[arg(required = true)]
    words: Vec<String>,
    /// How many to show at most
    #[arg(long, default_value_t = 20, value_name = "N")]
    limit: u32,
}

/// A material with the words.
#[derive(Serialize)]
struct Record {
    #[serde(flatten)]
    hit: Hit,
    /// Where it is: `database` or `built-in`.
    origin: &'static str,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let words = args.words.join(" ");
    if !words.chars().any(char::is_alphanumeric) {
        return Err(Error::usage(
            "there is no word to look for",
            "give one with a letter or a digit, as in `matdb search paint`",
        ));
    }
    let store = db.read()?;
    let missing = store_of_not_added(store.as_ref())?;
    let mut records = Vec::new();
    for (store, origin) in [(store.as_ref(), "database"), (Some(&missing), "built-in")] {
        let found = store.map_or(Ok(Vec::new()), |s: &Store| s.search(&words, args.limit))?;
        records.extend(found.into_iter().map(|hit| Record { hit, origin }));
    }
    records.truncate(usize::try_from(args.limit).unwrap_or(usize::MAX));
    let text = match records.as_slice() {
        [] => format!("no material has all these words: {words}\n"),
        found => table(&["material", "where", "name", "words"], found.iter().map(row)),
    };
    console.result(&text, &records)
}

fn row(Record { hit, origin }: &Record) -> [String; 4] {
    let place = match *origin {
        "built-in" => "built in, not added".to_owned(),
        _ => with_status(&format!("revision {}", hit.revision), &hit.status),
    };
    let snippet = hit.snippet.split_whitespace().collect::<Vec<_>>().join(" ");
    [hit.slug.to_string(), place, hit.name.clone(), snippet]
}
