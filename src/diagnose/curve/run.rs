//! The steps of the diagnosis of a curve.

use rayon::prelude::*;

use super::answer::{Answer, Compared, DECLARED};
use super::error::CurveDiagnoseError;
use super::folds::Folds;
use super::laws::other_laws;
use super::model::{Fit, Model, Score};
use super::points::{Contradiction, Points, f_per_sr};
use super::remains;
use super::report::{
    CurveBase, CurveBeforeAfter, CurveErrors, CurveFacts, CurveReport, CurveRow, CurveVerdict,
};
use super::select::Selection;
use super::settings::{CurveDiagnosis, LEAST_BLOCKS, LEAST_POINTS};
use super::terms::Term;
use crate::brdf::Brdf;
use crate::diagnose::report::SCHEMA;
use crate::diagnose::score::AT_THE_FLOOR;
use crate::fit::bistatic::{Bistatic, Sample};

impl CurveDiagnosis {
    /// Diagnoses a curve against a scattering model, trying these terms.
    ///
    /// # Errors
    /// When the curve is too short for an answer, or the scattering model cannot be fitted.
    pub fn run(
        &self,
        points: &Points,
        law: &Brdf,
        terms: &[&'static dyn Term],
    ) -> Result<CurveReport, CurveDiagnoseError> {
        let detected = points.points.iter().filter(|point| !point.censored).count();
        if detected < LEAST_POINTS {
            return Err(CurveDiagnoseError::TooFew { detected });
        }
        if let Some(Contradiction { repeats, apart_db, scatter_db }) = points.contradiction() {
            let apart_db = apart_db.abs();
            return Err(CurveDiagnoseError::Contradiction { repeats, apart_db, scatter_db });
        }
        let noise_db = points.noise.sd_db;
        if noise_db == f64::INFINITY {
            return Err(CurveDiagnoseError::Noiseless);
        }
        if !(noise_db > 0.0 && noise_db <= 100.0) {
            return Err(CurveDiagnoseError::Noise { noise_db });
        }
        let (model, fitted) = self.fitted(points, law)?;
        let levels_db = model.levels_db(&fitted.at, &points.points);
        let rough_db = remains::without_smooth(points, &levels_db, fitted.scale_db);
        let folds = Folds::new(points, &rough_db, self.folds, self.seed);
        if folds.blocks < LEAST_BLOCKS {
            let width_deg = folds.width_rad.to_degrees();
            return Err(CurveDiagnoseError::TooShort { blocks: folds.blocks, width_deg });
        }
        let selection = Selection {
            points,
            folds: &folds,
            settings: self,
            leaves_nothing: &remains::leaves_nothing,
        };
        let before = selection.state(model, fitted);
        let mut compared = vec![Compared::new(&selection, DECLARED, before)];
        if !compared[0].explains() {
            let others = other_laws(law).into_par_iter().filter_map(|(name, law)| {
                let (model, fitted) = self.fitted(points, &law).ok()?;
                Some(Compared::new(&selection, name, selection.state(model, fitted)))
            });
            compared.extend(others.collect::<Vec<Compared>>());
        }
        let answer = Answer::of(&selection, &compared, terms);
        Ok(self.report(&selection, &compared, answer))
    }

    /// The scattering model with its fit, which starts at the one by least squares in dB of all detections, from several
    /// starts.
    fn fitted(&self, points: &Points, law: &Brdf) -> Result<(Model, Fit), CurveDiagnoseError> {
        let samples: Vec<Sample> = points
            .points
            .iter()
            .filter(|point| !point.censored)
            .map(|point| Sample { i: point.i, o: point.o, f_per_sr: f_per_sr(point) })
            .collect();
        let found = Bistatic { seed: self.seed, ..Bistatic::default() }.run(law, &samples)?.model;
        let all = vec![true; points.points.len()];
        let (model, first) = (Model::new(law, points.kind)?, Model::new(&found, points.kind)?);
        let fitted = model.fit(points, &all, &first.start());
        Ok((model, fitted))
    }

    fn report(&self, selection: &Selection, compared: &[Compared], answer: Answer) -> CurveReport {
        let Selection { points, folds, .. } = *selection;
        let Answer { law, after, ranking, added, may_be, doubts, unexplained, .. } = answer;
        let (effects, parameters) = remains::values(selection, &after, added);
        let verdict = if !unexplained.is_empty() {
            CurveVerdict::Unexplained
        } else if !points.has_known_noise() {
            CurveVerdict::NoiseUnknown
        } else if !effects.is_empty() {
            CurveVerdict::Explained
        } else if law != DECLARED {
            CurveVerdict::AnotherLaw
        } else {
            CurveVerdict::NoMissingEffect
        };
        let before = compared.first().map_or(&after, |declared| &declared.state);
        let scans = points.points.last().map_or(0, |point| point.scan + 1);
        CurveReport {
            schema: SCHEMA,
            verdict,
            effects,
            ranking,
            may_be,
            doubts,
            laws: compared.iter().map(|one| one.in_report(points)).collect(),
            unexplained,
            error: before_after(points, folds, [&before.held_out, &after.held_out]),
            base: CurveBase { law, parameters, converged: after.fitted.converged },
            curve: CurveFacts {
                kind: points.kind,
                points: points.points.len(),
                censored: points.points.iter().filter(|point| point.censored).count(),
                scans,
            },
            rows: rows(points, folds, [&before.held_out, &after.held_out]),
        }
    }
}

/// Errors without and with the terms.
fn before_after(points: &Points, folds: &Folds, scores: [&[Score]; 2]) -> CurveBeforeAfter {
    let [before, after] = scores.map(|scores| CurveErrors::of(points, scores));
    let floor_db = points.noise.sd_db;
    let above = before.rmse_db.powi(2) - floor_db.powi(2);
    let gone = before.rmse_db.powi(2) - after.rmse_db.powi(2);
    let explained_share = (before.rmse_db > AT_THE_FLOOR * floor_db).then(|| gone / above);
    CurveBeforeAfter {
        before,
        after,
        noise_floor_db: floor_db,
        noise_source: points.noise.source,
        explained_share,
        folds: folds.folds,
        blocks: folds.blocks,
        block_deg: folds.width_rad.to_degrees(),
        correlation_deg: folds.correlation_rad.to_degrees(),
        held_out: true,
    }
}

/// One row per level.
fn rows(points: &Points, folds: &Folds, [before, after]: [&[Score]; 2]) -> Vec<CurveRow> {
    let rows = points.points.iter().enumerate().filter_map(|(index, point)| {
        Some(CurveRow {
            theta_i_deg: point.theta_i_rad.to_degrees(),
            theta_s_deg: point.theta_s_rad.to_degrees(),
            observed_db: point.f_db + point.offset_db,
            censored: point.censored,
            before_db: before.get(index)?.f_db + point.offset_db,
            after_db: after.get(index)?.f_db + point.offset_db,
            fold: *folds.fold.get(index)?,
            block: *folds.block.get(index)?,
            scan: point.scan,
        })
    });
    rows.collect()
}
