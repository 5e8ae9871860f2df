//! The interface of a physical effect.

use std::any::Any;

use super::echo::MeanEcho;
use super::place::Place;
use super::receiver::Receiver;
use super::shot::{Shot, Stage};
use super::twist::Twist;
use crate::brdf::Brdf;
use crate::frames::{Global, Pose};

/// A physical effect that the base model lacks.
///
/// `values` are those of [`parameters`](Effect::parameters), in their order and within their ranges.
pub trait Effect: Sync {
    /// Its name, parameters, texts and conflicts.
    fn about(&self) -> &About;

    /// Its name, as reports and scenes write it.
    fn name(&self) -> &'static str {
        self.about().name
    }

    /// Its level: instrument, material or scene.
    fn level(&self) -> Level {
        self.about().level
    }

    /// Its parameters.
    fn parameters(&self) -> &'static [EffectParameter] {
        self.about().parameters
    }

    /// Its description in one sentence, for a person.
    fn description(&self) -> &'static str {
        self.about().description
    }

    /// Its signature in the data, and how it differs from similar effects, for a person.
    fn signature(&self) -> &'static str {
        self.about().signature
    }

    /// A phrase that summarises its values; `None` for an effect with few parameters.
    fn summary(&self, _values: &[f64]) -> Option<String> {
        None
    }

    /// The members of its family: sets of its parameters, by their positions and in their order, of which a search tries each
    /// while the others stay absent; the simplest first. It reports the simplest that predicts as well as the best.
    /// Empty for an effect of one form.
    fn members(&self) -> &'static [&'static [usize]] {
        &[]
    }

    /// The range in which a search varies a parameter of a member, within that of the parameter.
    fn searched(&self, parameter: usize) -> [f64; 2] {
        let EffectParameter { min, max, .. } = self.parameters()[parameter];
        [min, max]
    }

    /// The effect of which this is a member, with the values of all its parameters; `None` for an effect by itself.
    fn whole(&self, _values: &[f64]) -> Option<(&'static dyn Effect, Vec<f64>)> {
        None
    }

    /// Values from which a search starts, with a weak effect. There are several if one start could miss the optimum,
    /// such as places over the target.
    fn starts(&self, stage: &Stage, shots: &[Shot]) -> Vec<Vec<f64>>;

    /// Numbers of the scans on which it acts, of several that are diagnosed together; empty for an effect on all.
    fn scans(&self) -> &[u16] {
        &[]
    }

    /// Widest step of a parameter, in its own steps, over which a difference quotient is its slope. Only facets that come
    /// and go need a wide one.
    fn widest_difference(&self) -> f64 {
        f64::INFINITY
    }

    /// Whether it acts on a scan.
    fn acts_on(&self, scan: u16) -> bool {
        self.scans().is_empty() || self.scans().contains(&scan)
    }

    /// Whether it depends on the time of a chirp.
    fn depends_on_time(&self) -> bool {
        false
    }

    /// Whether it moves the target, so that rays must be traced again.
    fn moves(&self) -> bool {
        false
    }

    /// The small motion of the target at a shot per unit of each parameter, from where these values place it. Empty if the
    /// target does not move.
    fn twists(&self, _values: &[f64], _stage: &Stage, _shot: &Shot) -> Vec<Twist> {
        Vec::new()
    }

    /// Parameters, by their positions, that are the x, y and z of one vector, with the vector's name.
    fn vectors(&self) -> &'static [(&'static str, [usize; 3])] {
        &[]
    }

    /// The motion of the target at the time of a shot; `None` if the target does not move.
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

    /// The largest distance from the axis of the beam at which a chirp detects the target, m at 8 m.
    fn reach_off_axis_m(&self, _values: &[f64]) -> f64 {
        0.0
    }

    /// f in backscatter with this effect, 1/sr; `f_per_sr` is f without it.
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

    /// Factor on the power of a shot, as a ratio.
    fn gain(&self, _values: &[f64], _stage: &Stage, _shot: &Shot) -> f64 {
        1.0
    }

    /// Multiplies the gains of some shots by [`gain`](Effect::gain); a shot that misses has none. An effect overrides it
    /// where shots share work.
    fn multiply_gains(
        &self,
        values: &[f64],
        stage: &Stage,
        shots: &[Option<&Shot>],
        gains: &mut [f64],
    ) {
        for (gain, shot) in gains.iter_mut().zip(shots) {
            if let Some(shot) = shot {
                *gain *= self.gain(values, stage, shot);
            }
        }
    }

    /// The values on which [`survey`](Effect::survey) depends; `None` for an effect without one.
    fn survey_key(&self, _values: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// Traces further rays for every shot: one entry per shot, independent of the scattering models.
    fn survey(&self, _values: &[f64], _stage: &Stage, _shots: &[Shot]) -> Survey {
        Box::new(())
    }

    /// Applies the scattering models of the regions to a survey: the part that does not depend on the values.
    fn shade(&self, _survey: &Survey, _laws: &[Brdf]) -> Survey {
        Box::new(())
    }

    /// Changes the mean powers and ranges of all shots by a shaded survey. It is called after all gains.
    fn arrive(&self, _values: &[f64], _shaded: &Survey, _echoes: &mut [Option<MeanEcho>]) {}

    /// How far a parameter may be off because the real effect has another form than this one.
    fn form_error(&self, _parameter: usize, _values: &[f64]) -> f64 {
        0.0
    }

    /// Changes the distribution of received powers.
    fn receive(&self, _values: &[f64], receiver: Receiver) -> Receiver {
        receiver
    }
}

