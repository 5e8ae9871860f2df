//! Smooth homogeneous layers on a half space: f = R(ψ)·D(h)·G/(4·cos θ_i·cos θ_o), as in `fresnel`.
//!
//! With p = √(ε − sin²θ) in each medium and δ = k₀·p·d in each layer, the reflected amplitude r above
//! a boundary follows from that below it: r ← (ρ + r·e^{−2jδ})/(1 + ρ·r·e^{−2jδ}), ρ being Fresnel's
//! amplitude of the boundary, from the substrate up, for both polarisations. It is what the
//! characteristic matrix gives (Born & Wolf, *Principles of Optics*, 7th ed., §1.6; Macleod,
//! *Thin-Film Optical Filters*, ch. 2), but holds for thick lossy layers too, where the matrix overflows.
//! The transmitted amplitude follows in the same pass, t ← (1 + ρ)·t·e^{−jδ}/(1 + ρ·r·e^{−2jδ}).
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
    EPS_IMAG, EPS_REAL, Polarisation, default_frequency_hz, interface, is_narrow, mirror_cosine,
    mirror_lobe, mirror_lobe_per_sr, narrow_mirror, normal_wavenumber, permittivity, unpolarised,
    visit_lobe, visit_permittivity, wavenumber_rad_per_m,
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

    /// The amplitude reflected at the frequency of the model.
    fn amplitude(&self, polarisation: Polarisation, cos_theta: f64) -> Complex<f64> {
        self.amplitudes(polarisation, cos_theta, self.frequency_hz).reflected
    }

    /// What the layers reflect and transmit of a plane wave at a frequency, from the substrate up. The layers have the
    /// same permittivity at every frequency.
    pub fn amplitudes(
        &self,
        polarisation: Polarisation,
        cos_theta: f64,
        frequency_hz: f64,
    ) -> Amplitudes {
        let k0_rad_per_m = wavenumber_rad_per_m(frequency_hz);
        let mut below = medium(self.eps_real, self.eps_imag, cos_theta);
        let mut from_below = Amplitudes { reflected: 0.0.into(), transmitted: 1.0.into() };
        // e^{−2jδ} and e^{−jδ} of the layer that lies between.
        let mut there_and_back = Complex::from(1.0);
        let mut down = Complex::from(1.0);
        for layer in self.layers.iter().rev() {
            let above = medium(layer.eps_real, layer.eps_imag, cos_theta);
            let boundary = interface(polarisation, above, below);
            from_below = from_below.above(boundary, there_and_back, down);
            let delta = above.1 * (k0_rad_per_m * layer.thickness_m);
            there_and_back = (Complex::new(0.0, -2.0) * delta).exp();
            down = (Complex::new(0.0, -1.0) * delta).exp();
            below = above;
        }
        let outside = (Complex::from(1.0), Complex::from(cos_theta));
        from_below.above(interface(polarisation, outside, below), there_and_back, down)
    }

    /// A single layer in air: a sheet that lets a part of the wave through.
    pub fn sheet(thickness_m: f64, [eps_real, eps_imag]: [f64; 2]) -> Layered {
        Layered {
            layers: vec![Layer { thickness_m, eps_real, eps_imag }],
            eps_real: 1.0,
            eps_imag: 0.0,
            frequency_hz: default_frequency_hz(),
            lobe_rad: None,
        }
    }

    /// Whether there is air behind the layers, as in front of them.
    pub fn is_in_air(&self) -> bool {
        self.eps_real == 1.0 && self.eps_imag == 0.0
    }

    /// Thickness of all layers together, m.
    pub fn thickness_m(&self) -> f64 {
        self.layers.iter().map(|layer| layer.thickness_m).sum()
    }

    /// What a beam sees, with a reflectance of the caller's: a function of cos ψ, where ψ is the angle at which the
    /// facets that answer are met.
    pub fn seen_with(
        &self,
        beam_rad: f64,
        i: Direction<Surface>,
        o: Direction<Surface>,
        reflectance: impl Fn(f64) -> f64,
    ) -> Seen {
        Seen::mirror(mirror_lobe_per_sr(i, o, self.lobe_rad, beam_rad, reflectance))
    }

    /// The lobes that are too narrow for a path to meet by chance, with a reflectance of the caller's.
    pub fn narrow_lobes_with(&self, reflectance: f64) -> Vec<NarrowLobe> {
        narrow_mirror(self.lobe_rad, reflectance)
    }

    /// Whether the mirror's lobe is one of those.
    pub fn is_narrow(&self) -> bool {
        is_narrow(self.lobe_rad)
    }
}

/// Complex amplitudes of the electric field along the layers, over that of the wave that falls on them. The phase of
/// what is reflected refers to the outer face, that of what is transmitted to the face of the substrate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Amplitudes {
    /// r.
    pub reflected: Complex<f64>,
    /// t; with air behind the layers |t|² is the power that passes.
    pub transmitted: Complex<f64>,
}

impl Amplitudes {
    /// Those above a boundary with the layer over them, from those of all below.
    fn above(
        self,
        boundary: Complex<f64>,
        there_and_back: Complex<f64>,
        down: Complex<f64>,
    ) -> Amplitudes {
        let returned = self.reflected * there_and_back;
        let sum = 1.0 + boundary * returned;
        if sum.norm_sqr() == 0.0 {
            return Amplitudes { reflected: boundary, transmitted: 0.0.into() };
        }
        Amplitudes {
            reflected: (boundary + returned) / sum,
            transmitted: (1.0 + boundary) * self.transmitted * down / sum,
        }
    }
}

