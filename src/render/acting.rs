//! The effects of a setup, acting on the radar's own echoes.
//!
//! Every ray of a chirp is a [`Shot`] that a [`Model`] predicts: where it meets the target, and the
//! mean power that comes straight back. What the model makes of a whole echo
//! ([`Effect::arrive`](crate::effects::Effect::arrive)) it makes of the sum over the paths of the
//! chirp, and every path has its share of the change. Second-order paths know the gains of the
//! instrument and nothing else of the effects.

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::error::RenderError;
use super::observer::Observer;
use super::path::Path;
use super::setup::Setup;
use super::spot::{Footprints, Intersection};
use super::surface::{Facing, LocalFrame};
use crate::brdf::Scattering;
use crate::effects::{
    Conflict, Level, MeanEcho, Model, PredictionCache, Receiver, Setting, Shot, Stage, middle,
    tilted_cos_theta,
};
use crate::frames::{Direction, Global, Point, Pose, Ray, Surface};
use crate::radar::Link;
use crate::radar::random::{Key, Purpose};
use crate::trace::{Hit, ScanGeometry};

/// The model of a setup, made ready for its scan.
pub(super) struct Acting<'a> {
    setup: Setup<'a>,
    model: &'a Model<'a>,
    /// The same without effects.
    bare: Model<'a>,
    link: Link,
    grain_of_region: Vec<DVec3>,
    middle: DVec3,
    /// Where the ray of every chirp passes 8 m in the target frame, m.
    places: Vec<DVec2>,
    progress: Vec<f64>,
    receiver: Receiver,
}

/// The facet of a ray that has met nothing yet.
const NOWHERE: u32 = u32::MAX;

