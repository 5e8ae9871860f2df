//! Equation (13), Cook–Torrance with the constant of Walter et al. (EGSR 2007):
//! f_s = F·D·G / (4·|n·i|·|n·o|).
//!
//! F is Schlick's approximation, equation (14); D and G1 are Walter's for Beckmann and GGX. f_λ is
//! the reflectivity at normal incidence (0.998 for aluminium, 0.16 for skin, 0.03 for PTFE near
//! 300 GHz) and m the roughness: 0.01 is a mirror, 0.1 a lobe whose backscatter falls to half at 5°
//! from the normal. Single scattering loses energy on rough surfaces: at normal incidence more than a
//! tenth from m = 0.6 with Beckmann and from m = 0.3 with GGX.
//!
//! Brushed, machined or woven surfaces are rougher across their grain: with `m_across` the slopes along
//! x (the direction field of the surface) follow m and those along y follow m_across. tan²θ/m² becomes
//! tan²θ·(cos²φ/m² + sin²φ/m_across²), m² in front of D becomes m·m_across, and G1 takes the roughness
//! in the azimuth of its direction, m²cos²φ + m_across²sin²φ (Heitz, JCGT 3-2 (2014) 48, §5.3–5.4).

use serde::{Deserialize, Serialize};

use crate::brdf::backscatter::{Facets, Term};
use crate::brdf::kind::{Key, Kind};
use crate::brdf::lobe::Lobe;
use crate::brdf::parameter::{Visitor, visit_number};
use crate::brdf::scattering::{
    NARROW_M, NarrowLobe, Scattering, ScatteringModel, Seen, half_vector,
};
use crate::brdf::slopes::{Distribution, SlopeMatrix};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "cook-torrance",
    keys: &[
        Key::number("f_lambda"),
        Key::number("m"),
        Key::number("m_across").optional(),
        Key::new("distribution", r#"{"enum": ["beckmann", "ggx"]}"#),
        Key::new("shadowing", r#"{"enum": ["separable", "correlated"]}"#),
    ],
    starts: &[
        ("cook-torrance", r#"{"model": "cook-torrance", "f_lambda": 0.05, "m": 0.1}"#),
        (
            "cook-torrance-ggx",
            r#"{"model": "cook-torrance", "distribution": "ggx", "f_lambda": 0.05, "m": 0.1}"#,
        ),
    ],
};

/// The paper's specular term.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CookTorrance {
    /// Reflectivity at normal incidence f_λ, 0 to 1.
    pub f_lambda: f64,
    /// Roughness m, 0.001 to 2; for Beckmann √2 times the rms slope along one direction.
    pub m: f64,
    /// Roughness along y, 0.001 to 2, where m holds only along x; isotropic when absent.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub m_across: Option<f64>,
    /// Law of the facet slopes.
    #[serde(default)]
    pub distribution: Distribution,
    /// How shadowing and masking combine.
    #[serde(default)]
    pub shadowing: Shadowing,
}

/// How the shadowing of i and the masking of o combine into G(i, o).
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Shadowing {
    /// The paper's: G = G1(i)·G1(o), as if the two were independent.
    #[default]
    Separable,
    /// Directions that see the same facets shadow them together: in exact backscatter G = G1 once.
    Correlated,
}

impl CookTorrance {
    /// Roughness along x and along y.
    fn axes(&self) -> [f64; 2] {
        [self.m, self.m_across.unwrap_or(self.m)]
    }

    fn is_narrow(&self) -> bool {
        self.axes().into_iter().all(|m| m <= NARROW_M)
    }

    /// G1 of one direction, with the roughness in its azimuth.
    fn g1(&self, direction: Direction<Surface>) -> f64 {
        let m = self.m_across.map_or(self.m, |m_across| m_along(direction, [self.m, m_across]));
        self.distribution.g1(direction.cos_theta(), m)
    }

    /// Equation (14), Schlick: F = f_λ + (1 − f_λ)(1 − |o·h|)⁵.
    fn fresnel(&self, o_h: f64) -> f64 {
        self.f_lambda + (1.0 - self.f_lambda) * (1.0 - o_h.abs()).powi(5)
    }

    /// G(i, o); the correlated form interpolates with van Ginneken et al., Appl. Opt. 37 (1998) 130.
    fn shadowing(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        let (g1_i, g1_o) = (self.g1(i), self.g1(o));
        match self.shadowing {
            Shadowing::Separable => g1_i * g1_o,
            Shadowing::Correlated => {
                let apart = 4.41 * azimuth_between_rad(i, o);
                let independent = apart / (apart + 1.0);
                independent * g1_i * g1_o + (1.0 - independent) * g1_i.min(g1_o)
            }
        }
    }
}

impl Scattering for CookTorrance {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let h = half_vector(i, o);
        let beam = SlopeMatrix::of_beam(beam_rad, i, o);
        let d = self.distribution.d_seen_per_sr(h, self.axes(), beam);
        let f = self.fresnel(o.xyz().dot(h.xyz()));
        let f_per_sr = f * d * self.shadowing(i, o) / (4.0 * i.cos_theta() * o.cos_theta());
        Seen::facets(f_per_sr, beam_rad, self.axes())
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        if !self.is_narrow() {
            return Vec::new();
        }
        let share = self.fresnel(i.cos_theta()) * self.shadowing(i, i.mirrored());
        let [m, m_across] = self.axes();
        vec![NarrowLobe { share, m: (m * m_across).sqrt() }]
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if self.is_narrow() { Seen::default() } else { self.seen_by(0.0, i, o) }
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        let shadowed = match self.shadowing {
            Shadowing::Separable => 2,
            Shadowing::Correlated => 1,
        };
        let (m, distribution) = (self.m, self.distribution);
        let facets = Facets { m, distribution, shadowed, includes_beam: false };
        self.m_across.is_none().then(|| vec![Term::mirrors(self.f_lambda, facets)])
    }

    /// Without a grain, and with separable shadowing.
    fn lobes(&self) -> Option<Vec<Lobe>> {
        let CookTorrance { f_lambda, m, m_across, distribution, shadowing } = *self;
        let has_lobe = m_across.is_none() && shadowing == Shadowing::Separable;
        has_lobe.then(|| vec![Lobe::Facets { weight: 1.0, f_lambda, m, distribution }])
    }
}

