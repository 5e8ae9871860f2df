//! A material's picture, its curves in words and by steps.

use serde::Serialize;

use super::bins::{Bin, bins};
use super::entry::{kind_of, place_of};
use super::levels::{FAINTEST_DB, Levels, TABLE_DEG, angles_deg, range_deg};
use super::picture::Picture;
use super::quantity::quantity;
use super::words::grouped;
use crate::brdf::ThroughBeam;
use crate::fit::stored_band;
use crate::formats::figure::{Ink, Series, Style};
use crate::formats::words::{digits, percent};
use crate::material::{Censor, Curve, Fit, Instrument, Material, Observation, SourceKind};
use crate::units::{db_from_ratio, dbm_from_watts};

/// Number of inks that the style has.
const INKS: usize = 6;

/// A line of the legend.
#[derive(Debug, Serialize)]
pub(super) struct Sample {
    pub(super) name: String,
    pub(super) kind: &'static str,
    /// The words of the badge, where they differ from the kind.
    pub(super) kind_words: Option<String>,
    /// `line`, `dots`, `below` or `above`.
    pub(super) shape: &'static str,
    pub(super) class: String,
    /// The note after the name.
    pub(super) note: &'static str,
}

/// A curve in words.
#[derive(Debug, Serialize)]
pub(super) struct CurveView {
    name: String,
    kind: &'static str,
    source: String,
    source_place: usize,
    /// How many points, and how many of them are only bounds.
    count: String,
    instrument: Option<InstrumentView>,
    /// The form of the footprint and the beam.
    lit: String,
    bins: Vec<Bin>,
    /// Points that are not backscatter and so not in the picture.
    bistatic: Option<String>,
}

/// What a curve was measured with.
#[derive(Debug, Serialize)]
pub(super) struct InstrumentView {
    name: String,
    facts: Vec<String>,
    note: Option<String>,
}

/// Everything drawn together, with its legend.
pub(super) fn picture(material: &Material) -> (Option<String>, Vec<Sample>) {
    let mut series: Vec<(String, Series)> = Vec::new();
    let mut samples = Vec::new();
    let curves = material.curves.len();
    for (number, fit) in material.fits.iter().enumerate() {
        series.extend(band(material, fit).map(|band| (ink(curves + number), band)));
    }
    for (number, curve) in material.curves.iter().enumerate() {
        let (drawn, named) = points(curve, kind_of(material, &curve.source), &ink(number));
        series.extend(drawn);
        samples.extend(named);
    }
    for (number, fit) in material.fits.iter().enumerate() {
        let class = format!("{} is-{}", ink(curves + number), line_word(material, fit));
        // Next to its curve a fit is drawn as the beam of the curve sees it.
        let seen = ThroughBeam { law: &fit.model, beam_rad: material.beam_rad(fit) };
        series.extend(lines(&fit.name, &Levels::stated(material, &seen), &class));
        samples.push(Sample {
            name: fit.name.clone(),
            kind: word(kind_of(material, &fit.source)),
            kind_words: material.kind_words(fit),
            shape: "line",
            class,
            note: match &fit.report {
                Some(report) if report.converged => "with the 95 % band of its numbers",
                _ => "",
            },
        });
    }
    if let Some(number) = material.curves.iter().position(|curve| curve.name == material.render)
        && let Ok(model) = material.scattering()
    {
        let class = format!("{} {}", ink(number), class_of(material.render_kind()));
        let name = "between the points".to_owned();
        series.extend(lines(&name, &Levels::rendered(material, &model), &class));
        let kind = word(material.render_kind());
        samples.push(Sample { name, kind, kind_words: None, shape: "line", class, note: "" });
    }
    let picture = Picture {
        id: "curve".to_owned(),
        title: format!("Backscatter of {}", material.name),
        description: description(material),
        y_label: "σ⁰, dB",
        y_range: None,
        series,
    };
    (picture.svg(material), samples)
}

