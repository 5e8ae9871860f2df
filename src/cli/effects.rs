//! `matdb effects`.

use super::console::Console;
use super::summary::table;
use crate::diagnose::curve::term;
use crate::effects::{Effect, Level, find, library};
use crate::error::Error;
use crate::formats::text::nearest;
use crate::report::EffectHelp;
use crate::units::shown;

/// List the physical effects that `diagnose` tries, or explain one
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  matdb effects
  matdb effects drift
  matdb effects --json | jq '.[].name'")]
pub(super) struct Args {
    /// The effect to explain; `unknown` is what none explains
    name: Option<String>,
}

pub(super) fn run(args: &Args, console: &Console) -> Result<(), Error> {
    let all = EffectHelp::all();
    let Some(name) = &args.name else { return console.result(&list(&all), &all) };
    // A name can stand for an effect of a cloud and for another one of a curve.
    let of_name: Vec<&EffectHelp> = all.iter().filter(|record| record.name == name).collect();
    if of_name.is_empty() {
        return Err(stranger(name, all.iter().map(|record| record.name)));
    }
    let entries: Vec<String> = of_name.iter().map(|record| entry(record)).collect();
    console.result(&entries.join("\n"), &of_name)
}

/// The effects of these names; all of them without any.
pub(super) fn chosen(names: &[String]) -> Result<Vec<&'static dyn Effect>, Error> {
    if names.is_empty() {
        return Ok(library().to_vec());
    }
    let numbered = names.iter().enumerate();
    let each_once = numbered.filter(|(index, name)| !names[..*index].contains(name));
    each_once.map(|(_, name)| known(name)).collect()
}

fn known(name: &str) -> Result<&'static dyn Effect, Error> {
    find(name).ok_or_else(|| {
        if name == EffectHelp::UNKNOWN.name {
            return Error::usage("`unknown` is not an effect to try", "leave it out: what no effect explains is always looked for");
        }
        if term(name).is_some() {
            return Error::usage(format!("`{name}` is an effect of curves and not of clouds"), "give the curve with --curve, or name effects of clouds: `matdb effects` lists them");
        }
        stranger(name, library().map(|effect| effect.name()).into_iter())
    })
}

/// That no effect has this name, and which of the known ones may be meant.
fn stranger(name: &str, known: impl Iterator<Item = &'static str>) -> Error {
    let way_out = match nearest(name, known) {
        Some(near) => format!("did you mean `{near}`?"),
        None => "`matdb effects` lists them".to_owned(),
    };
    Error::usage(format!("there is no effect `{name}`"), way_out)
}

fn list(all: &[EffectHelp]) -> String {
    format!(
        "Of a scan, `matdb diagnose CLOUD`:\n{}\nOf a curve, `matdb diagnose --curve FILE`:\n{}\n\
         `matdb effects NAME` says what one is, how it shows, and what its numbers are; `unknown` is\n\
         what none of them explains.\n",
        list_of(all, "cloud"),
        list_of(all, "curve")
    )
}

/// The effects that are looked for in a cloud, or in a curve, one a line.
fn list_of(all: &[EffectHelp], what: &str) -> String {
    let records = all.iter().filter(|record| record.applies_to == [what]);
    let rows = records.map(|record| {
        let level = record.level.map_or("", Level::as_str).to_owned();
        [record.name.to_owned(), level, short(record.shows)]
    });
    table(&["effect", "level", "what it looks like"], rows)
}

/// The first sentence, or as many of its words as fit into a line of a hundred beside the longest name.
fn short(text: &str) -> String {
    const LONG: usize = 66;
    let sentence = text.split_once(". ").map_or(text, |(first, _)| first).trim_end_matches('.');
    if sentence.chars().count() <= LONG {
        return sentence.to_owned();
    }
    let mut words = String::new();
    for word in sentence.split(' ') {
        if words.chars().count() + word.chars().count() + 2 > LONG {
            break;
        }
        words = words + word + " ";
    }
    words + "…"
}

fn entry(record: &EffectHelp) -> String {
    let rows = record.parameters.iter().map(|parameter| {
        [
            parameter.name.to_owned(),
            unit(parameter.unit).to_owned(),
            shown(parameter.min),
            shown(parameter.max),
            shown(parameter.absent),
        ]
    });
    let parameters = match record.parameters {
        [] => String::new(),
        _ => {
            "\n".to_owned() + &table(&["parameter", "unit", "from", "to", "absent or start"], rows)
        }
    };
    let EffectHelp { name, applies_to, is, shows, .. } = record;
    let level = record.level.map_or(String::new(), |of| format!("{}, ", of.as_str()));
    let of = applies_to.join(" and of a ");
    format!("{name} ({level}of a {of})\n{is}\n\nHow it shows: {shows}\n{parameters}")
}

/// A UCUM code as people write the unit.
pub(super) fn unit(code: &str) -> &str {
    match code {
        "deg" => "°",
        "dB[mW]" => "dBm",
        other => other,
    }
}
