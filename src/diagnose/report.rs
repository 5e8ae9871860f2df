//! The report of a diagnosis: most of the schema of `report.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::alarms::FalseAlarms;
use super::evidence::{Candidate, Evidence, from_one};
use super::residual::ResidualStructure;
use super::score::Errors;
use crate::brdf::Brdf;
use crate::effects::{Effect, Level, Place, Shot};
use crate::frames::{Global, Point, Pose};

/// Version of a report as JSON.
pub const SCHEMA: u32 = 3;

/// The answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// The base model explains the data.
    NoMissingEffect,
    /// The base model with the added effects explains the data.
    Explained,
    /// Structure remains that no effect explains.
    Unexplained,
    /// Several clouds contradict each other: no one model is right for all of them.
    Contradictory,
}

impl Verdict {
    /// The verdict on a model with or without effects, which leaves structure or not.
    pub(super) fn new(has_effects: bool, has_unexplained: bool) -> Verdict {
        if has_unexplained {
            Verdict::Unexplained
        } else if has_effects {
            Verdict::Explained
        } else {
            Verdict::NoMissingEffect
        }
    }
}

/// A number and its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Value {
    /// Value.
    pub value: f64,
    /// Standard deviation; none where a bound holds the number or the data do not determine it.
    pub sd: Option<f64>,
    /// UCUM code of its unit; 1 for a pure number.
    pub unit: &'static str,
}

/// A vector, such as a place.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Triple {
    /// Values along x, y and z.
    pub value: [f64; 3],
    /// Their standard deviations; none where the vector follows from other numbers.
    pub sd: Option<[f64; 3]>,
    /// UCUM code of their unit.
    pub unit: &'static str,
}

/// The parameters of an effect by name.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Parameters {
    /// Those that were fitted.
    #[serde(flatten)]
    pub numbers: BTreeMap<&'static str, Value>,
    /// Vectors in the global frame: `translation_m` and `rotation_deg` of a pose,
    /// `centre_m` of a place on the target, and `extent_m`, the sides of the box about that centre, unless the place
    /// is a ball.
    #[serde(flatten)]
    pub triples: BTreeMap<&'static str, Triple>,
}

