//! The source of every number of a material, and how to cite the material and its sources: as text, as BibTeX and
//! as CSL-JSON.

use serde::Serialize;
use serde_json::{Value, json};

use super::bibtex::entry;
use super::leaves::{Leaf, leaves};
use crate::material::{Citation, Fit, Material, Origin, Source, SourceKind, builtin};
use crate::store::StoredRevision;

/// A source and the numbers that come from it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reference {
    /// The source; none for numbers that the entry states itself, such as its claimed range.
    pub source: Option<Source>,
    /// Paths of numbers: names from the outermost inwards, with a dot between. All points of a curve
    /// and all numbers of a report are one.
    pub numbers: Vec<String>,
}

/// Every source of a material with the numbers that come from it, in the material's order; at the end the numbers
/// that the entry states itself.
pub fn references(material: &Material) -> Vec<Reference> {
    let mut found: Vec<Reference> = material
        .sources
        .iter()
        .map(|source| Reference { source: Some(source.clone()), numbers: Vec::new() })
        .collect();
    let mut own = Reference { source: None, numbers: Vec::new() };
    for leaf in leaves(material).into_iter().filter(|leaf| leaf.value.is_number()) {
        let key = source_of(material, &leaf);
        if leaf.path.first().is_some_and(|list| list == "sources") {
            continue;
        }
        let reference = found
            .iter_mut()
            .find(|reference| reference.source.as_ref().map(|source| source.key.as_str()) == key);
        let numbers = &mut reference.unwrap_or(&mut own).numbers;
        let place = gathered(&leaf.path);
        if numbers.last() != Some(&place) {
            numbers.push(place);
        }
    }
    found.push(own);
    found
}

/// The key of the source of a number; `None` where the entry states it itself.
fn source_of<'a>(material: &'a Material, leaf: &Leaf) -> Option<&'a str> {
    if leaf.path.first().is_some_and(|list| list == "roughness") {
        return material.roughness.as_ref().map(|roughness| roughness.source.as_str());
    }
    let place = leaf.item?;
    let mut curves = material.curves.iter();
    let source = match leaf.path.first()?.as_str() {
        "curves" => &material.curves.get(place)?.source,
        "fits" => return Some(fit_source(material.fits.get(place)?, &leaf.path)),
        "permittivities" => {
            let entry = material.permittivities.get(place)?;
            let is_frequency = leaf.path.last().is_some_and(|field| field == "frequency_hz");
            entry.frequency_source.as_ref().filter(|_| is_frequency).unwrap_or(&entry.source)
        }
        "findings" => &material.findings.get(place)?.source,
        "layers" => material.layers.get(place)?.source.as_ref()?,
        "effects" => material.effects.get(place)?.source.as_ref()?,
        // The source is that of a curve that was measured with it, or in that session.
        "instruments" => {
            let key = &material.instruments.get(place)?.key;
            &curves.find(|curve| curve.instrument.as_ref() == Some(key))?.source
        }
        "sessions" => {
            let key = &material.sessions.get(place)?.key;
            &curves.find(|curve| curve.session.as_ref() == Some(key))?.source
        }
        _ => return None,
    };
    Some(source)
}

/// The source of a number of a fit: a parameter may have its own.
fn fit_source<'a>(fit: &'a Fit, path: &[String]) -> &'a str {
    let [_, _, part, parameter @ ..] = path else { return &fit.source };
    let parameter = parameter_path(parameter);
    let own = fit.parameter_sources.iter().find(|(path, _)| part == "model" && *path == parameter);
    own.map_or(&fit.source, |(_, source)| source)
}

/// The path of a model's parameter, which does not name the list of a sum's models.
fn parameter_path(names: &[String]) -> String {
    let names: Vec<&str> =
        names.iter().map(String::as_str).filter(|name| *name != "parts").collect();
    names.join(".")
}

/// A place for people: a curve's points and what a fit said of itself are one each.
fn gathered(path: &[String]) -> String {
    match path {
        [list, name, what, ..] if list == "curves" && what == "observations" => {
            format!("curve {name}")
        }
        [list, name, what, ..] if list == "fits" && what != "model" => {
            format!("fit {name}, {what}")
        }
        [list, name, _, parameter @ ..] if list == "fits" => {
            format!("fit {name}, {}", parameter_path(parameter))
        }
        path => {
            let names = path.iter().map(String::as_str);
            let names: Vec<&str> = names.filter(|name| name.parse::<usize>().is_err()).collect();
            match names.as_slice() {
                [list, key, numbers @ ..] if !numbers.is_empty() => {
                    format!("{} {key}, {}", one_of(list), numbers.join(", "))
                }
                names => names.join(", "),
            }
        }
    }
}

