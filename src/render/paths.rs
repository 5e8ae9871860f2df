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
//!
//! What the radar lights is the same for all antennas (`light.rs`); what they receive of it is theirs.

use std::convert::Infallible;

use glam::DVec3;
use rayon::prelude::*;

use super::coherent::{RayPath, SpotRays, smooth_pieces};
use super::effect_scan::{Change, EffectScan};
use super::light::{Light, Lit, LitChirp, LitPoint, Onward, Place};
use super::observer::Observer;
use super::path::{Path, sum};
use super::polarised::{Journey, Polarised};
use super::setup::Setup;
use super::sheet::Passage;
use super::spot::{self, Footprints, Spot};
use super::surface::Orientation;
use crate::brdf::{Pair, Retro, Seen, of_each_law};
use crate::effects::MeanEcho;
use crate::frames::{Direction, Surface as Local};
use crate::radar::{Channel, Detection, Link};
use crate::trace::Hit;

/// Computes the paths of a scan to one antenna.
pub(super) struct Paths<'a> {
    light: Light<'a>,
    observer: Observer,
    link: Link,
    /// The share of the power sent that falls on each ray of a spot.
    lit_shares: Vec<f64>,
    effects: Option<EffectScan<'a>>,
    /// The smooth piece that each facet belongs to; empty where no spot can reach beyond what returns a wave.
    pieces: Vec<u32>,
    /// The laws of the regions as the radar sees them; empty for another observer.
    retros: Vec<Retro<'a>>,
    /// The change of each chirp's whole echo by the effects; empty without effects.
    changes: Vec<Option<Change>>,
}

/// How the antenna sees a lit place.
struct View {
    /// Direction to the antenna.
    towards: Direction<Local>,
    /// Distance to the antenna, m.
    antenna_m: f64,
    /// Solid angle in which the antenna is seen, sr.
    solid_angle_sr: f64,
    /// Divergence of the beam there, rad.
    beam_rad: f64,
}

impl View {
    /// Share of the power on the place that the antenna receives if nothing occludes it.
    fn received_share(&self, scattered: Seen) -> f64 {
        self.towards.cos_theta().max(0.0) * scattered.f_per_sr * self.solid_angle_sr
    }
}

/// In place of a smooth piece, for a hit that the antenna does not see.
const UNSEEN: u32 = u32::MAX;

/// By how much sheets lengthen some ways, m.
fn delay_m(ways: &[Passage]) -> f64 {
    ways.iter().map(|way| way.delay_m()).sum()
}

/// What `each` appends to a list for every antenna of one scan and every chirp, from their numbers, the hits of the chirp and its
/// paths to the antenna: the list of every antenna, in the order of the chirps. Runs on all threads; what a chirp
/// lights is traced once. `done` is called repeatedly with the number of chirps that were finished since the last call, once for each
/// antenna.
///
/// # Errors
/// For each antenna the error of `each` for its first chirp that has one.
pub(super) fn of_antennas<T: Send, E: Send>(
    antennas: &[Paths],
    done: &(dyn Fn(usize) + Sync),
    each: impl Fn(usize, usize, &[Option<Hit>], &mut Vec<Path>, &mut Vec<T>) -> Result<(), E> + Sync,
) -> Vec<Result<Vec<T>, E>> {
    /// Rays of a task, and how many go on from them.
    const RAYS: usize = 256;
    const ONWARD: usize = 1 << 13;
    let Some(Paths { light, .. }) = antennas.first() else { return Vec::new() };
    let rays = light.rays_per_chirp();
    let onward = light.setup.bounce.map_or(0, |bounce| bounce.rays);
    let chirps = (RAYS.min(ONWARD / onward.max(1)) / rays).max(1);
    let tasks = light.footprints.hits.par_chunks(chirps * rays).enumerate();
    let found = tasks.map(|(task, hits)| {
        // Whoever hears of it may stop here: the other tasks begin all the same.
        done(0);
        let lit = light.of(task * chirps, hits);
        let of_antennas = antennas.iter().enumerate().map(|(antenna, paths)| {
            let mut found = Vec::with_capacity(hits.len() / rays);
            paths.of_lit(&lit, hits, |chirp, hits, paths| {
                each(antenna, chirp, hits, paths, &mut found)
            })?;
            done(hits.len() / rays);
            Ok(found)
        });
        of_antennas.collect()
    });
    let mut all: Vec<Result<Vec<T>, E>> = antennas.iter().map(|_| Ok(Vec::new())).collect();
    for of_antennas in found.collect::<Vec<Vec<Result<Vec<T>, E>>>>() {
        for (all, found) in all.iter_mut().zip(of_antennas) {
            match (all.as_mut(), found) {
                (Ok(all), Ok(mut found)) => all.append(&mut found),
                (Ok(_), Err(error)) => *all = Err(error),
                (Err(_), _) => {}
            }
        }
    }
    all
}

