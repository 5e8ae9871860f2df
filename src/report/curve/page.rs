//! `report.html` of a curve.

use serde::Serialize;

use super::answer::CurveAnswer;
use super::text::{advice, angle, heading, may_be, noise_source, places, sentence, verdict};
use crate::diagnose::curve::{CurveEvidence, CurveReport, CurveUnknown};
use crate::error::Error;
use crate::formats::words::capitalised;
use crate::report::choice::{Omission, left_out};
use crate::report::effect::{Article, of_curve};
use crate::report::picture::{Figure, Picture};
use crate::report::templates;
use crate::report::words::{gone, value};

/// What the template takes.
#[derive(Serialize)]
struct Page<'a> {
    title: String,
    report: &'a CurveReport,
    name: &'a str,
    model: Option<&'a str>,
    seed: u64,
    heading: &'static str,
    sentence: String,
    effects: Vec<Article<'a, CurveEvidence>>,
    noise_source: &'static str,
    /// Share of the squared error above the noise that is gone, in words.
    share: Option<String>,
    picture: Figure<'a>,
    unexplained: Vec<Remaining<'a>>,
    not_tried: Vec<Omission>,
    /// Numbers of the base law: name and value.
    law: Vec<[String; 2]>,
    advice: Vec<String>,
    may_be: Option<String>,
}

/// Structure that remains, and the angle that it depends on.
#[derive(Serialize)]
struct Remaining<'a> {
    angle: String,
    unknown: &'a CurveUnknown,
}

/// The page of a diagnosis.
pub(super) fn page(answer: CurveAnswer, picture: &Picture) -> Result<Vec<u8>, Error> {
    let CurveAnswer { report, name, model, seed, not_tried, .. } = answer;
    let mut unexplained = Vec::new();
    for unknown in &report.unexplained {
        let at = if unknown.at_deg.is_empty() { "" } else { ": " };
        let angle = format!("{}{at}{}", angle(unknown.covariate), places(unknown));
        unexplained.push(Remaining { angle, unknown });
    }
    let mut law = Vec::new();
    for number in &report.base.parameters {
        law.push([number.name.clone(), value(&number.value)]);
    }
    let context = Page {
        title: format!("{name}: {}", verdict(report.verdict)),
        report,
        name,
        model,
        seed,
        heading: heading(report),
        sentence: capitalised(&sentence(report)) + ".",
        effects: report.effects.iter().map(of_curve).collect(),
        noise_source: noise_source(report.error.noise_source),
        share: report.error.explained_share.map(gone),
        picture: picture.figure()?,
        unexplained,
        not_tried: left_out(not_tried),
        law,
        may_be: may_be(report).map(|one| capitalised(&one) + "."),
        advice: advice(report).iter().map(|one| capitalised(one) + ".").collect(),
    };
    templates::page("curve.html", &context)
}