impl<'a> Acting<'a> {
    /// `None` for a setup without effects.
    pub fn new(setup: &Setup<'a>) -> Option<Acting<'a>> {
        let model = setup.effects?;
        let mut acting = Acting {
            setup: *setup,
            model,
            bare: Model { effects: Vec::new(), ..model.clone() },
            link: Link::new(setup.geometry.radar),
            grain_of_region: setup.surfaces.iter().map(|surface| surface.grain).collect(),
            middle: DVec3::ZERO,
            places: setup.geometry.chirps.target_points_m(&setup.geometry.radar.frames()).collect(),
            progress: setup.geometry.chirps.progress(),
            receiver: model.received(),
        };
        acting.middle = middle(&acting.shots());
        Some(acting)
    }

    /// The receiver's law with the effects.
    pub fn receiver(&self) -> Receiver {
        self.receiver
    }

    /// What a ray of a chirp meets, from what it hits where the scene has the target.
    pub fn meet(&self, chirp: usize, ray: &Ray<Global>, hit: Option<Hit>) -> Intersection {
        // A ray that misses may still meet a target that has moved.
        let shot = hit.map_or(self.blank(chirp, *ray), |hit| self.shot(chirp, *ray, hit, None));
        match self.model.placed(&self.stage(), shot) {
            Some(placed) if placed == shot => (hit, None),
            Some(Shot { hit, normal, azimuth_rad, .. }) if hit.facet != NOWHERE => {
                (Some(hit), Some(Facing { normal, azimuth_rad }))
            }
            _ => (None, None),
        }
    }

    /// A direct path, given without effects, with them.
    pub fn direct(
        &self,
        path: Path,
        chirp: usize,
        rays: usize,
        facing: Option<Facing>,
        tilts: [f64; 2],
    ) -> Path {
        let (stage, shot) = (self.stage(), self.seen(chirp, rays, path.hit, facing));
        let with_w =
            tilted(&shot, tilts).map_or(0.0, |shot| self.model.arrived(&stage, &shot).power_w);
        let Some(Facing { azimuth_rad, .. }) = facing else {
            // Where nothing acts, not even rounding may differ.
            let same = with_w == self.bare.arrived(&stage, &shot).power_w;
            return if same { path } else { Path { power_w: with_w / rays as f64, ..path } };
        };
        let retro = Direction::<Surface>::from_angles(shot.hit.theta_rad(), azimuth_rad);
        let law = self.model.laws.get(usize::from(shot.region));
        let specular_share = law.map_or(0.0, |law| law.specular_share(retro, retro));
        Path { power_w: with_w / rays as f64, azimuth_rad, specular_share, ..path }
    }

    /// Factor of the instrument on all that comes back through a ray of a chirp, a ratio.
    pub fn instrument_gain(
        &self,
        chirp: usize,
        rays: usize,
        hit: Hit,
        facing: Option<Facing>,
    ) -> f64 {
        let (stage, shot) = (self.stage(), self.seen(chirp, rays, hit, facing));
        let instrument = self.model.effects.iter().filter(|(e, _)| e.level() == Level::Instrument);
        instrument.map(|(effect, values)| effect.gain(values, &stage, &shot)).product()
    }

    /// Tangents of the two tilts of the normals under a chirp.
    pub fn tilts(&self, chirp: usize) -> [f64; 2] {
        let sd_rad = self.receiver.tilt_sd_rad;
        if sd_rad == 0.0 {
            return [0.0; 2];
        }
        let (seed, chirp, purpose) = (self.setup.seed, chirp as u64, Purpose::Tilt);
        let mut draws = Key { seed, chirp, sub_ray: Observer::Radar.number(), purpose }.draws();
        [(); 2].map(|()| (sd_rad * draws.gaussian()).tan())
    }

    /// What the effects make of the sums over the paths of all chirps.
    pub fn arrive(
        &self,
        footprints: &Footprints,
        sums: Vec<Option<MeanEcho>>,
    ) -> Vec<Option<Change>> {
        let chirps: Vec<(usize, Shot, MeanEcho)> = sums
            .iter()
            .enumerate()
            .filter_map(|(chirp, sum)| Some((chirp, self.first_shot(footprints, chirp)?, (*sum)?)))
            .collect();
        let shots: Vec<Shot> = chirps.iter().map(|(_, shot, _)| *shot).collect();
        let mut after: Vec<Option<MeanEcho>> =
            chirps.iter().map(|(_, _, sum)| Some(*sum)).collect();
        self.model.arrive(&self.stage(), &shots, &PredictionCache::default(), &mut after);
        let mut changes = vec![None; sums.len()];
        for ((chirp, _, before), after) in chirps.into_iter().zip(after.into_iter().flatten()) {
            changes[chirp] = (before != after).then_some(Change { before, after });
        }
        changes
    }

    /// The first ray of a chirp that meets the target.
    fn first_shot(&self, footprints: &Footprints, chirp: usize) -> Option<Shot> {
        let hits = footprints.hits.iter().zip(0..).skip(chirp * footprints.rays_per_chirp);
        let mut hits = hits.take(footprints.rays_per_chirp);
        let (hit, index) = hits.find_map(|(hit, index)| Some(((*hit)?, index)))?;
        let facing = footprints.facings.get::<usize>(index).copied().flatten();
        Some(self.seen(chirp, footprints.rays_per_chirp, hit, facing))
    }

    fn stage(&self) -> Stage<'_> {
        Stage {
            geometry: self.setup.geometry,
            link: self.link,
            grain_of_region: &self.grain_of_region,
            middle: self.middle,
        }
    }

    /// One shot for every chirp whose axis meets the target where the scene places it.
    fn shots(&self) -> Vec<Shot> {
        let ScanGeometry { chirps, bvh, .. } = self.setup.geometry;
        let rays = chirps.rays.par_iter().enumerate();
        let shots =
            rays.filter_map(|(chirp, ray)| Some(self.shot(chirp, *ray, bvh.closest(ray)?, None)));
        shots.collect()
    }

