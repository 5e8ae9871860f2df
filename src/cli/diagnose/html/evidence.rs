//! The tables behind the verdict: errors, what remains, controls, what was tried, the base.

use super::page::{list, numbers, paragraph, quiet, table, words};
use crate::cli::diagnose::Context;
use crate::cli::diagnose::plots::Peak;
use crate::cli::diagnose::tried::NotTried;
use crate::cli::diagnose::words::{
    covariate, fixed, gone, plus_minus, probability, signed, strongest, value as with_unit,
};
use crate::diagnose::{
    Base, BeforeAfter, Candidate, Control, Controls, MeshPose, Report, Unexplained,
};

/// Errors without and with the effects, and what a model that is right would have.
pub(super) fn errors(report: &Report) -> String {
    let error = &report.error;
    let BeforeAfter { before, after, noise_floor_db, .. } = error;
    let row = |name: &str, [before, after, right]: [String; 3], meaning: &str| {
        [name.to_owned(), before, after, right, meaning.to_owned()]
    };
    let share = |x: f64| format!("{:.1} %", 100.0 * x);
    let none = || "–".to_owned();
    let rows = [
        row(
            "rms error, dB",
            [
                format!("{:.2} ± {:.2}", before.rmse_db, before.rmse_se_db),
                format!("{:.2} ± {:.2}", after.rmse_db, after.rmse_se_db),
                fixed(*noise_floor_db, 2),
            ],
            "Root mean square of observed − predicted power over the detections, with its standard \
             error. The last column is the noise floor: what speckle and noise leave to a model that is \
             right.",
        ),
        row(
            "mean error, dB",
            [
                format!("{} ± {:.2}", signed(before.bias_db, 2), before.bias_se_db),
                format!("{} ± {:.2}", signed(after.bias_db, 2), after.bias_se_db),
                "0".to_owned(),
            ],
            "Observed − predicted, in the mean.",
        ),
        row(
            "ln p per chirp",
            [fixed(before.log_score, 4), fixed(after.log_score, 4), none()],
            "How probable the model called what then came, silent chirps included. More is better.",
        ),
        row(
            "inside the central 50 %",
            [share(before.coverage_50), share(after.coverage_50), "50 %".to_owned()],
            "Share of the detections within the middle half of what the model expects.",
        ),
        row(
            "inside the central 90 %",
            [share(before.coverage_90), share(after.coverage_90), "90 %".to_owned()],
            "The same of the middle nine tenths. Less: the model is surer than it may be.",
        ),
        row(
            "detected or not (Brier)",
            [fixed(before.brier, 4), fixed(after.brier, 4), none()],
            "Mean square error of the probability of a detection. Less is better.",
        ),
    ];
    let columns = [
        words("what"),
        numbers("before"),
        numbers("after"),
        numbers("a model that is right"),
        words("what it means"),
    ];
    let how = format!(
        "Every chirp is predicted by a fit that it took no part in: the target is cut into {} patches, \
         dealt out to {} folds, the same before and after. Before is the base model, refitted to the \
         data, so that nothing is won by a better fit of what was there.",
        error.blocks, error.folds
    );
    paragraph(&how)
        + &table("Errors on held-out patches", columns, &rows)
        + &paragraph(&match report.effects.is_empty() {
            true => "Nothing was added, so that before and after are the same.".to_owned(),
            false => explained(error),
        })
        + &error.with_unknown.as_ref().map_or(String::new(), |errors| {
            paragraph(&format!(
                "With a smooth term for what is unknown, which saw none of the patches that it is judged on either, {:.2} ± \
                 {:.2} dB rms are left.",
                errors.rmse_db, errors.rmse_se_db
            ))
        })
}

/// How much of what could be explained is.
fn explained(error: &BeforeAfter) -> String {
    let leak = match error.after.rmse_db < 0.98 * error.noise_floor_db {
        true => {
            " After lies below the floor, which no honest prediction does: speckle or noise is \
             weaker than declared."
        }
        false => "",
    };
    // Effects were added: what is small in all may be large in one place.
    let gone = error.explained_share.map(share);
    gone.unwrap_or_else(|| no_share("model", "in few chirps, which the maps show")) + leak
}

