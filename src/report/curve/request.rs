//! The diagnosis of a curve as a user asks for it.

use std::path::Path;

use crate::brdf::Brdf;
use crate::diagnose::curve::{CurveDiagnosis, CurveReport, Points, Term, base_law};
use crate::error::Error;
use crate::formats::{ColumnNames, FormatError};
use crate::material::file::in_plane;
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
                refuse_other_directions(&curve)?;
                Ok((Points::backscatter(&curve, noise_db), notices))
            })
        };
        points.map_err(|error| Error::CurveFile { file: self.path.to_owned(), error })
    }
}

/// Refuses a point that was lit and seen from two directions in a table of backscatter.
fn refuse_other_directions(curve: &Curve) -> Result<(), FormatError> {
    let Some(place) = curve.observations.iter().position(|row| !row.is_retro()) else {
        return Ok(());
    };
    let place = format!("point {} (from 1)", place + 1);
    let way_out =
        "give a table in the plane of incidence: theta_i_deg, theta_s_deg and brdf_per_sr";
    Err(FormatError::at(place, "source and receiver were in two directions", way_out))
}
