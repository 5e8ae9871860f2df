//! Promise: a material that says something impossible is refused with one sentence that names the
//! place and the way out, and what nobody says changes no hash.

use crate::support::database::{as_first_stored, complete, fitted, with_effects};
use matdb::material::{Material, Status, file};

type Spoil = fn(&mut Material);

#[test]
fn each_impossible_value_has_its_sentence() {
    complete("paint").validate().unwrap();
    let cases: [(Spoil, &str); 40] = [
        (|m| m.layers[0].thickness_m = Some(0.0), "layer 1: the thickness is not positive"),
        (|m| m.layers[0].thickness_m = None, "layer 1: has no thickness"),
        (|m| m.layers[1].name = " ".to_owned(), "layer 2: has no name"),
        (|m| m.layers[0].permittivity = Some("tar".to_owned()), "layer 1 refers to a permittivity"),
        (|m| m.permittivities[0].imaginary = -0.1, "which would amplify"),
        (
            |m| m.permittivities[0].imaginary = f64::NAN,
            "the imaginary part is negative or no number",
        ),
        (|m| m.permittivities[0].real = f64::INFINITY, "the real part is not finite"),
        (|m| m.permittivities[0].real_sd = Some(-1.0), "a deviation is negative"),
        (|m| m.permittivities[0].frequency_hz = 0.0, "the frequency is not positive"),
        (|m| m.permittivities[0].temperature_k = Some(-1.0), "above absolute zero is not positive"),
        (|m| m.permittivities[0].source = "x".to_owned(), "refers to a source `x`"),
        (|m| m.permittivities[1].frequency_hz = 300e9, "is given twice"),
        (|m| m.roughness.as_mut().unwrap().rms_height_m = -1.0, "roughness: the rms height"),
        (
            |m| m.roughness.as_mut().unwrap().correlation_length_m = Some(0.0),
            "roughness: the correlation length is not positive",
        ),
        (|m| m.roughness.as_mut().unwrap().source = "x".to_owned(), "roughness refers to a source"),
        (|m| m.status = Status::Withdrawn { reason: " ".to_owned() }, "status: gives no reason"),
        (
            |m| {
                let (by, reason) = (m.slug.clone(), "new".to_owned());
                m.status = Status::Superseded { by, reason };
            },
            "status: the material is superseded by itself",
        ),
        (|m| m.unknown = vec![String::new()], "unknown: holds an empty sentence"),
        (|m| m.finish = Some(String::new()), "finish: is empty"),
        (|m| m.sources[0].title = String::new(), "title: is empty"),
        (|m| m.sources[0].citation.year = Some(26), "the year has not four digits"),
        (|m| m.sources[0].citation.authors = vec![String::new()], "an author has no name"),
        (|m| m.instruments[0].centre_frequency_hz = 0.0, "the centre frequency is not positive"),
        (|m| m.instruments[0].bandwidth_hz = Some(-1.0), "the bandwidth is not positive"),
        (|m| m.instruments[0].stand_off_m = Some(0.0), "the stand-off is not positive"),
        (|m| m.instruments[0].threshold_w = Some(0.0), "the power of the threshold"),
        (|m| m.instruments[0].noise_floor_w = Some(f64::NAN), "the power of the noise floor"),
        (|m| m.instruments[0].calibration_sd_factor = Some(0.5), "is below 1"),
        (|m| m.instruments[0].false_alarm_probability = Some(1.0), "the false-alarm probability"),
        (|m| m.instruments[0].range_bins = Some(0), "searches no range bin"),
        (|m| m.sessions[0].date = "14 March".to_owned(), "`14 March` is not a date"),
        (|m| m.sessions[0].relative_humidity = Some(40.0), "the humidity is not within 0–100 %"),
        (|m| m.sessions[0].mesh_hash = Some("0D".repeat(32)), "the hash of the mesh"),
        (|m| m.sessions[0].normal_sd_rad = Some(2.0), "the deviation of the normals"),
        (|m| m.sessions[0].registration_rms_m = Some(-1.0), "the residual of the registration"),
        (
            |m| m.sessions[0].pose.as_mut().unwrap().rotation_rows[0][1] = 1.0,
            "the pose is not a rotation with a shift",
        ),
        (|m| m.curves[0].session = Some("autumn".to_owned()), "refers to a session `autumn`"),
        (|m| m.findings[0].p = Some(1.5), "p is not between 0 and 1"),
        (|m| m.findings[0].score_difference_sd = Some(-1.0), "the deviation of the score"),
        (|m| m.findings[0].fit_after = Some("x".to_owned()), "refers to a fit `x`"),
    ];
    for (spoil, expected) in cases {
        let mut material = complete("paint");
        spoil(&mut material);
        let message = material.validate().map(|()| expected.to_owned() + " passed").err();
        let message = message.unwrap_or_else(|| panic!("{expected}: accepted")).to_string();
        assert!(message.contains(expected), "{message}");
        assert!(message.contains("; ") && !message.contains('\n'), "{message}");
    }
}