/// One thing of a list that a material has.
fn one_of(list: &str) -> &str {
    match list {
        "permittivities" => "permittivity",
        list => list.strip_suffix('s').unwrap_or(list),
    }
}

/// Who gets the credit for a stored revision.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Credit<'a> {
    /// The owners of the database.
    Own,
    /// The authors of the catalogue that it was imported from.
    Others(&'a Origin),
    /// The makers of matdb, wherever the revision was copied since.
    BuiltIn,
}

impl<'a> Credit<'a> {
    /// Of a stored revision.
    pub fn of(stored: &'a StoredRevision) -> Credit<'a> {
        let built_in = builtin::get(stored.material.slug.as_str()).and_then(Result::ok);
        let origin = stored.activity.as_ref().and_then(|activity| activity.origin.as_ref());
        match origin {
            _ if built_in.is_some_and(|own| own.content_hash() == stored.content_hash) => {
                Credit::BuiltIn
            }
            Some(origin) => Credit::Others(origin),
            None => Credit::Own,
        }
    }

    /// The catalogue of others that it was imported from.
    pub fn origin(self) -> Option<&'a Origin> {
        match self {
            Credit::Others(origin) => Some(origin),
            Credit::Own | Credit::BuiltIn => None,
        }
    }

    /// The year for the citation of a stored revision: when it was first added, for an imported one in the catalogue
    /// that it came from.
    pub fn year(self, stored: &StoredRevision) -> Option<u16> {
        let added_at = self.origin().map_or(&stored.added_at, |origin| &origin.added_at);
        added_at.get(..4)?.parse().ok()
    }
}

/// How to cite a revision of a material: which one it is, wherever it came from.
#[derive(Clone, Debug)]
pub struct Citable<'a> {
    /// The material.
    pub material: &'a Material,
    /// Its revision in a database; none for a built-in one.
    pub revision: Option<u32>,
    /// Year in which it was added, four digits; none for a built-in one.
    pub year: Option<u16>,
    /// Who gets the credit.
    pub credit: Credit<'a>,
}

impl Citable<'_> {
    /// A unique title: name, revision and the beginning of the content's hash.
    fn title(&self) -> String {
        let Material { slug, name, .. } = self.material;
        let hash = self.material.content_hash();
        let hash = hash.get(..12).unwrap_or(&hash);
        let version = concat!("matdb ", env!("CARGO_PKG_VERSION"));
        match self.revision {
            Some(revision) => format!("{name} ({slug}, revision {revision}, content {hash})"),
            None => format!("{name} ({slug}, built into {version}, content {hash})"),
        }
    }

    fn key(&self) -> String {
        let revision = self.revision.map_or(String::new(), |revision| format!("-{revision}"));
        format!("matdb-{}{revision}", self.material.slug)
    }

    /// The material and its sources as sentences.
    pub fn text(&self) -> String {
        let year = self.year.map_or(String::new(), |year| format!(", {year}"));
        let mut text = format!("{}{year}. {}.\n", self.title(), self.material.licence);
        text += &self.taken_from().map_or(String::new(), |from| format!("{from}.\n"));
        let status = self.material.status.sentence();
        text += &status.map_or(String::new(), |said| format!("This entry is {said}\n"));
        for Reference { source, numbers } in references(self.material) {
            match &source {
                Some(source) => text += &format!("\n{}", sentence(source)),
                None if numbers.is_empty() => continue,
                None => text += "\nstated by this entry itself\n",
            }
            numbers.iter().for_each(|place| text += &format!("    {place}\n"));
            if numbers.is_empty() {
                text += "    no number of this entry\n";
            }
        }
        text
    }

    /// The entry and the catalogue that it was imported from, or that it is built in.
    fn taken_from(&self) -> Option<String> {
        let origin = match self.credit {
            Credit::Own => return None,
            Credit::BuiltIn => return Some("Built into matdb".to_owned()),
            Credit::Others(origin) => origin,
        };
        let day = origin.added_at.get(..10).unwrap_or_default();
        Some(format!("From {}, revision {} of {day} there", origin.credit(), origin.revision))
    }

    /// Who published the catalogue that it was taken from.
    fn authors_there(&self) -> &[String] {
        self.credit.origin().map_or(&[], |origin| &origin.authors)
    }

    /// The material and its sources as BibTeX.
    pub fn bibtex(&self) -> String {
        let licence = format!("Licence {}", self.material.licence);
        let status = self.material.status.sentence();
        let own = [
            ("title", Some(self.title())),
            ("howpublished", self.taken_from()),
            ("year", self.year.map(|year| year.to_string())),
            ("doi", self.credit.origin().and_then(|origin| origin.doi.clone())),
            ("url", self.credit.origin().and_then(|origin| origin.url.clone())),
            ("note", Some(status.map_or(licence.clone(), |said| format!("{licence}; {said}")))),
        ];
        let mut text = entry("misc", &self.key(), self.authors_there(), own);
        for source in &self.material.sources {
            text += &entry(
                bibtex_type(source),
                &format!("{}-{}", self.key(), source.key),
                &source.citation.authors,
                [
                    ("title", Some(source.title.clone())),
                    (container_field(source), source.citation.container.clone()),
                    ("volume", source.citation.volume.clone()),
                    ("pages", source.citation.pages.clone()),
                    ("publisher", source.citation.publisher.clone()),
                    ("year", source.citation.year.map(|year| year.to_string())),
                    ("doi", source.doi.clone()),
                    ("url", source.url.clone()),
                    ("note", source.note.clone()),
                ],
            );
        }
        text
    }

    /// The material and its sources as CSL-JSON.
    pub fn csl(&self) -> Value {
        let notes: Vec<String> =
            self.taken_from().into_iter().chain(self.material.status.sentence()).collect();
        let note = (!notes.is_empty()).then(|| notes.join("; "));
        let authors_there: Vec<Value> =
            self.authors_there().iter().map(|author| person(author)).collect();
        let own = pruned(json!({
            "id": self.key(),
            "type": "dataset",
            "title": self.title(),
            "author": (!authors_there.is_empty()).then_some(authors_there),
            "issued": self.year.map(issued),
            "version": self.revision.map(|revision| revision.to_string()),
            "container-title": self.credit.origin().map(Origin::title),
            "DOI": self.credit.origin().and_then(|origin| origin.doi.clone()),
            "URL": self.credit.origin().and_then(|origin| origin.url.clone()),
            "license": self.material.licence,
            "note": note,
        }));
        let sources = self.material.sources.iter().map(|source| {
            let Citation { authors, year, container, volume, pages, publisher } = &source.citation;
            let names: Vec<Value> = authors.iter().map(|author| person(author)).collect();
            pruned(json!({
                "id": format!("{}-{}", self.key(), source.key),
                "type": csl_type(source),
                "title": source.title,
                "author": (!names.is_empty()).then_some(names),
                "issued": year.map(issued),
                "container-title": container,
                "volume": volume,
                "page": pages,
                "publisher": publisher,
                "DOI": source.doi,
                "URL": source.url,
                "license": source.licence,
                "note": source.note,
            }))
        });
        std::iter::once(own).chain(sources).collect()
    }
}

