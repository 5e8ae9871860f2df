//! Rays of one origin as points (u, v) of a plane, sorted into the cells of a grid.

use std::sync::Arc;

use glam::{DMat3, DVec3};
use rayon::prelude::*;
use thiserror::Error;

use super::lanes::LANES;
use crate::frames::{Global, Pose, Ray};
use crate::lanes::{Wide, least, most, widest};

/// Least cosine between a ray and the axis of its fan: 84°.
const LEAST_COS: f64 = 0.1;

/// Height of a cell over its width. The rays of a facet's cells are read row by row in blocks, and high cells give
/// fuller blocks.
const CELL_HEIGHT: f64 = 3.0;

/// Least side of a cell over the largest coordinate: four times the rounding of a box.
const LEAST_CELL: f64 = 1e-6;

/// Rays per task.
const CHUNK: usize = 4096;

/// Least value of [`Grid::reach`].
const LEAST_REACH: f32 = 0.01;

/// Rays that share an origin, sorted for [`Fan::closest`].
///
/// In a frame with the mean direction as z axis, a ray with direction d is the point (u, v) = (d_x/d_z, d_y/d_z).
/// A fan does not depend on a mesh: it can trace any number of them.
pub struct Fan<'a> {
    pub(super) rays: &'a [Ray<Global>],
    pub(super) origin: DVec3,
    /// Rotates a direction into the frame of the fan.
    pub(super) frame: DMat3,
    pub(super) order: Arc<RayOrder>,
}

/// The rays of a fan in its frame, ordered by cell.
pub(super) struct RayOrder {
    pub grid: Grid,
    /// Coordinates of the rays, ordered by cell, and [`LANES`] more that are read and not used.
    pub u: Vec<f32>,
    pub v: Vec<f32>,
    /// The ray at each place of these lists, and the place of each ray.
    pub ray_at: Vec<u32>,
    pub place_of: Vec<u32>,
}

/// A grid of cells over (u, v), and the places of the rays in each, row by row.
pub(super) struct Grid {
    pub min: [f32; 2],
    pub max: [f32; 2],
    /// Cells per unit of u and v.
    pub per: [f32; 2],
    /// Sides of a cell.
    pub cell: [f32; 2],
    pub columns: usize,
    pub rows: usize,
    /// The largest coordinate, at least [`LEAST_REACH`]. Rounding is proportional to it.
    pub reach: f32,
    /// First place of each cell, and the number of rays at the end.
    starts: Vec<u32>,
}

/// Why rays do not form a [`Fan`].
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
pub enum NoFan {
    /// There are no rays, or too many.
    #[error(
        "the tracer `pinhole` takes 1 to 2³² − 2 rays and not {rays}; use `bvh`, or leave the choice to the \
         program"
    )]
    Count {
        /// Number of rays.
        rays: usize,
    },
    /// The rays have different origins.
    #[error(
        "the tracer `pinhole` needs rays of one origin, and ray {ray} starts elsewhere than ray 0; \
         use `bvh`, or leave the choice to the program"
    )]
    Origins {
        /// Number of the first ray with another origin than ray 0.
        ray: usize,
    },
    /// A ray points too far from the mean direction.
    #[error(
        "the tracer `pinhole` needs rays within 84° of their mean, and ray {ray} is not; use `bvh`, or \
         leave the choice to the program"
    )]
    Wide {
        /// Number of the first such ray, from 0.
        ray: usize,
    },
}