impl<'a> Paths<'a> {
    pub fn new(
        setup: &'a Setup<'a>,
        observer: Observer,
        footprints: &'a Footprints,
        effects: Option<EffectScan<'a>>,
    ) -> Paths<'a> {
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
            light: Light::new(setup, footprints),
            observer,
            link: Link::new(setup.geometry.radar),
            lit_shares: spot::lit_shares(footprints.rays_per_chirp),
            effects,
            pieces,
            retros,
            changes: Vec::new(),
        };
        let on_echoes = paths.effects.as_ref().filter(|effects| effects.acts_on_echoes());
        paths.changes = on_echoes.map_or(Vec::new(), |effects| paths.changes_by(effects));
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
        effects.changes(self.light.footprints, sums)
    }

    /// As [`of_antennas`], for this antenna alone.
    ///
    /// # Errors
    /// The error of `each` for the first chirp that has one.
    pub fn of_all<T: Send, E: Send>(
        &self,
        done: &(dyn Fn(usize) + Sync),
        each: impl Fn(usize, &[Option<Hit>], &mut Vec<Path>, &mut Vec<T>) -> Result<(), E> + Sync,
    ) -> Result<Vec<T>, E> {
        let each =
            |_, chirp, hits: &[_], paths: &mut _, found: &mut _| each(chirp, hits, paths, found);
        of_antennas(std::slice::from_ref(self), done, each).swap_remove(0)
    }

    /// All paths of a chirp through the hits of its rays, including single paths without power.
    pub fn of_chirp(&self, number: usize, hits: &[Option<Hit>]) -> Vec<Path> {
        let mut of_chirp = Vec::new();
        let lit = self.light.of(number, hits);
        let Ok(()) = self.of_lit::<Infallible>(&lit, hits, |_, _, paths| {
            of_chirp.append(paths);
            Ok(())
        });
        of_chirp
    }

    /// Calls `each` with number, hits and paths of each chirp. Their laws are evaluated at once.
    fn of_lit<E>(
        &self,
        lit: &Lit,
        hits: &[Option<Hit>],
        mut each: impl FnMut(usize, &[Option<Hit>], &mut Vec<Path>) -> Result<(), E>,
    ) -> Result<(), E> {
        let receptions: Vec<Reception> =
            lit.chirps.iter().map(|chirp| Reception::new(self, chirp)).collect();
        let mut views = Vec::with_capacity(lit.points.len());
        for reception in &receptions {
            let points = &lit.points[reception.chirp.points.clone()];
            views.extend(points.iter().map(|point| reception.view(point)));
        }
        let seen = self.seen(&lit.points, &views);
        let seconds = self.seconds(lit, &receptions);
        let (mut paths, mut direct) = (Vec::new(), Vec::new());
        for (reception, hits) in receptions.iter().zip(hits.chunks(self.light.rays_per_chirp())) {
            paths.clear();
            direct.clear();
            for place in reception.chirp.points.clone() {
                let point = &lit.points[place];
                direct.push(RayPath { ray: point.sample, place: paths.len() });
                let onward = lit.onward[point.onward.clone()].iter();
                let onward = onward.zip(&seconds[point.onward.clone()]);
                reception.scatter(point, &views[place], seen[place], onward, &mut paths);
            }
            let number = reception.chirp.number;
            self.finish(number, &direct, &mut paths);
            each(number, hits, &mut paths)?;
        }
        Ok(())
    }

    /// What each point scatters towards the antenna, as it views them.
    fn seen(&self, points: &[LitPoint], views: &[View]) -> Vec<Seen> {
        let regions = points.iter().map(|point| self.light.region(&point.place.hit));
        of_each_law(regions, |region, here| {
            let surface = &self.light.setup.surfaces[region];
            let of_each = here.iter().map(|&at| (&points[at].place, &views[at]));
            match self.retros.get(region) {
                Some(retro) => {
                    let looks = of_each.map(|(place, view)| (view.beam_rad, place.source));
                    surface.seen_straight_back(retro, looks)
                }
                None => {
                    let pairs = of_each.map(|(place, view)| view.pair(place)).collect();
                    surface.seen_by_each(&self.light.laws[region], pairs)
                }
            }
        })
    }

    /// How the antenna sees the second surfaces, one for each that power goes on to.
    fn seconds(&self, lit: &Lit, receptions: &[Reception]) -> Vec<Second> {
        let mut seconds = Vec::with_capacity(lit.onward.len());
        for reception in receptions {
            for point in &lit.points[reception.chirp.points.clone()] {
                let onward = lit.onward[point.onward.clone()].iter();
                seconds.extend(onward.map(|onward| reception.second(onward)));
            }
        }
        let regions = lit.onward.iter().map(|onward| self.light.region(&onward.place.hit));
        let seen = of_each_law(regions, |region, here| {
            let of_each = here.iter().map(|&at| seconds[at].view.pair(&lit.onward[at].place));
            let surface = &self.light.setup.surfaces[region];
            surface.seen_by_each(&self.light.laws[region], of_each.collect())
        });
        seconds.iter_mut().zip(seen).for_each(|(second, seen)| second.seen = seen);
        seconds
    }

    /// Changes the paths of a chirp by what depends on all of them; `direct` are those by way of one surface.
    fn finish(&self, number: usize, direct: &[RayPath], paths: &mut [Path]) {
        if !self.pieces.is_empty() {
            let rays = SpotRays { places: &self.light.samples, lit_shares: &self.lit_shares };
            rays.cut_waves(direct, paths);
        }
        if let Some(change) = self.changes.get(number).copied().flatten() {
            change.apply(paths);
        }
    }
}

