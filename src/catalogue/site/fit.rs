//! A fit: its parameters, which of them the data determine, and how far to trust it.

use serde::Serialize;
use serde_json::Value;

use super::entry::{kind_of, place_of};
use super::residuals;
use super::words::grouped;
use crate::brdf::Parameter;
use crate::formats::words::{as_typed, digits};
use crate::material::{ChosenBy, CrossValidation, Fit, FitNumber, FitReport, Material, SourceKind};
use crate::units::dbm_from_watts;

/// Parameters that backscatter sees only inside a product, and the product's name.
const PRODUCTS: [(&str, &str); 3] =
    [("specular.f_lambda", "S"), ("diffuse.r_s", "R"), ("k", "S and R")];

/// Replaces the kind of a value that is neither measured nor stated.
const CONVENTION: &str = "convention";

/// A fit as its page shows it.
#[derive(Debug, Serialize)]
pub(super) struct FitView {
    name: String,
    kind: &'static str,
    kind_words: Option<String>,
    model: String,
    method: String,
    curve: Option<String>,
    /// Whose lobes it has; none of a model without a lobe.
    lobes: Option<&'static str>,
    is_fitted: bool,
    is_rendered: bool,
    parameters: Vec<ParameterView>,
    products: Vec<ProductView>,
    has_values: bool,
    report: Option<ReportView>,
    /// Their drawing and what it says of itself.
    residuals: Option<(String, &'static str)>,
}

/// A line of the table of parameters.
#[derive(Debug, Serialize)]
struct ParameterView {
    path: String,
    value: String,
    unit: &'static str,
    sd: Option<String>,
    interval: Option<String>,
    range: String,
    source: String,
    source_place: usize,
    kind: &'static str,
    /// Whether the data determine it, in words and as a class of the style.
    told: String,
    is_told: bool,
}

/// A product of parameters that the data can determine.
#[derive(Debug, Serialize)]
struct ProductView {
    name: &'static str,
    is: &'static str,
    value: String,
    sd: Option<String>,
    interval: Option<String>,
}

/// The report of a fit.
#[derive(Debug, Serialize)]
struct ReportView {
    facts: Vec<(String, String)>,
    verdict: Vec<String>,
}

/// A fit as its page shows it; `number` is its place.
pub(super) fn view(material: &Material, number: usize, fit: &Fit) -> FitView {
    let told = fit.numbers();
    let parameters: Vec<ParameterView> =
        fit.model.parameters().iter().map(|p| parameter(material, fit, &told, p)).collect();
    FitView {
        name: fit.name.clone(),
        kind: word(material, &fit.source),
        kind_words: material.kind_words(fit),
        model: model_name(fit),
        method: method(&fit.estimator),
        curve: fit.curve.clone(),
        lobes: fit.lobes_words(),
        is_fitted: fit.is_fitted(),
        is_rendered: fit.name == material.render,
        has_values: !parameters.is_empty(),
        parameters,
        products: products(fit),
        report: fit.report.as_ref().map(report),
        residuals: residuals::picture(material, number, fit),
    }
}

/// An estimator in words; an unknown one keeps its name.
fn method(estimator: &str) -> String {
    match estimator {
        "stated" => "the numbers are stated",
        "censored" => "the likelihood of detections and of what stayed below the threshold",
        "tls" => "orthogonal distance in degrees and dB",
        "tls-tail" => "orthogonal distance in degrees and dB with a given tail",
        "mse" => "least squares in dB in two pieces",
        other => other,
    }
    .to_owned()
}

fn word(material: &Material, source: &str) -> &'static str {
    kind_of(material, source).map_or("unknown", SourceKind::as_str)
}

/// Names of the model and of its parts, as files write them.
fn model_name(fit: &Fit) -> String {
    let json = serde_json::to_value(&fit.model).unwrap_or_default();
    let parts = json.as_object().into_iter().flatten();
    let parts: Vec<&str> = parts.filter_map(|(_, part)| model_of(part)).collect();
    match model_of(&json) {
        Some(whole) if parts.is_empty() => whole.to_owned(),
        Some(whole) => format!("{whole} of {}", parts.join(" and ")),
        None => "unnamed".to_owned(),
    }
}

fn model_of(value: &Value) -> Option<&str> {
    value.get("model").and_then(Value::as_str)
}

fn parameter(
    material: &Material,
    fit: &Fit,
    told: &[FitNumber],
    parameter: &Parameter,
) -> ParameterView {
    let path = &parameter.path;
    let own = fit.parameter_sources.iter().find(|(known, _)| known == path);
    let source = own.map_or(&fit.source, |(_, source)| source);
    let own_told = told.iter().find(|told| told.name == *path);
    let stored_sd = fit.covariance.as_ref().and_then(|c| c.standard_deviation(path));
    let (told, is_told) = in_words(fit, path, own_told, stored_sd);
    ParameterView {
        path: path.clone(),
        value: if fit.is_fitted() { digits(parameter.value) } else { as_typed(parameter.value) },
        unit: parameter.unit,
        sd: own_told.and_then(|told| told.sd).or(stored_sd).map(digits),
        interval: own_told.and_then(|told| told.interval_95).map(interval),
        range: interval([parameter.min, parameter.max]),
        source: source.clone(),
        source_place: place_of(material, source),
        kind: match own_told {
            Some(told) if told.chosen_by == ChosenBy::Convention => CONVENTION,
            _ => word(material, source),
        },
        told,
        is_told,
    }
}

