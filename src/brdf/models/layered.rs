//! Smooth homogeneous layers on a half space: f = R(ψ)·D(h)·G/(4·cos θ_i·cos θ_o), as in `fresnel`.
//!
//! With p = √(ε − sin²θ) in each medium and δ = k₀·p·d in each layer, the reflected amplitude r above
//! a boundary follows from that below it: r ← (ρ + r·e^{−2jδ})/(1 + ρ·r·e^{−2jδ}), ρ being Fresnel's
//! amplitude of the boundary, from the substrate up, for both polarisations. It is what the
//! characteristic matrix gives (Born & Wolf, *Principles of Optics*, 7th ed., §1.6; Macleod,
//! *Thin-Film Optical Filters*, ch. 2), but holds for thick lossy layers too, where the matrix overflows.
//!
//! Paint is 20–200 µm of ε = 2.5 to 4 with ε″ = 0.05 to 0.3, cloth 0.2–2 mm of ε = 1.2 to 2; a quarter
//! wave at 300 GHz is 250 µm/√ε. Layers are taken as endless, even within the wavelength, and coherent:
//! true cloth is uneven, which smooths the ripples that this model shows, and a chirp of 27 GHz
//! averages them where a layer is thicker than some millimetres.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use crate::brdf::backscatter::Term;
use crate::brdf::kind::{Key, Kind};
use crate::brdf::parameter::{Visitor, visit_quantity};
use crate::brdf::permittivity::{
    BOTH, EPS_IMAG, EPS_REAL, Polarisation, default_frequency_hz, interface, is_narrow,
    mirror_cosine, mirror_lobe, mirror_lobe_per_sr, narrow_mirror, normal_wavenumber, permittivity,
    unpolarised, visit_lobe, visit_permittivity, wavenumber_rad_per_m,
};
use crate::brdf::scattering::{NarrowLobe, Scattering, ScatteringModel, Seen};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "layered",
    keys: &[
        Key::new("layers", LAYERS_SCHEMA),
        EPS_REAL,
        EPS_IMAG,
        Key::number("frequency_hz"),
        Key::number("lobe_rad").optional(),
    ],
    starts: &[],
};

const LAYERS_SCHEMA: &str = r#"{
  "type": "array",
  "items": {
    "type": "object",
    "additionalProperties": false,
    "required": ["thickness_m", "eps_real", "eps_imag"],
    "properties": {
      "thickness_m": {"type": "number"},
      "eps_real": {"type": "number", "description": "relative permittivity, real part"},
      "eps_imag": {"type": "number", "description": "imaginary part, 0 or more, for exp(+jwt)"}
    }
  }
}"#;

/// Layers on a substrate.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layered {
    /// The layers, the outermost first; none is the bare substrate.
    pub layers: Vec<Layer>,
    /// ε′ of the substrate, relative to vacuum.
    pub eps_real: f64,
    /// ε″ ≥ 0 of the substrate.
    #[serde(default)]
    pub eps_imag: f64,
    /// Frequency, 10 GHz to 10 THz.
    #[serde(default = "default_frequency_hz")]
    pub frequency_hz: f64,
    /// Width of the mirror's lobe as the radar sees it, 0.001 to 0.5 rad, the beam included; absent for a smooth
    /// mirror, whose lobe is the beam's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lobe_rad: Option<f64>,
}

/// One homogeneous layer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Layer {
    /// Thickness, 0 to 0.1 m.
    pub thickness_m: f64,
    /// ε′, relative to vacuum.
    pub eps_real: f64,
    /// ε″ ≥ 0.
    #[serde(default)]
    pub eps_imag: f64,
}

const FREQUENCY_RANGE_HZ: (f64, f64) = (1e10, 1e13);
const THICKNESS_RANGE_M: (f64, f64) = (0.0, 0.1);

impl Layered {
    /// Share of unpolarised power reflected at an angle from the normal, 0 to 1.
    pub fn reflectance(&self, theta_rad: f64) -> f64 {
        self.reflectance_at(theta_rad.cos())
    }

    fn reflectance_at(&self, cos_theta: f64) -> f64 {
        unpolarised(|polarisation| self.amplitude(polarisation, cos_theta))
    }

