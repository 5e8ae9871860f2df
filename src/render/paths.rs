//! The paths of power from the radar to an antenna.
//!
//! Single path: radar → A → antenna, equation (11) with the bistatic f(i, o). The spot's power P_t falls
//! on A, and the antenna, which A sees in the solid angle Ω, receives the share f(i, o)·cos θ_o·Ω of it. The
//! other factor cos θ_i of the paper is part of [`Link::flux_w`].
//!
//! Second-order path: radar → A → B → antenna. A scatters the share f_A(i, ω)·cos θ_ω·dω of its power into the
//! direction ω of B, and the antenna receives the share f_B(−ω, o)·cos θ_o·Ω of that. `bounce.rs` estimates
//! the integral over ω. The range is half the path length.
//!
//! Where a path crosses sheets, it loses power and seems longer by what `sheet.rs` says. A sheet is also a surface: every
//! ray has a single path from each sheet that it meets, and from what lies behind.

use std::convert::Infallible;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::behind::{LIFT_M, Way, follow, passage};
use super::bounce::{Bounce, directions};
use super::coherent::{RayPath, SpotRays, smooth_pieces};
use super::effect_scan::{Change, EffectScan};
use super::observer::Observer;
use super::path::{Path, sum};
use super::setup::Setup;
use super::sheet::{Passage, passed_share};
use super::spot::{self, Footprints, Spot};
use super::surface::{Orientation, Surface};
use crate::brdf::{NarrowLobe, Retro, Seen};
use crate::effects::MeanEcho;
use crate::frames::{Direction, Global, Point, Ray, Surface as Local};
use crate::radar::jones::Field;
use crate::radar::random::{Key, Purpose};
use crate::radar::{Channel, Detection, Link};
use crate::trace::{Hit, LocalFrame};

/// Computes the paths of a scan to one antenna.
pub(super) struct Paths<'a> {
    setup: &'a Setup<'a>,
    observer: Observer,
    link: Link,
    /// The rays of a spot, and the share of the power sent that falls on each.
    samples: Vec<DVec2>,
    lit_shares: Vec<f64>,
    footprints: &'a Footprints,
    effects: Option<EffectScan<'a>>,
    /// The smooth piece that each facet belongs to; empty where no spot can reach beyond what returns a wave.
    pieces: Vec<u32>,
    /// The laws of the regions as the radar sees them; empty for another observer.
    retros: Vec<Retro<'a>>,
    /// The change of each chirp's whole echo by the effects; empty without effects.
    changes: Vec<Option<Change>>,
}

/// One chirp and the position of the antenna that receives it.
struct Emission<'a> {
    paths: &'a Paths<'a>,
    number: usize,
    spot: Spot,
    antenna: DVec3,
    /// Number of rays that share its power.
    rays: usize,
    /// Tangents of the tilts of all normals by the effects.
    tilts: [f64; 2],
}

/// An illuminated point of the target.
struct ShadingPoint<'a> {
    hit: Hit,
    surface: Surface<'a>,
    frame: LocalFrame,
    /// Direction to the source.
    source: Direction<Local>,
    /// Direction to the antenna.
    antenna: Direction<Local>,
    /// Distance to the antenna, m.
    antenna_m: f64,
    /// Solid angle in which the antenna is seen, sr.
    solid_angle_sr: f64,
    /// Divergence of the beam there, rad.
    beam_rad: f64,
    /// The sheets on the way of the ray that illuminates it.
    inward: Passage,
}

/// A point that a ray of a chirp illuminates.
struct RayPoint<'a> {
    /// Place of the chirp among those that are computed at once.
    chirp: usize,
    /// Number of the ray in its spot.
    sample: usize,
    ray: Ray<Global>,
    lit: ShadingPoint<'a>,
}

/// What a channel of the antenna receives of the power on a path.
struct Polarised {
    /// Share of the power.
    share: f64,
    /// Share that the sheets on the path let through.
    passed: f64,
}

/// Power on its way to a second surface.
struct Onward {
    direction: Direction<Local>,
    /// Its share of the power on the first surface.
    share: f64,
    /// What the first surface scatters.
    first: Seen,
    /// Roughness of a lobe that the direction stands for.
    m: f64,
}

