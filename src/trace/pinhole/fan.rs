//! Rays of one origin as points of a plane, sorted into cells.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use thiserror::Error;

use super::lanes::LANES;
use crate::frames::{Global, Pose, Ray};
use crate::trace::wide::{Wide, least, most, widest};

/// Least cosine between a ray and the axis of its fan: 84°.
const LEAST_COS: f64 = 0.1;

/// Height of a cell over its width. A facet reads its cells row by row, a block of lanes at a time:
/// high cells make full blocks.
const CELL_HEIGHT: f64 = 3.0;

/// Least side of a cell over the largest coordinate: four times what rounding moves a box by.
const LEAST_CELL: f64 = 1e-6;

/// Rays of one task.
const CHUNK: usize = 4096;

/// Below this the coordinates are as good as in the middle of the picture.
const LEAST_REACH: f32 = 0.01;

/// Rays that share an origin, sorted for [`Fan::closest`].
///
/// In a frame whose z axis is the mean direction, a ray is the point (u, v) = (d_x/d_z, d_y/d_z).
/// A fan belongs to its rays alone: it serves every mesh and every pose of it.
pub struct Fan<'a> {
    pub(super) rays: &'a [Ray<Global>],
    pub(super) origin: DVec3,
    /// Turns a direction into the frame of the fan.
    pub(super) frame: DMat3,
    pub(super) sorted: Arc<Sorted>,
}

/// The rays of a fan in its frame, cell after cell.
pub(super) struct Sorted {
    pub grid: Grid,
    /// Coordinates of the rays, cell after cell, and [`LANES`] more that are read and not used.
    pub u: Vec<f32>,
    pub v: Vec<f32>,
    /// The ray at each place of these lists, and the place of each ray.
    pub ray_at: Vec<u32>,
    pub place_of: Vec<u32>,
}

/// Cells over (u, v), and which places belong to each, row by row.
pub(super) struct Grid {
    pub min: [f32; 2],
    pub max: [f32; 2],
    /// Cells per unit of u and v.
    pub per: [f32; 2],
    /// Sides of a cell.
    pub cell: [f32; 2],
    pub columns: usize,
    pub rows: usize,
    /// The largest coordinate, which is what they are rounded to.
    pub reach: f32,
    /// First place of each cell, and the end.
    starts: Vec<u32>,
}

/// Why rays are no fan.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum NoFan {
    /// There is no ray, or more than can be numbered.
    #[error(
        "the tracer `pinhole` takes 1 to 2³² − 2 rays and not {rays}; use `bvh`, or leave the choice to the \
         program"
    )]
    Count {
        /// How many there are.
        rays: usize,
    },
    /// They start at several places.
    #[error(
        "the tracer `pinhole` needs rays of one origin, and ray {ray} starts elsewhere than ray 0; \
         use `bvh`, or leave the choice to the program"
    )]
    Origins {
        /// The first that starts elsewhere, from 0.
        ray: usize,
    },
    /// They point all around.
    #[error(
        "the tracer `pinhole` needs rays within 84° of their mean, and ray {ray} is not; use `bvh`, or \
         leave the choice to the program"
    )]
    Wide {
        /// The first such ray, from 0.
        ray: usize,
    },
}