#[test]
fn a_file_is_read_in_its_units() {
    let text = include_str!("../src/setup/material-template.toml");
    let csv = b"theta_deg,sigma0_db\n0,5\n20,-10\n".to_vec();
    let material = file::parse("material.toml", text, |_| Ok(csv.clone())).unwrap();
    let near = |value: Option<f64>, expected: f64| {
        let value = value.unwrap();
        assert!((value / expected - 1.0).abs() < 1e-12, "{value} {expected}");
    };
    let (radar, session) = (&material.instruments[0], &material.sessions[0]);
    near(material.layers[0].thickness_m, 1.2e-4);
    near(material.roughness.as_ref().map(|r| r.rms_height_m), 4.2e-6);
    near(material.roughness.as_ref().and_then(|r| r.correlation_length_m), 1.8e-4);
    near(Some(material.permittivities[0].frequency_hz), 3e11);
    near(material.permittivities[0].temperature_k, 295.15);
    near(radar.threshold_w, 1e-3 * 10f64.powf(-7.7));
    near(radar.noise_floor_w, 1e-12);
    near(radar.calibration_sd_factor, 10f64.powf(0.1));
    near(radar.spot_diameter_m, 0.016);
    near(radar.aperture_m, 0.5);
    near(session.relative_humidity, 0.4);
    near(session.registration_rms_m, 7e-4);
    near(session.normal_sd_rad, 0.4f64.to_radians());
    near(session.footprint_sd_rad, 0.2f64.to_radians());
    let mut bare = material.clone();
    bare.curves.clear();
    bare.fits[0].curve = None;
    bare.render = bare.fits[0].name.clone();
    let written = file::write(&bare).unwrap();
    let again = file::parse("material.toml", &written, |_| Err(String::new())).unwrap();
    // Units cost the last digit.
    let digits = |m: &Material| format!("{:.9?}", m);
    assert_eq!(digits(&again), digits(&bare));
}

#[test]
fn what_nobody_says_changes_no_hash() {
    // As the first released schema stored it: a change here orphans every stored revision.
    assert_eq!(
        as_first_stored("ptfe").content_hash(),
        "7dca8264fb8c93c5227372b0e3877cf2822b5b1f24f6e0fd0859278efbea1a44"
    );
    let (fitted, paint) = (fitted("fitted"), with_effects("paint"));
    let text = serde_json::to_value(&fitted).unwrap();
    let keys: Vec<&String> = text.as_object().unwrap().keys().collect();
    assert_eq!(keys.len(), 13, "{keys:?}");
    assert_eq!(text["sources"][0].as_object().unwrap().len(), 7);
    assert_eq!(text["curves"][0].as_object().unwrap().len(), 4);
    let text = serde_json::to_value(&paint).unwrap();
    assert_eq!(text["instruments"][0].as_object().unwrap().len(), 6);
    assert_ne!(paint.content_hash(), complete("paint").content_hash());
}
