//! What a physical effect is.

use std::any::Any;

use super::echo::MeanEcho;
use super::place::Place;
use super::receiver::Receiver;
use super::shot::{Shot, Stage};
use crate::brdf::Brdf;
use crate::frames::{Global, Pose};

/// A physical effect that the base model lacks.
///
/// `values` are those of [`parameters`](Effect::parameters), in their order and within their ranges.
pub trait Effect: Sync {
    /// Its name, parameters, words and conflicts.
    fn about(&self) -> &About;

    /// Its name, as reports and scenes write it.
    fn name(&self) -> &'static str {
        self.about().name
    }

    /// Where it belongs.
    fn level(&self) -> Level {
        self.about().level
    }

    /// Its numbers.
    fn parameters(&self) -> &'static [EffectParameter] {
        self.about().parameters
    }

    /// What it is, in a sentence for a person.
    fn description(&self) -> &'static str {
        self.about().description
    }

    /// How the data show it, and what distinguishes it from similar effects, for a person.
    fn signature(&self) -> &'static str {
        self.about().signature
    }

    /// A sentence that sums up its values, for an effect that has too many to read one by one.
    fn summary(&self, _values: &[f64]) -> Option<String> {
        None
    }

    /// Where a search for it begins: values that are present but weak. Several where one start would
    /// miss it, such as places over the target.
    fn starts(&self, stage: &Stage, shots: &[Shot]) -> Vec<Vec<f64>>;

    /// Whether it depends on the time of a chirp.
    fn depends_on_time(&self) -> bool {
        false
    }

    /// Whether it moves the target, so that rays must be traced again.
    fn moves(&self) -> bool {
        false
    }

    /// The global axis along which a parameter shifts the target under a shot, and by how many m per unit of
    /// the parameter, after all that the others do; `None` for a parameter that does anything else.
    fn shifts(&self, _parameter: usize, _shot: &Shot) -> Option<(usize, f64)> {
        None
    }

    /// Parameters, by their positions, that are the x, y and z of one vector, with the vector's name.
    fn vectors(&self) -> &'static [(&'static str, [usize; 3])] {
        &[]
    }

    /// How it moves the target under the ray of a shot, by its values alone; `None` where the target rests.
    fn motion(
        &self,
        _values: &[f64],
        _stage: &Stage,
        _shot: &Shot,
    ) -> Option<Pose<Global, Global>> {
        None
    }

    /// The part of the target where it acts; `None` where it acts everywhere.
    fn place(&self, _values: &[f64]) -> Option<Place> {
        None
    }

    /// The largest distance from the axis of its beam at which a chirp sees the target, m at 8 m.
    fn reach_off_axis_m(&self, _values: &[f64]) -> f64 {
        0.0
    }

    /// f in backscatter, 1/sr, of a shot whose law without this effect has `f_per_sr`.
    fn scatter(
        &self,
        _values: &[f64],
        _stage: &Stage,
        _law: &Brdf,
        _shot: &Shot,
        f_per_sr: f64,
    ) -> f64 {
        f_per_sr
    }

    /// Factor on the power of a shot, a ratio.
    fn gain(&self, _values: &[f64], _stage: &Stage, _shot: &Shot) -> f64 {
        1.0
    }

    /// The values on which [`survey`](Effect::survey) depends; `None` for an effect without one.
    fn survey_key(&self, _values: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// Traces the rays that a chirp needs besides its own: one entry for each shot, for any laws.
    fn survey(&self, _values: &[f64], _stage: &Stage, _shots: &[Shot]) -> Survey {
        Box::new(())
    }

    /// Applies the laws of the regions to a survey: what does not depend on the values.
    fn shade(&self, _survey: &Survey, _laws: &[Brdf]) -> Survey {
        Box::new(())
    }

    /// Changes the mean powers, W, and ranges, m, of all shots together by a shaded survey, after all gains.
    fn arrive(&self, _values: &[f64], _shaded: &Survey, _echoes: &mut [Option<MeanEcho>]) {}

    /// Changes the receiver's law.
    fn receive(&self, _values: &[f64], receiver: Receiver) -> Receiver {
        receiver
    }
}

/// What an effect has traced, or computed from that: a list of its own type with an entry for each shot.
pub type Survey = Box<dyn Any + Send + Sync>;

/// What is to say of an effect, whatever its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct About {
    /// Its name, as reports and scenes write it.
    pub name: &'static str,
    /// Where it belongs.
    pub level: Level,
    /// What it is, in a sentence for a person.
    pub description: &'static str,
    /// How the data show it, and what distinguishes it from similar effects, for a person.
    pub signature: &'static str,
    /// Its numbers.
    pub parameters: &'static [EffectParameter],
    /// Settings of a scene that it cannot act with.
    pub conflicts: &'static [Conflict],
}

/// A setting of a scene that an effect cannot act with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conflict {
    /// The setting.
    pub with: Setting,
    /// Why, as the end of a sentence that begins with the effect.
    pub problem: &'static str,
    /// What to change.
    pub way_out: &'static str,
}

impl Conflict {
    /// The conflict of every effect that moves the target.
    pub(super) const OF_MOTION: Conflict = Conflict {
        with: Setting::Bounce,
        problem: "moves the target, and [bounce] follows paths on it where the scene has it",
        way_out: "remove [bounce], or move the mesh by its translation_m and rotation_deg",
    };
}

/// A setting of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Setting {
    /// `spot.rays` above 1.
    SeveralRays,
    /// `[bounce]`.
    Bounce,
    /// `[radar.receiver]`.
    RangeReceiver,
}

/// Where an effect belongs, and is stored after a diagnosis has found it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// The radar and its calibration.
    Instrument,
    /// A material.
    Material,
    /// The scene: what is where.
    Scene,
}

impl Level {
    /// The word that files use.
    pub fn as_str(self) -> &'static str {
        match self {
            Level::Instrument => "instrument",
            Level::Material => "material",
            Level::Scene => "scene",
        }
    }
}

/// One number of an effect.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct EffectParameter {
    /// Its name, with its unit.
    pub name: &'static str,
    /// UCUM code of the unit; 1 for a pure number.
    pub unit: &'static str,
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// The value at which the effect is absent; for a number that only shapes an effect, such as a
    /// place, where a search begins.
    pub absent: f64,
    /// A change that the data show: the step of a difference quotient and the first step of a search.
    pub step: f64,
}

impl EffectParameter {
    pub(crate) const fn new(
        name: &'static str,
        unit: &'static str,
        [min, max]: [f64; 2],
        absent: f64,
        step: f64,
    ) -> EffectParameter {
        EffectParameter { name, unit, min, max, absent, step }
    }
}