impl Parameters {
    pub(super) fn new(
        effect: &dyn Effect,
        numbers: BTreeMap<&'static str, Value>,
        place: Option<Place>,
        shots: &[Shot],
    ) -> Parameters {
        let mut triples = BTreeMap::new();
        for (name, axes) in effect.vectors() {
            let axes = axes.map(|axis| numbers.get(effect.parameters()[axis].name));
            if let [Some(x), Some(y), Some(z)] = axes {
                let sd = x.sd.zip(y.sd).zip(z.sd).map(|((x, y), z)| [x, y, z]);
                let value = [x.value, y.value, z.value];
                triples.insert(*name, Triple { value, sd, unit: x.unit });
            }
        }
        if let Some((centre, extent)) = place.and_then(|place| place.on_target_m(shots)) {
            for (name, at) in [("centre_m", Some(centre)), ("extent_m", extent)] {
                triples.extend(
                    at.map(|at| (name, Triple { value: at.to_array(), sd: None, unit: "m" })),
                );
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

/// An effect that was added.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FoundEffect {
    /// Its name.
    pub name: &'static str,
    /// The level it belongs to.
    pub level: Level,
    /// Scans on which it acts, of several that are diagnosed together; empty for all.
    #[serde(rename = "clouds", serialize_with = "from_one", skip_serializing_if = "Vec::is_empty")]
    pub scans: Vec<u16>,
    /// Effects that predict the data as well.
    pub class: Vec<&'static str>,
    /// Its parameters by name, fitted together with everything else.
    pub parameters: Parameters,
    /// The part of the target where it acts; none where it acts everywhere.
    #[serde(skip)]
    pub place: Option<Place>,
    /// From where the scene has the target to where the effect places it: as the scan meets it first and as it meets it last,
    /// or once where these agree; empty for an effect that moves nothing.
    #[serde(skip)]
    pub motions: Vec<Pose<Global, Global>>,
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
    /// With the effects and a smooth field of unknown origin, fitted without the patch that it is judged
    /// on; none where no such structure remains.
    pub with_unknown: Option<Errors>,
    /// The rmse of a correct model, dB.
    pub noise_floor_db: f64,
    /// (before − after)/(before − floor) of the squared rmse; none where before is at the floor.
    pub explained_share: Option<f64>,
    /// Folds that the patches were dealt out to.
    pub folds: usize,
    /// Patches.
    pub blocks: usize,
    /// Always: no shot was predicted by a fit that it took part in.
    pub held_out: bool,
}

/// A parameter of a scattering model, as fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseValue {
    /// Region with that scattering model.
    pub region: usize,
    /// Its name.
    pub name: String,
    /// Its value.
    #[serde(flatten)]
    pub value: Value,
}

/// Pose of a mesh in the global frame, in the units of `report.json`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshPose {
    /// Its name.
    pub mesh: String,
    /// Turns about x, y and z, deg.
    pub rotation_deg: [f64; 3],
    /// Shift, m.
    pub translation_m: [f64; 3],
}

/// The model that the effects are added to.
#[derive(Clone, Debug, PartialEq)]
pub struct Base {
    /// Parameters of the scattering models, as fitted with the effects.
    pub parameters: Vec<BaseValue>,
    /// Level of the radar over the one that its settings state, dB; none for a radar that was calibrated.
    pub level_db: Option<Value>,
    /// Looks of speckle, as declared.
    pub looks: f64,
    /// Threshold, W, as declared.
    pub threshold_w: f64,
    /// Thermal noise, W, as declared; 0 for a receiver without noise.
    pub noise_w: f64,
    /// Standard deviation of a range, m, as declared; 0 where ranges are not used.
    pub range_sd_m: f64,
    /// Poses of the meshes, as declared; a diagnosis does not change them.
    pub pose: Vec<MeshPose>,
    /// Whether the final fit converged.
    pub converged: bool,
}

/// The size from which on an effect was found in data that the base model simulated with it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Power {
    /// Effect.
    pub name: &'static str,
    /// Scans on which it acts, of several that are diagnosed together; empty for all.
    #[serde(rename = "clouds", serialize_with = "from_one", skip_serializing_if = "Vec::is_empty")]
    pub scans: Vec<u16>,
    /// The smallest size that was found, dB remaining after a refit of the scattering models; none where none was.
    pub least_db: Option<f64>,
    /// The largest size below it that was not found, dB; none where all were found.
    pub missed_db: Option<f64>,
}

/// Controls of the answer.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Controls {
    /// A random smooth field with as many parameters as the first effect that was added, or else as the one that
    /// gained most.
    pub placebo: Option<Control>,
    /// A spline with as many parameters over the best covariate.
    pub equal_df_spline: Option<Control>,
    /// For every effect, the size from which on it was found.
    pub injection_recovery: Vec<Power>,
}

/// A term without a physical meaning.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Control {
    /// Number of its parameters.
    pub numbers: usize,
    /// What it depends on.
    pub over: String,
    /// Gain in ln likelihood over the base.
    pub gain: f64,
    /// Gain in ln p of held-out patches.
    pub held_out_gain: f64,
    /// Its standard error.
    pub held_out_se: f64,
}

/// One shot in the table of residuals.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Number of its cloud, from 0.
    pub scan: u16,
    /// Chirp number.
    pub chirp: u32,
    /// Received power, W; none where nothing was detected.
    pub observed_w: Option<f64>,
    /// Geometric mean of the power of a detection, W, by the base model, from a fit without this shot's fold.
    pub before_w: f64,
    /// Geometric mean of the power of a detection, W, by the model with the effects, from a fit without this shot's
    /// fold.
    pub after_w: f64,
    /// Randomised quantile residual of the base model, fitted to all shots.
    pub z_before: f64,
    /// Randomised quantile residual of the model with the effects, fitted to all shots.
    pub z_after: f64,
    /// Fold that the shot was held out with.
    pub fold: usize,
    /// Incidence angle, rad.
    pub theta_rad: f64,
    /// Azimuth of the radar about the normal, rad.
    pub azimuth_rad: f64,
    /// Range of the mesh, m.
    pub range_m: f64,
    /// Measured range, m: half of the way to the antenna; none where there is no range.
    pub measured_range_m: Option<f64>,
    /// Where the cloud has the detection; none where nothing was detected.
    pub point: Option<Point<Global>>,
    /// Place of the detection among those of its chirp, by power: 1 is the strongest; none where nothing was detected, or
    /// where chirps report one detection at most.
    pub rank: Option<u32>,
    /// Measured less predicted range with the effects, m; none where there is no range.
    pub range_residual_m: Option<f64>,
    /// x in the target plane, m; of several clouds in that of the first, where its antenna sees the same point of the target.
    pub xt_m: f64,
    /// y in the target plane, m, as `xt_m`.
    pub yt_m: f64,
    /// Distance to the nearest edge in depth, m, at most three spots.
    pub edge_m: f64,
    /// Time, s.
    pub time_s: f64,
    /// Region, from 0.
    pub region: u16,
    /// Change of the mean power of the final model, dB, by a smooth field over all covariates that was fitted without
    /// this shot's fold; 0 where such a field finds nothing.
    pub unknown_db: f64,
}

