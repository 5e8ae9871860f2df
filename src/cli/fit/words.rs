//! A fit in words.

use crate::adopt::{FitSubject, StoredFit};
use crate::cli::summary::{grouped, table};
use crate::formats::words::significant;
use crate::material::{CrossValidation, Fit, FitReport, Goodness};
use crate::units::dbm_from_watts;

/// All that a person wants to know of a fit.
pub(super) fn result(
    subject: &FitSubject,
    fit: &Fit,
    saved: Option<&StoredFit>,
    files: &[String],
) -> String {
    let rows = subject.curve.observations.len();
    let censored = rows - subject.curve.detected().count();
    let apart = subject.curve.observations.iter().filter(|row| !row.is_retro()).count();
    let mut text = format!(
        "{}: {} rows, {} of them below the threshold",
        subject.label,
        grouped(rows),
        grouped(censored)
    );
    if apart > 0 {
        text += &format!(", {} of them with source and receiver in two directions", grouped(apart));
    }
    text.push('\n');
    let lit = subject.curve.illumination;
    let lobes = fit.lobes_words().map_or(String::new(), |words| format!("; {words}"));
    text += &format!("{}; {}{lobes}\n", lit.footprint_words(), lit.beam_words());
    text += &fit.report.as_ref().map_or(String::new(), report);
    if let Some(saved) = saved {
        let open = if saved.curve_is_open { ", since this fit leaves the curve open" } else { "" };
        text += &format!(
            "stored as fit {} of {}, revision {}, in {}; scenes render {}{open}\n",
            saved.fit, saved.material, saved.revision, saved.database, saved.render
        );
    }
    if !files.is_empty() {
        text += &format!("wrote {}\n", files.join(", "));
    }
    text
}

/// What a fit says of itself.
pub fn report(report: &FitReport) -> String {
    let end = if report.converged { "converged" } else { "did not converge" };
    let mut text = format!(
        "method {}: {end} ({}) after {} steps, {} of {} starts agree\n",
        report.method, report.stop, report.iterations, report.agreeing_starts, report.starts
    );
    if !report.given.is_empty() {
        let given =
            report.given.iter().map(|g| format!("{} = {}", g.name, significant(g.value, 4)));
        text += &format!("given: {}\n", given.collect::<Vec<_>>().join(", "));
    }
    text += &estimates(report);
    text += &level(report);
    text += &goodness(report);
    text += &report.held_out.as_ref().map_or(String::new(), held_out);
    let singular: Vec<String> = report.singular_values.iter().map(|v| significant(*v, 4)).collect();
    text += &format!("singular values: {}\n", singular.join(", "));
    text += &format!(
        "data {}, seed {}, matdb {}\n",
        report.data_hash.get(..12).unwrap_or_default(),
        report.seed,
        report.version
    );
    match report.verdict.as_slice() {
        [] => text += "verdict: the data determine every number above\n",
        sentences => {
            text += "verdict:\n";
            sentences.iter().for_each(|sentence| text += &format!("- {sentence}\n"));
        }
    }
    text
}

fn estimates(report: &FitReport) -> String {
    const UNKNOWN: &str = "not known";
    table(
        &["estimate", "value", "± sd", "95 % interval"],
        report.estimates.iter().map(|e| {
            let interval = e
                .interval_95
                .map(|[low, high]| format!("{} to {}", significant(low, 4), significant(high, 4)));
            [
                e.name.clone(),
                significant(e.value, 4),
                e.sd.map_or(UNKNOWN.to_owned(), |sd| significant(sd, 4)),
                interval.unwrap_or(UNKNOWN.to_owned()),
            ]
        }),
    )
}

fn level(report: &FitReport) -> String {
    let looks = report.looks.map_or("not used".to_owned(), |looks| significant(looks, 4));
    let noise = if report.noise_w > 0.0 {
        format!("{:.1} dBm", dbm_from_watts(report.noise_w))
    } else {
        "none".to_owned()
    };
    format!("looks {looks}, noise floor {noise}\n")
}

fn goodness(report: &FitReport) -> String {
    let Goodness { rms_db, mean_db, speckle_db, z_mean, z_variance, ks_distance, .. } =
        report.goodness;
    let speckle = speckle_db.map_or(String::new(), |speckle_db| {
        format!(" (speckle alone scatters by {speckle_db:.2} dB)")
    });
    let form = report.goodness.form_error_db().filter(|db| *db > 0.0).map_or(String::new(), |db| {
        format!("the form of the law is off by {db:.2} dB rms, which is not in the deviations\n")
    });
    format!(
        "detections are {rms_db:.2} dB rms{speckle} and {mean_db:.2} dB on average off the model; \
         residuals: mean {z_mean:.2}, variance {z_variance:.2}, {ks_distance:.3} off their law\n{form}"
    )
}

/// How the fit did on points that it had not seen.
fn held_out(held: &CrossValidation) -> String {
    let CrossValidation { folds, blocks, score, score_sd, rms_db, .. } = held;
    let of = held.of();
    let score = score
        .zip(*score_sd)
        .map_or(String::new(), |(score, sd)| format!(", ln p {score:.4} ± {sd:.4} a point"));
    format!("held out in {folds} turns ({blocks} {of}): {rms_db:.2} dB rms{score}\n")
}
