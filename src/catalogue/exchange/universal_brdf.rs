//! Universal BRDF files (`.brdf`), JSON: the format of the EMPIR project BxDiff, schema 1.0 (repository
//! BiRD-project/BiRD_view, commit a1ed342, MIT).
//!
//! Angles are in rad, azimuths in degrees since the schema stops them at π in rad, the wavelength in
//! µm, f in 1/sr with σ⁰ = 4π·f·cos θ_i·cos θ_r. Azimuths are of the directions to source and receiver,
//! so that backscatter has φ_r = φ_i. `uBRDF` is one standard deviation, by calibration and speckle,
//! as far as the instrument states them. The format knows no detection limit: a point below it has
//! f = 0 with the limit as `uBRDF`, one above the range has the limit as f, and `adhoc_variables` says
//! `censor` and `threshold_brdf` for every point.
//!
//! Lost: fits, effects, permittivities, layers, findings, every curve but one, and of its points the power, range, chirp,
//! place and angle error. The instrument is
//! in `adhoc_section`, because the format wants lamp and photodiode. Postal address and e-mail, which
//! it demands, are not known here and say so.

use serde_json::{Map, Value, json};

use super::error::ExchangeError;
use super::export_files::Export;
use super::plain_csv::describe;
use super::subject::{Points, Subject, cited, one_line};
use crate::material::{Censor, Observation, SourceKind};

const SCHEMA: &str = "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json";
/// Key of what only matdb reads.
pub(super) const OURS: &str = "matdb";
pub(super) const CENSOR: &str = "censor";
pub(super) const THRESHOLD: &str = "threshold_brdf";
const UNSTATED: &str = "not stated";

/// Writes the curve, or what the model says at every degree.
pub(super) fn write(subject: &Subject, name: &str) -> Result<Export, ExchangeError> {
    let points = subject.points();
    let file = json!({ "metadata": metadata(subject, &points), "data": data(&points) });
    let text = serde_json::to_string_pretty(&file);
    let text = text.map_err(|error| ExchangeError::encoding("JSON", error))? + "\n";
    let lost = format!(
        "the file holds {}; fits, effects, permittivities and layers have no place in the format, nor have the power, \
         range, chirp, place and angle error of a point, and a detection limit has one only in adhoc_variables",
        describe(&points)
    );
    Ok(Export { files: vec![(name.to_owned(), text.into_bytes())], lost })
}

fn metadata(subject: &Subject, points: &Points) -> Value {
    let material = subject.material;
    let kind = points.source.map(|source| source.kind);
    let is_measured = kind == Some(SourceKind::Measured) && points.curve.is_some();
    let source = points.source.map(cited).unwrap_or_else(|| UNSTATED.to_owned());
    let citation = points.source.map(|source| &source.citation);
    let organization = citation.and_then(|citation| citation.publisher.clone());
    let authors = citation.map(|citation| citation.authors.join("; ")).unwrap_or_default();
    let contact = if authors.is_empty() { UNSTATED.to_owned() } else { authors };
    let session = session(subject, points);
    let environment = session.and_then(|session| session.temperature_k).map(|temperature_k| {
        let mut environment = json!({ "temperature": { "value": temperature_k, "unit": "K" } });
        if let Some(humidity) = session.and_then(|session| session.relative_humidity) {
            environment["relative_humidity"] = json!({ "value": humidity * 100.0, "unit": "%" });
        }
        environment
    });
    json!({
        "schema": SCHEMA,
        "id": format!("urn:matdb:{}:{}", material.slug, material.content_hash()),
        "type": "BRDF",
        "timestamp": timestamp(subject, points),
        "provenance": {
            "organization": organization.unwrap_or_else(|| UNSTATED.to_owned()),
            "location": {
                "country": UNSTATED, "city": UNSTATED, "street": UNSTATED, "building_nr": UNSTATED,
                "postal_code": UNSTATED,
            },
            "email": "not-stated@example.invalid",
            "contact_person": contact,
            "comments": source,
        },
        "license": { "type": material.licence, "rights_holder": contact },
        "description": format!("{}. {}", subject.title(), material.description).trim(),
        "method": if is_measured { "measurement" } else { "simulation" },
        "instrumentation": "NA",
        "software": if is_measured { json!("NA") } else {
            json!({ "name": "matdb", "version": env!("CARGO_PKG_VERSION") })
        },
        "sample": {
            "name": material.name,
            "type": material.class,
            "shape": UNSTATED,
            "dimensions": {},
            "zero_azimuth_location": "towards the source: phi_i is always 0",
        },
        "environment": environment.unwrap_or_else(|| json!("NA")),
        "comments": subject.about().join("\n"),
        "adhoc_section": { OURS: {
            "slug": material.slug,
            "revision": subject.revision,
            "kind": kind,
            "source": points.source.map(|source| one_line(&source.titled())),
            "licence_of_source": points.source.and_then(|source| source.licence.clone()),
            "instrument": points.instrument,
            "illumination": points.curve.map(|curve| curve.illumination),
        } },
    })
}

