//! The report of the diagnosis of a curve: most of the schema of its `report.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::evidence::{CurveEvidence, RankedTerm};
use super::model::Score;
use super::points::{Kind, NoiseSource, Points};
use super::trust::NameDoubt;
use crate::diagnose::report::Value;
use crate::effects::Level;

/// The answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CurveVerdict {
    /// The scattering model explains the curve.
    NoMissingEffect,
    /// Another scattering model than the declared one explains the curve.
    AnotherLaw,
    /// The scattering model with the added terms explains the curve.
    Explained,
    /// Structure remains that neither other models nor terms explain.
    Unexplained,
    /// No structure remains, and how much noise alone would leave is unknown.
    NoiseUnknown,
}

/// A term that was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundTerm {
    /// Its name.
    pub name: &'static str,
    /// The level it belongs to.
    pub level: Level,
    /// Terms that predict the curve as well.
    pub class: Vec<&'static str>,
    /// Its parameters by name, fitted together with everything else.
    pub parameters: BTreeMap<&'static str, Value>,
    /// Why it was added.
    pub evidence: CurveEvidence,
}

/// Structure that no term explains.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveUnknown {
    /// Always `unknown`.
    pub name: &'static str,
    /// The angle that it depends on, `neighbouring angles`, `isolated angles`, or `scatter` for more of it than the noise
    /// has.
    pub covariate: &'static str,
    /// Pairs of incidence and receiver angle, degrees, at which isolated levels lie; else empty.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub at_deg: Vec<[f64; 2]>,
    /// Its size: root mean square over the levels, dB.
    pub strength_db: f64,
    /// Gain in ln p of held-out angles by a smooth curve; none where there is no curve.
    pub held_out_gain: Option<f64>,
    /// Its standard error over runs.
    pub held_out_se: Option<f64>,
    /// Rms error on held-out angles with that curve, dB.
    pub held_out_rmse_db: Option<f64>,
    /// Probability by chance.
    pub p_value: f64,
}

/// Errors over held-out levels.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveErrors {
    /// Root mean square of observed − predicted over detections, dB.
    pub rmse_db: f64,
    /// Mean of observed − predicted over detections, dB.
    pub bias_db: f64,
    /// Mean ln p of all levels, those below a threshold included.
    pub log_score: f64,
}

impl CurveErrors {
    /// The errors of a model from its scores.
    pub(super) fn of(points: &Points, scores: &[Score]) -> CurveErrors {
        let pairs = points.points.iter().zip(scores).filter(|(point, _)| !point.censored);
        let errors: Vec<f64> =
            pairs.map(|(point, score)| (point.f_db - score.f_db) / point.spread).collect();
        let count = errors.len().max(1) as f64;
        CurveErrors {
            rmse_db: (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt(),
            bias_db: errors.iter().sum::<f64>() / count,
            log_score: scores.iter().map(|s| s.log_p).sum::<f64>() / scores.len().max(1) as f64,
        }
    }
}

/// Errors on held-out angles without and with the terms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveBeforeAfter {
    /// Base law, refitted.
    pub before: CurveErrors,
    /// With the terms.
    pub after: CurveErrors,
    /// Noise of a level, dB: the rms error of a correct model.
    pub noise_floor_db: f64,
    /// How the noise is known.
    pub noise_source: NoiseSource,
    /// (before − after)/(before − floor) of the squared rmse; none where before is at the floor.
    pub explained_share: Option<f64>,
    /// Folds that the runs were dealt out to.
    pub folds: usize,
    /// Runs of angles.
    pub blocks: usize,
    /// Width of a run, degrees; below three correlation lengths where these would make fewer than eight runs.
    pub block_deg: f64,
    /// Correlation length of the residual of base and smooth curves, degrees.
    pub correlation_deg: f64,
    /// Always: no level was predicted by a fit that it took part in.
    pub held_out: bool,
}

/// A parameter of the scattering model as fitted with the terms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveBaseValue {
    /// Its path.
    pub name: String,
    /// Its value.
    #[serde(flatten)]
    pub value: Value,
}

/// A scattering model that the curve was compared with.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ComparedLaw {
    /// Its name; `declared` of the one that was asked for.
    pub name: &'static str,
    /// Root mean square residual of the detections, dB.
    pub rms_db: f64,
    /// Its free parameters.
    pub numbers: usize,
    /// Probability by chance that the residual exceeds the noise as much; none where the noise is unknown.
    pub p_value: Option<f64>,
    /// Whether no test of what remains finds anything.
    pub explains: bool,
}

/// The scattering model that the terms are added to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveBase {
    /// Its name; `declared` of the one that was asked for.
    pub law: &'static str,
    /// Its parameters, as fitted with the terms.
    pub parameters: Vec<CurveBaseValue>,
    /// Whether the final fit converged.
    pub converged: bool,
}

/// The measured curve.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveFacts {
    /// What it is measured over.
    pub kind: Kind,
    /// Levels.
    pub points: usize,
    /// Levels without a detection.
    pub censored: usize,
    /// Angles of incidence of a curve in the plane of incidence; else 1.
    pub scans: usize,
}

/// One level of a curve, as a line of `residuals.csv` has it. Levels are in dB, in which the fit minimises the residual.
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
    /// Level of the scattering model, dB, from a fit without this row's fold.
    pub before_db: f64,
    /// Level with the terms, dB, from a fit without this row's fold.
    pub after_db: f64,
    /// Fold that the level was held out with.
    pub fold: usize,
    /// Run of angles, from 0.
    pub block: usize,
    /// Which scan, from 0.
    pub scan: usize,
}

/// The report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveReport {
    /// Version of the schema.
    pub schema: u32,
    /// The answer.
    pub verdict: CurveVerdict,
    /// Terms in the order in which they were added.
    pub effects: Vec<FoundTerm>,
    /// Every term of every round.
    pub ranking: Vec<RankedTerm>,
    /// Terms that improve the law and get no name: more than noise remains, the noise is unknown, or they cannot be trusted.
    pub may_be: Vec<&'static str>,
    /// Why these get no name.
    pub doubts: Vec<NameDoubt>,
    /// The scattering models that the curve was compared with: the others only where the first does not explain it.
    pub laws: Vec<ComparedLaw>,
    /// Structure that no term explains.
    pub unexplained: Vec<CurveUnknown>,
    /// Errors on held-out angles.
    pub error: CurveBeforeAfter,
    /// The scattering model that the terms are added to.
    pub base: CurveBase,
    /// The measured curve.
    pub curve: CurveFacts,
    /// Every level.
    #[serde(skip)]
    pub rows: Vec<CurveRow>,
}
