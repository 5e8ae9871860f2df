//! The materials of a scene that receive what a diagnosis found, and their revisions with it.

use super::findings::findings;
use super::provenance::add_source;
use super::scene_after::entries;
use crate::brdf::Brdf;
use crate::diagnose::{LEAST_SHOTS, Report};
use crate::effects::Level;
use crate::error::Error;
use crate::formats::EffectEntry;
use crate::material::{Fit, Material, Slug, SourceKind};
use crate::setup::{MaterialRevision, ReadyScene, SceneMaterial, find_material};
use crate::store::{Addition, Store};

/// Name of the fit that holds a refitted law.
const FIT: &str = "diagnosed";
/// Opens the message of a material that is not there any more.
const ASKED_BY: &str = "storing what was found: ";

/// A diagnosis whose findings go into the materials of its scene.
#[derive(Clone, Copy)]
pub struct Adoption<'a> {
    /// The scene that was diagnosed, with its materials.
    pub ready: &'a ReadyScene,
    /// What the diagnosis found.
    pub report: &'a Report,
    /// The material that alone receives everything, as its place among those of the scene.
    pub wanted: Option<usize>,
}

/// A material that receives what was found.
pub struct Recipient {
    /// Its place among the materials of the scene.
    pub number: usize,
    /// Its law, refitted.
    law: Brdf,
}

/// The place of a material among those of a scene, by its name in the scene or in the database.
///
/// # Errors
/// The scene has no such material.
pub fn find_recipient(ready: &ReadyScene, name: &str) -> Result<usize, Error> {
    let of_scene = ready.materials.iter().position(|material| material.name == name);
    let of_slug =
        ready.materials.iter().position(|material| material.found.material.slug.as_str() == name);
    of_scene.or(of_slug).ok_or_else(|| {
        let known: Vec<&str> = ready.materials.iter().map(|known| known.name.as_str()).collect();
        Error::Usage {
            problem: format!("the scene has no material `{name}`"),
            way_out: format!("its materials are: {}", known.join(", ")),
        }
    })
}

/// Checks that the materials of a scene can receive what a diagnosis finds: they are those of a database, and can have a fit
/// of the name that a diagnosis gives.
///
/// # Errors
/// A material that a program gave; a material with a curve of that name.
pub fn check_recipients(ready: &ReadyScene) -> Result<(), Error> {
    for SceneMaterial { name, found: MaterialRevision { material, .. }, .. } in &ready.materials {
        if ready.scene.given.contains_key(name) {
            return Err(Error::Usage {
                problem: format!(
                    "`{name}` is a material that the scene keeps itself, not one of the database"
                ),
                way_out: "add it to the database, if it is not there, and give the scene its name"
                    .to_owned(),
            });
        }
        if material.curves.iter().any(|curve| curve.name == FIT) {
            return Err(Error::Usage {
                problem: format!(
                    "`{}` has a curve of the name `{FIT}`, as the fit would have",
                    material.slug
                ),
                way_out: "give the curve another name".to_owned(),
            });
        }
    }
    Ok(())
}

