//! What the radar's rays light: the points that they meet, and the second surfaces that these send power on to. All antennas
//! see the same light, so that it is traced once for all of them.
//!
//! From a lit point power goes into directions drawn at random, and exactly into that of the mirror by lobes that are
//! too narrow to be drawn (`bounce.rs`).

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::behind::{LIFT_M, Way, follow, passage};
use super::bounce::{Bounce, directions};
use super::setup::Setup;
use super::sheet::Passage;
use super::spot::{self, Footprints, Spot};
use super::surface::Surface;
use crate::brdf::{Bistatic, NarrowLobe, Pair, Seen};
use crate::frames::{Direction, Global, Point, Ray, Surface as Local};
use crate::radar::Beam;
use crate::radar::random::{Key, Purpose};
use crate::trace::{Hit, LocalFrame};

/// The light of a scan.
pub(super) struct Light<'a> {
    pub setup: &'a Setup<'a>,
    pub footprints: &'a Footprints,
    beam: Beam,
    /// The rays of a spot.
    pub samples: Vec<DVec2>,
    /// The laws of the regions.
    pub laws: Vec<Bistatic<'a>>,
}

/// What the rays of some chirps light.
pub(super) struct Lit<'a> {
    pub chirps: Vec<LitChirp>,
    /// Those of the first chirp come first.
    pub points: Vec<LitPoint<'a>>,
    /// Those of the first point come first.
    pub onward: Vec<Onward<'a>>,
}

/// A chirp and the places of its points.
pub(super) struct LitChirp {
    pub number: usize,
    pub spot: Spot,
    /// Number of rays that share its power.
    pub rays: usize,
    pub points: Range<usize>,
}

/// A point that a ray of the radar's beam lights.
pub(super) struct LitPoint<'a> {
    /// Number of the ray in its spot.
    pub sample: usize,
    pub ray: Ray<Global>,
    pub place: Place<'a>,
    /// The sheets on the way of the ray.
    pub inward: Passage,
    /// The places of the second surfaces that it sends power on to.
    pub onward: Range<usize>,
}

/// A second surface, and the power on its way to it.
pub(super) struct Onward<'a> {
    /// Share of the power on the first surface.
    pub share: f64,
    /// What the first surface scatters.
    pub first: Seen,
    /// Roughness of a lobe that the direction stands for.
    pub m: f64,
    /// The sheets on the way.
    pub passage: Passage,
    pub place: Place<'a>,
}

/// A place of the target that power falls on.
pub(super) struct Place<'a> {
    pub hit: Hit,
    pub surface: Surface<'a>,
    pub frame: LocalFrame,
    /// Direction to the source of the power.
    pub source: Direction<Local>,
}

impl<'a> Light<'a> {
    pub fn new(setup: &'a Setup<'a>, footprints: &'a Footprints) -> Light<'a> {
        let beam = Beam::new(setup.geometry.radar);
        let samples = spot::samples(footprints.rays_per_chirp);
        let surfaces = setup.surfaces.iter();
        let laws = surfaces.map(|surface| Bistatic::new(surface.scattering)).collect();
        Light { setup, footprints, beam, samples, laws }
    }

    pub fn rays_per_chirp(&self) -> usize {
        self.footprints.rays_per_chirp.max(1)
    }

    /// What the chirps from `first` on light through the hits of their rays.
    pub fn of(&self, first: usize, hits: &[Option<Hit>]) -> Lit<'a> {
        let mut lit = Lit { chirps: Vec::new(), points: Vec::new(), onward: Vec::new() };
        for (number, hits) in (first..).zip(hits.chunks(self.rays_per_chirp())) {
            let axis = &self.setup.geometry.chirps.rays[number];
            let range_m = self.footprints.axis_range_m[number];
            let spot = match hits.len() {
                1 => Spot::of_one_ray(&self.beam, axis, range_m),
                _ => Spot::met(&self.beam, axis, range_m, number),
            };
            let begin = lit.points.len();
            self.push_points(number, &spot, hits, &mut lit.points);
            let points = begin..lit.points.len();
            lit.chirps.push(LitChirp { number, spot, rays: hits.len(), points });
        }
        if let Some(bounce) = &self.setup.bounce {
            self.push_onward(bounce, &mut lit);
        }
        lit
    }

