//! A curve into a material, with where it comes from.

use super::admission;
use super::provenance::{add_source, free_key};
use crate::catalogue::exchange::Detail;
use crate::error::Error;
use crate::material::form::is_licence;
use crate::material::{Curve, Instrument, Material, Observation, SourceKind};
use crate::measure;
use crate::units::{range, shown};

/// What is stated of a curve that is to be stored: where it comes from and what it was measured with.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CurveOrigin {
    /// How the curve came to be.
    pub kind: Option<SourceKind>,
    /// Title of its source: who measured or made it, when and how.
    pub title: Option<String>,
    /// SPDX expression of the licence of its data.
    pub licence: Option<String>,
    /// Name or key of the instrument, one of the material's or a new one.
    pub instrument: Option<String>,
    /// Centre frequency of a new instrument, Hz.
    pub frequency_hz: Option<f64>,
    /// Least power that counts as a detection with a new instrument, W.
    pub threshold_w: Option<f64>,
}

/// A curve in a material.
#[derive(Clone, Debug, PartialEq)]
pub struct AddedCurve {
    /// Its name.
    pub curve: String,
    /// Key of its source.
    pub source: String,
}

impl CurveOrigin {
    /// Kind and title of the source.
    ///
    /// # Errors
    /// One of them is not stated; the error lists all that a curve of this kind lacks in `material`.
    pub(super) fn source(&self, material: &Material) -> Result<(SourceKind, &str), Error> {
        if let (Some(kind), Some(title)) = (self.kind, &self.title) {
            return Ok((kind, title));
        }
        let mut missing = Vec::new();
        if self.kind.is_none() {
            missing.push(Detail::Kind);
        }
        if self.title.is_none() {
            missing.push(Detail::Source);
        }
        // The example of a kind is `measured`, which asks for the rest.
        let kind = self.kind.or(Some(SourceKind::Measured));
        missing.extend(CurveOrigin { kind, ..self.clone() }.missing(material));
        Err(Error::Missing { what: "a curve that is stored", missing })
    }

    /// Checks what is stated before anything is computed for it.
    ///
    /// # Errors
    /// A value that cannot be, an instrument of the material that has other values, or a measured curve of which
    /// not enough is stated.
    pub fn check(&self, material: &Material) -> Result<(), Error> {
        if self.licence.as_ref().is_some_and(|licence| !is_licence(licence)) {
            return Err(Error::Detail {
                detail: Detail::Licence,
                problem: "is not an SPDX expression",
                way_out: "write an SPDX identifier such as CC-BY-4.0, or LicenseRef-proprietary",
            });
        }
        check_frequency_and_threshold(self.frequency_hz, self.threshold_w)?;
        if self.known_instrument(material).is_some_and(|known| self.contradicts(known)) {
            return Err(Error::usage(
                "the material's instrument of that name has another frequency or threshold",
                "leave frequency and threshold out, or name another instrument",
            ));
        }
        if let Some(hz) = self.frequency_hz_of(material)
            && self.kind == Some(SourceKind::Measured)
            && material.frequency_outside_hz(hz) > 0.0
        {
            let (slug, claimed) = (&material.slug, material.frequency_hz.map(|hz| hz / 1e9));
            return Err(Error::usage(
                format!(
                    "the curve was measured at {} GHz and `{slug}` claims {} GHz",
                    shown(hz / 1e9),
                    range(claimed)
                ),
                "claim in frequency_ghz what was measured, or name the curve's own instrument",
            ));
        }
        let missing = self.missing(material);
        if missing.is_empty() {
            return Ok(());
        }
        let what = match self.kind {
            Some(SourceKind::Measured) => "a measured curve",
            _ => "the instrument of a curve",
        };
        Err(Error::Missing { what, missing })
    }

    /// At which the curve was measured, Hz.
    fn frequency_hz_of(&self, material: &Material) -> Option<f64> {
        let known = self.known_instrument(material).map(|known| known.centre_frequency_hz);
        self.frequency_hz.or(known)
    }

    /// Whether an instrument has another frequency or threshold than is stated.
    fn contradicts(&self, known: &Instrument) -> bool {
        self.frequency_hz.is_some_and(|hz| hz != known.centre_frequency_hz)
            || self.threshold_w.is_some_and(|power_w| known.threshold_w != Some(power_w))
    }

    /// What is not stated and not known of the material.
    fn missing(&self, material: &Material) -> Vec<Detail> {
        let is_measured = self.kind == Some(SourceKind::Measured);
        let is_known = self.known_instrument(material).is_some();
        let is_stated =
            self.instrument.is_some() || self.frequency_hz.is_some() || self.threshold_w.is_some();
        let needs_instrument = (is_measured || is_stated) && !is_known;
        let mut missing = Vec::new();
        if is_measured && self.licence.is_none() {
            missing.push(Detail::Licence);
        }
        if needs_instrument && self.instrument.is_none() {
            missing.push(Detail::Instrument);
        }
        if needs_instrument && self.frequency_hz.is_none() {
            missing.push(Detail::Frequency);
        }
        if is_measured && !is_known && self.threshold_w.is_none() {
            missing.push(Detail::Threshold);
        }
        missing
    }

