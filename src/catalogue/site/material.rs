//! The page of a material.

use serde::Serialize;

use super::cite::Citation;
use super::composition::{self, Composition};
use super::curve::{self, CurveView, Sample};
use super::entry::{has_measured_curve, place_of};
use super::fit::{self, FitView};
use super::levels::{Levels, TABLE_DEG, range_deg};
use super::link::{self, Link};
use super::script::inert;
use super::snippet::{self, Snippet};
use super::sphere;
use super::words::{gaps, meaning};
use crate::catalogue::about::About;
use crate::effects;
use crate::formats::words::{digits, shortened};
use crate::material::{FindingVerdict, Material, Source, SourceKind};
use crate::store::{RevisionSummary, StoredRevision};

/// A page's context.
#[derive(Serialize)]
pub(super) struct Page<'a> {
    about: &'a About,
    root: &'static str,
    title: String,
    material: Head<'a>,
    kind: &'static str,
    /// The words of the badge, where they differ from the kind.
    kind_words: Option<String>,
    kind_means: &'static str,
    revision: u32,
    content_hash: &'a str,
    added_at: &'a str,
    sphere: Option<String>,
    /// What stands behind `#` in the address of the page in three dimensions.
    place: Option<&'a str>,
    picture: Option<String>,
    samples: Vec<Sample>,
    levels: Vec<(String, String)>,
    curves: Vec<CurveView>,
    fits: Vec<FitView>,
    effects: Vec<EffectView>,
    composition: Composition,
    sources: Vec<SourceView<'a>>,
    gaps: Vec<String>,
    validity: [String; 2],
    snippet: Option<Snippet>,
    citation: &'a Citation,
    record: String,
    history: &'a [RevisionSummary],
}

/// The head of the page.
#[derive(Serialize)]
struct Head<'a> {
    slug: &'a str,
    name: &'a str,
    class: &'a str,
    description: &'a str,
    licence: &'a str,
    tags: &'a [String],
    render: &'a str,
}

#[derive(Serialize)]
struct SourceView<'a> {
    key: &'a str,
    kind: &'static str,
    /// With authors and year.
    title: String,
    link: Option<Link>,
    licence: Option<&'a str>,
    note: Option<&'a str>,
}

#[derive(Serialize)]
struct EffectView {
    name: String,
    /// Key of its source and its place.
    source: Option<(String, usize)>,
    is: Option<&'static str>,
    parameters: Vec<[String; 3]>,
}

/// The context of a material's page.
pub(super) fn page<'a>(
    about: &'a About,
    stored: &'a StoredRevision,
    history: &'a [RevisionSummary],
    citation: &'a Citation,
    place: Option<&'a str>,
) -> Page<'a> {
    let material = &stored.material;
    let (picture, samples) = curve::picture(material);
    let kind = material.render_kind();
    let fits = material.fits.iter().enumerate();
    let rendered = material.rendered_words();
    Page {
        about,
        root: "../",
        title: shortened(&material.name, 80),
        material: head(material),
        kind: kind.map_or("unknown", SourceKind::as_str),
        kind_means: match (&rendered, kind) {
            (Some(_), _) => "a model beside a curve, which nobody measured itself",
            (None, kind) => kind.map_or("of unknown origin", meaning),
        },
        kind_words: rendered,
        revision: stored.revision,
        content_hash: &stored.content_hash,
        added_at: &stored.added_at,
        sphere: sphere::svg(material),
        place,
        picture,
        samples,
        levels: levels(material),
        curves: material.curves.iter().map(|curve| curve::view(material, curve)).collect(),
        fits: fits.map(|(number, fit)| fit::view(material, number, fit)).collect(),
        effects: effects(material),
        composition: composition::view(material),
        sources: material.sources.iter().map(source).collect(),
        gaps: unknown(material),
        validity: validity(material),
        snippet: snippet::of(stored),
        citation,
        record: inert(&citation.record),
        history,
    }
}

fn head(material: &Material) -> Head<'_> {
    Head {
        slug: material.slug.as_str(),
        name: &material.name,
        class: &material.class,
        description: material.description.trim(),
        licence: &material.licence,
        tags: &material.tags,
        render: &material.render,
    }
}

/// Levels of what scenes render.
fn levels(material: &Material) -> Vec<(String, String)> {
    let Ok(model) = material.scattering() else { return Vec::new() };
    let levels = Levels::rendered(material, &model);
    TABLE_DEG.map(|theta_deg| (format!("{theta_deg:.0}°"), levels.text(theta_deg))).to_vec()
}

fn source(source: &Source) -> SourceView<'_> {
    SourceView {
        key: &source.key,
        kind: source.kind.as_str(),
        title: source.titled(),
        link: link::of(source),
        licence: source.licence.as_deref(),
        note: source.note.as_deref(),
    }
}

/// As they are stored: a later program may know more of them than this one.
fn effects(material: &Material) -> Vec<EffectView> {
    let mut views = Vec::with_capacity(material.effects.len());
    for entry in &material.effects {
        let effect = effects::find(&entry.name);
        let mut parameters = Vec::new();
        for (name, value) in &entry.parameters {
            let known =
                effect.and_then(|effect| effect.parameters().iter().find(|k| k.name == name));
            let unit = known.map_or("", |parameter| parameter.unit);
            parameters.push([name.clone(), digits(*value), unit.to_owned()]);
        }
        views.push(EffectView {
            name: entry.name.clone(),
            source: entry.source.as_ref().map(|key| (key.clone(), place_of(material, key))),
            is: effect.map(|effect| effect.description()),
            parameters,
        });
    }
    views
}

/// What is not known: what the entry states, and what follows from its content.
fn unknown(material: &Material) -> Vec<String> {
    let mut found = gaps(&material.description);
    found.extend(material.unknown.iter().cloned());
    let unexplained = material.findings.iter().filter(|f| f.verdict == FindingVerdict::Unexplained);
    found.extend(
        unexplained.map(|f| format!("A residual that depends on {} is not explained.", f.effect)),
    );
    if !has_measured_curve(material) {
        found.push("This entry holds no measured curve.".to_owned());
    }
    for curve in material.curves.iter().filter(|curve| curve.illumination.relative) {
        found.push(format!(
            "The levels of curve {} are relative: the factor is not known.",
            curve.name
        ));
    }
    if material.fits.iter().all(|fit| fit.covariance.is_none()) {
        found.push("No number here carries an uncertainty.".to_owned());
    }
    if material.curves.iter().any(|curve| curve.instrument.is_none()) {
        found.push("A curve here names no instrument.".to_owned());
    }
    found
}

/// The claimed ranges of frequency and angle.
fn validity(material: &Material) -> [String; 2] {
    let range_ghz = material.frequency_hz.map(|hz| hz / 1e9);
    [range(range_ghz, "\u{a0}GHz"), range(range_deg(material), "°")]
}

fn range([low, high]: [f64; 2], unit: &str) -> String {
    if low == high {
        return format!("{}{unit}", digits(low));
    }
    format!("{}–{}{unit}", digits(low), digits(high))
}
