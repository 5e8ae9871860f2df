//! `api/v1/`: every material as JSON, and an index of them. The names of keys end in their units; the JSON
//! Schemas in `schema/` describe the rest.
//!
//! `schema_version` says how to read a file. A key of a later program is left out where it has no value; any other
//! change raises the version.

use std::io;

use serde::{Deserialize, Serialize};

use super::about::About;
use super::error::CatalogueError;
use super::folder::Folder;
use super::layout::{INDEX, material_path};
use super::references::Credit;
use crate::material::{Material, Origin, Slug, Status};
use crate::store::{StoredRevision, Summary};

/// The version of the shape of every JSON file here.
pub(super) const SCHEMA_VERSION: u32 = 1;

/// Largest file of a single material that is written or read, bytes: about 800 000 points.
pub(super) const LARGEST_MATERIAL_BYTES: u64 = 256 << 20;

/// `api/v1/materials/<slug>.json`.
#[derive(Serialize)]
pub(super) struct Record<'a> {
    schema_version: u32,
    revision: u32,
    content_hash: &'a str,
    added_at: &'a str,
    program_version: &'a str,
    /// The catalogue that it was imported from.
    #[serde(skip_serializing_if = "Option::is_none")]
    origin: Option<&'a Origin>,
    material: &'a Material,
}

impl Record<'_> {
    pub fn new(stored: &StoredRevision) -> Record<'_> {
        Record {
            schema_version: SCHEMA_VERSION,
            revision: stored.revision,
            content_hash: &stored.content_hash,
            added_at: &stored.added_at,
            program_version: &stored.program_version,
            origin: Credit::of(stored).origin(),
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
    /// Kind of the rendered data; for a model that was fitted to a curve, the kind of the curve.
    pub render_kind: String,
    /// Replaces the kind of a model that is stated with a curve, since nobody measured the model itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub render_words: Option<String>,
    pub curves: u32,
    pub observations: u32,
    pub fits: u32,
    /// Path from the folder of the publication.
    pub path: String,
    /// Whether it may still be used.
    #[serde(default, skip_serializing_if = "Status::is_active")]
    pub status: Status,
}

impl Entry {
    pub fn new(summary: &Summary, stored: &StoredRevision) -> Entry {
        Entry {
            slug: summary.slug.clone(),
            name: summary.name.clone(),
            class: summary.class.clone(),
            licence: stored.material.licence.clone(),
            revision: stored.revision,
            content_hash: stored.content_hash.clone(),
            added_at: stored.added_at.clone(),
            render_kind: summary.render_kind.as_str().to_owned(),
            render_words: stored.material.rendered_words(),
            curves: summary.curves,
            observations: summary.observations,
            fits: summary.fits,
            path: material_path(summary.slug.as_str()),
            status: stored.material.status.clone(),
        }
    }

    /// Whether it equals the entry that the database gives; older programs did not write `render_words`.
    pub fn is_of(&self, database: &Entry) -> bool {
        let words = database.render_words.clone().filter(|_| self.render_words.is_some());
        *self == Entry { render_words: words, ..database.clone() }
    }
}

/// `api/v1/index.json`.
#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Index {
    pub schema_version: u32,
    pub title: String,
    /// None where the catalogue is empty and declares none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub licence: Option<String>,
    pub version: Option<String>,
    /// When the newest entry was added: UTC, ISO 8601; none in an empty catalogue.
    pub date: Option<String>,
    /// Version of the program that published; older programs did not write it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub program_version: Option<String>,
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
            program_version: Some(env!("CARGO_PKG_VERSION").to_owned()),
            materials,
        }
    }

    pub fn write(&self, folder: &mut Folder) -> Result<(), CatalogueError> {
        json(folder, INDEX, self)
    }
}

/// Writes a material's own file.
pub(super) fn write(folder: &mut Folder, stored: &StoredRevision) -> Result<(), CatalogueError> {
    let slug = stored.material.slug.as_str();
    json(folder, &material_path(slug), &Record::new(stored))?;
    folder.sums().get(&material_path(slug)).map_or(Ok(()), |sum| check_size(slug, sum.bytes))
}

/// Refuses a material that is too large for `verify`.
fn check_size(slug: &str, bytes: u64) -> Result<(), CatalogueError> {
    let limit = LARGEST_MATERIAL_BYTES;
    if bytes > limit {
        return Err(CatalogueError::TooLarge { slug: slug.to_owned(), bytes, limit });
    }
    Ok(())
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::{Censor, Observation};

    #[test]
    fn a_curve_of_300_000_points_fits_and_what_does_not_is_refused_with_its_size() {
        let long = Some(std::f64::consts::PI * 1e-17);
        let point = Observation {
            theta_i_rad: 0.123_456_789_012_345_6,
            theta_r_rad: 0.123_456_789_012_345_6,
            delta_phi_rad: 0.123_456_789_012_345_6,
            sigma0: long,
            censor: Censor::Right,
            threshold_sigma0: long,
            theta_sd_rad: long,
            power_w: long,
            range_m: long,
            chirp: Some(u32::MAX),
            target_m: Some([-std::f64::consts::PI * 1e-17; 2]),
        };
        let bytes = serde_json::to_vec(&point).unwrap().len() as u64 + 1;
        assert!(check_size("paint", 300_000 * bytes).is_ok(), "{bytes}");
        let said = check_size("paint", LARGEST_MATERIAL_BYTES + 1).unwrap_err().to_string();
        assert!(
            said.starts_with("`paint` takes 257 MiB as JSON and a publication takes 256"),
            "{said}"
        );
    }
}
