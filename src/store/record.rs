//! Plain data that the database gives back: revisions, lines of lists, and results of writing.

use crate::material::{Activity, Material, Slug, SourceKind};

/// What adding a material did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Added {
    /// There was none of that name: this is revision 1.
    New,
    /// It differs from the current revision and became the revision of this number.
    Revision(u32),
    /// It is what the current revision, of this number, already says.
    Unchanged(u32),
    /// It is what the current revision, of this number, was, whose rows were damaged: they were written anew.
    Repaired(u32),
}

impl Added {
    /// The revision that is current now, from 1.
    pub fn revision(self) -> u32 {
        match self {
            Added::New => 1,
            Added::Revision(number) | Added::Unchanged(number) | Added::Repaired(number) => number,
        }
    }
}

/// One revision of a material, as stored.
#[derive(Clone, Debug, PartialEq)]
pub struct Stored {
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
    /// Which command made it of what; none where that was not recorded.
    pub activity: Option<Activity>,
}

/// A line of [`Store::history`](crate::store::Store::history).
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct RevisionSummary {
    /// Its number, from 1.
    pub revision: u32,
    /// When it was added: UTC, ISO 8601, to the second.
    pub added_at: String,
    /// Version of the program that added it.
    pub program_version: String,
    /// Title of somebody else's catalogue that it was taken from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub origin: Option<String>,
}

/// A line of [`Store::list`](crate::store::Store::list).
#[derive(Clone, Debug, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Short name.
    pub slug: Slug,
    /// Full name.
    pub name: String,
    /// Kind of stuff.
    pub class: String,
    /// Current revision, from 1.
    pub revision: u32,
    /// How the numbers that a scene renders came to be.
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

/// What [`Store::remove`](crate::store::Store::remove) took away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Removed {
    /// Number of revisions.
    pub revisions: u32,
}
