//! A fit into a material, as a new revision.

use serde::{Deserialize, Serialize};

use super::curve::{AddedCurve, CurveOrigin, add_curve};
use super::fit_subject::FitSubject;
use super::provenance::{activity, add_source};
use super::recipients::replace_fit;
use crate::error::Error;
use crate::fit::{Finding, FitResult};
use crate::material::{Curve, Fit, FitReport, Material, SourceKind};
use crate::setup::{Database, MaterialRevision, find_material};
use crate::store::Store;

/// How a fit is to be stored.
#[derive(Clone, Debug, Default)]
pub struct FitStorage {
    /// The material that gets it; `None` for the one whose curve was fitted.
    pub material: Option<String>,
    /// Whether scenes go on to render what they rendered before.
    pub keep_render: bool,
    /// Where the curve of a file comes from.
    pub origin: CurveOrigin,
}

/// Where a fit was stored.
#[derive(Clone, Debug, Serialize)]
pub struct StoredFit {
    /// The material.
    pub material: String,
    /// Its new revision.
    pub revision: u32,
    /// Name of the fit.
    pub fit: String,
    /// Name of the curve.
    pub curve: String,
    /// What scenes render of the material now.
    pub render: String,
    /// Whether the fit leaves the curve open somewhere, so that it is not rendered.
    pub curve_is_open: bool,
    /// The database.
    pub database: String,
}

/// The material that gets a fit, with its curve and the key of the curve's source.
pub(super) struct Target {
    pub material: Material,
    pub curve: String,
    pub source: String,
}

/// A fit that no material has yet.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct NewFit {
    /// The fit. Curve and source are those of the material that gets it.
    pub fit: Fit,
    /// Whether it leaves its curve open somewhere, so that it is not rendered.
    pub leaves_curve_open: bool,
}

impl NewFit {
    /// A fit of the curve of this name.
    pub fn new(found: &FitResult, name: &str, curve: &str) -> NewFit {
        let leaves_curve_open = found.verdict.iter().any(Finding::leaves_the_curve_open);
        NewFit { fit: found.stored(name, curve, ""), leaves_curve_open }
    }

    /// Adds the fit to a material, which renders it from now on, unless it keeps what it renders or the fit leaves the curve
    /// open.
    pub(super) fn add_to(&self, target: &mut Target, keep_render: bool) {
        let Target { material, curve, source } = target;
        let parameter_sources = add_parameter_sources(material, &self.fit);
        let (curve, source) = (Some(curve.clone()), source.clone());
        replace_fit(material, Fit { curve, source, parameter_sources, ..self.fit.clone() });
        if !keep_render && !self.leaves_curve_open {
            material.render.clone_from(&self.fit.name);
        }
    }

    /// Stores the material that has got the fit.
    pub(super) fn store(
        &self,
        target: Target,
        subject: &FitSubject,
        mut store: Store,
        database: &Database,
    ) -> Result<StoredFit, Error> {
        let files: Vec<_> = subject.file.as_deref().into_iter().collect();
        store.record(activity("fit", &files)?);
        let added = store.add([&target.material])?;
        Ok(StoredFit {
            material: target.material.slug.to_string(),
            revision: added.first().map_or(1, |added| added.revision()),
            fit: self.fit.name.clone(),
            curve: target.curve,
            render: target.material.render,
            curve_is_open: self.leaves_curve_open,
            database: database.path().display().to_string(),
        })
    }
}

impl FitStorage {
    /// Checks, before anything is fitted, that a fit of this name can be stored; the material with the curve in it.
    ///
    /// # Errors
    /// A material that is not known or is another one than the curve's; an origin of the curve that is missing,
    /// stated twice or not enough; a curve that has been revised since; a name that something else has.
    pub(super) fn check(
        &self,
        subject: &FitSubject,
        fit_name: &str,
        store: Option<&Store>,
    ) -> Result<Material, Error> {
        Ok(self.target(subject, fit_name, store)?.material)
    }

    /// Stores a fit in `database`, with the curve of a file. A fit of the same name is replaced, and stays in the
    /// earlier revisions.
    ///
    /// # Errors
    /// A material, an origin or a name with which the fit cannot be stored; a database that cannot be written.
    pub(super) fn save(
        &self,
        subject: &FitSubject,
        fit: &NewFit,
        database: &Database,
    ) -> Result<StoredFit, Error> {
        let store = database.write()?;
        let mut target = self.target(subject, &fit.fit.name, Some(&store))?;
        fit.add_to(&mut target, self.keep_render);
        fit.store(target, subject, store, database)
    }

