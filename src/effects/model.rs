//! Scattering models with any number of effects, and their prediction of a scan.

use std::f64::consts::TAU;

use glam::DVec3;
use rayon::prelude::*;

use super::cache::Cache;
use super::ceiling::SaturationCurve;
use super::echo::MeanEcho;
use super::effect::{Effect, Survey};
use super::intersection::{Facet, moved};
use super::receiver::Receiver;
use super::shot::{Shot, Stage, returns_wave};
use super::tilt::{NODES, nodes, tilted_cos_theta};
use super::twist::{Twist, twisted};
use super::way_back::WayBack;
use crate::brdf::{Brdf, Retro, Scattering, Seen};
use crate::frames::{Direction, Global, Pose, Ray, Surface};
use crate::radar::scan::PATTERN_RANGE_M;
use crate::trace::{Hit, closest};

/// The scattering models of a target, the receiver, and effects with their values.
#[derive(Clone)]
pub struct Model<'a> {
    /// Scattering model of each region.
    pub laws: Vec<Brdf>,
    /// The receiver without effects.
    pub receiver: Receiver,
    /// The effects, in the order in which they act.
    pub effects: Vec<(&'a dyn Effect, Vec<f64>)>,
    /// Factor on every echo, as a ratio: the level of the radar over the one that its settings state.
    pub level: f64,
}

/// The prediction of a model for the shots of a scan.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Mean power and range of every shot, without thermal noise; `None` where the ray misses.
    pub arrived: Vec<Option<MeanEcho>>,
    /// The random tilts of every shot; empty without such tilts.
    pub tilts: Vec<Tilts>,
    /// The distribution of powers about the mean.
    pub receiver: Receiver,
    /// The saturation of the receiver.
    pub saturating: SaturationCurve,
}

/// Factor on the power of a shot and probability, for every tilt of its normal.
pub type Tilts = [(f64, f64); NODES];

/// Traced rays and computed values of one list of shots, which are reused as long as their inputs do not change. A
/// search changes one parameter at a time, and few parameters move a ray or change a scattering model.
#[derive(Default)]
pub struct PredictionCache {
    /// Few, since each is large.
    surveys: Cache<Key, Survey, 4>,
    shaded: Cache<(Key, Vec<Brdf>), Survey>,
    intersections: Cache<Vec<Key>, Vec<Option<Intersection>>>,
    /// f of the scattering models without effects, 1/sr, by the models and the effects that move the target.
    scattered: Cache<(Vec<Brdf>, Vec<Key>), Vec<f64>>,
    /// The coherent share of each echo, by the same; empty where no model returns a wave.
    coherent: Cache<(Vec<Brdf>, Vec<Key>), Vec<f64>>,
    /// The product of all gains.
    gains: Cache<Vec<Key>, Vec<f64>>,
}

/// What a prediction needs of each shot's place on the target.
struct Surfaces<'a> {
    /// The coherent share of its echo; empty where no model returns a wave.
    coherent: &'a [f64],
    /// f of its scattering model without effects, 1/sr.
    f_per_sr: &'a [f64],
    /// The product of all gains.
    gains: &'a [f64],
}

/// The echoes of some shots, and their random tilts; empty without such tilts.
#[derive(Default)]
struct Echoes {
    arrived: Vec<Option<MeanEcho>>,
    tilts: Vec<Tilts>,
}

/// Shots that one task evaluates with the target in a dozen places, so few that they stay in the processor's cache.
const TWISTED_PER_TASK: usize = 64;

/// Shots that one task evaluates, so many that loops over them fill vector instructions.
const SHOTS_PER_TASK: usize = 256;

/// A shot where the effects place it.
#[derive(Clone)]
struct Intersection {
    shot: Shot,
    /// Direction of the radar from its surface.
    to_radar: Direction<Surface>,
    /// The way to an antenna apart from the radar's.
    way_back: Option<WayBack>,
}

impl Intersection {
    fn new(stage: &Stage, shot: Shot, to_radar: Direction<Surface>) -> Intersection {
        let way_back = stage.antenna.map(|antenna| WayBack::new(&antenna, stage, &shot));
        Intersection { shot, to_radar, way_back }
    }