/// How much of the squared error above what noise leaves is gone.
pub(super) fn share(share: f64) -> String {
    format!("Of the squared error above the noise, {} is gone.", gone(share)).replace('-', "−")
}

/// Why no share is told.
pub(super) fn no_share(base: &str, place: &str) -> String {
    format!(
        "In all the base {base} is within a twentieth of the noise, so that no share is told: what was \
         found is {place}."
    )
}

/// What no effect explains.
pub(super) fn unexplained(found: &[Unexplained], places: &[Peak]) -> String {
    if found.is_empty() {
        return paragraph(
            "Nothing that is tested for: neither the level nor the scatter of the residuals goes with \
             angle, azimuth, range, place, edges, time, predicted power or region beyond chance and \
             beyond the least size that counts.",
        );
    }
    let row = |one: &Unexplained| {
        let (name, hint) = covariate(&one.covariate);
        let strength = format!("{:.2}", one.strength_db);
        [name, strength, probability(one.p_value), hint.to_owned()]
    };
    let rows: Vec<[String; 4]> = found.iter().map(row).collect();
    let columns =
        [words("goes with"), numbers("strength, dB"), numbers("by chance"), words("often means")];
    paragraph(
        "The residuals still go with what stands below. No effect in the library explains it, so it \
         gets no name: see the maps for where it is. Covariates hang together on most targets, so \
         several lines can have one cause.",
    ) + &table("Structure in what remains, strongest first", columns, &rows)
        + &strongest(places).map_or(String::new(), |places| {
            paragraph(&format!("What is unknown is {places}, as marked on its map."))
        })
        + &quiet(
            "Strength: root mean square over the chirps of what goes with it, beyond chance. By chance: \
             how probable so much is if nothing is there, for one test alone.",
        )
}

/// What the answer is to be held against.
pub(super) fn controls(controls: &Controls) -> String {
    let named = [
        ("placebo: a random smooth field", &controls.placebo),
        ("spline with as many numbers", &controls.equal_df_spline),
    ];
    let row = |(name, control): (&str, &Option<Control>)| {
        let control = control.as_ref()?;
        Some([
            name.to_owned(),
            control.over.clone(),
            control.numbers.to_string(),
            plus_minus(control.held_out_gain, control.held_out_se),
        ])
    };
    let rows: Vec<[String; 4]> = named.into_iter().filter_map(row).collect();
    let columns =
        [words("control"), words("over"), numbers("numbers"), numbers("held-out gain in ln p")];
    let mut html = String::new();
    if !rows.is_empty() {
        html += &paragraph(
            "Terms that mean nothing, treated like the effects. If they did as well, an effect's gain \
             would mean nothing either.",
        );
        html += &table("Controls", columns, &rows);
    }
    html + &power(controls)
}

/// From which size on each effect would have been seen.
fn power(controls: &Controls) -> String {
    if controls.injection_recovery.is_empty() {
        return String::new();
    }
    let rows: Vec<[String; 3]> = controls
        .injection_recovery
        .iter()
        .map(|power| {
            let size = |db: Option<f64>| db.map_or("–".to_owned(), |db| format!("{db:.2}"));
            [power.name.to_owned(), size(power.least_db), size(power.missed_db)]
        })
        .collect();
    let columns = [words("effect"), numbers("found from, dB"), numbers("missed up to, dB")];
    paragraph(
        "What this scan can reveal: each effect was put into data drawn by the base model, in several \
         sizes (root mean square over the chirps), and looked for. Below what was found its absence \
         means nothing.",
    ) + &table("What these data would have shown", columns, &rows)
}