impl ShadingPoint<'_> {
    /// Share of the power on the point that the antenna receives if nothing occludes it.
    fn received_share(&self, scattered: Seen) -> f64 {
        self.antenna.cos_theta().max(0.0) * scattered.f_per_sr * self.solid_angle_sr
    }

    /// Range of the echo of a sheet behind its outer face, m: that of what it reflects like a mirror.
    fn echo_behind_m(&self, scattered: Seen) -> f64 {
        let Some(sheet) = self.surface.sheet else { return 0.0 };
        let half = (self.source.xyz() + self.antenna.xyz()).normalize_or(DVec3::Z);
        sheet.echo_behind_m(half.dot(self.source.xyz())) * scattered.specular_share
    }
}

/// By how much sheets lengthen some ways, m.
fn delay_m(ways: &[Passage]) -> f64 {
    ways.iter().map(|way| way.delay_m()).sum()
}

/// In place of a smooth piece, for a hit that the antenna does not see.
const UNSEEN: u32 = u32::MAX;

impl<'a> Paths<'a> {
    pub fn new(
        setup: &'a Setup<'a>,
        observer: Observer,
        footprints: &'a Footprints,
        effects: Option<EffectScan<'a>>,
    ) -> Paths<'a> {
        let link = Link::new(setup.geometry.radar);
        let samples = spot::samples(footprints.rays_per_chirp);
        let lit_shares = spot::lit_shares(footprints.rays_per_chirp);
        let pieces = match footprints.rays_per_chirp {
            1 => Vec::new(),
            _ if setup.has_waves() => {
                let geometry = &setup.geometry;
                smooth_pieces(geometry.bvh.mesh(), geometry.region_of_facet)
            }
            _ => Vec::new(),
        };
        let retros = match observer {
            Observer::Radar => {
                setup.surfaces.iter().map(|surface| Retro::new(surface.scattering)).collect()
            }
            Observer::Receiver { .. } => Vec::new(),
        };
        let mut paths = Paths {
            setup,
            observer,
            link,
            samples,
            lit_shares,
            footprints,
            effects,
            pieces,
            retros,
            changes: Vec::new(),
        };
        paths.changes =
            paths.effects.as_ref().map_or(Vec::new(), |effects| paths.changes_by(effects));
        paths
    }

    /// The change of every whole echo by the effects. It depends on all echoes of the scan, so that all paths are
    /// computed once more before.
    fn changes_by(&self, effects: &EffectScan) -> Vec<Option<Change>> {
        let Ok(sums) = self.of_all::<_, Infallible>(&|_| {}, |_, _, paths, sums| {
            let Detection { power_w, range_m } = sum(paths);
            sums.push((!paths.is_empty()).then_some(MeanEcho::at_once(power_w, range_m)));
            Ok(())
        });
        effects.changes(self.footprints, sums)
    }

    /// What `each` appends to a list for every chirp, from its number, its hits and its paths, in the order of the chirps, on
    /// all threads. `done` is called repeatedly with the number of chirps that were finished since the last call.
    ///
    /// # Errors
    /// An error of `each`.
    pub fn of_all<T: Send, E: Send>(
        &self,
        done: &(dyn Fn(usize) + Sync),
        each: impl Fn(usize, &[Option<Hit>], &mut Vec<Path>, &mut Vec<T>) -> Result<(), E> + Sync,
    ) -> Result<Vec<T>, E> {
        /// Rays of a task. With second-order paths every chirp is a task.
        const RAYS: usize = 256;
        let rays = self.rays_per_chirp();
        let chirps = if self.setup.bounce.is_some() { 1 } else { (RAYS / rays).max(1) };
        let tasks = self.footprints.hits.par_chunks(chirps * rays).enumerate();
        let found = tasks.map(|(task, hits)| {
            let mut found = Vec::with_capacity(hits.len() / rays);
            self.of_some(task * chirps, hits, |chirp, hits, paths| {
                each(chirp, hits, paths, &mut found)
            })?;
            done(hits.len() / rays);
            Ok(found)
        });
        let mut all = Vec::new();
        for mut found in found.collect::<Result<Vec<Vec<T>>, E>>()? {
            all.append(&mut found);
        }
        Ok(all)
    }

    /// All paths of a chirp through the hits of its rays, including single paths without power.
    pub fn of_chirp(&self, number: usize, hits: &[Option<Hit>]) -> Vec<Path> {
        let mut of_chirp = Vec::new();
        let Ok(()) = self.of_some::<Infallible>(number, hits, |_, _, paths| {
            of_chirp.append(paths);
            Ok(())
        });
        of_chirp
    }

    /// Calls `each` with number, hits and paths of each chirp from `first` on. Their laws are evaluated at once.
    fn of_some<E>(
        &self,
        first: usize,
        hits: &[Option<Hit>],
        mut each: impl FnMut(usize, &[Option<Hit>], &mut Vec<Path>) -> Result<(), E>,
    ) -> Result<(), E> {
        let chirps = hits.chunks(self.rays_per_chirp());
        let emissions: Vec<Emission> = (first..)
            .zip(chirps.clone())
            .map(|(number, hits)| self.emission(number, hits))
            .collect();
        let mut points = Vec::with_capacity(hits.len());
        for (chirp, (emission, hits)) in emissions.iter().zip(chirps.clone()).enumerate() {
            emission.push_points(chirp, hits, &mut points);
        }
        let seen = self.seen(&emissions, &points);
        let mut points = points.into_iter().zip(seen).peekable();
        let (mut paths, mut direct) = (Vec::new(), Vec::new());
        for (chirp, (emission, hits)) in emissions.iter().zip(chirps).enumerate() {
            paths.clear();
            direct.clear();
            while let Some((point, seen)) = points.next_if(|(point, _)| point.chirp == chirp) {
                direct.push(RayPath { ray: point.sample, place: paths.len() });
                emission.scatter(&point, seen, &mut paths);
            }
            self.finish(emission.number, &direct, &mut paths);
            each(emission.number, hits, &mut paths)?;
        }
        Ok(())
    }

    fn rays_per_chirp(&self) -> usize {
        self.footprints.rays_per_chirp.max(1)
    }

    /// What each point scatters towards the antenna.
    fn seen(&self, emissions: &[Emission], points: &[RayPoint]) -> Vec<Seen> {
        if let Observer::Receiver { .. } = self.observer {
            return points.iter().map(|p| emissions[p.chirp].scattered(&p.lit)).collect();
        }
        let regions: Vec<usize> = points.iter().map(|point| self.region(&point.lit.hit)).collect();
        let mut by_region: Vec<usize> = (0..points.len()).collect();
        by_region.sort_by_key(|&place| regions[place]);
        let mut seen = vec![Seen::default(); points.len()];
        for here in by_region.chunk_by(|&a, &b| regions[a] == regions[b]) {
            let region = regions[here[0]];
            let (retro, surface) = (&self.retros[region], &self.setup.surfaces[region]);
            let lit = here.iter().map(|&place| &points[place].lit);
            let looks = lit.map(|lit| (lit.beam_rad, lit.source));
            for (&place, of_look) in here.iter().zip(surface.seen_straight_back(retro, looks)) {
                seen[place] = of_look;
            }
        }
        seen
    }

    /// Number of the region that a hit lies on.
    fn region(&self, hit: &Hit) -> usize {
        usize::from(self.setup.geometry.region_of_facet[hit.facet as usize])
    }

    /// What is common to the rays of a chirp.
    fn emission(&self, number: usize, hits: &[Option<Hit>]) -> Emission<'_> {
        let axis = &self.setup.geometry.chirps.rays[number];
        let antenna = self.observer.position(axis.origin.xyz);
        let range_m = self.footprints.axis_range_m[number];
        let spot = match hits.len() {
            1 => Spot::of_one_ray(&self.link.beam, axis, range_m),
            _ => Spot::met(&self.link.beam, axis, range_m, number),
        };
        let tilts = self.effects.as_ref().map_or([0.0; 2], |effects| effects.tilts(number));
        Emission { paths: self, number, spot, antenna, rays: hits.len(), tilts }
    }

    /// Changes the paths of a chirp by what depends on all of them; `direct` are those by way of one surface.
    fn finish(&self, number: usize, direct: &[RayPath], paths: &mut [Path]) {
        if !self.pieces.is_empty() {
            let rays = SpotRays { places: &self.samples, lit_shares: &self.lit_shares };
            rays.cut_waves(direct, paths);
        }
        if let Some(change) = self.changes.get(number).copied().flatten() {
            change.apply(paths);
        }
    }
}

