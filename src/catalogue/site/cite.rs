//! How to cite: as a sentence, as BibTeX, and as a record for machines (schema.org).

use serde::Serialize;
use serde_json::{Value, json};

use super::link::doi_href;
use super::words::cut;
use crate::catalogue::About;
use crate::catalogue::bibtex::entry;
use crate::catalogue::references::pruned;
use crate::store::Stored;

/// How to cite a material.
#[derive(Debug, Serialize)]
pub(super) struct Citation {
    /// For a list of references.
    text: String,
    /// For a bibliography.
    bibtex: String,
    /// For machines.
    #[serde(skip)]
    pub(super) record: Value,
}

impl Citation {
    /// Of a stored revision in a catalogue.
    pub(super) fn new(about: &About, stored: &Stored) -> Citation {
        let material = &stored.material;
        let name = cut(&material.name, 200);
        let hash = stored.content_hash.get(..12).unwrap_or(&stored.content_hash);
        let what =
            format!("{name} ({}, revision {}, content {hash})", material.slug, stored.revision);
        let year = stored.added_at.get(..4).unwrap_or_default();
        let status = material.status.sentence();
        let said = status.as_ref().map_or(String::new(), |said| format!(" This entry is {said}"));
        let text = format!("{}{what}. In: {}{said}", authors(about), catalogue_words(about));
        let key = format!("{}-{}", material.slug, stored.revision);
        let bibtex = bibtex(about, &key, &what, year, status.clone());
        let record = pruned(json!({
            "@context": "https://schema.org/",
            "@type": "Dataset",
            "name": name,
            "identifier": format!("{}@{}", material.slug, stored.revision),
            "description": cut(&format!("{}. {}", name, material.description), 4000),
            "license": spdx(&material.licence),
            "keywords": material.tags,
            "version": stored.revision.to_string(),
            "creator": creators(about),
            "isPartOf": { "@type": "DataCatalog", "name": about.title },
            "distribution": [
                distribution(&format!("../api/v1/materials/{}.json", material.slug), "application/json"),
                distribution(&format!("{}.csv", material.slug), "text/csv"),
            ],
            "creativeWorkStatus": status,
        }));
        Citation { text, bibtex, record }
    }
}

/// How to cite the catalogue as a whole.
pub(super) fn catalogue(about: &About) -> String {
    format!("{}{}", authors(about), catalogue_words(about))
}

/// The catalogue for machines.
pub(super) fn catalogue_record(about: &About) -> Value {
    pruned(json!({
        "@context": "https://schema.org/",
        "@type": "DataCatalog",
        "name": about.title,
        "description": about.description,
        "license": spdx(&about.licence),
        "version": about.version,
        "url": about.url,
        "creator": creators(about),
    }))
}

fn distribution(path: &str, media_type: &str) -> Value {
    json!({ "@type": "DataDownload", "contentUrl": path, "encodingFormat": media_type })
}

fn spdx(licence: &str) -> String {
    format!("https://spdx.org/licenses/{licence}")
}

fn creators(about: &About) -> Vec<Value> {
    let person = |person: &crate::catalogue::about::Person| {
        pruned(json!({
            "@type": "Person",
            "familyName": person.family,
            "givenName": person.given,
            "affiliation": person.affiliation,
            "identifier": person.orcid.as_ref().map(|orcid| format!("https://orcid.org/{orcid}")),
        }))
    };
    about.people.iter().map(person).collect()
}

fn authors(about: &About) -> String {
    let names: Vec<String> =
        about.people.iter().map(|person| format!("{}, {}", person.family, person.given)).collect();
    if names.is_empty() { String::new() } else { names.join("; ") + ". " }
}

fn catalogue_words(about: &About) -> String {
    let mut text = about.title.clone();
    text += &about.version.as_ref().map_or(String::new(), |version| format!(", version {version}"));
    text += &place(about).map_or(String::new(), |place| format!(". {place}"));
    text + "."
}

fn place(about: &About) -> Option<String> {
    let doi = about.doi.as_ref().map(|doi| doi_href(doi).unwrap_or_else(|| format!("doi:{doi}")));
    doi.or_else(|| about.url.clone())
}

fn bibtex(about: &About, key: &str, title: &str, year: &str, note: Option<String>) -> String {
    let names: Vec<String> =
        about.people.iter().map(|person| format!("{}, {}", person.family, person.given)).collect();
    let fields = [
        ("author", (!names.is_empty()).then(|| names.join(" and "))),
        ("title", Some(title.to_owned())),
        ("howpublished", Some(about.title.clone())),
        ("year", Some(year.to_owned())),
        ("version", about.version.clone()),
        ("doi", about.doi.clone()),
        ("url", about.url.clone()),
        ("note", note),
    ];
    let short = fields.map(|(name, value)| (name, value.map(|value| cut(&value, 400))));
    entry("misc", &format!("matdb-{key}"), short).trim_end().to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_catalogue_without_people_is_cited_by_its_title() {
        let about = About { doi: Some("10.5281/zenodo.1".to_owned()), ..About::default() };
        assert_eq!(
            catalogue(&about),
            "Materials for 300 GHz imaging radar. https://doi.org/10.5281/zenodo.1."
        );
    }
}
