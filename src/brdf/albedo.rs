//! What a law reflects in all: its directional albedo a(i) = ∫ f(i, o)·cos θ_o dω_o, which no surface has above 1.
//!
//! The integral runs over the half vector h, dω_o = 4·(i·h)·dω_h: lobes about the mirror direction then lie about the
//! normal. Nodes are even in the azimuth of h, and in the logarithm of its angle from the normal, so that a lobe of
//! m = 0.001 has as many as a broad one.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::LazyLock;

use rayon::prelude::*;

use super::bistatic::{Bistatic, Pair};
use super::models::Brdf;
use super::scattering::Scattering;
use crate::frames::{Direction, Surface};

/// Nodes in the angle of h, and in the half turn of its azimuth: every law is even about a plane of incidence along
/// its grain.
const NODES: (i32, i32) = (64, 24);
/// ln of the range of angles that the nodes spread over.
const GAMMA: f64 = 12.0;
/// Step between the angles of incidence that are tried, rad, and the largest of them: beyond, no model holds.
const STEP_RAD: f64 = PI / 9.0;
const LARGEST_RAD: f64 = 4.0 * STEP_RAD;
/// What the quadrature and the approximations of shadowing may add to an albedo.
pub const ALBEDO_SLACK: f64 = 0.01;

/// A law that reflects more than it receives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Excess {
    /// The incidence at which it reflects most, rad.
    pub theta_rad: f64,
    /// What it reflects there in all, over what it receives: above 1.
    pub albedo: f64,
}

impl Excess {
    /// The largest excess of a law between two angles of incidence, rad; none where it reflects at most what it
    /// receives. A grain lies in the plane of incidence.
    pub fn of(law: &Brdf, range_rad: [f64; 2]) -> Option<Excess> {
        if most(law) <= 1.0 {
            return None;
        }
        let angles = incidences_rad(range_rad);
        let albedos: Vec<f64> =
            angles.par_iter().map(|theta_rad| albedo(law, *theta_rad)).collect();
        let found =
            std::iter::zip(angles, albedos).filter(|(_, albedo)| *albedo > 1.0 + ALBEDO_SLACK);
        let largest = found.max_by(|a, b| a.1.total_cmp(&b.1));
        largest.map(|(theta_rad, albedo)| Excess { theta_rad, albedo })
    }

    /// The excess as the end of a sentence about a law.
    pub fn words(&self) -> String {
        format!(
            "reflects {:.0} % of what it receives at an incidence of {:.0}°, {:.0} % too much",
            100.0 * self.albedo,
            self.theta_rad.to_degrees(),
            100.0 * (self.albedo - 1.0)
        )
    }
}

/// The incidences between two angles, rad, at which energy is checked: both ends and every 20° between, up to 80°.
pub fn incidences_rad([low_rad, high_rad]: [f64; 2]) -> Vec<f64> {
    let high_rad = high_rad.min(LARGEST_RAD);
    let mut angles: Vec<f64> = (0..4).map(|step| f64::from(step) * STEP_RAD).collect();
    angles.retain(|theta_rad| *theta_rad > low_rad && *theta_rad < high_rad);
    angles.extend([low_rad.min(high_rad), high_rad]);
    angles
}

/// What a law reflects at an incidence, rad, in all directions, over what it receives.
pub fn albedo(law: &dyn Scattering, theta_rad: f64) -> f64 {
    let i = Direction::from_angles(theta_rad, 0.0);
    let (mut pairs, mut weights) = (Vec::new(), Vec::new());
    for (h, solid_angle_sr) in &*HALF_VECTORS {
        let i_h = i.xyz().dot(h.xyz());
        let Some(o) = Direction::new(2.0 * i_h * h.xyz() - i.xyz()) else { continue };
        if i_h > 0.0 && o.cos_theta() > 0.0 {
            pairs.push(Pair { beam_rad: 0.0, i, o });
            weights.push(4.0 * i_h * solid_angle_sr * o.cos_theta());
        }
    }
    let seen = Bistatic::new(law).seen(&pairs);
    2.0 * seen.iter().zip(weights).map(|(seen, weight)| seen.f_per_sr * weight).sum::<f64>()
}

/// The nodes of the integral, half vectors and their solid angles, sr.
static HALF_VECTORS: LazyLock<Vec<(Direction<Surface>, f64)>> = LazyLock::new(|| {
    let mut nodes = Vec::new();
    for node in 0..NODES.0 {
        let x = (f64::from(node) + 0.5) / f64::from(NODES.0);
        let stretch = FRAC_PI_2 / GAMMA.exp_m1();
        let theta_rad = stretch * (GAMMA * x).exp_m1();
        let d_theta = stretch * GAMMA * (GAMMA * x).exp() / f64::from(NODES.0);
        let d_azimuth = PI / f64::from(NODES.1);
        nodes.extend((0..NODES.1).map(|turn| {
            let h = Direction::from_angles(theta_rad, (f64::from(turn) + 0.5) * d_azimuth);
            (h, theta_rad.sin() * d_theta * d_azimuth)
        }));
    }
    nodes
});

