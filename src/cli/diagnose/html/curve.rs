//! `report.html` of a curve.

use super::page::{
    self, escaped, list, meanings, numbers, paragraph, quiet, section, table, words,
};
use crate::cli::diagnose::curve::{numbers as of_term, remains, sentence, source, verdict};
use crate::cli::diagnose::plots::Picture;
use crate::cli::diagnose::words::{fixed, plus_minus, value};
use crate::diagnose::curve::{CurveFound, CurveReport, Ranked, term};
use crate::error::Error;

/// The page of a diagnosis.
pub(in crate::cli::diagnose) fn report(
    report: &CurveReport,
    name: &str,
    picture: &Picture,
) -> Result<Vec<u8>, Error> {
    let found = match report.effects.as_slice() {
        [] => paragraph("No effect is supported on angles that took no part in its fit."),
        found => found.iter().map(article).collect(),
    };
    let unknown: Vec<String> = report.unexplained.iter().map(remains).collect();
    let left = match unknown.is_empty() {
        true => paragraph("Nothing that is tested for."),
        false => {
            paragraph(
                "The residuals still go with what stands below. No effect that was tried explains it, \
                 so it gets no name.",
            ) + &list(&unknown)
        }
    };
    let html = format!(
        "<header>\n<p class=\"quiet\">Diagnosis of the curve {}</p>\n<h1>{}</h1>\n\
         <p class=\"verdict\">{}.</p>\n</header>\n",
        escaped(name),
        escaped(verdict(report)),
        escaped(&sentence(report))
    ) + &section("What was found", &found)
        + &section("Error before and after", &errors(report))
        + &section("Picture", &page::figure(picture)?)
        + &section("What remains", &left)
        + &section("What was tried", &tried(&report.ranking))
        + &section("The base law", &base(report));
    Ok(page::page(&format!("{name}: {}", verdict(report)), &html).into_bytes())
}

/// The page when nothing can be said.
pub(in crate::cli::diagnose) fn cannot_tell(name: &str, reason: &str, would_help: &str) -> Vec<u8> {
    let html = format!(
        "<header>\n<p class=\"quiet\">Diagnosis of the curve {}</p>\n<h1>Cannot tell</h1>\n</header>\n",
        escaped(name)
    ) + &section("Why", &paragraph(reason))
        + &section("What would help", &paragraph(would_help));
    page::page("Cannot tell", &html).into_bytes()
}

fn article(found: &CurveFound) -> String {
    let [is, shows] = term(found.name).map_or(["", ""], |term| [term.is(), term.shows()]);
    let evidence = &found.evidence;
    let mut facts = vec![
        of_term(found),
        format!(
            "Held-out angles are predicted better with it: ln p rises by {}.",
            plus_minus(evidence.held_out_gain, evidence.held_out_se)
        ),
        format!("It changes the levels by {:.2} dB (root mean square).", evidence.size_db),
    ];
    let others: Vec<&str> =
        found.class.iter().copied().filter(|name| *name != found.name).collect();
    if !others.is_empty() {
        facts.push(format!("This curve cannot tell it from {}.", others.join(", ")));
    }
    format!(
        "<article>\n<h3><code>{}</code></h3>\n{}{}{}</article>\n",
        escaped(found.name),
        paragraph(is),
        list(&facts),
        meanings(&[("How it shows, and what tells it from its neighbours", shows)])
    )
}

fn errors(report: &CurveReport) -> String {
    let error = &report.error;
    let row = |name: &str, errors: &crate::diagnose::curve::CurveErrors| {
        [
            name.to_owned(),
            fixed(errors.rmse_db, 2),
            fixed(errors.bias_db, 2),
            fixed(errors.log_score, 3),
        ]
    };
    let rows = [row("before", &error.before), row("after", &error.after)];
    let columns =
        [words("law"), numbers("rms, dB"), numbers("mean, dB"), numbers("ln p per level")];
    let how = format!(
        "Every level is predicted by a fit that it took no part in: {} runs of {:.1}°, dealt out to {} \
         folds. The noise of a level is {:.2} dB, {}.",
        error.blocks,
        error.block_deg,
        error.folds,
        error.noise_floor_db,
        source(error.noise_source)
    );
    paragraph(&how) + &table("Errors on held-out angles", columns, &rows)
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
    table("Every effect of every round", columns, &rows)
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