    /// A ray of a chirp where it was traced to.
    fn seen(&self, chirp: usize, rays: usize, hit: Hit, facing: Option<Facing>) -> Shot {
        let axis = self.setup.geometry.chirps.rays[chirp];
        let ray = match axis.origin.towards(hit.point) {
            Some(direction) if rays > 1 => Ray { direction, ..axis },
            _ => axis,
        };
        let shot = self.shot(chirp, ray, hit, facing);
        let moved = facing.and_then(|_| self.model.target(&self.stage(), &shot));
        Shot { target: moved.unwrap_or(shot.target), ..shot }
    }

    fn shot(&self, chirp: usize, ray: Ray<Global>, hit: Hit, facing: Option<Facing>) -> Shot {
        let region = self.setup.geometry.region_of_facet[hit.facet as usize];
        let Facing { normal, azimuth_rad } = facing.unwrap_or_else(|| {
            let back = -ray.direction.xyz();
            let grain = self.grain_of_region[usize::from(region)];
            let frame = LocalFrame::new(self.setup.geometry.bvh.mesh(), &hit, back, grain);
            let [x, y, _] = frame.local(back).xyz().to_array();
            Facing { normal: frame.normal, azimuth_rad: y.atan2(x) }
        });
        Shot { hit, normal, azimuth_rad, region, ..self.blank(chirp, ray) }
    }

    /// A ray that has met nothing.
    fn blank(&self, chirp: usize, ray: Ray<Global>) -> Shot {
        let chirps = self.setup.geometry.chirps;
        Shot {
            chirp: chirps.number[chirp],
            time_s: chirps.time_s[chirp],
            progress: self.progress[chirp],
            ray,
            hit: Hit {
                facet: NOWHERE,
                range_m: 0.0,
                point: Point::from(DVec3::ZERO),
                cos_theta: 1.0,
            },
            normal: -ray.direction.xyz(),
            target: Pose::NONE,
            azimuth_rad: 0.0,
            region: 0,
            xt_m: self.places[chirp].x,
            yt_m: self.places[chirp].y,
            edge_m: 0.0,
        }
    }
}

/// What the effects make of a whole echo.
#[derive(Clone, Copy)]
pub(super) struct Change {
    before: MeanEcho,
    after: MeanEcho,
}

impl Change {
    /// Gives every path its share.
    pub fn share_out(&self, paths: &mut [Path]) {
        let Change { before, after } = *self;
        let count = paths.len().max(1) as f64;
        for path in paths {
            path.power_w = if before.power_w > 0.0 {
                path.power_w * (after.power_w / before.power_w)
            } else {
                after.power_w / count
            };
            path.range_m += after.range_m - before.range_m;
        }
    }
}

/// The shot with its normal tilted in the plane of incidence and across it; `None` where the facet
/// then shows its back.
fn tilted(shot: &Shot, [along, across]: [f64; 2]) -> Option<Shot> {
    if along == 0.0 && across == 0.0 {
        return Some(*shot);
    }
    let cos_theta = tilted_cos_theta(shot.hit.theta_rad(), [along, across])?;
    Some(Shot { hit: Hit { cos_theta, ..shot.hit }, ..*shot })
}

/// Refuses what would be counted twice, and effects at another antenna.
pub(super) fn check(setup: &Setup, rays: usize, observer: Observer) -> Result<(), RenderError> {
    let Some(model) = setup.effects else { return Ok(()) };
    for (effect, _) in &model.effects {
        let effect = effect.about();
        if observer != Observer::Radar {
            return Err(RenderError::Effect {
                effect: effect.name,
                problem: "acts on the radar's own echoes, and nothing says what it does at another antenna",
                way_out: "remove [[receiver]], or the effect",
            });
        }
        let conflict = effect.conflicts.iter().find(|conflict| match conflict.with {
            Setting::SeveralRays => rays > 1,
            Setting::Bounce => setup.bounce.is_some(),
            Setting::RangeReceiver => setup.geometry.radar.receiver.is_some(),
        });
        if let Some(&Conflict { problem, way_out, .. }) = conflict {
            return Err(RenderError::Effect { effect: effect.name, problem, way_out });
        }
    }
    Ok(())
}
