//! A new material of a measured curve and its fit.

use std::path::Path;

use super::admission;
use super::fit_request::out_of_range;
use super::fit_storage::{FitStorage, NewFit, StoredFit, Target};
use super::fit_subject::FitSubject;
use crate::catalogue::exchange::{Details, Foreign};
use crate::error::Error;
use crate::setup::{Database, find_material};
use crate::store::Store;

/// Class of a new material that states none.
const USUAL_CLASS: &str = "sample";

/// A fit with its curve, for a material that need not be there yet.
pub struct FittedMaterial<'a> {
    /// What was fitted.
    pub subject: &'a FitSubject,
    /// The fit, which has converged.
    pub fit: &'a NewFit,
    /// What a new material states, with its name.
    pub details: Details,
    /// How a material that is there gets it.
    pub storage: FitStorage,
}

impl FittedMaterial<'_> {
    /// Stores the fit as a new revision of the material, or makes the material with curve and fit.
    ///
    /// # Errors
    /// Details that a new material lacks; what [`FitStorage`] refuses of one that is there; a fit that is out of range; a
    /// database that cannot be written.
    pub fn store(self, database: &Database) -> Result<StoredFit, Error> {
        let FittedMaterial { subject, fit, details, storage } = self;
        if fit.fit.model.validate().is_err() {
            return Err(out_of_range(subject));
        }
        let name = details.slug.as_ref().map(ToString::to_string).unwrap_or_default();
        // The first material makes the file.
        let there = Store::open_existing(database.path())?;
        let found = find_material(there.as_ref(), &name, "");
        let is_known =
            subject.found.is_some() || !matches!(found, Err(Error::UnknownMaterial { .. }));
        if is_known {
            let stated = [&details.class, &details.description];
            if stated.iter().any(|detail| detail.is_some()) {
                return Err(Error::usage(
                    format!("`{name}` is there, and has a class and a description"),
                    "leave them out, or give another name",
                ));
            }
            return storage.save(subject, fit, database);
        }
        let class = details.class.or_else(|| Some(USUAL_CLASS.to_owned()));
        let details = Details { curve: Some(subject.curve_name.clone()), class, ..details };
        let (mut material, _) =
            Foreign::Csv.read(&subject.label, &subject.curve.write(), &details)?;
        let [curve] = &mut material.curves[..] else {
            return Err(Error::usage("the curve has no point", "measure again"));
        };
        // The text of a file is rounded: keep the very points that were fitted.
        curve.observations.clone_from(&subject.curve.observations);
        let (curve, source) = (curve.name.clone(), curve.source.clone());
        let mut target = Target { material, curve, source };
        fit.add_to(&mut target, false);
        admission::check(&target.material, Path::new(&subject.label))?;
        fit.store(target, subject, database.write()?, database)
    }
}
