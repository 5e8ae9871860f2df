//! Speckle of scatterers on the facets, whose waves add up at the antenna with their phases.
//!
//! The amplitude of a chirp is Σ aᵢ·gᵢ·exp(iφᵢ)/√Σ|aᵢ|² with gᵢ circular Gaussian and fixed to scatterer i, |aᵢ|² =
//! f·cos θᵢ·cos θₒ·u², since each stands for the same area, and the phase that the beam itself has there,
//! φ = 2k·(z + r²/2R_c) − 2·arctan ζ at the distance z from the focus along the axis and r from it. Its mean square is 1
//! however many scatterers there are.
//!
//! A receiver elsewhere sees the same scatterers along its own way, k·(ways of both) in place of the radar's twice.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};
use num_complex::Complex;
use rayon::prelude::*;

use super::cell::Cell;
use super::identity::Identity;
use super::placement::{Placement, Site};
use crate::frames::{Direction, Global, Point, Pose, Ray, Target};
use crate::radar::random::Purpose;
use crate::radar::{Beam, GaussianBeam};
use crate::render::behind::{LIFT_M, follow};
use crate::render::error::RenderError;
use crate::render::observer::Observer;
use crate::render::setup::Setup;
use crate::trace::{Hit, LocalFrame};

/// Scatterers along the waist of the beam.
const PER_WAIST: f64 = 3.0;
/// Distance from the axis beyond which a scatterer is left out, in radii of the beam: 0.6 % of the amplitude.
const REACH: f64 = 1.6;
/// Most scatterers of a scene, which take some 3 GiB.
const MOST: usize = 50_000_000;
/// Most squares of the view, which take 1 GiB.
const MOST_SQUARES: f64 = 134_217_728.0;
/// Most amplitudes, one per scatterer and look, which take 2 GiB.
const MOST_AMPLITUDES: f64 = 134_217_728.0;
/// Numbers whose amplitudes have one key.
const BLOCK: usize = 1024;

/// A scatterer that the antenna sees.
#[derive(Clone, Copy, Debug)]
struct Scatterer {
    point: DVec3,
    number: usize,
    /// √(f·cos θᵢ·cos θₒ), 1/√sr.
    amplitude: f64,
    /// Number of sheets in front of it.
    sheets: u8,
}

/// The scatterers of a scan at one antenna.
pub(in crate::render) struct Scatterers<'a> {
    axes: &'a [Ray<Global>],
    beam: Beam,
    /// A receiver elsewhere.
    antenna: Option<DVec3>,
    /// In the order of the grid's squares.
    scatterers: Vec<Scatterer>,
    looks: usize,
    /// Amplitudes gᵢ, one per look.
    phasors: Vec<Complex<f64>>,
    identity: Identity,
    view: View,
    grid: Grid,
}

/// What an antenna sees from one point, drawn on the surface of the foci.
#[derive(Clone, Copy)]
struct View {
    origin: DVec3,
    focus_m: f64,
    target_from_global: Pose<Target, Global>,
}

/// Squares of the view, from its lower left corner.
#[derive(Clone, Copy)]
struct Squares {
    low: DVec2,
    side_m: f64,
    /// Columns and rows.
    size: [usize; 2],
}

/// Squares of the view, and the scatterers in each.
struct Grid {
    squares: Squares,
    /// First scatterer of every square, and the end.
    starts: Vec<usize>,
}

impl View {
    /// Where a point is seen.
    fn place_m(&self, point: DVec3) -> DVec2 {
        let forward = (point - self.origin).normalize_or_zero();
        let focus = Point::from(self.origin + self.focus_m * forward);
        (self.target_from_global * focus).xyz.truncate()
    }
}