fn interval([low, high]: [f64; 2]) -> String {
    format!("{} to {}", digits(low), digits(high))
}

/// Whether the data determine a parameter, in words and as a flag.
fn in_words(
    fit: &Fit,
    path: &str,
    told: Option<&FitNumber>,
    stored_sd: Option<f64>,
) -> (String, bool) {
    let product = PRODUCTS.iter().find(|(known, _)| *known == path);
    let product = product.filter(|_| fit.identified_products().is_some());
    let convention = |name: &str| format!("only inside {name}; this value is a convention");
    match (told, product) {
        (Some(told), _) if told.is_identified() => ("yes".to_owned(), true),
        (Some(FitNumber { chosen_by: ChosenBy::Data, is_at_bound: true, sd: Some(_), .. }), _) => {
            ("told, but it ended at the end of its range".to_owned(), false)
        }
        (Some(FitNumber { chosen_by: ChosenBy::Data, sd: Some(_), .. }), _) => {
            ("no: others can make up for a change of it".to_owned(), false)
        }
        (Some(FitNumber { chosen_by: ChosenBy::Data, .. }), _) => {
            ("no: the data leave it open".to_owned(), false)
        }
        (Some(FitNumber { chosen_by: ChosenBy::Hand, .. }), _) => {
            ("no: held at this value".to_owned(), false)
        }
        (None, _) if fit.curve.is_none() => ("no fit: stated".to_owned(), false),
        (_, Some((_, name))) => (convention(name), false),
        (Some(_), None) => (convention("a product"), false),
        _ if stored_sd.is_some() => ("yes, as the source states".to_owned(), true),
        _ => ("not said".to_owned(), false),
    }
}

fn products(fit: &Fit) -> Vec<ProductView> {
    let Some([specular, diffuse]) = fit.identified_products() else { return Vec::new() };
    vec![product(fit, "S", "(1 − k) · f_lambda", specular), product(fit, "R", "k · r_s", diffuse)]
}

fn product(fit: &Fit, name: &'static str, is: &'static str, value: f64) -> ProductView {
    let estimate = fit.report.as_ref().and_then(|report| report.estimate(name));
    ProductView {
        name,
        is,
        value: digits(value),
        sd: estimate.and_then(|e| e.sd).map(digits),
        interval: estimate.and_then(|e| e.interval_95).map(interval),
    }
}

fn held_out(held: &CrossValidation) -> String {
    let of = held.of();
    let score = held.score.zip(held.score_sd).map_or(String::new(), |(score, sd)| {
        format!("; mean ln p of a point {score:.4} ± {sd:.4}")
    });
    let CrossValidation { folds, blocks, rms_db, .. } = held;
    format!("{rms_db:.2} dB rms in {folds} turns of {} {of}{score}", grouped(*blocks as usize))
}

/// How far the form of the law is off, which no band holds.
fn form_error(report: &FitReport) -> String {
    match report.goodness.form_error_db() {
        Some(0.0) => "no more than the noise hides".to_owned(),
        Some(db) => format!("{db:.2} dB rms beyond the noise; the band does not hold it"),
        None => "not known: no noise is stated".to_owned(),
    }
}

fn report(report: &FitReport) -> ReportView {
    let g = &report.goodness;
    let end = if report.converged { "converged" } else { "did not converge" };
    let speckle =
        g.speckle_db.map_or(String::new(), |db| format!("; speckle alone scatters by {db:.2} dB"));
    let noise = if report.noise_w > 0.0 {
        format!("{} dBm", digits(dbm_from_watts(report.noise_w)))
    } else {
        "none".to_owned()
    };
    let given: Vec<String> =
        report.given.iter().map(|g| format!("{} = {}", g.name, digits(g.value))).collect();
    let singular: Vec<String> = report.singular_values.iter().map(|v| digits(*v)).collect();
    let mut facts = vec![
        ("Method", report.method.clone()),
        ("Search", format!("{end} ({}) after {} steps", report.stop, report.iterations)),
        ("Starts that agree", format!("{} of {}", report.agreeing_starts, report.starts)),
        ("Looks", report.looks.map_or("not used".to_owned(), digits)),
        ("Noise floor", noise),
        ("Set, not found", if given.is_empty() { "nothing".to_owned() } else { given.join(", ") }),
        ("Detections off the model", format!("{:.2} dB rms{speckle}", g.rms_db)),
        ("The form of the law is off", form_error(report)),
        (
            "Residuals against their law",
            format!(
                "{} rows, mean {}, variance {}, distance {}",
                grouped(g.rows as usize),
                digits(g.z_mean),
                digits(g.z_variance),
                digits(g.ks_distance)
            ),
        ),
        (
            "Points held out",
            report.held_out.as_ref().map_or("not tried, or not possible".to_owned(), held_out),
        ),
        ("Singular values", singular.join(", ")),
        ("Data, BLAKE3", report.data_hash.clone()),
        ("Seed and program", format!("{}, matdb {}", report.seed, report.version)),
    ];
    facts.extend(report.gauge.as_ref().map(|gauge| ("Convention", gauge.clone())));
    let facts = facts.into_iter().map(|(name, text)| (name.to_owned(), text)).collect();
    ReportView { facts, verdict: report.verdict.clone() }
}
