//! A base law with any number of effects, and what it predicts of a scan.

use std::f64::consts::TAU;
use std::sync::{Arc, Mutex, PoisonError};

use glam::DVec3;
use rayon::prelude::*;

use super::meeting::{moved, seen_from};
use super::pose::Pose as PoseEffect;
use super::tilt::{NODES, nodes, tilted_cos_theta};
use super::{Arrived, Effect, Receiver, Saturating, Shot, Stage, Survey};
use crate::brdf::{Brdf, Retro, Scattering};
use crate::frames::{Direction, Global, Pose, Ray, Surface};
use crate::radar::scan::PATTERN_RANGE_M;
use crate::trace::{Hit, closest};

/// The base law and the effects that were added to it, each with its values.
#[derive(Clone)]
pub struct Model<'a> {
    /// Scattering of each region.
    pub laws: Vec<Brdf>,
    /// Law of the receiver without effects.
    pub receiver: Receiver,
    /// The effects, in the order in which they act.
    pub effects: Vec<(&'a dyn Effect, Vec<f64>)>,
}

/// What a model predicts.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Mean power and range of every look, without thermal noise; `None` where the ray misses.
    pub arrived: Vec<Option<Arrived>>,
    /// Of every look, where tilts vary at random from chirp to chirp; empty where none do.
    pub tilts: Vec<Tilts>,
    /// The law about the mean.
    pub receiver: Receiver,
    /// What the receiver passes.
    pub saturating: Saturating,
}

/// Factor on the power of a look for every tilt of its normal, and the tilt's probability.
pub type Tilts = [(f64, f64); NODES];

/// What was traced and worked out for one list of looks, for as long as what it depends on comes again:
/// a search turns one number at a time, and few numbers move a ray or change a law.
#[derive(Default)]
pub struct Traced {
    /// Large, and on one number each.
    surveys: Kept<Key, Survey, 4>,
    shaded: Kept<(Key, Vec<Brdf>), Survey>,
    placed: Kept<Vec<Key>, Vec<Option<Placed>>>,
    /// f of the laws by themselves, 1/sr, by the laws and what moves the looks.
    scattered: Kept<(Vec<Brdf>, Vec<Key>), Vec<f64>>,
    /// What all gains make of a power.
    gains: Kept<Vec<Key>, Vec<f64>>,
}

/// A look where the effects place it, and the direction of the radar from its surface.
type Placed = (Shot, Direction<Surface>);

