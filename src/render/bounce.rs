//! Second-order paths: where a lit surface sends its power, and who sees it there.
//!
//! The integral over the half space above the first surface is a mean over directions ω drawn from
//! a density p, each weighted by 1/p. No single density suits all surfaces, so p is a mixture: half of it
//! the cosine law, which suits diffuse ones, and a sixth each of three lobes cosᵉ about the mirror's
//! direction, from a broad to a narrow one. Every ω is weighted by the whole mixture (the balance
//! heuristic of Veach and Guibas 1995, DOI 10.1145/218380.218498), so that the mean is unbiased for
//! any surface. A lobe too narrow for that is followed in the mirror's direction alone: what it lacks in width
//! joins the beam's at the second surface.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::spot::GOLDEN;
use crate::frames::{Direction, Global, Ray, Surface};
use crate::lanes::{Wide, exp, ln, widest};
use crate::radar::GaussianBeam;
use crate::radar::random::Key;

/// Exponents of the lobes: half widths at half height of 30°, 9.5° and 3°.
const LOBES: [f64; 3] = [4.8, 50.0, 500.0];

/// How second-order paths are followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounce {
    /// Directions followed from each point that is lit, 1 or more.
    pub rays: usize,
    /// Power by way of a surface outside the spot, over one inside, as a ratio: what the side lobes
    /// of the radar's own beam let through, both senses of the path together.
    pub outside_spot: f64,
    /// Whether the ways radar → A → B → radar and radar → B → A → radar add in phase, which doubles the power of what is
    /// not coherent.
    pub in_phase: bool,
}

impl Bounce {
    /// Factor on the power of a path, of which a share is coherent, that reaches the radar in the polarisation that was sent.
    ///
    /// The way back round the same pair is as long, so that both amplitudes are equal (coherent backscatter; Akkermans,
    /// Wolf and Maynard 1986, DOI 10.1103/PhysRevLett.56.1471). The coherent part is one wave already.
    pub(super) fn enhancement(&self, coherent_share: f64) -> f64 {
        if self.in_phase { 2.0 - coherent_share } else { 1.0 }
    }

    /// How well the radar's antenna sees a second surface at `place`, over how equation (11) sees the spot.
    pub(super) fn pattern(
        &self,
        beam: &GaussianBeam,
        axis: &Ray<Global>,
        rays: usize,
        place: DVec3,
    ) -> f64 {
        beam.pattern(axis, rays, place.into()).max(self.outside_spot)
    }
}

/// Directions above a surface that is lit from `source`, and for each the solid angle, sr, that it
/// stands for in a sum over all.
pub(super) fn directions(
    source: Direction<Surface>,
    count: usize,
    key: Key,
) -> Vec<(Direction<Surface>, f64)> {
    let mirrored = source.mirrored().xyz();
    let mut draws = key.draws();
    let (radial, turn) = (draws.uniform(), draws.uniform());
    let drawn = (0..count).filter_map(|number| {
        let along = (number as f64 * GOLDEN + turn).fract();
        let direction = sample((number as f64 + radial) / count as f64, along, mirrored);
        Direction::new(direction).filter(|local| local.cos_theta() > 0.0)
    });
    let drawn: Vec<Direction<Surface>> = drawn.collect();
    let cosines =
        drawn.iter().map(|direction| [direction.cos_theta(), direction.xyz().dot(mirrored)]);
    let mut weights_sr = vec![0.0; drawn.len()];
    widest(Weights { cosines: &cosines.collect::<Vec<_>>(), count, weights_sr: &mut weights_sr });
    drawn.into_iter().zip(weights_sr).collect()
}

/// The solid angle, sr, that each direction stands for, from its cosines to the normal and to the direction of the mirror.
struct Weights<'a> {
    cosines: &'a [[f64; 2]],
    count: usize,
    weights_sr: &'a mut [f64],
}

impl Wide for Weights<'_> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        for (weight_sr, &cosines) in self.weights_sr.iter_mut().zip(self.cosines) {
            *weight_sr = 1.0 / (density_per_sr(cosines) * self.count as f64);
        }
    }
}

/// A direction from the mixture. `share` from 0 to 1 picks the part and the angle from its axis;
/// `turn`, from 0 to 1, the azimuth.
fn sample(share: f64, turn: f64, mirrored: DVec3) -> DVec3 {
    if share < 0.5 {
        return about(DVec3::Z, (1.0 - 2.0 * share).sqrt(), turn);
    }
    let lobe = (6.0 * (share - 0.5)).min(2.999_999);
    let exponent = LOBES[lobe as usize];
    about(mirrored, (1.0 - lobe.fract()).powf(1.0 / (exponent + 1.0)), turn)
}

/// The direction at an angle from an axis.
fn about(axis: DVec3, cos: f64, turn: f64) -> DVec3 {
    let across = axis.any_orthonormal_vector();
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    let azimuth = TAU * turn;
    let (sin_azimuth, cos_azimuth) = azimuth.sin_cos();
    cos * axis + sin * (cos_azimuth * across + sin_azimuth * axis.cross(across))
}

