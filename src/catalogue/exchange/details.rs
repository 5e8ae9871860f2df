//! What a person states about a foreign file that does not state it itself.

use super::detail::Detail;
use super::error::ExchangeError;
use crate::brdf::Brdf;
use crate::formats::ColumnNames;
use crate::material::{Material, Slug, SourceKind};

/// What a person states about a foreign file; what is none must be in the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Details {
    /// Short name of the material.
    pub slug: Option<Slug>,
    /// Full name; by default the short one.
    pub name: Option<String>,
    /// Kind of material.
    pub class: Option<String>,
    /// What it is, and what is not known about it; replaces the description in the file.
    pub description: Option<String>,
    /// Keywords, in addition to those of the file.
    pub tags: Vec<String>,
    /// SPDX identifier of the licence of the data.
    pub licence: Option<String>,
    /// Citation or, for own numbers, how they were made.
    pub source: Option<String>,
    /// Authors of the source, `Family, Given`.
    pub authors: Vec<String>,
    /// Year of the source, four digits.
    pub year: Option<u16>,
    /// Name of the curve; by default that of the file.
    pub curve: Option<String>,
    /// How the numbers came to be.
    pub kind: Option<SourceKind>,
    /// Name of the instrument.
    pub instrument: Option<String>,
    /// Frequency of a curve, or the wanted frequency of optical constants, Hz.
    pub frequency_hz: Option<f64>,
    /// Least power that counts as a detection, W.
    pub threshold_w: Option<f64>,
    /// Name and start of a model that is fitted to a curve and rendered in its place.
    pub model: Option<(String, Brdf)>,
    /// Our names for the columns of a table.
    pub columns: ColumnNames,
}

impl Details {
    /// Adds the description, tags, authors and year, which no foreign file holds.
    pub(super) fn complete(&self, material: &mut Material) {
        material.description = self.description.clone().unwrap_or(material.description.clone());
        for tag in &self.tags {
            if !material.tags.contains(tag) {
                material.tags.push(tag.clone());
            }
        }
        if let Some(source) = material.sources.first_mut() {
            source.citation.authors.extend(self.authors.iter().cloned());
            source.citation.year = self.year.or(source.citation.year);
        }
    }
}

/// The name of a file, without its folder.
pub(super) fn file_name(file: &str) -> &str {
    file.rsplit(['/', '\\']).next().unwrap_or(file)
}

/// The refusal that names all details that are missing.
pub(super) fn missing(file: &str, details: &[(bool, Detail)]) -> ExchangeError {
    let missing = details.iter().filter(|(there, _)| !there);
    let missing = missing.map(|(_, detail)| *detail).collect();
    ExchangeError::Missing { file: file.to_owned(), missing }
}
