//! A smooth half space of permittivity ε = ε′ − jε″: f = R(ψ)·D(h)·G/(4·cos θ_i·cos θ_o).
//!
//! R is Fresnel's reflectance of unpolarised waves at the angle ψ of the mirroring facet (Born & Wolf,
//! *Principles of Optics*, 7th ed., §1.5.2 and §14.2). A perfect mirror is a delta in direction; a
//! radar sees it as wide as its beam, D: Beckmann's law with the beam's divergence δ as m, the tilt at which the echo
//! has fallen to 1/e. Without a radar it is drawn [`VIEWING_RAD`](crate::brdf::VIEWING_RAD) wide. Where `lobe_rad`
//! is stated, as by a fit to a radar's curve, it is that of beam and surface together: m = `lobe_rad`, and no less
//! than δ. What is reflected in all directions is R(θ_i) within 0.002 for lobes up to 0.05 rad, θ_i up to 75°.
//!
//! At 300 GHz: PTFE ε = 2.07 − j0.0011 (R = −14.9 dB at normal incidence), glass 5.8 − j0.3, water
//! 4.67 − j5.00 (−6.2 dB), aluminium −1.9·10⁴ − j2.2·10⁶ (−0.008 dB). A thick piece is meant: an echo
//! from the far side needs `layered`.

use num_complex::Complex;
use serde::{Deserialize, Serialize};

use crate::brdf::backscatter::Term;
use crate::brdf::kind::{Key, Kind};
use crate::brdf::parameter::Visitor;
use crate::brdf::permittivity::{
    EPS_IMAG, EPS_REAL, fresnel_reflectance, half_space_amplitudes, is_narrow, mirror_cosine,
    mirror_lobe, mirror_lobe_per_sr, narrow_mirror, permittivity, visit_lobe, visit_permittivity,
};
use crate::brdf::scattering::{NarrowLobe, Scattering, ScatteringModel, Seen};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "fresnel",
    keys: &[EPS_REAL, EPS_IMAG, Key::number("lobe_rad").optional()],
    starts: &[("fresnel", r#"{"model": "fresnel", "eps_real": 3, "lobe_rad": 0.02}"#)],
};

/// A smooth dielectric or metal.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fresnel {
    /// ε′, relative to vacuum; negative for metals.
    pub eps_real: f64,
    /// ε″ ≥ 0, relative to vacuum: the loss.
    #[serde(default)]
    pub eps_imag: f64,
    /// Width of the mirror's lobe as the radar sees it, 0.001 to 0.5 rad, the beam included; absent for a smooth
    /// mirror, whose lobe is the beam's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lobe_rad: Option<f64>,
}

impl Fresnel {
    /// Share of unpolarised power reflected at an angle from the normal, 0 to 1.
    pub fn reflectance(&self, theta_rad: f64) -> f64 {
        fresnel_reflectance(permittivity(self.eps_real, self.eps_imag), theta_rad.cos())
    }
}

impl Scattering for Fresnel {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let eps = permittivity(self.eps_real, self.eps_imag);
        let reflectance = |cos| fresnel_reflectance(eps, cos);
        Seen::mirror(mirror_lobe_per_sr(i, o, self.lobe_rad, beam_rad, reflectance))
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        let eps = permittivity(self.eps_real, self.eps_imag);
        narrow_mirror(self.lobe_rad, fresnel_reflectance(eps, i.cos_theta()))
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if is_narrow(self.lobe_rad) { Seen::default() } else { self.seen_by(0.0, i, o) }
    }

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        half_space_amplitudes(permittivity(self.eps_real, self.eps_imag), mirror_cosine(i, o))
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        Some(vec![mirror_lobe(self.lobe_rad, self.reflectance(0.0))])
    }
}

impl ScatteringModel for Fresnel {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_permittivity(visitor, prefix, &mut self.eps_real, &mut self.eps_imag);
        visit_lobe(visitor, prefix, &mut self.lobe_rad);
    }

    fn is_smooth(&self) -> bool {
        true
    }

    fn has_smooth_mirror(&self) -> bool {
        self.lobe_rad.is_none()
    }

    fn permittivity(&self) -> Option<[f64; 2]> {
        Some([self.eps_real, self.eps_imag])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::permittivity::{Polarisation, interface, normal_wavenumber};
    use crate::units::db_from_ratio;

    fn smooth(eps_real: f64, eps_imag: f64) -> Fresnel {
        Fresnel { eps_real, eps_imag, lobe_rad: Some(0.02) }
    }

    #[test]
    fn published_permittivities_give_their_reflectance() {
        // Aluminium's index 1035 − j1044 (Hagemann 1975), squared.
        let (n, k) = (1035.0f64, 1044.0f64);
        let aluminium = smooth(n * n - k * k, 2.0 * n * k);
        for (name, model, expected_db, tolerance_db) in [
            ("PTFE", smooth(2.07, 0.0011), -14.9, 0.05),
            ("water", smooth(4.67, 5.0), -6.2, 0.05),
            ("aluminium", aluminium, -0.008, 0.0005),
        ] {
            let found_db = db_from_ratio(model.reflectance(0.0));
            assert!((found_db - expected_db).abs() < tolerance_db, "{name}: {found_db} dB");
        }
    }

    #[test]
    fn nothing_polarised_in_the_plane_returns_at_brewsters_angle() {
        let eps = Complex::from(2.07);
        let cos = 2.07f64.sqrt().atan().cos();
        let inside = (eps, normal_wavenumber(eps, cos));
        let r = interface(Polarisation::P, (Complex::from(1.0), Complex::from(cos)), inside);
        assert!(r.norm() < 1e-15);
        let s_only = ((2.07 - 1.0f64) / (2.07 + 1.0)).powi(2) / 2.0;
        assert!((smooth(2.07, 0.0).reflectance(cos.acos()) - s_only).abs() < 1e-14);
    }

    #[test]
    fn nothing_returns_from_air_and_all_from_a_perfect_metal() {
        for theta_rad in [0.0, 0.5, 1.0, 1.5] {
            assert!(smooth(1.0, 0.0).reflectance(theta_rad) < 1e-28);
            assert!((smooth(-5.0, 0.0).reflectance(theta_rad) - 1.0).abs() < 1e-12);
        }
        assert!(smooth(1.0, 1e9).reflectance(0.5) > 0.9999);
        assert!(smooth(2.07, 0.0).reflectance(std::f64::consts::FRAC_PI_2 - 1e-4) > 0.999);
        assert_eq!(smooth(0.0, 0.0).reflectance(0.0), 1.0);
    }

    #[test]
    fn the_lobe_falls_to_1_over_e_at_its_width() {
        let model = smooth(2.07, 0.0);
        let ratio = model.sigma0(0.02) / model.sigma0(0.0);
        // D·cos⁴ is exp(−tan²/m²); the rest changes by less than a thousandth over 0.02 rad.
        assert!((ratio - (-1f64).exp()).abs() < 1e-3, "{ratio}");
    }
}