    /// Appends the points that the rays of a chirp light.
    fn push_points(
        &self,
        number: usize,
        spot: &Spot,
        hits: &[Option<Hit>],
        points: &mut Vec<LitPoint<'a>>,
    ) {
        for (sample, hit) in hits.iter().enumerate() {
            let Some((hit, ray)) = hit.zip(spot.ray(self.samples[sample])) else { continue };
            points.push(self.lit(sample, ray, hit, Passage::FREE));
            // Behind every sheet that the ray meets lies something else, or nothing.
            let (mut front, mut inward) = (hit, Passage::FREE);
            for behind in &self.footprints.behind {
                let Some(sheet) = self.setup.sheet(front.facet) else { break };
                let Some(hit) = behind.hits[number * hits.len() + sample] else { break };
                inward = inward.then(passage(self.setup, sheet, &front, ray.direction));
                points.push(self.lit(sample, ray, hit, inward));
                front = hit;
            }
        }
    }

    fn lit(&self, sample: usize, ray: Ray<Global>, hit: Hit, inward: Passage) -> LitPoint<'a> {
        let place = self.place(hit, -ray.direction.xyz());
        LitPoint { sample, ray, place, inward, onward: 0..0 }
    }

    /// Appends the second surfaces of all points.
    fn push_onward(&self, bounce: &Bounce, lit: &mut Lit<'a>) {
        let Lit { chirps, points, onward } = lit;
        for chirp in chirps {
            for point in &mut points[chirp.points.clone()] {
                let begin = onward.len();
                let key = Key {
                    seed: self.setup.seed,
                    chirp: chirp.number as u64,
                    sub_ray: point.sample as u64,
                    purpose: Purpose::Bounce,
                };
                self.push_onward_of(point, bounce, key, onward);
                point.onward = begin..onward.len();
            }
        }
    }

    /// Appends the second surfaces of one point.
    fn push_onward_of(
        &self,
        point: &LitPoint,
        bounce: &Bounce,
        key: Key,
        onward: &mut Vec<Onward<'a>>,
    ) {
        let from = &point.place;
        let drawn = directions(from.source, bounce.rays, key);
        let pairs = drawn.iter().map(|&(o, _)| Pair { beam_rad: 0.0, i: from.source, o });
        let law = &self.laws[self.region(&from.hit)];
        let scattered = law.apart_from_narrow_lobes(&pairs.collect::<Vec<_>>());
        let drawn = drawn.into_iter().zip(scattered).map(|((direction, weight), first)| {
            (direction, first.f_per_sr * direction.cos_theta() * weight, first, 0.0)
        });
        let narrow = from.surface.scattering.narrow_lobes(from.source).into_iter();
        let mirrored = from.source.mirrored();
        let narrow = narrow.map(|NarrowLobe { share, m }| (mirrored, share, Seen::mirror(0.0), m));
        for (direction, share, first, m) in drawn.chain(narrow).filter(|sent| sent.1 > 0.0) {
            let way = self.follow(from, direction, f64::INFINITY);
            if let Some(Way { hit: Some(hit), passage }) = way {
                let place = self.place(hit, -from.frame.world(direction.xyz()));
                onward.push(Onward { share, first, m, passage, place });
            }
        }
    }

    fn place(&self, hit: Hit, to_source: DVec3) -> Place<'a> {
        let mesh = self.setup.geometry.bvh.mesh();
        let surface = self.setup.surfaces[self.region(&hit)];
        let frame = LocalFrame::at_hit(mesh, &hit, to_source, surface.grain);
        let source = frame.local(to_source);
        Place { hit, surface, frame, source }
    }

    /// Number of the region that a hit lies on.
    pub fn region(&self, hit: &Hit) -> usize {
        usize::from(self.setup.geometry.region_of_facet[hit.facet as usize])
    }

    /// The way of a ray from a place to the first surface nearer than `until_m` that stops it; `None` without a
    /// direction.
    pub fn follow(&self, from: &Place, towards: Direction<Local>, until_m: f64) -> Option<Way> {
        let origin = Point::from(from.hit.point.xyz + LIFT_M * from.frame.normal());
        let direction = Direction::new(from.frame.world(towards.xyz()))?;
        Some(follow(self.setup, Ray { origin, direction }, until_m))
    }
}