    /// Of a shot that its ray hits as it is.
    fn of_shot(stage: &Stage, shot: &Shot) -> Intersection {
        Intersection::new(stage, *shot, shot.to_radar())
    }

    /// Range of its echo, m.
    fn range_m(&self) -> f64 {
        self.way_back.map_or(self.shot.hit.range_m, |way| way.range_m) + self.shot.longer_m
    }
}

/// Name of an effect, and the values on which a result depends.
type Key = (&'static str, Vec<f64>);

impl Prediction {
    /// Mean powers of a shot over speckle, without thermal noise, W, with their probabilities: one for
    /// every tilt of its normal.
    pub fn powers_w(&self, shot: usize) -> impl Iterator<Item = (f64, f64)> + Clone {
        const AS_IT_IS: &[(f64, f64)] = &[(1.0, 1.0)];
        let arrived = self.arrived.get(shot).copied().flatten();
        let power_w = arrived.map_or(0.0, |arrived| arrived.power_w).max(0.0);
        let tilts = self.tilts.get(shot).map_or(AS_IT_IS, |tilts| tilts);
        tilts.iter().map(move |(factor, weight)| (power_w * factor, *weight))
    }

    /// Looks of a shot's power, whose mean without noise is `power_w`, W: more than those of the speckle where a part of the
    /// echo does not speckle.
    pub fn looks(&self, shot: usize, power_w: f64) -> f64 {
        match self.arrived.get(shot).copied().flatten() {
            Some(echo) if echo.coherent_share != 0.0 || echo.more_looks != 1.0 => {
                let of_echo = power_w / (power_w + self.receiver.noise_w);
                let more = 1.0 + of_echo * (echo.more_looks - 1.0);
                self.receiver.looks_of(echo.coherent_share * of_echo, more)
            }
            _ => self.receiver.looks,
        }
    }

    /// Mean power of a shot with thermal noise before the receiver, W.
    pub fn mean_w(&self, shot: usize) -> f64 {
        let power_w: f64 = self.powers_w(shot).map(|(power_w, weight)| weight * power_w).sum();
        power_w + self.receiver.noise_w
    }

    /// Mean power of a shot with thermal noise after the receiver, W.
    pub fn passed_w(&self, shot: usize) -> f64 {
        let mean_w = self.mean_w(shot);
        if mean_w > 0.0 { self.saturating.ln_mean(mean_w.ln()).exp() } else { 0.0 }
    }

    /// Small relative changes of the shots' mean powers before the receiver as those after it.
    pub fn as_passed(&self, changes: &[f64]) -> Vec<f64> {
        let mut passed = changes.to_vec();
        for (shot, change) in passed.iter_mut().enumerate() {
            *change *= self.saturating.passes(self.mean_w(shot));
        }
        passed
    }

    /// Standard deviation of a shot's mean power over the tilts of its normal, as a share of the mean.
    pub fn tilt_spread(&self, shot: usize) -> f64 {
        let [mut mean_w, mut square_w2] = [0.0; 2];
        for (power_w, weight) in self.powers_w(shot) {
            mean_w += weight * power_w;
            square_w2 += weight * power_w.powi(2);
        }
        let variance = square_w2 - mean_w * mean_w;
        if variance > 0.0 { variance.sqrt() / mean_w } else { 0.0 }
    }
}

impl Model<'_> {
    /// The prediction for every shot.
    pub fn predict(&self, stage: &Stage, shots: &[Shot]) -> Prediction {
        self.predict_with(stage, shots, &PredictionCache::default())
    }

    /// As [`predict`](Model::predict), with a cache, which must belong to these shots.
    pub fn predict_with(
        &self,
        stage: &Stage,
        shots: &[Shot],
        cache: &PredictionCache,
    ) -> Prediction {
        // f of the scattering models and the gains, in caches of their own, since they depend on different values.
        let moving = self.keys(|effect| effect.moves());
        let make = || self.intersect_all(stage, shots);
        let intersections = cache.intersections.get_or_make(moving.clone(), make);
        let key = (self.laws.clone(), moving);
        let make = || self.coherent_shares(stage, &intersections);
        let coherent = cache.coherent.get_or_make(key.clone(), make);
        let f_per_sr =
            cache.scattered.get_or_make(key, || self.all_f_per_sr(stage, &intersections));
        let gains =
            cache.gains.get_or_make(self.keys(|_| true), || self.all_gains(stage, &intersections));
        let surfaces = Surfaces { coherent: &coherent, f_per_sr: &f_per_sr, gains: &gains };
        self.arrived_together(stage, shots, self.echoes(stage, &intersections, surfaces), cache)
    }

    /// The predictions with the target moved a little further in each of these ways, after the effects have moved it. The rays
    /// of a shot nearly coincide then: they are traced together, and mostly hit one facet.
    pub(crate) fn predict_twisted(
        &self,
        stage: &Stage,
        shots: &[Shot],
        twists: &[Twist],
        cache: &PredictionCache,
    ) -> Vec<Prediction> {
        let ways: Vec<Pose<Global, Global>> =
            twists.iter().map(|twist| twisted(stage.middle, twist)).collect();
        let laws = self.retros();
        let echoes = |shots: &[Shot]| {
            let of_ways = self.intersect_twisted(stage, shots, &ways);
            let echoes = of_ways.into_iter().map(|shots| {
                let surfaces = Surfaces {
                    coherent: &self.coherent_shares(stage, &shots),
                    f_per_sr: &self.f_per_sr(stage, &laws, &shots),
                    gains: &self.gains(stage, &shots),
                };
                self.echoes(stage, &shots, surfaces)
            });
            echoes.collect::<Vec<_>>()
        };
        let tasks: Vec<Vec<Echoes>> = shots.par_chunks(TWISTED_PER_TASK).map(echoes).collect();
        let joined = |way: usize| {
            let mut all = Echoes::default();
            for task in &tasks {
                all.arrived.extend_from_slice(&task[way].arrived);
                all.tilts.extend_from_slice(&task[way].tilts);
            }
            self.arrived_together(stage, shots, all, cache)
        };
        (0..ways.len()).into_par_iter().map(joined).collect()
    }

    /// The intersections of shots with the target moved a little further in each of these ways, way by way.
    fn intersect_twisted(
        &self,
        stage: &Stage,
        shots: &[Shot],
        ways: &[Pose<Global, Global>],
    ) -> Vec<Vec<Option<Intersection>>> {
        let mut placed = Vec::with_capacity(shots.len() * ways.len());
        for shot in shots {
            let target = self.target(stage, shot);
            placed.extend(ways.iter().map(|way| target.map_or(*way, |target| *way * target)));
        }
        let of_shots = shots.iter().zip(placed.chunks_exact(ways.len()));
        let rays: Vec<Ray<Global>> = of_shots
            .flat_map(|(shot, placed)| placed.iter().map(|target| target.inverse() * shot.ray))
            .collect();
        let hits = stage.geometry.bvh.closest_of_spots(&rays, ways.len());
        let mut found: Vec<_> = ways.iter().map(|_| Vec::with_capacity(shots.len())).collect();
        let mut facet: Option<(u32, Facet)> = None;
        for (at, (hit, (ray, target))) in hits.into_iter().zip(rays.iter().zip(&placed)).enumerate()
        {
            let (shot, way) = (&shots[at / ways.len()], at % ways.len());
            found[way].push(hit.map(|hit| {
                let (_, facet) = match facet.take() {
                    Some(known) if known.0 == hit.facet => facet.insert(known),
                    _ => facet.insert((hit.facet, Facet::of(stage, hit.facet as usize))),
                };
                let (shot, to_radar) = moved(facet, shot, *target, *ray, hit);
                Intersection::new(stage, shot, to_radar)
            }));
        }
        found
    }

    /// The echoes of shots with these intersections, before effects on all shots together.
    fn echoes(
        &self,
        stage: &Stage,
        intersections: &[Option<Intersection>],
        Surfaces { coherent, f_per_sr, gains }: Surfaces,
    ) -> Echoes {
        // Equation (11), shot by shot.
        let arrived: Vec<Option<MeanEcho>> = intersections
            .par_iter()
            .zip(f_per_sr)
            .zip(gains)
            .enumerate()
            .map(|(shot, ((intersection, f_per_sr), gain))| {
                let intersection = intersection.as_ref()?;
                let power_w = gain * self.scattered_w(stage, intersection, *f_per_sr);
                let coherent_share = coherent.get(shot).copied().unwrap_or(0.0);
                let echo = MeanEcho::at_once(power_w, intersection.range_m());
                Some(MeanEcho { coherent_share, ..echo })
            })
            .collect();
        let tilt_sd_rad = self.received().tilt_sd_rad;
        let tilts = if tilt_sd_rad > 0.0 {
            self.all_tilts(stage, intersections, &arrived, tilt_sd_rad)
        } else {
            Vec::new()
        };
        Echoes { arrived, tilts }
    }

    /// The prediction from the echoes of all shots, on which effects on all of them together act last.
    fn arrived_together(
        &self,
        stage: &Stage,
        shots: &[Shot],
        Echoes { mut arrived, tilts }: Echoes,
        cache: &PredictionCache,
    ) -> Prediction {
        self.arrive(stage, shots, cache, &mut arrived);
        for echo in arrived.iter_mut().flatten() {
            echo.power_w *= self.level;
        }
        let receiver = self.received();
        Prediction { arrived, tilts, saturating: receiver.saturating(), receiver }
    }

    /// f of the scattering models without effects, 1/sr, of all shots.
    fn all_f_per_sr(&self, stage: &Stage, shots: &[Option<Intersection>]) -> Vec<f64> {
        let laws = self.retros();
        in_tasks(shots, |shots| self.f_per_sr(stage, &laws, shots))
    }

    /// The products of all gains of all shots.
    fn all_gains(&self, stage: &Stage, shots: &[Option<Intersection>]) -> Vec<f64> {
        in_tasks(shots, |shots| self.gains(stage, shots))
    }

    /// Names and values of the effects for which `holds` is true.
    fn keys(&self, holds: fn(&dyn Effect) -> bool) -> Vec<Key> {
        let matters = self.effects.iter().filter(|(effect, _)| holds(*effect));
        matters.map(|(effect, values)| (effect.name(), values.clone())).collect()
    }

    /// The tilts of every shot.
    fn all_tilts(
        &self,
        stage: &Stage,
        intersections: &[Option<Intersection>],
        arrived: &[Option<MeanEcho>],
        tilt_sd_rad: f64,
    ) -> Vec<Tilts> {
        let (laws, nodes) = (self.retros(), nodes(tilt_sd_rad));
        let tasks =
            intersections.par_chunks(SHOTS_PER_TASK).zip(arrived.par_chunks(SHOTS_PER_TASK));
        let of_task = |(shots, arrived): (&[Option<Intersection>], &[Option<MeanEcho>])| {
            let tilted = shots.iter().flat_map(|shot| nodes.map(|(by, _)| tilted(shot, by)));
            let tilted: Vec<Option<Intersection>> = tilted.collect();
            let f_per_sr = self.f_per_sr(stage, &laws, &tilted);
            let gains = self.gains(stage, &tilted);
            let powers = tilted.iter().zip(f_per_sr).zip(gains).map(|((at, f_per_sr), gain)| {
                at.as_ref().map_or(0.0, |at| gain * self.scattered_w(stage, at, f_per_sr))
            });
            let power_w: Vec<f64> = powers.collect();
            let of_shots = power_w.chunks_exact(NODES).zip(arrived);
            let tilts = of_shots.map(|(power_w, arrived)| {
                // A ray that misses the target where an effect has moved it has no power, whatever the tilt.
                let untilted_w = arrived.map_or(0.0, |echo| echo.power_w);
                std::array::from_fn(|node| {
                    let factor = if untilted_w > 0.0 { power_w[node] / untilted_w } else { 0.0 };
                    (factor, nodes[node].1)
                })
            });
            tilts.collect::<Vec<Tilts>>()
        };
        tasks.map(of_task).collect::<Vec<_>>().concat()
    }

    /// f of the laws without effects towards the stage's antenna, 1/sr, of every shot that hits the target; 0 of any
    /// other.
    fn f_per_sr(
        &self,
        stage: &Stage,
        retros: &[Retro],
        shots: &[Option<Intersection>],
    ) -> Vec<f64> {
        if stage.antenna.is_none() {
            return retro_per_sr(stage, retros, shots);
        }
        let hits = shots.iter().map(Option::as_ref);
        hits.map(|hit| hit.map_or(0.0, |hit| bistatic_per_sr(stage, &self.laws, hit))).collect()
    }

    /// The coherent share of the echo of every shot; empty where no law returns a wave.
    fn coherent_shares(&self, stage: &Stage, shots: &[Option<Intersection>]) -> Vec<f64> {
        if !self.laws.iter().any(|law| returns_wave(law, stage.middle_divergence_rad())) {
            return Vec::new();
        }
        let share = |at: &Option<Intersection>| {
            let Some(Intersection { shot, to_radar, way_back }) = at else { return 0.0 };
            let Some(law) = self.laws.get(usize::from(shot.region)) else { return 0.0 };
            let beam_rad = stage.divergence_rad(shot);
            let seen = match way_back {
                None => law.seen_by(beam_rad, *to_radar, *to_radar),
                Some(way) => way.seen(law, beam_rad),
            };
            seen.coherent_share
        };
        shots.par_iter().map(share).collect()
    }

    /// The laws, to be asked for backscatter alone.
    fn retros(&self) -> Vec<Retro<'_>> {
        self.laws.iter().map(|law| Retro::new(law)).collect()
    }

    /// The shot at its intersection with the target where the effects place it; `None` if its ray misses.
    pub(crate) fn placed(&self, stage: &Stage, shot: Shot) -> Option<Shot> {
        let Some(target) = self.target(stage, &shot) else { return Some(shot) };
        let ray = target.inverse() * shot.ray;
        let hit = stage.geometry.bvh.closest(&ray)?;
        Some(moved(&Facet::of(stage, hit.facet as usize), &shot, target, ray, hit).0)
    }

    /// The intersections of all shots, traced together: rays of one origin are then rasterised.
    fn intersect_all(&self, stage: &Stage, shots: &[Shot]) -> Vec<Option<Intersection>> {
        let targets: Vec<Option<Pose<Global, Global>>> =
            shots.par_iter().map(|shot| self.target(stage, shot)).collect();
        if targets.iter().all(Option::is_none) {
            return shots.par_iter().map(|shot| Some(Intersection::of_shot(stage, shot))).collect();
        }
        let rays: Vec<Ray<Global>> = shots
            .par_iter()
            .zip(&targets)
            .map(|(shot, target)| target.map_or(shot.ray, |target| target.inverse() * shot.ray))
            .collect();
        let hits = closest(stage.geometry.bvh, &rays);
        (shots, &targets, &rays, &hits)
            .into_par_iter()
            .map(|(shot, target, ray, hit)| match *target {
                None => Some(Intersection::of_shot(stage, shot)),
                Some(target) => {
                    let hit = (*hit)?;
                    let facet = Facet::of(stage, hit.facet as usize);
                    let (shot, to_radar) = moved(&facet, shot, target, *ray, hit);
                    Some(Intersection::new(stage, shot, to_radar))
                }
            })
            .collect()
    }

    /// Whether an effect moves the target.
    pub(crate) fn moves_target(&self) -> bool {
        self.effects.iter().any(|(effect, _)| effect.moves())
    }

    /// The pose of the target at a shot by the effects; `None` if none moves it.
    pub(crate) fn target(&self, stage: &Stage, shot: &Shot) -> Option<Pose<Global, Global>> {
        let motions = self.effects.iter().filter(|(effect, _)| effect.moves());
        let motions = motions.filter_map(|(effect, values)| effect.motion(values, stage, shot));
        motions.reduce(|target, motion| motion * target)
    }

    /// Ranges at which a chirp may detect the target, along its axis or off it, m.
    pub(crate) fn ranges_m(&self, stage: &Stage, shot: &Shot) -> Vec<f64> {
        const AROUND: usize = 8;
        const RINGS: [f64; 3] = [1.0 / 3.0, 2.0 / 3.0, 1.0];
        let reaches = self.effects.iter().map(|(effect, values)| effect.reach_off_axis_m(values));
        let tangent = reaches.fold(0.0, f64::max) / PATTERN_RANGE_M;
        let axis = shot.ray.direction.xyz();
        // The axis, and where the beam is wide rings of rays around it.
        let mut directions = vec![axis];
        if tangent > 0.0 {
            let (u, v) = axis.any_orthonormal_pair();
            for share in RINGS {
                for k in 0..AROUND {
                    let turn = TAU * k as f64 / AROUND as f64;
                    directions.push(axis + share * tangent * (turn.cos() * u + turn.sin() * v));
                }
            }
        }
        directions.into_iter().filter_map(|way| self.range_m(stage, shot, way)).collect()
    }

    /// Range of the echo, m, where a shot would hit the target in another direction.
    fn range_m(&self, stage: &Stage, shot: &Shot, direction: DVec3) -> Option<f64> {
        let ray = Ray { direction: Direction::new(direction)?, ..shot.ray };
        let hit = if self.effects.iter().any(|(effect, _)| effect.moves()) {
            self.placed(stage, Shot { ray, ..*shot })?.hit
        } else {
            stage.geometry.bvh.closest(&ray)?
        };
        Some(stage.range_m(ray.origin, &hit))
    }

    /// The mean echo of one shot by itself: equation (11) with every effect on the surface and the gain.
    pub(crate) fn arrived(&self, stage: &Stage, shot: &Shot) -> MeanEcho {
        let at = Intersection::of_shot(stage, shot);
        let f_per_sr = match at.way_back {
            None => self.seen(stage, shot, stage.widening_of_shot_rad(shot)).f_per_sr,
            Some(_) => bistatic_per_sr(stage, &self.laws, &at),
        };
        let power_w = self.gain(stage, shot) * self.scattered_w(stage, &at, f_per_sr);
        MeanEcho::at_once(power_w, at.range_m())
    }

    /// What a beam of a divergence, rad, sees of the scattering model of a shot without effects.
    pub(crate) fn seen(&self, stage: &Stage, shot: &Shot, beam_rad: f64) -> Seen {
        let Some(law) = self.laws.get(usize::from(shot.region)) else { return Seen::default() };
        match stage.antenna {
            None => law.seen_by(beam_rad, shot.to_radar(), shot.to_radar()),
            Some(antenna) => WayBack::new(&antenna, stage, shot).seen(law, beam_rad),
        }
    }

    /// Applies the effects that act on the echoes of all shots together.
    pub(crate) fn arrive(
        &self,
        stage: &Stage,
        shots: &[Shot],
        cache: &PredictionCache,
        arrived: &mut [Option<MeanEcho>],
    ) {
        for (effect, values) in &self.effects {
            let Some(depends) = effect.survey_key(values) else { continue };
            let key: Key = (effect.name(), depends);
            let shaded = cache.shaded.get_or_make((key.clone(), self.laws.clone()), || {
                let make = || effect.survey(values, stage, shots);
                effect.shade(&cache.surveys.get_or_make(key, make), &self.laws)
            });
            effect.arrive(values, &shaded, arrived);
        }
    }

    /// The receiver with the effects on it.
    pub(crate) fn received(&self) -> Receiver {
        let mut receiver = self.receiver;
        for (effect, values) in &self.effects {
            receiver = effect.receive(values, receiver);
        }
        receiver
    }

    /// Equation (11) with every effect on the surface, W.
    fn scattered_w(&self, stage: &Stage, at: &Intersection, law_per_sr: f64) -> f64 {
        let Intersection { shot, way_back, .. } = at;
        let Some(law) = self.laws.get(usize::from(shot.region)) else { return 0.0 };
        let mut f_per_sr = law_per_sr;
        for (effect, values) in &self.effects {
            f_per_sr = effect.scatter(values, stage, law, shot, f_per_sr);
        }
        if let Some(way) = way_back {
            let flux_w = stage.link.flux_w(shot.hit.cos_theta);
            return flux_w * f_per_sr * way.projected_sr * stage.link.air_share(2.0 * way.range_m);
        }
        let beam = stage.beam(shot);
        let power_w = stage.link.power_w(&beam, shot.hit.range_m, shot.hit.cos_theta, f_per_sr);
        shot.by_sheets * power_w
    }

    /// The products of all gains of some shots; 0 of a shot that misses.
    fn gains(&self, stage: &Stage, shots: &[Option<Intersection>]) -> Vec<f64> {
        let mut gains: Vec<f64> =
            shots.iter().map(|shot| f64::from(u8::from(shot.is_some()))).collect();
        let shots: Vec<Option<&Shot>> =
            shots.iter().map(|shot| shot.as_ref().map(|at| &at.shot)).collect();
        for (effect, values) in &self.effects {
            effect.multiply_gains(values, stage, &shots, &mut gains);
        }
        gains
    }

    /// The product of all gains of a shot, whose law gives `f_per_sr` without effects; `None` where effects change that.
    pub(crate) fn gain_alone(&self, stage: &Stage, shot: &Shot, f_per_sr: f64) -> Option<f64> {
        let law = self.laws.get(usize::from(shot.region))?;
        let is_left = |(effect, values): &(&dyn Effect, Vec<f64>)| {
            effect.scatter(values, stage, law, shot, f_per_sr) == f_per_sr
        };
        self.effects.iter().all(is_left).then(|| self.gain(stage, shot))
    }

    /// The product of all gains of a shot.
    fn gain(&self, stage: &Stage, shot: &Shot) -> f64 {
        self.effects.iter().map(|(effect, values)| effect.gain(values, stage, shot)).product()
    }
}

