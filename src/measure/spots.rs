//! Gaps of echoes of whole spots: the range of a radar is the mean over its beam, weighted by what each part returns.
//!
//! On a curved or steep surface the mean differs from the range on the axis: near the rim of a ball by centimetres. Here
//! rays spread over the beam, by its two-way weight, and a surface of Lambert's law say what the mean is. Parts that are a
//! range cell or more behind the others are other echoes; the strongest counts.

use glam::DVec3;

use super::cloud::Cloud;
use super::ray_gap::RayGap;
use super::tracer::{Intersection, RaySet, Tracer};
use crate::frames::{Global, Pose, Ray};
use crate::geometry::Mesh;
use crate::radar::{Footprint, Radar};
use crate::render::spot_rays;

/// Rays over each beam: means over them err by a tenth of what the mean differs from the axis.
const RAYS: usize = 16;

/// The rays over the beams of measured points.
pub(super) struct SpotRays {
    rays: Vec<Ray<Global>>,
    cell_m: f64,
    footprint: Footprint,
}

impl SpotRays {
    /// From the axis of each point's beam; a spot is as wide as the beam at the point.
    pub fn new(radar: &Radar, axes: &[Ray<Global>], cloud: &Cloud) -> SpotRays {
        let points = cloud.points().iter().map(|point| point.point.xyz);
        let met = axes.iter().zip(points).map(|(axis, p)| (*axis, p.distance(axis.origin.xyz)));
        SpotRays {
            rays: spot_rays(radar, met, RAYS),
            cell_m: radar.range_cell_m(),
            footprint: radar.footprint,
        }
    }
}

/// The same, ready for one mesh.
pub(super) struct Spots<'a> {
    set: RaySet<'a>,
    spot_rays: &'a SpotRays,
}

impl<'a> Spots<'a> {
    pub fn new(mesh: &Mesh, spot_rays: &'a SpotRays) -> Spots<'a> {
        Spots { set: RaySet::new(mesh, &spot_rays.rays), spot_rays }
    }

    /// The gap of every point at a pose; `None` where no part of a beam meets the mesh, and as for a single ray.
    pub fn gaps(
        &self,
        tracer: &Tracer,
        pose: &Pose<Global, Global>,
        axes: &[Ray<Global>],
        points: &[DVec3],
        reach_m: f64,
    ) -> Vec<Option<RayGap>> {
        let seen = tracer.scan(pose, &self.set);
        let spots = seen.chunks(RAYS).zip(self.set.rays().chunks(RAYS));
        let measured = axes.iter().zip(points);
        let gaps = spots.zip(measured).map(|((seen, rays), (axis, point))| {
            let mean = self.mean(seen, rays)?;
            mean.gap((*point - axis.origin.xyz).dot(axis.direction.xyz()), reach_m)
        });
        gaps.collect()
    }

    /// The strongest echo of a spot.
    fn mean(&self, seen: &[Option<Intersection>], rays: &[Ray<Global>]) -> Option<Mean> {
        let SpotRays { cell_m, footprint, .. } = *self.spot_rays;
        let met = seen.iter().zip(rays).filter_map(|(seen, ray)| Some(((*seen)?, ray)));
        let mut met: Vec<(Intersection, &Ray<Global>)> = met.collect();
        met.sort_by(|a, b| a.0.hit.range_m.total_cmp(&b.0.hit.range_m));
        let echoes = met.chunk_by(|a, b| b.0.hit.range_m - a.0.hit.range_m < cell_m);
        let echoes = echoes.filter_map(|echo| Mean::of(echo, footprint));
        echoes.max_by(|a, b| a.weight.total_cmp(&b.weight))
    }
}

/// The mean over an echo, by the power that each part returns.
struct Mean {
    weight: f64,
    range_m: f64,
    cos_theta: f64,
    at: DVec3,
    /// How the range shrinks when the surface moves.
    gradient: DVec3,
}

impl Mean {
    fn of(echo: &[(Intersection, &Ray<Global>)], footprint: Footprint) -> Option<Mean> {
        /// Flatter parts return nothing; a gradient would be without bound.
        const FLATTEST_COS: f64 = 0.03;
        let mut sum = Mean {
            weight: 0.0,
            range_m: 0.0,
            cos_theta: 0.0,
            at: DVec3::ZERO,
            gradient: DVec3::ZERO,
        };
        for (Intersection { hit, normal }, ray) in echo {
            let cos = hit.cos_theta;
            if cos < FLATTEST_COS {
                continue;
            }
            let weight = cos * cos / Footprint::Paper.factor_to(footprint, cos);
            sum.weight += weight;
            sum.range_m += weight * hit.range_m;
            sum.cos_theta += weight * cos;
            sum.at += weight * hit.point.xyz;
            sum.gradient += weight * *normal / normal.dot(ray.direction.xyz());
        }
        (sum.weight > 0.0).then(|| Mean {
            weight: sum.weight,
            range_m: sum.range_m / sum.weight,
            cos_theta: sum.cos_theta / sum.weight,
            at: sum.at / sum.weight,
            gradient: sum.gradient / sum.weight,
        })
    }

