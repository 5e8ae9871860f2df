//! A measured cloud → the physical effect that the model lacks, or that it lacks none, or that what
//! it lacks is unknown.
//!
//! The observation model comes first (`likelihood.rs`): speckle, thermal noise, and chirps that should
//! have been detected and were not. The base laws are refitted, so that "before" is the best that can
//! be had without the effect. A score test screens the library on a sample of the looks; the best few are
//! fitted with the base and must predict patches of the scan that took no part in their fit. When none
//! is left that does, effects that the others made superfluous are taken away, and what remains is
//! looked at: by a smooth field over every covariate, by what neighbours have in common, by the
//! scatter, by outliers.
//!
//! | step | file |
//! |---|---|
//! | every chirp against the target, the cloud against the chirps | `looks.rs` |
//! | probability of what was seen | `likelihood.rs` |
//! | base and effects together | `refit.rs` |
//! | what an effect promises | `screen.rs` |
//! | held-out patches, selection | `folds.rs`, `select.rs` |
//! | what remains | `covariates.rs`, `field.rs`, `residual.rs` |
//! | how large the error is, and what the answer is to be held against | `score.rs`, `controls.rs`, `placebo.rs` |
//! | the same of a measured curve | `curve/` |

mod controls;
mod covariates;
pub mod curve;
mod field;
mod folds;
mod likelihood;
mod looks;
mod placebo;
mod refit;
mod residual;
mod score;
mod screen;
mod select;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;

use serde::Serialize;
use thiserror::Error;

use crate::brdf::Brdf;
use crate::effects::{Effect, Knob, Level, Look, Prediction, Receiver, Stage, Surveys};
use crate::fit::FitError;
use crate::render::RenderError;
use crate::units::dbm_from_watts;

pub use folds::Folds;
pub use likelihood::Declared;
pub use looks::{Matched, Observation, looks, matched};
pub use residual::Unexplained;
pub use score::Errors;
pub use select::Candidate;

use covariates::covariates;
use refit::{Problem, Space};
use residual::Tests;
use select::{Selected, Selection};

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
    /// Side of the patches that are held out together, m; three correlation lengths or more. 0.05:
    /// three spots.
    pub block_m: f64,
    /// Number of folds, 2 or more.
    pub folds: usize,
    /// Most effects that are added.
    pub most_effects: usize,
    /// Least gain in ln likelihood of an effect with one number that is looked into. 5: by chance once
    /// in some 640.
    pub least_gain: f64,
    /// Standard errors by which a held-out gain must exceed nothing.
    pub standard_errors: f64,
    /// Least change of the data, dB, of an effect.
    pub least_size_db: f64,
    /// Least structure of the means, dB, that counts as unexplained.
    pub least_structure_db: f64,
    /// Probability that a complete model is called unexplained.
    pub family_error: f64,
    /// Random signs drawn for each residual test.
    pub draws: usize,
}

impl Default for Diagnosis {
    fn default() -> Self {
        Diagnosis {
            seed: 0,
            block_m: 0.05,
            folds: 5,
            most_effects: 4,
            least_gain: 5.0,
            standard_errors: 2.0,
            least_size_db: 0.1,
            least_structure_db: 0.15,
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
    /// Effects that are declared, at fixed values.
    pub at_work: &'a [(&'a dyn Effect, Vec<f64>)],
    /// The receiver's law without effects; its looks lie between 0.1 and 10⁴.
    pub receiver: Receiver,
    /// Threshold and range error.
    pub declared: Declared,
    /// Every chirp that meets the target.
    pub looks: &'a [Look],
    /// What each of them saw.
    pub observations: &'a [Observation],
    /// Detections that belong to no look, or far from where it meets the target.
    pub false_alarms: usize,
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
    /// Value.
    pub value: f64,
    /// Standard deviation; none where a bound holds the number or the data cannot tell it.
    pub sd: Option<f64>,
    /// UCUM code of its unit; 1 for a pure number.
    pub unit: &'static str,
}

/// Three numbers that belong together, such as a place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Triple {
    /// Values along x, y and z.
    pub value: [f64; 3],
    /// Their standard deviations, as those of numbers; none for what follows from other numbers.
    pub sd: Option<[f64; 3]>,
    /// UCUM code of their unit.
    pub unit: &'static str,
}

