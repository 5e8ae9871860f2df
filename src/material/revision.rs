//! One revision of a material, and what follows from it as a whole.

use std::io;

use serde::{Deserialize, Serialize};
use serde_json::ser::{CompactFormatter, Formatter, Serializer};

use super::composition::{Layer, Permittivity, Roughness};
use super::curve::Curve;
use super::error::{MaterialError, dangling};
use super::finding::Finding;
use super::fit::{Fit, Lobes};
use super::instrument::Instrument;
use super::provenance::{Session, Source, SourceKind};
use super::slug::Slug;
use super::status::Status;
use crate::brdf::Brdf;
use crate::formats::EffectEntry;

/// One revision of a material.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Short name that commands and scenes use.
    pub slug: Slug,
    /// Full name.
    pub name: String,
    /// Class of material: `metal`, `polymer`, `paint`, `tissue`, `textile`, `glass` …
    pub class: String,
    /// What it is and what is not known of it.
    pub description: String,
    /// SPDX identifier of the licence under which this entry may be passed on.
    pub licence: String,
    /// Free words to find it by.
    pub tags: Vec<String>,
    /// Lowest and highest frequency for which the numbers are claimed, Hz.
    pub frequency_hz: [f64; 2],
    /// Smallest and largest angle of incidence for which they are claimed, rad.
    pub theta_rad: [f64; 2],
    /// Which fit or curve a scene renders.
    pub render: String,
    /// Where numbers come from; everything below refers to these by key.
    pub sources: Vec<Source>,
    /// What curves were measured with.
    pub instruments: Vec<Instrument>,
    /// Scattering curves.
    pub curves: Vec<Curve>,
    /// Scattering models with their parameters.
    pub fits: Vec<Fit>,
    /// Physical effects beyond the scattering model, each once.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub effects: Vec<EffectEntry>,
    /// Whether it may still be used.
    #[serde(default, skip_serializing_if = "Status::is_active")]
    pub status: Status,
    /// How the surface was made: rolled, sanded with grit 120, sprayed …
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finish: Option<String>,
    /// What is not known, a sentence each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub unknown: Vec<String>,
    /// How rough the outer surface is.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub roughness: Option<Roughness>,
    /// What it is made of, the outermost layer first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub layers: Vec<Layer>,
    /// Permittivities of its substances.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub permittivities: Vec<Permittivity>,
    /// Sittings in which its curves were measured.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub sessions: Vec<Session>,
    /// What diagnoses tried to explain it with.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub findings: Vec<Finding>,
}

impl Material {
    /// The scattering that a scene renders.
    ///
    /// # Errors
    /// When `render` names nothing, or a curve that cannot be interpolated.
    pub fn scattering(&self) -> Result<Brdf, MaterialError> {
        if let Some(fit) = self.rendered_fit() {
            return Ok(fit.model.clone());
        }
        let Some(curve) = self.curves.iter().find(|c| c.name == self.render) else {
            return Err(dangling("render", "a fit or curve", &self.render, self.renderable()));
        };
        curve.tabulated().map(Brdf::Tabulated)
    }

    /// The material with the law alone that a scene renders, for a file without curves beside it: a rendered curve becomes
    /// a tabulated law.
    ///
    /// # Errors
    /// As [`Material::scattering`].
    pub fn with_law_alone(&self) -> Result<Material, MaterialError> {
        let fit = match self.rendered_fit() {
            Some(fit) => Fit { curve: None, report: None, ..fit.clone() },
            None => Fit {
                name: self.render.clone(),
                model: self.scattering()?,
                estimator: "stated".to_owned(),
                curve: None,
                lobes: self.rendered_lobes(),
                source: self
                    .rendered_curve()
                    .map_or_else(String::new, |curve| curve.source.clone()),
                parameter_sources: Vec::new(),
                covariance: None,
                report: None,
            },
        };
        let (curves, findings) = (Vec::new(), Vec::new());
        Ok(Material { curves, findings, fits: vec![fit], ..self.clone() })
    }

    /// ε′ and ε″ at the frequency nearest to this one, Hz: of the only substance that has a permittivity, or of the one
    /// whose key is the material's own name. `None` for any other material.
    pub fn permittivity_near(&self, frequency_hz: f64) -> Option<[f64; 2]> {
        let first = self.permittivities.first()?;
        let is_own = |entry: &&Permittivity| entry.key == self.slug.as_str();
        let is_only = self.permittivities.iter().all(|entry| entry.key == first.key);
        let entries = self.permittivities.iter().filter(|entry| is_only || is_own(entry));
        let distance_hz = |entry: &&Permittivity| (entry.frequency_hz - frequency_hz).abs();
        let nearest = entries.min_by(|a, b| distance_hz(a).total_cmp(&distance_hz(b)))?;
        Some([nearest.real, nearest.imaginary])
    }