/// The unbroken pieces of a model's curve.
fn lines(name: &str, levels: &Levels, class: &str) -> Vec<(String, Series)> {
    let mut lines = Vec::new();
    for points in levels.line() {
        let (name, ink) = (name.to_owned(), Ink::Own(0));
        let line = Series { name, style: Style::Curve, ink, points };
        lines.push((class.to_owned(), line));
    }
    lines
}

/// The picture in words, for those who do not see it.
fn description(material: &Material) -> String {
    let mut text = "σ⁰ in dB over the angle of incidence. ".to_owned();
    if let Ok(model) = material.scattering() {
        let levels = Levels::rendered(material, &model);
        let named = TABLE_DEG.iter().filter_map(|&deg| {
            let level_db = levels.db(deg)?;
            Some(format!("{level_db:.1} dB at {deg:.0}°"))
        });
        text += &named.collect::<Vec<_>>().join(", ").replace('-', "−");
        text += ". ";
    }
    text += "The tables below hold the same numbers.";
    text
}

/// The class of a series by its place.
pub(super) fn ink(number: usize) -> String {
    format!("ink{}", number % INKS)
}

/// The class of a kind: kinds differ by their line, not only by a word.
pub(super) fn class_of(kind: Option<SourceKind>) -> String {
    format!("is-{}", word(kind))
}

pub(super) fn word(kind: Option<SourceKind>) -> &'static str {
    kind.map_or("unknown", SourceKind::as_str)
}

/// The word for the style of a fit's line. A model that was stated with measured points is not drawn as measured.
pub(super) fn line_word(material: &Material, fit: &Fit) -> &'static str {
    let kind = kind_of(material, &fit.source);
    let is_stated = fit.curve.is_some() && !fit.is_fitted();
    if is_stated && kind == Some(SourceKind::Measured) { "stated" } else { word(kind) }
}

/// Detections and bounds of a curve, (°, dB), as three kinds of marks.
pub(super) fn marks(observations: &[Observation]) -> [(Style, Vec<(f64, f64)>); 3] {
    let mut found = [Style::Points, Style::Below, Style::Above].map(|style| (style, Vec::new()));
    for o in observations.iter().filter(|o| o.is_retro()) {
        let (place, sigma0) = match (o.sigma0, o.threshold_sigma0, o.censor) {
            (Some(sigma0), ..) => (0, sigma0),
            (None, Some(threshold), Censor::Right) => (2, threshold),
            (None, Some(threshold), _) => (1, threshold),
            (None, None, _) => continue,
        };
        found[place].1.push((o.theta_i_rad.to_degrees(), db_from_ratio(sigma0)));
    }
    found
}

/// Detections and bounds of a curve, each with its line of the legend.
fn points(
    curve: &Curve,
    kind: Option<SourceKind>,
    ink: &str,
) -> (Vec<(String, Series)>, Vec<Sample>) {
    let class = format!("{ink} {}", class_of(kind));
    let (mut drawn, mut samples) = (Vec::new(), Vec::new());
    for (style, points) in marks(&curve.observations) {
        if points.is_empty() {
            continue;
        }
        let (shape, note) = match style {
            Style::Below => ("below", "no detection: the value lies below"),
            Style::Above => ("above", "beyond the instrument: the value lies above"),
            _ => ("dots", "detections"),
        };
        let (name, ink) = (curve.name.clone(), Ink::Detections);
        drawn.push((class.clone(), Series { name: name.clone(), style, ink, points }));
        let class = class.clone();
        samples.push(Sample { name, kind: word(kind), kind_words: None, shape, class, note });
    }
    (drawn, samples)
}