    /// r from the substrate up.
    fn amplitude(&self, polarisation: Polarisation, cos_theta: f64) -> Complex<f64> {
        let k0_rad_per_m = wavenumber_rad_per_m(self.frequency_hz);
        let mut below = medium(self.eps_real, self.eps_imag, cos_theta);
        let mut r = Complex::from(0.0);
        let mut there_and_back = Complex::from(1.0);
        for layer in self.layers.iter().rev() {
            let above = medium(layer.eps_real, layer.eps_imag, cos_theta);
            r = step_up(interface(polarisation, above, below), r * there_and_back);
            let delta = above.1 * (k0_rad_per_m * layer.thickness_m);
            there_and_back = (Complex::new(0.0, -2.0) * delta).exp();
            below = above;
        }
        let outside = (Complex::from(1.0), Complex::from(cos_theta));
        step_up(interface(polarisation, outside, below), r * there_and_back)
    }
}

/// ε of a medium and the normal wavenumber in it.
fn medium(eps_real: f64, eps_imag: f64, cos_theta: f64) -> (Complex<f64>, Complex<f64>) {
    let eps = permittivity(eps_real, eps_imag);
    (eps, normal_wavenumber(eps, cos_theta))
}

/// Reflection above a boundary from that of the boundary and that of all below it.
fn step_up(boundary: Complex<f64>, from_below: Complex<f64>) -> Complex<f64> {
    let sum = 1.0 + boundary * from_below;
    if sum.norm_sqr() == 0.0 { boundary } else { (boundary + from_below) / sum }
}

impl Scattering for Layered {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let reflectance = |cos| self.reflectance_at(cos);
        Seen::mirror(mirror_lobe_per_sr(i, o, self.lobe_rad, beam_rad, reflectance))
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        narrow_mirror(self.lobe_rad, self.reflectance_at(i.cos_theta()))
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if is_narrow(self.lobe_rad) { Seen::default() } else { self.seen_by(0.0, i, o) }
    }

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        BOTH.map(|polarisation| self.amplitude(polarisation, mirror_cosine(i, o)))
    }

    fn backscatter(&self) -> Option<Vec<Term>> {
        Some(vec![mirror_lobe(self.lobe_rad, self.reflectance_at(1.0))])
    }
}

