//! The diagnosis of a cloud in words, as the terminal shows it.

use std::path::Path;

use super::places::{self, Peak};
use crate::diagnose::{CloudPart, Errors, FalseAlarms, FoundEffect, Report};
use crate::formats::words::{counted, listed, plus_minus, uncapitalised};
use crate::report::words::{covariate, gone, named, numbers, others, sentence, summary, verdict};

/// Lines of what remains that are shown; the page has all.
const MOST_UNEXPLAINED: usize = 3;

/// About ten lines: the verdict, what was found, the error, what remains, and where the files are.
pub(super) fn text(report: &Report, peaks: &[Peak], files: &[String], folder: &Path) -> String {
    let mut text = format!("{}: {}\n", verdict(report.verdict), uncapitalised(&sentence(report)));
    for found in &report.effects {
        text += &effect(found, report);
    }
    text += &error(report);
    text += &remains(report);
    if let Some(places) = places::words(peaks) {
        text += &format!("  {places}\n");
    }
    for part in &report.clouds {
        text += &cloud(part);
    }
    if let Some(level_db) = report.base.level_db.as_ref().filter(|_| report.clouds.is_empty()) {
        text += &format!(
            "level of the radar: {} dB over its settings, {}\n",
            plus_minus(level_db.value, level_db.sd.unwrap_or(f64::INFINITY)),
            "as far as the stored scale of its materials is right"
        );
    }
    if report.set_aside > 0 {
        text += &format!(
            "set aside: {} detections that lie elsewhere than their chirps meet the target{}\n",
            report.set_aside,
            beside_edge(report.beside_edge)
        );
    }
    text += &false_alarms(&report.false_alarms);
    if report.independent_chirps < report.rows.len() as f64 {
        text += &format!(
            "neighbours share speckle: the {} chirps on the target count as {:.0}\n",
            report.rows.len(),
            report.independent_chirps
        );
    }
    let mut not_found: Vec<&str> = report.not_found().map(|tried| tried.name).collect();
    not_found.sort_unstable();
    not_found.dedup();
    if !not_found.is_empty() {
        text += &format!("tried and not supported: {}\n", listed(&not_found));
    }
    text + &written(files, folder)
}

/// How many of the detections that were set aside lie beside an edge; nothing for none.
fn beside_edge(count: usize) -> String {
    if count == 0 {
        return String::new();
    }
    format!(", {count} of them beside an edge, within the reach of the beam")
}

/// How many detections count as false alarms; nothing where none does and the noise predicts less than one.
fn false_alarms(alarms: &FalseAlarms) -> String {
    let detections = counted(alarms.counted, "detection");
    match alarms.expected {
        Some(expected) if alarms.counted > 0 || expected >= 1.0 => {
            format!("false alarms: {detections}; the declared noise predicts {expected:.1}\n")
        }
        None if alarms.counted > 0 => format!("false alarms: {detections}\n"),
        _ => String::new(),
    }
}

/// What one of several clouds has.
fn cloud(part: &CloudPart) -> String {
    let CloudPart { name, chirps, detected, level_db, before, after } = part;
    let mut text = format!("{name}: {chirps} chirps on the target, {detected} detected, ");
    if let Some(level_db) = level_db {
        let sd = level_db.sd.unwrap_or(f64::INFINITY);
        text += &format!("level {} dB, ", plus_minus(level_db.value, sd));
    }
    text + &format!("{} → {} dB rms\n", rms(before), rms(after))
}

fn effect(found: &FoundEffect, report: &Report) -> String {
    let values = summary(found).unwrap_or_else(|| {
        let numbers = numbers(&found.parameters);
        numbers.iter().map(|number| number.join(" = ")).collect::<Vec<_>>().join(", ")
    });
    let mut text = format!(
        "  {} ({}): {values}\n    held-out gain in ln p {}, changes the data by {:.2} dB\n",
        named(found.name, &found.scans, report),
        found.level.as_str(),
        plus_minus(found.evidence.held_out_gain, found.evidence.held_out_se),
        found.evidence.size_db
    );
    let gains = found.evidence.by_cloud.iter().filter_map(|one| {
        let part = report.clouds.get(one.cloud.checked_sub(1)?)?;
        Some(format!("{} in {}", plus_minus(one.gain, one.se), part.name))
    });
    let gains: Vec<String> = gains.collect();
    if !gains.is_empty() {
        text += &format!("    of that {}\n", gains.join(", "));
    }
    let others = others(&found.class, found.name);
    if !others.is_empty() {
        text += &format!("    these data cannot tell it from {}\n", listed(&others));
    }
    text
}

fn error(report: &Report) -> String {
    let error = &report.error;
    let is_changed = !report.effects.is_empty();
    let mut text = format!("error on held-out patches: {}", rms(&error.before));
    if is_changed {
        text += &format!(" → {}", rms(&error.after));
    }
    text += &format!(" dB rms (noise floor {:.2} dB)", error.noise_floor_db);
    if let Some(share) = error.explained_share.filter(|_| is_changed) {
        text += &format!("; {} of what lies above the floor is gone", gone(share));
    }
    if let Some(errors) = &error.with_unknown {
        text += &format!("; {} dB with a smooth term for what is unknown", rms(errors));
    }
    text + "\n"
}

/// An rms error with its standard error.
fn rms(errors: &Errors) -> String {
    format!("{:.2} ± {:.2}", errors.rmse_db, errors.rmse_se_db)
}

fn remains(report: &Report) -> String {
    if report.unexplained.is_empty() {
        return "what remains: nothing that is tested for\n".to_owned();
    }
    let mut first = Vec::new();
    for one in report.unexplained.iter().take(MOST_UNEXPLAINED) {
        first.push(format!("{:.2} dB with {}", one.strength_db, covariate(&one.covariate).0));
    }
    let mut text = format!("what remains: {}", first.join(", "));
    let more = report.unexplained.len() - first.len();
    if more > 0 {
        text += &format!(", and {more} more");
    }
    text + "\n"
}

fn written(files: &[String], folder: &Path) -> String {
    let (mut pictures, mut others) = (0, Vec::new());
    for name in files {
        if name.ends_with(".png") {
            pictures += 1;
        } else if !name.ends_with(".svg") {
            others.push(name.as_str());
        }
    }
    format!(
        "wrote {} and {pictures} pictures (.svg and .png) to {}\n",
        others.join(", "),
        folder.display()
    )
}
