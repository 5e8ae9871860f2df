//! Geometric optics of a rough surface, the limit of `kirchhoff` for k·s ≫ 1:
//! σ⁰ = R(ψ)·(q/q_z)⁴/(2·slope²) · exp(−q_t²/(2·slope²·q_z²)), f = σ⁰/(4π·cos θ_i·cos θ_o).
//!
//! q = k(i + o); R is Fresnel's unpolarised reflectance at the angle ψ of the mirroring facet. It is
//! `cook-torrance` with Beckmann's law, m = √2·slope, R in place of Schlick's F, and no shadowing
//! (Ulaby & Long, *Microwave Radar and Radiometric Remote Sensing* (2014), ch. 10; Beckmann &
//! Spizzichino 1963, ch. 5). The rms slope runs from 0.01 (polished) to 0.5 (grit); with Gaussian
//! correlation it is √2·s/l. The frequency enters only by ε. Without shadowing a metal
//! reflects 0.91 to 1 of what it receives up to 60° (slopes to 0.4), but 1.18 at 75° and slope 0.4.
//! The limit is that of a large rms height s, (2k·s·cos θ)² ≥ 10 (`conditions`).

use std::f64::consts::{SQRT_2, TAU};

use num_complex::Complex;
use serde::{Deserialize, Serialize};

use crate::brdf::backscatter::{Facets, Term};
use crate::brdf::kind::{Key, Kind};
use crate::brdf::parameter::{Visitor, visit_number};
use crate::brdf::permittivity::{
    EPS_IMAG, EPS_REAL, fresnel_reflectance, half_space_amplitudes, mirror_cosine, permittivity,
    visit_permittivity,
};
use crate::brdf::scattering::{
    NARROW_M, NarrowLobe, Scattering, ScatteringModel, Seen, half_vector,
};
use crate::brdf::slopes::{Distribution, SlopeMatrix};
use crate::brdf::validity::{Bound, Condition, ULABY, kirchhoff_conditions};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "kirchhoff-go",
    keys: &[Key::number("rms_slope"), EPS_REAL, EPS_IMAG],
    starts: &[("kirchhoff-go", r#"{"model": "kirchhoff-go", "rms_slope": 0.2, "eps_real": 3}"#)],
};

/// Facets with Gaussian slopes, each a mirror.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KirchhoffGo {
    /// Standard deviation of the slope along one direction, 0.001 to 1.
    pub rms_slope: f64,
    /// ε′, relative to vacuum; negative for metals.
    pub eps_real: f64,
    /// ε″ ≥ 0: the loss.
    #[serde(default)]
    pub eps_imag: f64,
}

impl KirchhoffGo {
    fn m(&self) -> f64 {
        std::f64::consts::SQRT_2 * self.rms_slope
    }
}

impl Scattering for KirchhoffGo {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let m = self.m();
        let law = Distribution::Beckmann;
        let beam = SlopeMatrix::of_beam(beam_rad, i, o);
        let d_per_sr = law.d_seen_per_sr(half_vector(i, o), [m, m], beam);
        let eps = permittivity(self.eps_real, self.eps_imag);
        let reflectance = fresnel_reflectance(eps, mirror_cosine(i, o));
        let f_per_sr = reflectance * d_per_sr / (4.0 * i.cos_theta() * o.cos_theta());
        Seen::facets(f_per_sr, beam_rad, [m, m])
    }

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        half_space_amplitudes(permittivity(self.eps_real, self.eps_imag), mirror_cosine(i, o))
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        let m = self.m();
        if m > NARROW_M {
            return Vec::new();
        }
        let eps = permittivity(self.eps_real, self.eps_imag);
        vec![NarrowLobe { share: fresnel_reflectance(eps, i.cos_theta()), m }]
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if self.m() <= NARROW_M { Seen::default() } else { self.seen_by(0.0, i, o) }
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        let m = self.m();
        let distribution = Distribution::Beckmann;
        let facets = Facets { m, distribution, shadowed: 0, includes_beam: false };
        let eps = permittivity(self.eps_real, self.eps_imag);
        Some(vec![Term::mirrors(fresnel_reflectance(eps, 1.0), facets)])
    }
}

impl ScatteringModel for KirchhoffGo {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "rms_slope", (0.001, 1.0), &mut self.rms_slope);
        visit_permittivity(visitor, prefix, &mut self.eps_real, &mut self.eps_imag);
    }

    fn permittivity(&self) -> Option<[f64; 2]> {
        Some([self.eps_real, self.eps_imag])
    }

    /// Those of the rays' limit at normal incidence, where they are easiest met, for a surface of a known height
    /// with Gaussian correlation: l is √2·s over the slope.
    fn conditions(&self, wavelength_m: f64, rms_height_m: Option<f64>) -> Vec<Condition> {
        let Some(s_m) = rms_height_m else { return Vec::new() };
        let l_m = SQRT_2 * s_m / self.rms_slope;
        let phase_rad = 2.0 * TAU / wavelength_m * s_m;
        let mut conditions = vec![Condition {
            model: KIND.name,
            quantity: "(2·k·s)²",
            unit: "1",
            value: phase_rad * phase_rad,
            bound: Bound::AtLeast,
            limit: 10.0,
            source: ULABY,
        }];
        // A smooth surface breaks the one above, and has no curvature.
        if s_m > 0.0 {
            conditions.extend(kirchhoff_conditions(KIND.name, wavelength_m, s_m, l_m));
        }
        conditions
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{CookTorrance, Shadowing};

    #[test]
    fn the_limit_of_rays_wants_a_height_beyond_the_wavelength() {
        let model = KirchhoffGo { rms_slope: 0.2, eps_real: 3.0, eps_imag: 0.0 };
        assert!(model.conditions(1e-3, None).is_empty());
        // 2·k·s is 1.26 and 3.77 rad; l²/(s·λ) = 2·s/(slope²·λ) is 5 and 15; k·l = 4.4 and 13.3.
        for (s_m, is_met) in [(0.1e-3, [false, false, true]), (0.3e-3, [true, true, true])] {
            let found = model.conditions(1e-3, Some(s_m));
            assert_eq!([0, 1, 2].map(|number| found[number].is_met()), is_met, "{found:?}");
        }
        let smooth = model.conditions(1e-3, Some(0.0));
        assert!(smooth.len() == 1 && !smooth[0].is_met());
    }

    #[test]
    fn it_is_the_formula_and_cook_torrance_without_shadowing() {
        let model = KirchhoffGo { rms_slope: 0.2, eps_real: 1.0, eps_imag: 1e9 };
        let m = 0.2 * 2f64.sqrt();
        let shadowing = Shadowing::Separable;
        let distribution = Distribution::Beckmann;
        let facets = CookTorrance { f_lambda: 1.0, m, distribution, shadowing, m_across: None };
        for theta_rad in [0.0f64, 0.2, 0.5, 0.8] {
            // All of it is reflected, within 1e-4: what is left of R.
            let (cos, tan) = (theta_rad.cos(), theta_rad.tan());
            let sigma0 = (-tan * tan / 0.08).exp() / (0.08 * cos.powi(4));
            assert!((model.sigma0(theta_rad) / sigma0 - 1.0).abs() < 1e-4);
            let shadow = distribution.g1(cos, m).powi(2);
            let unshadowed = facets.retro_per_sr(theta_rad) / shadow;
            assert!((model.retro_per_sr(theta_rad) / unshadowed - 1.0).abs() < 1e-4);
        }
    }
}