impl Adoption<'_> {
    /// The materials that receive what was found: the wanted one, or all whose law was refitted.
    pub fn recipients(&self) -> Vec<Recipient> {
        let mut recipients = Vec::new();
        if self.report.effects.is_empty() {
            return recipients;
        }
        for number in self.candidates() {
            let region = self.region(number);
            let law = region.and_then(|region| self.report.laws.get(region)).cloned();
            recipients.extend(law.map(|law| Recipient { number, law }));
        }
        recipients
    }

    /// The current revisions of all materials that were looked at with what was tried on them and not
    /// found, each after a built-in one that is not in the database yet, and the places of the former.
    ///
    /// # Errors
    /// A material that the database does not have any more, or that becomes invalid.
    pub fn record_not_found(
        &self,
        title: &str,
        store: &Store,
    ) -> Result<(Vec<Material>, Vec<usize>), Error> {
        let (mut materials, mut last) = (Vec::new(), Vec::new());
        for number in self.candidates().filter(|&number| self.region(number).is_some()) {
            let slug = &self.ready.materials[number].found.material.slug;
            let MaterialRevision { mut material, revision } =
                find_material(Some(store), slug.as_str(), ASKED_BY)?;
            if revision.is_none() {
                materials.push(material.clone());
            }
            let key = add_source(&mut material, SourceKind::Modelled, title, FIT, None);
            let rendered = material.fits.iter().find(|fit| fit.name == material.render);
            let rendered = rendered.map(|fit| fit.name.clone());
            // The findings of the same diagnosis, run again, replace those of its first run.
            material.findings.retain(|known| known.source != key || known.fit_after.is_some());
            material.findings.extend(findings(self.report, rendered.as_deref(), None, &key));
            material.validate()?;
            last.push(materials.len());
            materials.push(material);
        }
        Ok((materials, last))
    }

    /// The current revision of a recipient with what was found, before it a built-in one that is not in
    /// the database yet.
    ///
    /// # Errors
    /// A material that the database does not have any more, or that becomes invalid.
    pub fn revise(
        &self,
        recipient: &Recipient,
        title: &str,
        store: &Store,
    ) -> Result<Vec<Material>, Error> {
        let slug = &self.ready.materials[recipient.number].found.material.slug;
        let MaterialRevision { material, revision } =
            find_material(Some(store), slug.as_str(), ASKED_BY)?;
        let first = revision.is_none().then(|| material.clone());
        let last = self.with_found(material, recipient, title)?;
        Ok(first.into_iter().chain([last]).collect())
    }

    /// A material of its own with the law and the effects that were found and nothing else, for a file.
    ///
    /// # Errors
    /// A name that makes no name of a material.
    pub fn make_material(&self, recipient: &Recipient, title: &str) -> Result<Material, Error> {
        let SceneMaterial { name, found, .. } = &self.ready.materials[recipient.number];
        let bare = Material {
            slug: slug_of_copy(name)?,
            name: format!("{}, diagnosed", found.material.name),
            description: format!("{name} with the law and the effects that a diagnosis found."),
            sources: Vec::new(),
            instruments: Vec::new(),
            curves: Vec::new(),
            fits: Vec::new(),
            roughness: None,
            layers: Vec::new(),
            permittivities: Vec::new(),
            sessions: Vec::new(),
            findings: Vec::new(),
            ..found.material.clone()
        };
        self.with_found(bare, recipient, title)
    }

    /// The names that the regions of the scene get: those of the recipients are replaced by `new`.
    pub fn region_names(&self, recipients: &[Recipient], new: &[String]) -> Vec<String> {
        let mut names = Vec::new();
        for &material in &self.ready.material_of_region {
            let material = usize::from(material);
            let place = recipients.iter().position(|recipient| recipient.number == material);
            let name = place.and_then(|place| new.get(place));
            names.push(name.unwrap_or(&self.ready.materials[material].name).clone());
        }
        names
    }

    /// The places of the materials that may receive something.
    fn candidates(&self) -> impl Iterator<Item = usize> {
        let wanted = self.wanted;
        let all = 0..self.ready.materials.len();
        all.filter(move |&number| wanted.is_none_or(|wanted| wanted == number))
    }

    /// The region of a material with most shots, if those are enough. Each region has a law of its own;
    /// that of this one stands for the material.
    fn region(&self, number: usize) -> Option<usize> {
        let mut most = (0, 0);
        for (region, &material) in self.ready.material_of_region.iter().enumerate() {
            if usize::from(material) == number {
                let rows = self.report.rows.iter();
                let shots = rows.filter(|row| usize::from(row.region) == region).count();
                most = most.max((shots, region));
            }
        }
        let (shots, region) = most;
        (shots >= LEAST_SHOTS).then_some(region)
    }

    /// A material with the refitted law and the effects in it: those that it declares and those found.
    fn with_found(
        &self,
        mut material: Material,
        recipient: &Recipient,
        title: &str,
    ) -> Result<Material, Error> {
        let key = add_source(&mut material, SourceKind::Modelled, title, FIT, None);
        let before = Some(material.render.clone())
            .filter(|name| *name != FIT && material.fits.iter().any(|fit| fit.name == *name));
        let fit = Fit {
            name: FIT.to_owned(),
            model: recipient.law.clone(),
            estimator: FIT.to_owned(),
            curve: None,
            source: key.clone(),
            lobes: self.ready.materials[recipient.number].lobes,
            parameter_sources: Vec::new(),
            covariance: None,
            report: None,
        };
        replace_fit(&mut material, fit);
        material.render = FIT.to_owned();
        // Earlier findings speak of the fit that was just replaced.
        material.findings.retain(|known| known.fit_after.as_deref() != Some(FIT));
        material.findings.extend(findings(self.report, before.as_deref(), Some(FIT), &key));
        let mut effects = Vec::new();
        for entry in &self.ready.materials[recipient.number].found.material.effects {
            // A material of its own does not have the sources of the one that it was made from.
            let source = entry.source.clone().filter(|key| has_source(&material, key));
            effects.push(EffectEntry { source, ..entry.clone() });
        }
        for entry in entries(&self.report.effects, Level::Material) {
            effects.push(EffectEntry { source: Some(key.clone()), ..entry });
        }
        material.effects = effects;
        material.validate()?;
        Ok(material)
    }
}

