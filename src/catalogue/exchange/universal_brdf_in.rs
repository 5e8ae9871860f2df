//! Reading universal BRDF files (`.brdf`), which `universal_brdf.rs` writes, as a curve.
//!
//! One wavelength and one state of polarisation are read. Lost: uncertainties, instrumentation,
//! sample and environment of files that matdb did not write; postal addresses of all.

use serde_json::Value;

use super::detail::Detail;
use super::details::{Details, missing};
use super::error::ExchangeError;
use super::plain_csv::{RADAR, SingleCurve, of_curve};
use super::universal_brdf::{CENSOR, OURS, THRESHOLD};
use crate::formats::FormatError;
use crate::material::{
    Aspect, Censor, Illumination, Instrument, Material, Observation, SourceKind,
};
use crate::units::SPEED_OF_LIGHT_M_PER_S;

/// Makes a material of a file.
pub(super) fn read(file: &str, bytes: &[u8], given: &Details) -> Result<Material, ExchangeError> {
    let (json, observations, wavelength_m) =
        parse(bytes).map_err(|error| ExchangeError::in_file(file, error))?;
    let metadata = &json["metadata"];
    let ours = &metadata["adhoc_section"][OURS];
    let hz =
        given.frequency_hz.or(wavelength_m.map(|wavelength| SPEED_OF_LIGHT_M_PER_S / wavelength));
    let kind = given.kind.or_else(|| kind(metadata, ours));
    let name = given.instrument.clone().or_else(|| {
        text(&ours["instrument"]["name"]).or(text(&metadata["instrumentation"]["name"]))
    });
    let licence = given.licence.clone().or(text(&metadata["license"]["type"]));
    let source = given.source.clone().or(text(&ours["source"])).or(text(&metadata["description"]));
    let is_named = name.is_some() || kind != Some(SourceKind::Measured);
    let threshold_w = given.threshold_w.or(ours["instrument"]["threshold_w"].as_f64());
    let is_limited = kind != Some(SourceKind::Measured)
        || threshold_w.is_some()
        || observations.iter().all(|row| row.threshold_sigma0.is_some());
    let details = [
        (given.slug.is_some(), Detail::Name),
        (given.class.is_some(), Detail::Class),
        (licence.is_some(), Detail::Licence),
        (source.is_some(), Detail::Source),
        (kind.is_some(), Detail::Kind),
        (hz.is_some(), Detail::Frequency),
        (is_named, Detail::Instrument),
        (is_limited, Detail::Threshold),
    ];
    let is_whole = is_named && is_limited;
    let (Some(slug), Some(class), Some(licence), Some(title), Some(kind), Some(hz), true) =
        (given.slug.clone(), given.class.clone(), licence, source, kind, hz, is_whole)
    else {
        return Err(missing(file, &details));
    };
    let stated = &ours["instrument"];
    let instrument = name.map(|name| Instrument {
        key: RADAR.to_owned(),
        name,
        centre_frequency_hz: hz,
        bandwidth_hz: stated["bandwidth_hz"].as_f64(),
        calibration_sd_factor: stated["calibration_sd_factor"].as_f64(),
        looks: stated["looks"].as_f64(),
        threshold_w,
        ..Instrument::default()
    });
    // Another program's f is stated as f, without the form in which it was reduced.
    let illumination: Option<Illumination> = serde_json::from_value(ours["illumination"].clone())
        .map_err(|error| {
        let place = format!("metadata.adhoc_section.{OURS}.illumination");
        let problem = format!("it cannot be read: {error}");
        ExchangeError::in_file(file, FormatError::at(place, problem, "correct or remove it"))
    })?;
    let single = SingleCurve {
        slug,
        class,
        licence,
        title,
        kind,
        hz,
        instrument,
        illumination: illumination.unwrap_or_default(),
        observations,
    };
    Ok(of_curve(file, given, single))
}

/// The file as JSON, with its points and its wavelength, m.
fn parse(bytes: &[u8]) -> Result<(Value, Vec<Observation>, Option<f64>), FormatError> {
    let json: Value = serde_json::from_slice(bytes).map_err(|error| {
        let place = format!("line {}, column {}", error.line(), error.column());
        FormatError::at(place, "not JSON", "mend the file, or name another")
    })?;
    let observations = observations(&json["data"])?;
    let wavelength_m = wavelength_m(&json["data"])?;
    Ok((json, observations, wavelength_m))
}

fn text(value: &Value) -> Option<String> {
    value.as_str().map(str::to_owned)
}

fn kind(metadata: &Value, ours: &Value) -> Option<SourceKind> {
    let ours = serde_json::from_value(ours["kind"].clone()).ok().flatten();
    ours.or(match metadata["method"].as_str() {
        Some("measurement") => Some(SourceKind::Measured),
        Some("simulation") => Some(SourceKind::Modelled),
        _ => None,
    })
}

