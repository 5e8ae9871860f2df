//! Values of a material that cannot be meant.

use crate::material::form::{is_address, is_doi, is_licence};
use crate::material::{Curve, Material, SourceKind};
use crate::units::{range, shown};

/// Thickest layer of a sample that anybody puts before a radar, m.
const THICKEST_M: f64 = 10.0;

/// What is wrong, and what to do.
type Slip = (String, &'static str);

/// Values that cannot be meant, each with the way out.
pub(super) fn slips(material: &Material) -> Vec<Slip> {
    const TURN: &str =
        "leave U+202A to U+202E and U+2066 to U+2069 out; letters of any script are welcome";
    let mut slips: Vec<Slip> =
        material.misleading_name().map(|name| (name, TURN)).into_iter().collect();
    slips.extend(of_tags(&material.tags));
    slips.extend(blank_text(material));
    slips.extend(of_licences(material));
    slips.extend(of_addresses(material));
    for instrument in &material.instruments {
        if instrument.bandwidth_hz.is_some_and(|b| b >= 2.0 * instrument.centre_frequency_hz) {
            slips.push((
                format!("instrument `{}` has a band that begins below 0 Hz", instrument.key),
                "give bandwidth_ghz and centre_frequency_ghz in GHz",
            ));
        }
    }
    slips.extend(material.curves.iter().filter_map(|curve| strange_frequency(material, curve)));
    for layer in &material.layers {
        if let Some(thickness_m) = layer.thickness_m.filter(|thickness_m| *thickness_m > THICKEST_M)
        {
            slips.push((
                format!("layer `{}` is {thickness_m} m thick", layer.name),
                "give thickness_mm in mm, 10000 at most",
            ));
        }
    }
    slips
}

fn of_tags(tags: &[String]) -> Option<Slip> {
    if tags.iter().any(|tag| tag.trim().is_empty()) {
        return Some(("tags holds an empty word".to_owned(), "fill it in or remove it"));
    }
    let mut repeated = tags.iter().enumerate().filter(|(at, tag)| tags[..*at].contains(tag));
    let (_, tag) = repeated.next()?;
    Some((format!("tags holds `{tag}` twice"), "remove one of them"))
}

/// The first name or title that was left as the template has it.
fn blank_text(material: &Material) -> Option<Slip> {
    let mut texts = Vec::new();
    for instrument in &material.instruments {
        texts.push((format!("the name of instrument `{}`", instrument.key), &instrument.name));
    }
    for source in &material.sources {
        texts.push((format!("the title of source `{}`", source.key), &source.title));
    }
    let (place, _) = texts.into_iter().find(|(_, text)| is_blank(text))?;
    Some((format!("{place} is not filled in"), "fill it in"))
}

fn is_blank(text: &str) -> bool {
    text.chars().all(|c| c.is_whitespace() || c == '…' || c == '.')
}

fn of_licences(material: &Material) -> Vec<Slip> {
    const LICENCE: &str =
        "write an SPDX identifier such as CC-BY-4.0, or LicenseRef-proprietary for your own terms";
    let mut licences = vec![("the material".to_owned(), Some(&material.licence))];
    for source in &material.sources {
        licences.push((format!("source `{}`", source.key), source.licence.as_ref()));
    }
    let mut slips = Vec::new();
    for (place, licence) in licences {
        if let Some(text) = licence.filter(|text| !is_licence(text)) {
            slips.push((
                format!("the licence of {place}, `{text}`, is not an SPDX expression"),
                LICENCE,
            ));
        }
    }
    slips
}

fn of_addresses(material: &Material) -> Vec<Slip> {
    const DOI: &str = "write it as 10.1234/name, without a resolver in front";
    const URL: &str = "write an address that begins with http:// or https://";
    let mut slips = Vec::new();
    for source in &material.sources {
        if let Some(doi) = source.doi.as_ref().filter(|doi| !is_doi(doi)) {
            slips.push((format!("the doi of source `{}`, `{doi}`, is not a DOI", source.key), DOI));
        }
        if let Some(url) = source.url.as_ref().filter(|url| !is_address(url)) {
            slips.push((
                format!("the url of source `{}`, `{url}`, is not an address", source.key),
                URL,
            ));
        }
    }
    slips
}

/// That a measured curve is of another frequency than the entry claims.
fn strange_frequency(material: &Material, curve: &Curve) -> Option<Slip> {
    let key = curve.instrument.as_ref()?;
    let instrument = material.instruments.iter().find(|instrument| instrument.key == *key)?;
    let source = material.sources.iter().find(|source| source.key == curve.source);
    let is_measured = source.is_some_and(|source| source.kind == SourceKind::Measured);
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
