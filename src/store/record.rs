//! Plain data that the database returns: revisions, rows of lists, and results of writing.

use serde::Serialize;

use crate::material::{Activity, Material, Slug, SourceKind};

/// Result of adding a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Addition {
    /// The material is new and has revision 1.
    New,
    /// It differs from the current revision and is now the revision of this number.
    Revision(u32),
    /// It equals the current revision, which has this number.
    Unchanged(u32),
    /// It has the hash of the current revision, which has this number. The rows were damaged and have been rewritten.
    Repaired(u32),
}

impl Addition {
    /// The revision that is current now, from 1.
    pub fn revision(self) -> u32 {
        match self {
            Addition::New => 1,
            Addition::Revision(number)
            | Addition::Unchanged(number)
            | Addition::Repaired(number) => number,
        }
    }
}

/// One revision of a material, as stored.
#[derive(Clone, Debug, PartialEq)]
pub struct StoredRevision {
    /// The material.
    pub material: Material,
    /// Its revision, from 1.
    pub revision: u32,
    /// [`Material::content_hash`] when it was added.
    pub content_hash: String,
    /// When it was added: UTC, ISO 8601, to the second.
    pub added_at: String,
    /// Version of the program that added it.
    pub program_version: String,
    /// The command that made it and its inputs; none where that was not recorded.
    pub activity: Option<Activity>,
}

/// What is stored with the content of a revision. New fields of an activity must leave the JSON of older ones as it is:
/// files have its hash.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct Record {
    pub slug: String,
    pub revision: u32,
    pub content_hash: String,
    pub added_at: String,
    pub program_version: String,
    pub activity: Option<Activity>,
}

impl Record {
    /// BLAKE3 of its JSON.
    pub fn hash(&self) -> String {
        // Serialising plain structs into memory has no way to fail.
        blake3::hash(&serde_json::to_vec(self).unwrap_or_default()).to_hex().to_string()
    }
}

/// A record as it is, and its hash as it was stored.
pub(super) struct Recorded {
    pub record: Record,
    /// None where the record was damaged when its hash would have been computed.
    pub hash: Option<String>,
}

impl Recorded {
    pub fn is_as_stored(&self) -> bool {
        self.hash.as_ref() == Some(&self.record.hash())
    }

    /// Whether it was stored under another number, of those up to `most`.
    pub fn is_renumbered(&self, most: u32) -> bool {
        // More numbers would take hours. What is not found among them counts as damaged all the same.
        self.hash.is_some()
            && (1..=most.min(10_000)).filter(|number| *number != self.record.revision).any(
                |number| {
                    let other = Record { revision: number, ..self.record.clone() };
                    self.hash.as_ref() == Some(&other.hash())
                },
            )
    }
}

/// One entry of [`Store::history`](crate::store::Store::history).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RevisionSummary {
    /// Its number, from 1.
    pub revision: u32,
    /// When it was added: UTC, ISO 8601, to the second.
    pub added_at: String,
    /// Version of the program that added it.
    pub program_version: String,
    /// Title of the catalogue from which it was imported.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<String>,
}

/// One entry of [`Store::list`](crate::store::Store::list).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Short name.
    pub slug: Slug,
    /// Full name.
    pub name: String,
    /// Class, such as `polymer`.
    pub class: String,
    /// Current revision, from 1.
    pub revision: u32,
    /// Kind of the source of what scenes render.
    pub render_kind: SourceKind,
    /// `active`, `superseded` or `withdrawn`.
    pub status: String,
    /// Number of curves.
    pub curves: u32,
    /// Number of points on all curves together.
    pub observations: u32,
    /// Number of scattering models with parameters.
    pub fits: u32,
}

/// Result of [`Store::remove`](crate::store::Store::remove).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Removal {
    /// Number of revisions.
    pub revisions: u32,
}
