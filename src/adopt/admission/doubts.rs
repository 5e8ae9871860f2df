//! Values of a material that may be a slip and may be meant.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;

use crate::brdf::{BeyondBeam, VIEWING_RAD};
use crate::formats::words::counted;
use crate::material::form::licence_doubt;
use crate::material::{Censor, Curve, Instrument, Material, Source};
use crate::units::{db_from_ratio, dbm_from_watts, rounded, shown};

/// Highest frequency of anything that is called a radar, Hz.
const HIGHEST_HZ: f64 = 1e13;

/// Highest frequency of light that anybody sees, Hz, and a little beyond.
const HIGHEST_CLAIM_HZ: f64 = 1e15;

/// Lowest frequency of any radar that this program serves, Hz: what is below may be GHz without its prefix.
const LOWEST_HZ: f64 = 1e9;

/// Points below which a curve may well be of a few angles near the normal, and the widest of them in
/// radians that no such curve reaches.
const FEWEST_ANGLES: usize = 5;
const FEW_RADIANS: f64 = 0.5;

/// DOI of the source in the template of a material, which leads nowhere.
const TEMPLATE_DOI: &str = "10.1234/example";

/// By how much a detection is below its threshold that rounding does not explain, dB.
const WEAK_DB: f64 = 1.0;

/// Sentences on what may be a slip and may be meant.
pub fn doubts(material: &Material) -> Vec<String> {
    let slug = &material.slug;
    let mut doubts = Vec::new();
    for instrument in &material.instruments {
        doubts.extend(of_instrument(instrument));
    }
    if doubts.is_empty() {
        doubts.extend(of_claim(material));
    }
    for curve in &material.curves {
        doubts.extend(in_radians(curve));
        doubts.extend(too_weak(curve));
    }
    for curve in material.curves.iter().filter(|curve| curve.name == material.render) {
        doubts.extend(mostly_missed(curve));
    }
    doubts.extend(beyond_beam(material));
    doubts.extend(material.sources.iter().filter_map(of_template));
    let mut licences: Vec<&String> = material.sources.iter().flat_map(|s| &s.licence).collect();
    licences.push(&material.licence);
    licences.sort();
    licences.dedup();
    doubts.extend(licences.into_iter().filter_map(|licence| licence_doubt(licence)));
    doubts.into_iter().map(|doubt| format!("{slug}: {doubt}")).collect()
}

/// That its rendered curve returns what no surface does through the beam of the default radar.
fn beyond_beam(material: &Material) -> Option<String> {
    let beyond = BeyondBeam::of(&material.scattering().ok()?, VIEWING_RAD)?;
    Some(format!("`{}` {}", material.render, beyond.words(VIEWING_RAD)))
}

/// That a source is still that of the template.
fn of_template(source: &Source) -> Option<String> {
    let is_of_it = source.doi.as_deref() == Some(TEMPLATE_DOI);
    is_of_it.then(|| {
        format!(
            "source `{}` has the DOI of the template, {TEMPLATE_DOI}; are its numbers yours?",
            source.key
        )
    })
}

/// That an instrument has the frequency or the threshold of no radar.
fn of_instrument(instrument: &Instrument) -> Vec<String> {
    let Instrument { key, centre_frequency_hz, threshold_w, .. } = instrument;
    let mut doubts = Vec::new();
    if !(LOWEST_HZ..=HIGHEST_HZ).contains(centre_frequency_hz) {
        let ghz = shown(rounded(centre_frequency_hz / 1e9));
        doubts.push(format!("instrument `{key}` is at {ghz} GHz; is that in GHz?"));
    }
    let threshold_dbm = threshold_w.map(|threshold_w| rounded(dbm_from_watts(threshold_w)));
    if let Some(dbm) = threshold_dbm.filter(|dbm| *dbm > 0.0) {
        doubts.push(format!(
            "instrument `{key}` detects nothing below {} dBm, which is more than a radar receives; is a minus \
             missing?",
            shown(dbm)
        ));
    }
    doubts
}

/// That the frequencies of a claim are beyond light or below any radar.
fn of_claim(material: &Material) -> Option<String> {
    let [lowest_hz, highest_hz] = material.frequency_hz;
    let [lowest, highest] = [lowest_hz, highest_hz].map(|hz| shown(rounded(hz / 1e9)));
    if highest_hz > HIGHEST_CLAIM_HZ {
        Some(format!("it is claimed to hold up to {highest} GHz; is that in GHz?"))
    } else if highest_hz < LOWEST_HZ {
        Some(format!("it is claimed to hold from {lowest} to {highest} GHz; is that in GHz?"))
    } else {
        None
    }
}

/// That all angles of a curve are as small as radians are.
fn in_radians(curve: &Curve) -> Option<String> {
    let angles = curve.observations.iter().flat_map(|row| [row.theta_i_rad, row.theta_r_rad]);
    let angles_deg = angles.map(f64::to_degrees);
    let widest_deg = angles_deg.fold(0.0, f64::max);
    let is_few = curve.observations.len() < FEWEST_ANGLES;
    (!is_few && (FEW_RADIANS..FRAC_PI_2).contains(&widest_deg)).then(|| {
        format!(
            "no angle of curve `{}` is above {}°; are they in degrees?",
            curve.name,
            shown(rounded(widest_deg))
        )
    })
}

/// That detections of a curve are weaker than what could be detected at their angles.
fn too_weak(curve: &Curve) -> Option<String> {
    let mut weak = 0;
    let mut most_db = 0.0f64;
    for row in curve.observations.iter().filter(|row| row.censor == Censor::None) {
        let (Some(threshold), Some(sigma0)) = (row.threshold_sigma0, row.sigma0) else { continue };
        let below_db = db_from_ratio(threshold / sigma0);
        if below_db > WEAK_DB {
            weak += 1;
            most_db = most_db.max(below_db);
        }
    }
    (weak > 0).then(|| {
        format!(
            "{} of curve `{}` {} below what could be detected, by up to {most_db:.1} dB; are both in the same \
             unit?",
            counted(weak, "detection"),
            curve.name,
            if weak == 1 { "lies" } else { "lie" }
        )
    })
}

/// That a rendered curve has angles at which most points were missed: only detections are rendered there.
fn mostly_missed(curve: &Curve) -> Option<String> {
    const PER_DEG: f64 = 1e6;
    let mut by_angle: BTreeMap<u64, [usize; 2]> = BTreeMap::new();
    for row in curve.observations.iter().filter(|row| row.is_retro()) {
        let counts = by_angle.entry((row.theta_i_rad.to_degrees() * PER_DEG).round() as u64);
        counts.or_default()[usize::from(row.censor == Censor::Left)] += 1;
    }
    let (angle, [seen, missed]) =
        by_angle.into_iter().find(|(_, [seen, missed])| (1..=*missed).contains(seen))?;
    Some(format!(
        "at {}° {missed} of {} points of curve `{}` were missed; scenes render the mean of the rest, which is \
         too high: a fit (`matdb fit`) counts them all",
        shown(angle as f64 / PER_DEG),
        seen + missed,
        curve.name
    ))
}