    fn target(
        &self,
        subject: &FitSubject,
        fit_name: &str,
        store: Option<&Store>,
    ) -> Result<Target, Error> {
        let target = match &subject.found {
            Some(found) => self.target_of_material(subject, found, store)?,
            None => self.target_of_file(subject, store)?,
        };
        let (material, name) = (&target.material, fit_name);
        let what = if material.curves.iter().any(|curve| curve.name == name) {
            "a curve"
        } else if material.fits.iter().any(|fit| fit.name == name && fit.report.is_none()) {
            "a fit without a report"
        } else {
            return Ok(target);
        };
        Err(Error::usage(
            format!("`{}` has {what} of the name `{name}`", material.slug),
            "give the fit another name",
        ))
    }

    /// The current revision of the material whose curve was fitted.
    fn target_of_material(
        &self,
        subject: &FitSubject,
        found: &MaterialRevision,
        store: Option<&Store>,
    ) -> Result<Target, Error> {
        let slug = &found.material.slug;
        if self.material.as_ref().is_some_and(|name| name != slug.as_str()) {
            return Err(Error::usage(
                format!("a fit of a curve of `{slug}` belongs to `{slug}`"),
                "leave the name of the material out",
            ));
        }
        if self.origin != CurveOrigin::default() {
            return Err(Error::usage(
                format!("the curve of `{slug}` has a source already"),
                "leave out --kind, --source and the other details of its origin",
            ));
        }
        // The current revision: it may have been revised while the fit ran.
        let material = find_material(store, slug.as_str(), "")?.material;
        let [fitted, current] =
            [&found.material, &material].map(|material| curve_of(material, &subject.curve_name));
        match current.filter(|curve| fitted == Some(*curve)) {
            Some(Curve { name, source, .. }) => {
                let (curve, source) = (name.clone(), source.clone());
                Ok(Target { material, curve, source })
            }
            None => Err(Error::usage(
                format!("the curve of {} is not that of the current revision", subject.wanted),
                "fit the current one, or do not store the fit",
            )),
        }
    }

    /// The material that is named, with the curve of the file in it.
    fn target_of_file(&self, subject: &FitSubject, store: Option<&Store>) -> Result<Target, Error> {
        let Some(name) = &self.material else {
            return Err(Error::usage(
                format!("{} belongs to no material yet", subject.label),
                "name the one to store it in",
            ));
        };
        if name.contains('@') {
            return Err(Error::usage(
                format!("`{name}` names a revision, and a revision never changes"),
                "give the bare name; the fit becomes a new revision",
            ));
        }
        let mut material = find_material(store, name, "")?.material;
        let AddedCurve { curve, source } =
            add_curve(&mut material, &subject.curve_name, &subject.curve, &self.origin)?;
        Ok(Target { material, curve, source })
    }
}

fn curve_of<'a>(material: &'a Material, name: &str) -> Option<&'a Curve> {
    material.curves.iter().find(|curve| curve.name == name)
}

/// Adds the sources of the parameters that no data gave: those that were fixed, and those that are a convention.
/// Path and key of each.
fn add_parameter_sources(material: &mut Material, fit: &Fit) -> Vec<(String, String)> {
    const CHOSEN: &str = "Chosen, while the other parameters were fitted";
    const CONVENTION: &str = "Convention: k is chosen, and f_lambda and r_s follow from it; the curve tells \
                              S = (1 − k)·f_lambda and R = k·r_s";
    let Some(report) = &fit.report else { return Vec::new() };
    let paths: Vec<String> = fit.model.parameters().into_iter().map(|one| one.path).collect();
    // Settings of the fit are given, too.
    let given = report.given.iter().map(|number| number.name.clone());
    let fixed: Vec<String> = given.filter(|name| paths.contains(name)).collect();
    let mut by_convention = Vec::new();
    if report.gauge.is_some() {
        by_convention.extend(FitReport::BY_CONVENTION.map(str::to_owned));
        by_convention.retain(|path| !fixed.contains(path));
    }
    let mut sources = Vec::new();
    for (paths, title, key) in
        [(fixed, CHOSEN, "chosen"), (by_convention, CONVENTION, "convention")]
    {
        if !paths.is_empty() {
            let key = add_source(material, SourceKind::Synthetic, title, key, None);
            sources.extend(paths.into_iter().map(|path| (path, key.clone())));
        }
    }
    sources.sort();
    sources.dedup_by(|a, b| a.0 == b.0);
    sources
}
