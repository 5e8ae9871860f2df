//! `matdb effects`.

use serde::Serialize;

use super::console::Console;
use super::summary::table;
use crate::effects::{Effect, Knob, Level, find, library};
use crate::error::Error;
use crate::formats::text::nearest;
use crate::units::shown;

/// List the physical effects that `diagnose` tries, or explain one
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb effects
  matdb effects drift
  matdb effects --json | jq '.[].name'")]
pub(super) struct Args {
    /// The effect to explain
    name: Option<String>,
}

/// An effect as a script reads it.
#[derive(Serialize)]
struct Record {
    name: &'static str,
    level: Level,
    is: &'static str,
    shows: &'static str,
    parameters: &'static [Knob],
}

/// What has no name, as a script reads it.
#[derive(Serialize)]
struct Unknown {
    name: &'static str,
    is: &'static str,
    shows: &'static str,
}

const UNKNOWN: Unknown = Unknown {
    name: "unknown",
    is: "What no effect in this list does to the data: a smooth term over all covariates and the target \
         plane, beside the law and the effects that were found, which names nothing.",
    shows: "The verdict is `unexplained`; `unexplained` in report.json says with which covariates it goes \
            and how large it is, the picture unknown-map shows where, and residuals.csv has it chirp by \
            chirp as unknown_db. It is never stored and never rendered.",
};

impl Record {
    fn new(effect: &dyn Effect) -> Record {
        Record {
            name: effect.name(),
            level: effect.level(),
            is: effect.is(),
            shows: effect.shows(),
            parameters: effect.knobs(),
        }
    }
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    match &args.name {
        Some(name) if name == UNKNOWN.name => console.result(&unknown(), &UNKNOWN),
        Some(name) => {
            let record = Record::new(known(name)?);
            console.result(&entry(&record), &record)
        }
        None => {
            let records = library().map(Record::new);
            console.result(&list(&records), &records)
        }
    }
}

/// The effects of these names; all of them without any.
pub(super) fn chosen(names: &[String]) -> Result<Vec<&'static dyn Effect>, Error> {
    if names.is_empty() {
        return Ok(library().to_vec());
    }
    let mut chosen: Vec<&'static dyn Effect> = Vec::new();
    for name in names {
        let effect = known(name)?;
        if chosen.iter().all(|other| other.name() != effect.name()) {
            chosen.push(effect);
        }
    }
    Ok(chosen)
}

fn known(name: &str) -> Result<&'static dyn Effect, Error> {
    find(name).ok_or_else(|| {
        if name == UNKNOWN.name {
            let problem = "`unknown` is no effect to try".to_owned();
            let way_out = "leave it out: what no effect explains is always looked for".to_owned();
            return Error::Usage { problem, way_out };
        }
        let way_out = match nearest(name, library().map(|effect| effect.name())) {
            Some(near) => format!("did you mean `{near}`?"),
            None => "`matdb effects` lists them".to_owned(),
        };
        Error::Usage { problem: format!("there is no effect `{name}`"), way_out }
    })
}

/// Where an effect belongs, in a word.
pub(super) fn level(level: Level) -> &'static str {
    match level {
        Level::Instrument => "instrument",
        Level::Material => "material",
        Level::Scene => "scene",
    }
}

fn list(records: &[Record]) -> String {
    let row = |record: &Record| {
        let names: Vec<&str> = record.parameters.iter().map(|knob| knob.name).collect();
        let parameters = match names.as_slice() {
            [first, .., last] if names.len() > 3 => format!("{first} … {last}"),
            few => few.join(", "),
        };
        let level = level(record.level).to_owned();
        [record.name.to_owned(), level, parameters, short(record.is).to_owned()]
    };
    table(&["effect", "level", "parameters", "what it is"], records.iter().map(row))
        + "`matdb effects NAME` says how one shows, and what its numbers are; `unknown` is what none of \
           them explains\n"
}

fn unknown() -> String {
    let Unknown { name, is, shows } = UNKNOWN;
    format!("{name}\n{is}\n\nHow it shows: {shows}\n")
}

/// A sentence up to where it goes into detail.
fn short(sentence: &'static str) -> &'static str {
    const LONG: usize = 80;
    let first = |text: &'static str, ends: &[&str]| {
        let end = ends.iter().filter_map(|end| text.find(end)).min().unwrap_or(text.len());
        text.get(..end).unwrap_or(text).trim_end_matches('.')
    };
    match first(sentence, &[":", ";", ". "]) {
        long if long.len() > LONG => first(long, &[", "]),
        short => short,
    }
}

fn entry(record: &Record) -> String {
    let rows = record.parameters.iter().map(|knob| {
        [
            knob.name.to_owned(),
            unit(knob.unit).to_owned(),
            shown(knob.min),
            shown(knob.max),
            shown(knob.absent),
        ]
    });
    let parameters = table(&["parameter", "unit", "from", "to", "absent or start"], rows);
    let Record { name, is, shows, .. } = record;
    format!("{name} ({})\n{is}\n\nHow it shows: {shows}\n\n{parameters}", level(record.level))
}

/// A UCUM code as people write the unit.
pub(super) fn unit(code: &str) -> &str {
    match code {
        "deg" => "°",
        "dB[mW]" => "dBm",
        other => other,
    }
}