    /// The fit that a scene renders; none where it renders a curve.
    pub fn rendered_fit(&self) -> Option<&Fit> {
        self.fits.iter().find(|fit| fit.name == self.render)
    }

    /// The curve that a scene renders, or that what it renders belongs to; none for a model without a curve.
    pub fn rendered_curve(&self) -> Option<&Curve> {
        self.curve_behind(&self.render)
    }

    /// That what scenes render of it has relative levels, in a sentence.
    pub fn relative_words(&self) -> Option<String> {
        let curve = self.rendered_curve().filter(|curve| curve.illumination.relative)?;
        Some(format!(
            "the levels of `{}`, curve `{}`, are relative, up to a factor that is not known: what scenes show of it is right in \
             its shape over the angle alone",
            self.slug, curve.name
        ))
    }

    /// The curve of this name, or the one that the fit of this name belongs to.
    pub fn curve_behind(&self, name: &str) -> Option<&Curve> {
        let fit = self.fits.iter().find(|fit| fit.name == name);
        let name = match fit {
            Some(fit) => fit.curve.as_ref()?,
            None => name,
        };
        self.curves.iter().find(|curve| curve.name == name)
    }

    /// Whose lobes a scene renders. A curve has those of its radar in it.
    pub fn rendered_lobes(&self) -> Lobes {
        self.rendered_fit().map_or(Lobes::RadarAndSurface, |fit| fit.lobes)
    }

    /// Divergence, rad, of the beam through which a fit describes its curve: that of the curve where the lobes are
    /// those of the surface alone, else 0.
    pub fn beam_rad(&self, fit: &Fit) -> f64 {
        let curve = self.curves.iter().find(|curve| Some(&curve.name) == fit.curve.as_ref());
        let beam_rad = curve.and_then(|curve| curve.illumination.beam_rad);
        if fit.lobes.is_of_both() { 0.0 } else { beam_rad.unwrap_or(0.0) }
    }

    /// The [`beam_rad`](Self::beam_rad) of the fit that scenes render; 0 where they render a curve.
    pub fn rendered_beam_rad(&self) -> f64 {
        let rendered = self.fits.iter().find(|fit| fit.name == self.render);
        rendered.map_or(0.0, |fit| self.beam_rad(fit))
    }

    /// The source of the numbers that a scene renders.
    pub fn render_kind(&self) -> Option<SourceKind> {
        let fits = self.fits.iter().map(|f| (&f.name, &f.source));
        let curves = self.curves.iter().map(|c| (&c.name, &c.source));
        let key = fits.chain(curves).find(|(name, _)| **name == self.render)?.1;
        self.sources.iter().find(|s| s.key == *key).map(|s| s.kind)
    }

    /// What to say of a model that belongs to a curve instead of its source's kind, since nobody measured the
    /// model itself; `None` without a curve.
    pub fn kind_words(&self, fit: &Fit) -> Option<String> {
        let curve = self.curves.iter().find(|curve| Some(&curve.name) == fit.curve.as_ref())?;
        let source = self.sources.iter().find(|source| source.key == curve.source)?;
        Some(source.kind.words_beside(fit.is_fitted()))
    }

    /// The [`kind_words`](Material::kind_words) of what scenes render; `None` of a curve, and of a model without
    /// one.
    pub fn rendered_words(&self) -> Option<String> {
        self.kind_words(self.rendered_fit()?)
    }

    /// The curve with the most points, the first of several.
    pub fn longest_curve(&self) -> Option<&Curve> {
        self.curves.iter().rev().max_by_key(|curve| curve.observations.len())
    }

    /// Hash of everything in the material: equal exactly when nothing differs.
    ///
    /// Databases keep it: a field added later must serialise to nothing while it is empty, or what
    /// was stored before no longer matches its hash.
    pub fn content_hash(&self) -> String {
        let mut json = Vec::new();
        // Serialising a tree of plain structs into memory has no way to fail.
        let _ = self.serialize(&mut Serializer::with_formatter(&mut json, OneZero));
        blake3::hash(&json).to_hex().to_string()
    }

    /// Names of its fits and curves.
    pub(super) fn renderable(&self) -> Vec<String> {
        let fits = self.fits.iter().map(|f| f.name.clone());
        fits.chain(self.curves.iter().map(|c| c.name.clone())).collect()
    }
}

/// Writes −0 as 0: the two are equal, so they must hash alike.
struct OneZero;

impl Formatter for OneZero {
    fn write_f64<W: ?Sized + io::Write>(&mut self, writer: &mut W, value: f64) -> io::Result<()> {
        CompactFormatter.write_f64(writer, value + 0.0)
    }
}
