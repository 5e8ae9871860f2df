//! The diagnosis of a curve in words, as the terminal shows it.

use std::path::Path;

use super::answer::CurveAnswer;
use crate::diagnose::curve::{
    CurveReport, CurveUnknown, CurveVerdict, FoundTerm, Kind, NameDoubt, NoiseSource,
};
use crate::effects::Level;
use crate::formats::words::{listed, plus_minus};
use crate::report::words::{gone, others, value};

/// Residual of the nearest law, dB, from which on levels or angles may mean something else.
const FAR_OFF_DB: f64 = 2.0;

/// The verdict in a word or two.
pub(super) fn verdict(verdict: CurveVerdict) -> &'static str {
    match verdict {
        CurveVerdict::NoMissingEffect => "nothing is missing",
        CurveVerdict::AnotherLaw => "another law",
        CurveVerdict::Explained => "explained",
        CurveVerdict::Unexplained => "unexplained",
        CurveVerdict::NoiseUnknown => "the noise is not known",
    }
}

/// The verdict as a heading.
pub(super) fn heading(report: &CurveReport) -> &'static str {
    match (report.verdict, report.effects.len()) {
        (CurveVerdict::NoMissingEffect, _) => "Nothing is missing",
        (CurveVerdict::AnotherLaw, _) => "Another law explains the curve",
        (CurveVerdict::Explained, 2..) => "The missing effects are found",
        (CurveVerdict::Explained, _) => "The missing effect is found",
        (CurveVerdict::Unexplained, _) => "Something unknown remains",
        (CurveVerdict::NoiseUnknown, _) => "The noise is not known",
    }
}

/// The verdict in a sentence.
pub(super) fn sentence(report: &CurveReport) -> String {
    let names: Vec<String> = report.effects.iter().map(or_alike).collect();
    let names = listed(&names);
    match report.verdict {
        CurveVerdict::NoMissingEffect => {
            "the law explains the curve within its noise, and no structure remains".to_owned()
        }
        CurveVerdict::AnotherLaw => format!(
            "another law, {}, explains the curve within its noise, and needs no effect",
            report.base.law
        ),
        CurveVerdict::Explained => format!("the law lacks {names}; with that, only noise is left"),
        CurveVerdict::Unexplained if report.unexplained.iter().any(|one| !one.at_deg.is_empty()) => {
            "a law explains all levels but isolated ones: what these are is unknown".to_owned()
        }
        CurveVerdict::Unexplained if report.laws.len() > 1 => {
            "the law does not explain the curve, and neither another law nor an effect that was tried \
             does: what remains is unknown"
                .to_owned()
        }
        CurveVerdict::Unexplained => {
            "the law does not explain the curve: what remains is unknown".to_owned()
        }
        CurveVerdict::NoiseUnknown => {
            let law = match report.base.law {
                "declared" => "the law".to_owned(),
                other => format!("another law, {other},"),
            };
            format!(
                "{law} leaves no structure, but the noise of a level is unknown, so that \
                 nothing can be called explained; repeat some angles, or state --noise-db"
            )
        }
    }
}

/// A term, or one of those that do equally well.
fn or_alike(found: &FoundTerm) -> String {
    let names: Vec<&str> = [found.name].into_iter().chain(found.class.iter().copied()).collect();
    names.join(" or ")
}

/// What improves the law and gets no name; `None` where nothing does.
pub(super) fn may_be(report: &CurveReport) -> Option<String> {
    (!report.may_be.is_empty()).then(|| {
        format!(
            "may be {}, but has no name: {}",
            listed(&report.may_be),
            listed(&report.doubts.iter().map(|one| doubt(*one)).collect::<Vec<&str>>())
        )
    })
}

/// Why an effect gets no name.
fn doubt(doubt: NameDoubt) -> &'static str {
    match doubt {
        NameDoubt::NoiseUnknown => "the noise of a level is not known",
        NameDoubt::Small => {
            "it changes the levels by less than 0.3 dB, as laws and instruments err"
        }
        NameDoubt::AtBound => "one of its numbers is at the end of its range",
        NameDoubt::NoFringe => "a film would show less than a whole fringe",
        NameDoubt::NotInRepeats => "one of the repeats lacks it",
        NameDoubt::BesideShape => "it stands beside a term that makes another law",
        NameDoubt::BesideLaw => "with it another law than the declared one explains the curve",
        NameDoubt::OtherBetter => "another law with an effect does better",
        NameDoubt::MoreRemains => "more than the noise remains with it",
    }
}

/// How the noise is known.
pub(super) fn noise_source(source: NoiseSource) -> &'static str {
    match source {
        NoiseSource::Declared => "declared",
        NoiseSource::Repeats => "from repeats",
        NoiseSource::File => "stated in the file",
        NoiseSource::Neighbours => "estimated from neighbouring angles",
    }
}