impl<'a> Emission<'a> {
    /// Appends the points that the rays of the chirp illuminate; `chirp` is its place among those that are computed at once.
    fn push_points(&self, chirp: usize, hits: &[Option<Hit>], points: &mut Vec<RayPoint<'a>>) {
        let Paths { setup, footprints, samples, .. } = self.paths;
        for (sample, hit) in hits.iter().enumerate() {
            let Some((hit, ray)) = hit.zip(self.spot.ray(samples[sample])) else { continue };
            let lit = self.lit_by_beam(hit, &ray, Passage::FREE);
            points.push(RayPoint { chirp, sample, ray, lit });
            // Behind every sheet that the ray meets lies something else, or nothing.
            let (mut front, mut inward) = (hit, Passage::FREE);
            for behind in &footprints.behind {
                let Some(sheet) = setup.sheet(front.facet) else { break };
                let Some(hit) = behind.hits[self.number * hits.len() + sample] else { break };
                inward = inward.then(passage(setup, sheet, &front, ray.direction));
                let lit = self.lit_by_beam(hit, &ray, inward);
                points.push(RayPoint { chirp, sample, ray, lit });
                front = hit;
            }
        }
    }

    /// Appends the paths by way of a point, of which the antenna sees this.
    fn scatter(&self, point: &RayPoint, seen: Seen, paths: &mut Vec<Path>) {
        let RayPoint { sample, ref ray, ref lit, .. } = *point;
        let orientation = self.orientation(sample);
        let bare = self.direct(lit, seen);
        let effects = self.paths.effects.as_ref();
        let direct = effects.map_or(bare, |effects| {
            effects.direct(bare, self.number, ray, self.rays, orientation, self.tilts)
        });
        paths.push(direct);
        if let Some(bounce) = &self.paths.setup.bounce {
            let gain = effects
                .map(|effects| effects.instrument_gain(self.number, ray, lit.hit, orientation));
            let flux_w = self.paths.link.flux_w(lit.hit.cos_theta) * self.paths.lit_shares[sample];
            let flux_w = flux_w * gain.unwrap_or(1.0);
            self.second_order(lit, flux_w, direct, bounce, sample, paths);
        }
    }

