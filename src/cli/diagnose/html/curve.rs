//! `report.html` of a curve.

use super::evidence::{no_share, not_tried, share};
use super::page::{self, escaped, meanings, numbers, paragraph, quiet, section, table, words};
use super::{LN_P, SUPPORTED, effect};
use crate::cli::diagnose::curve::Told;
use crate::cli::diagnose::curve::words::{advice, angle, sentence, source};
use crate::cli::diagnose::plots::Picture;
use crate::cli::diagnose::words::{
    digits, fixed, heading, plus_minus, probability, signed, value, verdict,
};
use crate::cli::summary::{counted, grouped};
use crate::diagnose::Verdict;
use crate::diagnose::curve::{CurveReport, CurveUnknown, Kind, Ranked};
use crate::error::Error;

/// The page of a diagnosis.
pub(in crate::cli::diagnose) fn report(told: Told, picture: &Picture) -> Result<Vec<u8>, Error> {
    let Told { report, name, .. } = told;
    let found = match report.effects.as_slice() {
        [] => paragraph(
            "No effect is supported. An effect is only added when it predicts runs of angles that took \
             no part in its fit, by more than two standard errors, and changes the levels by a size that \
             counts.",
        ),
        found => found.iter().map(effect::of_curve).collect(),
    };
    let html = head(told)
        + &section("What was found", &found)
        + &section("Error before and after", &errors(report))
        + &section("Picture", &page::figure(picture)?)
        + &section("What remains", &unexplained(&report.unexplained))
        + &section("What was tried", &(tried(&report.ranking) + &not_tried(told.not_tried)))
        + &section("The base law", &base(report))
        + &section("How to go on", &way_on(told))
        + &section("Words", &meanings(&WORDS));
    Ok(page::page(&format!("{name}: {}", verdict(report.verdict)), &html).into_bytes())
}

fn head(told: Told) -> String {
    let Told { report, name, model, seed, .. } = told;
    let facts = &report.curve;
    let over = match facts.kind {
        Kind::Backscatter => "of backscatter".to_owned(),
        Kind::InPlane => {
            format!("in the plane of incidence, at {} of incidence", counted(facts.scans, "angle"))
        }
    };
    let facts = format!(
        "{} levels {over}, {} of them not detected. The law: {}. Everything random follows seed {seed}.",
        grouped(facts.points),
        grouped(facts.censored),
        model.unwrap_or("one GGX lobe over Lambert"),
    );
    format!(
        "<header>\n<p class=\"quiet\">Diagnosis of the curve {}</p>\n<h1>{}</h1>\n\
         <p class=\"verdict\">{}</p>\n</header>\n",
        escaped(name),
        heading(report.verdict, report.effects.len()),
        escaped(&sentence_of(&sentence(report)))
    ) + &quiet(&facts)
}

fn errors(report: &CurveReport) -> String {
    let error = &report.error;
    let (before, after) = (&error.before, &error.after);
    let row = |name: &str, [before, after, right]: [String; 3], meaning: &str| {
        [name.to_owned(), before, after, right, meaning.to_owned()]
    };
    let rows = [
        row(
            "rms error, dB",
            [before.rmse_db, after.rmse_db, error.noise_floor_db].map(|db| fixed(db, 2)),
            "Root mean square of measured − predicted levels over the detections. The last column is the \
             noise of a level.",
        ),
        row(
            "mean error, dB",
            [signed(before.bias_db, 2), signed(after.bias_db, 2), "0".to_owned()],
            "Measured − predicted, in the mean.",
        ),
        row(
            "ln p per level",
            [fixed(before.log_score, 3), fixed(after.log_score, 3), "–".to_owned()],
            "How probable the law called what was measured, levels below a threshold included. More is \
             better.",
        ),
    ];
    let columns = [
        words("what"),
        numbers("before"),
        numbers("after"),
        numbers("a law that is right"),
        words("what it means"),
    ];
    let how = format!(
        "Every level is predicted by a fit that it took no part in: the angles make {} runs of {}°, dealt \
         out to {} folds, the same before and after. Residuals go together over {}°. Before is the base \
         law, refitted to the curve. The noise of a level is {}.",
        error.blocks,
        digits(error.block_deg),
        error.folds,
        digits(error.correlation_deg),
        source(error.noise_source)
    );
    let gone = match (report.effects.is_empty(), error.explained_share) {
        (true, _) => "Nothing was added, so that before and after are the same.".to_owned(),
        (false, Some(gone)) => share(gone),
        (false, None) => no_share("law", "at few angles, which the picture shows"),
    };
    paragraph(&how) + &table("Errors on held-out angles", columns, &rows) + &paragraph(&gone)
}