impl<'a> Fan<'a> {
    /// Sorts the rays.
    ///
    /// # Errors
    /// When they do not share an origin, or point more than 84° away from their mean direction.
    pub fn new(rays: &'a [Ray<Global>]) -> Result<Fan<'a>, NoFan> {
        // Within the pool: from outside, every step would wake it anew.
        rayon::scope(|_| Fan::sorted(rays))
    }

    fn sorted(rays: &'a [Ray<Global>]) -> Result<Fan<'a>, NoFan> {
        let origin = match rays.first() {
            Some(ray) if rays.len() < u32::MAX as usize => ray.origin.xyz,
            _ => return Err(NoFan::Count { rays: rays.len() }),
        };
        let elsewhere = |rays: &[Ray<Global>]| rays.iter().position(|ray| ray.origin.xyz != origin);
        let sum = |rays: &[Ray<Global>]| rays.iter().map(|ray| ray.direction.xyz()).sum::<DVec3>();
        // Fixed chunks, so that the sum does not depend on the threads.
        let chunks: Vec<_> =
            rays.par_chunks(CHUNK).map(|rays| (elsewhere(rays), sum(rays))).collect();
        for (chunk, (elsewhere, _)) in chunks.iter().enumerate() {
            if let Some(ray) = elsewhere {
                return Err(NoFan::Origins { ray: chunk * CHUNK + ray });
            }
        }
        let sum = chunks.iter().map(|(_, sum)| sum).sum::<DVec3>();
        let frame = frame(sum.normalize_or(rays[0].direction.xyz()));
        let blocks = rays.par_chunks(LANES).with_min_len(256);
        let flat: Vec<_> = blocks.map(|rays| widest(Flattening { frame, rays })).collect();
        let flat = &flat.as_flattened()[..rays.len()];
        let is_wide = |at: &[f32; 2]| at[0].is_nan();
        if let Some(ray) = flat.par_iter().with_min_len(CHUNK).position_first(is_wide) {
            return Err(NoFan::Wide { ray });
        }
        let mut grid = Grid::over(flat);
        let place_of = grid.sort(flat);
        let mut sorted = Sorted {
            grid,
            u: vec![0.0; rays.len() + LANES],
            v: vec![0.0; rays.len() + LANES],
            ray_at: vec![0; rays.len()],
            place_of,
        };
        for (&place, ray) in sorted.place_of.iter().zip(0..) {
            sorted.ray_at[place as usize] = ray;
        }
        let (u, v) = (sorted.u.par_iter_mut(), sorted.v.par_iter_mut());
        let places = sorted.ray_at.par_iter().zip(u.zip(v)).with_min_len(CHUNK);
        places.for_each(|(&ray, (u, v))| [*u, *v] = flat[ray as usize]);
        Ok(Fan { rays, origin, frame, sorted: Arc::new(sorted) })
    }

    /// The fan of the same rays at another pose, which need not be sorted again; `None` unless there are as
    /// many. Each of `rays` must be the one of this fan, carried by `pose`.
    ///
    /// ```
    /// use matdb::frames::{Point, Pose, Ray};
    /// use matdb::trace::Fan;
    /// let origin = Point::new(0.0, 0.0, 8.0);
    /// let ray = |x: f64| Ray { origin, direction: origin.towards(Point::new(x, 0.2, 0.0)).unwrap() };
    /// let rays = [ray(0.0), ray(0.1), ray(0.2)];
    /// let pose = Pose::from_euler_xyz([0.0, 0.3, 0.1].into(), [0.5, 0.0, 0.2].into());
    /// let carried = rays.map(|ray| Ray { origin: pose * ray.origin, direction: pose * ray.direction });
    /// let mesh = matdb::scene::solids::icosphere(0.5, 2);
    /// let again = Fan::new(&rays).unwrap().carried(&carried, &pose).unwrap();
    /// assert_eq!(again.closest(&mesh), Fan::new(&carried).unwrap().closest(&mesh));
    /// ```
    pub fn carried<'b>(
        &self,
        rays: &'b [Ray<Global>],
        pose: &Pose<Global, Global>,
    ) -> Option<Fan<'b>> {
        let origin = rays.first().filter(|_| rays.len() == self.rays.len())?.origin.xyz;
        let frame = self.frame * pose.rotation().transpose();
        Some(Fan { rays, origin, frame, sorted: Arc::clone(&self.sorted) })
    }
}

/// Rows: two axes across a direction, and it.
fn frame(axis: DVec3) -> DMat3 {
    let (right, up) = axis.any_orthonormal_pair();
    DMat3::from_cols(right, up, axis).transpose()
}

/// (u, v) of up to [`LANES`] rays; not a number for one that is too far from the axis.
struct Flattening<'a> {
    frame: DMat3,
    rays: &'a [Ray<Global>],
}