/// A covariate of the residuals in words.
pub(super) fn angle(covariate: &str) -> &str {
    match covariate {
        "theta" | "theta_i" => "angle of incidence",
        "theta_s" => "angle of the receiver",
        "theta_s - theta_i" => "angle from the mirror direction",
        "theta_s + theta_i" => "angle from backscatter",
        "scatter" => "more scatter than the noise has",
        other => other,
    }
}

/// What to do next, beyond what the verdict says.
pub(super) fn advice(report: &CurveReport) -> Vec<String> {
    let mut advice = Vec::new();
    for found in &report.effects {
        advice.push(match (found.name, found.level) {
            ("thin-film", _) => "the thickness holds for a film of index 1.5: of index n it is about n²/2.25 \
                                 times that, and the standard deviation does not include this"
                .to_owned(),
            ("subsurface", _) if report.curve.kind == Kind::Backscatter => {
                "before the material is blamed, measure the blank: in backscatter a floor of the receiver adds \
                 the same"
                    .to_owned()
            }
            (name, Level::Instrument) => format!(
                "before {name} is blamed, measure another sample on the same bench: what belongs to the \
                 instrument stays"
            ),
            _ => continue,
        });
    }
    if report.verdict == CurveVerdict::Unexplained {
        if report.error.noise_source == NoiseSource::Neighbours {
            advice.push("state the noise with --noise-db, or repeat some angles: without it no effect gets a name".to_owned());
        }
        let least_db = report.laws.iter().map(|law| law.rms_db).fold(f64::INFINITY, f64::min);
        if least_db > FAR_OFF_DB {
            advice.push(format!(
                "no law comes nearer than {least_db:.1} dB: look at the unit of the levels and the signs of \
                 the angles (θ_s is positive on the specular side)"
            ));
        }
    }
    advice
}

/// The diagnosis on the terminal; `folder` is where its files were written.
pub(super) fn text(answer: CurveAnswer, folder: &Path) -> String {
    let report = answer.report;
    let mut text = format!("{}: {}\n", verdict(report.verdict), sentence(report));
    for found in &report.effects {
        text += &effect(found);
    }
    for said in may_be(report).into_iter().chain(advice(report)) {
        text += &format!("  {said}\n");
    }
    text += &error(report);
    if report.unexplained.is_empty() {
        text += "what remains: nothing that is tested for\n";
    }
    for unknown in &report.unexplained {
        text += &remains(unknown);
    }
    text + &format!(
        "wrote report.html, report.json, residuals.csv, curve.svg and curve.png to {}\n",
        folder.display()
    )
}

fn effect(found: &FoundTerm) -> String {
    let mut numbers = Vec::new();
    for (name, number) in &found.parameters {
        numbers.push(format!("{name} = {}", value(number)));
    }
    let mut text = format!(
        "  {} ({}): {}\n    held-out gain in ln p {}, changes the levels by {:.2} dB\n",
        found.name,
        found.level.as_str(),
        numbers.join(", "),
        plus_minus(found.evidence.held_out_gain, found.evidence.held_out_se),
        found.evidence.size_db
    );
    let others = others(&found.class, found.name);
    if !others.is_empty() {
        text += &format!("    this curve cannot tell it from {}\n", listed(&others));
    }
    text
}

fn error(report: &CurveReport) -> String {
    let error = &report.error;
    let mut text = format!("error on held-out angles: {:.2}", error.before.rmse_db);
    // By another law, or with what was added.
    if error.after.rmse_db != error.before.rmse_db {
        text += &format!(" → {:.2}", error.after.rmse_db);
    }
    text += &format!(
        " dB rms (noise {:.2} dB, {})",
        error.noise_floor_db,
        noise_source(error.noise_source)
    );
    if let Some(share) = error.explained_share.filter(|_| !report.effects.is_empty()) {
        text += &format!("; {} of what lies above it is gone", gone(share));
    }
    text + "\n"
}

fn remains(unknown: &CurveUnknown) -> String {
    let gain = match (unknown.held_out_gain, unknown.held_out_se, unknown.held_out_rmse_db) {
        (Some(gain), Some(se), Some(rmse_db)) => format!(
            " (a smooth curve over it gains {} in held-out ln p and leaves {rmse_db:.2} dB)",
            plus_minus(gain, se)
        ),
        _ => String::new(),
    };
    let (db, what) = (unknown.strength_db, angle(unknown.covariate));
    match unknown.covariate {
        "scatter" => format!("  unknown: {db:.2} dB more scatter than the noise has\n"),
        "isolated angles" => {
            format!("  unknown: {db:.2} dB at single angles: {}\n", places(unknown))
        }
        _ => format!("  unknown: {db:.2} dB with {what}{gain}\n"),
    }
}

/// Angles of isolated levels.
pub(super) fn places(unknown: &CurveUnknown) -> String {
    let places = unknown
        .at_deg
        .iter()
        .map(|[i, s]| if *s == -*i { format!("{i:.1}°") } else { format!("{i:.1}°/{s:.1}°") });
    places.collect::<Vec<String>>().join(", ")
}