impl<'a> Scatterers<'a> {
    /// Places scatterers on the target, and keeps those that the radar and the antenna see.
    ///
    /// # Errors
    /// Rays from several places, or more scatterers, squares or amplitudes than memory should hold.
    pub fn new(
        setup: &'a Setup<'a>,
        observer: Observer,
        looks: usize,
    ) -> Result<Scatterers<'a>, RenderError> {
        let geometry = &setup.geometry;
        let (radar, axes, mesh) = (geometry.radar, &geometry.chirps.rays, geometry.bvh.mesh());
        let waist_m = radar.waist_m();
        let origin = axes.first().map_or(radar.frames().origin(), |axis| axis.origin);
        if axes.iter().any(|axis| axis.origin.distance_m(origin) > waist_m) {
            return Err(RenderError::ScattererOrigins);
        }
        let view = View {
            origin: origin.xyz,
            focus_m: radar.beam.focus_m,
            target_from_global: radar.frames().global_from_target.inverse(),
        };
        let placement = Placement::new(mesh, waist_m / PER_WAIST);
        if placement.count > MOST {
            return Err(RenderError::ScattererCount { count: placement.count });
        }
        let antenna = match observer {
            Observer::Radar => None,
            Observer::Receiver { position, .. } => Some(position.xyz),
        };
        let beam = Beam::new(radar);
        let identity = Identity::of(setup, |vertex| vertex, [0, 0]);
        let (low, high) = seen_field(&beam, &view, axes);
        let size = Grid::size(low, high, waist_m)
            .map_err(|squares| RenderError::ScattererField { squares, most: MOST_SQUARES })?;
        let sites = placement.sites(identity, |site| {
            let at = view.place_m(site.point);
            at.cmpge(low).all() && at.cmple(high).all()
        });
        let eye = Eye { setup, origin, antenna, beam_rad: radar.wavelength_m() / (TAU * waist_m) };
        let seen: Vec<_> = sites.par_iter().filter_map(|site| eye.scatterer(site)).collect();
        let amplitudes = seen.len() as f64 * looks as f64;
        if amplitudes > MOST_AMPLITUDES {
            let scatterers = seen.len();
            return Err(RenderError::ScattererLooks { scatterers, looks, most: MOST_AMPLITUDES });
        }
        let (grid, scatterers) = Grid::new(&view, Squares { low, side_m: waist_m, size }, seen);
        let phasors = phasors(identity, &scatterers, looks);
        Ok(Scatterers { axes, beam, antenna, scatterers, looks, phasors, identity, view, grid })
    }

    /// Replaces `amplitudes` by those of an echo, one per look.
    pub fn amplitudes(&self, chirp: usize, cell: &Cell, amplitudes: &mut Vec<Complex<f64>>) {
        amplitudes.clear();
        amplitudes.resize(self.looks, Complex::ZERO);
        let mut power = 0.0;
        self.visit(chirp, cell, |wave| {
            power += wave.amplitude.norm_sqr();
            let looks = amplitudes.iter_mut().zip(wave.phasors);
            looks.for_each(|(sum, phasor)| *sum += wave.amplitude * phasor);
        });
        if power > 0.0 {
            let norm = 1.0 / power.sqrt();
            amplitudes.iter_mut().for_each(|amplitude| *amplitude *= norm);
            return;
        }
        // What is smaller than the spacing may have no scatterer, and then has an amplitude of its own.
        let place = [chirp as i64, i64::from(cell.sheets)];
        for (look, amplitude) in amplitudes.iter_mut().enumerate() {
            *amplitude = self.identity.draws(Purpose::Speckle, place, look).complex_gaussian();
        }
    }

    /// Calls `add` for the wave of every scatterer of an echo.
    pub fn visit(&self, chirp: usize, cell: &Cell, mut add: impl FnMut(Wave)) {
        let axis = &self.axes[chirp];
        let beam = self.beam.along(axis);
        let way_m = cell.range_m - cell.delay_m;
        // Half the path is the range for the radar alone; elsewhere its own way is at most the whole path.
        let widest_m = beam.section(way_m).radius_m.max(beam.waist_m);
        let reach_m = 1.2 * REACH * widest_m * self.view.focus_m / way_m.max(beam.waist_m);
        let at = self.view.place_m(axis.origin.xyz + beam.focus_m * axis.direction.xyz());
        for places in self.grid.near(at, reach_m) {
            for place in places {
                let scatterer = &self.scatterers[place];
                if scatterer.sheets != cell.sheets {
                    continue;
                }
                let Some(wave) = self.wave(place, scatterer, axis, &beam, way_m) else { continue };
                let [near_m, far_m] = cell.gate_m;
                if (near_m..far_m).contains(&(wave.range_m + cell.delay_m)) {
                    add(wave);
                }
            }
        }
    }

    /// The wave of a scatterer; `None` outside the beam.
    fn wave(
        &self,
        place: usize,
        scatterer: &Scatterer,
        axis: &Ray<Global>,
        beam: &GaussianBeam,
        carrier_m: f64,
    ) -> Option<Wave<'_>> {
        let (from_origin, forward) = (scatterer.point - axis.origin.xyz, axis.direction.xyz());
        let along_m = from_origin.dot(forward);
        let aside_m2 = from_origin.length_squared() - along_m * along_m;
        let section = beam.section(along_m);
        if along_m <= 0.0 || aside_m2 > (REACH * section.radius_m).powi(2) {
            return None;
        }
        let wavenumber = TAU / beam.wavelength_m;
        let out_m = along_m + 0.5 * aside_m2 * section.curvature_per_m;
        let gouy_rad = ((along_m - beam.focus_m) / beam.rayleigh_m()).atan();
        let (back_m, gouys) = match self.antenna {
            None => (out_m, 2.0),
            Some(antenna) => (scatterer.point.distance(antenna), 1.0),
        };
        let phase_rad = wavenumber * (out_m + back_m - 2.0 * carrier_m) - gouys * gouy_rad;
        let level = (-2.0 * aside_m2 / (section.radius_m * section.radius_m)).exp()
            / (section.radius_m * section.radius_m);
        Some(Wave {
            range_m: 0.5 * (out_m + back_m),
            amplitude: Complex::from_polar(level * scatterer.amplitude, phase_rad),
            phasors: &self.phasors[place * self.looks..(place + 1) * self.looks],
        })
    }
}