/// The traced rays of an effect, or values computed from them: a list of the effect's own type, one entry per shot.
pub type Survey = Box<dyn Any + Send + Sync>;

/// The facts about an effect that do not depend on its values.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct About {
    /// Its name, as reports and scenes write it.
    pub name: &'static str,
    /// Its level: instrument, material or scene.
    pub level: Level,
    /// Its description in one sentence, for a person.
    pub description: &'static str,
    /// Its signature in the data, and how it differs from similar effects, for a person.
    pub signature: &'static str,
    /// Its parameters.
    pub parameters: &'static [EffectParameter],
    /// Settings of a scene that exclude it.
    pub conflicts: &'static [Conflict],
    /// Whether it has no other form than this one, as a shift and turn of a rigid target has none. What stands beside any
    /// other effect may only correct that effect's form, and must be large itself.
    pub has_one_form: bool,
}

impl About {
    /// Whether a setting of a scene excludes the effect.
    pub fn is_excluded_by(&self, setting: Setting) -> bool {
        self.conflicts.iter().any(|conflict| conflict.with == setting)
    }
}

/// A setting of a scene that excludes an effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Conflict {
    /// The setting.
    pub with: Setting,
    /// The reason, as the end of a sentence whose subject is the effect.
    pub problem: &'static str,
    /// The remedy.
    pub way_out: &'static str,
}

impl Conflict {
    /// The conflict of every effect that moves the target.
    pub(super) const OF_MOTION: Conflict = Conflict {
        with: Setting::Bounce,
        problem: "moves the target, and [bounce] follows paths on it where the scene has it",
        way_out: "remove [bounce], or move the mesh by its translation_m and rotation_deg",
    };

    /// The conflict of every effect that follows rays to the first surface.
    pub(super) const OF_SHEETS: Conflict = Conflict {
        with: Setting::Sheets,
        problem: "follows rays to the first surface, and some regions let them pass on",
        way_out: "remove the effect, or `transmits` and `thickness_m` of the regions",
    };

    /// The conflict of every effect that changes what comes straight back.
    pub(super) const OF_BACKSCATTER: Conflict = Conflict {
        with: Setting::OtherAntenna,
        problem: "changes what comes back to the radar, and nothing says what it does at another antenna",
        way_out: "remove [[receiver]], or the effect",
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
    /// Regions that let rays pass on.
    Sheets,
    /// `[[receiver]]`, for the echoes at an antenna apart from the radar's.
    OtherAntenna,
}

/// The level of an effect, which says where it is stored after a diagnosis has found it.
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

/// A parameter of an effect.
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
    /// The value at which the effect is absent. For a parameter that only shapes an effect, such as a
    /// place, the value from which a search starts.
    pub absent: f64,
    /// A change with a visible result: the step of difference quotients, and the first step of a search.
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
