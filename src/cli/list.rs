//! `matdb list`.

use super::console::Console;
use super::curves::kind_of;
use super::summary::{grouped, table, with_status};
use crate::error::Error;
use crate::material::{Slug, SourceKind};
use crate::report::{MaterialList, MaterialRow, UnknownWord};
use crate::setup::Database;
use crate::store::{Filter, Summary};

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
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..), allow_negative_numbers = true)]
    limit: Option<u32>,
}

/// What a person still looks through.
const SHOWN: u32 = 200;

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
    let most = args.limit.unwrap_or(if console.json { u32::MAX } else { SHOWN });
    let list = MaterialList::new(&filter, most, store.as_ref())?;
    if console.json {
        let lines: Vec<&Summary> = list.rows.iter().map(|row| &row.summary).collect();
        return console.result("", &lines);
    }
    let is_any = store.is_none() || filter == Filter::default();
    console.result(&text(&list, is_any, &db.path().display().to_string()), &())
}

fn text(list: &MaterialList, is_any: bool, file: &str) -> String {
    let mut text = match list.rows.as_slice() {
        [] if is_any => format!("no material in {file} yet\n"),
        [] => {
            let unknown: String = list.unknown_words.iter().map(none_of).collect();
            format!("no such material in {file}{unknown}\n")
        }
        rows => table(
            &["material", "rev", "kind", "class", "curves", "points", "fits", "name"],
            rows.iter().map(row),
        ),
    };
    if list.more > 0 {
        let at_least = if list.more_at_least { "at least " } else { "" };
        text += &format!(
            "… and {at_least}{} more; narrow with --class, --tag, --kind or --frequency, or see more with \
             --limit\n",
            grouped(list.more)
        );
    }
    if !list.built_in.is_empty() {
        text += &wrapped("built in, not added:", &list.built_in);
    }
    text
}

/// That no class or tag has a name, and which there are.
fn none_of(UnknownWord { asked, what, known }: &UnknownWord) -> String {
    let known = known.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
    format!("; no {what} is called `{asked}`, there are: {known}")
}

/// Names after a title, on lines that a narrow terminal holds.
fn wrapped(title: &str, names: &[Slug]) -> String {
    const WIDTH: usize = 80;
    let mut lines = vec![title.to_owned()];
    for (number, name) in names.iter().enumerate() {
        let comma = if number + 1 < names.len() { "," } else { "" };
        match lines.last_mut() {
            Some(line) if line.len() + name.as_str().len() + 2 <= WIDTH => {
                *line += &format!(" {name}{comma}")
            }
            _ => lines.push(format!("  {name}{comma}")),
        }
    }
    lines.join("\n") + "\n"
}

fn row(MaterialRow { summary: m, kind }: &MaterialRow) -> [String; 8] {
    [
        m.slug.to_string(),
        m.revision.to_string(),
        // A damaged line may have any kind and status.
        if m.is_damaged { "damaged".to_owned() } else { with_status(kind, &m.status) },
        m.class.clone(),
        m.curves.to_string(),
        m.observations.to_string(),
        m.fits.to_string(),
        m.name.clone(),
    ]
}