/// What a scatterer adds to an echo.
pub(in crate::render) struct Wave<'a> {
    /// Half of its path's length, m.
    pub range_m: f64,
    /// a·exp(iφ), which has no unit of its own.
    pub amplitude: Complex<f64>,
    /// g for every look.
    pub phasors: &'a [Complex<f64>],
}

/// The part of the view that any beam lights.
fn seen_field(beam: &Beam, view: &View, axes: &[Ray<Global>]) -> (DVec2, DVec2) {
    /// Beams far out of focus are wider than at the waist.
    const WAISTS: f64 = 8.0;
    let places = axes.iter().map(|axis| {
        let beam = beam.along(axis);
        let at = view.place_m(axis.origin.xyz + beam.focus_m * axis.direction.xyz());
        (at, DVec2::splat(WAISTS * beam.waist_m))
    });
    let empty = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    places.fold(empty, |(low, high), (at, reach)| (low.min(at - reach), high.max(at + reach)))
}

/// The radar and the antenna, as they look at a scatterer.
struct Eye<'a> {
    setup: &'a Setup<'a>,
    origin: Point<Global>,
    antenna: Option<DVec3>,
    /// Divergence of the beam, rad.
    beam_rad: f64,
}

impl Eye<'_> {
    /// The scatterer at a site; `None` where the radar or the antenna does not see it.
    fn scatterer(&self, site: &Site) -> Option<Scatterer> {
        let geometry = &self.setup.geometry;
        let point = Point::from(site.point);
        let to_site = self.origin.towards(point)?;
        let range_m = self.origin.distance_m(point);
        let sheets = self.passes(Ray { origin: self.origin, direction: to_site }, range_m)?;
        let normal = geometry.bvh.mesh().area_normal(site.facet as usize).normalize_or_zero();
        let cos_theta = normal.dot(to_site.xyz()).abs();
        let hit = Hit { facet: site.facet, range_m, point, cos_theta };
        let region = geometry.region_of_facet[site.facet as usize];
        let surface = self.setup.surfaces.get(usize::from(region))?;
        let to_source = -to_site.xyz();
        let frame = LocalFrame::at_hit(geometry.bvh.mesh(), &hit, to_source, surface.grain);
        let source = frame.local(to_source);
        let exit = match self.antenna {
            None => source,
            Some(antenna) => {
                let away = antenna - site.point;
                let exit = frame.local(away.normalize_or(DVec3::Z));
                if exit.cos_theta() <= 0.0 {
                    return None;
                }
                let origin = Point::from(site.point + LIFT_M * frame.normal());
                self.passes(Ray { origin, direction: Direction::new(away)? }, away.length())?;
                exit
            }
        };
        let seen = surface.seen_by(self.beam_rad, source, exit);
        let incoherent = seen.f_per_sr * (1.0 - seen.coherent_share);
        let amplitude = (incoherent * source.cos_theta() * exit.cos_theta()).max(0.0).sqrt();
        let scatterer = Scatterer { point: site.point, number: site.number, amplitude, sheets };
        (amplitude > 0.0).then_some(scatterer)
    }

    /// Number of sheets that a ray passes within a distance; `None` where something stops it before.
    fn passes(&self, ray: Ray<Global>, until_m: f64) -> Option<u8> {
        /// Rounding of the distance to a facet, m.
        const HAIR_M: f64 = 1e-6;
        let way = follow(self.setup, ray, until_m - HAIR_M);
        way.hit.is_none().then_some(way.passage.sheets)
    }
}

