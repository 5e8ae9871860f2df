//! The database of materials: a file of SQLite, and the only SQL in the crate.
//!
//! Plain [`Material`]s go in and come out, bit for bit; a revision once written never changes.
//! Every call that writes is one transaction: it happens as a whole or not at all, whenever the
//! program or the machine stops. Several programs may use a file at once.
//!
//! ```
//! use matdb::material::builtin;
//! use matdb::store::{Added, Store};
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("materials.sqlite");
//! let paint = builtin::get("mannequin-paint").unwrap().unwrap();
//! let mut store = Store::open(&path).unwrap();
//! assert_eq!(store.add([&paint]).unwrap(), [Added::New]);
//! assert_eq!(store.get(&paint.slug, None).unwrap().unwrap().material, paint);
//! ```

mod again;
mod connect;
mod error;
mod find;
mod read;
mod repair;
mod tables;
mod write;

use std::path::{Path, PathBuf};

use rusqlite::Connection;

use crate::brdf::Brdf;
use crate::material::{Activity, Material, Slug, SourceKind};
use crate::measure::AngleStatistics;

pub use again::{Again, Difference};
pub use error::StoreError;
pub use find::outline::Outlined;
pub use find::{Filter, Hit};
pub use tables::{Cell, Column, ColumnKind, Reference, Table};

/// An open database.
#[derive(Debug)]
pub struct Store {
    conn: Connection,
    path: PathBuf,
    activity: Option<Activity>,
}

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

/// A line of [`Store::history`].
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

/// A line of [`Store::list`].
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

/// What [`Store::remove`] took away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Removed {
    /// Number of revisions.
    pub revisions: u32,
}

impl Store {
    /// Opens a database, makes it when there is none, and brings an older one up to date.
    ///
    /// # Errors
    /// When the file is somebody else's, newer than the program, damaged, locked or cannot be
    /// written. Somebody else's file and a newer one are left as they are.
    pub fn open(path: impl AsRef<Path>) -> Result<Store, StoreError> {
        let path = path.as_ref().to_owned();
        let conn = connect::writable(&path)?;
        Ok(Store { conn, path, activity: None })
    }

