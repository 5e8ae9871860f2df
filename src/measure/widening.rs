//! How much wider than its own a radar sees the lobes of a registered target.
//!
//! A lobe with the slopes m² of a surface of the depth z(r) across the beam is seen as one of the slopes
//! m²·1 + δ_w²·1 + (w²/4)·(H + 1/R_c)², where w is the radius of the spot, R_c that of the wavefront, δ_w = λ/(2π·w), and
//! H the Hessian of z. What is added to m² is the square of the beam's divergence as this target shows it. For a flat
//! target it is δ₀² at every distance, since δ₀² = δ_w² + w²/(4·R_c²). A sphere of 0.15 m adds 0.047 rad in place of
//! the 0.0117 rad of the default radar.

use glam::DVec3;

use super::incidence::{Incidence, Sighting};
use crate::frames::{Global, Point, Ray};
use crate::radar::Beam;

/// Rows within this incidence show the lobes of facets, rad: the tilt at which a lobe of m = 0.2 has fallen to 1/e.
const LOBES_RAD: f64 = 0.2;
/// Fewer rows do not stand for a target.
const LEAST_ROWS: usize = 10;

/// What is added to the slopes m² of a lobe under one beam, rad².
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Widening {
    /// On a flat target: δ₀².
    pub flat_rad2: f64,
    /// On the target with its curvature, the mean along both directions; none beside an edge.
    pub curved_rad2: Option<f64>,
    /// Angle of incidence, rad.
    pub theta_rad: f64,
}

/// The same of all rows of a curve.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct CurveWidening {
    /// Root of the mean over the rows on a flat target, rad.
    pub flat_rad: f64,
    /// Root of the median over the rows near normal incidence with the target's curvature, rad; that of a flat target
    /// where no row shows it.
    pub curved_rad: f64,
}

impl Widening {
    /// Under the beam along `axis`, which meets the target at `sighting`.
    pub fn of(
        incidence: &Incidence,
        beams: &Beam,
        axis: &Ray<Global>,
        sighting: &Sighting,
    ) -> Widening {
        let beam = beams.along(axis);
        let section = beam.section(sighting.hit.range_m);
        let flat_rad2 = beam.divergence_rad().powi(2);
        let wave_rad = section.radius_m * section.curvature_per_m;
        let curved_rad2 = bend_rad(incidence, axis, sighting, section.radius_m).map(|bend| {
            // A quarter of the mean over both directions of the squared matrix w·(H + 1/R_c).
            let [[xx, xy], [yx, yy]] = bend;
            let across_rad = 0.5 * (xy + yx);
            let sum = (xx + wave_rad).powi(2) + (yy + wave_rad).powi(2) + 2.0 * across_rad.powi(2);
            section.divergence_rad().powi(2) + 0.125 * sum
        });
        Widening { flat_rad2, curved_rad2, theta_rad: sighting.hit.theta_rad() }
    }
}

impl CurveWidening {
    /// Of all rows of a curve; none without a row.
    pub fn of(rows: &[Widening]) -> Option<CurveWidening> {
        if rows.is_empty() {
            return None;
        }
        let flat_rad2 = rows.iter().map(|row| row.flat_rad2).sum::<f64>() / rows.len() as f64;
        let near: Vec<Widening> =
            rows.iter().copied().filter(|row| row.theta_rad < LOBES_RAD).collect();
        let rows = if near.len() < LEAST_ROWS { rows } else { &near };
        let mut curved: Vec<f64> = rows.iter().filter_map(|row| row.curved_rad2).collect();
        curved.sort_by(f64::total_cmp);
        let curved_rad2 = curved.get(curved.len() / 2).copied().unwrap_or(flat_rad2);
        Some(CurveWidening { flat_rad: flat_rad2.sqrt(), curved_rad: curved_rad2.sqrt() })
    }
}

