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
    /// It has the hash of a revision, which has this number. The rows were damaged and have been rewritten.
    Repaired(u32),
}

impl Addition {
    /// The revision that has the content, from 1: the current one, but where an earlier one was repaired.
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
    /// Whether it is known that something else is stored than this says: then any of it may be wrong.
    #[serde(rename = "damaged", skip_serializing_if = "std::ops::Not::not")]
    pub is_damaged: bool,
}

/// Result of [`Store::remove`](crate::store::Store::remove).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Removal {
    /// Number of revisions.
    pub revisions: u32,
}