/// A number of each shot, computed for those of a task at once.
fn in_tasks(
    shots: &[Option<Intersection>],
    compute: impl Fn(&[Option<Intersection>]) -> Vec<f64> + Sync,
) -> Vec<f64> {
    let mut numbers = vec![0.0; shots.len()];
    let tasks = numbers.par_chunks_mut(SHOTS_PER_TASK).zip(shots.par_chunks(SHOTS_PER_TASK));
    tasks.for_each(|(numbers, shots)| numbers.copy_from_slice(&compute(shots)));
    numbers
}

/// f of the laws in backscatter without effects, 1/sr, of every shot that hits the target; 0 of any other.
fn retro_per_sr(stage: &Stage, laws: &[Retro], shots: &[Option<Intersection>]) -> Vec<f64> {
    let mut f_per_sr = vec![0.0; shots.len()];
    for (region, law) in (0..).zip(laws) {
        let mut places = Vec::with_capacity(shots.len());
        let mut looks = Vec::with_capacity(shots.len());
        for (at, hit) in shots.iter().enumerate() {
            if let Some(hit) = hit.as_ref().filter(|hit| hit.shot.region == region) {
                places.push(at);
                looks.push((stage.widening_of_shot_rad(&hit.shot), hit.to_radar));
            }
        }
        for (at, one_per_sr) in places.into_iter().zip(law.per_sr(&looks)) {
            f_per_sr[at] = one_per_sr;
        }
    }
    f_per_sr
}