fn session<'a>(subject: &Subject<'a>, points: &Points) -> Option<&'a crate::material::Session> {
    let key = points.curve?.session.as_ref()?;
    subject.material.sessions.iter().find(|session| session.key == *key)
}

/// Day of the session, else when the entry was added, else the start of all time stamps.
fn timestamp(subject: &Subject, points: &Points) -> String {
    match (session(subject, points), subject.added_at) {
        (Some(session), _) => format!("{}T00:00:00Z", session.date),
        (None, Some(added_at)) => added_at.to_owned(),
        (None, None) => "1970-01-01T00:00:00Z".to_owned(),
    }
}

fn data(points: &Points) -> Value {
    let wavelength_um = points.wavelength_m() * 1e6;
    let mut data = json!({
        "wavelength_i": { "unit": "μm", "values": column(points, |_| json!(wavelength_um)) },
        "theta_i": { "unit": "rad", "values": column(points, |o| json!(o.theta_i_rad)) },
        "phi_i": { "unit": "deg", "values": column(points, |_| json!(0.0)) },
        "theta_r": { "unit": "rad", "values": column(points, |o| json!(o.theta_r_rad)) },
        "phi_r": { "unit": "deg", "values": column(points, |o| json!(phi_deg(o))) },
        "BRDF": {
            "unit": "sr^-1",
            "values": column(points, |o| json!(value_per_sr(o))),
            "comments": "where censor is left the true value lies between 0 and threshold_brdf, where \
                         it is right above the value given",
        },
        "adhoc_variables": {
            CENSOR: {
                "description": "none: measured; left: below the detection limit; right: above the \
                                instrument's range.",
                "unit": "", "type": "string", "values": column(points, |o| json!(o.censor.as_str())),
            },
            THRESHOLD: {
                "description": "Detection limit that applied to the point, as a BRDF; null: not stated.",
                "unit": "1/sr", "type": "number", "values": column(points, |o| json!(threshold_per_sr(o))),
            },
        },
    });
    if let (Some(share), Some(data)) = (relative_deviation(points), data.as_object_mut()) {
        let values = column(points, |o| match (o.sigma0, threshold_per_sr(o)) {
            (None, Some(threshold)) => json!(threshold),
            _ => json!(share * value_per_sr(o)),
        });
        data.insert("uBRDF".to_owned(), deviations(&values));
    }
    data
}

/// A value for every point.
fn column(points: &Points, value: impl Fn(&Observation) -> Value) -> Vec<Value> {
    points.observations.iter().map(value).collect()
}

/// f of a point, 1/sr: the limit where it is above the instrument's range, 0 where it is below the threshold.
fn value_per_sr(o: &Observation) -> f64 {
    match (o.sigma0, o.censor) {
        (Some(sigma0), _) => sigma0 / o.aspect().sigma0_per_f(),
        (None, Censor::Right) => threshold_per_sr(o).unwrap_or(0.0),
        (None, _) => 0.0,
    }
}

fn threshold_per_sr(o: &Observation) -> Option<f64> {
    o.threshold_sigma0.map(|threshold| threshold / o.aspect().sigma0_per_f())
}

fn phi_deg(o: &Observation) -> f64 {
    (o.delta_phi_rad.to_degrees() + 360.0) % 360.0
}

fn deviations(values: &[Value]) -> Value {
    let mut entry = Map::new();
    entry.insert("unit".to_owned(), json!("sr^-1"));
    entry.insert("values".to_owned(), json!(values));
    let comments = "one standard deviation, by the calibration and by speckle, as far as the instrument \
                    states them; of a censored point its detection limit";
    entry.insert("comments".to_owned(), json!(comments));
    Value::Object(entry)
}

/// One standard deviation of a level over the level; none where the instrument states nothing.
fn relative_deviation(points: &Points) -> Option<f64> {
    let instrument = points.instrument?;
    let calibration = instrument.calibration_sd_factor.map(|factor| factor - 1.0);
    let speckle = instrument.looks.map(|looks| 1.0 / looks.sqrt());
    match (calibration, speckle) {
        (None, None) => None,
        (a, b) => Some(a.unwrap_or(0.0).hypot(b.unwrap_or(0.0))),
    }
}