impl Wide for Flattening<'_> {
    type Answer = [[f32; 2]; LANES];

    #[inline(always)]
    fn run(self) -> [[f32; 2]; LANES] {
        let mut along = [[0.0; LANES]; 3];
        for (lane, ray) in self.rays.iter().enumerate() {
            let at = ray.direction.xyz().to_array();
            along.iter_mut().zip(at).for_each(|(list, at)| list[lane] = at);
        }
        let mut flat = [[0.0; 2]; LANES];
        for lane in 0..LANES {
            let along = DVec3::new(along[0][lane], along[1][lane], along[2][lane]);
            let DVec3 { x, y, z } = self.frame * along;
            let per_depth = if z > LEAST_COS { 1.0 / z } else { f64::NAN };
            flat[lane] = [(x * per_depth) as f32, (y * per_depth) as f32];
        }
        flat
    }
}

impl Grid {
    /// Cells as wide as the rays' mean spacing; along a line, their spacing on it.
    fn over(flat: &[[f32; 2]]) -> Grid {
        let bounds = |points: &[[f32; 2]]| {
            let (mut min, mut max) = ([f32::INFINITY; 2], [f32::NEG_INFINITY; 2]);
            for point in points {
                for axis in [0, 1] {
                    min[axis] = least(min[axis], point[axis]);
                    max[axis] = most(max[axis], point[axis]);
                }
            }
            [min, max]
        };
        let corners: Vec<_> = flat.par_chunks(CHUNK).flat_map_iter(bounds).collect();
        let [min, max] = bounds(&corners);
        let sides = [0, 1].map(|axis| f64::from(max[axis]) - f64::from(min[axis]));
        let count = flat.len() as f64;
        let longest = sides[0].max(sides[1]);
        let spacing = (sides[0] * sides[1] / count).sqrt().max(longest / count);
        let reach = min.into_iter().chain(max).map(f32::abs).fold(LEAST_REACH, f32::max);
        let least = LEAST_CELL * f64::from(reach);
        let cell = [1.0, CELL_HEIGHT].map(|factor| (factor * spacing).max(least) as f32);
        let per = cell.map(|side| 1.0 / side);
        let cells = |axis: usize| ((max[axis] - min[axis]) * per[axis]).round() as usize + 1;
        let (columns, rows) = (cells(0), cells(1));
        Grid { min, max, per, cell, columns, rows, reach, starts: vec![0; columns * rows + 1] }
    }

    /// Column or row of a coordinate; outside the grid the nearest. It never falls as `at` grows.
    #[inline(always)]
    pub fn step(&self, axis: usize, at: f32) -> u32 {
        let last = if axis == 0 { self.columns } else { self.rows } - 1;
        let step = least(most((at - self.min[axis]) * self.per[axis], 0.0), last as f32);
        // A sum of 2²³ and less than that is rounded to a whole number, which its last 23 bits are.
        const WHOLE: f32 = (1 << 23) as f32;
        (step + WHOLE).to_bits() - WHOLE.to_bits()
    }

    /// The places of some columns, from first to last, of a row.
    #[inline(always)]
    pub fn places(&self, row: usize, first: usize, last: usize) -> [usize; 2] {
        let cell = row * self.columns;
        [cell + first, cell + last + 1].map(|cell| self.starts[cell] as usize)
    }

    /// The first place of a row; of the row after the last, the end.
    pub fn row_start(&self, row: usize) -> usize {
        self.starts[row * self.columns] as usize
    }

    /// The place of every ray, cell after cell and in a cell by number.
    fn sort(&mut self, flat: &[[f32; 2]]) -> Vec<u32> {
        let columns = self.columns as u32;
        let cell = |&[u, v]: &[f32; 2]| self.step(1, v) * columns + self.step(0, u);
        let mut place_of: Vec<u32> = flat.par_iter().with_min_len(CHUNK).map(cell).collect();
        let mut next = vec![0; self.starts.len()];
        place_of.iter().for_each(|&cell| next[cell as usize] += 1);
        let mut before = 0;
        for count in &mut next {
            before += std::mem::replace(count, before);
        }
        self.starts.copy_from_slice(&next);
        for place in &mut place_of {
            let next = &mut next[*place as usize];
            *place = *next;
            *next += 1;
        }
        place_of
    }
}
