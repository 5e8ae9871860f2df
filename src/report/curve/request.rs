//! The diagnosis of a curve as a user asks for it.

use std::path::Path;

use crate::brdf::Brdf;
use crate::diagnose::curve::{
    CurveDiagnosis, CurveReport, Points, Term, base_law, is_grazing, term, terms,
};
use crate::error::Error;
use crate::fit::{model, model_names};
use crate::formats::text::nearest;
use crate::formats::{ColumnNames, FormatError};
use crate::material::file::in_plane::{is_bsdf, read_bsdf};
use crate::material::file::points;
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

/// A curve, and what is stated of the deviation of each of its levels, dB.
type Levels = (Curve, Vec<Option<f64>>);

/// The law of this name, to compare a curve with.
///
/// # Errors
/// There is none; the error names one that may be meant.
pub fn curve_law(name: &str) -> Result<Brdf, Error> {
    model(name).ok_or_else(|| unknown("model", name, &model_names().collect::<Vec<_>>()))
}

/// The effects of curves of these names, each once; all of them without any.
///
/// # Errors
/// The first name that no effect has.
pub fn curve_terms(names: &[String]) -> Result<Vec<&'static dyn Term>, Error> {
    if names.is_empty() {
        return Ok(terms().to_vec());
    }
    let mut chosen: Vec<&'static dyn Term> = Vec::new();
    for name in names {
        let Some(found) = term(name) else {
            let known: Vec<&str> = terms().iter().map(|term| term.name()).collect();
            return Err(unknown("effect", name, &known));
        };
        if chosen.iter().all(|other| other.name() != found.name()) {
            chosen.push(found);
        }
    }
    Ok(chosen)
}

fn unknown(what: &str, name: &str, known: &[&str]) -> Error {
    let way_out = match nearest(name, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("choose {}", known.join(", ")),
    };
    Error::usage(format!("a curve has no {what} `{name}`"), way_out)
}

impl CurveRequest<'_> {
    /// Diagnoses the curve; `bytes` is the content of its file. Also what a person should know of the file.
    ///
    /// # Errors
    /// [`Error::CurveFile`] for bytes that are not a curve, [`Error::CurveDiagnosis`] for a curve of which nothing
    /// can be said.
    pub fn diagnose(&self, bytes: &[u8]) -> Result<(CurveReport, Vec<String>), Error> {
        let ((curve, sd_db), mut notices) =
            self.read(bytes).map_err(|error| self.of_file(error))?;
        let (report, of_points) = self.diagnose_curve(&curve, &sd_db)?;
        notices.extend(of_points);
        Ok((report, notices))
    }

    /// As [`CurveRequest::diagnose`], of a curve that is read; `sd_db` is what is stated of the deviation of each level, for
    /// none or for all rows.
    ///
    /// # Errors
    /// As [`CurveRequest::diagnose`].
    pub fn diagnose_curve(
        &self,
        curve: &Curve,
        sd_db: &[Option<f64>],
    ) -> Result<(CurveReport, Vec<String>), Error> {
        let (points, notices) = self.points(curve, sd_db).map_err(|error| self.of_file(error))?;
        let law = self.law.cloned().unwrap_or_else(base_law);
        let diagnosis = CurveDiagnosis { seed: self.seed, ..CurveDiagnosis::default() };
        match diagnosis.run(&points, &law, self.effects) {
            Ok(report) => Ok((report, notices)),
            Err(error) => {
                Err(Error::CurveDiagnosis { curve: self.path.display().to_string(), error })
            }
        }
    }

    fn of_file(&self, error: FormatError) -> Error {
        Error::CurveFile { file: self.path.to_owned(), error }
    }

    /// The levels of a file, and what a person should know of it.
    fn read(&self, bytes: &[u8]) -> Result<(Levels, Vec<String>), FormatError> {
        let is_named_so = self.path.extension().is_some_and(|end| end.eq_ignore_ascii_case("bsdf"));
        if is_named_so && !is_bsdf(bytes) {
            // What it lacks.
            read_bsdf(bytes)?;
        }
        let table = points(bytes, self.columns)?;
        let sd_db = table.sd_db.clone();
        let (curve, mut notices) = Curve::of_points(table)?;
        let stated = curve.observations.iter().zip(&sd_db).filter(|(row, _)| !row.is_censored());
        let stated: Vec<bool> = stated.map(|(_, sd_db)| sd_db.is_some()).collect();
        if stated.contains(&true) && stated.contains(&false) {
            notices.push("`sd_db` is not used: some levels have none".to_owned());
        }
        Ok(((curve, sd_db), notices))
    }

    /// The points of a curve, and what a person should know of them.
    fn points(
        &self,
        curve: &Curve,
        sd_db: &[Option<f64>],
    ) -> Result<(Points, Vec<String>), FormatError> {
        if curve.illumination.relative {
            let problem = "the levels are relative, and a law has levels of its own";
            let way_out =
                "calibrate them, or `matdb fit` the curve: its widths and exponents need no level";
            return Err(FormatError::at("column relative", problem, way_out));
        }
        let points = Points::of_curve(curve, sd_db, self.noise_db).map_err(|row| {
            let place = format!("point {row} (from 1)");
            FormatError::at(place, "it is out of the plane of incidence", "leave such points out")
        })?;
        let grazing = curve.observations.iter().filter(|row| is_grazing(row)).count();
        let notice = format!("levels at 89.9° or more are not used: {grazing}");
        Ok((points, if grazing > 0 { vec![notice] } else { Vec::new() }))
    }
}