/// Name of an effect and the values that matter.
type Key = (&'static str, Vec<f64>);

/// The latest results of a slow function, by default as many as a difference quotient over every number of a pose
/// asks for, its middle, and the next.
pub(super) struct Kept<K, V, const MOST: usize = 15>(Mutex<Vec<(K, Arc<V>)>>);

impl<K, V, const MOST: usize> Default for Kept<K, V, MOST> {
    fn default() -> Self {
        Kept(Mutex::default())
    }
}

impl<K: PartialEq, V, const MOST: usize> Kept<K, V, MOST> {
    /// Makes it without the lock, since other threads may want another key meanwhile.
    pub(super) fn of(&self, key: K, make: impl FnOnce() -> V) -> Arc<V> {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(found) = Self::take(&mut kept(), &key) {
            return found;
        }
        let made = Arc::new(make());
        let mut kept = kept();
        // Another thread may have made it meanwhile.
        if let Some(found) = Self::take(&mut kept, &key) {
            return found;
        }
        if kept.len() >= MOST {
            kept.remove(0);
        }
        kept.push((key, made.clone()));
        made
    }

    /// What is there, as the latest of all.
    fn take(kept: &mut Vec<(K, Arc<V>)>, key: &K) -> Option<Arc<V>> {
        let at = kept.iter().position(|(other, _)| other == key)?;
        let found = kept.remove(at);
        let value = found.1.clone();
        kept.push(found);
        Some(value)
    }
}

impl Prediction {
    /// Mean powers of a look over speckle, without thermal noise, W, with their probabilities: one for
    /// every tilt of its normal.
    pub fn powers_w(&self, look: usize) -> impl Iterator<Item = (f64, f64)> + Clone {
        const AS_IT_IS: &[(f64, f64)] = &[(1.0, 1.0)];
        let arrived = self.arrived.get(look).copied().flatten();
        let power_w = arrived.map_or(0.0, |arrived| arrived.power_w).max(0.0);
        let tilts = self.tilts.get(look).map_or(AS_IT_IS, |tilts| tilts);
        tilts.iter().map(move |(factor, weight)| (power_w * factor, *weight))
    }

    /// Mean power of a look with thermal noise before the receiver, W.
    pub fn mean_w(&self, look: usize) -> f64 {
        let power_w: f64 = self.powers_w(look).map(|(power_w, weight)| weight * power_w).sum();
        power_w + self.receiver.noise_w
    }

    /// The same as the receiver passes it, W.
    pub fn passed_w(&self, look: usize) -> f64 {
        let mean_w = self.mean_w(look);
        if mean_w > 0.0 { self.saturating.of(mean_w.ln()).ln_mean.exp() } else { 0.0 }
    }

    /// Small relative changes of the looks' mean powers as the receiver passes them.
    pub fn as_passed(&self, changes: &[f64]) -> Vec<f64> {
        let passes = |look: usize| self.saturating.passes(self.mean_w(look));
        changes.iter().enumerate().map(|(look, change)| change * passes(look)).collect()
    }

    /// Standard deviation of a look's mean power over the tilts of its normal, as a share of the mean.
    pub fn tilt_spread(&self, look: usize) -> f64 {
        let moment = |power: i32| -> f64 {
            self.powers_w(look).map(|(power_w, weight)| weight * power_w.powi(power)).sum()
        };
        let [mean_w, square_w2] = [moment(1), moment(2)];
        let variance = square_w2 - mean_w * mean_w;
        if variance > 0.0 { variance.sqrt() / mean_w } else { 0.0 }
    }
}

impl Model<'_> {
    /// The same with the target shifted along an axis, m, after all that its effects do with it.
    pub(crate) fn shifted(mut self, axis: usize, by_m: f64) -> Self {
        let mut pose = vec![0.0; PoseEffect.knobs().len()];
        pose[axis] = by_m;
        self.effects.push((&PoseEffect, pose));
        self
    }

    /// What arrives of every look.
    pub fn predict(&self, stage: &Stage, looks: &[Shot]) -> Prediction {
        self.predict_with(stage, looks, &Traced::default())
    }

    /// The same with what may have been traced for these very looks before.
    pub fn predict_with(&self, stage: &Stage, looks: &[Shot], traced: &Traced) -> Prediction {
        let keys = |matters: fn(&dyn Effect) -> bool| -> Vec<Key> {
            let matters = self.effects.iter().filter(|(effect, _)| matters(*effect));
            matters.map(|(effect, values)| (effect.name(), values.clone())).collect()
        };
        let (moves, all) = (keys(|effect| effect.moves()), keys(|_| true));
        let placed = traced.placed.of(moves.clone(), || self.all_placed(stage, looks));
        let of_placed = |of: &(dyn Fn(&Placed) -> f64 + Sync)| -> Vec<f64> {
            placed.par_iter().map(|placed| placed.as_ref().map_or(0.0, of)).collect()
        };
        let f_per_sr = traced.scattered.of((self.laws.clone(), moves), || {
            let laws: Vec<Retro> = self.laws.iter().map(Retro::new).collect();
            of_placed(&|(look, to_radar)| {
                laws.get(usize::from(look.region)).map_or(0.0, |law| law.per_sr(*to_radar))
            })
        });
        let gains = traced.gains.of(all, || of_placed(&|(look, _)| self.gain(stage, look)));
        let arrive = |((placed, f_per_sr), gain): ((&Option<Placed>, &f64), &f64)| {
            let (look, _) = placed.as_ref()?;
            let power_w = gain * self.scattered_w(stage, look, *f_per_sr);
            Some(Arrived::at_once(power_w, look.hit.range_m))
        };
        let looked = placed.par_iter().zip(&*f_per_sr).zip(&*gains);
        let mut arrived: Vec<Option<Arrived>> = looked.map(arrive).collect();
        let receiver = self.received();
        let tilted =
            |(placed, arrived): (&Option<Placed>, &Option<Arrived>)| match (placed, arrived) {
                (Some((look, _)), Some(arrived)) => {
                    self.tilts(stage, look, arrived.power_w, &receiver)
                }
                _ => Tilts::default(),
            };
        let tilts = match receiver.tilt_sd_rad > 0.0 {
            true => placed.par_iter().zip(&arrived).map(tilted).collect(),
            false => Vec::new(),
        };
        self.arrive(stage, looks, traced, &mut arrived);
        Prediction { arrived, tilts, saturating: receiver.saturating(), receiver }
    }

    /// Where a look meets the target, as the effects place it; `None` where its ray misses.
    pub(crate) fn placed(&self, stage: &Stage, look: Shot) -> Option<Shot> {
        let Some(target) = self.target(stage, &look) else { return Some(look) };
        let ray = seen_from(&target, &look.ray);
        stage.geometry.bvh.closest(&ray).map(|hit| moved(stage, &look, target, (ray, hit)).0)
    }

    /// All looks at once, so that rays of one origin share their walk over the facets.
    fn all_placed(&self, stage: &Stage, looks: &[Shot]) -> Vec<Option<Placed>> {
        let facing = |look: Shot| (look, to_radar(&look));
        let targets = looks.par_iter().map(|look| self.target(stage, look));
        let targets: Vec<Option<Pose<Global, Global>>> = targets.collect();
        if targets.iter().all(Option::is_none) {
            return looks.par_iter().map(|look| Some(facing(*look))).collect();
        }
        let seen = |(look, target): (&Shot, &Option<Pose<Global, Global>>)| {
            target.map_or(look.ray, |target| seen_from(&target, &look.ray))
        };
        let rays: Vec<Ray<Global>> = looks.par_iter().zip(&targets).map(seen).collect();
        let hits = closest(stage.geometry.bvh, &rays);
        let placed =
            |(((look, target), ray), hit): (((&Shot, &Option<_>), &Ray<_>), &Option<_>)| {
                Some(match *target {
                    None => facing(*look),
                    Some(target) => moved(stage, look, target, (*ray, (*hit)?)),
                })
            };
        looks.par_iter().zip(&targets).zip(&rays).zip(&hits).map(placed).collect()
    }

    /// Where the effects have the target under a look; `None` where the scene has it.
    pub(crate) fn target(&self, stage: &Stage, look: &Shot) -> Option<Pose<Global, Global>> {
        let motions = self.effects.iter().filter(|(effect, _)| effect.moves());
        let motions = motions.filter_map(|(effect, values)| effect.motion(values, stage, look));
        motions.reduce(|target, motion| motion * target)
    }

    /// Ranges, m, at which a chirp may see the target, along its axis or beside it.
    pub(crate) fn ranges_m(&self, stage: &Stage, look: &Shot) -> Vec<f64> {
        const ROUND: usize = 8;
        const RINGS: [f64; 3] = [1.0 / 3.0, 2.0 / 3.0, 1.0];
        let beside = self.effects.iter().map(|(effect, values)| effect.sees_beside_m(values));
        let tangent = beside.fold(0.0, f64::max) / PATTERN_RANGE_M;
        let axis = look.ray.direction.xyz();
        let (u, v) = axis.any_orthonormal_pair();
        let ring = |share: f64| {
            let round = (0..ROUND).map(|k| TAU * k as f64 / ROUND as f64);
            round.map(move |turn| axis + share * tangent * (turn.cos() * u + turn.sin() * v))
        };
        let moves = self.effects.iter().any(|(effect, _)| effect.moves());
        let range_m = |direction: DVec3| {
            let ray = Ray { direction: Direction::new(direction)?, ..look.ray };
            let hit = match moves {
                true => self.placed(stage, Shot { ray, ..*look })?.hit,
                false => stage.geometry.bvh.closest(&ray)?,
            };
            Some(hit.range_m)
        };
        let rays =
            std::iter::once(axis).chain(RINGS.into_iter().flat_map(ring).filter(|_| tangent > 0.0));
        rays.filter_map(range_m).collect()
    }

    /// What arrives of one look by itself.
    pub(crate) fn arrived(&self, stage: &Stage, look: &Shot) -> Arrived {
        Arrived::at_once(self.power_w(stage, look), look.hit.range_m)
    }

    /// What the effects make of all that arrives together.
    pub(crate) fn arrive(
        &self,
        stage: &Stage,
        looks: &[Shot],
        traced: &Traced,
        arrived: &mut [Option<Arrived>],
    ) {
        for (effect, values) in &self.effects {
            let Some(depends) = effect.surveyed(values) else { continue };
            let key: Key = (effect.name(), depends);
            let survey = || traced.surveys.of(key.clone(), || effect.survey(values, stage, looks));
            let shade = || effect.shade(&survey(), &self.laws);
            let shaded = traced.shaded.of((key.clone(), self.laws.clone()), shade);
            effect.arrive(values, &shaded, arrived);
        }
    }

    /// The receiver's law with the effects.
    pub(crate) fn received(&self) -> Receiver {
        let receive =
            |receiver, (effect, values): &(&dyn Effect, Vec<f64>)| effect.receive(values, receiver);
        self.effects.iter().fold(self.receiver, receive)
    }

    /// Equation (11) with every effect on the surface and the gain.
    fn power_w(&self, stage: &Stage, look: &Shot) -> f64 {
        let f_per_sr = self.law_per_sr(look, to_radar(look));
        self.gain(stage, look) * self.scattered_w(stage, look, f_per_sr)
    }

    /// f of the law of a look by itself, 1/sr.
    fn law_per_sr(&self, look: &Shot, to_radar: Direction<Surface>) -> f64 {
        let law = self.laws.get(usize::from(look.region));
        law.map_or(0.0, |law| law.f_per_sr(to_radar, to_radar))
    }

    /// Equation (11) with every effect on the surface, W.
    fn scattered_w(&self, stage: &Stage, look: &Shot, law_per_sr: f64) -> f64 {
        let Some(law) = self.laws.get(usize::from(look.region)) else { return 0.0 };
        let f_per_sr = self
            .effects
            .iter()
            .fold(law_per_sr, |f, (effect, values)| effect.scatter(values, stage, law, look, f));
        stage.link.power_w(look.hit.range_m, look.hit.cos_theta, f_per_sr)
    }

    /// What all gains make of the power of a look.
    fn gain(&self, stage: &Stage, look: &Shot) -> f64 {
        self.effects.iter().map(|(effect, values)| effect.gain(values, stage, look)).product()
    }

    /// What the tilts of a normal make of the power, W, of a look.
    fn tilts(&self, stage: &Stage, look: &Shot, power_w: f64, receiver: &Receiver) -> Tilts {
        let theta_rad = look.hit.theta_rad();
        nodes(receiver.tilt_sd_rad).map(|(tilts, weight)| {
            let tilted = tilted_cos_theta(theta_rad, tilts).map(|cos_theta| {
                let hit = Hit { cos_theta, ..look.hit };
                self.power_w(stage, &Shot { hit, ..*look })
            });
            let factor = if power_w > 0.0 { tilted.unwrap_or(0.0) / power_w } else { 0.0 };
            (factor, weight)
        })
    }
}

/// The direction of the radar from the surface of a look.
fn to_radar(look: &Shot) -> Direction<Surface> {
    Direction::from_angles(look.hit.theta_rad(), look.azimuth_rad)
}