/// What one of several clouds has in a joint diagnosis.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CloudPart {
    /// Its name.
    pub name: String,
    /// Its chirps that meet the target.
    pub chirps: usize,
    /// Those of them that were detected.
    pub detected: usize,
    /// Level of its radar over the one that its settings state, dB; none for a radar that was calibrated.
    pub level_db: Option<Value>,
    /// Errors on its held-out patches, by the base model.
    pub before: Errors,
    /// Errors on its held-out patches, with the effects.
    pub after: Errors,
}

/// A cloud that contradicts the others.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Contradiction {
    /// Number of the cloud, from 1.
    pub cloud: usize,
    /// The effect that the clouds together support and this one excludes; none where it needs other laws than the rest.
    pub effect: Option<&'static str>,
    /// Change of ln p of its held-out patches by that effect, or by laws of its own.
    pub gain: f64,
    /// Its standard error.
    pub se: f64,
    /// Change of its mean powers, or of the data, root mean square, dB.
    pub size_db: f64,
}

/// The report.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Report {
    /// Version of the schema.
    pub schema: u32,
    /// The answer.
    pub verdict: Verdict,
    /// Effects in the order in which they were added.
    pub effects: Vec<FoundEffect>,
    /// Every effect of every round.
    pub ranking: Vec<Candidate>,
    /// Structure that no effect explains.
    pub unexplained: Vec<ResidualStructure>,
    /// Errors on held-out patches.
    pub error: BeforeAfter,
    /// Detections away from where their chirps meet the target. They are set aside, and their chirps count as
    /// silent.
    pub set_aside: usize,
    /// Those of them that lie beside an edge of the target, within the reach of the radar's beam.
    pub beside_edge: usize,
    /// Detections that noise alone makes. They are not among those set aside.
    pub false_alarms: FalseAlarms,
    /// Effective number of independent chirps on the target: fewer than there are where neighbours share speckle.
    pub independent_chirps: f64,
    /// Controls of the answer.
    pub controls: Controls,
    /// What each of several clouds has; empty for one cloud.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub clouds: Vec<CloudPart>,
    /// Why several clouds contradict each other.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub contradictions: Vec<Contradiction>,
    /// The model that the effects are added to.
    #[serde(skip)]
    pub base: Base,
    /// The scattering model of every region as fitted with the effects.
    #[serde(skip)]
    pub laws: Vec<Brdf>,
    /// Every shot.
    #[serde(skip)]
    pub rows: Vec<Row>,
}

impl Report {
    /// The effects that were tried and are neither among those found nor equally good, each as in the last round that
    /// tried it.
    pub fn not_found(&self) -> impl Iterator<Item = &Candidate> {
        self.ranking.iter().enumerate().filter_map(|(place, tried)| {
            let mut later = self.ranking.iter().skip(place + 1);
            let is_last = !later.any(|later| later.is_same(tried));
            (is_last && !self.has_found(tried)).then_some(tried)
        })
    }

    /// Whether an effect was found, or one that predicts the data equally well.
    fn has_found(&self, tried: &Candidate) -> bool {
        self.effects.iter().any(|effect| {
            (effect.name == tried.name && effect.scans == tried.scans)
                || effect.class.contains(&tried.name)
        })
    }
}
