//! `report.html` of a cloud: the whole diagnosis for a person who has not read the documentation.

use serde::Serialize;

use super::answer::{CloudAnswer, NextSteps};
use super::places::{self, Peak};
use super::record::BaseRecord;
use crate::diagnose::{
    BaseValue, Candidate, CloudGain, CloudPart, Control, Controls, Evidence, MeshPose, Report,
};
use crate::error::Error;
use crate::formats::words::listed;
use crate::report::choice::{Omission, left_out};
use crate::report::effect::{Article, of_cloud};
use crate::report::picture::{Figure, Picture};
use crate::report::templates;
use crate::report::words::{covariate, gone, heading, sentence, value, verdict};
use crate::scene::Scene;

/// What the template takes.
#[derive(Serialize)]
struct Page<'a> {
    title: String,
    report: &'a Report,
    base: BaseRecord<'a>,
    scene: &'a str,
    scene_path: String,
    cloud_path: String,
    heading: &'static str,
    sentence: String,
    /// Chirps that meet the target, and those of them that were detected.
    shots: usize,
    detected: usize,
    seed: u64,
    notices: &'a [String],
    effects: Vec<Article<'a, Evidence>>,
    /// What each of several clouds has; empty for one cloud.
    clouds: &'a [CloudPart],
    /// Effect, cloud, and the gain of the one in the other.
    gains: Vec<(&'static str, &'a str, CloudGain)>,
    /// Share of the squared error above the noise that is gone, in words.
    share: Option<String>,
    pictures: Vec<Figure<'a>>,
    unexplained: Vec<Remaining>,
    /// Where something unknown is strongest, in a clause.
    strongest: Option<String>,
    controls: Vec<(&'static str, &'a Control)>,
    /// What was tried and not found, the largest gain first.
    not_found: Vec<&'a Candidate>,
    not_tried: Vec<Omission>,
    laws: Vec<LawNumber<'a>>,
    pose: String,
    next: &'a NextSteps,
}

/// Structure that remains, in words.
#[derive(Serialize)]
struct Remaining {
    covariate: String,
    strength_db: f64,
    p_value: f64,
    /// What residuals that depend on the covariate often mean.
    hint: &'static str,
}

/// A fitted number of the law of a region.
#[derive(Serialize)]
struct LawNumber<'a> {
    name: &'a str,
    value: String,
    region: &'a str,
    material: &'a str,
}

/// The page of a diagnosis.
pub(super) fn page(
    answer: CloudAnswer,
    pictures: &[Picture],
    peaks: &[Peak],
    next: &NextSteps,
) -> Result<Vec<u8>, Error> {
    let CloudAnswer { report, scene, notices, not_tried, seed, .. } = answer;
    let context = Page {
        title: format!("{}: {}", scene.file.name, verdict(report.verdict)),
        report,
        base: BaseRecord::new(&report.base),
        scene: &scene.file.name,
        scene_path: answer.scene_path.display().to_string(),
        cloud_path: clouds(answer),
        heading: heading(report.verdict, report.effects.len()),
        sentence: sentence(report),
        shots: report.rows.len(),
        detected: report.rows.iter().filter(|row| row.observed_w.is_some()).count(),
        seed,
        notices,
        effects: report.effects.iter().map(of_cloud).collect(),
        clouds: &report.clouds,
        gains: gains(report),
        share: report.error.explained_share.map(gone),
        pictures: pictures.iter().map(Picture::figure).collect::<Result<_, Error>>()?,
        unexplained: unexplained(report),
        strongest: places::words(peaks),
        controls: controls(&report.controls),
        not_found: not_found(report),
        not_tried: left_out(not_tried),
        laws: report.base.parameters.iter().map(|number| law_number(number, scene)).collect(),
        pose: pose(&report.base.pose),
        next,
    };
    templates::page("cloud.html", &context)
}

/// The names of the clouds.
fn clouds(answer: CloudAnswer) -> String {
    let names: Vec<&str> = answer.report.clouds.iter().map(|part| part.name.as_str()).collect();
    if names.is_empty() { answer.cloud_path.display().to_string() } else { listed(&names) }
}

/// The gain of every effect in every one of several clouds.
fn gains(report: &Report) -> Vec<(&'static str, &str, CloudGain)> {
    let mut gains = Vec::new();
    for found in &report.effects {
        for (part, gain) in report.clouds.iter().zip(&found.evidence.by_cloud) {
            gains.push((found.name, part.name.as_str(), *gain));
        }
    }
    gains
}

fn unexplained(report: &Report) -> Vec<Remaining> {
    let mut remaining = Vec::new();
    for one in &report.unexplained {
        let (covariate, hint) = covariate(&one.covariate);
        let (strength_db, p_value) = (one.strength_db, one.p_value);
        remaining.push(Remaining { covariate, strength_db, p_value, hint });
    }
    remaining
}

/// The terms without meaning that were treated like effects.
fn controls(controls: &Controls) -> Vec<(&'static str, &Control)> {
    let mut named = Vec::new();
    named.extend(controls.placebo.as_ref().map(|one| ("placebo: a random smooth field", one)));
    let spline = controls.equal_df_spline.as_ref();
    named.extend(spline.map(|one| ("spline with as many numbers", one)));
    named
}

fn not_found(report: &Report) -> Vec<&Candidate> {
    let mut candidates: Vec<&Candidate> = report.not_found().collect();
    candidates.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    candidates
}

fn law_number<'a>(number: &'a BaseValue, scene: &'a Scene) -> LawNumber<'a> {
    let region = scene.target.regions.get(number.region);
    LawNumber {
        name: &number.name,
        value: value(&number.value),
        region: region.map_or("–", |region| &region.name),
        material: region.map_or("–", |region| &region.material),
    }
}

fn pose(meshes: &[MeshPose]) -> String {
    let mut poses = Vec::new();
    for MeshPose { mesh, translation_m, rotation_deg } in meshes {
        poses.push(format!("{mesh} at {translation_m:?} m, turned by {rotation_deg:?}°"));
    }
    poses.join("; ")
}
