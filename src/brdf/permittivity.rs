//! Complex permittivity, Fresnel amplitudes and the lobe of a mirror, for the models that need them.
//!
//! Time runs as exp(+jωt), so that ε = ε′ − jε″ with ε″ ≥ 0 for anything passive, and a wave going
//! down as exp(−j·k₀·p·z) has Im p ≤ 0. p = √(ε − sin²θ) is the normal wavenumber in units of k₀.
//! Source: Born & Wolf, *Principles of Optics*, 7th ed., §1.5 and §14.2 (with the other sign of time).

use nalgebra::Complex;

use super::backscatter::{Facets, Term};
use super::kind::Key;
use super::parameter::{Visitor, visit_number, visit_quantity};
use super::scattering::{NARROW_M, NarrowLobe, half_vector};
use super::slopes::{Distribution, SlopeMatrix};
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

/// The amplitudes r_s and r_p that a half space reflects.
pub(super) fn half_space_amplitudes(eps: Complex<f64>, cos_theta: f64) -> [Complex<f64>; 2] {
    let outside = (Complex::from(1.0), Complex::from(cos_theta));
    let inside = (eps, normal_wavenumber(eps, cos_theta));
    Polarisation::BOTH.map(|polarisation| interface(polarisation, outside, inside))
}

/// Mean over both polarisations of |r|², held to at most 1 against rounding.
pub(super) fn unpolarised(amplitude: impl Fn(Polarisation) -> Complex<f64>) -> f64 {
    let powers = Polarisation::BOTH.map(|polarisation| amplitude(polarisation).norm_sqr());
    let sum: f64 = powers.into_iter().sum();
    (sum / 2.0).min(1.0)
}

/// Range of the lobe width of a mirror, rad.
const LOBE_RANGE_RAD: (f64, f64) = (0.001, 0.5);

/// Calls the visitor for the width of a mirror's lobe, where it is stated.
pub(super) fn visit_lobe(visitor: &mut Visitor, prefix: &str, lobe_rad: &mut Option<f64>) {
    if let Some(lobe_rad) = lobe_rad {
        visit_quantity(visitor, prefix, "lobe_rad", "rad", LOBE_RANGE_RAD, lobe_rad);
    }
}

/// Frequency of a model that gives none.
pub(super) fn default_frequency_hz() -> f64 {
    300e9
}

/// k₀ = 2π·f/c, rad/m.
pub(super) fn wavenumber_rad_per_m(frequency_hz: f64) -> f64 {
    std::f64::consts::TAU * frequency_hz / SPEED_OF_LIGHT_M_PER_S
}

/// f of a mirror as a beam of a divergence, rad, sees it: R·D(h)·G/(4·cos θ_i·cos θ_o), 1/sr.
///
/// `reflectance` maps cos of the angle between the directions and h to R. D is Beckmann's with the beam's own slopes
/// and those of the lobe, and Smith's G keeps the energy of a wide lobe at grazing incidence.
pub(super) fn mirror_lobe_per_sr(
    i: Direction<Surface>,
    o: Direction<Surface>,
    lobe_rad: Option<f64>,
    beam_rad: f64,
    reflectance: impl Fn(f64) -> f64,
) -> f64 {
    let facets = mirror_facets(lobe_rad);
    let (law, own_m) = (facets.distribution, facets.m_without_beam(beam_rad));
    let beam = SlopeMatrix::of_beam(beam_rad, i, o);
    let d_per_sr = law.d_seen_per_sr(half_vector(i, o), [own_m, own_m], beam);
    if d_per_sr == 0.0 {
        return 0.0;
    }
    let m = facets.shadowing_m(beam_rad);
    let g = law.g1(i.cos_theta(), m) * law.g1(o.cos_theta(), m);
    reflectance(mirror_cosine(i, o)) * d_per_sr * g / (4.0 * i.cos_theta() * o.cos_theta())
}

/// [`mirror_lobe_per_sr`] in backscatter, for the reflectance at normal incidence.
pub(super) fn mirror_lobe(lobe_rad: Option<f64>, reflectance: f64) -> Term {
    Term::mirrors(reflectance, mirror_facets(lobe_rad))
}

/// Whether a mirror's lobe is too narrow for a path to meet by chance.
pub(super) fn is_narrow(lobe_rad: Option<f64>) -> bool {
    lobe_rad.is_none_or(|lobe_rad| lobe_rad <= NARROW_M)
}

/// The lobe of a mirror, if it is narrow. A stated one is mostly the beam's, so that the mirror itself counts as smooth.
pub(super) fn narrow_mirror(lobe_rad: Option<f64>, share: f64) -> Vec<NarrowLobe> {
    if is_narrow(lobe_rad) { vec![NarrowLobe { share, m: 0.0 }] } else { Vec::new() }
}

/// The facets of a mirror: of a lobe stated as beam and surface make it, or of a smooth one.
fn mirror_facets(lobe_rad: Option<f64>) -> Facets {
    Facets {
        m: lobe_rad.unwrap_or(0.0),
        distribution: Distribution::Beckmann,
        shadowed: 2,
        includes_beam: lobe_rad.is_some(),
    }
}

/// Cosine of the angle at which a facet mirrors i into o, √((1 + i·o)/2): the same from both ends.
pub(crate) fn mirror_cosine(i: Direction<Surface>, o: Direction<Surface>) -> f64 {
    ((1.0 + i.xyz().dot(o.xyz())) / 2.0).clamp(0.0, 1.0).sqrt()
}