/// The numbers of an effect by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Parameters {
    /// Those that were fitted.
    #[serde(flatten)]
    pub numbers: BTreeMap<&'static str, Value>,
    /// The same as vectors in the global frame: `translation_m` and `rotation_deg` of a pose,
    /// `centre_m` of a place on the target.
    #[serde(flatten)]
    pub triples: BTreeMap<&'static str, Triple>,
}

impl Parameters {
    fn new(numbers: BTreeMap<&'static str, Value>, looks: &[Look]) -> Parameters {
        let mut triples = BTreeMap::new();
        for (name, unit) in [("translation_m", "m"), ("rotation_deg", "deg")] {
            let (stem, end) = name.split_once('_').unwrap_or((name, ""));
            let axis = |axis: &str| numbers.get(format!("{stem}_{axis}_{end}").as_str());
            if let (Some(x), Some(y), Some(z)) = (axis("x"), axis("y"), axis("z")) {
                let sd = x.sd.zip(y.sd).zip(z.sd).map(|((x, y), z)| [x, y, z]);
                triples.insert(name, Triple { value: [x.value, y.value, z.value], sd, unit });
            }
        }
        if let (Some(x), Some(y)) = (numbers.get("centre_x_m"), numbers.get("centre_y_m")) {
            let off = |look: &&Look| (look.xt_m - x.value).hypot(look.yt_m - y.value);
            let nearest = looks.iter().min_by(|a, b| off(a).total_cmp(&off(b)));
            if let Some(look) = nearest {
                let value = look.hit.point.xyz.to_array();
                triples.insert("centre_m", Triple { value, sd: None, unit: "m" });
            }
        }
        Parameters { numbers, triples }
    }
}

impl std::ops::Deref for Parameters {
    type Target = BTreeMap<&'static str, Value>;

    fn deref(&self) -> &Self::Target {
        &self.numbers
    }
}

/// Why an effect was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evidence {
    /// Gain in ln likelihood over the model before.
    pub gain: f64,
    /// The largest gain of a placebo with as many numbers.
    pub placebo_gain: f64,
    /// Gain in ln p of held-out patches.
    pub held_out_gain: f64,
    /// Its standard error over patches.
    pub held_out_se: f64,
    /// What it changes: root mean square of mean powers, or of the spread, dB.
    pub size_db: f64,
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
    /// Its numbers by name, fitted together with everything else.
    pub parameters: Parameters,
    /// Why it was added.
    pub evidence: Evidence,
}

/// Errors on held-out patches without and with the effects.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BeforeAfter {
    /// Base model, refitted.
    pub before: Errors,
    /// With the effects.
    pub after: Errors,
    /// The rmse of a model that is right, dB.
    pub noise_floor_db: f64,
    /// (before − after)/(before − floor) of the squared rmse; none where before is at the floor.
    pub explained_share: Option<f64>,
    /// Folds that the patches were dealt out to.
    pub folds: usize,
    /// Patches.
    pub blocks: usize,
    /// Always: no look was predicted by a fit that it took part in.
    pub held_out: bool,
}

/// A law's number as fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseValue {
    /// First region whose law it is.
    pub region: usize,
    /// Its name.
    pub name: String,
    /// The number.
    #[serde(flatten)]
    pub value: Value,
}

/// What the effects are added to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Base {
    /// The laws' numbers, as fitted with the effects.
    pub parameters: Vec<BaseValue>,
    /// Looks of speckle, as declared.
    pub looks: f64,
    /// Threshold, dBm, as declared.
    pub threshold_dbm: f64,
    /// Which pose was used.
    pub pose: &'static str,
    /// Whether the final fit converged.
    pub converged: bool,
}

/// The smallest effect that these data would reveal.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Power {
    /// Effect.
    pub name: &'static str,
    /// Size, dB, from which it would be seen; none where these data never show it.
    pub least_db: Option<f64>,
    /// Whether an effect of twice that size, put into drawn data, was found again.
    pub recovered: Option<bool>,
}