/// The 95 % band of a fit that has a report.
fn band(material: &Material, fit: &Fit) -> Option<Series> {
    let (mut points, mut upper) = (Vec::new(), Vec::new());
    for theta_deg in angles_deg(range_deg(material)) {
        let Some(band) = stored_band(fit, material.beam_rad(fit), theta_deg.to_radians()) else {
            continue;
        };
        let [low_db, high_db] = [band.low, band.high].map(db_from_ratio);
        if high_db >= FAINTEST_DB {
            points.push((theta_deg, low_db.max(FAINTEST_DB)));
            upper.push((theta_deg, high_db));
        }
    }
    // Along the lower end and back along the upper one.
    points.extend(upper.into_iter().rev());
    let (name, ink) = (String::new(), Ink::Own(0));
    (points.len() > 2).then_some(Series { name, style: Style::Band, ink, points })
}

/// A curve in words.
pub(super) fn view(material: &Material, curve: &Curve) -> CurveView {
    let instrument = curve.instrument.as_ref();
    let instrument = instrument.and_then(|key| material.instruments.iter().find(|i| i.key == *key));
    let bistatic = curve.observations.iter().filter(|o| !o.is_retro()).count();
    CurveView {
        name: curve.name.clone(),
        kind: word(kind_of(material, &curve.source)),
        source: curve.source.clone(),
        source_place: place_of(material, &curve.source),
        count: count(curve),
        instrument: instrument.map(instrument_view),
        lit: format!(
            "{}; {}",
            curve.illumination.footprint_words(),
            curve.illumination.beam_words()
        ),
        bins: bins(curve),
        bistatic: (bistatic > 0).then(|| grouped(bistatic)),
    }
}

fn count(curve: &Curve) -> String {
    let observations = &curve.observations;
    let [left, right] = [Censor::Left, Censor::Right]
        .map(|censor| observations.iter().filter(|o| o.censor == censor).count());
    let all = observations.len();
    let mut text = format!("{} points.", grouped(all));
    if curve.illumination.only_detected {
        return text
            + " Only detections were recorded: where few chirps pass the threshold, their mean is too high.";
    }
    if left + right == 0 {
        return text + " All were detected.";
    }
    let sides = [
        (
            left,
            "gave no detection: the value lies below the detection limit, drawn as a triangle there",
        ),
        (right, "are beyond the instrument's range: the value lies above the level drawn"),
    ];
    for (part, what) in sides.into_iter().filter(|(part, _)| *part > 0) {
        text += &format!(" {} of them ({}) {what}.", grouped(part), percent(part, all));
    }
    text
}

fn instrument_view(instrument: &Instrument) -> InstrumentView {
    let mut facts = vec![format!("{} GHz", digits(instrument.centre_frequency_hz / 1e9))];
    facts.extend(instrument.bandwidth_hz.map(|hz| format!("bandwidth {} GHz", digits(hz / 1e9))));
    facts.extend(instrument.polarisation.as_ref().map(|p| format!("polarisation {p}")));
    let i = instrument;
    let text =
        |what: &str, text: &Option<String>| text.as_ref().map(|text| format!("{what} {text}"));
    let more = [
        text("sends", &i.transmit_polarisation),
        text("receives", &i.receive_polarisation),
        i.geometry.map(|geometry| geometry.as_str().to_owned()),
        quantity("stand-off", i.stand_off_m, "m"),
        quantity("spot", i.spot_diameter_m.map(|m| m * 1e3), "mm"),
        quantity("aperture", i.aperture_m, "m"),
        text("calibrated with", &i.calibration_target),
        quantity("calibration known to", i.calibration_sd_factor.map(db_from_ratio), "dB"),
        i.scale.map(|scale| format!("{} levels", scale.as_str())),
        quantity("noise floor", i.noise_floor_w.map(dbm_from_watts), "dBm"),
        quantity("threshold", i.threshold_w.map(dbm_from_watts), "dBm"),
        quantity("false-alarm probability", i.false_alarm_probability, "per chirp"),
        i.range_bins.map(|bins| format!("{bins} range bins searched")),
        quantity("looks", i.looks, "in one value"),
        text("looks were", &i.looks_method),
    ];
    facts.extend(more.into_iter().flatten());
    InstrumentView { name: instrument.name.clone(), facts, note: instrument.note.clone() }
}
