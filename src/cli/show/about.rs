//! What `matdb show` says of composition, sessions and findings.

use crate::cli::summary::table;
use crate::effects::find;
use crate::material::{
    Finding, FindingVerdict, Instrument, Layer, Material, Permittivity, Session,
};
use crate::units::{db_from_ratio, dbm_from_watts, rounded, shown};

/// Layers, permittivities, roughness and finish.
pub(super) fn composition(material: &Material) -> String {
    let mut text = String::new();
    if !material.layers.is_empty() {
        text += "\nlayers, outermost first\n";
        let header = ["layer", "thickness mm", "permittivity", "source"];
        text += &table(&header, material.layers.iter().map(layer));
    }
    if !material.permittivities.is_empty() {
        text += "\npermittivity eps' - j eps''\n";
        let header = ["of", "GHz", "°C", "eps'", "eps''", "source"];
        text += &table(&header, material.permittivities.iter().map(permittivity));
    }
    if let Some(roughness) = &material.roughness {
        text += &format!("\nroughness: {} um rms", shown(micro(roughness.rms_height_m)));
        if let Some(length_m) = roughness.correlation_length_m {
            text += &format!(", correlated over {} um", shown(micro(length_m)));
        }
        text += &roughness.method.as_ref().map_or(String::new(), |method| format!(", {method}"));
        text += &format!(", from {}\n", roughness.source);
    }
    text += &material.finish.as_ref().map_or(String::new(), |finish| format!("finish: {finish}\n"));
    text
}

fn layer(layer: &Layer) -> [String; 4] {
    let thickness = layer.thickness_m.map(|m| shown(rounded(m * 1e3)));
    [
        layer.name.clone(),
        thickness.unwrap_or("half space".to_owned()),
        layer.permittivity.clone().unwrap_or("not known".to_owned()),
        layer.source.clone().unwrap_or_default(),
    ]
}

fn permittivity(entry: &Permittivity) -> [String; 6] {
    let with = |value: f64, sd: Option<f64>| {
        shown(value) + &sd.map_or(String::new(), |sd| format!(" ± {}", shown(sd)))
    };
    let from = entry.frequency_source.as_ref().map_or(String::new(), |key| format!(", {key}"));
    [
        entry.key.clone(),
        shown(rounded(entry.frequency_hz / 1e9)) + &from,
        entry.temperature_k.map_or("not stated".to_owned(), |k| shown(rounded(k - 273.15))),
        with(entry.real, entry.real_sd),
        with(entry.imaginary, entry.imaginary_sd),
        entry.source.clone(),
    ]
}

fn micro(length_m: f64) -> f64 {
    rounded(length_m * 1e6)
}

/// What curves were measured with, a line each.
pub(super) fn instruments(material: &Material) -> String {
    material.instruments.iter().map(instrument).collect()
}

fn instrument(instrument: &Instrument) -> String {
    let number = |value: Option<f64>, what: &str, unit: &str| {
        value.map(|value| format!("{what}{} {unit}", shown(rounded(value))))
    };
    let dbm = |power_w: Option<f64>| power_w.map(dbm_from_watts);
    let word =
        |text: &Option<String>, what: &str| text.as_ref().map(|text| format!("{what}{text}"));
    let parts = [
        Some(instrument.name.clone()),
        number(Some(instrument.centre_frequency_hz / 1e9), "", "GHz"),
        number(instrument.bandwidth_hz.map(|hz| hz / 1e9), "bandwidth ", "GHz"),
        word(&instrument.polarisation, "polarisation "),
        word(&instrument.transmit_polarisation, "sends "),
        word(&instrument.receive_polarisation, "receives "),
        number(dbm(instrument.threshold_w), "threshold ", "dBm"),
        number(dbm(instrument.noise_floor_w), "noise ", "dBm"),
        number(instrument.stand_off_m, "from ", "m"),
        number(instrument.spot_diameter_m.map(|m| m * 1e3), "spot ", "mm"),
        word(&instrument.calibration_target, "calibrated by "),
        number(instrument.calibration_sd_factor.map(db_from_ratio), "to ", "dB"),
        number(instrument.looks, "", if instrument.looks == Some(1.0) { "look" } else { "looks" }),
    ];
    let parts: Vec<String> = parts.into_iter().flatten().collect();
    let note = instrument.note.as_ref().map_or(String::new(), |note| format!("    {note}\n"));
    format!("\ninstrument {}: {}\n{note}", instrument.key, parts.join(", "))
}

/// Sittings of measurement.
pub(super) fn sessions(material: &Material) -> String {
    material.sessions.iter().map(session).collect()
}

fn session(session: &Session) -> String {
    let part = |value: Option<f64>, what: &str, unit: &str| {
        value.map_or(String::new(), |value| format!(", {what} {} {unit}", shown(rounded(value))))
    };
    let mut text = format!("\nsession {}: {}", session.key, session.date);
    text += &part(session.temperature_k.map(|k| k - 273.15), "at", "°C");
    text += &part(session.relative_humidity.map(|share| share * 100.0), "humidity", "%");
    text += &part(session.registration_rms_m.map(|m| m * 1e3), "registered to", "mm rms");
    text += &part(session.normal_sd_rad.map(f64::to_degrees), "normals to", "°");
    text += &part(session.footprint_sd_rad.map(f64::to_degrees), "spread in a footprint", "°");
    text += "\n";
    text + &session.note.as_ref().map_or(String::new(), |note| format!("    {note}\n"))
}

/// What diagnoses tried.
pub(super) fn findings(material: &Material) -> String {
    if material.findings.is_empty() {
        return String::new();
    }
    let header =
        ["effect", "level", "verdict", "gain ln L", "held out ln p", "size dB", "or", "source"];
    "\nwhat diagnoses tried\n".to_owned() + &table(&header, material.findings.iter().map(finding))
}

fn finding(finding: &Finding) -> [String; 8] {
    let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:.1}"));
    let error = finding.score_difference_sd.map(|sd| format!(" ± {sd:.1}"));
    let verdict = match finding.verdict {
        FindingVerdict::Found => "found",
        FindingVerdict::NotFound => "not found",
        FindingVerdict::Unexplained => "unexplained",
    };
    [
        finding.effect.clone(),
        find(&finding.effect).map_or("", |effect| effect.level().as_str()).to_owned(),
        verdict.to_owned(),
        number(finding.gain),
        number(finding.score_difference) + &error.unwrap_or_default(),
        number(finding.size_db),
        finding.confusable_with.join(", "),
        finding.source.clone(),
    ]
}
