//! What a material must say before it is let in: numbers without their circumstances cannot be used by
//! anybody else, and who measured them knows them best on the day.

use std::collections::BTreeMap;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use super::summary::counted;
use crate::error::Error;
use crate::material::form::{is_address, is_doi, is_licence, licence_doubt};
use crate::material::{Censor, Curve, Fit, Instrument, Material, Observation, SourceKind};
use crate::units::{db_from_ratio, dbm_from_watts, range, rounded, shown};

/// Thickest layer of a sample that anybody puts before a radar, m.
const THICKEST_M: f64 = 10.0;

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

/// By how much a detection is below its threshold that rounding does not explain, dB.
const WEAK_DB: f64 = 1.0;

/// Refuses a material with measured numbers that lack curve, licence, instrument or threshold, and one
/// with values that only a slip can give.
pub(super) fn check(material: &Material, file: &Path) -> Result<(), Error> {
    let of_curves = material.curves.iter().flat_map(|curve| missing(material, curve));
    let gaps: Vec<Gap> = of_curves.chain(measured_alone(material)).collect();
    if !gaps.is_empty() {
        let what: Vec<&str> = gaps.iter().map(|gap| gap.what.as_str()).collect();
        return Err(Error::Usage {
            problem: format!(
                "{}: what was measured needs more: {}",
                file.display(),
                what.join("; ")
            ),
            way_out: way_out(&gaps),
        });
    }
    match slips(material).first() {
        None => Ok(()),
        Some((problem, way_out)) => Err(Error::Usage {
            problem: format!("{}: {problem}", file.display()),
            way_out: (*way_out).to_owned(),
        }),
    }
}

/// What an entry lacks.
pub(super) struct Gap {
    /// A clause.
    pub what: String,
    /// Blocks of lines of a material.toml with places to fill in; none where others bring them.
    blocks: Vec<String>,
}

/// The lines that are to be filled in, each once.
fn way_out(gaps: &[Gap]) -> String {
    const COMPLETE: &str = "`matdb add --template` prints a complete entry";
    let mut blocks: Vec<&str> = Vec::new();
    for block in gaps.iter().flat_map(|gap| &gap.blocks) {
        if !blocks.contains(&block.as_str()) {
            blocks.push(block);
        }
    }
    match blocks.is_empty() {
        true => COMPLETE.to_owned(),
        false => format!("fill this in ({COMPLETE}):\n\n{}", blocks.join("\n\n")),
    }
}

/// What may be a slip and may be meant, a sentence each.
pub(super) fn doubts(material: &Material) -> Vec<String> {
    let slug = &material.slug;
    let mut doubts = Vec::new();
    for Instrument { key, centre_frequency_hz, threshold_w, .. } in &material.instruments {
        let ghz = shown(rounded(centre_frequency_hz / 1e9));
        if !(LOWEST_HZ..=HIGHEST_HZ).contains(centre_frequency_hz) {
            doubts.push(format!("{slug}: instrument `{key}` is at {ghz} GHz; is that in GHz?"));
        }
        if let Some(dbm) = threshold_w.map(|w| rounded(dbm_from_watts(w))).filter(|dbm| *dbm > 0.0)
        {
            doubts.push(format!(
                "{slug}: instrument `{key}` detects nothing below {} dBm, which is more than a radar \
                 receives; is a minus missing?",
                shown(dbm)
            ));
        }
    }
    let [lowest_hz, highest_hz] = material.frequency_hz;
    let [lowest, highest] = [lowest_hz, highest_hz].map(|hz| shown(rounded(hz / 1e9)));
    if doubts.is_empty() && highest_hz > HIGHEST_CLAIM_HZ {
        doubts.push(format!("{slug}: it is claimed to hold up to {highest} GHz; is that in GHz?"));
    }
    if doubts.is_empty() && highest_hz < LOWEST_HZ {
        doubts.push(format!(
            "{slug}: it is claimed to hold from {lowest} to {highest} GHz; is that in GHz?"
        ));
    }
    let of_curves = material.curves.iter().flat_map(|curve| [in_radians(curve), too_weak(curve)]);
    let rendered = material.curves.iter().filter(|curve| curve.name == material.render);
    let doubts_of = of_curves.flatten().chain(rendered.filter_map(mostly_missed));
    doubts.extend(doubts_of.map(|doubt| format!("{slug}: {doubt}")));
    let mut licences: Vec<&String> = material.sources.iter().flat_map(|s| &s.licence).collect();
    licences.push(&material.licence);
    licences.sort();
    licences.dedup();
    for licence in licences {
        doubts.extend(licence_doubt(licence).map(|doubt| format!("{slug}: {doubt}")));
    }
    doubts
}