/// Density of the mixture, from the cosines to the normal, above 0, and to the direction of the mirror.
#[inline(always)]
fn density_per_sr([cos_theta, cos_to_mirror]: [f64; 2]) -> f64 {
    let ln_cos = ln(if cos_to_mirror > 0.0 { cos_to_mirror } else { 0.0 });
    let [a, b, c] = LOBES.map(|exponent| (exponent + 1.0) / TAU * exp(exponent * ln_cos));
    0.5 * cos_theta / PI + (a + b + c) / 6.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Distribution, Lambert, Scattering, Shadowing};
    use crate::frames::Point;
    use crate::radar::random::Purpose;
    use crate::radar::{Beam, Radar};

    fn key(chirp: u64) -> Key {
        Key { seed: 5, chirp, sub_ray: 0, purpose: Purpose::Bounce }
    }

    /// ∫ f·cos θ_o dω_o by the directions, averaged over many chirps.
    fn albedo(surface: &dyn Scattering, theta_rad: f64) -> f64 {
        const CHIRPS: u64 = 200;
        let source = Direction::from_angles(theta_rad, 0.7);
        let of_chirp = |chirp| -> f64 {
            directions(source, 64, key(chirp))
                .into_iter()
                .map(|(o, weight_sr)| surface.f_per_sr(source, o) * o.cos_theta() * weight_sr)
                .sum()
        };
        (0..CHIRPS).map(of_chirp).sum::<f64>() / CHIRPS as f64
    }

    /// ∫ f·cos θ_o dω_o by the midpoint rule.
    fn albedo_by_midpoints(surface: &dyn Scattering, theta_rad: f64) -> f64 {
        const STEPS: usize = 600;
        let source = Direction::from_angles(theta_rad, 0.7);
        let (da, db) = (0.5 * PI / STEPS as f64, TAU / STEPS as f64);
        let at = |i: usize, j: usize| {
            let theta = (i as f64 + 0.5) * da;
            let o = Direction::from_angles(theta, (j as f64 + 0.5) * db);
            surface.f_per_sr(source, o) * theta.cos() * theta.sin() * da * db
        };
        (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| at(i, j))).sum()
    }

    #[test]
    fn the_mean_is_unbiased_for_dull_and_for_shiny_surfaces() {
        let shiny = |m| CookTorrance {
            f_lambda: 0.9,
            m,
            m_across: None,
            distribution: Distribution::Beckmann,
            shadowing: Shadowing::Separable,
        };
        let surfaces: [(&dyn Scattering, f64); 4] = [
            (&Lambert { albedo: 0.6 }, 0.01),
            (&shiny(0.4), 0.02),
            (&shiny(0.1), 0.02),
            (&shiny(0.03), 0.05),
        ];
        for (number, (surface, tolerance)) in surfaces.into_iter().enumerate() {
            for theta_rad in [0.0, 0.6, 1.2] {
                let (found, expected) =
                    (albedo(surface, theta_rad), albedo_by_midpoints(surface, theta_rad));
                let error = (found / expected - 1.0).abs();
                assert!(error < tolerance, "{number} at {theta_rad}: {found} is not {expected}");
            }
        }
    }

    #[test]
    fn the_beam_receives_as_it_sends() {
        let radar = Radar::default();
        let origin = radar.frames().origin();
        let axis = Ray { origin, direction: origin.towards(Point::new(0.0, 1.1, 0.0)).unwrap() };
        let beam = Beam::new(&radar).along(&axis);
        let bounce = Bounce { rays: 1, outside_spot: 1e-3, in_phase: false };
        let seen = |rays, x_m: f64, z_m: f64| {
            bounce.pattern(&beam, &axis, rays, DVec3::new(x_m, 1.1, z_m))
        };
        // Half the spot's diameter off the axis the Gaussian is ½, and 2·½ = 1.
        assert!((seen(64, 0.008, 0.0) - 1.0).abs() < 1e-4);
        assert!((seen(64, 0.0, 0.0) - 2.0).abs() < 1e-12 && seen(1, 0.0, 0.0) == 1.0);
        assert!((seen(1, 0.008, 0.0) - 0.5f64.sqrt()).abs() < 1e-4);
        // Far off, and behind the radar.
        assert_eq!([seen(64, 0.1, 0.0), seen(64, 0.0, 9.0)], [1e-3, 1e-3]);
        // The mean of 2g over the spot's own Gaussian is 1: rings of equal power.
        let ring = |i: usize| 0.008 * (-(1.0 - (i as f64 + 0.5) / 1e4).log2()).sqrt();
        let mean = (0..10_000).map(|i| seen(64, ring(i), 0.0)).sum::<f64>() / 1e4;
        assert!((mean - 1.0).abs() < 2e-3, "{mean}");
    }

    #[test]
    fn directions_leave_the_surface_and_repeat_themselves() {
        let source = Direction::from_angles(1.4, 0.0);
        let these = directions(source, 32, key(1));
        assert!(these.len() > 16 && these.iter().all(|(o, _)| o.cos_theta() > 0.0));
        let again = directions(source, 32, key(1));
        assert_eq!(these, again);
        assert_ne!(these, directions(source, 32, key(2)));
    }
}
