//! Adding and removing materials.

use super::database::Store;
use super::error::{InFile, StoreError};
use super::pages::check_pages;
use super::results::{Addition, Removal};
use super::write;
use crate::material::{Activity, Material, Slug};

impl Store {
    /// Attaches the command and its inputs to every revision that is added from now on.
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
    ) -> Result<Vec<Addition>, StoreError> {
        self.add_if(materials, |added| Ok(added.to_vec()))
    }

    /// As [`Store::add`], but only if `then` succeeds. It gets the answers before they are committed. Its result must
    /// undo itself when it is dropped, since committing may still fail.
    ///
    /// # Errors
    /// When a material is not [valid](Material::validate), or the file cannot be written; an error of `then`.
    pub fn add_if<'a, T, E: From<StoreError>>(
        &mut self,
        materials: impl IntoIterator<Item = &'a Material>,
        then: impl FnOnce(&[Addition]) -> Result<T, E>,
    ) -> Result<T, E> {
        let activity = self.activity.clone();
        let made = materials.into_iter().map(|material| (material, activity.as_ref()));
        self.add_all(&made.collect::<Vec<_>>(), then)
    }

    /// Adds materials as [`Store::add`] does, each with the command that made it and its inputs.
    ///
    /// # Errors
    /// When a material is not [valid](Material::validate), or the file cannot be written.
    pub fn add_made(&mut self, made: &[(Material, Activity)]) -> Result<Vec<Addition>, StoreError> {
        let made: Vec<_> = made.iter().map(|(material, by)| (material, Some(by))).collect();
        self.add_all(&made, |added| Ok(added.to_vec()))
    }

    fn add_all<T, E: From<StoreError>>(
        &mut self,
        made: &[(&Material, Option<&Activity>)],
        then: impl FnOnce(&[Addition]) -> Result<T, E>,
    ) -> Result<T, E> {
        for (material, _) in made {
            check(material)?;
        }
        let Store { conn, path, .. } = self;
        let tx = conn.transaction().in_file(path)?;
        check_pages(&tx).in_file(path)?;
        let mut adding = write::MaterialWriter::new(&tx);
        let added: Result<Vec<Addition>, _> =
            made.iter().map(|(material, activity)| adding.add(material, *activity)).collect();
        let added = added.and_then(|added| adding.finish().map(|()| added)).in_file(path)?;
        let done = then(&added)?;
        tx.commit().in_file(path)?;
        Ok(done)
    }

    /// Adds materials as [`Store::add`] does, in one transaction, but holds only one at a time. `then`
    /// gets the answer for each; an error of `then` or of `materials` undoes everything.
    ///
    /// # Errors
    /// When a material is not [valid](Material::validate), or the file cannot be written; an error of `then` or of `materials`.
    pub fn add_each<E: From<StoreError>>(
        &mut self,
        materials: impl IntoIterator<Item = Result<Material, E>>,
        then: impl FnMut(&Material, Addition) -> Result<(), E>,
    ) -> Result<(), E> {
        let activity = self.activity.clone();
        let made = materials.into_iter().map(|material| Ok((material?, activity.clone())));
        self.add_each_made(made, then)
    }

    /// Adds materials as [`Store::add_each`] does, each with the command that made it and its inputs.
    ///
    /// # Errors
    /// When a material is not [valid](Material::validate), or the file cannot be written; an error of `then` or of `made`.
    pub fn add_each_made<E: From<StoreError>>(
        &mut self,
        made: impl IntoIterator<Item = Result<(Material, Option<Activity>), E>>,
        mut then: impl FnMut(&Material, Addition) -> Result<(), E>,
    ) -> Result<(), E> {
        let Store { conn, path, .. } = self;
        let tx = conn.transaction().in_file(path)?;
        check_pages(&tx).in_file(path)?;
        let mut adding = write::MaterialWriter::new(&tx);
        for made in made {
            let (material, activity) = made?;
            check(&material)?;
            then(&material, adding.add(&material, activity.as_ref()).in_file(path)?)?;
        }
        adding.finish().in_file(path)?;
        Ok(tx.commit().in_file(path)?)
    }

    /// Removes materials with all their revisions, in one transaction; `None` for each that is not
    /// there.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub fn remove<'a>(
        &mut self,
        slugs: impl IntoIterator<Item = &'a Slug>,
    ) -> Result<Vec<Option<Removal>>, StoreError> {
        let slugs: Vec<&Slug> = slugs.into_iter().collect();
        write::remove(&mut self.conn, &slugs).in_file(&self.path)
    }
}

fn check(material: &Material) -> Result<(), StoreError> {
    let slug = &material.slug;
    material.validate().map_err(|error| StoreError::Material { slug: slug.to_string(), error })
}
