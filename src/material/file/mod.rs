//! `material.toml`: a material as people write and review it, in degrees, gigahertz and dB.
//!
//! Curves are CSV files in the same folder, with the columns `theta_deg,sigma0_db,censor,threshold_db`; the
//! last two may be left out, and others may be added ([`points`]).

mod composition;
pub mod in_plane;
mod points;
mod provenance;
mod temperature;

use std::collections::BTreeMap;
use std::path::Path;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::composition::{Layer, Permittivity, Roughness};
use super::curve::{Curve, Illumination};
use super::error::{MaterialError, value};
use super::finding::Finding;
use super::fit::{Covariance, Fit, Lobes};
use super::instrument::Instrument;
use super::provenance::{Session, Source};
use super::revision::Material;
use super::slug::Slug;
use super::status::Status;
use crate::brdf::Brdf;
use crate::formats::text::{from_toml, to_toml};
use crate::formats::{ColumnNames, EffectEntry, FormatError};
use crate::radar::Footprint;
pub use points::{Points, points};

use composition::{LayerFile, PermittivityFile, RoughnessFile};
use provenance::{InstrumentFile, SessionFile, SourceFile};

/// Why a material file was refused.
#[derive(Debug, Error)]
pub enum FileError {
    /// A file does not follow its format.
    #[error("{file}: {error}")]
    Format {
        /// The file, as the material names it.
        file: String,
        /// What is wrong.
        error: FormatError,
    },
    /// The file was read, but says something impossible.
    #[error("{file}: {error}")]
    Material {
        /// The file.
        file: String,
        /// What is wrong.
        error: MaterialError,
    },
    /// A curve's file cannot be had.
    #[error(
        "{file}: curve `{curve}`: cannot read {csv}: {reason}; put the CSV beside material.toml"
    )]
    Curve {
        /// The material file.
        file: String,
        /// Name of the curve.
        curve: String,
        /// The CSV that it names.
        csv: String,
        /// Why it cannot be had.
        reason: String,
    },
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct MaterialFile {
    slug: Slug,
    name: String,
    class: String,
    #[serde(default)]
    description: String,
    licence: String,
    #[serde(default)]
    tags: Vec<String>,
    frequency_ghz: [f64; 2],
    theta_deg: [f64; 2],
    render: String,
    finish: Option<String>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    unknown: Vec<String>,
    #[serde(default, skip_serializing_if = "Status::is_active")]
    status: Status,
    roughness: Option<RoughnessFile>,
    source: Vec<SourceFile>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    layer: Vec<LayerFile>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    permittivity: Vec<PermittivityFile>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    instrument: Vec<InstrumentFile>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    session: Vec<SessionFile>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    curve: Vec<CurveFile>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    fit: Vec<FitFile>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    effect: Vec<EffectEntry>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    finding: Vec<Finding>,
}

#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct CurveFile {
    name: String,
    source: String,
    instrument: Option<String>,
    session: Option<String>,
    footprint: Option<Footprint>,
    beam_rad: Option<f64>,
    file: String,
}

/// A fit as a material file states it. [`Fit`] cannot take its place, because the names of that type's fields are part
/// of the content hash.
#[derive(Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
struct FitFile {
    name: String,
    #[serde(default = "stated")]
    estimator: String,
    curve: Option<String>,
    source: String,
    #[serde(default, skip_serializing_if = "Lobes::is_of_both")]
    lobes: Lobes,
    scattering: Brdf,
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    parameter_source: BTreeMap<String, String>,
    covariance: Option<Covariance>,
}

fn stated() -> String {
    Fit::STATED.to_owned()
}