/// ε of a medium and the normal wavenumber in it.
fn medium(eps_real: f64, eps_imag: f64, cos_theta: f64) -> (Complex<f64>, Complex<f64>) {
    let eps = permittivity(eps_real, eps_imag);
    (eps, normal_wavenumber(eps, cos_theta))
}

impl Scattering for Layered {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        self.seen_with(beam_rad, i, o, |cos| self.reflectance_at(cos))
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        self.narrow_lobes_with(self.reflectance_at(i.cos_theta()))
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if self.is_narrow() { Seen::default() } else { self.seen_by(0.0, i, o) }
    }

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        Polarisation::BOTH.map(|polarisation| self.amplitude(polarisation, mirror_cosine(i, o)))
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
            for polarisation in Polarisation::BOTH {
                let found = model.amplitude(polarisation, cos).norm();
                let expected = by_matrices(&model, polarisation, cos).norm();
                assert!((found - expected).abs() < 1e-12, "{polarisation:?} {cos}");
            }
        }
    }

    /// The share of the power that a single layer in air turns to heat: ∫ k₀·ε″·|E|² dz/cos θ over the field in it,
    /// which the textbook's matrix carries up from its lower face, in slices.
    fn heated(layer: Layer, polarisation: Polarisation, cos: f64, t: Complex<f64>) -> f64 {
        const SLICES: usize = 4000;
        let eps = permittivity(layer.eps_real, layer.eps_imag);
        let p = normal_wavenumber(eps, cos);
        let eta = match polarisation {
            Polarisation::S => p,
            Polarisation::P => eps / p,
        };
        let below = match polarisation {
            Polarisation::S => Complex::from(cos),
            Polarisation::P => Complex::from(1.0 / cos),
        };
        let k0 = wavenumber_rad_per_m(300e9);
        let step_m = layer.thickness_m / SLICES as f64;
        let j = Complex::new(0.0, 1.0);
        let density = |slice: usize| {
            let delta = p * (k0 * step_m * (slice as f64 + 0.5));
            let electric = t * (delta.cos() + j * delta.sin() / eta * below);
            let magnetic = t * (j * eta * delta.sin() + delta.cos() * below);
            let across = match polarisation {
                Polarisation::S => 0.0,
                // The field along the normal: k_x·H/ε.
                Polarisation::P => (1.0 - cos * cos) * (magnetic / eps).norm_sqr(),
            };
            k0 * layer.eps_imag * (electric.norm_sqr() + across)
        };
        (0..SLICES).map(density).sum::<f64>() * step_m / below.re
    }

    #[test]
    fn what_is_neither_reflected_nor_transmitted_turns_to_heat() {
        for (thickness_m, eps) in [(5e-4, [1.6, 0.08]), (3e-3, [2.6, 0.3]), (1e-4, [-3.0, 2.0])] {
            let sheet = Layered::sheet(thickness_m, eps);
            for cos in ANGLES_RAD.map(f64::cos) {
                for polarisation in Polarisation::BOTH {
                    let Amplitudes { reflected, transmitted } =
                        sheet.amplitudes(polarisation, cos, 300e9);
                    let heat = heated(sheet.layers[0], polarisation, cos, transmitted);
                    let sum = reflected.norm_sqr() + transmitted.norm_sqr() + heat;
                    assert!((sum - 1.0).abs() < 1e-5, "{eps:?} {cos} {polarisation:?}: {sum}");
                }
            }
        }
    }

    #[test]
    fn without_loss_reflected_and_transmitted_power_are_all() {
        let mut model = coated(&[(130e-6, 2.6, 0.0), (4e-3, 1.5, 0.0), (50e-6, 9.0, 0.0)]);
        (model.eps_real, model.eps_imag) = (1.0, 0.0);
        for step in 0..100 {
            let frequency_hz = 286.5e9 + 0.27e9 * f64::from(step);
            for cos in ANGLES_RAD.map(f64::cos) {
                for polarisation in Polarisation::BOTH {
                    let Amplitudes { reflected, transmitted } =
                        model.amplitudes(polarisation, cos, frequency_hz);
                    let sum = reflected.norm_sqr() + transmitted.norm_sqr();
                    assert!((sum - 1.0).abs() < 1e-12, "{frequency_hz} {cos}: {sum}");
                }
            }
        }
    }

    #[test]
    fn a_sheet_transmits_as_the_sum_of_its_inner_echoes() {
        // Airy: t = Σ τ·(ρ²)ᵐ·τ′·e^{−j(2m + 1)δ}, with Fresnel's ρ and τ = 1 + ρ of each face.
        let (thickness_m, eps, cos) = (8e-3, [2.56, 0.01], 0.8f64);
        let inside = medium(eps[0], eps[1], cos);
        let outside = (Complex::from(1.0), Complex::from(cos));
        for polarisation in Polarisation::BOTH {
            let into = interface(polarisation, outside, inside);
            let delta = inside.1 * (wavenumber_rad_per_m(300e9) * thickness_m);
            let once = (Complex::new(0.0, -1.0) * delta).exp();
            let mut expected = Complex::from(0.0);
            let mut wave = (1.0 + into) * (1.0 - into) * once;
            for _ in 0..60 {
                expected += wave;
                wave *= into * into * once * once;
            }
            let found = Layered::sheet(thickness_m, eps).amplitudes(polarisation, cos, 300e9);
            assert!((found.transmitted - expected).norm() < 1e-12, "{polarisation:?}");
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
                    for polarisation in Polarisation::BOTH {
                        let r = model.amplitude(polarisation, theta_rad.cos()).norm_sqr();
                        assert!(r <= 1.0 + 1e-12, "{thickness_m} {theta_rad}: {r}");
                    }
                }
            }
        }
    }
}