/// f of the law of a shot without effects, 1/sr, on its way to an antenna apart from the radar's, which receives the
/// polarisation that was sent. 0 of a shot without such a way.
fn bistatic_per_sr(stage: &Stage, laws: &[Brdf], hit: &Intersection) -> f64 {
    let Intersection { shot, way_back: Some(way), .. } = hit else { return 0.0 };
    let Some(law) = laws.get(usize::from(shot.region)) else { return 0.0 };
    let beam_rad = stage.divergence_rad(shot);
    let seen = way.seen(law, beam_rad);
    // Lobes that include the beam that saw them are not widened again; their parts are.
    let widening_rad = stage.widening_rad(shot.region, beam_rad);
    let f_per_sr =
        if widening_rad == beam_rad { seen.f_per_sr } else { way.seen(law, widening_rad).f_per_sr };
    let polarisation = &stage.geometry.radar.polarisation;
    f_per_sr * way.co_polar_share(polarisation, law, seen.specular_share)
}

/// A shot with its normal tilted by these tangents, along the plane of incidence and across it; `None` if the facet then
/// faces away.
fn tilted(shot: &Option<Intersection>, by: [f64; 2]) -> Option<Intersection> {
    let Intersection { shot, to_radar, way_back } = shot.as_ref()?;
    let cos_theta = tilted_cos_theta(shot.hit.cos_theta, by)?;
    let shot = Shot { hit: Hit { cos_theta, ..shot.hit }, ..*shot };
    Some(Intersection { shot, to_radar: to_radar.turned(cos_theta), way_back: *way_back })
}
