//! How to cite: as a sentence, as BibTeX, and as a record for machines (schema.org).

use serde::Serialize;
use serde_json::{Value, json};

use super::link::doi_href;
use crate::catalogue::about::{About, Institute, Person};
use crate::catalogue::bibtex::entry;
use crate::catalogue::records::licence_record;
use crate::catalogue::references::{Credit, pruned};
use crate::formats::words::shortened;
use crate::store::StoredRevision;

/// The note in the citation of a built-in entry.
const BUILT_IN: &str = "Built into matdb, not by the publisher of this catalogue";

/// How to cite a material.
#[derive(Debug, Serialize)]
pub(super) struct Citation {
    /// For a list of references.
    text: String,
    /// For a bibliography.
    bibtex: String,
    /// What another party gets the credit for, and who that is.
    origin: Option<(&'static str, String)>,
    /// For machines.
    #[serde(skip)]
    pub(super) record: Value,
}

impl Citation {
    /// Of a stored revision in a catalogue.
    pub(super) fn new(about: &About, stored: &StoredRevision) -> Citation {
        let material = &stored.material;
        let name = shortened(&material.name, 200);
        let hash = stored.content_hash.get(..12).unwrap_or(&stored.content_hash);
        let what =
            format!("{name} ({}, revision {}, content {hash})", material.slug, stored.revision);
        let credit = Credit::of(stored);
        let year = credit.year(stored);
        let dated = what.clone() + &year.map_or(String::new(), |year| format!(", {year}"));
        let mut text = match &credit {
            Credit::Own => {
                format!("{}{dated}. In: {}", listed(&about.authors()), catalogue_words(about))
            }
            Credit::BuiltIn => format!("{dated}. {BUILT_IN}. In: {}", catalogue_words(about)),
            Credit::Others(origin) => {
                let there = origin.catalogue();
                let authors = listed(&origin.authors);
                format!("{authors}{dated}. In: {there}. Republished in: {}", catalogue_words(about))
            }
        };
        let status = material.status.sentence();
        text += &status.as_ref().map_or(String::new(), |said| format!(" This entry is {said}"));
        let key = format!("{}-{}", material.slug, stored.revision);
        let bibtex = bibtex(about, &credit, &key, &what, year, status.clone());
        let creator = match credit {
            Credit::Own => creators(about),
            Credit::BuiltIn => Vec::new(),
            Credit::Others(origin) => origin.authors.iter().map(|author| person(author)).collect(),
        };
        let origin = match &credit {
            Credit::Own => None,
            Credit::BuiltIn => Some(("Made by", "matdb, which it is built into".to_owned())),
            Credit::Others(origin) => Some(("Imported from", origin.credit())),
        };
        let record = record(about, stored, &name, creator, status);
        Citation { text, bibtex, origin, record }
    }
}

/// A stored revision for machines.
fn record(
    about: &About,
    stored: &StoredRevision,
    name: &str,
    creator: Vec<Value>,
    status: Option<String>,
) -> Value {
    let material = &stored.material;
    let json_path = format!("../api/v1/materials/{}.json", material.slug);
    pruned(json!({
        "@context": "https://schema.org/",
        "@type": "Dataset",
        "name": name,
        "identifier": format!("{}@{}", material.slug, stored.revision),
        "description": shortened(&format!("{name}. {}", material.description), 4000),
        "license": licence_record(&material.licence),
        "keywords": material.tags,
        "version": stored.revision.to_string(),
        "creator": creator,
        "isPartOf": { "@type": "DataCatalog", "name": about.title },
        "distribution": [
            distribution(&json_path, "application/json"),
            distribution(&format!("{}.csv", material.slug), "text/csv"),
        ],
        "creativeWorkStatus": status,
    }))
}

/// How to cite the catalogue as a whole.
pub(super) fn catalogue(about: &About) -> String {
    format!("{}{}", listed(&about.authors()), catalogue_words(about))
}

/// The catalogue for machines.
pub(super) fn catalogue_record(about: &About) -> Value {
    pruned(json!({
        "@context": "https://schema.org/",
        "@type": "DataCatalog",
        "name": about.title,
        "description": about.description,
        "license": about.licence.as_deref().map(licence_record),
        "version": about.version,
        "url": about.url,
        "creator": creators(about),
    }))
}

fn distribution(path: &str, media_type: &str) -> Value {
    json!({ "@type": "DataDownload", "contentUrl": path, "encodingFormat": media_type })
}

fn creators(about: &About) -> Vec<Value> {
    let mut creators = Vec::new();
    for Person { family, given, orcid, affiliation } in &about.people {
        creators.push(pruned(json!({
            "@type": "Person",
            "familyName": family,
            "givenName": given,
            "affiliation": affiliation,
            "identifier": orcid.as_ref().map(|orcid| format!("https://orcid.org/{orcid}")),
        })));
    }
    for Institute { name, url } in &about.institutes {
        creators.push(pruned(json!({ "@type": "Organization", "name": name, "url": url })));
    }
    creators
}

/// A person as `Family, Given`, or an institute by its name.
fn person(author: &str) -> Value {
    match author.split_once(", ") {
        Some((family, given)) => {
            json!({ "@type": "Person", "familyName": family, "givenName": given })
        }
        None => json!({ "@type": "Organization", "name": author }),
    }
}

/// Names before a title.
fn listed(authors: &[String]) -> String {
    if authors.is_empty() { String::new() } else { authors.join("; ") + ". " }
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

fn bibtex(
    about: &About,
    credit: &Credit,
    key: &str,
    title: &str,
    year: Option<u16>,
    status: Option<String>,
) -> String {
    let here = (Some(about.title.clone()), &about.version, &about.doi, &about.url);
    let (authors, (place, version, doi, url), note) = match credit {
        Credit::Own => (about.authors(), here, None),
        Credit::BuiltIn => (Vec::new(), here, Some(BUILT_IN.to_owned())),
        Credit::Others(o) => {
            let there = (Some(o.title().to_owned()), &o.version, &o.doi, &o.url);
            (o.authors.clone(), there, Some(format!("Republished in {}", catalogue_words(about))))
        }
    };
    let notes: Vec<String> = note.into_iter().chain(status).collect();
    let note = (!notes.is_empty()).then(|| notes.join("; "));
    let fields = [
        ("title", Some(title.to_owned())),
        ("howpublished", place),
        ("year", year.map(|year| year.to_string())),
        ("version", version.clone()),
        ("doi", doi.clone()),
        ("url", url.clone()),
        ("note", note),
    ];
    let short = fields.map(|(name, value)| (name, value.map(|value| shortened(&value, 400))));
    let authors: Vec<String> = authors.iter().map(|author| shortened(author, 400)).collect();
    entry("misc", &format!("matdb-{key}"), &authors, short).trim_end().to_owned()
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
