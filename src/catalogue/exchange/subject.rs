//! A material to be written in a foreign format: which of its numbers are exported, and the description that every
//! file holds.

use std::borrow::Cow;

use crate::brdf::{Brdf, Scattering};
use crate::material::{
    Curve, Instrument, Layer, Material, MaterialError, Observation, Origin, Permittivity, Source,
    SourceKind,
};
use crate::units::SPEED_OF_LIGHT_M_PER_S;

/// Below this σ⁰ a model has no echo.
const FAINTEST: f64 = 1e-8;

/// A material and the revision that it is.
#[derive(Clone, Copy, Debug)]
pub struct Subject<'a> {
    /// The material.
    pub material: &'a Material,
    /// Its revision in the database; none for a built-in that is not in it.
    pub revision: Option<u32>,
    /// When that was added: UTC, ISO 8601.
    pub added_at: Option<&'a str>,
    /// The catalogue that it was imported from.
    pub origin: Option<&'a Origin>,
    /// Name of the exported curve; none for the one that a scene renders or that was fitted.
    pub curve: Option<&'a str>,
}

/// The exported curve: a stored one, or the levels of a model at every degree.
pub(super) struct Points<'a> {
    /// The curve; none for a model.
    pub curve: Option<&'a Curve>,
    /// Names of the curves that are not exported.
    pub others: Vec<&'a str>,
    pub observations: Cow<'a, [Observation]>,
    pub source: Option<&'a Source>,
    pub instrument: Option<&'a Instrument>,
    /// Hz.
    pub frequency_hz: f64,
}

