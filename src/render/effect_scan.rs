//! Applies the effects of a setup to the echoes at an antenna.
//!
//! Every ray of a chirp is a [`Shot`], of which a [`Model`] predicts the intersection and the mean power of the single
//! path. Effects on a whole echo ([`Effect::arrive`](crate::effects::Effect::arrive)) act on the sum over the paths of
//! a chirp, and every path gets its share of the change. Of all effects, only the gains of the instrument act on
//! second-order paths.

use glam::{DVec2, DVec3};

use super::error::RenderError;
use super::observer::Observer;
use super::path::Path;
use super::setup::Setup;
use super::spot::{Footprints, Intersection};
use super::surface::Orientation;
use crate::brdf::Seen;
use crate::effects::{
    Conflict, Level, MeanEcho, Model, PredictionCache, Receiver, Setting, Shot, Stage, mean,
    shot_at, tilted_cos_theta,
};
use crate::frames::{Global, Ray};
use crate::radar::random::{Key, Purpose};
use crate::radar::{Channel, Link};
use crate::trace::{Hit, ScanGeometry, closest};

/// The model of a setup, prepared for its scan.
pub(super) struct EffectScan<'a> {
    setup: Setup<'a>,
    observer: Observer,
    model: &'a Model<'a>,
    /// The model without effects.
    bare: Model<'a>,
    link: Link,
    grain_of_region: Vec<DVec3>,
    seen_lobe_rad: Vec<Option<f64>>,
    middle: DVec3,
    /// Point of every chirp's ray at 8 m in the target frame, m.
    places: Vec<DVec2>,
    progress: Vec<f64>,
    receiver: Receiver,
}

