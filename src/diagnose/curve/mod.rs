//! A measured curve → the term that its law of scattering lacks, or that it lacks none, or that what
//! it lacks is unknown.
//!
//! As for a scan, the base law is refitted first, so that "before" is the best that can be had
//! without a term; every term is fitted with it, and must predict runs of angles that took no part in
//! its fit (`folds.rs`). What goes with an angle then, smoothly and beyond chance, is unknown.
//!
//! | step | file |
//! |---|---|
//! | a curve as points, and their noise | `points.rs` |
//! | what a law can lack | `terms.rs` |
//! | law and terms together | `model.rs` |
//! | held-out runs of angles, selection | `folds.rs`, `select.rs` |
//! | what remains | `smooth.rs`, `remains.rs` |

mod folds;
mod model;
mod points;
mod remains;
mod select;
mod smooth;
mod terms;
#[cfg(test)]
mod testing;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use serde::Serialize;
use thiserror::Error;

use super::score::AT_THE_FLOOR;
use super::{SCHEMA, Value, Verdict};
use crate::brdf::{Brdf, CookTorrance, Distribution, Lambert, Shadowing, Sum};
use crate::effects::Level;
use crate::fit::FitError;
use crate::fit::bistatic::{Bistatic, Sample};
use crate::units::{rounded, shown};

pub use points::{Kind, Noise, NoiseSource, Point, Points};
pub use select::Ranked;
pub use terms::{Term, term, terms};

use folds::Folds;
use model::{Model, Scored};
use select::{Added, Selection, State};

/// Points without which nothing is said.
const LEAST_POINTS: usize = 24;
/// Runs of angles without which held-out scores have no standard error worth the name.
const LEAST_BLOCKS: usize = 8;

/// Settings of the diagnosis of a curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveDiagnosis {
    /// Seed of starts and folds.
    pub seed: u64,
    /// Number of folds, 2 or more.
    pub folds: usize,
    /// Most terms that are added.
    pub most_terms: usize,
    /// Least gain in ln likelihood that is looked into.
    pub least_gain: f64,
    /// Standard errors by which a held-out gain must exceed nothing.
    pub standard_errors: f64,
    /// Least change of the levels, dB, of a term and of what counts as unexplained.
    pub least_size_db: f64,
    /// Probability by chance below which neighbouring residuals go together.
    pub family_error: f64,
}

impl Default for CurveDiagnosis {
    fn default() -> Self {
        CurveDiagnosis {
            seed: 0,
            folds: 5,
            most_terms: 4,
            least_gain: 8.0,
            standard_errors: 2.0,
            least_size_db: 0.1,
            family_error: 0.005,
        }
    }
}

/// Why nothing can be said of a curve.
#[derive(Debug, Error, PartialEq)]
pub enum CurveDiagnoseError {
    /// The base law cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// Too little was detected.
    #[error("{detected} detected levels cannot tell terms apart; measure {LEAST_POINTS} or more")]
    TooFew {
        /// Levels.
        detected: usize,
    },
    /// Too few runs of angles.
    #[error(
        "the angles make {blocks} runs of {}° and {LEAST_BLOCKS} are needed to hold some out; \
         measure more angles or more incidences", shown(rounded(*.width_deg))
    )]
    TooShort {
        /// Runs.
        blocks: usize,
        /// Their width, degrees.
        width_deg: f64,
    },
    /// Nothing tells the noise.
    #[error(
        "the levels tell no noise: no incidence has three angles, none is repeated and no `sd_db` is \
         given; state it by --noise-db, or measure more angles of each incidence"
    )]
    Noiseless,
    /// A noise that is none.
    #[error("a noise of {noise_db} dB has no meaning; give a value above 0 and up to 100")]
    Noise {
        /// As declared.
        noise_db: f64,
    },
}

/// Why a term was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveEvidence {
    /// Gain in ln likelihood over the model before.
    pub gain: f64,
    /// Gain in ln p of held-out angles.
    pub held_out_gain: f64,
    /// Its standard error over runs of angles.
    pub held_out_se: f64,
    /// What it changes: root mean square of the levels, dB.
    pub size_db: f64,
}

