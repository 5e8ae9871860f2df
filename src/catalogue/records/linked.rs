//! Linked data: `dataset.jsonld` (schema.org/Dataset) for search engines and
//! `ro-crate-metadata.json` (RO-Crate 1.1) for repositories.

use std::collections::BTreeMap;

use serde_json::{Value, json};

use super::citation::{doi_url, insert, orcid_url};
use super::context::Context;
use crate::catalogue::folder::Checksum;
use crate::catalogue::layout::{MATERIALS, listed_media_type};
use crate::material::form::alternative_licences;

/// The address of a licence at SPDX; none for an expression of several, or a licence that is not on its list.
fn licence_url(licence: &str) -> Option<String> {
    match alternative_licences(licence)?.as_slice() {
        [only] => Some(format!("https://spdx.org/licenses/{only}")),
        _ => None,
    }
}

/// A licence in schema.org's terms: its address, or else its name.
pub(crate) fn licence_record(licence: &str) -> Value {
    match licence_url(licence) {
        Some(url) => url.into(),
        None => json!({ "@type": "CreativeWork", "name": licence }),
    }
}

/// People and institutes in schema.org's terms, each with an identifier in this file.
fn people(context: &Context) -> Vec<Value> {
    if !context.about.has_authors() {
        return vec![
            json!({ "@id": "#contributors", "@type": "Organization", "name": context.anonymous_author() }),
        ];
    }
    let mut people = Vec::new();
    for (number, person) in (1..).zip(&context.about.people) {
        let id = person.orcid.as_deref().map_or(format!("#person-{number}"), orcid_url);
        let mut entry = json!({
            "@id": id,
            "@type": "Person",
            "name": format!("{} {}", person.given, person.family),
            "givenName": person.given,
            "familyName": person.family,
        });
        insert(&mut entry, "affiliation", person.affiliation.as_deref());
        people.push(entry);
    }
    for (number, institute) in (1..).zip(&context.about.institutes) {
        let id = institute.url.clone().unwrap_or(format!("#institute-{number}"));
        people.push(json!({ "@id": id, "@type": "Organization", "name": institute.name }));
    }
    people
}

/// The fields of the catalogue that both files have.
fn common(context: &Context) -> Value {
    let about = context.about;
    let mut record =
        json!({ "@type": "Dataset", "name": about.title, "description": about.description });
    insert(&mut record, "version", about.version.as_deref());
    insert(&mut record, "datePublished", context.day());
    insert(&mut record, "url", about.url.as_deref());
    insert(&mut record, "identifier", about.doi.as_deref().map(doi_url).as_deref());
    record
}

/// `dataset.jsonld`.
pub(super) fn dataset(context: &Context, sums: &BTreeMap<String, Checksum>) -> Value {
    let mut record = common(context);
    record["@context"] = "https://schema.org/".into();
    if let Some(licence) = &context.about.licence {
        record["license"] = licence_record(licence);
    }
    record["creator"] = people(context).into();
    record["isAccessibleForFree"] = true.into();
    record["keywords"] =
        json!(["backscatter", "BRDF", "terahertz", "millimetre wave", "300 GHz", "imaging radar"]);
    record["variableMeasured"] = json!([
        { "@type": "PropertyValue", "name": "sigma0", "unitCode": "1",
          "description": "normalised radar cross section 4 pi f cos^2(theta), a ratio of powers" },
        { "@type": "PropertyValue", "name": "theta_i_rad", "unitCode": "rad",
          "description": "angle of incidence" }
    ]);
    let downloads: Vec<Value> = sums.iter().filter_map(|(path, sum)| download(path, sum)).collect();
    record["distribution"] = downloads.into();
    record
}

/// A file in `dataset.jsonld`, if it is listed.
fn download(path: &str, sum: &Checksum) -> Option<Value> {
    Some(json!({
        "@type": "DataDownload",
        "contentUrl": path,
        "encodingFormat": listed_media_type(path)?,
        "contentSize": sum.bytes.to_string(),
        "sha256": sum.sha256,
    }))
}

/// `ro-crate-metadata.json`.
pub(super) fn crate_metadata(context: &Context, sums: &BTreeMap<String, Checksum>) -> Value {
    let files: Vec<Value> = sums.iter().filter_map(|(path, sum)| crate_file(path, sum)).collect();
    let people = people(context);
    let mut parts = ids(&files);
    let mut graph = vec![json!({
        "@id": "ro-crate-metadata.json",
        "@type": "CreativeWork",
        "conformsTo": { "@id": "https://w3id.org/ro/crate/1.1" },
        "about": { "@id": "./" },
    })];
    let mut single = Vec::new();
    if context.materials > 0 {
        parts.push(json!({ "@id": MATERIALS }));
        single.push(json!({
            "@id": MATERIALS,
            "@type": "Dataset",
            "name": "Materials",
            "description": "One JSON file per material; api/v1/index.json lists them",
        }));
    }
    let mut root = common(context);
    root["@id"] = "./".into();
    let mut authors = ids(&people);
    // A list of one should stand without its brackets.
    root["author"] = if authors.len() == 1 { authors.remove(0) } else { authors.into() };
    root["hasPart"] = parts.into();
    if let Some(licence) = &context.about.licence {
        let id = licence_url(licence).unwrap_or("#licence".to_owned());
        root["license"] = json!({ "@id": id });
        single.push(json!({ "@id": id, "@type": "CreativeWork", "name": licence,
            "identifier": licence }));
    }
    graph.push(root);
    graph.extend(people.into_iter().chain(single).chain(files));
    json!({ "@context": "https://w3id.org/ro/crate/1.1/context", "@graph": graph })
}

/// A file in `ro-crate-metadata.json`, if it is listed.
fn crate_file(path: &str, sum: &Checksum) -> Option<Value> {
    Some(json!({
        "@id": path,
        "@type": "File",
        "name": path.rsplit('/').next(),
        "encodingFormat": listed_media_type(path)?,
        "contentSize": sum.bytes.to_string(),
    }))
}

/// References to entries by their identifiers.
fn ids(entries: &[Value]) -> Vec<Value> {
    entries.iter().map(|entry| json!({ "@id": entry["@id"] })).collect()
}