    /// Opens a database for reading only; `None` when there is no file or nothing in it.
    ///
    /// Changes nothing, and works where nothing can be written: a file of an older schema is brought
    /// up to date in memory and stays as it is until somebody [opens](Store::open) it for writing.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_existing(path: impl AsRef<Path>) -> Result<Option<Store>, StoreError> {
        let path = path.as_ref().to_owned();
        let conn = connect::readable(&path)?;
        Ok(conn.map(|conn| Store { conn, path, activity: None }))
    }

    /// Opens a file that nobody writes, such as somebody else's copy: what lies beside it is neither
    /// read nor changed. `None` when there is no file or nothing in it.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open_frozen(path: impl AsRef<Path>) -> Result<Option<Store>, StoreError> {
        let path = path.as_ref().to_owned();
        let conn = connect::frozen(&path)?;
        Ok(conn.map(|conn| Store { conn, path, activity: None }))
    }

    /// The file, by the name under which it was opened.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The same, but errors name the file of which this is a copy.
    pub(crate) fn known_as(self, original: &Store) -> Store {
        Store { path: original.path.clone(), ..self }
    }

    /// Whether a file that was opened [frozen](Store::open_frozen) has an older schema: then what is read is
    /// a copy in memory, brought up to date.
    pub fn is_of_older_schema(&self) -> bool {
        self.conn.path().is_none_or(str::is_empty)
    }

    /// An empty database in memory, gone when it is dropped.
    ///
    /// # Errors
    /// When there is no memory.
    pub fn in_memory() -> Result<Store, StoreError> {
        let conn = connect::in_memory()?;
        Ok(Store { conn, path: PathBuf::from(":memory:"), activity: None })
    }

    /// Records with every revision that is added from now on which command made it of what.
    pub fn record(&mut self, activity: Activity) {
        self.activity = Some(activity);
    }

    /// Adds materials, or revisions to those of the same names, in one transaction: all or none.
    /// What is already current is not added again. The answers are in the order of `materials`.
    ///
    /// # Errors
    /// When a material is not [valid](Material::validate), or the file cannot be written.
    pub fn add<'a>(
        &mut self,
        materials: impl IntoIterator<Item = &'a Material>,
    ) -> Result<Vec<Added>, StoreError> {
        self.add_if(materials, |added| Ok(added.to_vec()))
    }

    /// The same if `then`, which gets the answers before they are kept, succeeds: what it does and what
    /// is stored happen together. Its result must undo itself when it is dropped after a failure here.
    ///
    /// # Errors
    /// As [`Store::add`], and those of `then`.
    pub fn add_if<'a, T, E: From<StoreError>>(
        &mut self,
        materials: impl IntoIterator<Item = &'a Material>,
        then: impl FnOnce(&[Added]) -> Result<T, E>,
    ) -> Result<T, E> {
        let activity = self.activity.clone();
        let made = |material| (material, activity.as_ref());
        self.add_all(&materials.into_iter().map(made).collect::<Vec<_>>(), then)
    }

    /// Adds materials as [`Store::add`] does, each recorded with which command made it of what.
    ///
    /// # Errors
    /// As [`Store::add`].
    pub fn add_made(&mut self, made: &[(Material, Activity)]) -> Result<Vec<Added>, StoreError> {
        let made: Vec<_> = made.iter().map(|(material, by)| (material, Some(by))).collect();
        self.add_all(&made, |added| Ok(added.to_vec()))
    }

    fn add_all<T, E: From<StoreError>>(
        &mut self,
        made: &[(&Material, Option<&Activity>)],
        then: impl FnOnce(&[Added]) -> Result<T, E>,
    ) -> Result<T, E> {
        for (material, _) in made {
            let slug = || material.slug.to_string();
            material.validate().map_err(|error| StoreError::Material { slug: slug(), error })?;
        }
        let Store { conn, path, .. } = self;
        let failed = |error| StoreError::new(path, error);
        let tx = conn.transaction().map_err(failed)?;
        let mut adding = write::Adding::new(&tx);
        let added: Result<Vec<Added>, _> =
            made.iter().map(|(material, activity)| adding.add(material, *activity)).collect();
        let added = added.and_then(|added| adding.finish().map(|()| added)).map_err(failed)?;
        let done = then(&added)?;
        tx.commit().map_err(failed)?;
        Ok(done)
    }

    /// Adds materials as [`Store::add`] does, in one transaction, but holds only one at a time. `then`
    /// hears what became of each; an error of its own, or of `materials`, takes everything back.
    ///
    /// # Errors
    /// As [`Store::add`], those of `then` and of `materials`.
    pub fn add_each<E: From<StoreError>>(
        &mut self,
        materials: impl IntoIterator<Item = Result<Material, E>>,
        then: impl FnMut(&Material, Added) -> Result<(), E>,
    ) -> Result<(), E> {
        let activity = self.activity.clone();
        let made = |material: Result<Material, E>| Ok((material?, activity.clone()));
        self.add_each_made(materials.into_iter().map(made), then)
    }

    /// Adds materials as [`Store::add_each`] does, each recorded with which command made it of what.
    ///
    /// # Errors
    /// As [`Store::add_each`].
    pub fn add_each_made<E: From<StoreError>>(
        &mut self,
        made: impl IntoIterator<Item = Result<(Material, Option<Activity>), E>>,
        mut then: impl FnMut(&Material, Added) -> Result<(), E>,
    ) -> Result<(), E> {
        let Store { conn, path, .. } = self;
        let failed = |error| StoreError::new(path, error);
        let tx = conn.transaction().map_err(failed)?;
        let mut adding = write::Adding::new(&tx);
        for made in made {
            let (material, activity) = made?;
            let slug = || material.slug.to_string();
            material.validate().map_err(|error| StoreError::Material { slug: slug(), error })?;
            then(&material, adding.add(&material, activity.as_ref()).map_err(failed)?)?;
        }
        adding.finish().map_err(failed)?;
        Ok(tx.commit().map_err(failed)?)
    }

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
        read::licences(&self.conn).map_err(|error| StoreError::new(&self.path, error))
    }

    /// One revision of a material, or the current one; `None` when there is no such material, or it never had that
    /// revision.
    ///
    /// # Errors
    /// When the file cannot be read, holds something else than was stored, or has lost the revision.
    pub fn get(&self, slug: &Slug, revision: Option<u32>) -> Result<Option<Stored>, StoreError> {
        let stored = read::get(&self.conn, slug, revision)
            .map_err(|error| StoreError::new(&self.path, error))?;
        match stored {
            Some(stored) if stored.material.content_hash() != stored.content_hash => {
                let problem =
                    format!("revision {} of `{slug}` is not what was stored", stored.revision);
                Err(StoreError::Corrupt { file: self.path.clone(), problem })
            }
            stored => Ok(stored),
        }
    }

    /// What scenes render of a material's current revision, and the angles at which that answers, rad, read without all else and without comparing its hash; `None` when it is not there or no curve can
    /// be made of it.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn rendered(&self, slug: &Slug) -> Result<Option<(Brdf, [f64; 2])>, StoreError> {
        read::rendered(&self.conn, slug).map_err(|error| StoreError::new(&self.path, error))
    }

    /// Statistics by angle of a curve of a revision, or of the current one, as they were computed when
    /// it was added; none for a curve or revision that is not there, for a curve without backscatter, or
    /// with points above the instrument's range, and for what an older program stored.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn statistics(
        &self,
        slug: &Slug,
        revision: Option<u32>,
        curve: &str,
    ) -> Result<Vec<AngleStatistics>, StoreError> {
        read::statistics(&self.conn, slug, revision, curve)
            .map_err(|error| StoreError::new(&self.path, error))
    }

    /// What is wrong with the file as such, a sentence each: damaged pages and indexes, references to
    /// nothing, and what lists and searches say without being so.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn damage(&self) -> Result<Vec<String>, StoreError> {
        read::damage(&self.conn).map_err(|error| StoreError::new(&self.path, error))
    }

    /// Whether there is a material of that name, sound or damaged.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn holds(&self, slug: &Slug) -> Result<bool, StoreError> {
        let current = read::current_revision(&self.conn, slug);
        Ok(current.map_err(|error| StoreError::new(&self.path, error))?.is_some())
    }

    /// Every revision of a material, oldest first; none when there is no such material.
    ///
    /// # Errors
    /// When the file cannot be read, or a material has no revision.
    pub fn history(&self, slug: &Slug) -> Result<Vec<RevisionSummary>, StoreError> {
        read::history(&self.conn, slug).map_err(|error| StoreError::new(&self.path, error))
    }

    /// Removes materials with all their revisions, in one transaction; `None` for each that is not
    /// there.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn remove<'a>(
        &mut self,
        slugs: impl IntoIterator<Item = &'a Slug>,
    ) -> Result<Vec<Option<Removed>>, StoreError> {
        let slugs: Vec<&Slug> = slugs.into_iter().collect();
        write::remove(&mut self.conn, &slugs).map_err(|error| StoreError::new(&self.path, error))
    }
}
