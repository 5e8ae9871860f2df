//! A measured cloud → the physical effect that the model lacks, or that it lacks none, or that what
//! it lacks is unknown.
//!
//! The observation model comes first (`likelihood.rs`): speckle, thermal noise, and chirps that should
//! have been detected and were not. The base laws are refitted, so that "before" is the best that can
//! be had without the effect. Every effect is then fitted with the base, and the best few must
//! predict patches of the scan that took no part in their fit (`folds.rs`). When none is left that does,
//! directed tests look for structure in what remains (`residual.rs`).
//!
//! | step | file |
//! |---|---|
//! | every chirp against the target, the cloud against the chirps | `looks.rs` |
//! | probability of what was seen | `likelihood.rs` |
//! | base and effects together | `refit.rs` |
//! | held-out patches, controls, selection | `folds.rs`, `placebo.rs`, `select.rs` |
//! | what remains, and how large the error is | `residual.rs`, `score.rs` |

mod folds;
mod likelihood;
mod looks;
mod placebo;
mod refit;
mod residual;
mod score;
mod select;
#[cfg(test)]
mod tests;

use serde::Serialize;
use thiserror::Error;

use crate::brdf::Brdf;
use crate::effects::{Effect, Level, Look, Receiver, Stage};
use crate::fit::FitError;
use crate::render::RenderError;
use crate::units::dbm_from_watts;

pub use folds::Folds;
pub use likelihood::Declared;
pub use looks::{Matched, Observation, looks, matched};
pub use residual::Unexplained;
pub use score::Errors;
pub use select::Candidate;

use refit::{Problem, Space};
use residual::Tests;
use select::Selection;

/// Version of [`Report`] as JSON.
pub const SCHEMA: u32 = 1;

/// Detections without which nothing is said.
const LEAST_DETECTIONS: usize = 300;
/// Patches without which held-out scores have no standard error worth the name.
const LEAST_BLOCKS: usize = 15;

/// Settings of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Seed of folds, placebos and randomised residuals.
    pub seed: u64,
    /// Side of the patches that are held out together, m; three correlation lengths or more. 0.1:
    /// six spots.
    pub block_m: f64,
    /// Number of folds, 2 or more.
    pub folds: usize,
    /// Most effects that are added.
    pub most_effects: usize,
    /// Least gain in ln likelihood that is looked into. 8: by chance once in some 16 000 for one number.
    pub least_gain: f64,
    /// Standard errors by which a held-out gain must exceed nothing.
    pub standard_errors: f64,
    /// Least change of the data, dB, of an effect and of what counts as unexplained.
    pub least_size_db: f64,
    /// Probability that a complete model is called unexplained.
    pub family_error: f64,
    /// Random signs drawn for each residual test.
    pub draws: usize,
}

impl Default for Diagnosis {
    fn default() -> Self {
        Diagnosis {
            seed: 0,
            block_m: 0.1,
            folds: 5,
            most_effects: 4,
            least_gain: 8.0,
            standard_errors: 2.0,
            least_size_db: 0.1,
            family_error: 0.02,
            draws: 4999,
        }
    }
}

/// What a diagnosis starts from: everything declared of the scan.
#[derive(Clone, Copy)]
pub struct Subject<'a> {
    /// Instrument and target.
    pub stage: &'a Stage<'a>,
    /// Scattering of each region, where the refit begins.
    pub laws: &'a [Brdf],
    /// The receiver's law without effects; its looks lie between 0.1 and 10⁴.
    pub receiver: Receiver,
    /// Threshold and range error.
    pub declared: Declared,
    /// Every chirp that meets the target.
    pub looks: &'a [Look],
    /// What each of them saw.
    pub observations: &'a [Observation],
}

/// The answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The base model explains the data.
    NoMissingEffect,
    /// With the effects that were added it does.
    Explained,
    /// Structure is left that no effect explains.
    Unexplained,
}

/// A number and its standard deviation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Value {
    /// Name, with its unit.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard deviation; none where a bound holds the number or the data cannot tell it.
    pub sd: Option<f64>,
}

/// An effect that was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// Its name.
    pub name: &'static str,
    /// Where it belongs.
    pub level: Level,
    /// Effects that predict the data as well.
    pub class: Vec<&'static str>,
    /// Its numbers, fitted together with everything else.
    pub parameters: Vec<Value>,
}

