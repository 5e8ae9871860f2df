//! The diagnosis on the terminal.

use std::path::Path;

use super::plots::Peak;
use super::words::{
    covariate, gone, listed, numbers, others, plus_minus, sentence, strongest, told, verdict,
};
use crate::diagnose::{Errors, Found, Report};

/// Lines of what remains that are shown; the page has all.
const MOST_UNEXPLAINED: usize = 3;

/// About ten lines: the verdict, what was found, the error, what is left, where it stands.
pub(super) fn text(report: &Report, places: &[Peak], files: &[String], folder: &Path) -> String {
    let mut text = format!("{}: {}\n", verdict(report.verdict), lower(&sentence(report)));
    text += &report.effects.iter().map(effect).collect::<String>();
    text += &error(report);
    text += &remains(report);
    text += &strongest(places).map_or(String::new(), |places| format!("  {places}\n"));
    if report.set_aside > 0 {
        text += &format!(
            "set aside: {} detections that lie elsewhere than their chirps meet the target\n",
            report.set_aside
        );
    }
    let mut others: Vec<&str> = report.not_found().map(|tried| tried.name).collect();
    others.sort_unstable();
    if !others.is_empty() {
        text += &format!("tried and not supported: {}\n", listed(&others));
    }
    text + &written(files, folder)
}

/// A sentence after a colon.
fn lower(sentence: &str) -> String {
    let mut letters = sentence.chars();
    letters.next().map_or(String::new(), |first| first.to_lowercase().chain(letters).collect())
}

fn effect(found: &Found) -> String {
    let each = || {
        let each = numbers(&found.parameters);
        each.iter().map(|number| number.join(" = ")).collect::<Vec<_>>().join(", ")
    };
    let others = others(&found.class, found.name);
    let class = match others.is_empty() {
        true => String::new(),
        false => format!("    these data cannot tell it from {}\n", listed(&others)),
    };
    format!(
        "  {} ({}): {}\n    held-out gain in ln p {}, changes the data by {:.2} dB\n{class}",
        found.name,
        found.level.as_str(),
        told(found).unwrap_or_else(each),
        plus_minus(found.evidence.held_out_gain, found.evidence.held_out_se),
        found.evidence.size_db
    )
}

fn error(report: &Report) -> String {
    let error = &report.error;
    let share = match error.explained_share.filter(|_| !report.effects.is_empty()) {
        Some(share) => format!("; {} of what lies above the floor is gone", gone(share)),
        None => String::new(),
    };
    let change = match report.effects.is_empty() {
        true => rms(&error.before),
        false => format!("{} → {}", rms(&error.before), rms(&error.after)),
    };
    let unknown = error.with_unknown.as_ref().map_or(String::new(), |errors| {
        format!("; {} dB with a smooth term for what is unknown", rms(errors))
    });
    format!(
        "error on held-out patches: {change} dB rms (noise floor {:.2} dB){share}{unknown}\n",
        error.noise_floor_db
    )
}

/// With its standard error.
fn rms(errors: &Errors) -> String {
    format!("{:.2} ± {:.2}", errors.rmse_db, errors.rmse_se_db)
}

fn remains(report: &Report) -> String {
    let named = |one: &crate::diagnose::Unexplained| {
        format!("{:.2} dB with {}", one.strength_db, covariate(&one.covariate).0)
    };
    let first: Vec<String> = report.unexplained.iter().take(MOST_UNEXPLAINED).map(named).collect();
    let more = match report.unexplained.len().saturating_sub(MOST_UNEXPLAINED) {
        0 => String::new(),
        count => format!(", and {count} more"),
    };
    match first.is_empty() {
        true => "what remains: nothing that is tested for\n".to_owned(),
        false => format!("what remains: {}{more}\n", first.join(", ")),
    }
}

fn written(files: &[String], folder: &Path) -> String {
    let pictures = files.iter().filter(|name| name.ends_with(".png")).count();
    let others: Vec<&str> = files
        .iter()
        .map(String::as_str)
        .filter(|name| !name.ends_with(".png") && !name.ends_with(".svg"))
        .collect();
    format!(
        "wrote {} and {pictures} pictures (.svg and .png) to {}\n",
        others.join(", "),
        folder.display()
    )
}
