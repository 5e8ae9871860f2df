//! What was found, effect by effect.

use super::page::{escaped, list, meanings, numbers, paragraph, quiet, table, words};
use crate::cli::diagnose::words::{
    belongs, digits, fixed, in_unit, listed, numbers as of_effect, plus_minus,
};
use crate::cli::effects::level;
use crate::diagnose::{Evidence, Found};
use crate::effects::{Knob, find};

/// An effect: what it is, its numbers, why it was added, what it could be instead.
pub(super) fn article(found: &Found) -> String {
    let effect = find(found.name);
    let is = effect.map_or(String::new(), |effect| paragraph(effect.is()));
    let shows = effect.map_or(String::new(), |effect| {
        meanings(&[("How it shows, and what tells it from its neighbours", effect.shows())])
    });
    format!(
        "<article>\n<h3><code>{}</code> ({})</h3>\n{is}{}{}{}{}{shows}</article>\n",
        escaped(found.name),
        level(found.level),
        paragraph(belongs(found.level)),
        parameters(found, effect.map_or(&[], |effect| effect.knobs())),
        evidence(&found.evidence),
        class(found),
    )
}

fn parameters(found: &Found, knobs: &[Knob]) -> String {
    let absent = |name: &str| {
        let knob = knobs.iter().find(|knob| knob.name == name);
        knob.map_or("–".to_owned(), |knob| in_unit(digits(knob.absent), knob.unit))
    };
    let rows = of_effect(&found.parameters).into_iter().map(|[name, number]| {
        let absent = absent(&name);
        [name, number, absent]
    });
    let place = match found.parameters.triples.contains_key("centre_m") {
        true => quiet(
            "centre_m is the point of the target where its centre lies, in the global frame of the \
             scene; centre_x_m and centre_y_m are its place in the target plane, as on the maps.",
        ),
        false => String::new(),
    };
    let rows: Vec<[String; 3]> = rows.collect();
    table(
        "Its numbers ± standard deviation, fitted together with everything else",
        [words("number"), numbers("found"), numbers("means absent, or starts the search")],
        &rows,
    ) + &place
}

fn evidence(evidence: &Evidence) -> String {
    let Evidence { gain, placebo_gain, held_out_gain, held_out_se, size_db } = evidence;
    let errors = match *held_out_se > 0.0 {
        true => format!(", {:.1} standard errors above nothing", held_out_gain / held_out_se),
        false => String::new(),
    };
    let sentences = [
        format!(
            "Parts of the scan that took no part in the fit are predicted better with it: ln p rises by \
             {}{errors}.",
            plus_minus(*held_out_gain, *held_out_se)
        ),
        format!(
            "In the fit itself it gains {} in ln likelihood; as many numbers that mean nothing gain {} \
             at most.",
            fixed(*gain, 1),
            fixed(*placebo_gain, 1)
        ),
        format!(
            "It changes the data by {size_db:.2} dB (root mean square of the mean power, or of the spread)."
        ),
    ];
    "<h4>Why it is supported</h4>\n".to_owned() + &list(&sentences)
}

/// What it cannot be told from.
fn class(found: &Found) -> String {
    let others: Vec<&'static str> =
        found.class.iter().copied().filter(|name| *name != found.name).collect();
    if others.is_empty() {
        return paragraph("No other effect that was tried predicts these data as well.");
    }
    let meaning = |&name: &&'static str| (name, find(name).map_or("", |effect| effect.shows()));
    let meanings_of_others: Vec<(&str, &str)> = others.iter().map(meaning).collect();
    let text = format!(
        "These data cannot tell it from {}, which would predict them as well; it is named first because \
         it is the simplest of them or, where others are as simple, the likelier. What would tell them \
         apart:",
        listed(&others)
    );
    paragraph(&text) + &meanings(&meanings_of_others)
}