impl<'a> EffectScan<'a> {
    /// Of the echoes at an antenna; `None` for a setup without effects.
    pub fn new(setup: &Setup<'a>, observer: Observer) -> Option<EffectScan<'a>> {
        let model = setup.effects?;
        let mut effects = EffectScan {
            setup: *setup,
            observer,
            model,
            bare: Model { effects: Vec::new(), ..model.clone() },
            link: Link::new(setup.geometry.radar),
            grain_of_region: setup.surfaces.iter().map(|surface| surface.grain).collect(),
            seen_lobe_rad: setup.surfaces.iter().map(|surface| surface.seen_lobe_rad).collect(),
            middle: DVec3::ZERO,
            places: setup.geometry.chirps.target_points_m(&setup.geometry.radar.frames()).collect(),
            progress: setup.geometry.chirps.progress(),
            receiver: model.received(),
        };
        // Where the axes of the beams hit the target where the scene places it.
        let ScanGeometry { chirps, bvh, .. } = setup.geometry;
        let hits = closest(bvh, &chirps.rays);
        effects.middle = mean(hits.iter().flatten().map(|hit| hit.point.xyz));
        Some(effects)
    }

    /// The receiver with the effects on it.
    pub fn receiver(&self) -> Receiver {
        self.receiver
    }

    /// The intersection of a ray with the target where the effects place it. `hit` is its hit where the scene places the
    /// target.
    pub fn meet(&self, chirp: usize, ray: &Ray<Global>, hit: Option<Hit>) -> Intersection {
        // A ray that misses may hit the target after the effects have moved it.
        let shot =
            hit.map_or(self.missed_shot(chirp, *ray), |hit| self.shot(chirp, *ray, hit, None));
        match self.model.placed(&self.stage(), shot) {
            Some(placed) if placed == shot => (hit, None),
            Some(placed) if !placed.misses() => {
                let Shot { hit, normal, azimuth_rad, .. } = placed;
                (Some(hit), Some(Orientation { normal, azimuth_rad }))
            }
            _ => (None, None),
        }
    }

    /// Whether effects act on the whole echoes of all chirps together.
    pub fn acts_on_echoes(&self) -> bool {
        self.model.effects.iter().any(|(effect, values)| effect.survey_key(values).is_some())
    }

    /// Applies the effects to a single path, by way of a surface of which the antenna sees `f_per_sr`, with a normal towards the
    /// radar where the mesh has it. `orientation` is that of a surface that effects have moved.
    pub fn direct(
        &self,
        path: Path,
        (f_per_sr, normal): (f64, DVec3),
        (chirp, ray, rays): (usize, &Ray<Global>, usize),
        orientation: Option<Orientation>,
        tilts: [f64; 2],
    ) -> Path {
        let stage = Stage { on_wavefront: rays > 1, ..self.stage() };
        let shot = match orientation {
            Some(_) => self.traced_shot(chirp, ray, path.hit, orientation),
            None => {
                let lies = Orientation { normal, azimuth_rad: path.azimuth_rad };
                self.shot(chirp, *ray, path.hit, Some(lies))
            }
        };
        if orientation.is_none()
            && tilts == [0.0; 2]
            && let Some(gain) = self.model.gain_alone(&stage, &shot, f_per_sr)
        {
            return Path { power_w: path.power_w * gain, ..path };
        }
        let with_w =
            tilted(&shot, tilts).map_or(0.0, |shot| self.model.arrived(&stage, &shot).power_w);
        let Some(Orientation { azimuth_rad, .. }) = orientation else {
            // Without a change the path stays the same bit for bit.
            let bare_w = self.bare.arrived(&stage, &shot).power_w;
            return if with_w == bare_w {
                path
            } else if self.setup.has_sheets() && bare_w > 0.0 {
                // The model knows no sheets: what it changes is a factor.
                Path { power_w: path.power_w * (with_w / bare_w), ..path }
            } else {
                Path { power_w: with_w / rays as f64, ..path }
            };
        };
        let seen = self.model.seen(&stage, &shot, stage.divergence_rad(&shot));
        let Seen { specular_share, coherent_share, .. } = seen;
        let power_w = with_w / rays as f64;
        Path { power_w, azimuth_rad, specular_share, coherent_share, ..path }
    }

    /// Gain of the effects of the instrument on the power of one ray of a chirp, as a ratio.
    pub fn instrument_gain(
        &self,
        chirp: usize,
        ray: &Ray<Global>,
        hit: Hit,
        orientation: Option<Orientation>,
    ) -> f64 {
        let (stage, shot) = (self.stage(), self.traced_shot(chirp, ray, hit, orientation));
        let instrument = self.model.effects.iter().filter(|(e, _)| e.level() == Level::Instrument);
        instrument.map(|(effect, values)| effect.gain(values, &stage, &shot)).product()
    }

    /// Draws the tangents of the two tilts of the normals under a chirp.
    pub fn tilts(&self, chirp: usize) -> [f64; 2] {
        let sd_rad = self.receiver.tilt_sd_rad;
        if sd_rad == 0.0 {
            return [0.0; 2];
        }
        let (seed, chirp, purpose) = (self.setup.seed, chirp as u64, Purpose::Tilt);
        let mut draws = Key { seed, chirp, sub_ray: Observer::Radar.number(), purpose }.draws();
        [(); 2].map(|()| (sd_rad * draws.gaussian()).tan())
    }

    /// The change of every chirp's whole echo by the effects, from the sums over its paths; `None` without a change.
    pub fn changes(
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

    /// The shot of a chirp's first ray that hits the target.
    fn first_shot(&self, footprints: &Footprints, chirp: usize) -> Option<Shot> {
        let first = chirp * footprints.rays_per_chirp;
        let mut rays = first..first + footprints.rays_per_chirp;
        let (hit, ray) = rays.find_map(|ray| Some((footprints.hits[ray]?, ray)))?;
        let orientation = footprints.orientations.get(ray).copied().flatten();
        Some(self.traced_shot(chirp, &self.setup.geometry.chirps.rays[chirp], hit, orientation))
    }

    fn stage(&self) -> Stage<'_> {
        Stage {
            geometry: self.setup.geometry,
            link: self.link,
            grain_of_region: &self.grain_of_region,
            seen_lobe_rad: &self.seen_lobe_rad,
            on_wavefront: false,
            antenna: self.observer.antenna(),
            middle: self.middle,
        }
    }

    /// The shot of a ray with a hit on the target where the effects place it.
    fn traced_shot(
        &self,
        chirp: usize,
        ray: &Ray<Global>,
        hit: Hit,
        orientation: Option<Orientation>,
    ) -> Shot {
        let shot = self.shot(chirp, *ray, hit, orientation);
        let moved = orientation.and_then(|_| self.model.target(&self.stage(), &shot));
        Shot { target: moved.unwrap_or(shot.target), ..shot }
    }

    /// The shot of a ray with a hit. Without `orientation` the surface lies as the mesh has it.
    fn shot(
        &self,
        chirp: usize,
        ray: Ray<Global>,
        hit: Hit,
        orientation: Option<Orientation>,
    ) -> Shot {
        let missed = self.missed_shot(chirp, ray);
        let Some(Orientation { normal, azimuth_rad }) = orientation else {
            return shot_at(&self.stage(), &missed, hit);
        };
        let region = self.setup.geometry.region_of_facet[hit.facet as usize];
        Shot { hit, normal, azimuth_rad, region, ..missed }
    }

    /// The shot of a ray that misses the target.
    fn missed_shot(&self, chirp: usize, ray: Ray<Global>) -> Shot {
        let missed = Shot::missed(self.setup.geometry.chirps, chirp, self.progress[chirp]);
        let DVec2 { x: xt_m, y: yt_m } = self.places[chirp];
        Shot { ray, normal: -ray.direction.xyz(), xt_m, yt_m, ..missed }
    }
}

/// The change of a whole echo by the effects.
#[derive(Clone, Copy)]
pub(super) struct Change {
    before: MeanEcho,
    after: MeanEcho,
}

impl Change {
    /// Applies the change to the paths of the echo: powers in proportion, ranges by the same shift.
    pub fn apply(&self, paths: &mut [Path]) {
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

/// The shot with its normal tilted in the plane of incidence and across it, by these tangents; `None` if the facet then
/// faces away.
fn tilted(shot: &Shot, [along, across]: [f64; 2]) -> Option<Shot> {
    if along == 0.0 && across == 0.0 {
        return Some(*shot);
    }
    let cos_theta = tilted_cos_theta(shot.hit.cos_theta, [along, across])?;
    Some(Shot { hit: Hit { cos_theta, ..shot.hit }, ..*shot })
}

/// Refuses effects that would be counted twice, and those without a meaning at the antenna.
pub(super) fn check(setup: &Setup, rays: usize, observer: Observer) -> Result<(), RenderError> {
    let Some(model) = setup.effects else { return Ok(()) };
    for (acting, _) in &model.effects {
        let effect = acting.about();
        if setup.channel == Channel::CrossPolar {
            return Err(RenderError::Effect {
                effect: effect.name,
                problem: "acts on the co-polar echoes, and nothing says what it does to the cross-polar ones",
                way_out: "remove radar.polarisation.receive, or the effect",
            });
        }
        let conflict = effect.conflicts.iter().find(|conflict| match conflict.with {
            Setting::SeveralRays => rays > 1,
            Setting::Bounce => setup.bounce.is_some(),
            Setting::RangeReceiver => setup.geometry.radar.receiver.is_some(),
            Setting::Sheets => setup.has_sheets(),
            Setting::OtherAntenna => observer != Observer::Radar,
        });
        if let Some(&Conflict { problem, way_out, .. }) = conflict {
            return Err(RenderError::Effect { effect: effect.name, problem, way_out });
        }
    }
    Ok(())
}