/// Errors on held-out patches without and with the effects.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// Base model, refitted.
    pub before: Errors,
    /// With the effects.
    pub after: Errors,
    /// (before − after)/(before − floor) of the squared rmse; none where before is at the floor.
    pub explained_share: Option<f64>,
}

/// A law's number as fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseValue {
    /// Region.
    pub region: usize,
    /// The number.
    #[serde(flatten)]
    pub value: Value,
}

/// One look, as a table of residuals has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Chirp number.
    pub chirp: u32,
    /// Received power, dBm; none where nothing was detected.
    pub observed_dbm: Option<f64>,
    /// E[dBm | detected] of the base model, from a fit without this look's fold.
    pub before_dbm: f64,
    /// The same with the effects.
    pub after_dbm: f64,
    /// Randomised quantile residual of the base model, fitted to all looks.
    pub z_before: f64,
    /// The same with the effects.
    pub z_after: f64,
    /// Fold that it was held out with.
    pub fold: usize,
}

/// Everything that was found.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Version of the schema.
    pub schema: u32,
    /// The answer.
    pub verdict: Verdict,
    /// Effects in the order in which they were added.
    pub effects: Vec<Found>,
    /// Every effect of every round.
    pub ranking: Vec<Candidate>,
    /// What no effect explains.
    pub unexplained: Vec<Unexplained>,
    /// Errors on held-out patches.
    pub error: BeforeAfter,
    /// The laws as fitted with the effects.
    pub base: Vec<BaseValue>,
    /// Whether the final fit converged.
    pub converged: bool,
    /// Patches.
    pub blocks: usize,
    /// The laws of every region as fitted with the effects.
    #[serde(skip)]
    pub laws: Vec<Brdf>,
    /// Every look.
    #[serde(skip)]
    pub rows: Vec<Row>,
}

/// Why nothing can be said.
#[derive(Debug, Error)]
pub enum DiagnoseError {
    /// No chirp meets the target, or the like.
    #[error(transparent)]
    Render(#[from] RenderError),
    /// A law that cannot be fitted.
    #[error(transparent)]
    Fit(#[from] FitError),
    /// A point that cannot be given to its chirp.
    #[error("point {point} of the cloud has no chirp number; export the cloud with its chirps")]
    Unnumbered {
        /// Point, from 0.
        point: usize,
    },
    /// Too little was detected.
    #[error(
        "{detected} detections on the target cannot tell effects apart; {LEAST_DETECTIONS} are needed, \
             so check scene and threshold, or scan more"
    )]
    TooFew {
        /// Detections.
        detected: usize,
    },
    /// The target is too small for held-out patches.
    #[error(
        "the looks fill {blocks} patches and {LEAST_BLOCKS} are needed; make block_m smaller or scan more"
    )]
    TooSmall {
        /// Patches.
        blocks: usize,
    },
    /// As many observations as looks are needed.
    #[error(
        "{observations} observations are not one for each of {looks} looks; match the cloud again"
    )]
    Unmatched {
        /// Observations.
        observations: usize,
        /// Looks.
        looks: usize,
    },
    /// No law of speckle.
    #[error("{looks} looks of speckle give no likelihood; declare between 0.1 and 10000")]
    Looks {
        /// As declared.
        looks: f64,
    },
}

impl Diagnosis {
    /// Diagnoses a scan, trying these effects.
    ///
    /// # Errors
    /// When the data are too few to tell anything, or something declared has no meaning.
    pub fn run(&self, subject: &Subject, effects: &[&dyn Effect]) -> Result<Report, DiagnoseError> {
        let Subject { stage, laws, receiver, declared, looks, observations } = *subject;
        let folds = Folds::new(looks, self.block_m, self.folds, self.seed);
        check(subject, &folds)?;
        let problem = Problem { stage, looks, observations, declared, receiver };
        let selection = Selection { problem, folds: &folds, settings: self };
        let base = selection.base(Space::new(&problem, laws)?);
        let (before, z_before) = (base.held_out.clone(), self.z(&problem, &base));
        let (state, ranking, added) = selection.run(base, effects);
        let z_after = self.z(&problem, &state);
        let prediction = problem.predict(&state.space, &state.fitted.at);
        let unexplained = self.tests().run(&z_after, looks, &prediction, &folds);
        let (base, effects) = values(&problem, &state, added);
        Ok(Report {
            schema: SCHEMA,
            verdict: verdict(&unexplained, &effects),
            effects,
            ranking,
            unexplained,
            error: before_after(score::errors(&before), score::errors(&state.held_out)),
            base,
            converged: state.fitted.converged,
            blocks: folds.blocks,
            laws: state.space.model(receiver, &state.fitted.at).laws,
            rows: rows(subject, &folds, [&before, &state.held_out], [&z_before, &z_after]),
        })
    }

