//! Which materials take in what was found, and how they look with it.

use super::after::entries;
use super::findings::findings;
use crate::brdf::Brdf;
use crate::cli::curves::source;
use crate::cli::materials::{Found, find};
use crate::cli::staging::Used;
use crate::diagnose::{LEAST_SHOTS, Report};
use crate::effects::Level;
use crate::error::Error;
use crate::formats::EffectEntry;
use crate::material::{Fit, Material, Slug, SourceKind};
use crate::store::{Added, Store};

/// Name of the fit that holds a refitted law.
const FIT: &str = "diagnosed";

/// The materials of a scene, each with the name that its regions give it.
#[derive(Clone, Copy)]
pub(super) struct Cast<'a> {
    pub used: &'a [Used],
    /// Materials of the regions, as the scene names them.
    pub names: &'a [String],
    /// Number of the material of each region.
    pub of_region: &'a [u16],
}

/// A material that takes in what was found.
pub(super) struct Taker {
    /// Its number among those of the scene.
    pub number: usize,
    /// Its law, refitted.
    law: Brdf,
}

impl<'a> Cast<'a> {
    /// A material as the scene names it.
    pub fn name(&self, number: usize) -> &'a str {
        let region = self.of_region.iter().position(|&of| usize::from(of) == number);
        region.and_then(|region| self.names.get(region)).map_or("", String::as_str)
    }

    /// The number of the material that is to take everything in, if one is named.
    pub fn wanted(&self, name: Option<&str>) -> Result<Option<usize>, Error> {
        let Some(name) = name else { return Ok(None) };
        let numbers = || 0..self.used.len();
        let of_slug = |&number: &usize| {
            self.used.get(number).is_some_and(|u| u.found.material.slug.as_str() == name)
        };
        let found = numbers().find(|&n| self.name(n) == name).or_else(|| numbers().find(of_slug));
        if found.is_some() {
            return Ok(found);
        }
        let known: Vec<&str> = numbers().map(|number| self.name(number)).collect();
        Err(Error::Usage {
            problem: format!("the scene has no material `{name}`"),
            way_out: format!("its materials are: {}", known.join(", ")),
        })
    }

    /// The materials that take in what was found: the wanted one, or all whose law was refitted.
    pub fn takers(&self, report: &Report, wanted: Option<usize>) -> Vec<Taker> {
        if report.effects.is_empty() {
            return Vec::new();
        }
        let numbers = (0..self.used.len()).filter(|&n| wanted.is_none_or(|wanted| wanted == n));
        numbers.filter_map(|number| self.taker(report, number)).collect()
    }

    /// Each region has a law of its own; the one that most shots of the scan meet stands for the material.
    fn taker(&self, report: &Report, number: usize) -> Option<Taker> {
        let law = report.laws.get(self.region(report, number)?)?.clone();
        Some(Taker { number, law })
    }

    /// The region of a material that most shots of the scan meet, if those are enough.
    fn region(&self, report: &Report, number: usize) -> Option<usize> {
        let shots =
            |region: usize| report.rows.iter().filter(|r| usize::from(r.region) == region).count();
        let regions = self.of_region.iter().enumerate();
        let regions = regions.filter(|(_, of)| usize::from(**of) == number);
        let (shots, region) = regions.map(|(region, _)| (shots(region), region)).max()?;
        (shots >= LEAST_SHOTS).then_some(region)
    }

    /// The current revisions of all materials that were looked at with what was tried on them and not
    /// found, each after a built-in one that is not in the database yet, and the places of the former.
    pub fn tried(
        &self,
        report: &Report,
        wanted: Option<usize>,
        title: &str,
        store: &Store,
    ) -> Result<(Vec<Material>, Vec<usize>), Error> {
        let (mut materials, mut last) = (Vec::new(), Vec::new());
        for (number, used) in self.used.iter().enumerate() {
            let is_wanted = wanted.is_none_or(|wanted| wanted == number);
            if !is_wanted || self.region(report, number).is_none() {
                continue;
            }
            let Found { mut material, revision } =
                find(Some(store), used.found.material.slug.as_str(), "--add: ")?;
            materials.extend(revision.is_none().then(|| material.clone()));
            let key = source(&mut material, SourceKind::Modelled, title, FIT, None);
            let is_fit = |fit: &&Fit| fit.name == material.render;
            let rendered = material.fits.iter().find(is_fit).map(|fit| fit.name.clone());
            // The same diagnosis once more says the same once.
            material.findings.retain(|known| known.source != key || known.fit_after.is_some());
            material.findings.extend(findings(report, rendered.as_deref(), None, &key));
            material.validate()?;
            last.push(materials.len());
            materials.push(material);
        }
        Ok((materials, last))
    }

    /// The current revision of a taker's material with what was found, before it a built-in one that
    /// is not in the database yet.
    pub fn revised(
        &self,
        taker: &Taker,
        report: &Report,
        title: &str,
        store: Option<&Store>,
    ) -> Result<Vec<Material>, Error> {
        let Some(used) = self.used.get(taker.number) else { return Ok(Vec::new()) };
        let Found { material, revision } =
            find(store, used.found.material.slug.as_str(), "--add: ")?;
        let first = revision.is_none().then(|| material.clone());
        let last = with_found(material, used, taker, report, title)?;
        Ok(first.into_iter().chain([last]).collect())
    }

    /// A material of its own with what was found and nothing else, for a file.
    pub fn alone(
        &self,
        taker: &Taker,
        report: &Report,
        title: &str,
    ) -> Result<Option<Material>, Error> {
        let Some(used) = self.used.get(taker.number) else { return Ok(None) };
        let base = &used.found.material;
        let name = self.name(taker.number);
        let bare = Material {
            slug: self.slug_alone(taker.number)?,
            name: format!("{}, diagnosed", base.name),
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
            ..base.clone()
        };
        with_found(bare, used, taker, report, title).map(Some)
    }

    /// Name of [`alone`](Self::alone).
    pub fn slug_alone(&self, number: usize) -> Result<Slug, Error> {
        let name = self.name(number).replace('@', "-");
        let slug = format!("{name:.54}-{FIT}").parse();
        slug.map_err(|problem| Error::Usage { problem, way_out: "rename the material".to_owned() })
    }

    /// Refuses what could not take a fit of this name in.
    pub fn check(&self) -> Result<(), Error> {
        let has_curve = |used: &&Used| used.found.material.curves.iter().any(|c| c.name == FIT);
        match self.used.iter().find(has_curve) {
            None => Ok(()),
            Some(Used { found: Found { material, .. }, .. }) => Err(Error::Usage {
                problem: format!(
                    "`{}` has a curve of the name `{FIT}`, as the fit would have",
                    material.slug
                ),
                way_out: "give the curve another name".to_owned(),
            }),
        }
    }
}