impl ScatteringModel for CookTorrance {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "f_lambda", (0.0, 1.0), &mut self.f_lambda);
        visit_number(visitor, prefix, "m", (0.001, 2.0), &mut self.m);
        if let Some(m_across) = &mut self.m_across {
            visit_number(visitor, prefix, "m_across", (0.001, 2.0), m_across);
        }
    }

    fn lobe_rad(&self, beam_rad: f64) -> Option<f64> {
        Some(self.m.min(self.m_across.unwrap_or(self.m)).hypot(beam_rad))
    }

    fn f_lambda(&self) -> Option<f64> {
        Some(self.f_lambda)
    }
}

/// Roughness in the azimuth of a direction: m_x² cos²φ + m_y² sin²φ, rooted.
fn m_along(direction: Direction<Surface>, [m_x, m_y]: [f64; 2]) -> f64 {
    let across = direction.xyz().truncate();
    match across.try_normalize() {
        Some(unit) => (m_x * unit.x).hypot(m_y * unit.y),
        None => m_x,
    }
}

/// Angle between the projections of two directions onto the surface, rad; 0 when either is normal.
fn azimuth_between_rad(i: Direction<Surface>, o: Direction<Surface>) -> f64 {
    let (a, b) = (i.xyz().truncate(), o.xyz().truncate());
    a.perp_dot(b).abs().atan2(a.dot(b))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn paint(distribution: Distribution, shadowing: Shadowing) -> CookTorrance {
        CookTorrance { f_lambda: 0.2, m: 0.1, m_across: None, distribution, shadowing }
    }

    /// ∫ D cos θ dω over the hemisphere by the midpoint rule in θ.
    fn projected_area(distribution: Distribution, m: f64) -> f64 {
        let steps = 200_000;
        let width = std::f64::consts::FRAC_PI_2 / f64::from(steps);
        let term = |step: i32| {
            let theta = (f64::from(step) + 0.5) * width;
            distribution.d_per_sr(theta.cos(), m) * theta.cos() * 2.0 * PI * theta.sin() * width
        };
        (0..steps).map(term).sum()
    }

    #[test]
    fn the_slope_laws_are_normalised() {
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for m in [0.02, 0.1, 0.5, 1.0] {
                let area = projected_area(distribution, m);
                assert!((area - 1.0).abs() < 1e-6, "{distribution:?} m = {m}: {area}");
            }
        }
    }

    #[test]
    fn the_peak_is_the_closed_form() {
        // At normal incidence F = f_λ, G = 1, D = 1/(π m²): f = f_λ/(4π m²).
        let expected = 0.2 / (4.0 * PI * 0.01);
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            let f = paint(distribution, Shadowing::Separable).retro_per_sr(0.0);
            assert!((f - expected).abs() < 1e-12 * expected);
        }
    }

    #[test]
    fn correlated_shadowing_counts_backscatter_once() {
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            let theta_rad = 75f64.to_radians();
            let rough = |shadowing| CookTorrance { m: 0.5, ..paint(distribution, shadowing) };
            let once = rough(Shadowing::Correlated).retro_per_sr(theta_rad);
            let twice = rough(Shadowing::Separable).retro_per_sr(theta_rad);
            let g1 = distribution.g1(theta_rad.cos(), 0.5);
            assert!(g1 < 0.999);
            assert!((twice / once - g1).abs() < 1e-9);
        }
    }

    #[test]
    fn a_smoother_surface_is_narrower_and_higher() {
        let smooth =
            CookTorrance { m: 0.05, ..paint(Distribution::Beckmann, Shadowing::Separable) };
        let rough = paint(Distribution::Beckmann, Shadowing::Separable);
        assert!(smooth.retro_per_sr(0.0) > rough.retro_per_sr(0.0));
        assert!(smooth.retro_per_sr(0.3) < rough.retro_per_sr(0.3));
    }

    /// ∫ g dω over the hemisphere by the midpoint rule.
    fn over_hemisphere(g: impl Fn(Direction<Surface>) -> f64) -> f64 {
        let (thetas, azimuths) = (2000, 200);
        let (d_theta, d_azimuth) = (PI / 2.0 / f64::from(thetas), 2.0 * PI / f64::from(azimuths));
        let ring = |t: i32| {
            let theta = (f64::from(t) + 0.5) * d_theta;
            let at = |a: i32| g(Direction::from_angles(theta, (f64::from(a) + 0.5) * d_azimuth));
            (0..azimuths).map(at).sum::<f64>() * theta.sin()
        };
        (0..thetas).map(ring).sum::<f64>() * d_theta * d_azimuth
    }

    #[test]
    fn the_slope_laws_with_a_grain_are_normalised_and_smiths_g1_fits_them() {
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            for m in [[0.1, 0.1], [0.1, 0.4], [0.6, 0.2]] {
                let d = |h| distribution.d_anisotropic_per_sr(h, m);
                let area = over_hemisphere(|h| d(h) * h.cos_theta());
                assert!((area - 1.0).abs() < 1e-4, "{distribution:?} {m:?}: {area}");
                // What a direction sees of the facets is the surface's own projection.
                let o = Direction::from_angles(1.1, 0.6);
                let seen = |h: Direction<Surface>| d(h) * o.xyz().dot(h.xyz()).max(0.0);
                let g1 = o.cos_theta() / over_hemisphere(seen);
                let found = distribution.g1(o.cos_theta(), m_along(o, m));
                assert!((found / g1 - 1.0).abs() < 4e-3, "{distribution:?} {m:?}: {found} {g1}");
            }
        }
    }

    #[test]
    fn an_equal_roughness_across_changes_nothing_and_a_turn_swaps_the_two() {
        for distribution in [Distribution::Beckmann, Distribution::Ggx] {
            let isotropic = paint(distribution, Shadowing::Separable);
            let with = |m, m_across| CookTorrance { m, m_across: Some(m_across), ..isotropic };
            let quarter = PI / 2.0;
            for (ti, to, azimuth) in [(0.0, 0.0, 0.0), (0.2, 0.3, 1.0), (0.9, 0.8, 3.0)] {
                let f = |model: &CookTorrance, turn: f64| {
                    let i = Direction::from_angles(ti, turn);
                    model.f_per_sr(i, Direction::from_angles(to, azimuth + turn))
                };
                let expected = f(&isotropic, 0.4);
                assert!((f(&with(0.1, 0.1), 0.4) - expected).abs() <= 1e-9 * expected);
                let along = f(&with(0.1, 0.3), 0.4);
                assert!((f(&with(0.3, 0.1), 0.4 + quarter) - along).abs() <= 1e-9 * along);
            }
            let wide = Direction::from_angles(0.3, quarter);
            let narrow = Direction::from_angles(0.3, 0.0);
            let model = with(0.1, 0.3);
            assert!(model.f_per_sr(wide, wide) > 10.0 * model.f_per_sr(narrow, narrow));
        }
    }
}