fn unexplained(found: &[CurveUnknown]) -> String {
    if found.is_empty() {
        return paragraph(
            "Nothing that is tested for: the residuals go with no angle, and neighbouring ones err to the \
             same side no more than by chance.",
        );
    }
    let dash = || "–".to_owned();
    let row = |one: &CurveUnknown| {
        let gain = one.held_out_gain.zip(one.held_out_se);
        [
            angle(one.covariate).to_owned(),
            format!("{:.2}", one.strength_db),
            probability(one.p_value),
            gain.map_or_else(dash, |(gain, se)| plus_minus(gain, se)),
            one.held_out_rmse_db.map_or_else(dash, |db| format!("{db:.2}")),
        ]
    };
    let rows: Vec<[String; 5]> = found.iter().map(row).collect();
    let columns = [
        words("goes with"),
        numbers("strength, dB"),
        numbers("by chance"),
        numbers("held-out gain in ln p"),
        numbers("rms error with it, dB"),
    ];
    paragraph(
        "The residuals still go with what stands below. No effect that was tried explains it, so it gets no \
         name.",
    ) + &table("Structure in what remains", columns, &rows)
        + &quiet(
            "Strength: root mean square over the levels. The gain is that of a smooth curve over the angle.",
        )
}

fn tried(ranking: &[Ranked]) -> String {
    let row = |one: &Ranked| {
        [
            one.name.to_owned(),
            one.round.to_string(),
            fixed(one.gain, 1),
            one.held_out.map_or("–".to_owned(), |[gain, se]| plus_minus(gain, se)),
            format!("{:.2}", one.size_db),
            if one.accepted { "added" } else { "" }.to_owned(),
        ]
    };
    let columns = [
        words("effect"),
        numbers("round"),
        numbers("gain in ln likelihood"),
        numbers("held-out gain in ln p"),
        numbers("size, dB"),
        words(""),
    ];
    let rows: Vec<[String; 6]> = ranking.iter().map(row).collect();
    paragraph(
        "Each was tried together with what had been found by its round. That an effect is not supported \
         does not say that it is absent: it may be too weak for these data. Only the best few are judged \
         on held-out angles.",
    ) + &table("Every effect of every round", columns, &rows)
}

fn base(report: &CurveReport) -> String {
    let rows: Vec<[String; 2]> = report
        .base
        .parameters
        .iter()
        .map(|number| [number.name.clone(), value(&number.value)])
        .collect();
    table("Its numbers, fitted with what was added", [words("number"), numbers("fitted")], &rows)
        + &quiet(match report.base.converged {
            true => "The final fit converged.",
            false => "The final fit did not converge: take the numbers with care.",
        })
}

fn way_on(told: Told) -> String {
    let general = match (told.report.verdict, told.report.effects.is_empty()) {
        (Verdict::NoMissingEffect, _) => {
            "There is nothing to add. A weak effect may hide in the noise: repeats and more angles show weaker ones."
        }
        (_, false) => {
            "The verdict is about the law that the curve was held against: another one (--model) may \
             need no effect. A curve belongs to no material, so nothing was stored."
        }
        (_, true) => {
            "See at which angles it is in the picture, and in residuals.csv level by level. Try another law \
             with --model, and measure again: what comes back is no noise."
        }
    };
    paragraph(general)
        + &advice(told).map_or(String::new(), |advice| paragraph(&sentence_of(&advice)))
}

/// Words as a sentence of its own.
fn sentence_of(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).chain(['.']).collect()
}

const WORDS: [(&str, &str); 4] = [
    (
        "Held out",
        "Predicted by a fit that had not seen it. Runs of neighbouring angles are held out together, because their errors go together.",
    ),
    ("Supported", SUPPORTED),
    ("ln p, ln likelihood", LN_P),
    ("Noise", "What repeats of one level scatter by. A law that is right errs by so much."),
];