    /// The instrument of the material that is stated.
    fn known_instrument<'a>(&self, material: &'a Material) -> Option<&'a Instrument> {
        let name = self.instrument.as_ref()?;
        material.instruments.iter().find(|known| known.key == *name || known.name == *name)
    }

    /// The key of the instrument, which is added when it is a new one.
    fn add_instrument(&self, material: &mut Material) -> Option<String> {
        if let Some(known) = self.known_instrument(material) {
            return Some(known.key.clone());
        }
        let name = self.instrument.clone()?;
        let centre_frequency_hz = self.frequency_hz?;
        let key = free_key("radar", material.instruments.iter().map(|known| &known.key));
        material.instruments.push(Instrument {
            key: key.clone(),
            name,
            centre_frequency_hz,
            threshold_w: self.threshold_w,
            ..Instrument::default()
        });
        Some(key)
    }
}

/// Checks the frequency and the threshold of an instrument, where they are stated.
///
/// # Errors
/// A number that is not finite or not above 0.
pub fn check_frequency_and_threshold(
    frequency_hz: Option<f64>,
    threshold_w: Option<f64>,
) -> Result<(), Error> {
    for (number, detail, way_out) in [
        (frequency_hz, Detail::Frequency, "give one in GHz such as 300"),
        (threshold_w, Detail::Threshold, "give one in dBm such as -77"),
    ] {
        if number.is_some_and(|number| !(number > 0.0 && number.is_finite())) {
            return Err(Error::Detail { detail, problem: "cannot be", way_out });
        }
    }
    Ok(())
}

/// Adds a curve to a material, unless it has the same points already, maybe under another name.
///
/// # Errors
/// What [`CurveOrigin::check`] refuses; the same points from another source; a curve or a fit of that name.
pub fn add_curve(
    material: &mut Material,
    name: &str,
    curve: &measure::Curve,
    origin: &CurveOrigin,
) -> Result<AddedCurve, Error> {
    let (kind, title) = origin.source(material)?;
    origin.check(material)?;
    let source = add_source(material, kind, title, name, origin.licence.as_deref());
    if let Some(place) = same_points(material, curve) {
        let known = &mut material.curves[place];
        if known.source == source {
            // What only one of the two states is kept.
            let stated: Vec<Observation> = known.stated().collect();
            let pairs = std::iter::zip(&stated, &curve.observations);
            known.observations = pairs.map(|(known, row)| completed(known, row)).collect();
            return Ok(AddedCurve { curve: known.name.clone(), source });
        }
        let known = &material.curves[place];
        let slug = &material.slug;
        return Err(Error::usage(
            format!(
                "`{slug}` has these points already, as the curve `{}` from {}",
                known.name,
                title_of(material, &known.source)
            ),
            format!("fit the curve `{}` of `{slug}`", known.name),
        ));
    }
    if let Some(what) = owner_of_name(material, name) {
        return Err(Error::usage(
            format!("`{}` has {what}", material.slug),
            "give this curve another name",
        ));
    }
    let curve = Curve {
        name: name.to_owned(),
        source: source.clone(),
        instrument: origin.add_instrument(material),
        session: None,
        illumination: curve.illumination,
        observations: curve.observations.clone(),
    };
    let gaps = admission::missing(material, &curve);
    if !gaps.is_empty() {
        return Err(Error::usage(
            format!("a measured curve needs more: {}", admission::clauses(&gaps)),
            "name another instrument, with its frequency and its threshold",
        ));
    }
    material.curves.push(curve);
    Ok(AddedCurve { curve: name.to_owned(), source })
}

/// Which curve of a material has these points.
fn same_points(material: &Material, curve: &measure::Curve) -> Option<usize> {
    material.curves.iter().position(|known| {
        measure::Curve::of_material(known).is_ok_and(|known| {
            known.illumination == curve.illumination
                && known.observations.len() == curve.observations.len()
                && std::iter::zip(&known.observations, &curve.observations)
                    .all(|(known, row)| is_same_point(known, row))
        })
    })
}

/// Whether two points differ in nothing that both state.
fn is_same_point(known: &Observation, row: &Observation) -> bool {
    completed(known, row) == completed(row, known)
}

/// A point with what it does not state and another one does.
fn completed(point: &Observation, other: &Observation) -> Observation {
    Observation {
        theta_sd_rad: point.theta_sd_rad.or(other.theta_sd_rad),
        power_w: point.power_w.or(other.power_w),
        range_m: point.range_m.or(other.range_m),
        chirp: point.chirp.or(other.chirp),
        ..*point
    }
}

/// The curve or the fit of a material that has this name, in words.
fn owner_of_name(material: &Material, name: &str) -> Option<String> {
    if let Some(known) = material.curves.iter().find(|known| known.name == name) {
        let title = title_of(material, &known.source);
        return Some(format!("another curve `{name}`, from {title}"));
    }
    let is_fit = material.fits.iter().any(|fit| fit.name == name);
    is_fit.then(|| format!("a fit of the name `{name}`"))
}

/// The title of a source.
fn title_of<'a>(material: &'a Material, key: &str) -> &'a str {
    let source = material.sources.iter().find(|source| source.key == key);
    source.map_or("nowhere", |source| &source.title)
}
