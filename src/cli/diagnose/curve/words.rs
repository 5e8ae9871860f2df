//! The diagnosis of a curve in words.

use std::path::Path;

use super::Told;
use crate::cli::diagnose::words::{gone, listed, others, plus_minus, value, verdict};
use crate::diagnose::curve::{CurveFound, CurveReport, CurveUnknown, NoiseSource};
use crate::diagnose::{Value, Verdict};
use crate::effects::Level;

/// The verdict in a sentence.
pub(in crate::cli::diagnose) fn sentence(report: &CurveReport) -> String {
    let names: Vec<&str> = report.effects.iter().map(|found| found.name).collect();
    let names = listed(&names);
    match (report.verdict, report.effects.is_empty()) {
        (Verdict::NoMissingEffect, _) => {
            "the law explains the curve, and nothing that is tested for remains".to_owned()
        }
        (Verdict::Explained, _) => {
            format!("the law lacks {names}; with that, what is left is noise")
        }
        (Verdict::Unexplained, false) => format!(
            "the law lacks {names}, which the curve supports, and something unknown remains that no \
             effect that was tried explains"
        ),
        (Verdict::Unexplained, true) => {
            "the law does not explain the curve, and no effect that was tried does: what remains is \
             unknown"
                .to_owned()
        }
    }
}

/// How the noise is known.
pub(in crate::cli::diagnose) fn source(source: NoiseSource) -> &'static str {
    match source {
        NoiseSource::Declared => "declared",
        NoiseSource::Repeats => "from repeats",
        NoiseSource::File => "stated in the file",
        NoiseSource::Neighbours => "estimated from neighbouring angles",
    }
}

/// What remains goes with this.
pub(in crate::cli::diagnose) fn angle(covariate: &str) -> &str {
    match covariate {
        "theta" | "theta_i" => "angle of incidence",
        "theta_s" => "angle of the receiver",
        "theta_s - theta_i" => "angle from the mirror direction",
        "theta_s + theta_i" => "angle from backscatter",
        other => other,
    }
}

/// What to do before an instrument is blamed; nothing where none is.
pub(in crate::cli::diagnose) fn advice(told: Told) -> Option<String> {
    let of_instrument = told.report.effects.iter().filter(|f| f.level == Level::Instrument);
    let blamed: Vec<&str> = of_instrument.map(|found| found.name).collect();
    let what = match told.model {
        Some("mixture" | "mixture-ggx") => {
            "measure another sample on the same bench: what belongs to the instrument stays"
        }
        _ => "try a law of the sample with two lobes: --model mixture",
    };
    (!blamed.is_empty()).then(|| format!("before {} is blamed, {what}", listed(&blamed)))
}

/// The numbers of a term by name.
pub(in crate::cli::diagnose) fn numbers(found: &CurveFound) -> Vec<[String; 2]> {
    let number = |(name, number): (&&str, &Value)| [(*name).to_owned(), value(number)];
    found.parameters.iter().map(number).collect()
}

/// The diagnosis on the terminal.
pub(super) fn text(told: Told, folder: &Path) -> String {
    let report = told.report;
    let mut text = format!("{}: {}\n", verdict(report.verdict), sentence(report));
    text += &report.effects.iter().map(effect).collect::<String>();
    text += &advice(told).map_or(String::new(), |advice| format!("  {advice}\n"));
    text += &error(report);
    match report.unexplained.is_empty() {
        true => text += "what remains: nothing that is tested for\n",
        false => report.unexplained.iter().for_each(|one| text += &remains(one)),
    }
    text + &format!(
        "wrote report.html, report.json, residuals.csv, curve.svg and curve.png to {}\n",
        folder.display()
    )
}

fn effect(found: &CurveFound) -> String {
    let numbers: Vec<String> = numbers(found).iter().map(|number| number.join(" = ")).collect();
    let others = others(&found.class, found.name);
    let class = match others.is_empty() {
        true => String::new(),
        false => format!("    this curve cannot tell it from {}\n", listed(&others)),
    };
    format!(
        "  {} ({}): {}\n    held-out gain in ln p {}, changes the levels by {:.2} dB\n{class}",
        found.name,
        found.level.as_str(),
        numbers.join(", "),
        plus_minus(found.evidence.held_out_gain, found.evidence.held_out_se),
        found.evidence.size_db
    )
}

fn error(report: &CurveReport) -> String {
    let error = &report.error;
    let change = match report.effects.is_empty() {
        true => format!("{:.2}", error.before.rmse_db),
        false => format!("{:.2} → {:.2}", error.before.rmse_db, error.after.rmse_db),
    };
    let share = match error.explained_share.filter(|_| !report.effects.is_empty()) {
        Some(share) => format!("; {} of what lies above it is gone", gone(share)),
        None => String::new(),
    };
    format!(
        "error on held-out angles: {change} dB rms (noise {:.2} dB, {}){share}\n",
        error.noise_floor_db,
        source(error.noise_source)
    )
}

fn remains(unknown: &CurveUnknown) -> String {
    let gain = match (unknown.held_out_gain, unknown.held_out_se, unknown.held_out_rmse_db) {
        (Some(gain), Some(se), Some(rmse_db)) => format!(
            " (a smooth curve over it gains {} in held-out ln p and leaves {rmse_db:.2} dB)",
            plus_minus(gain, se)
        ),
        _ => String::new(),
    };
    format!("  unknown: {:.2} dB with {}{gain}\n", unknown.strength_db, angle(unknown.covariate))
}
