//! The choice of a tracer for many rays.

use rayon::prelude::*;

use thiserror::Error;

use super::brute;
use super::bvh::Bvh;
use super::gpu::{GpuError, GpuMesh};
use super::hit::Hit;
use super::pinhole::{Fan, NoFan};
use crate::frames::{Global, Ray};

/// Facets per ray from which on a hierarchy that is built is faster than a fan.
const FACETS_PER_RAY: usize = 3;

/// A method to find the closest hits of many rays. All give the same hits ([`Brute`](Self::Brute) up to rounding);
/// they differ in speed and in the rays that they accept.
#[derive(Clone, Copy, Default)]
pub enum Tracer<'a> {
    /// [`Fan`] if all rays share an origin, otherwise [`Bvh`]; also [`Bvh`] if it is built and facets are many more than
    /// rays, since a fan reads every facet.
    #[default]
    Automatic,
    /// [`Fan`]: accepts rays of one origin only, and builds no hierarchy.
    Pinhole,
    /// [`Bvh`]: accepts any rays.
    Bvh,
    /// [`brute`]: accepts any rays; slow.
    Brute,
    /// A graphics processor with the hierarchy in its memory: accepts any rays.
    Gpu(&'a GpuMesh<'a>),
}

/// Why rays cannot be traced.
#[derive(Clone, Debug, Error, PartialEq, Eq)]
pub enum TraceError {
    /// The rays do not suit the tracer `pinhole`.
    #[error(transparent)]
    NoFan(#[from] NoFan),
    /// The graphics processor fails.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

impl Tracer<'_> {
    /// Rays of spots that are best given to [`closest_of_spots`](Self::closest_of_spots) at once: a graphics processor waits
    /// for its memory, and a processor's caches hold few.
    pub(crate) fn rays_at_once(self) -> usize {
        match self {
            Tracer::Gpu(_) => 1 << 18,
            _ => 1 << 10,
        }
    }

    /// Finds the closest hit of every ray on the mesh of `bvh`. The hierarchy is built only if the tracer uses it.
    ///
    /// # Errors
    /// When the rays do not suit [`Tracer::Pinhole`], or when the graphics processor fails or holds another hierarchy.
    pub fn closest(self, bvh: &Bvh, rays: &[Ray<Global>]) -> Result<Vec<Option<Hit>>, TraceError> {
        Ok(match self {
            Tracer::Pinhole => Fan::new(rays)?.closest(bvh.mesh()),
            Tracer::Bvh => bvh.closest_of_each(rays),
            Tracer::Brute => rays.par_iter().map(|ray| brute::closest(bvh.mesh(), ray)).collect(),
            Tracer::Gpu(held) if std::ptr::eq(held.bvh(), bvh) => held.closest(rays)?,
            Tracer::Gpu(_) => return Err(GpuError::OtherMesh.into()),
            Tracer::Automatic => closest(bvh, rays),
        })
    }

    /// As [`closest`](Self::closest), for the rays of spots, one spot after the other. [`Automatic`](Self::Automatic) walks
    /// the hierarchy.
    ///
    /// # Errors
    /// Those of [`closest`](Self::closest).
    pub fn closest_of_spots(
        self,
        bvh: &Bvh,
        rays: &[Ray<Global>],
        rays_per_spot: usize,
    ) -> Result<Vec<Option<Hit>>, TraceError> {
        match self {
            Tracer::Automatic | Tracer::Bvh => Ok(bvh.closest_of_spots(rays, rays_per_spot)),
            Tracer::Pinhole | Tracer::Brute | Tracer::Gpu(_) => self.closest(bvh, rays),
        }
    }
}

/// Finds the closest hit of every ray with [`Tracer::Automatic`], which accepts any rays and cannot fail.
pub fn closest(bvh: &Bvh, rays: &[Ray<Global>]) -> Vec<Option<Hit>> {
    if bvh.is_built() && bvh.mesh().facets.len() > FACETS_PER_RAY * rays.len() {
        return bvh.closest_of_each(rays);
    }
    match Fan::new(rays) {
        Ok(fan) => fan.closest(bvh.mesh()),
        Err(_) => bvh.closest_of_each(rays),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frames::Point;
    use crate::lanes::at_most;
    use crate::scene::{mannequin, solids};
    use crate::trace::testing;

    fn ray(from: [f64; 3], to: [f64; 3]) -> Ray<Global> {
        testing::ray(from.into(), to.into())
    }

    #[test]
    fn one_origin_needs_no_hierarchy_and_two_need_one() {
        let mesh = solids::plate(2.0, 2.0);
        let mut rays =
            vec![ray([0.0, 0.0, 8.0], [0.1, 0.2, 0.0]), ray([0.0, 0.0, 8.0], [0.3, 0.0, 0.0])];
        let bvh = Bvh::new(&mesh);
        let one = Tracer::Automatic.closest(&bvh, &rays).unwrap();
        assert!(one.iter().all(Option::is_some) && !bvh.is_built());
        rays.push(ray([1.0, 0.0, 8.0], [0.3, 0.0, 0.0]));
        assert_eq!(Tracer::Pinhole.closest(&bvh, &rays), Err(NoFan::Origins { ray: 2 }.into()));
        assert!(!bvh.is_built());
        let two = Tracer::Automatic.closest(&bvh, &rays).unwrap();
        assert!(bvh.is_built() && two[..2] == one && two[2].is_some());
        assert_eq!(Tracer::Bvh.closest(&bvh, &rays).unwrap(), two);
        for (slow, fast) in Tracer::Brute.closest(&bvh, &rays).unwrap().iter().zip(&two) {
            assert!((slow.unwrap().range_m - fast.unwrap().range_m).abs() < 1e-14);
        }
    }

    #[test]
    fn rays_of_many_tasks_meet_what_each_meets_alone() {
        let mesh = solids::icosphere(0.5, 3);
        let bvh = Bvh::new(&mesh);
        let towards = |k: u32| {
            let turn = f64::from(k) * 2.4;
            let aside = 0.6 * (f64::from(k) / 1000.0).sqrt();
            ray([turn.sin(), turn.cos(), 3.0], [aside * turn.cos(), aside * turn.sin(), 0.0])
        };
        let rays: Vec<_> = (0..1000).map(towards).collect();
        let alone: Vec<_> = rays.iter().map(|ray| bvh.closest(ray)).collect();
        let missed = alone.iter().filter(|hit| hit.is_none()).count();
        assert!((100..900).contains(&missed), "{missed}");
        assert_eq!(Tracer::Bvh.closest(&bvh, &rays).unwrap(), alone);
    }

    #[test]
    fn no_rays_meet_nothing() {
        let mesh = solids::plate(2.0, 2.0);
        assert_eq!(Tracer::Automatic.closest(&Bvh::new(&mesh), &[]).unwrap(), []);
        let refused = Tracer::Pinhole.closest(&Bvh::new(&mesh), &[]);
        assert_eq!(refused, Err(NoFan::Count { rays: 0 }.into()));
    }

    #[test]
    fn every_width_of_instructions_gives_the_same_hits() {
        let body = mannequin::mannequin();
        let origin = Point::new(0.0, 1.1, 8.0);
        let towards = |k: u32| {
            let [x, y] = [k % 120, k / 120].map(|i| 2.2 * (f64::from(i) + 0.3) / 120.0 - 1.1);
            Ray { origin, direction: origin.towards(Point::new(x, y + 1.1, 0.0)).unwrap() }
        };
        let rays: Vec<_> = (0..120 * 120).map(towards).collect();
        let hits = |bits: u32| {
            at_most(bits, || {
                let bvh = Bvh::new(&body);
                [Tracer::Pinhole, Tracer::Bvh].map(|by| by.closest(&bvh, &rays).unwrap())
            })
        };
        let [plain, of_256, of_512] = [128, 256, 512].map(hits);
        assert!(plain[0].iter().flatten().count() > 1_000);
        assert!(plain == of_256 && plain == of_512);
    }
}