impl Squares {
    /// Column and row of a place, within the grid.
    fn cell(&self, at: DVec2) -> [usize; 2] {
        let at = ((at - self.low) / self.side_m).max(DVec2::ZERO);
        [(at.x as usize).min(self.size[0] - 1), (at.y as usize).min(self.size[1] - 1)]
    }

    fn square(&self, at: DVec2) -> usize {
        let [column, row] = self.cell(at);
        row * self.size[0] + column
    }
}

impl Grid {
    /// Columns and rows of squares of a side between two corners; their number where it is more than memory should hold.
    fn size(low: DVec2, high: DVec2, side_m: f64) -> Result<[usize; 2], f64> {
        // Without a chirp both corners are infinite, and one square remains.
        let sides = ((high - low) / side_m).max(DVec2::ZERO).floor() + 1.0;
        let squares = sides.x * sides.y;
        // Also what is no number is too large.
        if squares.is_nan() || squares > MOST_SQUARES {
            return Err(squares);
        }
        Ok([sides.x as usize, sides.y as usize])
    }

    /// Sorts scatterers into squares.
    fn new(view: &View, squares: Squares, scatterers: Vec<Scatterer>) -> (Grid, Vec<Scatterer>) {
        let mut keyed: Vec<(usize, Scatterer)> = scatterers
            .into_par_iter()
            .map(|scatterer| (squares.square(view.place_m(scatterer.point)), scatterer))
            .collect();
        keyed.par_sort_unstable_by_key(|(square, scatterer)| (*square, scatterer.number));
        let mut starts = vec![0; squares.size[0] * squares.size[1] + 1];
        keyed.iter().for_each(|(square, _)| starts[square + 1] += 1);
        for square in 1..starts.len() {
            starts[square] += starts[square - 1];
        }
        let scatterers = keyed.into_iter().map(|(_, scatterer)| scatterer).collect();
        (Grid { squares, starts }, scatterers)
    }

    /// The scatterers of the squares within a distance, row by row.
    fn near(&self, at: DVec2, reach_m: f64) -> impl Iterator<Item = std::ops::Range<usize>> {
        let [low, high] = [at - reach_m, at + reach_m].map(|at| self.squares.cell(at));
        (low[1]..=high[1]).map(move |row| {
            let start = row * self.squares.size[0];
            self.starts[start + low[0]]..self.starts[start + high[0] + 1]
        })
    }
}

/// The amplitudes of scatterers by their numbers, one per look.
fn phasors(identity: Identity, scatterers: &[Scatterer], looks: usize) -> Vec<Complex<f64>> {
    let last = scatterers.iter().map(|scatterer| scatterer.number).max();
    let blocks = last.map_or(0, |last| last / BLOCK + 1);
    let mut places = vec![Vec::new(); blocks];
    for (place, scatterer) in scatterers.iter().enumerate() {
        places[scatterer.number / BLOCK].push((scatterer.number % BLOCK, place));
    }
    let drawn: Vec<(usize, Complex<f64>)> = places
        .into_par_iter()
        .enumerate()
        .filter(|(_, places)| !places.is_empty())
        .flat_map_iter(|(block, mut places)| {
            places.sort_unstable();
            (0..looks).flat_map(move |look| {
                let mut draws = identity.draws(Purpose::Scatterers, [block as i64, 1], look);
                let of_block: Vec<_> = (0..BLOCK).map(|_| draws.complex_gaussian()).collect();
                let places = places.clone().into_iter();
                places.map(move |(number, place)| (place * looks + look, of_block[number]))
            })
        })
        .collect();
    let mut phasors = vec![Complex::ZERO; scatterers.len() * looks];
    drawn.into_iter().for_each(|(place, phasor)| phasors[place] = phasor);
    phasors
}