/// A term that was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveFound {
    /// Its name.
    pub name: &'static str,
    /// Where it belongs.
    pub level: Level,
    /// Terms that predict the curve as well.
    pub class: Vec<&'static str>,
    /// Its numbers by name, fitted together with everything else.
    pub parameters: BTreeMap<&'static str, Value>,
    /// Why it was added.
    pub evidence: CurveEvidence,
}

/// Structure that no term explains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveUnknown {
    /// Always `unknown`.
    pub name: &'static str,
    /// The angle that it goes with, or `neighbouring angles`.
    pub covariate: &'static str,
    /// Its size: root mean square over the levels, dB.
    pub strength_db: f64,
    /// Gain in ln p of held-out angles by a smooth curve; none where there is no curve.
    pub held_out_gain: Option<f64>,
    /// Its standard error over runs.
    pub held_out_se: Option<f64>,
    /// Rms error on held-out angles with that curve, dB.
    pub held_out_rmse_db: Option<f64>,
    /// Probability of so much by chance.
    pub p_value: f64,
}

/// Errors over held-out levels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveErrors {
    /// Root mean square of observed − predicted over detections, dB.
    pub rmse_db: f64,
    /// Mean of it, dB.
    pub bias_db: f64,
    /// Mean ln p of all levels, those below a threshold included.
    pub log_score: f64,
}

/// Errors on held-out angles without and with the terms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveBeforeAfter {
    /// Base law, refitted.
    pub before: CurveErrors,
    /// With the terms.
    pub after: CurveErrors,
    /// Noise of a level, dB: the rms error of a model that is right.
    pub noise_floor_db: f64,
    /// How the noise is known.
    pub noise_source: NoiseSource,
    /// (before − after)/(before − floor) of the squared rmse; none where before is at the floor.
    pub explained_share: Option<f64>,
    /// Folds that the runs were dealt out to.
    pub folds: usize,
    /// Runs of angles.
    pub blocks: usize,
    /// Width of a run, degrees; below three correlation lengths where fewer than eight would be left.
    pub block_deg: f64,
    /// Correlation length of what base and smooth curves leave, degrees.
    pub correlation_deg: f64,
    /// Always: no level was predicted by a fit that it took part in.
    pub held_out: bool,
}

/// A number of the base law as fitted with the terms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveBaseValue {
    /// Its path.
    pub name: String,
    /// The number.
    #[serde(flatten)]
    pub value: Value,
}

/// What the terms are added to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveBase {
    /// The law's numbers, as fitted with the terms.
    pub parameters: Vec<CurveBaseValue>,
    /// Whether the final fit converged.
    pub converged: bool,
}

/// What was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveFacts {
    /// Over what.
    pub kind: Kind,
    /// Levels.
    pub points: usize,
    /// Those that only say that nothing was detected.
    pub censored: usize,
    /// Angles of incidence of a curve in the plane of incidence; else 1.
    pub scans: usize,
}

/// One level.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CurveRow {
    /// Angle of incidence, degrees.
    pub theta_i_deg: f64,
    /// Angle of the receiver, degrees, positive on the mirror's side.
    pub theta_s_deg: f64,
    /// Measured level, dB.
    pub observed_db: f64,
    /// Whether the truth is below.
    pub censored: bool,
    /// Level of the base law, dB, from a fit without this row's fold.
    pub before_db: f64,
    /// The same with the terms.
    pub after_db: f64,
    /// Fold that it was held out with.
    pub fold: usize,
    /// Run of angles, from 0.
    pub block: usize,
    /// Which scan, from 0.
    pub scan: usize,
}

/// Everything that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveReport {
    /// Version of the schema.
    pub schema: u32,
    /// The answer.
    pub verdict: Verdict,
    /// Terms in the order in which they were added.
    pub effects: Vec<CurveFound>,
    /// Every term of every round.
    pub ranking: Vec<Ranked>,
    /// What no term explains.
    pub unexplained: Vec<CurveUnknown>,
    /// Errors on held-out angles.
    pub error: CurveBeforeAfter,
    /// What the terms are added to.
    pub base: CurveBase,
    /// What was measured.
    pub curve: CurveFacts,
    /// Every level.
    #[serde(skip)]
    pub rows: Vec<CurveRow>,
}

