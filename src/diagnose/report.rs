//! What a diagnosis says: most of the schema of `report.json`.

use std::collections::BTreeMap;

use serde::Serialize;

use super::{Candidate, Errors, Unexplained};
use crate::brdf::Brdf;
use crate::effects::{Effect, Level, Place, Shot};

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

impl Verdict {
    /// The verdict where effects were added or not, and structure is left or not.
    pub(super) fn new(is_extended: bool, is_unexplained: bool) -> Verdict {
        match (is_extended, is_unexplained) {
            (_, true) => Verdict::Unexplained,
            (true, false) => Verdict::Explained,
            (false, false) => Verdict::NoMissingEffect,
        }
    }
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
    /// `centre_m` of a place on the target, and `extent_m`, the sides of the box whose middle that is, where it is no ball.
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
            let [x, y, z] = axes.map(|axis| numbers.get(effect.parameters()[axis].name));
            if let (Some(x), Some(y), Some(z)) = (x, y, z) {
                let sd = x.sd.zip(y.sd).zip(z.sd).map(|((x, y), z)| [x, y, z]);
                let value = [x.value, y.value, z.value];
                triples.insert(*name, Triple { value, sd, unit: x.unit });
            }
        }
        if let Some((centre, extent)) = place.and_then(|place| place.on_target_m(shots)) {
            let told = [("centre_m", Some(centre)), ("extent_m", extent)];
            for (name, value) in told.into_iter().filter_map(|(name, at)| Some((name, at?))) {
                triples.insert(name, Triple { value: value.to_array(), sd: None, unit: "m" });
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
    /// The gain of a placebo with as many numbers, but at most six.
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
    /// The part of the target where it acts; none where it acts everywhere.
    #[serde(skip)]
    pub place: Option<Place>,
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
    /// With the effects and the smooth term of what is unknown, which has not seen a patch that it is judged
    /// on either; none where nothing of that kind is left.
    pub with_unknown: Option<Errors>,
    /// The rmse of a model that is right, dB.
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

/// A law's number as fitted.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BaseValue {
    /// Region whose law it is.
    pub region: usize,
    /// Its name.
    pub name: String,
    /// The number.
    #[serde(flatten)]
    pub value: Value,
}

/// Where a mesh stands in the global frame.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeshPose {
    /// Its name.
    pub mesh: String,
    /// Turns about x, y and z, deg.
    pub rotation_deg: [f64; 3],
    /// Shift, m.
    pub translation_m: [f64; 3],
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
    /// Thermal noise, dBm, as declared; none where there is none.
    pub noise_dbm: Option<f64>,
    /// Standard deviation of a range, m, as declared; 0 where ranges are not used.
    pub range_sd_m: f64,
    /// Where the meshes stand, as declared; a diagnosis leaves them there.
    pub pose: Vec<MeshPose>,
    /// Whether the final fit converged.
    pub converged: bool,
}

/// From which size on an effect was found that was put into data drawn by the base model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Power {
    /// Effect.
    pub name: &'static str,
    /// The smallest size, dB left when the laws are refitted, that was found; none where none was.
    pub least_db: Option<f64>,
    /// The largest size below it, dB, that was not found; none where all were.
    pub missed_db: Option<f64>,
}

/// What the answer is to be held against.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Controls {
    /// Held-out gain in ln p, and its standard error, of a random smooth field with as many numbers as the
    /// first effect that was added, or else as the one that gained most.
    pub placebo: Option<Control>,
    /// The same of a spline over the best covariate.
    pub equal_df_spline: Option<Control>,
    /// For every effect, the size from which it was found again.
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

/// One shot, as a table of residuals has it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Row {
    /// Chirp number.
    pub chirp: u32,
    /// Received power, dBm; none where nothing was detected.
    pub observed_dbm: Option<f64>,
    /// E[dBm | detected] of the base model, from a fit without this shot's fold.
    pub before_dbm: f64,
    /// The same with the effects.
    pub after_dbm: f64,
    /// Randomised quantile residual of the base model, fitted to all shots.
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
    /// What a smooth field over all covariates, fitted without this shot's fold, would add to the mean
    /// power of the final model, dB; 0 where such a field finds nothing.
    pub unknown_db: f64,
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
    /// Detections that lie elsewhere than their chirps meet the target: set aside, and their chirps count as
    /// silent.
    pub set_aside: usize,
    /// What the answer is to be held against.
    pub controls: Controls,
    /// What the effects are added to.
    pub base: Base,
    /// The laws of every region as fitted with the effects.
    #[serde(skip)]
    pub laws: Vec<Brdf>,
    /// Every shot.
    #[serde(skip)]
    pub rows: Vec<Row>,
}

impl Report {
    /// The effects that were tried and neither found nor as good as one that was, each as the last round that
    /// tried it saw it.
    pub fn not_found(&self) -> impl Iterator<Item = &Candidate> {
        self.ranking.iter().enumerate().filter_map(|(place, tried)| {
            let mut later = self.ranking.iter().skip(place + 1);
            let is_last = !later.any(|later| later.name == tried.name);
            (is_last && !self.has_found(tried.name)).then_some(tried)
        })
    }

    /// Whether an effect was found, or one from which the data cannot tell it apart.
    fn has_found(&self, name: &str) -> bool {
        self.effects.iter().any(|effect| effect.name == name || effect.class.contains(&name))
    }
}
