//! A measured cloud → the physical effect that the model lacks, or that it lacks none, or that what
//! it lacks is unknown.
//!
//! The observation model comes first (`likelihood.rs`): speckle, thermal noise, and chirps that should
//! have been detected and were not. The base laws are refitted, so that "before" is the best that can
//! be had without the effect. A score test screens the library on a sample of the shots; the best few are
//! fitted with the base and must predict patches of the scan that took no part in their fit. When none
//! is left that does, effects that the others made superfluous are taken away, and what remains is
//! looked at: by a smooth field over every covariate, by what neighbours have in common, by the
//! scatter, by outliers.
//!
//! | step | file |
//! |---|---|
//! | from a scene and its cloud to a report | `scan.rs` |
//! | every chirp against the target, the cloud against the chirps | `shots.rs` |
//! | probability of what was seen | `likelihood.rs` |
//! | base and effects together | `refit.rs` |
//! | what an effect promises | `screen.rs` |
//! | held-out patches, selection, what counts as support, rivals held against each other | `folds.rs`, `select.rs`, `support.rs`, `exchange.rs` |
//! | what remains | `covariates.rs`, `field.rs`, `residual.rs` |
//! | what is said in the end | `report.rs` |
//! | how large the error is, and what the answer is to be held against | `score.rs`, `controls.rs`, `placebo.rs` |
//! | the same of a measured curve | `curve/` |

mod controls;
mod covariates;
pub mod curve;
mod exchange;
mod field;
mod folds;
mod likelihood;
mod shots;
mod placebo;
mod ranges;
mod refit;
mod report;
mod residual;
mod scan;
mod score;
mod screen;
mod select;
mod support;
#[cfg(test)]
mod tests;
mod trial;

use serde::Serialize;
use thiserror::Error;

use crate::brdf::Brdf;
use crate::effects::{Effect, EffectParameter, Prediction, PredictionCache, Receiver, Shot, Stage};
use crate::fit::FitError;
use crate::render::RenderError;
use crate::units::dbm_from_watts;

pub use folds::Folds;
pub use likelihood::Declared;
pub(crate) use refit::LEAST_SHOTS;
pub use report::{
    Base, BaseValue, BeforeAfter, Control, Controls, Evidence, Found, MeshPose, Parameters, Power,
    Report, Row, Triple, Value, Verdict,
};
pub use residual::Unexplained;
pub use scan::{MeasuredScene, declared_receiver};
pub use score::Errors;
pub use select::Candidate;
pub use shots::{CloudMatch, Observation, Stray, match_cloud, trace_shots};

use covariates::covariates;
use refit::{Problem, Space};
use residual::Tests;
use screen::Sample;
use select::{Selected, Selection};
use support::Largest;

/// Version of a report as JSON.
pub const SCHEMA: u32 = 3;

/// Times the noise floor beyond which a target is another one: what no effect explains leaves less than two.
const MOST_FLOORS: f64 = 3.0;
/// Detections without which nothing is said.
const LEAST_DETECTIONS: usize = 300;
/// Share of detections below the threshold that may be the rounding of a file.
const MOST_BELOW: f64 = 0.01;
/// By how much these are below it, ratio of powers.
const BELOW: f64 = 0.999;
/// Share of chirps far off the refitted model, from which no effect explains them.
const MOST_WILD: f64 = 0.25;
/// Patches without which held-out scores have no standard error worth the name.
const LEAST_BLOCKS: usize = 15;

/// Settings of a diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Diagnosis {
    /// Seed of folds, placebos and randomised residuals.
    pub seed: u64,
    /// Side of the patches that are held out together, m at 8 m; three correlation lengths or more. 0.05:
    /// three spots of 16 mm.
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
    /// Probability that the tests of the scatter find something in a complete model, all together.
    pub family_error: f64,
    /// Random signs drawn for each residual test.
    pub draws: usize,
}

