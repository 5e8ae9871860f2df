//! `matdb search`.

use super::console::Console;
use super::list::FilterArgs;
use super::summary::{table, with_status};
use crate::error::Error;
use crate::report::{MaterialHit, MaterialSearch};
use crate::setup::Database;
use crate::store::Filter;

/// Search materials for words
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb search matt pai          all words must be there; the last may be a beginning
  matdb search piesiewicz        by an author of a source
  matdb search paint --frequency 300 --kind measured    among what holds at 300 GHz
  matdb search skin --json | jq '.[].slug'

Searches name, tags, class, description, finish, unknowns and sources, also of built-in materials that \
are not in the database.")]
pub(super) struct Args {
    /// Words to look for
    #[arg(required = true)]
    words: Vec<String>,
    /// How many to show at most
    #[arg(long, default_value_t = 20, value_name = "N", allow_negative_numbers = true)]
    limit: u32,
    #[command(flatten)]
    filter: FilterArgs,
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let words = args.words.join(" ");
    let filter = &args.filter.filter();
    let hits = MaterialSearch { words: &words, filter, most: args.limit }.run(db)?;
    let text = match hits.as_slice() {
        [] if *filter == Filter::default() => format!("no material has all these words: {words}\n"),
        [] => format!("no material of these conditions has all these words: {words}\n"),
        found => table(&["material", "where", "name", "words"], found.iter().map(row)),
    };
    console.result(&text, &hits)
}

fn row(MaterialHit { hit, origin }: &MaterialHit) -> [String; 4] {
    let place = match *origin {
        "built-in" => "built in, not added".to_owned(),
        _ if hit.is_damaged => "damaged".to_owned(),
        _ => with_status(&format!("revision {}", hit.revision), &hit.status),
    };
    let snippet = hit.snippet.split_whitespace().collect::<Vec<_>>().join(" ");
    [hit.slug.to_string(), place, hit.name.clone(), snippet]
}