impl ScatteringModel for Layered {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        for (position, layer) in self.layers.iter_mut().enumerate() {
            let prefix = format!("{prefix}layers.{position}.");
            let slot = &mut layer.thickness_m;
            visit_quantity(visitor, &prefix, "thickness_m", "m", THICKNESS_RANGE_M, slot);
            visit_permittivity(visitor, &prefix, &mut layer.eps_real, &mut layer.eps_imag);
        }
        visit_permittivity(visitor, prefix, &mut self.eps_real, &mut self.eps_imag);
        let slot = &mut self.frequency_hz;
        visit_quantity(visitor, prefix, "frequency_hz", "Hz", FREQUENCY_RANGE_HZ, slot);
        visit_lobe(visitor, prefix, &mut self.lobe_rad);
    }

    fn is_smooth(&self) -> bool {
        true
    }

    fn has_smooth_mirror(&self) -> bool {
        self.lobe_rad.is_none()
    }

    fn permittivity(&self) -> Option<[f64; 2]> {
        let substrate = [self.eps_real, self.eps_imag];
        Some(self.layers.first().map_or(substrate, |layer| [layer.eps_real, layer.eps_imag]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::Fresnel;
    use crate::units::SPEED_OF_LIGHT_M_PER_S;

    const GLASS: f64 = 5.79;
    const ANGLES_RAD: [f64; 5] = [0.0, 0.3, 0.8, 1.2, 1.5];

    fn coated(layers: &[(f64, f64, f64)]) -> Layered {
        let layer = |&(thickness_m, eps_real, eps_imag)| Layer { thickness_m, eps_real, eps_imag };
        Layered {
            layers: layers.iter().map(layer).collect(),
            eps_real: GLASS,
            eps_imag: 0.3,
            frequency_hz: 300e9,
            lobe_rad: Some(0.02),
        }
    }

    fn bare(eps_real: f64, eps_imag: f64) -> Fresnel {
        Fresnel { eps_real, eps_imag, lobe_rad: Some(0.02) }
    }

    fn wavelength_m() -> f64 {
        SPEED_OF_LIGHT_M_PER_S / 300e9
    }

    /// The textbook's product of characteristic matrices, with admittances p (s) and ε/p (p).
    fn by_matrices(model: &Layered, polarisation: Polarisation, cos: f64) -> Complex<f64> {
        let admittance = |eps: Complex<f64>| match polarisation {
            Polarisation::S => normal_wavenumber(eps, cos),
            Polarisation::P => eps / normal_wavenumber(eps, cos),
        };
        let substrate = admittance(permittivity(model.eps_real, model.eps_imag));
        let (mut b, mut c) = (Complex::from(1.0), substrate);
        for layer in model.layers.iter().rev() {
            let eps = permittivity(layer.eps_real, layer.eps_imag);
            let phase = wavenumber_rad_per_m(model.frequency_hz) * layer.thickness_m;
            let delta = normal_wavenumber(eps, cos) * phase;
            let (eta, j) = (admittance(eps), Complex::new(0.0, 1.0));
            (b, c) = (
                delta.cos() * b + j * delta.sin() / eta * c,
                j * eta * delta.sin() * b + delta.cos() * c,
            );
        }
        let outside = admittance(Complex::from(1.0));
        (outside * b - c) / (outside * b + c)
    }

    #[test]
    fn the_recursion_is_the_product_of_matrices() {
        let model = coated(&[(130e-6, 2.6, 0.1), (400e-6, 1.5, 0.02), (50e-6, 9.0, 1.0)]);
        for cos in ANGLES_RAD.map(f64::cos) {
            for polarisation in crate::brdf::permittivity::BOTH {
                let found = model.amplitude(polarisation, cos).norm();
                let expected = by_matrices(&model, polarisation, cos).norm();
                assert!((found - expected).abs() < 1e-12, "{polarisation:?} {cos}");
            }
        }
    }

    #[test]
    fn no_layer_a_layer_of_no_thickness_and_a_half_wave_are_absent() {
        let half_wave_m = wavelength_m() / 2.0 / 2.6f64.sqrt();
        for theta_rad in ANGLES_RAD {
            let expected = bare(GLASS, 0.3).reflectance(theta_rad);
            for layers in [&[][..], &[(0.0, 2.6, 0.1)], &[(1e-3, 1.0, 0.0)]] {
                let found = coated(layers).reflectance(theta_rad);
                assert!((found - expected).abs() < 1e-12, "{layers:?} {theta_rad}");
            }
        }
        let found = coated(&[(half_wave_m, 2.6, 0.0)]).reflectance(0.0);
        assert!((found - bare(GLASS, 0.3).reflectance(0.0)).abs() < 1e-12);
    }

    #[test]
    fn a_quarter_wave_of_the_geometric_mean_reflects_nothing() {
        let eps = GLASS.sqrt();
        let layers = [(wavelength_m() / 4.0 / eps.sqrt(), eps, 0.0)];
        let found = Layered { eps_imag: 0.0, ..coated(&layers) }.reflectance(0.0);
        assert!(found < 1e-28, "{found}");
    }

    #[test]
    fn a_thick_lossy_layer_hides_the_substrate() {
        for theta_rad in ANGLES_RAD {
            let found = coated(&[(0.1, 4.67, 5.0)]).reflectance(theta_rad);
            let expected = bare(4.67, 5.0).reflectance(theta_rad);
            assert!((found - expected).abs() < 1e-12);
        }
    }

    #[test]
    fn no_stack_reflects_more_than_it_receives() {
        for step in 0..200 {
            let thickness_m = f64::from(step) * 11e-6;
            let layers = [(thickness_m, 2.6, 0.0), (2.0 * thickness_m, -3.0, 0.01)];
            for theta_rad in ANGLES_RAD {
                let lossless = Layered { eps_imag: 0.0, ..coated(&layers) };
                for model in [lossless, coated(&layers)] {
                    for polarisation in crate::brdf::permittivity::BOTH {
                        let r = model.amplitude(polarisation, theta_rad.cos()).norm_sqr();
                        assert!(r <= 1.0 + 1e-12, "{thickness_m} {theta_rad}: {r}");
                    }
                }
            }
        }
    }
}
