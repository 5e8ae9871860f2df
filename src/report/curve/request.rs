//! The diagnosis of a curve as a user asks for it.

use std::path::Path;

use crate::brdf::Brdf;
use crate::diagnose::curve::{CurveDiagnosis, CurveReport, Points, Term, base_law};
use crate::error::Error;
use crate::formats::{ColumnNames, FormatError};
use crate::material::Observation;
use crate::material::file::in_plane::{self, InPlane};
use crate::measure::Curve;

/// What to diagnose.
#[derive(Clone, Copy)]
pub struct CurveRequest<'a> {
    /// The curve's file: `.bsdf`, a table in the plane of incidence, or a backscatter curve.
    pub path: &'a Path,
    /// Our names for its columns.
    pub columns: &'a ColumnNames,
    /// The law to compare the curve with, from which the refit begins; one GGX lobe over Lambert for `None`.
    pub law: Option<&'a Brdf>,
    /// Noise of the levels, dB; from repeats, the file or neighbouring angles for `None`.
    pub noise_db: Option<f64>,
    /// Effects to try.
    pub effects: &'a [&'static dyn Term],
    /// Seed of everything random.
    pub seed: u64,
}

impl CurveRequest<'_> {
    /// Diagnoses the curve; `bytes` is the content of its file. Also what a person should know of the file.
    ///
    /// # Errors
    /// [`Error::CurveFile`] for bytes that are not a curve, [`Error::CurveDiagnosis`] for a curve of which nothing
    /// can be said.
    pub fn diagnose(&self, bytes: &[u8]) -> Result<(CurveReport, Vec<String>), Error> {
        let (points, notices) = self.points(bytes)?;
        let law = self.law.cloned().unwrap_or_else(base_law);
        let diagnosis = CurveDiagnosis { seed: self.seed, ..CurveDiagnosis::default() };
        match diagnosis.run(&points, &law, self.effects) {
            Ok(report) => Ok((report, notices)),
            Err(error) => {
                Err(Error::CurveDiagnosis { curve: self.path.display().to_string(), error })
            }
        }
    }

    fn points(&self, bytes: &[u8]) -> Result<(Points, Vec<String>), Error> {
        let is_named_so = self.path.extension().is_some_and(|end| end.eq_ignore_ascii_case("bsdf"));
        let is_bsdf = is_named_so || in_plane::is_bsdf(bytes);
        let noise_db = self.noise_db;
        let points = if is_bsdf {
            in_plane::read_bsdf(bytes).map(|table| (Points::in_plane(&table, noise_db), Vec::new()))
        } else if in_plane::is_table(bytes, self.columns) {
            in_plane::read_table(bytes, self.columns)
                .map(|(table, notices)| (Points::in_plane(&table, noise_db), notices))
        } else {
            Curve::read_as(bytes, self.columns).and_then(|(curve, notices)| {
                if curve.observations.iter().all(Observation::is_retro) {
                    return Ok((Points::backscatter(&curve, noise_db), notices));
                }
                Ok((Points::in_plane(&values(&curve)?, noise_db), notices))
            })
        };
        points.map_err(|error| Error::CurveFile { file: self.path.to_owned(), error })
    }
}

/// The detections of a curve as values in the plane of incidence.
fn values(curve: &Curve) -> Result<Vec<InPlane>, FormatError> {
    let mut values = Vec::new();
    for (place, row) in curve.observations.iter().enumerate().filter(|(_, row)| !row.is_censored())
    {
        values.push(InPlane::of(row).ok_or_else(|| {
            let place = format!("point {} (from 1)", place + 1);
            FormatError::at(place, "it is out of the plane of incidence", "leave such points out")
        })?);
    }
    Ok(values)
}
