//! Physical effects beyond the paper's model: one file each, one interface, the same object in a
//! diagnosis and in a prediction.
//!
//! A prediction starts from what the scene knows of every chirp, a [`Shot`], and asks every effect in
//! turn for each of four things; an effect answers those that it changes:
//!
//! 1. where and how the chirp meets the target ([`Effect::motion`]): pose, motion;
//! 2. how the surface scatters ([`Effect::scatter`]): subsurface, thin film, anisotropy, shadowing;
//! 3. how much power arrives ([`Effect::gain`], [`Effect::arrive`]): layers, patches, gains, bounces;
//! 4. what the receiver makes of it ([`Effect::receive`]): compression, speckle, noise, tilts that vary
//!    at random.
//!
//! Parameters at their [`absent`](Knob::absent) values are no effect at all, exactly. [`library`] has
//! them all; another one is a file and a line of its list.

mod ceiling;
mod declared;
mod entry;
mod lobes;
mod meeting;
mod model;
mod place;
mod spread;
mod tilt;

use std::any::Any;

use glam::DVec3;

use crate::brdf::Brdf;
use crate::frames::{Global, Pose, Ray};
use crate::radar::Link;
use crate::trace::{Hit, ScanGeometry};

pub use ceiling::{Ceiling, Passed, Saturating};
pub use declared::SceneEffects;
pub(crate) use entry::rank;
pub use entry::{Chosen, EffectError, entry, resolve};
pub use model::{Model, Prediction, Tilts, Traced};
pub use place::Place;
pub use tilt::tilted_cos_theta;

/// Declares the file of every effect and lists them all, in the order in which they act.
macro_rules! library {
    ($($file:ident::$effect:ident),+ $(,)?) => {
        $(mod $file;)+

        /// Every effect, in the order in which they act on a chirp.
        pub fn library() -> [&'static dyn Effect; [$(stringify!($file)),+].len()] {
            [$(&$file::$effect),+]
        }
    };
}

// `cargo fmt` does not follow modules in a macro: `rustfmt src/effects/*.rs` does them.
library! {
    pose::Pose,
    motion::Motion,
    subsurface::Subsurface,
    thin_film::ThinFilm,
    anisotropy::Anisotropy,
    correlated_shadowing::CorrelatedShadowing,
    covering_layer::CoveringLayer,
    foreign_patch::ForeignPatch,
    fov_gain::FovGain,
    drift::Drift,
    finite_spot::FiniteSpot,
    multi_bounce::MultiBounce,
    compression::Compression,
    angle_error::AngleError,
    speckle::Speckle,
    noise_floor::NoiseFloor,
}

/// The effect of that name; `None` when the library has none.
///
/// ```
/// assert_eq!(matdb::effects::find("drift").unwrap().name(), "drift");
/// assert!(matdb::effects::find("witchcraft").is_none());
/// ```
pub fn find(name: &str) -> Option<&'static dyn Effect> {
    library().into_iter().find(|effect| effect.name() == name)
}

/// Middle of the points where looks meet the target, m, global frame; the origin without looks.
pub fn middle(looks: &[Shot]) -> DVec3 {
    let sum: DVec3 = looks.iter().map(|look| look.hit.point.xyz).sum();
    sum / looks.len().max(1) as f64
}

/// One chirp that meets the target, as far as the scene knows it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shot {
    /// Chirp number.
    pub chirp: u32,
    /// Time of the chirp, s.
    pub time_s: f64,
    /// Share of the scan that is over, 0 to 1, by the chirp's place in it.
    pub progress: f64,
    /// The ray.
    pub ray: Ray<Global>,
    /// Where it meets the target.
    pub hit: Hit,
    /// Unit normal there, towards the radar.
    pub normal: DVec3,
    /// Where effects have moved the target from where the scene has it.
    pub target: Pose<Global, Global>,
    /// Azimuth of the radar about the normal, from the grain of the region, rad.
    pub azimuth_rad: f64,
    /// Region of the facet.
    pub region: u16,
    /// x of the target frame where the ray passes 8 m, m.
    pub xt_m: f64,
    /// y of the same, m.
    pub yt_m: f64,
    /// Distance in the target plane to the nearest edge in depth, m, at most three spots.
    pub edge_m: f64,
}

/// What all looks of a scan share.
#[derive(Clone, Copy)]
pub struct Stage<'a> {
    /// The instrument and its target.
    pub geometry: ScanGeometry<'a>,
    /// The instrument's power balance.
    pub link: Link,
    /// Direction of the grain of every region, global frame.
    pub grain_of_region: &'a [DVec3],
    /// What a pose turns about, m, global frame: the [`middle`] of all looks of the scan, whichever
    /// of them are predicted.
    pub middle: DVec3,
}

/// The law of what is received about its mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Receiver {
    /// Looks L of the speckle.
    pub looks: f64,
    /// Mean thermal power, W.
    pub noise_w: f64,
    /// Standard deviation of each of the two tilts of a normal that differ from chirp to chirp, rad.
    pub tilt_sd_rad: f64,
    /// What it cannot pass.
    pub ceiling: Ceiling,
}

impl Receiver {
    /// No speckle, no noise, no tilt, no ceiling.
    pub const LINEAR: Receiver =
        Receiver { looks: f64::INFINITY, noise_w: 0.0, tilt_sd_rad: 0.0, ceiling: Ceiling::NONE };