/// A material's name with the revision that adding it made current.
pub fn pinned_name(material: &Material, added: Addition) -> String {
    format!("{}@{}", material.slug, added.revision())
}

/// A material's name with the revision before the added one, where that is a new one.
pub fn replaced_name(material: &Material, added: Addition, store: &Store) -> Option<String> {
    match added {
        // It is stored by now: a revision before that cannot be read is not an error.
        Addition::Revision(new) => {
            let before = store.revision_before(&material.slug, new).ok().flatten()?;
            Some(format!("{}@{before}", material.slug))
        }
        Addition::New | Addition::Unchanged(_) | Addition::Repaired(_) => None,
    }
}

/// Puts a fit in the place of the one of its name, or behind the others.
pub(super) fn replace_fit(material: &mut Material, fit: Fit) {
    match material.fits.iter_mut().find(|known| known.name == fit.name) {
        Some(known) => *known = fit,
        None => material.fits.push(fit),
    }
}

/// The name of a material that is made from the one of this name.
fn slug_of_copy(name: &str) -> Result<Slug, Error> {
    let name = name.replace(['@', ':'], "-");
    let slug = format!("{name:.54}-{FIT}").parse();
    slug.map_err(|problem| Error::Usage { problem, way_out: "rename the material".to_owned() })
}

fn has_source(material: &Material, key: &str) -> bool {
    material.sources.iter().any(|source| source.key == key)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::builtin;

    #[test]
    fn the_replaced_revision_is_the_one_before_even_if_a_number_is_missing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("matdb.sqlite");
        let mut ptfe = builtin::get("ptfe").unwrap().unwrap();
        Store::open(&path).unwrap().add([&ptfe]).unwrap();
        let lose = "PRAGMA foreign_keys = off; UPDATE material SET current_revision = 9";
        rusqlite::Connection::open(&path).unwrap().execute_batch(lose).unwrap();
        ptfe.description += " Changed.";
        let mut store = Store::open(&path).unwrap();
        let added = store.add([&ptfe]).unwrap()[0];
        assert_eq!(pinned_name(&ptfe, added), "ptfe@10");
        assert_eq!(replaced_name(&ptfe, added, &store).as_deref(), Some("ptfe@1"));
        assert_eq!(replaced_name(&ptfe, Addition::New, &store), None);
    }
}
