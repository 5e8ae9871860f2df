//! A material in the search index.

use serde::Serialize;

use super::levels::{Levels, SMALL_DEG, range_deg};
use crate::formats::html::clean;
use crate::formats::words::shortened;
use crate::material::{Material, SourceKind};

/// Longest name and longest description that are searched and shown, characters.
const NAME: usize = 200;
const DESCRIPTION: usize = 2000;

/// The entry of a material in the index.
#[derive(Debug, Serialize)]
pub(super) struct Entry {
    slug: String,
    name: String,
    class: String,
    tags: Vec<String>,
    text: String,
    kind: &'static str,
    /// Replaces the kind on the badge of a model that is stated with a curve.
    #[serde(skip_serializing_if = "Option::is_none")]
    kind_words: Option<String>,
    /// `superseded` or `withdrawn`; none of what may still be used.
    #[serde(skip_serializing_if = "Option::is_none")]
    status: Option<&'static str>,
    /// Lowest and highest frequency, GHz.
    ghz: [f64; 2],
    /// Smallest and largest angle, °.
    deg: [f64; 2],
    /// Whether a curve was fitted.
    fitted: bool,
    /// Whether somebody measured a curve.
    measured: bool,
    /// Points of all curves, and those of them that are only bounds.
    points: usize,
    censored: usize,
    /// dB at the angles of [`SMALL_DEG`].
    level: Vec<Option<f64>>,
}

impl Entry {
    /// Of a material.
    pub(super) fn new(material: &Material) -> Entry {
        let observations = || material.curves.iter().flat_map(|c| &c.observations);
        let model = material.scattering().ok();
        let levels = model.as_ref().map(|model| Levels::rendered(material, model));
        Entry {
            slug: material.slug.to_string(),
            name: shortened(&material.name, NAME),
            class: shortened(&material.class, NAME),
            tags: material.tags.iter().map(|tag| shortened(tag, NAME)).collect(),
            text: clean(&shortened(&material.description, DESCRIPTION)),
            kind: material.render_kind().map_or("unknown", SourceKind::as_str),
            kind_words: material.rendered_words(),
            status: status_of(material),
            ghz: material.frequency_hz.map(|hz| hz / 1e9),
            deg: range_deg(material),
            fitted: material.fits.iter().any(|fit| fit.is_fitted()),
            measured: has_measured_curve(material),
            points: observations().count(),
            censored: observations().filter(|o| o.sigma0.is_none()).count(),
            level: SMALL_DEG.map(|deg| levels.as_ref()?.db(deg)).to_vec(),
        }
    }
}

/// `superseded` or `withdrawn`; none of what may still be used.
pub(super) fn status_of(material: &Material) -> Option<&'static str> {
    (!material.status.is_active()).then(|| material.status.as_str())
}

/// Whether somebody measured one of the curves.
pub(super) fn has_measured_curve(material: &Material) -> bool {
    material
        .curves
        .iter()
        .any(|curve| kind_of(material, &curve.source) == Some(SourceKind::Measured))
}

/// Kind of a source by its key.
pub(super) fn kind_of(material: &Material, key: &str) -> Option<SourceKind> {
    material.sources.iter().find(|source| source.key == key).map(|source| source.kind)
}

/// Place of a source among its material's, from 1; 0 when there is none of that key.
pub(super) fn place_of(material: &Material, key: &str) -> usize {
    material.sources.iter().position(|source| source.key == key).map_or(0, |place| place + 1)
}