/// One chirp, and the position of the antenna that receives it.
struct Reception<'a> {
    paths: &'a Paths<'a>,
    chirp: &'a LitChirp,
    antenna: DVec3,
    /// Tangents of the tilts of all normals by the effects.
    tilts: [f64; 2],
}

impl View {
    /// The directions of the light and of the antenna at a place.
    fn pair(&self, place: &Place) -> Pair {
        Pair { beam_rad: self.beam_rad, i: place.source, o: self.towards }
    }
}

impl<'a> Reception<'a> {
    fn new(paths: &'a Paths<'a>, chirp: &'a LitChirp) -> Reception<'a> {
        let antenna = paths.observer.position(chirp.spot.axis.origin.xyz);
        let tilts = paths.effects.as_ref().map_or([0.0; 2], |effects| effects.tilts(chirp.number));
        Reception { paths, chirp, antenna, tilts }
    }

    /// How the antenna sees a point that a ray lights.
    fn view(&self, point: &LitPoint) -> View {
        let Place { hit, frame, source, .. } = &point.place;
        let (towards, antenna_m) = match self.paths.observer {
            Observer::Radar => (*source, hit.range_m),
            Observer::Receiver { .. } => {
                let (to_antenna, antenna_m) = self.to_antenna(hit);
                (frame.local(to_antenna), antenna_m)
            }
        };
        self.view_at(towards, antenna_m, hit.range_m)
    }

    /// How the antenna sees a second surface: in the main lobe of its beam, or by a side lobe.
    fn view_of_second(&self, place: &Place, in_main_lobe: bool) -> View {
        let Spot { axis, beam, .. } = &self.chirp.spot;
        let hit = &place.hit;
        let (mut to_antenna, antenna_m) = self.to_antenna(hit);
        if in_main_lobe {
            // A single ray stands for the whole spot: its divergence holds the wavefront's curvature already.
            let wave = if self.chirp.rays == 1 {
                axis.direction
            } else {
                beam.direction_at(axis, hit.point)
            };
            to_antenna = -wave.xyz();
        }
        let along_beam_m = (hit.point.xyz - axis.origin.xyz).dot(axis.direction.xyz());
        self.view_at(place.frame.local(to_antenna), antenna_m, along_beam_m)
    }

    fn view_at(&self, towards: Direction<Local>, antenna_m: f64, along_beam_m: f64) -> View {
        let solid_angle_sr = self.solid_angle_sr(antenna_m, along_beam_m);
        let beam_rad = self.chirp.spot.divergence_rad(self.chirp.rays, along_beam_m);
        View { towards, antenna_m, solid_angle_sr, beam_rad }
    }

    /// The unit vector from a hit to the antenna, and the distance, m.
    fn to_antenna(&self, hit: &Hit) -> (DVec3, f64) {
        let to_antenna = self.antenna - hit.point.xyz;
        (to_antenna.normalize_or(DVec3::Z), to_antenna.length())
    }

    /// Solid angle, sr, in which a place sees the antenna, from its distance and its place along the beam, m.
    fn solid_angle_sr(&self, antenna_m: f64, along_beam_m: f64) -> f64 {
        let stated_m2 = match self.paths.observer {
            Observer::Radar => self.paths.link.aperture_m2,
            Observer::Receiver { aperture_m2, .. } => aperture_m2,
        };
        match stated_m2 {
            Some(aperture_m2) => aperture_m2 / (antenna_m * antenna_m),
            None => self.chirp.spot.beam.section(along_beam_m).solid_angle_sr(),
        }
    }

    /// How the antenna sees a second surface; what this scatters is still open.
    fn second(&self, Onward { place, m, .. }: &Onward) -> Second {
        let (gain, in_main_lobe) = self.gain(&place.hit);
        let mut view = self.view_of_second(place, in_main_lobe);
        // The beam's width counts once, here: exp(−ε²/4δ²) for the angle ε to its wavefront.
        let beam_rad = view.beam_rad;
        view.beam_rad = beam_rad.hypot(*m);
        let beam_share = (beam_rad / view.beam_rad).powi(2);
        Second { view, gain, beam_share, seen: Seen::default() }
    }

    /// Appends the paths by way of a point, of which the antenna sees this, and which sends power on.
    fn scatter<'b>(
        &self,
        point: &LitPoint,
        view: &View,
        seen: Seen,
        onward: impl ExactSizeIterator<Item = (&'b Onward<'b>, &'b Second)>,
        paths: &mut Vec<Path>,
    ) {
        let LitPoint { sample, ref ray, ref place, .. } = *point;
        let (number, rays) = (self.chirp.number, self.chirp.rays);
        let orientation = self.orientation(sample);
        let bare = self.direct(point, view, seen);
        let effects = self.paths.effects.as_ref();
        let direct = effects.map_or(bare, |effects| {
            let surface = (seen.f_per_sr, place.frame.normal());
            effects.direct(bare, surface, (number, ray, rays), orientation, self.tilts)
        });
        paths.push(direct);
        if onward.len() > 0 {
            let gain =
                effects.map(|effects| effects.instrument_gain(number, ray, place.hit, orientation));
            let flux_w =
                self.paths.link.flux_w(place.hit.cos_theta) * self.paths.lit_shares[sample];
            let flux_w = flux_w * gain.unwrap_or(1.0);
            let second = onward.filter_map(|(onward, second)| {
                self.second_order(point, flux_w, direct, onward, second)
            });
            paths.extend(second);
        }
    }

    /// The single path by way of a point, of which the antenna sees this.
    fn direct(&self, point: &LitPoint, view: &View, scattered: Seen) -> Path {
        let LitPoint { ref place, inward, .. } = *point;
        let outward = match self.paths.observer {
            // It is visible to the radar by the same way.
            Observer::Radar => Some(inward.reversed()),
            Observer::Receiver { .. } => self.way_out(place, view),
        };
        let ways = [inward, outward.unwrap_or(Passage::FREE)];
        let polarised = self.polarised_share(scattered.specular_share, &[place], view, &ways);
        let share =
            if outward.is_some() { view.received_share(scattered) * polarised.share } else { 0.0 };
        let path_m = place.hit.range_m + view.antenna_m;
        let air_share = self.paths.link.air_share(path_m);
        let [x, y, _] = place.source.xyz().to_array();
        let apparent_m = 0.5 * delay_m(&ways) + self.echo_behind_m(place, view, scattered);
        let hit = place.hit;
        Path {
            range_m: 0.5 * path_m + apparent_m,
            power_w: self.paths.link.flux_w(hit.cos_theta) / self.chirp.rays as f64
                * share
                * air_share,
            hit,
            sheets: inward.sheets,
            passed_share: polarised.passed,
            delay_m: apparent_m,
            // What the antenna does not see is missing from the wave of its piece.
            pieces: [if outward.is_some() { self.piece(&hit) } else { UNSEEN }; 2],
            surfaces: 1,
            azimuth_rad: y.atan2(x),
            specular_share: scattered.specular_share,
            coherent_share: scattered.coherent_share,
        }
    }

    /// Range of the echo of a sheet behind its outer face, m: that of what it reflects like a mirror.
    fn echo_behind_m(&self, place: &Place, view: &View, scattered: Seen) -> f64 {
        let Some(sheet) = place.surface.sheet else { return 0.0 };
        let half = (place.source.xyz() + view.towards.xyz()).normalize_or(DVec3::Z);
        sheet.echo_behind_m(half.dot(place.source.xyz())) * scattered.specular_share
    }

    /// Number of the smooth piece that a hit lies on.
    fn piece(&self, hit: &Hit) -> u32 {
        self.paths.pieces.get(hit.facet as usize).copied().unwrap_or(0)
    }

    /// The second-order path by way of a point that receives `flux_w`, W, and of a second surface; `None` without power.
    fn second_order(
        &self,
        point: &LitPoint,
        flux_w: f64,
        direct: Path,
        onward: &Onward,
        second: &Second,
    ) -> Option<Path> {
        let Onward { share, first, passage, ref place, .. } = *onward;
        let Second { ref view, gain, beam_share, seen: last } = *second;
        let specular_share = first.specular_share * last.specular_share;
        let power_w = flux_w * share * gain * view.received_share(last);
        if power_w <= 0.0 {
            return None;
        }
        let ways = [point.inward, passage, self.way_out(place, view)?];
        let polarised = self.polarised_share(specular_share, &[&point.place, place], view, &ways);
        if polarised.share == 0.0 {
            return None;
        }
        let coherent_share = first.coherent_share * last.coherent_share * beam_share;
        let enhancement = self.enhancement(coherent_share);
        let delay_m = delay_m(&ways);
        let [a, b] = [&point.place, place].map(|place| self.piece(&place.hit));
        let path_m = point.place.hit.range_m + place.hit.range_m + view.antenna_m;
        let air_share = self.paths.link.air_share(path_m);
        Some(Path {
            range_m: 0.5 * (path_m + delay_m),
            power_w: power_w * polarised.share * enhancement * air_share,
            passed_share: polarised.passed,
            delay_m: 0.5 * delay_m,
            pieces: [a.min(b), a.max(b)],
            surfaces: 2,
            specular_share,
            coherent_share: coherent_share / enhancement,
            ..direct
        })
    }

    /// Factor on a second-order path by the one that goes round its surfaces the other way.
    fn enhancement(&self, coherent_share: f64) -> f64 {
        let Setup { channel, bounce, .. } = self.paths.light.setup;
        match (self.paths.observer, channel, bounce) {
            (Observer::Radar, Channel::CoPolar, Some(bounce)) => bounce.enhancement(coherent_share),
            _ => 1.0,
        }
    }

    /// The orientation of the surface at the hit of a ray, if effects have moved it.
    fn orientation(&self, ray: usize) -> Option<Orientation> {
        let place = self.chirp.number * self.chirp.rays + ray;
        self.paths.light.footprints.orientations.get(place).copied().flatten()
    }

    fn polarised_share(
        &self,
        specular_share: f64,
        places: &[&Place],
        view: &View,
        ways: &[Passage],
    ) -> Polarised {
        let is_monostatic = self.paths.observer == Observer::Radar;
        let way = Journey {
            setup: self.paths.light.setup,
            is_monostatic,
            places,
            exit: view.towards,
            ways,
        };
        way.polarised_share(specular_share)
    }

    /// The way from a place to the antenna; `None` where something stands between.
    fn way_out(&self, place: &Place, view: &View) -> Option<Passage> {
        if view.towards.cos_theta() <= 0.0 {
            return None;
        }
        let way = self.paths.light.follow(place, view.towards, view.antenna_m)?;
        way.hit.is_none().then_some(way.passage)
    }

    /// Gain of the antenna towards a second surface, relative to that towards the spot, and whether that lies in the main lobe
    /// of the radar's own beam. A separate receiver sees all alike.
    fn gain(&self, hit: &Hit) -> (f64, bool) {
        match (self.paths.observer, &self.paths.light.setup.bounce) {
            (Observer::Radar, Some(bounce)) => {
                let Spot { axis, beam, .. } = &self.chirp.spot;
                let gain = bounce.pattern(beam, axis, self.chirp.rays, hit.point.xyz);
                (gain, gain > bounce.outside_spot)
            }
            _ => (1.0, false),
        }
    }
}

/// How an antenna sees a second surface.
struct Second {
    view: View,
    /// Gain relative to that towards the spot.
    gain: f64,
    /// Share of the square of the width, that of the beam and of a narrow first lobe together, that is the beam's.
    beam_share: f64,
    /// What it scatters towards the antenna.
    seen: Seen,
}
