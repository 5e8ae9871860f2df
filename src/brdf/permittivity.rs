//! Complex permittivity, Fresnel amplitudes and the lobe of a mirror, for the models that need them.
//!
//! Time runs as exp(+jωt), so that ε = ε′ − jε″ with ε″ ≥ 0 for anything passive, and a wave going
//! down as exp(−j·k₀·p·z) has Im p ≤ 0. p = √(ε − sin²θ) is the normal wavenumber in units of k₀.
//! Source: Born & Wolf, *Principles of Optics*, 7th ed., §1.5 and §14.2 (with the other sign of time).

use nalgebra::Complex;

use super::backscatter::{Facets, Term};
use super::kind::Key;
use super::parameter::{Visitor, visit_number};
use super::scattering::half_vector;
use super::slopes::Distribution;
use crate::frames::{Direction, Surface};
use crate::units::SPEED_OF_LIGHT_M_PER_S;

/// Widest values that metals reach: aluminium at 300 GHz has ε′ ≈ −2·10⁴ and ε″ ≈ 2·10⁶.
const EPS_REAL_RANGE: (f64, f64) = (-1e9, 1e9);
const EPS_IMAG_RANGE: (f64, f64) = (0.0, 1e9);

/// ε′ and ε″ in JSON.
pub(super) const EPS_REAL: Key = Key::new(
    "eps_real",
    r#"{"type": "number", "description": "relative permittivity, real part"}"#,
);
pub(super) const EPS_IMAG: Key = Key::new(
    "eps_imag",
    r#"{"type": "number", "description": "imaginary part, 0 or more, for exp(+jwt)"}"#,
);

/// ε = ε′ − jε″.
pub(super) fn permittivity(eps_real: f64, eps_imag: f64) -> Complex<f64> {
    Complex::new(eps_real, -eps_imag)
}

/// Calls the visitor for ε′ and ε″.
pub(super) fn visit_permittivity(
    visitor: &mut Visitor,
    prefix: &str,
    eps_real: &mut f64,
    eps_imag: &mut f64,
) {
    visit_number(visitor, prefix, "eps_real", EPS_REAL_RANGE, eps_real);
    visit_number(visitor, prefix, "eps_imag", EPS_IMAG_RANGE, eps_imag);
}

/// The electric field's direction: across the plane of incidence (s) or in it (p).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polarisation {
    /// Across the plane of incidence.
    S,
    /// In the plane of incidence.
    P,
}

impl Polarisation {
    /// Both, in equal shares: unpolarised incidence.
    pub const BOTH: [Polarisation; 2] = [Polarisation::S, Polarisation::P];
}

/// √(ε − sin²θ) on the branch that decays downwards.
pub(super) fn normal_wavenumber(eps: Complex<f64>, cos_theta: f64) -> Complex<f64> {
    let root = (eps - (1.0 - cos_theta * cos_theta).max(0.0)).sqrt();
    if root.im > 0.0 { -root } else { root }
}

/// Amplitude reflected where medium `a` meets medium `b`, each given as (ε, normal wavenumber).
pub(super) fn interface(
    polarisation: Polarisation,
    (eps_a, p_a): (Complex<f64>, Complex<f64>),
    (eps_b, p_b): (Complex<f64>, Complex<f64>),
) -> Complex<f64> {
    let (plus, minus) = match polarisation {
        Polarisation::S => (p_a, p_b),
        Polarisation::P => (eps_a * p_b, eps_b * p_a),
    };
    // Both vanish only where a wave grazes, or where ε = 0: all of it is reflected.
    let sum = plus + minus;
    if sum.norm_sqr() == 0.0 { Complex::from(-1.0) } else { (plus - minus) / sum }
}

/// Share of the power that a half space reflects of unpolarised incidence, 0 to 1.
pub(super) fn fresnel_reflectance(eps: Complex<f64>, cos_theta: f64) -> f64 {
    let outside = (Complex::from(1.0), Complex::from(cos_theta));
    let inside = (eps, normal_wavenumber(eps, cos_theta));
    unpolarised(|polarisation| interface(polarisation, outside, inside))
}

/// Mean over both polarisations of |r|², held to at most 1 against rounding.
pub(super) fn unpolarised(amplitude: impl Fn(Polarisation) -> Complex<f64>) -> f64 {
    let powers = Polarisation::BOTH.map(|polarisation| amplitude(polarisation).norm_sqr());
    let sum: f64 = powers.into_iter().sum();
    (sum / 2.0).min(1.0)
}

/// Range of the lobe width of a mirror, rad.
pub(super) const LOBE_RANGE_RAD: (f64, f64) = (0.001, 0.5);

/// A Gaussian beam of waist w returns exp(−(δ/δ₀)²) of its power from a mirror tilted by δ, with
/// δ₀ = λ/(2πw): 0.020 rad for a spot 2w = 16 mm across at λ = 1 mm.
pub(super) fn default_lobe_rad() -> f64 {
    0.02
}

/// Frequency of a model that gives none.
pub(super) fn default_frequency_hz() -> f64 {
    300e9
}

/// k₀ = 2π·f/c, rad/m.
pub(super) fn wavenumber_rad_per_m(frequency_hz: f64) -> f64 {
    std::f64::consts::TAU * frequency_hz / SPEED_OF_LIGHT_M_PER_S
}

/// f of a mirror seen with a finite angular width: R·D(h)·G/(4·cos θ_i·cos θ_o), 1/sr.
///
/// `reflectance` maps cos of the angle between the directions and h to R. D is Beckmann's with
/// m = `lobe_rad`, and Smith's G keeps the energy at grazing incidence.
pub(super) fn mirror_lobe_per_sr(
    i: Direction<Surface>,
    o: Direction<Surface>,
    lobe_rad: f64,
    reflectance: impl Fn(f64) -> f64,
) -> f64 {
    let h = half_vector(i, o);
    let law = Distribution::Beckmann;
    let d_per_sr = law.d_per_sr(h.cos_theta(), lobe_rad);
    if d_per_sr == 0.0 {
        return 0.0;
    }
    let g = law.g1(i.cos_theta(), lobe_rad) * law.g1(o.cos_theta(), lobe_rad);
    reflectance(mirror_cosine(i, o)) * d_per_sr * g / (4.0 * i.cos_theta() * o.cos_theta())
}

/// [`mirror_lobe_per_sr`] in backscatter, for the reflectance at normal incidence.
pub(super) fn mirror_lobe(lobe_rad: f64, reflectance: f64) -> Term {
    let distribution = Distribution::Beckmann;
    Term::mirrors(reflectance, Facets { m: lobe_rad, distribution, shadowed: 2 })
}

/// Cosine of the angle at which a facet mirrors i into o, √((1 + i·o)/2): the same from both ends.
pub(super) fn mirror_cosine(i: Direction<Surface>, o: Direction<Surface>) -> f64 {
    ((1.0 + i.xyz().dot(o.xyz())) / 2.0).clamp(0.0, 1.0).sqrt()
}
