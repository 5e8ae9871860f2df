//! `report.html`: the whole diagnosis for a person who has not read the docs.

pub(super) mod curve;
mod effect;
mod evidence;
mod page;

use super::cannot_tell::CannotTell;
use super::plots::Picture;
use super::words::{self, sentence, verdict};
use super::{Context, typed};
use crate::cli::summary::grouped;
use crate::diagnose::{Report, Verdict};
use crate::error::Error;
use page::{commands, escaped, meanings, paragraph, quiet, section};

/// The page of a diagnosis.
pub(super) fn report(
    report: &Report,
    context: &Context,
    pictures: &[Picture],
) -> Result<Vec<u8>, Error> {
    let mut html = heading(report, context);
    html += &found(report);
    html += &section("Error before and after", &evidence::errors(report));
    html += &section("Pictures", &figures(pictures)?);
    html += &section("What remains", &evidence::unexplained(&report.unexplained, &context.places));
    let controls = evidence::controls(&report.controls);
    if !controls.is_empty() {
        html += &section("Controls", &controls);
    }
    html += &section(
        "Tried and not supported",
        &(evidence::tried(report) + &evidence::not_tried(&context.not_tried)),
    );
    html += &section("The base model", &evidence::base(&report.base, context));
    html += &section("How to go on", &way_on(report, context));
    html += &section("Words", &meanings(&WORDS));
    let title = format!("{}: {}", context.scene, verdict(report.verdict));
    Ok(page::page(&title, &html).into_bytes())
}

/// The page when nothing can be said of something.
pub(super) fn cannot_tell(answer: &CannotTell, of: &str) -> Vec<u8> {
    let html = format!(
        "<header>\n<p class=\"quiet\">Diagnosis of {}</p>\n<h1>Cannot tell</h1>\n</header>\n",
        escaped(of)
    );
    let html = html
        + "<p class=\"verdict\">These data do not allow an answer. That is no answer either: an \
           effect may be missing or not.</p>\n"
        + &section("Why", &paragraph(&answer.reason))
        + &section("What would help", &paragraph(&answer.would_help));
    page::page("Cannot tell", &html).into_bytes()
}

fn heading(report: &Report, context: &Context) -> String {
    let detected = report.rows.iter().filter(|row| row.observed_dbm.is_some()).count();
    let facts = format!(
        "{} chirps meet the target, {} of them were detected; {} detections that lie elsewhere were \
         set aside. Everything random follows seed {}.",
        grouped(report.rows.len()),
        grouped(detected),
        grouped(report.set_aside),
        context.seed
    );
    format!(
        "<header>\n<p class=\"quiet\">{}: diagnosis of {} with {}</p>\n<h1>{}</h1>\n\
         <p class=\"verdict\">{}</p>\n</header>\n",
        escaped(&context.scene),
        escaped(&context.cloud_path),
        escaped(&context.scene_path),
        words::heading(report.verdict, report.effects.len()),
        escaped(&sentence(report))
    ) + &quiet(&facts)
        + &context.beyond.iter().map(|sentence| paragraph(sentence)).collect::<String>()
}

fn found(report: &Report) -> String {
    let html = match report.effects.as_slice() {
        [] => paragraph(
            "No effect is supported. An effect is only added when it predicts parts of the scan that \
             took no part in its fit, by more than two standard errors (one in a small place, if the gain is \
             far beyond chance), gains more than a placebo, and changes the data by a size that counts.",
        ),
        found => found.iter().map(effect::of_cloud).collect(),
    };
    section("What was found", &html)
}

fn figures(pictures: &[Picture]) -> Result<String, Error> {
    pictures.iter().map(page::figure).collect()
}

fn way_on(report: &Report, context: &Context) -> String {
    match (report.verdict, report.effects.is_empty()) {
        (Verdict::NoMissingEffect, _) => paragraph(
            "There is nothing to add. Whether a weak effect could hide in these data is a question of \
             their number: more chirps, more looks of speckle or a second target show weaker ones.",
        ),
        (_, false) => {
            let more = match report.verdict {
                Verdict::Unexplained => paragraph(
                    "For what is still unknown, see where it is on the maps, and in residuals.csv \
                     chirp by chirp.",
                ),
                _ => String::new(),
            };
            way_to_render(context) + &more
        }
        (_, true) => paragraph(
            "See where it is on the maps, and in residuals.csv chirp by chirp. Check first what the \
             scene declares: mesh, pose, materials of the regions, threshold and speckle. A second \
             scan with the target moved or turned tells what stays with the radar from what goes with \
             the target.",
        ),
    }
}

/// How to render with what was found.
fn way_to_render(context: &Context) -> String {
    let Context { program, command, after, beside, folder, added, material_files, .. } = context;
    let render = |scene: &str| format!("{program} render {scene} -o rendered");
    if context.is_added {
        let what = match added.as_slice() {
            [] => "What was found is stored. Render the scene that has it:".to_owned(),
            names => format!("{} stored. Render the scene that has what was found:", are(names)),
        };
        return paragraph(&what) + &commands(&render(beside));
    }
    let stored = paragraph("Store what was found, and render the scene that has it:")
        + &commands(&format!("{command} --add\n{}", render(beside)));
    let froms = material_files.iter().map(|name| format!(" --from {}", typed(&folder.join(name))));
    let froms: String = froms.collect();
    let add = if froms.is_empty() { String::new() } else { format!("{program} add{froms}\n") };
    stored
        + &paragraph("Or leave the materials as they are, and render what stands beside this page:")
        + &commands(&format!("{add}{}", render(after)))
}

fn are(names: &[String]) -> String {
    format!("{} {}", names.join(", "), if names.len() == 1 { "is" } else { "are" })
}

const SUPPORTED: &str = "Better than the model without it, on what was held out, by more than chance. A comparison of models, not a proof.";
const LN_P: &str = "Logarithm of the probability that a model gave to what was measured. 8 more is a factor of 3000.";

const WORDS: [(&str, &str); 6] = [
    (
        "Held out",
        "Predicted by a fit that had not seen it. Patches of the target are held out together, because neighbouring spots overlap.",
    ),
    ("Supported", SUPPORTED),
    ("ln p, ln likelihood", LN_P),
    (
        "Noise floor",
        "The error that speckle and noise leave to a model that is right. Nothing honest gets below it.",
    ),
    (
        "z",
        "Quantile residual: the place of a measured power within its law, as a normal number. Standard normal if the model is right.",
    ),
    (
        "Placebo",
        "A random smooth field without meaning, with as many numbers as an effect, but at most six.",
    ),
];
