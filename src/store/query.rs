//! Reads materials by their names.

use rusqlite::Connection;

use super::database::Store;
use super::error::{InFile, StoreError};
use super::find::Filter;
use super::results::{RevisionSummary, StoredRevision, Summary};
use super::rows::moment;
use super::{damage, read, record};
use crate::brdf::Brdf;
use crate::material::Slug;
use crate::measure::AngleStatistics;

impl Store {
    /// Every material's current revision, sorted by name.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn list(&self) -> Result<Vec<Summary>, StoreError> {
        self.find(&Filter::default())
    }

    /// The licences of the current revisions, each once, sorted.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn licences(&self) -> Result<Vec<String>, StoreError> {
        read::licences(&self.conn).in_file(&self.path)
    }

    /// One revision of a material, or the current one. `None` when the material or the revision does not exist.
    ///
    /// # Errors
    /// When the file cannot be read, holds something else than was stored, or has lost the revision. The content, its
    /// number, date and program, and the command that made it are compared with the hashes that were stored.
    pub fn get(
        &self,
        slug: &Slug,
        revision: Option<u32>,
    ) -> Result<Option<StoredRevision>, StoreError> {
        let stored = stored(&self.conn, slug, revision).in_file(&self.path)?;
        match stored {
            Some(stored) if stored.material.content_hash() != stored.content_hash => {
                let problem =
                    format!("revision {} of `{slug}` is not what was stored", stored.revision);
                Err(StoreError::Corrupt { file: self.path.clone(), problem })
            }
            stored => Ok(stored),
        }
    }

    /// Number of the revision before one of a material; `None` for the first. A number between the two may be missing.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn revision_before(&self, slug: &Slug, revision: u32) -> Result<Option<u32>, StoreError> {
        read::revision_before(&self.conn, slug, revision).in_file(&self.path)
    }

    /// Which of these materials the database has, sound or damaged, sorted.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn present(&self, slugs: &[Slug]) -> Result<Vec<Slug>, StoreError> {
        read::present(&self.conn, slugs).in_file(&self.path)
    }

    /// The model that scenes render of a material's current revision, and its range of angles, rad. Nothing else is
    /// read, and the hash is not compared. `None` when the material does not exist or has no such model.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn rendered(&self, slug: &Slug) -> Result<Option<(Brdf, [f64; 2])>, StoreError> {
        read::rendered(&self.conn, slug).in_file(&self.path)
    }

    /// Statistics by angle of a curve of one revision, or of the current one, computed when it was added. Empty when
    /// the curve or the revision does not exist, has no backscatter or has points above the instrument's range.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn statistics(
        &self,
        slug: &Slug,
        revision: Option<u32>,
        curve: &str,
    ) -> Result<Vec<AngleStatistics>, StoreError> {
        read::statistics(&self.conn, slug, revision, curve).in_file(&self.path)
    }

    /// Every problem of the file as such, as a sentence each: damaged pages and indexes, references to missing rows,
    /// and wrong rows of lists and searches.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn damage(&self) -> Result<Vec<String>, StoreError> {
        damage::damage(&self.conn).in_file(&self.path)
    }

    /// Every material with fewer revisions than the greatest number says, as a sentence each. A repair leaves such gaps
    /// where it cannot bring a revision back.
    pub(crate) fn lost_revisions(&self) -> Result<Vec<String>, StoreError> {
        damage::lost_revisions(&self.conn).in_file(&self.path)
    }

    /// Reads in one moment: writes of other programs are not seen.
    pub(crate) fn in_one_moment<T>(&self, read: impl FnOnce(&Store) -> T) -> Result<T, StoreError> {
        let _moment = moment(&self.conn).in_file(&self.path)?;
        Ok(read(self))
    }

    /// Names of all materials as they are, sound or damaged.
    pub(crate) fn names(&self) -> Result<Vec<String>, StoreError> {
        read::names(&self.conn).in_file(&self.path)
    }

    /// Number of all revisions.
    pub(crate) fn revision_count(&self) -> Result<usize, StoreError> {
        read::revision_count(&self.conn).in_file(&self.path)
    }

    /// Whether a material of that name exists, sound or damaged, in the lists alone too.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn holds(&self, slug: &Slug) -> Result<bool, StoreError> {
        let found = read::present(&self.conn, std::slice::from_ref(slug));
        Ok(!found.in_file(&self.path)?.is_empty())
    }

    /// Numbers of the revisions of a material, ascending; none when there is no such material.
    ///
    /// # Errors
    /// When the file cannot be read, or a material has no revision.
    pub fn revision_numbers(&self, slug: &Slug) -> Result<Vec<u32>, StoreError> {
        read::revision_numbers(&self.conn, slug).in_file(&self.path)
    }

    /// Every revision of a material, oldest first; none when there is no such material.
    ///
    /// # Errors
    /// When the file cannot be read, a material has no revision, or a revision another number, date, program, command
    /// or origin than was stored.
    pub fn history(&self, slug: &Slug) -> Result<Vec<RevisionSummary>, StoreError> {
        history(&self.conn, slug).in_file(&self.path)
    }
}

/// A revision, of which the record is as it was stored.
fn stored(
    conn: &Connection,
    slug: &Slug,
    number: Option<u32>,
) -> rusqlite::Result<Option<StoredRevision>> {
    let _moment = moment(conn)?;
    let Some((id, stored)) = read::found(conn, slug, number)? else { return Ok(None) };
    record::check(conn, id, slug, stored.revision)?;
    Ok(Some(stored))
}

/// Every revision, of which the records are as they were stored.
fn history(conn: &Connection, slug: &Slug) -> rusqlite::Result<Vec<RevisionSummary>> {
    let _moment = moment(conn)?;
    let found = read::history(conn, slug)?;
    for (id, summary) in &found {
        record::check(conn, *id, slug, summary.revision)?;
    }
    Ok(found.into_iter().map(|(_, summary)| summary).collect())
}