impl<'a> Fan<'a> {
    /// Sorts the rays.
    ///
    /// # Errors
    /// When they do not share an origin, or point more than 84° away from their mean direction.
    pub fn new(rays: &'a [Ray<Global>]) -> Result<Fan<'a>, NoFan> {
        // Inside the thread pool, since every parallel step from outside would have to wake it.
        rayon::scope(|_| Fan::sort(rays))
    }

    fn sort(rays: &'a [Ray<Global>]) -> Result<Fan<'a>, NoFan> {
        let origin = match rays.first() {
            Some(ray) if rays.len() < u32::MAX as usize => ray.origin.xyz,
            _ => return Err(NoFan::Count { rays: rays.len() }),
        };
        let elsewhere = |rays: &[Ray<Global>]| rays.iter().position(|ray| ray.origin.xyz != origin);
        let sum = |rays: &[Ray<Global>]| rays.iter().map(|ray| ray.direction.xyz()).sum::<DVec3>();
        // The chunks are fixed, so that the sum does not depend on the number of threads.
        let chunks: Vec<_> =
            rays.par_chunks(CHUNK).map(|rays| (elsewhere(rays), sum(rays))).collect();
        for (chunk, (elsewhere, _)) in chunks.iter().enumerate() {
            if let Some(ray) = elsewhere {
                return Err(NoFan::Origins { ray: chunk * CHUNK + ray });
            }
        }
        let sum = chunks.iter().map(|(_, sum)| sum).sum::<DVec3>();
        let frame = frame_about(sum.normalize_or(rays[0].direction.xyz()));
        let blocks = rays.par_chunks(LANES).with_min_len(256);
        let flat: Vec<_> = blocks.map(|rays| widest(RayProjection { frame, rays })).collect();
        let flat = &flat.as_flattened()[..rays.len()];
        let is_wide = |at: &[f32; 2]| at[0].is_nan();
        if let Some(ray) = flat.par_iter().with_min_len(CHUNK).position_first(is_wide) {
            return Err(NoFan::Wide { ray });
        }
        let mut grid = Grid::over(flat);
        let place_of = grid.sort(flat);
        let mut order = RayOrder {
            grid,
            u: vec![0.0; rays.len() + LANES],
            v: vec![0.0; rays.len() + LANES],
            ray_at: vec![0; rays.len()],
            place_of,
        };
        for (&place, ray) in order.place_of.iter().zip(0..) {
            order.ray_at[place as usize] = ray;
        }
        let (u, v) = (order.u.par_iter_mut(), order.v.par_iter_mut());
        let places = order.ray_at.par_iter().zip(u.zip(v)).with_min_len(CHUNK);
        places.for_each(|(&ray, (u, v))| [*u, *v] = flat[ray as usize]);
        Ok(Fan { rays, origin, frame, order: Arc::new(order) })
    }

    /// The fan of the same rays moved by a pose, without sorting them again. `rays` must be the rays of this fan moved by
    /// `pose`, in the same order; the result is `None` if their number differs.
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
        Some(Fan { rays, origin, frame, order: Arc::clone(&self.order) })
    }
}

/// The rotation into a frame with a direction as z axis.
fn frame_about(axis: DVec3) -> DMat3 {
    let (right, up) = axis.any_orthonormal_pair();
    DMat3::from_cols(right, up, axis).transpose()
}

/// Projects up to [`LANES`] rays to (u, v); NaN for a ray too far from the axis.
struct RayProjection<'a> {
    frame: DMat3,
    rays: &'a [Ray<Global>],
}

impl Wide for RayProjection<'_> {
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
    /// A grid over all rays. Cells are as wide as the mean spacing of the rays; for rays along a line, the spacing on it.
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

    /// Column (axis 0) or row (axis 1) of a coordinate; outside the grid the nearest one. It is monotonic in `at`.
    #[inline(always)]
    pub fn step(&self, axis: usize, at: f32) -> u32 {
        let last = if axis == 0 { self.columns } else { self.rows } - 1;
        let step = least(most((at - self.min[axis]) * self.per[axis], 0.0), last as f32);
        // Adding 2²³ rounds to a whole number and leaves it in the last 23 bits.
        const WHOLE: f32 = (1 << 23) as f32;
        (step + WHOLE).to_bits() - WHOLE.to_bits()
    }

    /// The range of places of the columns from `first` to `last` in a row: first place, and the place after the last.
    #[inline(always)]
    pub fn places(&self, row: usize, first: usize, last: usize) -> [usize; 2] {
        let cell = row * self.columns;
        [cell + first, cell + last + 1].map(|cell| self.starts[cell] as usize)
    }

    /// The first place of a row. The row after the last gives the number of rays.
    pub fn row_start(&self, row: usize) -> usize {
        self.starts[row * self.columns] as usize
    }

    /// Orders the rays by cell, and within a cell by number. Returns the place of every ray.
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
