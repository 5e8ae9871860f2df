//! `matdb list`.

use std::collections::BTreeSet;

use super::console::Console;
use super::curves::kind_of;
use super::summary::{grouped, table, with_status};
use crate::error::Error;
use crate::material::{Material, SourceKind};
use crate::setup::Database;
use crate::setup::builtin_not_added;
use crate::store::{Filter, Store, Summary};

/// List the materials in the database
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb list
  matdb list --frequency 300 --kind measured    measured ones that hold at 300 GHz
  matdb list --class paint --fitted             paints with a model that was fitted
  matdb list --json | jq '.[].slug'")]
pub(super) struct Args {
    #[command(flatten)]
    filter: FilterArgs,
    /// How many to show at most [default: 200, with --json all]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    limit: Option<u32>,
}

/// What a person still looks through.
const SHOWN: u32 = 200;
/// How many more are counted.
const MOST_COUNTED: u32 = 10_000;

/// Which materials are wanted; all that is said must hold.
#[derive(Debug, clap::Args)]
pub(super) struct FilterArgs {
    /// Only those whose numbers are claimed at this frequency
    #[arg(long, value_name = "GHZ", value_parser = frequency, allow_negative_numbers = true)]
    frequency: Option<f64>,
    /// Only those with this tag
    #[arg(long, value_name = "TAG")]
    tag: Option<String>,
    /// Only those whose rendered numbers are of this origin
    #[arg(long, value_parser = kind_of(KINDS))]
    kind: Option<SourceKind>,
    /// Only those of this class, such as paint or metal
    #[arg(long, value_name = "CLASS")]
    class: Option<String>,
    /// Only those with a model that was fitted to a curve
    #[arg(long, conflicts_with = "not_fitted")]
    fitted: bool,
    /// Only those without one
    #[arg(long)]
    not_fitted: bool,
    /// Only those with this status
    #[arg(long, value_parser = ["active", "superseded", "withdrawn"])]
    status: Option<String>,
}

/// How numbers can have come to be.
pub(super) const KINDS: [SourceKind; 4] =
    [SourceKind::Measured, SourceKind::Literature, SourceKind::Modelled, SourceKind::Synthetic];

impl FilterArgs {
    pub fn filter(&self) -> Filter {
        Filter {
            frequency_hz: self.frequency.map(|ghz| ghz * 1e9),
            tag: self.tag.clone(),
            kind: self.kind,
            class: self.class.clone(),
            fitted: (self.fitted || self.not_fitted).then_some(self.fitted),
            status: self.status.clone(),
        }
    }
}

/// Visible light: what lies above was not meant in GHz.
const HIGHEST_GHZ: f64 = 1e6;

pub(super) fn frequency(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(ghz) if ghz > 0.0 && ghz <= HIGHEST_GHZ => Ok(ghz),
        _ => Err("give a frequency in GHz above 0, such as 300".to_owned()),
    }
}

pub(super) fn run(args: &Args, db: &Database, console: &Console) -> Result<(), Error> {
    let filter = args.filter.filter();
    let store = db.read()?;
    let limit = args.limit.or((!console.json).then_some(SHOWN));
    let materials = match (&store, limit) {
        (None, _) => Vec::new(),
        (Some(store), Some(most)) => store.page(&filter, most)?,
        (Some(store), None) => store.find(&filter)?,
    };
    if console.json {
        return console.result("", &materials);
    }
    let built_in = builtin_not_added(store.as_ref())?;
    let mut text = match (materials.len(), &store) {
        (0, None) => format!("no material in {} yet\n", db.path().display()),
        (0, _) if filter == Filter::default() => {
            format!("no material in {} yet\n", db.path().display())
        }
        (0, Some(store)) => {
            format!(
                "no such material in {}{}\n",
                db.path().display(),
                others(&filter, store, &built_in)?
            )
        }
        _ => table(
            &["material", "rev", "kind", "class", "curves", "points", "fits", "name"],
            materials.iter().zip(kinds(store.as_ref(), &materials)?).map(row),
        ),
    };
    let most = MOST_COUNTED.saturating_add(limit.unwrap_or_default());
    let all = store.as_ref().map_or(Ok(0), |store| store.count(&filter, most))?;
    if all > materials.len() {
        let more = grouped(all - materials.len());
        let more = if all as u64 == u64::from(most) { format!("at least {more}") } else { more };
        text += &format!(
            "… and {more} more; narrow with --class, --tag, --kind or --frequency, or see more with \
             --limit\n",
        );
    }
    let wanted = built_in.iter().filter(|material| filter.lets_through(material));
    let names: Vec<&str> = wanted.map(|material| material.slug.as_str()).collect();
    if !names.is_empty() {
        text += &wrapped("built in, not added:", &names);
    }
    console.result(&text, &materials)
}

/// Which classes or tags there are, where one is asked for that no material has.
fn others(filter: &Filter, store: &Store, built_in: &[Material]) -> Result<String, Error> {
    /// More tags than these are no help.
    const MOST_TAGS: usize = 100;
    let mut said = String::new();
    if let Some(class) = &filter.class {
        let built_in = built_in.iter().map(|material| material.class.clone());
        let there: BTreeSet<String> = store.classes()?.into_iter().chain(built_in).collect();
        if !there.contains(class) {
            said += &none_of(class, "class", there);
        }
    }
    if let Some(tag) = &filter.tag {
        let built_in = built_in.iter().flat_map(|material| material.tags.clone());
        let alone = Filter { tag: Some(tag.clone()), ..Filter::default() };
        if store.count(&alone, 1)? == 0 && !built_in.clone().any(|known| known == *tag) {
            let there = store.tags(MOST_TAGS)?.into_iter().chain(built_in);
            said += &none_of(tag, "tag", there.collect());
        }
    }
    Ok(said)
}

/// That no class or tag has a name, and which there are.
fn none_of(asked: &str, what: &str, there: BTreeSet<String>) -> String {
    let there = there.into_iter().collect::<Vec<_>>().join(", ");
    format!("; no {what} is called `{asked}`, there are: {there}")
}

/// Names after a title, on lines that a narrow terminal holds.
fn wrapped(title: &str, names: &[&str]) -> String {
    const WIDTH: usize = 80;
    let mut lines = vec![title.to_owned()];
    for (number, name) in names.iter().enumerate() {
        let comma = if number + 1 < names.len() { "," } else { "" };
        match lines.last_mut() {
            Some(line) if line.len() + name.len() + 2 <= WIDTH => {
                *line += &format!(" {name}{comma}")
            }
            _ => lines.push(format!("  {name}{comma}")),
        }
    }
    lines.join("\n") + "\n"
}

/// How what scenes render of each material came to be.
fn kinds(store: Option<&Store>, materials: &[Summary]) -> Result<Vec<String>, Error> {
    let mut kinds = Vec::new();
    for material in materials {
        let words = store.map_or(Ok(None), |store| store.rendered_words(&material.slug))?;
        kinds.push(words.unwrap_or_else(|| material.render_kind.as_str().to_owned()));
    }
    Ok(kinds)
}

fn row((m, kind): (&Summary, String)) -> [String; 8] {
    [
        m.slug.to_string(),
        m.revision.to_string(),
        with_status(&kind, &m.status),
        m.class.clone(),
        m.curves.to_string(),
        m.observations.to_string(),
        m.fits.to_string(),
        m.name.clone(),
    ]
}
