//! An effect that was found, as a page shows it.

use serde::Serialize;

use super::words::{belongs, numbers, others, summary, value};
use crate::diagnose::curve::{CurveEvidence, FoundTerm, term};
use crate::diagnose::{Evidence, FoundEffect};
use crate::effects::{EffectParameter, Level, Place, find};
use crate::formats::words::{digits, in_unit};

const ROUND_PLACE: &str = "centre_m is the point of the target where its centre lies, in the global frame of the \
    scene; centre_x_m and centre_y_m are its place in the target plane, as on the maps.";
const BOUNDED_PLACE: &str = "centre_m is the middle and extent_m the size of the box around the part of the target that \
    it covers, along the global axes of the scene; its border is a line on the maps, where it crosses them.";

/// An effect: what it is, its numbers, why it was added, what it could be instead.
#[derive(Serialize)]
pub(super) struct Article<'a, Evidence> {
    name: &'static str,
    level: Level,
    /// Where it belongs, in a sentence.
    belongs: &'static str,
    /// None of an effect that the library does not have.
    description: Option<&'static str>,
    signature: Option<&'static str>,
    numbers: Vec<Number>,
    /// A sentence on its place, or on what its numbers mean together.
    note: Option<String>,
    evidence: &'a Evidence,
    /// What predicts the data as well.
    others: Vec<Other>,
}

/// A number of an effect.
#[derive(Serialize)]
struct Number {
    name: String,
    value: String,
    /// The value that means absent, or starts a search.
    absent: String,
}

/// An effect that predicts the data as well.
#[derive(Serialize)]
struct Other {
    name: &'static str,
    signature: &'static str,
}

/// An effect of a cloud.
pub(super) fn of_cloud(found: &FoundEffect) -> Article<'_, Evidence> {
    let effect = find(found.name);
    let mut rivals = Vec::new();
    for name in others(&found.class, found.name) {
        rivals.push(Other { name, signature: find(name).map_or("", |effect| effect.signature()) });
    }
    let note = match found.place {
        Some(Place::Round { .. }) => Some(ROUND_PLACE.to_owned()),
        Some(Place::Beyond { .. }) => Some(BOUNDED_PLACE.to_owned()),
        None => summary(found).map(|words| format!("Together: {words}.")),
    };
    let parameters = effect.map_or(&[][..], |effect| effect.parameters());
    Article {
        name: found.name,
        level: found.level,
        belongs: belongs(found.level),
        description: effect.map(|effect| effect.description()),
        signature: effect.map(|effect| effect.signature()),
        numbers: with_absent(numbers(&found.parameters), parameters),
        note,
        evidence: &found.evidence,
        others: rivals,
    }
}

/// An effect of a curve.
pub(super) fn of_curve(found: &FoundTerm) -> Article<'_, CurveEvidence> {
    let effect = term(found.name);
    let mut rivals = Vec::new();
    for name in others(&found.class, found.name) {
        rivals.push(Other { name, signature: term(name).map_or("", |term| term.signature()) });
    }
    let mut numbers = Vec::new();
    for (name, number) in &found.parameters {
        numbers.push([(*name).to_owned(), value(number)]);
    }
    Article {
        name: found.name,
        level: found.level,
        belongs: belongs(found.level),
        description: effect.map(|effect| effect.description()),
        signature: effect.map(|effect| effect.signature()),
        numbers: with_absent(numbers, effect.map_or(&[][..], |effect| effect.parameters())),
        note: None,
        evidence: &found.evidence,
        others: rivals,
    }
}

/// Numbers, given as name and value, with the values that mean absent.
fn with_absent(numbers: Vec<[String; 2]>, parameters: &[EffectParameter]) -> Vec<Number> {
    let mut rows = Vec::new();
    for [name, value] in numbers {
        let parameter = parameters.iter().find(|parameter| parameter.name == name);
        let absent = parameter.map_or("–".to_owned(), |parameter| {
            in_unit(digits(parameter.absent), parameter.unit)
        });
        rows.push(Number { name, value, absent });
    }
    rows
}
