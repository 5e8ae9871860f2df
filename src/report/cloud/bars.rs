//! Bars: what every effect gained, and the error before and after.

use super::models::shown;
use crate::diagnose::{Candidate, Report};
use crate::formats::figure::{Bar, Bars, FigureError, Ink};
use crate::formats::words::{fixed, plus_minus};
use crate::report::picture::Picture;

/// Gain in ln likelihood of every candidate of the first round.
pub(super) fn ranking(report: &Report) -> Result<Picture, FigureError> {
    let mut first: Vec<&Candidate> = report.ranking.iter().filter(|c| c.round == 1).collect();
    first.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let mut bars = Vec::new();
    for candidate in &first {
        bars.push(Bar {
            name: candidate.name,
            value: if candidate.gain.is_finite() { candidate.gain } else { 0.0 },
            note: note(candidate, &report.ranking),
            ink: report
                .effects
                .iter()
                .any(|found| found.name == candidate.name)
                .then_some(Ink::After),
        });
    }
    let placebos = first.iter().filter_map(|c| c.placebo_gain).filter(|gain| gain.is_finite());
    let guide = placebos.reduce(f64::max).map(|gain| (gain.max(0.0), "placebo"));
    let bars = Bars {
        title: "Which effect would help",
        subtitle: "each tried alone beside the base",
        label: "gain in ln likelihood over the base model",
        bars,
        guide,
    };
    let added = if report.effects.is_empty() { "" } else { " Green ones were added in the end." };
    let placebo = match guide {
        Some(_) => {
            " The line is the gain of a random smooth field with as many parameters as the effect (six at most); the \
             largest where they differ."
        }
        None => "",
    };
    // Without any candidate there is nothing to draw and nothing wrong.
    let panels = if first.is_empty() { Vec::new() } else { vec![bars.drawing()?] };
    Ok(Picture {
        file: "ranking",
        title: "What every effect gained",
        caption: "Gain in ln likelihood when one effect is fitted with the base model (round 1); those that promise \
                  little are fitted to a sample of the chirps at most, and their gain is counted up from there. A large \
                  gain alone does not add an effect: it must also predict patches of the scan that took no part in its \
                  fit. “Held out” is that gain ± its standard error, only worked out for the best few."
            .to_owned()
            + added
            + placebo,
        panels,
        columns: 1,
    })
}

/// What stands beside a bar: its gain, that on held-out patches, and the round in which it was added if later.
fn note(candidate: &Candidate, ranking: &[Candidate]) -> String {
    let decimals = if candidate.gain.abs() < 10.0 { 1 } else { 0 };
    let mut note = fixed(candidate.gain, decimals);
    if let Some([gain, se]) = candidate.held_out {
        note += &format!(", held out {}", plus_minus(gain, se));
    }
    let accepted = ranking.iter().find(|other| other.accepted && other.name == candidate.name);
    if let Some(accepted) = accepted.filter(|accepted| accepted.round > 1) {
        note += &format!(", added in round {}", accepted.round);
    }
    note
}

/// Root mean square error before and after, against the noise floor.
pub(super) fn error(report: &Report) -> Result<Picture, FigureError> {
    let error = &report.error;
    let (before, title) = if report.effects.is_empty() {
        ("base model", "Error and noise floor")
    } else {
        ("before: base model", "Error before and after")
    };
    let floor = format!("noise floor {:.2} dB", error.noise_floor_db);
    let bars = Bars {
        title: "Error on parts of the scan that were not fitted",
        subtitle: "",
        label: "rms of observed − predicted, dB",
        bars: shown(
            report,
            [
                error_bar(before, error.before.rmse_db, Ink::Before),
                error_bar("after: with the effects", error.after.rmse_db, Ink::After),
            ],
        ),
        guide: Some((error.noise_floor_db, &floor)),
    };
    Ok(Picture {
        file: "error",
        title,
        caption: format!(
            "Root mean square of observed − predicted power over held-out detections. The noise floor of \
             {:.2} dB is what speckle and noise leave to a model that is right.",
            error.noise_floor_db
        ),
        panels: vec![bars.drawing()?],
        columns: 1,
    })
}

fn error_bar(name: &'static str, rmse_db: f64, ink: Ink) -> Bar<'static> {
    Bar { name, value: rmse_db, note: format!("{rmse_db:.2} dB"), ink: Some(ink) }
}