/// The base law where none is chosen: one GGX lobe over Lambert, with values to start from.
pub fn base_law() -> Brdf {
    let (distribution, shadowing) = (Distribution::Ggx, Shadowing::Separable);
    let lobe = CookTorrance { f_lambda: 0.05, m: 0.3, m_across: None, distribution, shadowing };
    Brdf::Sum(Sum { parts: vec![Brdf::Lambert(Lambert { albedo: 0.1 }), Brdf::CookTorrance(lobe)] })
}

impl CurveDiagnosis {
    /// Diagnoses a curve against a law, trying these terms.
    ///
    /// # Errors
    /// When the curve is too short to tell anything, or the law cannot be fitted.
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
        let noise_db = points.noise.sd_db;
        if noise_db == f64::INFINITY {
            return Err(CurveDiagnoseError::Noiseless);
        }
        if !(noise_db > 0.0 && noise_db <= 100.0) {
            return Err(CurveDiagnoseError::Noise { noise_db });
        }
        let model = Model::new(&self.first_fit(points, law)?)?;
        let all = vec![true; points.points.len()];
        let fitted = model.fit(points, &all, &model.start());
        let levels_db = model.levels_db(&fitted.at, &points.points);
        let rough_db = remains::without_smooth(points, &levels_db, fitted.scale_db);
        let folds = Folds::new(points, &rough_db, self.folds, self.seed);
        if folds.blocks < LEAST_BLOCKS {
            let width_deg = folds.width_rad.to_degrees();
            return Err(CurveDiagnoseError::TooShort { blocks: folds.blocks, width_deg });
        }
        let selection = Selection { points, folds: &folds, settings: self };
        let before = selection.state(model, fitted);
        let (after, ranking, added) = selection.run(before.clone(), terms);
        let unexplained = remains::unexplained(&selection, &after);
        Ok(self.report(&selection, [&before, &after], ranking, added, unexplained))
    }

    /// The law as least squares in dB of all detections have it, from several starts.
    fn first_fit(&self, points: &Points, law: &Brdf) -> Result<Brdf, CurveDiagnoseError> {
        let samples: Vec<Sample> = points
            .points
            .iter()
            .filter(|point| !point.censored)
            .map(|point| Sample { i: point.i, o: point.o, f_per_sr: points::f_per_sr(point) })
            .collect();
        Ok(Bistatic { seed: self.seed, ..Bistatic::default() }.run(law, &samples)?.model)
    }

    fn report(
        &self,
        selection: &Selection,
        [before, after]: [&State; 2],
        ranking: Vec<Ranked>,
        added: Vec<Added>,
        unexplained: Vec<CurveUnknown>,
    ) -> CurveReport {
        let Selection { points, folds, .. } = *selection;
        let (effects, parameters) = remains::values(selection, after, added);
        let verdict = Verdict::new(!effects.is_empty(), !unexplained.is_empty());
        let scans = points.points.last().map_or(0, |point| point.scan + 1);
        CurveReport {
            schema: SCHEMA,
            verdict,
            effects,
            ranking,
            unexplained,
            error: before_after(points, folds, [&before.held_out, &after.held_out]),
            base: CurveBase { parameters, converged: after.fitted.converged },
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

fn before_after(
    points: &Points,
    folds: &Folds,
    [before, after]: [&[Scored]; 2],
) -> CurveBeforeAfter {
    let (before, after) = (errors(points, before), errors(points, after));
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

fn errors(points: &Points, scored: &[Scored]) -> CurveErrors {
    let pairs = || points.points.iter().zip(scored);
    let errors: Vec<f64> =
        pairs().filter(|(p, _)| !p.censored).map(|(p, scored)| p.f_db - scored.f_db).collect();
    let count = errors.len().max(1) as f64;
    CurveErrors {
        rmse_db: (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
        bias_db: errors.iter().sum::<f64>() / count,
        log_score: scored.iter().map(|s| s.log_p).sum::<f64>() / scored.len().max(1) as f64,
    }
}

fn rows(points: &Points, folds: &Folds, [before, after]: [&[Scored]; 2]) -> Vec<CurveRow> {
    let row = |(index, point): (usize, &Point)| {
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
    };
    points.points.iter().enumerate().filter_map(row).collect()
}