/// What was tried and not found, best first.
pub(super) fn tried(report: &Report) -> String {
    let mut candidates: Vec<&Candidate> = report.not_found().collect();
    if candidates.is_empty() {
        return paragraph(
            "Nothing was tried beyond what was found and what it cannot be told from.",
        );
    }
    candidates.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    let dash = || "–".to_owned();
    let row = |candidate: &&Candidate| {
        let held_out = candidate.held_out.map_or_else(dash, |[gain, se]| plus_minus(gain, se));
        // The size is only known of what was fitted.
        let size_db = Some(candidate.size_db).filter(|size_db| *size_db > 0.0);
        [
            candidate.name.to_owned(),
            if candidate.sampled { "sample" } else { "all chirps" }.to_owned(),
            fixed(candidate.gain, 1),
            candidate.placebo_gain.map_or_else(dash, |gain| fixed(gain, 1)),
            held_out,
            size_db.map_or_else(dash, |size_db| format!("{size_db:.2}")),
        ]
    };
    let rows: Vec<[String; 6]> = candidates.iter().map(row).collect();
    let columns = [
        words("effect"),
        words("by"),
        numbers("gain in ln likelihood"),
        numbers("placebo"),
        numbers("held-out gain in ln p"),
        numbers("size, dB"),
    ];
    paragraph(
        "Each was tried together with what had been found by its last round. Those marked “sample” were \
         only screened: held against a sample of the chirps, where they promised too little to be fitted \
         to all. That an effect is not supported does not say that it is absent: it may be too weak for \
         these data. Only the best few are judged on held-out patches.",
    ) + &table("Tried and not supported", columns, &rows)
}

/// What was left out of the search.
pub(super) fn not_tried(left_out: &[NotTried]) -> String {
    if left_out.is_empty() {
        return String::new();
    }
    let row = |one: &NotTried| [one.name.to_owned(), one.reason.words().to_owned()];
    let rows: Vec<[String; 2]> = left_out.iter().map(row).collect();
    table("Left out of the search", [words("effect"), words("because")], &rows)
}

/// The model that the effects are added to.
pub(super) fn base(base: &Base, context: &Context) -> String {
    let region = |number: usize| {
        context.regions.get(number).map_or(("–".to_owned(), "–".to_owned()), Clone::clone)
    };
    let rows: Vec<[String; 4]> = base
        .parameters
        .iter()
        .map(|number| {
            let (name, material) = region(number.region);
            [number.name.clone(), with_unit(&number.value), name, material]
        })
        .collect();
    let columns = [words("number"), numbers("fitted"), words("region"), words("material")];
    let converged = match base.converged {
        true => "The final fit converged.".to_owned(),
        false => "The final fit did not converge: take the numbers with care.".to_owned(),
    };
    let facts = [
        format!("Looks of speckle, as the scene declares: {}.", fixed_or_none(base.looks)),
        format!("Threshold, as the scene declares: {} dBm.", fixed(base.threshold_dbm, 1)),
        noise(base),
        pose(&base.pose),
        converged,
    ];
    table("The material laws, refitted with the effects", columns, &rows) + &list(&facts)
}

fn noise(base: &Base) -> String {
    let thermal = match base.noise_dbm {
        Some(dbm) => format!("Thermal noise, as the scene declares: {} dBm", fixed(dbm, 1)),
        None => "The scene declares no thermal noise".to_owned(),
    };
    match base.range_sd_m > 0.0 {
        true => {
            let sd_mm = fixed(1e3 * base.range_sd_m, 2);
            format!("{thermal}; standard deviation of a range: {sd_mm} mm.")
        }
        false => format!("{thermal} and no error of ranges, which are not used."),
    }
}

fn pose(meshes: &[MeshPose]) -> String {
    let one = |at: &MeshPose| {
        format!("{} at {:?} m, turned by {:?}°", at.mesh, at.translation_m, at.rotation_deg)
    };
    format!(
        "Pose, as the scene declares: {}. It is not refitted, but `pose` is one of the effects.",
        meshes.iter().map(one).collect::<Vec<_>>().join("; ")
    )
}

/// Many looks are none: without speckle declared there is nothing to draw.
fn fixed_or_none(looks: f64) -> String {
    if looks >= 1e4 { "none declared".to_owned() } else { fixed(looks, 1) }
}