impl<'a> Subject<'a> {
    /// The curve that the user names; else the rendered or the fitted one; else the first curve; else the model.
    pub(super) fn points(&self) -> Points<'a> {
        let material = self.material;
        let named = |name: &str| material.curves.iter().find(|curve| curve.name == name);
        let fit = material.fits.iter().find(|fit| fit.name == material.render);
        let fitted = fit.and_then(|fit| fit.curve.as_deref()).and_then(named);
        let asked = self.curve.and_then(named);
        let curve = asked.or(named(&material.render)).or(fitted).or(material.curves.first());
        let names = material.curves.iter().map(|curve| curve.name.as_str());
        let instrument = curve.and_then(|curve| {
            material.instruments.iter().find(|i| Some(&i.key) == curve.instrument.as_ref())
        });
        let key = curve.map(|curve| &curve.source).or(fit.map(|fit| &fit.source));
        let observations = match (curve, material.scattering()) {
            (Some(curve), _) => Cow::Borrowed(curve.observations.as_slice()),
            (None, Ok(model)) => Cow::Owned(self.sampled(&model)),
            (None, Err(_)) => Cow::default(),
        };
        Points {
            curve,
            others: names.filter(|name| curve.is_some_and(|c| c.name != *name)).collect(),
            observations,
            source: material.sources.iter().find(|source| Some(&source.key) == key),
            instrument,
            frequency_hz: instrument.map_or(self.frequency_hz(), |i| i.centre_frequency_hz),
        }
    }

    /// Angles of incidence at every degree of the claimed range, with both of its ends, rad.
    fn angles_rad(&self) -> Vec<f64> {
        let [low, high] = self.material.theta_rad;
        let inner = (0..=90).map(|degree| f64::from(degree).to_radians());
        let mut angles = vec![low];
        angles.extend(inner.filter(|angle| *angle > low && *angle < high));
        angles.extend((high > low).then_some(high));
        // At 90° no surface is seen.
        angles.retain(|angle| *angle < 89.5f64.to_radians());
        angles
    }

    fn sampled(&self, model: &Brdf) -> Vec<Observation> {
        let points = self.echoing_rad(model).into_iter().map(|theta_rad| {
            Observation::backscatter(theta_rad, Some(model.sigma0(theta_rad)), None)
        });
        points.collect()
    }

    /// Those of the angles at which a model scatters back more than −80 dB, rad.
    pub(super) fn echoing_rad(&self, model: &Brdf) -> Vec<f64> {
        let mut angles = self.angles_rad();
        angles.retain(|angle| model.sigma0(*angle) > FAINTEST);
        angles
    }

    /// Middle of the claimed range, Hz.
    pub(super) fn frequency_hz(&self) -> f64 {
        (self.material.frequency_hz[0] + self.material.frequency_hz[1]) / 2.0
    }

    /// The model that a scene renders.
    pub(super) fn model(&self) -> Result<Brdf, MaterialError> {
        self.material.scattering()
    }

    /// Permittivities of the outermost layer or, without layers, of the only substance; else why there are
    /// none.
    pub(super) fn permittivities(&self) -> Result<Vec<&'a Permittivity>, &'static str> {
        let entries = &self.material.permittivities;
        let outermost: Option<&Layer> = self.material.layers.first();
        let key = match (outermost, entries.first()) {
            (Some(layer), _) => layer.permittivity.as_deref(),
            (None, Some(first)) if entries.iter().any(|entry| entry.key != first.key) => {
                return Err(
                    "several permittivities are known and no layer says which is the surface's",
                );
            }
            (None, first) => first.map(|entry| entry.key.as_str()),
        };
        let key = key.ok_or("no permittivity of the surface is known")?;
        Ok(entries.iter().filter(|entry| entry.key == key).collect())
    }

    /// How the rendered numbers came to be.
    pub(super) fn kind(&self) -> String {
        let kind = self.material.render_kind();
        let kind = kind.map_or("of unknown origin", SourceKind::as_str);
        self.material.rendered_words().unwrap_or_else(|| kind.to_owned())
    }

    /// `slug@revision`, or that it is built in.
    pub(super) fn title(&self) -> String {
        let Material { slug, name, .. } = self.material;
        match self.revision {
            Some(revision) => format!("{name} ({slug}@{revision})"),
            None => format!("{name} ({slug}, built into matdb {})", env!("CARGO_PKG_VERSION")),
        }
    }

    /// Every source in a line: how it came to be, what it is, where it is.
    pub(super) fn sources(&self) -> Vec<String> {
        self.material.sources.iter().map(cited).collect()
    }

    /// The description that every file holds, line by line, without characters that end a line.
    pub(super) fn about(&self) -> Vec<String> {
        let material = self.material;
        let [low_ghz, high_ghz] = material.frequency_hz.map(|hz| hz / 1e9);
        let [low_deg, high_deg] = material.theta_rad.map(f64::to_degrees);
        let lobes = material.rendered_fit().and_then(|fit| fit.lobes_words());
        let lobes = lobes.map_or(String::new(), |words| format!("{words}; "));
        let mut lines = vec![
            self.title(),
            format!("content {}", material.content_hash()),
            format!(
                "the rendered numbers are {}; {lobes}licence {}",
                self.kind(),
                material.licence
            ),
            format!("claimed from {low_ghz} to {high_ghz} GHz, {low_deg:.3} to {high_deg:.3} deg"),
        ];
        lines.extend(self.origin.map(|origin| format!("from {}", origin.credit())));
        lines.extend(self.points().curve.map(|curve| {
            let lit = curve.illumination;
            format!("curve `{}`: {}; {}", curve.name, lit.footprint_words(), lit.beam_words())
        }));
        lines.extend(self.sources().iter().map(|source| format!("source, {source}")));
        lines.extend(material.unknown.iter().map(|sentence| format!("not known: {sentence}")));
        lines.extend(material.status.sentence());
        lines.iter().map(|line| one_line(line)).collect()
    }
}

/// A source in a line.
pub(super) fn cited(source: &Source) -> String {
    let doi = source.doi.as_ref().map(|doi| format!(", doi {doi}")).unwrap_or_default();
    let url = source.url.as_ref().map(|url| format!(", {url}")).unwrap_or_default();
    format!("{}: {}{doi}{url}", source.kind.as_str(), source.titled())
}

impl Points<'_> {
    /// Wavelength in free space, m.
    pub fn wavelength_m(&self) -> f64 {
        SPEED_OF_LIGHT_M_PER_S / self.frequency_hz
    }
}

/// The text with blanks for characters that end a line or reverse its direction, so that it stays within a comment.
pub(super) fn one_line(text: &str) -> String {
    text.replace(ends_or_turns_a_line, " ")
}

fn ends_or_turns_a_line(c: char) -> bool {
    c.is_control()
        || matches!(c, '\u{2028}' | '\u{2029}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
        || matches!(c, '\u{fffe}' | '\u{ffff}')
}