    /// A point that a ray of the radar's beam lights, by the way `inward`.
    fn lit_by_beam(&self, hit: Hit, ray: &Ray<Global>, inward: Passage) -> ShadingPoint<'a> {
        let to_source = -ray.direction.xyz();
        let (to_antenna, antenna_m) = match self.paths.observer {
            Observer::Radar => (to_source, hit.range_m),
            Observer::Receiver { .. } => self.to_antenna(&hit),
        };
        let point = self.lit(hit, to_source, to_antenna, antenna_m, hit.range_m);
        ShadingPoint { inward, ..point }
    }

    /// A point that another point of the target lights from `to_source`; the antenna sees it in the main lobe of its beam, or
    /// by a side lobe.
    fn lit_by_surface(&self, hit: Hit, to_source: DVec3, in_main_lobe: bool) -> ShadingPoint<'a> {
        let Spot { axis, beam, .. } = &self.spot;
        let (mut to_antenna, antenna_m) = self.to_antenna(&hit);
        if in_main_lobe {
            // A single ray stands for the whole spot: its divergence holds the wavefront's curvature already.
            let wave =
                if self.rays == 1 { axis.direction } else { beam.direction_at(axis, hit.point) };
            to_antenna = -wave.xyz();
        }
        let along_beam_m = (hit.point.xyz - axis.origin.xyz).dot(axis.direction.xyz());
        self.lit(hit, to_source, to_antenna, antenna_m, along_beam_m)
    }

    /// The unit vector from a hit to the antenna, and the distance, m.
    fn to_antenna(&self, hit: &Hit) -> (DVec3, f64) {
        let to_antenna = self.antenna - hit.point.xyz;
        (to_antenna.normalize_or(DVec3::Z), to_antenna.length())
    }

    fn lit(
        &self,
        hit: Hit,
        to_source: DVec3,
        to_antenna: DVec3,
        antenna_m: f64,
        along_beam_m: f64,
    ) -> ShadingPoint<'a> {
        let mesh = self.paths.setup.geometry.bvh.mesh();
        let surface = self.paths.setup.surfaces[self.paths.region(&hit)];
        let frame = LocalFrame::at_hit(mesh, &hit, to_source, surface.grain);
        let source = frame.local(to_source);
        let antenna = if to_antenna == to_source { source } else { frame.local(to_antenna) };
        let solid_angle_sr = self.solid_angle_sr(antenna_m, along_beam_m);
        let beam_rad = self.spot.divergence_rad(self.rays, along_beam_m);
        let inward = Passage::FREE;
        ShadingPoint {
            hit,
            surface,
            frame,
            source,
            antenna,
            antenna_m,
            solid_angle_sr,
            beam_rad,
            inward,
        }
    }

    /// Solid angle, sr, in which a point sees the antenna, from its distance and its place along the beam, m.
    fn solid_angle_sr(&self, antenna_m: f64, along_beam_m: f64) -> f64 {
        let stated_m2 = match self.paths.observer {
            Observer::Radar => self.paths.link.aperture_m2,
            Observer::Receiver { aperture_m2, .. } => aperture_m2,
        };
        match stated_m2 {
            Some(aperture_m2) => aperture_m2 / (antenna_m * antenna_m),
            None => self.spot.beam.section(along_beam_m).solid_angle_sr(),
        }
    }

    /// The single path by way of a point, of which the antenna sees this.
    fn direct(&self, lit: &ShadingPoint, scattered: Seen) -> Path {
        let outward = match self.paths.observer {
            // It is visible to the radar by the same way.
            Observer::Radar => Some(lit.inward.reversed()),
            Observer::Receiver { .. } => self.way_out(lit),
        };
        let ways = [lit.inward, outward.unwrap_or(Passage::FREE)];
        let polarised = self.polarised_share(scattered.specular_share, &[lit], &ways);
        let share =
            if outward.is_some() { lit.received_share(scattered) * polarised.share } else { 0.0 };
        let [x, y, _] = lit.source.xyz().to_array();
        let apparent_m = 0.5 * delay_m(&ways) + lit.echo_behind_m(scattered);
        Path {
            range_m: 0.5 * (lit.hit.range_m + lit.antenna_m) + apparent_m,
            power_w: self.flux_w(lit) * share,
            hit: lit.hit,
            sheets: lit.inward.sheets,
            passed_share: polarised.passed,
            delay_m: apparent_m,
            // What the antenna does not see is missing from the wave of its piece.
            pieces: [if outward.is_some() { self.piece(&lit.hit) } else { UNSEEN }; 2],
            surfaces: 1,
            azimuth_rad: y.atan2(x),
            specular_share: scattered.specular_share,
            coherent_share: scattered.coherent_share,
        }
    }

    /// Number of the smooth piece that a hit lies on.
    fn piece(&self, hit: &Hit) -> u32 {
        self.paths.pieces.get(hit.facet as usize).copied().unwrap_or(0)
    }

    /// Where a lit point sends power: into directions drawn at random, and exactly into that of the mirror by lobes
    /// that are too narrow to be drawn.
    fn onward(&self, lit: &ShadingPoint, bounce: &Bounce, ray: usize) -> Vec<Onward> {
        let law = lit.surface.scattering;
        let mut all = Vec::with_capacity(bounce.rays);
        for (direction, weight) in directions(lit.source, bounce.rays, self.key(ray)) {
            let first = law.apart_from_narrow_lobes(lit.source, direction);
            let share = first.f_per_sr * direction.cos_theta() * weight;
            all.push(Onward { direction, share, first, m: 0.0 });
        }
        for NarrowLobe { share, m } in law.narrow_lobes(lit.source) {
            let direction = lit.source.mirrored();
            all.push(Onward { direction, share, first: Seen::mirror(0.0), m });
        }
        all.retain(|onward| onward.share > 0.0);
        all
    }

    /// Appends the second-order paths by way of a point that receives `flux_w`, W.
    fn second_order(
        &self,
        lit: &ShadingPoint,
        flux_w: f64,
        direct: Path,
        bounce: &Bounce,
        ray: usize,
        paths: &mut Vec<Path>,
    ) {
        for Onward { direction, share, first, m } in self.onward(lit, bounce, ray) {
            let Some(Way { hit: Some(hit), passage }) =
                self.trace_onward(lit, direction, f64::INFINITY)
            else {
                continue;
            };
            let pattern = self.pattern(bounce, &hit);
            let to_first = -lit.frame.world(direction.xyz());
            let in_main_lobe =
                self.paths.observer == Observer::Radar && pattern > bounce.outside_spot;
            let mut second = self.lit_by_surface(hit, to_first, in_main_lobe);
            // The beam's width counts once, here: exp(−ε²/4δ²) for the angle ε to its wavefront.
            let beam_rad = second.beam_rad;
            second.beam_rad = beam_rad.hypot(m);
            let last = self.scattered(&second);
            let specular_share = first.specular_share * last.specular_share;
            let power_w = flux_w * share * pattern * second.received_share(last);
            if power_w > 0.0
                && let Some(outward) = self.way_out(&second)
            {
                let ways = [lit.inward, passage, outward];
                let polarised = self.polarised_share(specular_share, &[lit, &second], &ways);
                if polarised.share == 0.0 {
                    continue;
                }
                let coherent_share = first.coherent_share
                    * last.coherent_share
                    * (beam_rad / second.beam_rad).powi(2);
                let enhancement = self.enhancement(bounce, coherent_share);
                let delay_m = delay_m(&ways);
                let path_m = lit.hit.range_m + hit.range_m + second.antenna_m + delay_m;
                let [a, b] = [&lit.hit, &hit].map(|hit| self.piece(hit));
                paths.push(Path {
                    range_m: 0.5 * path_m,
                    power_w: power_w * polarised.share * enhancement,
                    passed_share: polarised.passed,
                    delay_m: 0.5 * delay_m,
                    pieces: [a.min(b), a.max(b)],
                    surfaces: 2,
                    specular_share,
                    coherent_share: coherent_share / enhancement,
                    ..direct
                });
            }
        }
    }

    /// Factor on a second-order path by the one that goes round its surfaces the other way.
    fn enhancement(&self, bounce: &Bounce, coherent_share: f64) -> f64 {
        match (self.paths.observer, self.paths.setup.channel) {
            (Observer::Radar, Channel::CoPolar) => bounce.enhancement(coherent_share),
            _ => 1.0,
        }
    }

    /// The orientation of the surface at the hit of a ray, if effects have moved it.
    fn orientation(&self, ray: usize) -> Option<Orientation> {
        self.paths.footprints.orientations.get(self.number * self.rays + ray).copied().flatten()
    }

    /// The key of the random directions from the hit of a ray. It is the same for all observers, since a surface
    /// scatters independently of them.
    fn key(&self, ray: usize) -> Key {
        let (seed, chirp) = (self.paths.setup.seed, self.number as u64);
        Key { seed, chirp, sub_ray: ray as u64, purpose: Purpose::Bounce }
    }

    /// Power of one ray on a point, W.
    fn flux_w(&self, lit: &ShadingPoint) -> f64 {
        self.paths.link.flux_w(lit.hit.cos_theta) / self.rays as f64
    }

    /// What the antenna's channel receives of the power by way of some points; the ways lead to, between and from
    /// them. The specular part keeps the polarisation that facets and sheets give it. The diffuse part is co-polar, and
    /// what is depolarised adds to it.
    fn polarised_share(
        &self,
        specular_share: f64,
        points: &[&ShadingPoint],
        ways: &[Passage],
    ) -> Polarised {
        let channel = self.paths.setup.channel;
        let is_straight_back = self.paths.observer == Observer::Radar && points.len() == 1;
        let is_free = ways.iter().all(|way| way.sheets == 0);
        let depolarised = match channel {
            Channel::CoPolar => 0.0,
            Channel::CrossPolar => {
                let shares = points.iter().map(|lit| lit.surface.depolarised_share);
                let largest = shares.fold(0.0, f64::max);
                largest / (1.0 - largest)
            }
        };
        // Straight back a facet, and a diffuse surface, keep the field.
        if is_straight_back && is_free {
            let kept = if channel == Channel::CoPolar { 1.0 } else { 0.0 };
            return Polarised { share: kept + (1.0 - specular_share) * depolarised, passed: 1.0 };
        }
        let Some((first, last)) = points.first().zip(points.last()) else {
            return Polarised { share: 0.0, passed: 1.0 };
        };
        let antenna = self.paths.setup.geometry.radar.polarisation;
        let sent = antenna.field(-first.frame.world(first.source.xyz()));
        let received = antenna.received(-last.frame.world(last.antenna.xyz()), channel);
        let passed = passed_share(sent, received, ways);
        let depolarised = depolarised * passed;
        if is_straight_back {
            let field = ways.iter().fold(Field::linear(sent), |field, way| way.pass(field));
            let kept = field.power_along(received);
            let passed = if channel == Channel::CoPolar { kept } else { passed };
            return Polarised { share: kept + (1.0 - specular_share) * depolarised, passed };
        }
        let specular = if specular_share > 0.0 {
            self.specular_field(sent, points, ways).power_along(received)
        } else {
            0.0
        };
        let diffuse = if channel == Channel::CoPolar { passed } else { depolarised };
        Polarised { share: specular_share * specular + (1.0 - specular_share) * diffuse, passed }
    }

    /// The field of a specular path by way of some points, of unit power where it was sent along `sent`.
    fn specular_field(&self, sent: DVec3, points: &[&ShadingPoint], ways: &[Passage]) -> Field {
        let mut field = Field::linear(sent);
        for (place, (lit, way)) in points.iter().zip(ways).enumerate() {
            let exit = match points.get(place + 1) {
                Some(next) => lit.frame.local(-next.frame.world(next.source.xyz())),
                None => lit.antenna,
            };
            let amplitudes = lit.surface.scattering.facet_amplitudes(lit.source, exit);
            let [from, to] = [-lit.source.xyz(), exit.xyz()].map(|local| lit.frame.world(local));
            field = way.pass(field).reflected(from, to, amplitudes);
        }
        ways.last().map_or(field, |way| way.pass(field))
    }

    /// What a point scatters towards the antenna.
    fn scattered(&self, lit: &ShadingPoint) -> Seen {
        lit.surface.seen_by(lit.beam_rad, lit.source, lit.antenna)
    }

    /// The way of a ray from a point to the first surface nearer than `until_m` that stops it; `None` without a
    /// direction.
    fn trace_onward(
        &self,
        lit: &ShadingPoint,
        towards: Direction<Local>,
        until_m: f64,
    ) -> Option<Way> {
        let origin = Point::from(lit.hit.point.xyz + LIFT_M * lit.frame.normal());
        let direction = Direction::new(lit.frame.world(towards.xyz()))?;
        Some(follow(self.paths.setup, Ray { origin, direction }, until_m))
    }

    /// The way from a point to the antenna; `None` where something stands between.
    fn way_out(&self, lit: &ShadingPoint) -> Option<Passage> {
        if lit.antenna.cos_theta() <= 0.0 {
            return None;
        }
        let way = self.trace_onward(lit, lit.antenna, lit.antenna_m)?;
        way.hit.is_none().then_some(way.passage)
    }

    /// Gain of the antenna towards a second surface, relative to that towards the spot. It is 1 for a separate receiver.
    fn pattern(&self, bounce: &Bounce, hit: &Hit) -> f64 {
        match self.paths.observer {
            Observer::Receiver { .. } => 1.0,
            Observer::Radar => {
                bounce.pattern(&self.spot.beam, &self.spot.axis, self.rays, hit.point.xyz)
            }
        }
    }
}
