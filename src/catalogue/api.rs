//! `api/v1/`: every material as JSON, and an index of them. Units stand in the names of keys; the JSON
//! Schemas in `schema/` say the rest.
//!
//! A file says by `schema_version` how it is to be read. A key that is added later is left out while it
//! says nothing; anything else that changes raises the version.

use std::io;

use serde::{Deserialize, Serialize};

use super::folder::INDEX;
use super::{About, CatalogueError, Folder};
use crate::material::{Material, Slug};
use crate::store::{Stored, Summary};

/// The version of the shape of every JSON file here.
pub(super) const SCHEMA_VERSION: u32 = 1;

/// Where a material's file stands.
pub(super) fn path(slug: &str) -> String {
    format!("{FOLDER}{slug}.json")
}

/// The folder of the materials' files.
pub(super) const FOLDER: &str = "api/v1/materials/";

/// The JSON Schemas that come with a publication.
pub(super) const SCHEMAS: [(&str, &str); 3] = [
    ("schema/material.json", include_str!("schema/material.json")),
    ("schema/index.json", include_str!("schema/index.json")),
    ("schema/changes.json", include_str!("schema/changes.json")),
];

/// `api/v1/materials/<slug>.json`.
#[derive(Serialize)]
pub(super) struct Record<'a> {
    schema_version: u32,
    revision: u32,
    content_hash: &'a str,
    added_at: &'a str,
    program_version: &'a str,
    material: &'a Material,
}

impl Record<'_> {
    pub fn new(stored: &Stored) -> Record<'_> {
        Record {
            schema_version: SCHEMA_VERSION,
            revision: stored.revision,
            content_hash: &stored.content_hash,
            added_at: &stored.added_at,
            program_version: &stored.program_version,
            material: &stored.material,
        }
    }
}

/// A line of the index.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    pub slug: Slug,
    pub name: String,
    pub class: String,
    pub licence: String,
    pub revision: u32,
    pub content_hash: String,
    pub added_at: String,
    pub render_kind: String,
    pub curves: u32,
    pub observations: u32,
    pub fits: u32,
    /// From the folder of the publication.
    pub path: String,
}

impl Entry {
    pub fn new(summary: &Summary, stored: &Stored) -> Entry {
        Entry {
            slug: summary.slug.clone(),
            name: summary.name.clone(),
            class: summary.class.clone(),
            licence: stored.material.licence.clone(),
            revision: stored.revision,
            content_hash: stored.content_hash.clone(),
            added_at: stored.added_at.clone(),
            render_kind: summary.render_kind.as_str().to_owned(),
            curves: summary.curves,
            observations: summary.observations,
            fits: summary.fits,
            path: path(summary.slug.as_str()),
        }
    }
}

/// `api/v1/index.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Index {
    pub schema_version: u32,
    pub title: String,
    pub licence: String,
    pub version: Option<String>,
    /// When the newest entry was added: UTC, ISO 8601; none in an empty catalogue.
    pub date: Option<String>,
    pub materials: Vec<Entry>,
}

impl Index {
    pub fn new(about: &About, materials: Vec<Entry>) -> Index {
        Index {
            schema_version: SCHEMA_VERSION,
            title: about.title.clone(),
            licence: about.licence.clone(),
            version: about.version.clone(),
            date: materials.iter().map(|entry| &entry.added_at).max().cloned(),
            materials,
        }
    }

    pub fn write(&self, folder: &mut Folder) -> Result<(), CatalogueError> {
        json(folder, INDEX, self)
    }
}

/// Writes a material's own file.
pub(super) fn write(folder: &mut Folder, stored: &Stored) -> Result<(), CatalogueError> {
    json(folder, &path(stored.material.slug.as_str()), &Record::new(stored))
}

/// Writes a value as one line of JSON.
pub(super) fn json(
    folder: &mut Folder,
    path: &str,
    value: &impl Serialize,
) -> Result<(), CatalogueError> {
    folder.stream(path, |out| {
        serde_json::to_writer(&mut *out, value).map_err(io::Error::from)?;
        out.write_all(b"\n")
    })
}