/// What the answer is to be held against.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Controls {
    /// Largest held-out gain in ln p, and its standard error, of a random smooth field with as many
    /// numbers as the best effect.
    pub placebo: Option<Control>,
    /// The same of a spline over the best covariate.
    pub equal_df_spline: Option<Control>,
    /// For every effect, the size that would be seen.
    pub injection_recovery: Vec<Power>,
}

/// A term that means nothing, beside one that is claimed to.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Control {
    /// Its numbers.
    pub numbers: usize,
    /// What it goes over.
    pub over: String,
    /// Gain in ln likelihood over the base.
    pub gain: f64,
    /// Gain in ln p of held-out patches.
    pub held_out_gain: f64,
    /// Its standard error.
    pub held_out_se: f64,
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
    /// Incidence, degrees.
    pub theta_deg: f64,
    /// Azimuth of the radar about the normal, degrees.
    pub azimuth_deg: f64,
    /// Range of the mesh, m.
    pub range_m: f64,
    /// Measured less predicted range with the effects, m; none where there is no range.
    pub range_residual_m: Option<f64>,
    /// x in the target plane, m.
    pub xt_m: f64,
    /// y in the target plane, m.
    pub yt_m: f64,
    /// Distance to the nearest edge in depth, m, at most three spots.
    pub edge_m: f64,
    /// Time, s.
    pub time_s: f64,
    /// Region, from 0.
    pub region: u16,
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
    /// What the answer is to be held against.
    pub controls: Controls,
    /// What the effects are added to.
    pub base: Base,
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
    /// Points that cannot be given to their chirps.
    #[error(
        "the cloud has no chirp numbers and the rays of the scan do not start from one point; export \
         the cloud with a column `chirp`"
    )]
    Unnumbered,
    /// A cloud of something else.
    #[error(
        "{matched} of the cloud's {points} points lie where the scan meets the mesh; check the scene, \
         its pose and the frame and unit of the cloud, or register it with `matdb measure`"
    )]
    Elsewhere {
        /// Points on the mesh.
        matched: usize,
        /// Points.
        points: usize,
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
    /// Least gain in ln likelihood of an effect with so many numbers, tried from so many starts: about
    /// as rare by chance as the one of a single number.
    fn least_gain_of(&self, numbers: usize, starts: usize) -> f64 {
        self.least_gain + 1.2 * (numbers as f64 - 1.0) + (0.25 * starts as f64).max(1.0).ln()
    }

    /// Diagnoses a scan, trying these effects.
    ///
    /// # Errors
    /// When the data are too few to tell anything, or something declared has no meaning.
    pub fn run(&self, subject: &Subject, effects: &[&dyn Effect]) -> Result<Report, DiagnoseError> {
        let Subject { stage, laws, at_work, receiver, declared, .. } = *subject;
        let Subject { looks, observations, false_alarms, .. } = *subject;
        let folds = Folds::new(looks, self.block_m, self.folds, self.seed);
        check(subject, &folds)?;
        let surveys = &Surveys::default();
        let problem = Problem { stage, looks, observations, declared, receiver, surveys };
        let selection = Selection { problem, folds: &folds, settings: self };
        let base = selection.base(Space::new(&problem, laws, at_work)?);
        let (before, z_before) = (base.held_out.clone(), self.z(&problem, &base));
        let Selected { state, ranking, added, structure } = selection.run(base.clone(), effects);
        let numbers = ranking.first().map_or(1, |candidate| candidate.numbers);
        let controls = controls::controls(&selection, &base, effects, numbers);
        let z_after = self.z(&problem, &state);
        let prediction = problem.predict(&state.space, &state.fitted.at);
        let largest_db = added.iter().map(|a| a.evidence.size_db).fold(0.0, f64::max);
        let covariates = covariates(looks, &prediction, observations);
        let mut unexplained =
            self.tests(largest_db).run(&z_after, looks, &prediction, &covariates, &folds);
        if selection.is_structured(&structure, largest_db) {
            unexplained.extend(residual::of_field(&structure));
        }
        let sd_db = residual::speckle_sd_db(prediction.receiver.looks);
        let neighbours =
            residual::of_neighbours(&z_after, looks, stage.radar.spot_diameter_m, sd_db, &folds);
        if selection.is_shared(&neighbours, largest_db) {
            unexplained.push(neighbours);
        }
        unexplained.extend(residual::outliers(
            &z_after,
            &prediction,
            declared,
            observations,
            false_alarms,
        ));
        unexplained.extend(residual::steps(observations));
        unexplained.sort_by(|a, b| b.strength_db.total_cmp(&a.strength_db));
        let (parameters, effects) = values(&problem, &state, added);
        let error = before_after(score::errors(&before), score::errors(&state.held_out), &folds);
        let base = Base {
            parameters,
            looks: receiver.looks,
            threshold_dbm: dbm_from_watts(declared.threshold_w),
            pose: "as the scene has it",
            converged: state.fitted.converged,
        };
        Ok(Report {
            schema: SCHEMA,
            verdict: verdict(&unexplained, &effects),
            effects,
            ranking,
            unexplained,
            error,
            controls,
            base,
            laws: state.space.model(receiver, &state.fitted.at).laws,
            rows: rows(
                subject,
                &prediction,
                &folds,
                [&before, &state.held_out],
                [&z_before, &z_after],
            ),
        })
    }

    fn z(&self, problem: &Problem, state: &select::State) -> Vec<f64> {
        let prediction = problem.predict(&state.space, &state.fitted.at);
        residual::z(&prediction, problem.declared, problem.observations, self.seed)
    }

    fn tests(&self, largest_db: f64) -> Tests {
        let Diagnosis { seed, draws, block_m, family_error, .. } = *self;
        let least_size_db = self.least_size_db.max(select::SHARE_OF_FORM * largest_db);
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
    prediction: &Prediction,
    folds: &Folds,
    [before, after]: [&[score::Scored]; 2],
    [z_before, z_after]: [&[f64]; 2],
) -> Vec<Row> {
    let row = |index: usize| {
        let seen = subject.observations.get(index)?;
        let look = subject.looks.get(index)?;
        let arrived = prediction.arrived.get(index).copied().flatten();
        Some(Row {
            chirp: look.chirp,
            observed_dbm: seen.power_w.map(dbm_from_watts),
            before_dbm: before.get(index)?.expected_dbm,
            after_dbm: after.get(index)?.expected_dbm,
            z_before: *z_before.get(index)?,
            z_after: *z_after.get(index)?,
            fold: *folds.fold.get(index)?,
            theta_deg: look.hit.theta_rad().to_degrees(),
            azimuth_deg: look.azimuth_rad.to_degrees(),
            range_m: look.hit.range_m,
            range_residual_m: seen.range_m.zip(arrived).map(|(seen_m, a)| seen_m - a.range_m),
            xt_m: look.xt_m,
            yt_m: look.yt_m,
            edge_m: look.edge_m,
            time_s: look.time_s,
            region: look.region,
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
    let sd = problem.sd(space, at);
    let finite = |sd: f64| sd.is_finite().then_some(sd);
    let base = space.base_values(at).into_iter().zip(&sd);
    let base = base.map(|((region, name, value, slope), sd)| BaseValue {
        region,
        name,
        value: Value { value, sd: finite(sd * slope), unit: "1" },
    });
    let mut sds = sd.iter().skip(space.base_len());
    let effects = space.effects.iter().zip(space.effect_values(at)).zip(added);
    let found = effects.map(|((effect, values), added)| {
        let knobs = effect.knobs().iter().zip(values).zip(sds.by_ref());
        let value = |((knob, value), sd): ((&Knob, f64), &f64)| {
            (knob.name, Value { value, sd: finite(sd * knob.step), unit: knob.unit })
        };
        let parameters = Parameters::new(knobs.map(value).collect(), problem.looks);
        let select::Added { class, evidence } = added;
        Found { name: effect.name(), level: effect.level(), class, parameters, evidence }
    });
    let found = found.collect();
    (base.collect(), found)
}

fn before_after(before: Errors, after: Errors, folds: &Folds) -> BeforeAfter {
    let noise_floor_db = after.noise_floor_db;
    let excess = before.rmse_db.powi(2) - noise_floor_db.powi(2);
    let removed = before.rmse_db.powi(2) - after.rmse_db.powi(2);
    let explained_share = (excess > 0.0).then_some(removed / excess);
    let Folds { folds, blocks, .. } = *folds;
    BeforeAfter { before, after, noise_floor_db, explained_share, folds, blocks, held_out: true }
}