/// That all angles of a curve are so small as radians are.
fn in_radians(curve: &Curve) -> Option<String> {
    let angles_deg = curve.observations.iter().map(|row| row.theta_i_rad.to_degrees());
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

/// That detections of a curve are weaker than what they say could be detected.
fn too_weak(curve: &Curve) -> Option<String> {
    let below_db = |row: &Observation| {
        let ratio = row.threshold_sigma0? / row.sigma0.filter(|_| row.censor == Censor::None)?;
        Some(db_from_ratio(ratio)).filter(|below_db| *below_db > WEAK_DB)
    };
    let below: Vec<f64> = curve.observations.iter().filter_map(below_db).collect();
    let most_db = below.iter().copied().reduce(f64::max)?;
    Some(format!(
        "{} of curve `{}` {} below what could be detected, by up to {most_db:.1} dB; are both in the same unit?",
        counted(below.len(), "detection"),
        curve.name,
        if below.len() == 1 { "lies" } else { "lie" }
    ))
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

/// Fits that claim to be measured without a curve that anybody measured.
fn measured_alone(material: &Material) -> impl Iterator<Item = Gap> {
    let is_alone = |fit: &&Fit| {
        fit.curve.is_none() && kind(material, &fit.source) == Some(SourceKind::Measured)
    };
    material.fits.iter().filter(is_alone).map(|fit| Gap {
        what: format!(
            "fit `{}` has the measured source `{}` and names no curve; numbers that others fitted are \
             literature",
            fit.name, fit.source
        ),
        blocks: Vec::new(),
    })
}

fn kind(material: &Material, key: &str) -> Option<SourceKind> {
    material.sources.iter().find(|source| source.key == key).map(|source| source.kind)
}

/// What a curve lacks. That there is a source at all was checked before.
pub(super) fn missing(material: &Material, curve: &Curve) -> Vec<Gap> {
    let source = material.sources.iter().find(|source| source.key == curve.source);
    let Some(source) = source.filter(|source| source.kind == SourceKind::Measured) else {
        return Vec::new();
    };
    let mut missing = Vec::new();
    if source.licence.as_ref().is_none_or(|licence| licence.trim().is_empty()) {
        missing.push(Gap {
            what: format!("source `{}` has no licence", source.key),
            blocks: vec![format!(
                "# into the [[source]] `{}`:\n\
                 licence = \"…\"               # SPDX, such as CC-BY-4.0",
                source.key
            )],
        });
    }
    let key = curve.instrument.as_ref();
    let instrument = key.and_then(|key| material.instruments.iter().find(|i| i.key == *key));
    if instrument.is_none() {
        missing.push(Gap {
            what: format!("curve `{}` names no instrument", curve.name),
            blocks: instrument_lines(material, curve),
        });
    }
    let in_rows = curve.observations.iter().all(|row| row.threshold_sigma0.is_some());
    if !in_rows && instrument.is_none_or(|instrument| instrument.threshold_w.is_none()) {
        missing.push(match instrument {
            Some(Instrument { key, .. }) => Gap {
                what: format!(
                    "instrument `{key}` has no threshold_dbm and not every row of curve `{}` a threshold_db",
                    curve.name
                ),
                blocks: vec![format!("# into the [[instrument]] `{key}`:\n{THRESHOLD}")],
            },
            None => Gap {
                what: format!("not every row of curve `{}` has a threshold_db", curve.name),
                blocks: Vec::new(),
            },
        });
    }
    missing
}

const THRESHOLD: &str =
    "threshold_dbm = …             # the least power that counts as a detection, such as -77";

/// What names the instrument of a curve, and the instrument itself where there is none.
fn instrument_lines(material: &Material, curve: &Curve) -> Vec<String> {
    let known = material.instruments.first().map_or("radar", |instrument| &instrument.key);
    let named = format!("# into the [[curve]] `{}`:\ninstrument = \"{known}\"", curve.name);
    let itself = format!(
        "[[instrument]]\nkey = \"{known}\"\n\
         name = \"…\"                  # maker and model\n\
         centre_frequency_ghz = …      # such as 300\n{THRESHOLD}"
    );
    [named].into_iter().chain(material.instruments.is_empty().then_some(itself)).collect()
}

/// Values that cannot be meant, each with the way out.
fn slips(material: &Material) -> Vec<(String, &'static str)> {
    const LICENCE: &str =
        "write an SPDX identifier such as CC-BY-4.0, or LicenseRef-proprietary for your own terms";
    const TURN: &str =
        "leave U+202A to U+202E and U+2066 to U+2069 out; letters of any script are welcome";
    const DOI: &str = "write it as 10.1234/name, without a resolver in front";
    const URL: &str = "write an address that begins with http:// or https://";
    let mut slips: Vec<_> =
        material.misleading_name().map(|name| (name, TURN)).into_iter().collect();
    let tags = &material.tags;
    let is_repeated = |(at, tag): &(usize, &String)| tags[..*at].contains(tag);
    if tags.iter().any(|tag| tag.trim().is_empty()) {
        slips.push(("tags holds an empty word".to_owned(), "fill it in or remove it"));
    } else if let Some((_, tag)) = tags.iter().enumerate().find(is_repeated) {
        slips.push((format!("tags holds `{tag}` twice"), "remove one of them"));
    }
    let names = material
        .instruments
        .iter()
        .map(|i| (format!("the name of instrument `{}`", i.key), &i.name));
    let titles =
        material.sources.iter().map(|s| (format!("the title of source `{}`", s.key), &s.title));
    let is_blank = |text: &str| text.chars().all(|c| c.is_whitespace() || c == '…' || c == '.');
    let blank = names.chain(titles).find(|(_, text)| is_blank(text));
    slips.extend(blank.map(|(place, _)| (format!("{place} is not filled in"), "fill it in")));
    let own = ("the material".to_owned(), Some(&material.licence));
    let of_sources =
        material.sources.iter().map(|s| (format!("source `{}`", s.key), s.licence.as_ref()));
    for (place, licence) in std::iter::once(own).chain(of_sources) {
        if let Some(text) = licence.filter(|text| !is_licence(text)) {
            slips.push((
                format!("the licence of {place}, `{text}`, is no SPDX expression"),
                LICENCE,
            ));
        }
    }
    for source in &material.sources {
        if let Some(doi) = source.doi.as_ref().filter(|doi| !is_doi(doi)) {
            slips.push((format!("the doi of source `{}`, `{doi}`, is none", source.key), DOI));
        }
        if let Some(url) = source.url.as_ref().filter(|url| !is_address(url)) {
            slips.push((format!("the url of source `{}`, `{url}`, is none", source.key), URL));
        }
    }
    let is_wide =
        |i: &&Instrument| i.bandwidth_hz.is_some_and(|b| b >= 2.0 * i.centre_frequency_hz);
    slips.extend(material.instruments.iter().filter(is_wide).map(|instrument| {
        let problem = format!("instrument `{}` has a band that begins below 0 Hz", instrument.key);
        (problem, "give bandwidth_ghz and centre_frequency_ghz in GHz")
    }));
    slips.extend(material.curves.iter().filter_map(|curve| strange_frequency(material, curve)));
    slips.extend(material.layers.iter().filter_map(|layer| {
        let thickness_m = layer.thickness_m.filter(|thickness_m| *thickness_m > THICKEST_M)?;
        let problem = format!("layer `{}` is {thickness_m} m thick", layer.name);
        Some((problem, "give thickness_mm in mm, 10000 at most"))
    }));
    slips
}

/// That a measured curve is of another frequency than the entry claims.
fn strange_frequency(material: &Material, curve: &Curve) -> Option<(String, &'static str)> {
    let instrument =
        material.instruments.iter().find(|i| Some(&i.key) == curve.instrument.as_ref())?;
    let is_measured = kind(material, &curve.source) == Some(SourceKind::Measured);
    let is_outside = material.frequency_outside_hz(instrument.centre_frequency_hz) > 0.0;
    (is_measured && is_outside).then(|| {
        let problem = format!(
            "curve `{}` was measured at {} GHz and the entry claims {} GHz",
            curve.name,
            shown(instrument.centre_frequency_hz / 1e9),
            range(material.frequency_hz.map(|hz| hz / 1e9))
        );
        (problem, "claim in frequency_ghz what was measured, or name the curve's own instrument")
    })
}