impl Diagnosis {
    /// For a spot of this diameter, m at 8 m: patches are three of a large one.
    pub fn for_spot(diameter_m: f64) -> Diagnosis {
        let usual = Diagnosis::default();
        Diagnosis { block_m: usual.block_m.max(3.0 * diameter_m), ..usual }
    }
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
    pub shots: &'a [Shot],
    /// What each of them saw.
    pub observations: &'a [Observation],
    /// Detections that are no shot's.
    pub strays: &'a [Stray],
    /// Where the meshes stand, to be told in the report.
    pub pose: &'a [MeshPose],
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
    /// Points on the rays of other chirps.
    #[error(
        "most points of the cloud lie on the rays of the chirps numbered {} {} than they say; number \
         them as the scene's scan does, from its first chirp on, or leave the column `chirp` out",
        .off.unsigned_abs(),
        if *.off > 0 { "lower" } else { "higher" }
    )]
    Misnumbered {
        /// How much too high their numbers are.
        off: i64,
    },
    /// Chirp numbers that are not those of the scan.
    #[error(
        "by their chirp numbers {matched} of the cloud's {points} points lie on the target, and by their \
         directions {placed}: the numbers are not those of the scene's scan; leave the column `chirp` out"
    )]
    Strange {
        /// Points on the target when directions tell their chirps.
        placed: usize,
        /// Points on the target when their numbers do.
        matched: usize,
        /// Points.
        points: usize,
    },
    /// Several detections of each chirp.
    #[error(
        "{second} of the cloud's {points} points are further ones of chirps that have one on the target \
         already; keep one point of each chirp"
    )]
    Repeated {
        /// Points of chirps that have one.
        second: usize,
        /// Points.
        points: usize,
    },
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
    /// Detections that the declared threshold forbids.
    #[error(
        "{below} of {detected} detections are weaker than the threshold of {threshold_dbm:.2} dBm that the \
         scene declares; correct `threshold_dbm` under [radar], or the powers of the cloud"
    )]
    Threshold {
        /// Detections below the threshold.
        below: usize,
        /// Detections.
        detected: usize,
        /// As declared, dBm.
        threshold_dbm: f64,
    },
    /// With everything that was found the model is still far off.
    #[error(
        "even with the effects that would fit best the model is off by {rmse_db:.1} dB, where speckle and noise leave \
         {noise_floor_db:.1} dB, as for another target; check mesh, pose and radar of the scene, or register the \
         cloud with `matdb measure`"
    )]
    FarOff {
        /// Rms error on held-out patches, dB.
        rmse_db: f64,
        /// That of a model that is right, dB.
        noise_floor_db: f64,
    },
    /// Effects that go with time, of a scan that does not tell it.
    #[error(
        "the scan of the scene has no times, and {effects} cannot be told without; give its chirps a column \
         `time_s`"
    )]
    Untimed {
        /// Their names.
        effects: String,
    },
    /// Effects that move the target, of a scene without an error of ranges.
    #[error(
        "the scene states no error of ranges, and {effects} cannot be told by powers alone; give `range_sd_m` \
         under [radar.noise]"
    )]
    Unranged {
        /// Their names.
        effects: String,
    },
    /// A law that fits nowhere.
    #[error(
        "the refitted model is far off at {wild} of {shots} chirps, as for another target or power \
         balance; check mesh, pose and radar of the scene, or register the cloud with `matdb measure`"
    )]
    Unlike {
        /// Chirps beyond 4.5 standard deviations.
        wild: usize,
        /// Chirps that meet the target.
        shots: usize,
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
        "the chirps on the target fill {blocks} patches and {LEAST_BLOCKS} are needed; scan a larger part of the target, \
         or a larger target"
    )]
    TooSmall {
        /// Patches.
        blocks: usize,
    },
    /// As many observations as shots are needed.
    #[error(
        "{observations} observations are not one for each of {shots} chirps on the target; match the cloud again"
    )]
    Unmatched {
        /// Observations.
        observations: usize,
        /// Shots.
        shots: usize,
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
        self.run_with(subject, effects, &|_| ())
    }

    /// The same; `hear` is told in a few words what is being done.
    ///
    /// # Errors
    /// As [`Diagnosis::run`].
    pub fn run_with(
        &self,
        subject: &Subject,
        effects: &[&dyn Effect],
        hear: &(dyn Fn(&str) + Sync),
    ) -> Result<Report, DiagnoseError> {
        let Subject { stage, laws, at_work, receiver, declared, .. } = *subject;
        let Subject { shots, observations, strays, .. } = *subject;
        let folds = Folds::new(shots, self.block_m, self.folds, self.seed);
        check(subject, &folds)?;
        let traced = &PredictionCache::default();
        let problem = Problem { stage, shots, observations, declared, receiver, traced };
        let sample = &Sample::new(&problem);
        let selection = Selection { problem, sample, folds: &folds, settings: self, hear };
        hear("refitting the base laws");
        let base = selection.base(Space::new(&problem, laws, at_work)?);
        let (before, z_before) = (base.held_out.clone(), self.z(&problem, &base));
        // Whether the target is another one is judged with much speckle: to find that there is some is
        // the task of an effect.
        let wide = Problem { receiver: select::wide(receiver), ..problem };
        let (wild, all) = (residual::wild(&self.z(&wide, &base)), shots.len());
        if wild as f64 > MOST_WILD * all as f64 {
            return Err(DiagnoseError::Unlike { wild, shots: all });
        }
        let Selected { state, ranking, added, structure } = selection.run(base.clone(), effects);
        let model = state.space.model(receiver, &state.fitted.at);
        // Those past the edge were let in for the sake of a wide spot, which may not have been found.
        let off = strays.iter().filter(|stray| !stray.is_on_target(&model, stage)).count();
        let points = strays.len() + observations.iter().filter(|o| o.power_w.is_some()).count();
        if off as f64 > shots::MOST_STRAYS * points as f64 {
            return Err(DiagnoseError::Elsewhere { matched: points - off, points });
        }
        let after = score::errors(&state.held_out, &folds);
        let Errors { rmse_db, noise_floor_db, .. } = after;
        if rmse_db > MOST_FLOORS * noise_floor_db {
            return Err(DiagnoseError::FarOff { rmse_db, noise_floor_db });
        }
        let first = ranking.iter().find(|candidate| candidate.accepted).or(ranking.first());
        let numbers = first.map_or(1, |candidate| candidate.numbers);
        hear("controls");
        let controls = controls::controls(&selection, &base, effects, numbers);
        let z_after = self.z(&problem, &state);
        let prediction = problem.predict(&state.space, &state.fitted.at);
        let largest_db = Largest::of(&added).size_db;
        let covariates = covariates(shots, &prediction, observations);
        hear("testing what is left");
        let mut unexplained =
            self.tests(largest_db).run(&z_after, shots, &prediction, &covariates, &folds);
        let is_structured = selection.is_structured(&structure, largest_db);
        if is_structured {
            unexplained.extend(residual::of_field(&structure));
        }
        let unknown: Vec<f64> = match is_structured {
            true => prediction.as_passed(&structure.ln_factor),
            false => Vec::new(),
        };
        let sd_db = residual::speckle_sd_db(prediction.receiver.looks);
        let neighbours = residual::of_neighbours(
            &z_after,
            shots,
            stage.geometry.radar.spot_diameter_m,
            sd_db,
            &folds,
        );
        if selection.is_shared(&neighbours, largest_db) {
            unexplained.push(neighbours);
        }
        unexplained.extend(residual::outliers(&z_after, &prediction, declared, observations, off));
        unexplained.extend(residual::steps(observations));
        unexplained.extend(residual::lopsided(&z_after, sd_db));
        unexplained.sort_by(|a, b| b.strength_db.total_cmp(&a.strength_db));
        let (parameters, effects) = values(&problem, &state, added);
        let with_unknown = is_structured
            .then(|| selection.held_out_with(&state.space, &state.fitted.at, &structure.ln_factor));
        let errors = |scored: &[score::Scored]| score::errors(scored, &folds);
        let error =
            before_after([errors(&before), after], with_unknown.as_deref().map(errors), &folds);
        let base = Base {
            parameters,
            looks: receiver.looks,
            threshold_dbm: dbm_from_watts(declared.threshold_w),
            noise_dbm: (receiver.noise_w > 0.0).then(|| dbm_from_watts(receiver.noise_w)),
            range_sd_m: declared.range_sd_m,
            pose: subject.pose.to_vec(),
            converged: state.fitted.converged,
        };
        Ok(Report {
            schema: SCHEMA,
            verdict: Verdict::new(!effects.is_empty(), !unexplained.is_empty()),
            effects,
            ranking,
            unexplained,
            error,
            set_aside: strays.len(),
            controls,
            base,
            laws: model.laws,
            rows: rows(
                subject,
                &prediction,
                &folds,
                [&before, &state.held_out],
                [&z_before, &z_after],
                &unknown,
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

fn rows(
    subject: &Subject,
    prediction: &Prediction,
    folds: &Folds,
    [before, after]: [&[score::Scored]; 2],
    [z_before, z_after]: [&[f64]; 2],
    ln_unknown: &[f64],
) -> Vec<Row> {
    let row = |index: usize| {
        let seen = subject.observations.get(index)?;
        let shot = subject.shots.get(index)?;
        let arrived = prediction.arrived.get(index).copied().flatten();
        Some(Row {
            chirp: shot.chirp,
            observed_dbm: seen.power_w.map(dbm_from_watts),
            before_dbm: before.get(index)?.expected_dbm,
            after_dbm: after.get(index)?.expected_dbm,
            z_before: *z_before.get(index)?,
            z_after: *z_after.get(index)?,
            fold: *folds.fold.get(index)?,
            theta_deg: shot.hit.theta_rad().to_degrees(),
            azimuth_deg: shot.azimuth_rad.to_degrees(),
            range_m: shot.hit.range_m,
            range_residual_m: seen.range_m.zip(arrived).map(|(seen_m, a)| seen_m - a.range_m),
            xt_m: shot.xt_m,
            yt_m: shot.yt_m,
            edge_m: shot.edge_m,
            time_s: shot.time_s,
            region: shot.region,
            unknown_db: score::DB * ln_unknown.get(index).copied().unwrap_or(0.0),
        })
    };
    (0..subject.shots.len()).filter_map(row).collect()
}

fn check(subject: &Subject, folds: &Folds) -> Result<(), DiagnoseError> {
    let (observations, shots) = (subject.observations.len(), subject.shots.len());
    if observations != shots {
        return Err(DiagnoseError::Unmatched { observations, shots });
    }
    if !(0.1..=1e4).contains(&subject.receiver.looks) {
        return Err(DiagnoseError::Looks { looks: subject.receiver.looks });
    }
    let detected = subject.observations.iter().filter(|o| o.power_w.is_some()).count();
    if detected < LEAST_DETECTIONS {
        return Err(DiagnoseError::TooFew { detected });
    }
    let threshold_w = subject.declared.threshold_w;
    let is_below = |o: &&Observation| o.power_w.is_some_and(|w| w < BELOW * threshold_w);
    let below = subject.observations.iter().filter(is_below).count();
    if below as f64 > MOST_BELOW * detected as f64 {
        let threshold_dbm = dbm_from_watts(threshold_w);
        return Err(DiagnoseError::Threshold { below, detected, threshold_dbm });
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
    let laws = space.model(problem.receiver, at).laws;
    let base = base.map(|((region, name, value, slope), sd)| {
        let parameters = laws.get(region).map_or(Vec::new(), Brdf::parameters);
        let unit =
            parameters.iter().find(|known| known.path == name).map_or("1", |known| known.unit);
        BaseValue { region, name, value: Value { value, sd: finite(sd * slope), unit } }
    });
    let mut sds = sd.iter().skip(space.base_len());
    let effects = space.effects.iter().zip(space.effect_values(at)).zip(added);
    let found = effects.map(|((effect, values), added)| {
        let place = effect.place(&values);
        let knobs = effect.parameters().iter().zip(values).zip(sds.by_ref());
        let value = |((knob, value), sd): ((&EffectParameter, f64), &f64)| {
            (knob.name, Value { value, sd: finite(sd * knob.step), unit: knob.unit })
        };
        let parameters = Parameters::new(*effect, knobs.map(value).collect(), place, problem.shots);
        let select::Added { class, evidence, .. } = added;
        Found { name: effect.name(), level: effect.level(), class, parameters, place, evidence }
    });
    let found = found.collect();
    (base.collect(), found)
}

fn before_after(
    [before, after]: [Errors; 2],
    with_unknown: Option<Errors>,
    folds: &Folds,
) -> BeforeAfter {
    let noise_floor_db = after.noise_floor_db;
    let excess = before.rmse_db.powi(2) - noise_floor_db.powi(2);
    let removed = before.rmse_db.powi(2) - after.rmse_db.powi(2);
    let is_above = before.rmse_db > score::AT_THE_FLOOR * noise_floor_db;
    let explained_share = is_above.then_some(removed / excess);
    let Folds { folds, blocks, .. } = *folds;
    BeforeAfter {
        before,
        after,
        with_unknown,
        noise_floor_db,
        explained_share,
        folds,
        blocks,
        held_out: true,
    }
}
