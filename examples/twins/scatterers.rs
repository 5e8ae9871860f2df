//! Scatterers on the surface: where they lie, which of them the radar sees, and how bright they are.
//!
//! Facets are halved at their longest side until each piece has at most the area of one scatterer. Pieces
//! in a row then hold one scatterer per area of one, at a random place of it: about evenly, and never on a
//! lattice.

use std::collections::HashMap;
use std::ops::Range;

use glam::{DMat3, DVec3};
use matdb::geometry::Mesh;
use num_complex::Complex;
use rayon::prelude::*;

use super::base::Base;
use super::physics::{Acting, incoherent_per_sr, moves};
use super::scan::{Shot, Stream, World, draws, look, ray};

/// Farther in front of a scatterer than this, m, a surface hides it: far above the rounding of f64 at 8 m.
const HIDES_M: f64 = 1e-6;

/// One of them that the radar sees.
#[derive(Clone, Copy, Debug)]
pub struct Scatterer {
    pub point: DVec3,
    /// √(f·cos²θ) of its place, in 1/√sr.
    pub brightness: f64,
}

/// All that the radar sees, by place.
pub struct Scatterers {
    pub seen: Vec<Scatterer>,
    /// Complex amplitudes, E|a|² = 1: so many sets of one per scatterer, scatterer by scatterer.
    amplitudes: Vec<Complex<f64>>,
    sets: usize,
    cells: HashMap<[i32; 3], Range<usize>>,
    cell_m: f64,
}

impl Scatterers {
    /// The scatterers of a mesh, `spacing_m` apart, as the world's radar sees them. Which of them are hidden,
    /// and under what angle each is seen, is judged from where the target stands in the middle of the scan:
    /// a sway of 6 cm at 8 m turns the view by 8 mrad.
    pub fn new(
        world: &World,
        seed: u64,
        base: &Base,
        acting: &[Acting],
        spacing_m: f64,
        sets: usize,
    ) -> Scatterers {
        let antenna = world.middle_of_scan().map_or(world.origin, |sight| {
            moves(acting, sight).iter().fold(world.origin, |at, moved| moved.undo(at))
        });
        let mesh = world.bvh.mesh();
        let cell_m = 4.0 * spacing_m;
        let places = places(mesh, seed, spacing_m);
        let mut seen: Vec<(usize, Scatterer)> = places
            .into_par_iter()
            .enumerate()
            .filter_map(|(number, point)| {
                let shot = visible(world, antenna, point)?;
                let f = incoherent_per_sr(world, base, acting, &shot);
                let brightness = shot.cos_theta() * f.max(0.0).sqrt();
                (brightness > 0.0).then_some((number, Scatterer { point, brightness }))
            })
            .collect();
        seen.sort_by_key(|(number, scatterer)| (cell(scatterer.point, cell_m), *number));
        let amplitudes = seen
            .par_iter()
            .flat_map_iter(|(number, _)| {
                let mut random = draws(seed, *number, Stream::Scatterer);
                (0..sets).map(move |_| random.complex_gaussian())
            })
            .collect();
        let seen: Vec<Scatterer> = seen.into_iter().map(|(_, scatterer)| scatterer).collect();
        let mut cells: HashMap<[i32; 3], Range<usize>> = HashMap::new();
        for (index, scatterer) in seen.iter().enumerate() {
            cells.entry(cell(scatterer.point, cell_m)).or_insert(index..index).end = index + 1;
        }
        Scatterers { seen, amplitudes, sets, cells, cell_m }
    }

    /// Numbers of all scatterers within a distance of a point, and of some beyond it.
    pub fn near(&self, point: DVec3, reach_m: f64) -> impl Iterator<Item = usize> + '_ {
        let [low, high] = [-reach_m, reach_m].map(|by| cell(point + DVec3::splat(by), self.cell_m));
        (low[0]..=high[0])
            .flat_map(move |x| (low[1]..=high[1]).map(move |y| (x, y)))
            .flat_map(move |(x, y)| (low[2]..=high[2]).map(move |z| [x, y, z]))
            .filter_map(|cell| self.cells.get(&cell))
            .flat_map(Range::clone)
    }

    /// The amplitudes of one scatterer, one per set.
    pub fn amplitudes(&self, index: usize) -> &[Complex<f64>] {
        &self.amplitudes[index * self.sets..(index + 1) * self.sets]
    }
}

fn cell(point: DVec3, cell_m: f64) -> [i32; 3] {
    (point / cell_m).floor().as_ivec3().to_array()
}

/// What the radar meets at a point of the surface, unless something lies in front of it.
fn visible(world: &World, antenna: DVec3, point: DVec3) -> Option<Shot> {
    let met = look(&world.bvh, &ray(antenna, point - antenna)?)?;
    (met.range_m > antenna.distance(point) - HIDES_M).then_some(met)
}

/// One point per `spacing_m`² of a mesh, whatever the size of its facets.
pub fn places(mesh: &Mesh, seed: u64, spacing_m: f64) -> Vec<DVec3> {
    let each_m2 = spacing_m * spacing_m;
    let mut places = Vec::new();
    let mut covered_m2 = 0.0;
    let mut random = draws(seed, 0, Stream::Place);
    let mut next_m2 = random.uniform() * each_m2;
    for facet in 0..mesh.facets.len() {
        let mut pieces = vec![mesh.corners(facet)];
        while let Some(piece) = pieces.pop() {
            let area_m2 = area_m2(piece);
            if area_m2 > each_m2 {
                pieces.extend(halves(piece));
                continue;
            }
            covered_m2 += area_m2;
            if next_m2 < covered_m2 {
                places.push(within(piece, [random.uniform(), random.uniform()]));
                let number = places.len();
                random = draws(seed, number, Stream::Place);
                next_m2 = (number as f64 + random.uniform()) * each_m2;
            }
        }
    }
    places
}

fn area_m2([a, b, c]: [DVec3; 3]) -> f64 {
    0.5 * (b - a).cross(c - a).length()
}

/// A triangle cut in two of the same area, at the middle of its longest side.
fn halves([a, b, c]: [DVec3; 3]) -> [[DVec3; 3]; 2] {
    let (ab, bc, ca) = (a.distance(b), b.distance(c), c.distance(a));
    let [from, to, tip] = if ab >= bc && ab >= ca {
        [a, b, c]
    } else if bc >= ca {
        [b, c, a]
    } else {
        [c, a, b]
    };
    let middle = from.midpoint(to);
    [[from, middle, tip], [middle, to, tip]]
}

/// A point of a triangle, every one as likely.
fn within([a, b, c]: [DVec3; 3], [first, second]: [f64; 2]) -> DVec3 {
    let root = first.sqrt();
    DMat3::from_cols(a, b, c) * DVec3::new(1.0 - root, root * (1.0 - second), root * second)
}