/// The most that a law can reflect, by its parameters alone; infinite where they do not say it.
fn most(law: &Brdf) -> f64 {
    law.sum_over_parts(&|part| match part {
        Brdf::Lambert(lambert) => lambert.albedo,
        Brdf::Directive(directive) => directive.s * directive.s,
        _ => f64::INFINITY,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{
        BlinnPhong, CookTorrance, Distribution, Fresnel, KirchhoffGo, Lambert, Shadowing,
    };

    /// Of the quadrature at a broad law, whose horizon cuts the nodes.
    const BROAD: f64 = 5e-3;

    const QUARTER_RAD: [f64; 2] = [0.0, FRAC_PI_2];

    #[test]
    fn lambert_reflects_its_albedo() {
        for theta_rad in [0.0, 0.5, 1.0, LARGEST_RAD] {
            let found = albedo(&Lambert { albedo: 0.7 }, theta_rad);
            assert!((found - 0.7).abs() < BROAD, "{theta_rad}: {found}");
        }
    }

    #[test]
    fn blinn_phong_has_its_closed_form_at_normal_incidence() {
        // 4·r_s·(α + 2^(−α/2))/(α + 4), from ∫ cosᵅ(θ/2)·cos θ dω.
        for alpha in [0.0, 1.0, 3.0, 10.0, 100.0, 1000.0] {
            let expected = 4.0 * (alpha + 2f64.powf(-0.5 * alpha)) / (alpha + 4.0);
            let found = albedo(&BlinnPhong { r_s: 1.0, alpha }, 0.0);
            assert!((found / expected - 1.0).abs() < BROAD, "{alpha}: {found} {expected}");
        }
    }

    #[test]
    fn blinn_phong_is_named_above_its_bound_and_not_below() {
        for alpha in [2.0, 10.0, 100.0] {
            let bound = (alpha + 4.0) / (4.0 * (alpha + 2f64.powf(-0.5 * alpha)));
            let at = |r_s| Excess::of(&Brdf::BlinnPhong(BlinnPhong { r_s, alpha }), QUARTER_RAD);
            assert_eq!(at(0.99 * bound), None, "{alpha}");
            let excess = at(1.1 * bound).unwrap();
            assert_eq!(excess.theta_rad, 0.0, "it reflects most at normal incidence");
            assert!((excess.albedo - 1.1).abs() < 2.0 * BROAD, "{alpha}: {excess:?}");
        }
        let paint = BlinnPhong { r_s: 0.9, alpha: 10.0 };
        let said = Excess::of(&Brdf::BlinnPhong(paint), QUARTER_RAD).unwrap().words();
        assert_eq!(
            said,
            "reflects 258 % of what it receives at an incidence of 0°, 158 % too much"
        );
    }

    #[test]
    fn a_lobe_of_any_width_reflects_its_reflectance() {
        let metal = |lobe_rad| Fresnel { eps_real: 1.0, eps_imag: 1e9, lobe_rad: Some(lobe_rad) };
        for lobe_rad in [0.001, 0.01, 0.05] {
            for theta_rad in [0.0, 0.5, 1.0, 1.3] {
                let found = albedo(&metal(lobe_rad), theta_rad);
                assert!((found - 1.0).abs() < 5e-3, "{lobe_rad} {theta_rad}: {found}");
            }
            assert_eq!(Excess::of(&Brdf::Fresnel(metal(lobe_rad)), [0.0, 1.3]), None);
        }
    }

    #[test]
    fn facets_without_shadowing_are_named_at_grazing_incidence_and_with_it_they_are_not() {
        let metal = KirchhoffGo { rms_slope: 0.4, eps_real: 1.0, eps_imag: 1e9 };
        // The documented 1.18 at 75°.
        assert!((albedo(&metal, 75f64.to_radians()) - 1.18).abs() < 0.01);
        let metal = Brdf::KirchhoffGo(metal);
        assert_eq!(Excess::of(&metal, [0.0, 1.0]), None);
        let excess = Excess::of(&metal, QUARTER_RAD).unwrap();
        assert_eq!(excess.theta_rad, LARGEST_RAD);
        for m in [0.001, 0.1, 0.6] {
            let shadowing = Shadowing::Separable;
            let distribution = Distribution::Beckmann;
            let law = CookTorrance { f_lambda: 1.0, m, m_across: None, distribution, shadowing };
            assert_eq!(Excess::of(&Brdf::CookTorrance(law), QUARTER_RAD), None, "{m}");
        }
    }
}