    fn z(&self, problem: &Problem, state: &select::State) -> Vec<f64> {
        let prediction = problem.predict(&state.space, &state.fitted.at);
        residual::z(&prediction, problem.declared, problem.observations, self.seed)
    }

    fn tests(&self) -> Tests {
        let Diagnosis { seed, draws, block_m, family_error, least_size_db, .. } = *self;
        Tests { seed, draws, block_m, family_error, least_size_db }
    }
}

fn verdict(unexplained: &[Unexplained], effects: &[Found]) -> Verdict {
    match (unexplained.is_empty(), effects.is_empty()) {
        (false, _) => Verdict::Unexplained,
        (true, true) => Verdict::NoMissingEffect,
        (true, false) => Verdict::Explained,
    }
}

fn rows(
    subject: &Subject,
    folds: &Folds,
    [before, after]: [&[score::Scored]; 2],
    [z_before, z_after]: [&[f64]; 2],
) -> Vec<Row> {
    let row = |look: usize| {
        let power_w = subject.observations.get(look)?.power_w;
        Some(Row {
            chirp: subject.looks.get(look)?.chirp,
            observed_dbm: power_w.map(dbm_from_watts),
            before_dbm: before.get(look)?.expected_dbm,
            after_dbm: after.get(look)?.expected_dbm,
            z_before: *z_before.get(look)?,
            z_after: *z_after.get(look)?,
            fold: *folds.fold.get(look)?,
        })
    };
    (0..subject.looks.len()).filter_map(row).collect()
}

fn check(subject: &Subject, folds: &Folds) -> Result<(), DiagnoseError> {
    let (observations, looks) = (subject.observations.len(), subject.looks.len());
    if observations != looks {
        return Err(DiagnoseError::Unmatched { observations, looks });
    }
    if !(0.1..=1e4).contains(&subject.receiver.looks) {
        return Err(DiagnoseError::Looks { looks: subject.receiver.looks });
    }
    let detected = subject.observations.iter().filter(|o| o.power_w.is_some()).count();
    if detected < LEAST_DETECTIONS {
        return Err(DiagnoseError::TooFew { detected });
    }
    match folds.blocks < LEAST_BLOCKS {
        true => Err(DiagnoseError::TooSmall { blocks: folds.blocks }),
        false => Ok(()),
    }
}

fn values(
    problem: &Problem,
    state: &select::State,
    added: Vec<select::Added>,
) -> (Vec<BaseValue>, Vec<Found>) {
    let (space, at) = (&state.space, &state.fitted.at);
    let sd = problem.sd(space, at, &vec![true; problem.looks.len()]);
    let finite = |sd: f64| sd.is_finite().then_some(sd);
    let base = space.base_values(at).into_iter().zip(&sd);
    let base = base.map(|((region, name, value, slope), sd)| BaseValue {
        region,
        value: Value { name, value, sd: finite(sd * slope) },
    });
    let mut sds = sd.iter().skip(space.base_len());
    let effects = space.effects.iter().zip(space.effect_values(at)).zip(added);
    let found = effects.map(|((effect, values), added)| {
        let knobs = effect.knobs().iter().zip(values).zip(sds.by_ref());
        let parameters = knobs.map(|((knob, value), sd)| Value {
            name: knob.name.to_owned(),
            value,
            sd: finite(sd * knob.step),
        });
        let parameters = parameters.collect();
        Found { name: effect.name(), level: effect.level(), class: added.class, parameters }
    });
    let found = found.collect();
    (base.collect(), found)
}

fn before_after(before: Errors, after: Errors) -> BeforeAfter {
    let floor = after.noise_floor_db.powi(2);
    let excess = before.rmse_db.powi(2) - floor;
    let removed = before.rmse_db.powi(2) - after.rmse_db.powi(2);
    let explained_share = (excess > 0.0).then_some(removed / excess);
    BeforeAfter { before, after, explained_share }
}