/// A material with a law and effects in it; its effects are those that were at work, and those found.
fn with_found(
    mut material: Material,
    used: &Used,
    taker: &Taker,
    report: &Report,
    title: &str,
) -> Result<Material, Error> {
    let key = source(&mut material, SourceKind::Modelled, title, FIT, None);
    let is_before = |fit: &&Fit| fit.name == material.render && fit.name != FIT;
    let before = material.fits.iter().find(is_before).map(|fit| fit.name.clone());
    let fit = Fit {
        name: FIT.to_owned(),
        model: taker.law.clone(),
        estimator: FIT.to_owned(),
        curve: None,
        source: key.clone(),
        parameter_sources: Vec::new(),
        covariance: None,
        report: None,
    };
    match material.fits.iter_mut().find(|known| known.name == FIT) {
        Some(known) => *known = fit,
        None => material.fits.push(fit),
    }
    material.render = FIT.to_owned();
    // The fit that earlier findings speak of has given way.
    material.findings.retain(|known| known.fit_after.as_deref() != Some(FIT));
    material.findings.extend(findings(report, before.as_deref(), Some(FIT), &key));
    // A material of its own has left its sources behind.
    let is_known = |key: &String| material.sources.iter().any(|source| source.key == *key);
    let declared = used.found.material.effects.iter().cloned();
    let declared = declared.map(|entry| {
        let source = entry.source.clone().filter(is_known);
        EffectEntry { source, ..entry }
    });
    let found = entries(&report.effects, Level::Material)
        .map(|entry| EffectEntry { source: Some(key.clone()), ..entry });
    let effects = declared.chain(found).collect();
    material.effects = effects;
    material.validate()?;
    Ok(material)
}

/// A material's name, pinned to what adding it made current.
pub(super) fn pinned(material: &Material, added: Added) -> String {
    format!("{}@{}", material.slug, added.revision())
}

/// The revision that was current before, where what was added is a new one.
pub(super) fn replaced(material: &Material, added: Added) -> Option<String> {
    match added {
        Added::Revision(new) => Some(format!("{}@{}", material.slug, new.saturating_sub(1))),
        Added::New | Added::Unchanged(_) => None,
    }
}
