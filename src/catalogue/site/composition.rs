//! Layers, permittivities, status, sessions and findings of a material.

use serde::Serialize;

use super::entry::place_of;
use super::quantity::quantity;
use super::spectra::{self, SpectrumView};
use crate::effects::find;
use crate::formats::words::{as_typed, digits, plus_minus};
use crate::material::{Finding, FindingVerdict, Layer, Material, Permittivity, Session, Status};

/// These parts as the page of a material shows them.
#[derive(Serialize)]
pub(super) struct Composition {
    status: Option<StatusView>,
    finish: Option<String>,
    /// In a sentence, and the place of its source.
    roughness: Option<(String, usize)>,
    layers: Vec<LayerView>,
    permittivities: Vec<PermittivityView>,
    spectra: Vec<SpectrumView>,
    sessions: Vec<SessionView>,
    findings: Vec<FindingView>,
}

/// Why an entry is no longer to be used.
#[derive(Serialize)]
struct StatusView {
    word: &'static str,
    reason: String,
    by: Option<String>,
}

#[derive(Serialize)]
struct LayerView {
    cells: [String; 3],
    /// Key of its source and its place.
    source: Option<(String, usize)>,
}

#[derive(Serialize)]
struct PermittivityView {
    cells: [String; 5],
    source: String,
    source_place: usize,
}

#[derive(Serialize)]
struct SessionView {
    key: String,
    facts: Vec<String>,
    note: Option<String>,
}

#[derive(Serialize)]
struct FindingView {
    effect: String,
    level: &'static str,
    verdict: &'static str,
    numbers: [Option<String>; 3],
    confusable: String,
    source: String,
    source_place: usize,
}

/// These parts of a material for its page.
pub(super) fn view(material: &Material) -> Composition {
    Composition {
        status: status(&material.status),
        finish: material.finish.clone(),
        roughness: roughness(material),
        layers: material.layers.iter().map(|l| layer(material, l)).collect(),
        permittivities: material.permittivities.iter().map(|p| permittivity(material, p)).collect(),
        spectra: spectra::view(material),
        sessions: material.sessions.iter().map(session).collect(),
        findings: material.findings.iter().map(|f| finding(material, f)).collect(),
    }
}

fn status(status: &Status) -> Option<StatusView> {
    let reason = status.reason()?.to_owned();
    let by = status.superseded_by().map(ToString::to_string);
    Some(StatusView { word: status.as_str(), reason, by })
}

fn roughness(material: &Material) -> Option<(String, usize)> {
    let roughness = material.roughness.as_ref()?;
    let mut text = format!("{} µm rms", as_typed(roughness.rms_height_m * 1e6));
    if let Some(length_m) = roughness.correlation_length_m {
        text += &format!(", correlated over {} µm", as_typed(length_m * 1e6));
    }
    text += &roughness.method.as_ref().map_or(String::new(), |method| format!(", {method}"));
    Some((text, place_of(material, &roughness.source)))
}

fn layer(material: &Material, layer: &Layer) -> LayerView {
    let thickness = layer.thickness_m.map(|m| as_typed(m * 1e3));
    LayerView {
        cells: [
            layer.name.clone(),
            thickness.unwrap_or("half space".to_owned()),
            layer.permittivity.clone().unwrap_or("not known".to_owned()),
        ],
        source: layer.source.as_ref().map(|key| (key.clone(), place_of(material, key))),
    }
}

fn permittivity(material: &Material, entry: &Permittivity) -> PermittivityView {
    let from = entry.frequency_source.as_ref().map_or(String::new(), |key| format!(", {key}"));
    let celsius = entry.temperature_k.map(|k| as_typed(k - 273.15));
    PermittivityView {
        cells: [
            entry.key.clone(),
            as_typed(entry.frequency_hz / 1e9) + &from,
            celsius.unwrap_or("not stated".to_owned()),
            with_sd(entry.real, entry.real_sd),
            with_sd(entry.imaginary, entry.imaginary_sd),
        ],
        source: entry.source.clone(),
        source_place: place_of(material, &entry.source),
    }
}

/// A number that a source states, in the digits that it states, which rounding to its deviation would change.
fn with_sd(value: f64, sd: Option<f64>) -> String {
    as_typed(value) + &sd.map_or(String::new(), |sd| format!(" ± {}", as_typed(sd)))
}

fn session(session: &Session) -> SessionView {
    let [normal_sd_deg, footprint_sd_deg] =
        [session.normal_sd_rad, session.footprint_sd_rad].map(|sd| sd.map(f64::to_degrees));
    let parts = [
        quantity("at", session.temperature_k.map(|k| k - 273.15), "°C"),
        quantity("humidity", session.relative_humidity.map(|share| share * 100.0), "%"),
        quantity("registered to", session.registration_rms_m.map(|m| m * 1e3), "mm rms"),
        quantity("normals known to", normal_sd_deg, "°"),
        quantity("normals spread in a footprint by", footprint_sd_deg, "°"),
        session.cloud_hash.as_ref().map(|hash| format!("cloud {hash}")),
        session.mesh_hash.as_ref().map(|hash| format!("mesh {hash}")),
    ];
    let date = std::iter::once(session.date.clone());
    SessionView {
        key: session.key.clone(),
        facts: date.chain(parts.into_iter().flatten()).collect(),
        note: session.note.clone(),
    }
}

fn finding(material: &Material, finding: &Finding) -> FindingView {
    let verdict = match finding.verdict {
        FindingVerdict::Found => "found",
        FindingVerdict::NotFound => "looked for, not found",
        FindingVerdict::Unexplained => "there, and no effect explains it",
    };
    let sd = finding.score_difference_sd;
    let score = finding.score_difference;
    let score = score.map(|gain| sd.map_or(digits(gain), |sd| plus_minus(gain, sd)));
    FindingView {
        effect: finding.effect.clone(),
        level: find(&finding.effect).map_or("", |effect| effect.level().as_str()),
        verdict,
        numbers: [finding.size_db.map(digits), score, finding.p.map(digits)],
        confusable: finding.confusable_with.join(", "),
        source: finding.source.clone(),
        source_place: place_of(material, &finding.source),
    }
}
