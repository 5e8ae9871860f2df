//! Bars: what every effect gained, and the error before and after.

use super::{Picture, shown};
use crate::cli::diagnose::words::{fixed, plus_minus};
use crate::diagnose::{Candidate, Report};
use crate::formats::figure::{Bar, Bars, FigureError};

/// Gain in ln likelihood of every candidate of the first round.
pub(super) fn ranking(report: &Report) -> Result<Picture, FigureError> {
    let mut first: Vec<&Candidate> = report.ranking.iter().filter(|c| c.round == 1).collect();
    first.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let round_of = |name: &str| {
        report.ranking.iter().find(|c| c.accepted && c.name == name).map(|accepted| accepted.round)
    };
    let bar = |candidate: &&Candidate| {
        let round = round_of(candidate.name);
        Bar {
            name: candidate.name,
            value: if candidate.gain.is_finite() { candidate.gain } else { 0.0 },
            note: note(candidate, round),
            strong: report.effects.iter().any(|found| found.name == candidate.name),
        }
    };
    let placebos = first.iter().filter_map(|c| c.placebo_gain).filter(|gain| gain.is_finite());
    let guide = placebos.reduce(f64::max).map(|gain| (gain.max(0.0), "placebo"));
    let bars = Bars {
        title: "Which effect would help",
        subtitle: "each tried alone beside the base",
        label: "gain in ln likelihood over the base model",
        bars: first.iter().map(bar).collect(),
        guide,
    };
    let added = match report.effects.is_empty() {
        true => "",
        false => " Blue ones were added in the end.",
    };
    let placebo = match guide {
        Some(_) => {
            " The line is the gain of a random smooth field with as many numbers as one of those, but at most six; the \
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

fn note(candidate: &Candidate, round: Option<usize>) -> String {
    let decimals = if candidate.gain.abs() < 10.0 { 1 } else { 0 };
    let gain = fixed(candidate.gain, decimals);
    let held_out = candidate
        .held_out
        .map_or(String::new(), |[gain, se]| format!(", held out {}", plus_minus(gain, se)));
    let added = match round {
        Some(1) | None => String::new(),
        Some(round) => format!(", added in round {round}"),
    };
    gain + &held_out + &added
}

/// Root mean square error before and after, against the noise floor.
pub(super) fn error(report: &Report) -> Result<Picture, FigureError> {
    let error = &report.error;
    let bar = |name, rmse_db: f64, strong| Bar {
        name,
        value: rmse_db,
        note: format!("{rmse_db:.2} dB"),
        strong,
    };
    let (before, title) = match report.effects.is_empty() {
        true => ("base model", "Error and noise floor"),
        false => ("before: base model", "Error before and after"),
    };
    let floor = format!("noise floor {:.2} dB", error.noise_floor_db);
    let bars = Bars {
        title: "Error on parts of the scan that were not fitted",
        subtitle: "",
        label: "rms of observed − predicted, dB",
        bars: shown(
            report,
            [
                bar(before, error.before.rmse_db, false),
                bar("after: with the effects", error.after.rmse_db, true),
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