/// w·H: by how much the slope of the target across a beam changes over the radius w, along and across two directions;
/// `None` where one of four rays misses the region.
fn bend_rad(
    incidence: &Incidence,
    axis: &Ray<Global>,
    sighting: &Sighting,
    radius_m: f64,
) -> Option<[[f64; 2]; 2]> {
    let forward = axis.direction.xyz();
    let (right, up) = forward.any_orthonormal_pair();
    let slopes = |aside_m: DVec3| {
        let place = Point::from(sighting.hit.point.xyz + aside_m);
        let ray = Ray { origin: axis.origin, direction: axis.origin.towards(place)? };
        let normal = incidence.normal_in(&ray, sighting.region)?;
        let towards = -normal.dot(forward);
        (towards > 0.0).then(|| [normal.dot(right) / towards, normal.dot(up) / towards])
    };
    let along = |direction: DVec3| {
        let [more, less] = [slopes(radius_m * direction)?, slopes(-radius_m * direction)?];
        Some([0.5 * (more[0] - less[0]), 0.5 * (more[1] - less[1])])
    };
    Some([along(right)?, along(up)?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Mesh;
    use crate::measure::synthetic::exact;
    use crate::radar::{Chirps, Radar};
    use crate::scene::{Target, solids};

    /// δ₀ = λ/(2π·w₀) and w₀ of the default radar, by hand.
    const DIVERGENCE_RAD: f64 = 0.011704;
    const WAIST_M: f64 = 13.589e-3;

    /// What the rays of the default radar near the middle of the field see of a mesh there, moved away by `z_m`.
    fn widening(mut mesh: Mesh, z_m: f64) -> CurveWidening {
        for vertex in &mut mesh.vertices {
            *vertex += DVec3::new(0.0, 1.1, -z_m);
        }
        let region_of_facet = vec![0; mesh.facets.len()];
        let target = Target { mesh, meshes: vec![], regions: vec![], region_of_facet };
        let radar = Radar::default();
        let chirps = Chirps::draw(&radar, |_| Err("no file".to_owned())).unwrap();
        let (registered, beams) = (exact(), Beam::new(&radar));
        let incidence = Incidence::new(&target, &registered, 0.0);
        let rows = chirps.rays.iter().filter_map(|axis| {
            let sighting = incidence.sight(axis)?;
            let place = sighting.hit.point.xyz;
            let is_near = place.x.hypot(place.y - 1.1) < 0.03;
            is_near.then(|| Widening::of(&incidence, &beams, axis, &sighting))
        });
        CurveWidening::of(&rows.collect::<Vec<_>>()).unwrap()
    }

    /// A sphere whose front is at the origin.
    fn ball(radius_m: f64) -> Mesh {
        let mut mesh = solids::icosphere(radius_m, 6);
        mesh.vertices.iter_mut().for_each(|vertex| vertex.z -= radius_m);
        mesh
    }

    #[test]
    fn a_flat_target_shows_the_divergence_of_the_waist_at_every_distance() {
        for z_m in [-0.5, 0.0, 0.5] {
            let found = widening(solids::plate(0.5, 0.5), z_m);
            for rad in [found.flat_rad, found.curved_rad] {
                assert!((rad / DIVERGENCE_RAD - 1.0).abs() < 2e-3, "{z_m}: {found:?}");
            }
        }
    }

    #[test]
    fn a_sphere_adds_the_spot_over_its_diameter() {
        for (radius_m, z_m) in [(0.15, 0.0), (0.15, -0.4), (0.4, 0.0), (0.4, 0.4)] {
            // δ_w² + (w²/4)·(1/a + 1/R_c)².
            let rayleigh_m = std::f64::consts::PI * WAIST_M * WAIST_M / 0.99931e-3;
            let wide = (1.0f64 + z_m * z_m / (rayleigh_m * rayleigh_m)).sqrt();
            let bend = 1.0 / radius_m + z_m / (z_m * z_m + rayleigh_m * rayleigh_m);
            let expected = (DIVERGENCE_RAD / wide).hypot(0.5 * WAIST_M * wide * bend);
            let found = widening(ball(radius_m), z_m);
            assert!(
                (found.curved_rad / expected - 1.0).abs() < 0.04,
                "{radius_m} {z_m}: {found:?}"
            );
            assert!((found.flat_rad / DIVERGENCE_RAD - 1.0).abs() < 5e-3, "{found:?}");
        }
    }

    #[test]
    fn a_target_that_no_spot_lies_on_counts_as_flat() {
        let found = widening(solids::plate(0.01, 0.01), 0.0);
        assert_eq!(found.curved_rad, found.flat_rad);
        assert_eq!(CurveWidening::of(&[]), None);
    }
}