    /// Its ceiling over its speckle.
    pub fn saturating(&self) -> Saturating {
        self.ceiling.over(self.looks)
    }
}

/// Where an effect belongs, and is stored once it is found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Level {
    /// The radar and its calibration.
    Instrument,
    /// A material.
    Material,
    /// What stands where.
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
pub struct Knob {
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
    /// A change that is felt: the step of a difference quotient and the first step of a search.
    pub step: f64,
}

impl Knob {
    const fn new(
        name: &'static str,
        unit: &'static str,
        [min, max]: [f64; 2],
        absent: f64,
        step: f64,
    ) -> Knob {
        Knob { name, unit, min, max, absent, step }
    }
}

/// A physical effect that the base model lacks.
///
/// `values` are those of [`knobs`](Effect::knobs), in their order and within their ranges.
pub trait Effect: Sync {
    /// Its name, as reports and scenes write it.
    fn name(&self) -> &'static str;

    /// Where it belongs.
    fn level(&self) -> Level;

    /// Its numbers.
    fn knobs(&self) -> &'static [Knob];

    /// What it is, in a sentence for a person.
    fn is(&self) -> &'static str;

    /// What it does to the data and how to tell it from its neighbours, for a person.
    fn shows(&self) -> &'static str;

    /// What its values come to, for a person, where they are too many to be read one by one.
    fn told(&self, _values: &[f64]) -> Option<String> {
        None
    }

    /// Where a search for it begins: values that are present but weak. Several where one start would
    /// miss it, such as places over the target.
    fn starts(&self, stage: &Stage, looks: &[Shot]) -> Vec<Vec<f64>>;

    /// Whether it goes with the time of a chirp.
    fn goes_with_time(&self) -> bool {
        false
    }

    /// Whether it moves the target, which is where rays are traced anew.
    fn moves(&self) -> bool {
        false
    }

    /// The global axis along which a number of its values does nothing but shift the target, after all that its
    /// others do, and by how many m per unit under a look; `None` for numbers that do anything else.
    fn shifts(&self, _knob: usize, _look: &Shot) -> Option<(usize, f64)> {
        None
    }

    /// How it moves the target under the ray of a look, by its values alone; `None` where it rests.
    fn motion(
        &self,
        _values: &[f64],
        _stage: &Stage,
        _look: &Shot,
    ) -> Option<Pose<Global, Global>> {
        None
    }

    /// The part of the target where it acts; `None` where it acts everywhere.
    fn place(&self, _values: &[f64]) -> Option<Place> {
        None
    }

    /// How far beside its axis a chirp sees the target, m at 8 m.
    fn sees_beside_m(&self, _values: &[f64]) -> f64 {
        0.0
    }

    /// f in backscatter, 1/sr, of a look whose law without this effect has `f_per_sr`.
    fn scatter(
        &self,
        _values: &[f64],
        _stage: &Stage,
        _law: &Brdf,
        _look: &Shot,
        f_per_sr: f64,
    ) -> f64 {
        f_per_sr
    }

    /// Factor on the power of a look, a ratio.
    fn gain(&self, _values: &[f64], _stage: &Stage, _look: &Shot) -> f64 {
        1.0
    }

    /// The values on which [`survey`](Effect::survey) depends; `None` for an effect without one.
    fn surveyed(&self, _values: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// Rays beyond a chirp's own, traced once and used for whatever laws: one entry for each look.
    fn survey(&self, _values: &[f64], _stage: &Stage, _looks: &[Shot]) -> Survey {
        Box::new(())
    }

    /// What the laws of the regions make of a survey, for whatever else changes.
    fn shade(&self, _survey: &Survey, _laws: &[Brdf]) -> Survey {
        Box::new(())
    }

    /// Changes the mean powers, W, and ranges, m, of all looks together by a shaded survey, after all gains.
    fn arrive(&self, _values: &[f64], _shaded: &Survey, _arrived: &mut [Option<Arrived>]) {}

    /// Changes the receiver's law.
    fn receive(&self, _values: &[f64], receiver: Receiver) -> Receiver {
        receiver
    }
}

/// What an effect has traced, or made of it: a list of its own with an entry for each look.
pub type Survey = Box<dyn Any + Send + Sync>;

/// What arrives of one look in the mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrived {
    /// Mean power, W.
    pub power_w: f64,
    /// Range, the mean by power, m.
    pub range_m: f64,
    /// Standard deviation by power of the ranges of what arrives together, m: speckle weighs it anew from
    /// chirp to chirp, so that the range may lie so far from the mean.
    pub spread_m: f64,
}

impl Arrived {
    /// What arrives from one place.
    pub fn at_once(power_w: f64, range_m: f64) -> Arrived {
        Arrived { power_w, range_m, spread_m: 0.0 }
    }

    /// With something else; nothing changes where neither brings any power.
    pub fn with(self, other: Arrived) -> Arrived {
        let power_w = self.power_w + other.power_w;
        if power_w <= 0.0 {
            return self;
        }
        let share = other.power_w / power_w;
        let apart_m = other.range_m - self.range_m;
        let within_m2 = (1.0 - share) * self.spread_m.powi(2) + share * other.spread_m.powi(2);
        let between_m2 = share * (1.0 - share) * apart_m * apart_m;
        let range_m = self.range_m + share * apart_m;
        Arrived { power_w, range_m, spread_m: (within_m2 + between_m2).sqrt() }
    }
}

#[cfg(test)]
mod testing;
