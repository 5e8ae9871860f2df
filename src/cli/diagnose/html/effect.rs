//! What was found, effect by effect.

use super::page::{escaped, list, meanings, numbers, paragraph, quiet, table, words};
use crate::cli::diagnose::curve::words::numbers as of_term;
use crate::cli::diagnose::words::{
    belongs, digits, fixed, in_unit, listed, numbers as of_effect, others, plus_minus, told,
};
use crate::diagnose::curve::{CurveEvidence, CurveFound, term};
use crate::diagnose::{Evidence, Found};
use crate::effects::{EffectParameter, Level, Place, find};

/// An effect as the page shows it: what it is, its numbers, why it was added, what it could be instead.
struct Article<'a> {
    name: &'a str,
    level: Level,
    /// What it is, and how it shows; nothing where no library has it.
    words: Option<[&'static str; 2]>,
    knobs: &'static [EffectParameter],
    numbers: Vec<[String; 2]>,
    /// A word on its place.
    place: String,
    evidence: Vec<String>,
    /// What predicts the data as well, and how that shows.
    others: Vec<(&'static str, &'static str)>,
    /// Why it is named and none of these.
    named_first: &'static str,
}

/// An effect of a cloud.
pub(super) fn of_cloud(found: &Found) -> String {
    let effect = find(found.name);
    let shows = |name: &'static str| (name, find(name).map_or("", |effect| effect.signature()));
    let place = match found.place {
        Some(Place::Beyond { .. }) => quiet(
            "centre_m is the middle and extent_m the size of the box around the part of the target that it covers, \
             along the global axes of the scene; its border is a line on the maps, where it crosses them.",
        ),
        Some(Place::Round { .. }) => quiet(
            "centre_m is the point of the target where its centre lies, in the global frame of the \
             scene; centre_x_m and centre_y_m are its place in the target plane, as on the maps.",
        ),
        None => told(found).map_or(String::new(), |words| quiet(&format!("Together: {words}."))),
    };
    let Evidence { gain, placebo_gain, held_out_gain, held_out_se, size_db } = &found.evidence;
    Article {
        name: found.name,
        level: found.level,
        words: effect.map(|effect| [effect.description(), effect.signature()]),
        knobs: effect.map_or(&[], |effect| effect.parameters()),
        numbers: of_effect(&found.parameters),
        place,
        evidence: vec![
            held_out("Parts of the scan", *held_out_gain, *held_out_se),
            format!(
                "In the fit itself it gains {} in ln likelihood; as many numbers, but at most six, that mean nothing \
                 gain {}.",
                fixed(*gain, 1),
                fixed(*placebo_gain, 1)
            ),
            format!(
                "It changes the data by {size_db:.2} dB (root mean square of the mean power, or of the \
                 spread)."
            ),
        ],
        others: others(&found.class, found.name).into_iter().map(shows).collect(),
        named_first: "the simplest of them or, where others are as simple, the likelier",
    }
    .html()
}

/// An effect of a curve.
pub(super) fn of_curve(found: &CurveFound) -> String {
    let effect = term(found.name);
    let shows = |name: &'static str| (name, term(name).map_or("", |term| term.signature()));
    let CurveEvidence { gain, held_out_gain, held_out_se, size_db } = &found.evidence;
    Article {
        name: found.name,
        level: found.level,
        words: effect.map(|effect| [effect.description(), effect.signature()]),
        knobs: effect.map_or(&[], |effect| effect.parameters()),
        numbers: of_term(found),
        place: String::new(),
        evidence: vec![
            held_out("Runs of angles", *held_out_gain, *held_out_se),
            format!("In the fit itself it gains {} in ln likelihood.", fixed(*gain, 1)),
            format!("It changes the levels by {size_db:.2} dB (root mean square)."),
        ],
        others: others(&found.class, found.name).into_iter().map(shows).collect(),
        named_first: "the one that predicts held-out angles best",
    }
    .html()
}

impl Article<'_> {
    fn html(&self) -> String {
        let is = self.words.map_or(String::new(), |[is, _]| paragraph(is));
        let shows = self.words.map_or(String::new(), |[_, shows]| {
            meanings(&[("How it shows, and what tells it from its neighbours", shows)])
        });
        format!(
            "<article>\n<h3><code>{}</code> ({})</h3>\n{is}{}{}{}<h4>Why it is supported</h4>\n{}{}{shows}\
             </article>\n",
            escaped(self.name),
            self.level.as_str(),
            paragraph(belongs(self.level)),
            self.parameters(),
            self.place,
            list(&self.evidence),
            self.class(),
        )
    }

    fn parameters(&self) -> String {
        let absent = |name: &str| {
            let knob = self.knobs.iter().find(|knob| knob.name == name);
            knob.map_or("–".to_owned(), |knob| in_unit(digits(knob.absent), knob.unit))
        };
        let row = |[name, number]: &[String; 2]| [name.clone(), number.clone(), absent(name)];
        let rows: Vec<[String; 3]> = self.numbers.iter().map(row).collect();
        table(
            "Its numbers ± standard deviation, fitted together with everything else",
            [words("number"), numbers("found"), numbers("means absent, or starts the search")],
            &rows,
        )
    }

    /// What it cannot be told from.
    fn class(&self) -> String {
        if self.others.is_empty() {
            return paragraph("No other effect that was tried predicts these data as well.");
        }
        let names: Vec<&str> = self.others.iter().map(|(name, _)| *name).collect();
        let text = format!(
            "These data cannot tell it from {}, which would predict them as well; it is named first \
             because it is {}. What would tell them apart:",
            listed(&names),
            self.named_first
        );
        paragraph(&text) + &meanings(&self.others)
    }
}

/// What a held-out gain says of parts that were not fitted.
fn held_out(parts: &str, gain: f64, se: f64) -> String {
    let errors = match se > 0.0 {
        true => format!(", {:.1} standard errors above nothing", gain / se),
        false => String::new(),
    };
    format!(
        "{parts} that took no part in the fit are predicted better with it: ln p rises by {}{errors}.",
        plus_minus(gain, se)
    )
}