fn observations(data: &Value) -> Result<Vec<Observation>, FormatError> {
    for key in ["polarization_i", "polarization_r"] {
        one_state(data, key)?;
    }
    let [theta_i, phi_i] = [angles_rad(data, "theta_i")?, angles_rad(data, "phi_i")?];
    let [theta_r, phi_r] = [angles_rad(data, "theta_r")?, angles_rad(data, "phi_r")?];
    let brdf = numbers(data, "BRDF")?;
    let columns =
        [("theta_i", &theta_i), ("phi_i", &phi_i), ("theta_r", &theta_r), ("phi_r", &phi_r)];
    if let Some((key, _)) = columns.iter().find(|(_, column)| column.len() != brdf.len()) {
        return Err(refuse(key, "has not as many values as BRDF", "give one for each"));
    }
    let censors = censors(data, brdf.len())?;
    let mut observations = Vec::with_capacity(brdf.len());
    for (row, (&value, limit)) in brdf.iter().zip(censors).enumerate() {
        let (theta_i_rad, theta_r_rad) = (theta_i[row], theta_r[row]);
        let delta_phi_rad = phi_r[row] - phi_i[row];
        let aspect = Aspect { theta_i_rad, theta_r_rad, delta_phi_rad };
        let per_f = aspect.sigma0_per_f();
        let sigma0 = per_f * value;
        let is_level = sigma0 > 0.0 && sigma0.is_finite();
        if limit.censor == Censor::None && !is_level {
            let place = format!("data.BRDF, value {}", row + 1);
            let problem = format!("{value} is not a level in dB");
            return Err(FormatError::at(place, problem, "leave the point out, or censor it"));
        }
        let level = (limit.censor == Censor::None).then_some(sigma0);
        let threshold = limit.threshold.map(|threshold| per_f * threshold);
        observations.push(Observation {
            theta_r_rad,
            delta_phi_rad,
            censor: limit.censor,
            ..Observation::backscatter(theta_i_rad, level, threshold)
        });
    }
    Ok(observations)
}

/// A column of angles, rad.
fn angles_rad(data: &Value, key: &str) -> Result<Vec<f64>, FormatError> {
    let angles = numbers(data, key);
    match data[key]["unit"].as_str() {
        Some("rad") => angles,
        Some("deg" | "°") => Ok(angles?.into_iter().map(f64::to_radians).collect()),
        _ => Err(refuse(key, "has no unit rad or deg", "state the unit")),
    }
}

/// Whether a point is censored, and its detection limit as f, 1/sr.
#[derive(Clone, Copy)]
struct Limit {
    censor: Censor,
    threshold: Option<f64>,
}

fn censors(data: &Value, len: usize) -> Result<Vec<Limit>, FormatError> {
    let (words, thresholds) =
        (extra_column(data, CENSOR, len)?, extra_column(data, THRESHOLD, len)?);
    let mut limits = Vec::with_capacity(len);
    for row in 0..len {
        let censor = match words.and_then(|words| words.get(row)).map(Value::as_str) {
            None | Some(Some("none")) => Censor::None,
            Some(Some("left")) => Censor::Left,
            Some(Some("right")) => Censor::Right,
            Some(_) => return Err(refuse(CENSOR, "has another word", "write none, left or right")),
        };
        let threshold = thresholds.and_then(|thresholds| thresholds.get(row)?.as_f64());
        limits.push(Limit { censor, threshold });
    }
    Ok(limits)
}

/// A column of `adhoc_variables`; none where the file does not have it.
fn extra_column<'a>(
    data: &'a Value,
    key: &str,
    len: usize,
) -> Result<Option<&'a Vec<Value>>, FormatError> {
    match data["adhoc_variables"][key]["values"].as_array() {
        Some(values) if values.len() == len => Ok(Some(values)),
        None => Ok(None),
        Some(_) => Err(refuse(key, "has not as many values as BRDF", "give one for each")),
    }
}

/// Wavelength, m; none where the file states none.
fn wavelength_m(data: &Value) -> Result<Option<f64>, FormatError> {
    const KEY: &str = "wavelength_i";
    if data[KEY].is_null() {
        return Ok(None);
    }
    let values = numbers(data, KEY)?;
    let metre = match data[KEY]["unit"].as_str() {
        Some("nm") => 1e-9,
        // The Greek letter and the sign for micro.
        Some("\u{3bc}m" | "\u{b5}m") => 1e-6,
        _ => return Err(refuse(KEY, "has no unit nm or μm", "state the unit")),
    };
    match values.as_slice() {
        [first, rest @ ..] if *first > 0.0 && rest.iter().all(|value| value == first) => {
            Ok(Some(first * metre))
        }
        _ => Err(refuse(KEY, "is not one wavelength above 0", "make a file for each wavelength")),
    }
}

fn one_state(data: &Value, key: &'static str) -> Result<(), FormatError> {
    let values = data[key]["values"].as_array().map(Vec::as_slice).unwrap_or_default();
    if values.windows(2).all(|pair| pair.first() == pair.last()) {
        return Ok(());
    }
    Err(refuse(key, "has several states", "make a file for each state of polarisation"))
}

fn numbers(data: &Value, key: &str) -> Result<Vec<f64>, FormatError> {
    let Some(values) = data[key]["values"].as_array() else {
        return Err(refuse(key, "has no `values`", "give a universal BRDF file, schema 1.0"));
    };
    let found: Option<Vec<f64>> =
        values.iter().map(|value| value.as_f64().filter(|number| number.is_finite())).collect();
    found.ok_or_else(|| refuse(key, "holds something that is not a number", "mend the value"))
}

fn refuse(key: &str, problem: &str, way_out: &str) -> FormatError {
    FormatError::at(format!("data.{key}"), problem, way_out)
}