fn sentence(source: &Source) -> String {
    let Citation { year, container, volume, pages, publisher, .. } = &source.citation;
    let mut text = format!("{} ({}): ", source.key, source.kind.as_str());
    text += &authors(source).map_or(String::new(), |authors| format!("{authors}: "));
    text += &source.title;
    let place = [container, volume, pages, publisher].into_iter().flatten().cloned();
    let place: Vec<String> = place.chain(year.map(|year| year.to_string())).collect();
    if !place.is_empty() {
        text += &format!(". {}", place.join(", "));
    }
    let address = source.doi.as_ref().map(|doi| format!("https://doi.org/{doi}"));
    text += &address.or(source.url.clone()).map_or(String::new(), |at| format!(". {at}"));
    text + "\n"
}

fn authors(source: &Source) -> Option<String> {
    let authors = &source.citation.authors;
    (!authors.is_empty()).then(|| authors.join("; "))
}

fn is_article(source: &Source) -> bool {
    source.citation.container.is_some()
        && (source.citation.volume.is_some() || source.citation.pages.is_some())
}

fn bibtex_type(source: &Source) -> &'static str {
    if is_article(source) { "article" } else { "misc" }
}

fn container_field(source: &Source) -> &'static str {
    if is_article(source) { "journal" } else { "howpublished" }
}

fn csl_type(source: &Source) -> &'static str {
    match (is_article(source), source.kind) {
        (true, _) => "article-journal",
        (false, SourceKind::Measured | SourceKind::Synthetic) => "dataset",
        (false, SourceKind::Literature | SourceKind::Modelled) => "document",
    }
}

fn issued(year: u16) -> Value {
    json!({ "date-parts": [[year]] })
}

fn person(author: &str) -> Value {
    match author.split_once(", ") {
        Some((family, given)) => json!({ "family": family, "given": given }),
        None => json!({ "literal": author }),
    }
}

/// The record without its empty fields.
pub(super) fn pruned(mut record: Value) -> Value {
    if let Some(fields) = record.as_object_mut() {
        fields.retain(|_, value| !value.is_null());
    }
    record
}