    fn gap(&self, measured_m: f64, reach_m: f64) -> Option<RayGap> {
        RayGap::new(self.at, self.gradient, self.cos_theta, measured_m - self.range_m, reach_m)
    }
}

#[cfg(test)]
mod tests {
    use super::super::point_rays::PointRays;
    use super::super::synthetic::SyntheticScan;
    use super::*;
    use crate::radar::Beam;
    use crate::scene::solids;

    /// Gaps of points on the axes, and ranges there, of a mesh where it stands.
    fn gaps(mesh: Mesh) -> Vec<(RayGap, f64)> {
        let scan = SyntheticScan::of(mesh, 0.0, 1);
        let axes = PointRays::of(&scan.cloud, &scan.radar, &scan.chirps).unwrap().rays;
        let points: Vec<DVec3> = scan.cloud.points().iter().map(|p| p.point.xyz).collect();
        let spot_rays = SpotRays::new(&scan.radar, &axes, &scan.cloud);
        let here = Pose::from_euler_xyz(DVec3::ZERO, DVec3::ZERO);
        let (tracer, spots) = (Tracer::new(&scan.mesh), Spots::new(&scan.mesh, &spot_rays));
        let gaps = spots.gaps(&tracer, &here, &axes, &points, 0.1);
        let near = gaps
            .into_iter()
            .zip(&axes)
            .zip(&points)
            .filter(|((gap, _), point)| gap.is_some() && point.x.hypot(point.y - 1.1) < 0.03);
        near.filter_map(|((gap, axis), point)| Some((gap?, point.distance(axis.origin.xyz))))
            .collect()
    }

    #[test]
    fn a_sphere_lies_behind_its_axis_by_its_sagitta() {
        let radius_m = 0.15;
        let mut ball = solids::icosphere(radius_m, 6);
        ball.vertices.iter_mut().for_each(|vertex| vertex.z -= radius_m);
        let found = gaps(ball);
        let mean_m = found.iter().map(|(gap, _)| -gap.range_error_m).sum::<f64>();
        // With the two-way weight exp(−4r²/w²) the mean of r² is w²/4, and rays follow their wave's front.
        let expected_m = found.iter().map(|(_, range_m)| {
            let section = Beam::new(&Radar::default()).towards(0.0, 0.0).section(*range_m);
            section.radius_m.powi(2) / 8.0 * (1.0 / radius_m + section.curvature_per_m)
        });
        let ratio = mean_m / expected_m.sum::<f64>();
        assert!(found.len() > 20 && (ratio - 1.0).abs() < 0.1, "{} {ratio}", found.len());
    }

    #[test]
    fn a_plate_lies_where_its_axis_meets_it() {
        let found = gaps(solids::plate(0.5, 0.5));
        assert!(found.len() > 20);
        for (gap, _) in found {
            assert!(gap.range_error_m.abs() < 1e-4, "{}", gap.range_error_m);
        }
    }
}