/// Reads a material file; `read_csv` fetches a curve's file by the name the material gives it.
///
/// `file` is only the name that errors show.
pub fn parse(
    file: &str,
    text: &str,
    read_csv: impl Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<Material, FileError> {
    let toml: MaterialFile =
        from_toml(text).map_err(|error| FileError::Format { file: file.to_owned(), error })?;
    let mut curves = Vec::with_capacity(toml.curve.len());
    for entry in toml.curve {
        curves.push(read_curve(file, entry, &read_csv)?);
    }
    let material = Material {
        slug: toml.slug,
        name: toml.name,
        class: toml.class,
        description: toml.description.trim().to_owned(),
        licence: toml.licence,
        tags: toml.tags,
        frequency_hz: toml.frequency_ghz.map(|f| f * 1e9),
        theta_rad: toml.theta_deg.map(f64::to_radians),
        render: toml.render,
        sources: toml.source.into_iter().map(Source::from).collect(),
        instruments: toml.instrument.into_iter().map(Instrument::from).collect(),
        curves,
        fits: toml.fit.into_iter().map(Fit::from).collect(),
        effects: toml.effect,
        status: toml.status,
        finish: toml.finish,
        unknown: toml.unknown,
        roughness: toml.roughness.map(Roughness::from),
        layers: toml.layer.into_iter().map(Layer::from).collect(),
        permittivities: toml.permittivity.into_iter().map(Permittivity::from).collect(),
        sessions: toml.session.into_iter().map(Session::from).collect(),
        findings: toml.finding,
    };
    match material.validate() {
        Ok(()) => Ok(material),
        Err(error) => Err(FileError::Material { file: file.to_owned(), error }),
    }
}

/// A curve of a material file, with the points of its CSV.
fn read_curve(
    file: &str,
    entry: CurveFile,
    read_csv: impl Fn(&str) -> Result<Vec<u8>, String>,
) -> Result<Curve, FileError> {
    let bytes = read_csv(&entry.file).map_err(|reason| FileError::Curve {
        file: file.to_owned(),
        curve: entry.name.clone(),
        csv: entry.file.clone(),
        reason,
    })?;
    let csv = Path::new(file).with_file_name(&entry.file);
    let points = points(&bytes, &ColumnNames::default())
        .map_err(|error| FileError::Format { file: csv.display().to_string(), error })?;
    if let Some(passed_over) = points.passed_over {
        let error = FormatError::at("the header", passed_over, "a [[curve]] has our columns only");
        return Err(FileError::Format { file: csv.display().to_string(), error });
    }
    let CurveFile { name, source, instrument, session, footprint, beam_rad, .. } = entry;
    let stated = Illumination { footprint, beam_rad, ..Illumination::default() };
    let Some(illumination) = points.illumination.and(stated) else {
        let problem = "states another footprint or beam than its [[curve]]";
        let error = value(&csv.display().to_string(), problem, "state each once, or the same");
        return Err(FileError::Material { file: file.to_owned(), error });
    };
    let observations = points.rows.into_iter().map(|(_, point)| point).collect();
    Ok(Curve { name, source, instrument, session, illumination, observations })
}

/// Writes a material file. Curves stay out of it, since they stand in files of their own, and so do the
/// reports of fits.
///
/// # Errors
/// When the material holds what TOML has no form for.
pub fn write(material: &Material) -> Result<String, FormatError> {
    let material = material.clone();
    to_toml(&MaterialFile {
        slug: material.slug,
        name: material.name,
        class: material.class,
        description: material.description,
        licence: material.licence,
        tags: material.tags,
        frequency_ghz: material.frequency_hz.map(|f| f / 1e9),
        theta_deg: material.theta_rad.map(f64::to_degrees),
        render: material.render,
        finish: material.finish,
        unknown: material.unknown,
        status: material.status,
        roughness: material.roughness.map(RoughnessFile::from),
        layer: material.layers.into_iter().map(LayerFile::from).collect(),
        permittivity: material.permittivities.into_iter().map(PermittivityFile::from).collect(),
        session: material.sessions.into_iter().map(SessionFile::from).collect(),
        finding: material.findings,
        source: material.sources.into_iter().map(SourceFile::from).collect(),
        instrument: material.instruments.into_iter().map(InstrumentFile::from).collect(),
        curve: Vec::new(),
        fit: material.fits.into_iter().map(FitFile::from).collect(),
        effect: material.effects,
    })
}

impl From<Fit> for FitFile {
    fn from(fit: Fit) -> FitFile {
        FitFile {
            name: fit.name,
            estimator: fit.estimator,
            curve: fit.curve,
            source: fit.source,
            lobes: fit.lobes,
            scattering: fit.model,
            parameter_source: fit.parameter_sources.into_iter().collect(),
            covariance: fit.covariance,
        }
    }
}

impl From<FitFile> for Fit {
    fn from(entry: FitFile) -> Fit {
        Fit {
            name: entry.name,
            model: entry.scattering,
            estimator: entry.estimator,
            curve: entry.curve,
            source: entry.source,
            lobes: entry.lobes,
            parameter_sources: entry.parameter_source.into_iter().collect(),
            covariance: entry.covariance,
            report: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Scattering;
    use crate::material::{Censor, Observation, SourceKind};

    const CURVE: &str =
        "theta_deg,sigma0_db,censor,threshold_db\n0,5,none,-30\n20,-10,,-30\n60,,left,-30\n";

    fn toml(render: &str) -> String {
        format!(
            r#"
slug = "sample"
name = "Sample"
class = "paint"
licence = "CC0-1.0"
frequency_ghz = [290, 310]
theta_deg = [0, 80]
render = "{render}"
[[source]]
key = "bench"
kind = "measured"
title = "Our bench"
[[curve]]
name = "scan"
source = "bench"
file = "scan.csv"
[[fit]]
name = "lambert"
source = "bench"
scattering = {{ model = "lambert", albedo = 0.5 }}
covariance = {{ parameters = ["albedo"], matrix = [[0.01]] }}
"#
        )
    }

    fn read(text: &str) -> Result<Material, FileError> {
        parse("material.toml", text, |name| match name {
            "scan.csv" => Ok(CURVE.as_bytes().to_vec()),
            _ => Err("no such file".to_owned()),
        })
    }

    fn refused(text: &str) -> String {
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn a_curve_is_a_material_without_a_fit() {
        let material = read(&toml("scan")).unwrap();
        let sigma0 = material.scattering().unwrap().sigma0(20f64.to_radians());
        assert!((sigma0 - 0.1).abs() < 1e-12);
        assert_eq!(material.curves[0].observations[2].censor, Censor::Left);
        assert_eq!(material.render_kind(), Some(SourceKind::Measured));
    }

    #[test]
    fn a_fit_is_rendered_by_name() {
        let material = read(&toml("lambert")).unwrap();
        assert!((material.scattering().unwrap().sigma0(0.0) - 2.0).abs() < 1e-12);
        let covariance = material.fits[0].covariance.as_ref().unwrap();
        assert!((covariance.standard_deviation("albedo").unwrap() - 0.1).abs() < 1e-12);
    }

    #[test]
    fn what_is_written_is_read_again() {
        let mut material = read(&toml("lambert")).unwrap();
        material.curves.clear();
        material.tags = vec!["a \"word\"".to_owned()];
        let parameters = [("slope".to_owned(), 0.1 + 0.2)].into();
        material.effects = vec![EffectEntry { name: "any".to_owned(), source: None, parameters }];
        assert_eq!(read(&write(&material).unwrap()).unwrap(), material);
    }

    #[test]
    fn every_model_can_be_written_in_a_few_words() {
        let given = "{ model = \"lambert\", albedo = 0.5 }";
        for scattering in [
            "{ model = \"cook-torrance\", f_lambda = 0.9, m = 0.1, m_across = 0.3 }",
            "{ model = \"kirchhoff\", rms_height_m = 5e-5, correlation_length_m = 1e-3, eps_real = 4 }",
            "{ model = \"kirchhoff-go\", rms_slope = 0.2, eps_real = 4 }",
            "{ model = \"directive\", s = 0.4, alpha_r = 4 }",
            "{ model = \"sum\", parts = [{ model = \"lambert\", albedo = 0.5 }] }",
            "{ model = \"fresnel\", eps_real = 2.07 }",
            "{ model = \"layered\", eps_real = 4.2, layers = [{ thickness_m = 1e-3, eps_real = 1.5 }] }",
        ] {
            let text = toml("lambert").replace(given, scattering);
            let text = text.lines().filter(|line| !line.starts_with("covariance"));
            let material = read(&text.collect::<Vec<_>>().join("\n")).unwrap();
            assert!(material.scattering().unwrap().sigma0(0.0) > 0.0, "{scattering}");
        }
    }

    #[test]
    fn what_cannot_be_is_refused_with_its_place() {
        let base = toml("scan");
        for (from, to, expected) in [
            ("\"scan\"\n[[source]]", "\"scam\"\n[[source]]", "render refers to"),
            ("scan.csv", "scam.csv", "cannot read scam.csv: no such file"),
            ("albedo = 0.5", "albedo = 1.5", "albedo = 1.5 is out of range"),
            ("albedo = 0.5", "albedo = nan", "albedo = NaN is out of range"),
            ("[[0.01]]", "[[-0.01]]", "not a covariance"),
            ("[[0.01]]", "[[0.01, 0.0]]", "not 1 × 1"),
            ("[\"albedo\"], matrix = [[0.01]]", "[], matrix = []", "names no parameter"),
            ("class =", "clas =", "did you mean `class`?"),
            ("kind = \"measured\"", "kind = \"guessed\"", "unknown value `guessed`"),
            ("slug = \"sample\"", "slug = \"../x\"", "is not a material name"),
            ("[290, 310]", "[310, 290]", "frequency_ghz"),
            ("licence = \"CC0-1.0\"", "licence = \" \"", "licence: is empty"),
            ("source = \"bench\"\nfile", "source = \"desk\"\nfile", "a source `desk`"),
            ("name = \"lambert\"", "name = \"scan\"", "`scan` is defined twice"),
        ] {
            assert!(base.contains(from), "{from}");
            let message = refused(&base.replacen(from, to, 1));
            assert!(message.contains(expected), "{message}");
            assert!(message.contains("material.toml"), "{message}");
        }
    }

    #[test]
    fn circumstances_of_a_point_must_be_possible() {
        let material = read(&toml("scan")).unwrap();
        let spoilt = |spoil: fn(&mut Observation)| {
            let mut material = material.clone();
            spoil(&mut material.curves[0].observations[0]);
            material.validate().map_err(|error| error.to_string())
        };
        assert_eq!(spoilt(|o| o.theta_sd_rad = Some(0.0)), Ok(()));
        for (result, expected) in [
            (spoilt(|o| o.theta_sd_rad = Some(2.0)), "the angle's deviation"),
            (spoilt(|o| o.power_w = Some(0.0)), "the power"),
            (spoilt(|o| o.power_w = Some(f64::INFINITY)), "the power"),
            (spoilt(|o| o.range_m = Some(-1.0)), "the range"),
            (spoilt(|o| o.range_m = Some(f64::NAN)), "the range"),
        ] {
            let message = result.unwrap_err();
            assert!(
                message.contains("curve `scan`, observation 1") && message.contains(expected),
                "{message}"
            );
        }
    }

    #[test]
    fn the_hash_sees_every_change() {
        let material = read(&toml("scan")).unwrap();
        let mut other = material.clone();
        assert_eq!(material.content_hash(), other.content_hash());
        other.curves[0].observations[0].delta_phi_rad = -0.0;
        assert_eq!((material.content_hash(), &material), (other.content_hash(), &other));
        other.curves[0].observations[0].theta_i_rad += 1e-9;
        assert_ne!(material.content_hash(), other.content_hash());
        let mut other = material.clone();
        other.curves[0].observations[0].chirp = Some(0);
        assert_ne!(material.content_hash(), other.content_hash());
    }
}
