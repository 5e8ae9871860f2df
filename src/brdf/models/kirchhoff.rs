//! Kirchhoff's (physical optics) scattering of a Gaussian random surface, incoherent and coherent.
//!
//! With q = k(i + o), q_z along the normal and q_t across it, height deviation s, correlation length l:
//!
//! σ⁰ = R(ψ)·q⁴/(4π·q_z²) · e^{−g} Σ_{n≥1} gⁿ/n! · W_n(q_t) + coherent, g = (q_z·s)²,
//! W_n = (π·l²/n)·exp(−q_t²·l²/4n) for the correlation exp(−r²/l²) (Gaussian),
//! W_n = 2π·l²·n/(n² + q_t²·l²)^{3/2} for exp(−r/l) (exponential), f = σ⁰/(4π·cos θ_i·cos θ_o).
//!
//! Source: Beckmann & Spizzichino, *The Scattering of Electromagnetic Waves from Rough Surfaces*
//! (1963), ch. 5, whose F·cos θ_i is q²/(2k·q_z); the reflectance is Fresnel's, unpolarised, at the
//! angle ψ of the mirroring facet, as in the stationary-phase form (Tsang, Kong & Ding, *Scattering
//! of Electromagnetic Waves: Theories and Applications* (2000), ch. 9). Ulaby & Long's scalar
//! approximation (*Microwave Radar and Radiometric Remote Sensing* (2014), ch. 10) instead takes R
//! and the slope at the mean plane; in backscatter it is cos⁴θ times as strong.
//! The coherent part is the mirror of `fresnel` times e^{−g}: in backscatter exp(−(2ks·cos θ)²).
//!
//! At 300 GHz (k = 6.28 rad/mm) painted or anodised metal has s = 0.5–5 µm and coarse grit 36–280 µm
//! (Grossman 2017, IEEE Trans. THz Sci. Technol. 7(5)); cast or blasted 5–50 µm is assumed; l is 0.1–3 mm.
//! The theory wants k·l > 6 and a radius of curvature beyond λ (for Gaussian correlation l² > 2.8·s·λ); exponential correlation has no
//! curvature, and its results are a convention of the field. There is no shadowing: a metal
//! with s = 0.3 mm, l = 2 mm reflects at most what it receives up to 60°, but at 75° 1.04 (Gaussian) to
//! 1.40 (exponential) times that. Rough exponential surfaces lose up to half at normal incidence.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, TAU};

use crate::brdf::kind::{Key, Kind};
use crate::brdf::parameter::{Visitor, visit_quantity};
use crate::brdf::permittivity::{
    EPS_IMAG, EPS_REAL, LOBE_RANGE_RAD, default_frequency_hz, default_lobe_rad,
    fresnel_reflectance, half_space_amplitudes, mirror_cosine, mirror_lobe_per_sr, permittivity,
    visit_permittivity, wavenumber_rad_per_m,
};
use crate::brdf::scattering::{Scattering, ScatteringModel, Seen};
use crate::frames::{Direction, Surface};

pub(super) const KIND: Kind = Kind {
    name: "kirchhoff",
    keys: &[
        Key::number("rms_height_m"),
        Key::number("correlation_length_m"),
        Key::new("correlation", r#"{"enum": ["gaussian", "exponential"]}"#),
        EPS_REAL,
        EPS_IMAG,
        Key::number("frequency_hz"),
        Key::number("lobe_rad"),
    ],
    starts: &[(
        "kirchhoff",
        r#"{"model": "kirchhoff", "rms_height_m": 5e-5, "correlation_length_m": 5e-4, "eps_real": 3}"#,
    )],
};

/// A rough surface by its statistics.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Kirchhoff {
    /// Standard deviation of the height s, 0 to 2 mm, in m.
    pub rms_height_m: f64,
    /// Correlation length l, where the correlation is 1/e; 10 µm to 0.1 m, in m.
    pub correlation_length_m: f64,
    /// Shape of the correlation.
    #[serde(default)]
    pub correlation: Correlation,
    /// ε′, relative to vacuum; negative for metals.
    pub eps_real: f64,
    /// ε″ ≥ 0: the loss.
    #[serde(default)]
    pub eps_imag: f64,
    /// Frequency, 10 GHz to 1 THz.
    #[serde(default = "default_frequency_hz")]
    pub frequency_hz: f64,
    /// Width of the coherent mirror's lobe, 0.001 to 0.5 rad, as in `fresnel`.
    #[serde(default = "default_lobe_rad")]
    pub lobe_rad: f64,
}

/// How the heights at two places depend on their distance r.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Correlation {
    /// exp(−r²/l²): smooth hills, rms slope √2·s/l.
    #[default]
    Gaussian,
    /// exp(−r/l): fine structure at every scale.
    Exponential,
}

const HEIGHT_RANGE_M: (f64, f64) = (0.0, 2e-3);
const LENGTH_RANGE_M: (f64, f64) = (1e-5, 0.1);
/// Up to here the series has at most some thousand terms that count.
const FREQUENCY_RANGE_HZ: (f64, f64) = (1e10, 1e12);

impl Kirchhoff {
    fn eps(&self) -> Complex<f64> {
        permittivity(self.eps_real, self.eps_imag)
    }

    /// The diffuse part of f, 1/sr.
    pub fn incoherent_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        let k_rad_per_m = wavenumber_rad_per_m(self.frequency_hz);
        let q = (i.xyz() + o.xyz()) * k_rad_per_m;
        let across = q.truncate().length() * self.correlation_length_m;
        let spectrum_m2 = self.correlation_length_m.powi(2)
            * self.correlation.series((q.z * self.rms_height_m).powi(2), across);
        let reflectance = fresnel_reflectance(self.eps(), mirror_cosine(i, o));
        let sigma0 = reflectance * (q.length_squared() / q.z).powi(2) / (4.0 * PI) * spectrum_m2;
        sigma0 / (4.0 * PI * i.cos_theta() * o.cos_theta())
    }

    /// The mirror's part of f, 1/sr.
    pub fn coherent_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.coherent_seen_by(0.0, i, o)
    }

    /// The mirror's part of f, 1/sr, as a beam of a divergence, rad, sees it.
    fn coherent_seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        let lobe_rad = self.lobe_rad.max(beam_rad);
        let q_z = wavenumber_rad_per_m(self.frequency_hz) * (i.cos_theta() + o.cos_theta());
        let kept = (-(q_z * self.rms_height_m).powi(2)).exp();
        kept * mirror_lobe_per_sr(i, o, lobe_rad, |cos| fresnel_reflectance(self.eps(), cos))
    }
}

impl Scattering for Kirchhoff {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        half_space_amplitudes(permittivity(self.eps_real, self.eps_imag), mirror_cosine(i, o))
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let coherent_per_sr = self.coherent_seen_by(beam_rad, i, o);
        let f_per_sr = self.incoherent_per_sr(i, o) + coherent_per_sr;
        let coherent_share = if f_per_sr > 0.0 { coherent_per_sr / f_per_sr } else { 0.0 };
        Seen { f_per_sr, specular_share: 1.0, coherent_share }
    }
}

impl ScatteringModel for Kirchhoff {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        for (name, unit, range, slot) in [
            ("rms_height_m", "m", HEIGHT_RANGE_M, &mut self.rms_height_m),
            ("correlation_length_m", "m", LENGTH_RANGE_M, &mut self.correlation_length_m),
            ("frequency_hz", "Hz", FREQUENCY_RANGE_HZ, &mut self.frequency_hz),
            ("lobe_rad", "rad", LOBE_RANGE_RAD, &mut self.lobe_rad),
        ] {
            visit_quantity(visitor, prefix, name, unit, range, slot);
        }
        visit_permittivity(visitor, prefix, &mut self.eps_real, &mut self.eps_imag);
    }

    fn permittivity(&self) -> Option<[f64; 2]> {
        Some([self.eps_real, self.eps_imag])
    }
}

/// Terms below this share of the largest are left out.
const LEAST_TERM_LN: f64 = -40.0;

impl Correlation {
    /// e^{−g} Σ gⁿ/n! · W_n/l², `across` being q_t·l.
    ///
    /// The terms rise to one maximum and fall from there. They are taken as logarithms, relative to
    /// the largest, so that neither gⁿ nor n! nor e^{−g} can overflow or vanish on the way.
    fn series(self, g: f64, across: f64) -> f64 {
        if g <= 0.0 {
            return 0.0;
        }
        let peak = first_fall(|n| self.term_ln(n + 1, g, across) <= self.term_ln(n, g, across));
        let peak_ln = self.term_ln(peak, g, across);
        peak_ln.exp()
            * (self.shares(peak..u32::MAX, peak_ln, g, across)
                + self.shares((1..peak).rev(), peak_ln, g, across))
    }

    /// Sum of the terms n, relative to the peak, up to the first that is too small to count.
    fn shares(self, n: impl Iterator<Item = u32>, peak_ln: f64, g: f64, across: f64) -> f64 {
        let shares_ln = n.map(|n| self.term_ln(n, g, across) - peak_ln);
        shares_ln.take_while(|share_ln| *share_ln > LEAST_TERM_LN).map(f64::exp).sum()
    }

    /// ln of the term n of the series.
    fn term_ln(self, n: u32, g: f64, across: f64) -> f64 {
        let n_real = f64::from(n);
        n_real * g.ln() - g - ln_factorial(n) + self.spectrum_ln(n_real, across)
    }

    /// ln(W_n/l²).
    fn spectrum_ln(self, n: f64, across: f64) -> f64 {
        match self {
            Correlation::Gaussian => (PI / n).ln() - across * across / (4.0 * n),
            Correlation::Exponential => (TAU * n).ln() - 1.5 * (n * n + across * across).ln(),
        }
    }
}

/// The first n ≥ 1 from which `falls` holds, for a condition that stays true once it is.
fn first_fall(falls: impl Fn(u32) -> bool) -> u32 {
    let mut high = 1;
    while !falls(high) && high < 1 << 30 {
        high *= 2;
    }
    let mut low = high / 2;
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if falls(middle) { high = middle } else { low = middle }
    }
    high
}

/// ln n!: a product for small n, else Stirling's series, good to 1e-13.
fn ln_factorial(n: u32) -> f64 {
    if n < 16 {
        return (1..=n).map(f64::from).product::<f64>().ln();
    }
    let x = f64::from(n);
    let inverse = 1.0 / x;
    let tail = inverse * (1.0 / 12.0 - inverse.powi(2) * (1.0 / 360.0 - inverse.powi(2) / 1260.0));
    x * x.ln() - x + 0.5 * (TAU * x).ln() + tail
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::brdf::{Fresnel, KirchhoffGo};
    use crate::units::db_from_ratio;

    fn rough(rms_height_m: f64, correlation_length_m: f64) -> Kirchhoff {
        Kirchhoff {
            rms_height_m,
            correlation_length_m,
            correlation: Correlation::Gaussian,
            eps_real: 4.67,
            eps_imag: 5.0,
            frequency_hz: 300e9,
            lobe_rad: 0.02,
        }
    }

    fn retro(theta_rad: f64) -> Direction<Surface> {
        Direction::from_angles(theta_rad, 0.0)
    }

    #[test]
    fn factorials_are_exact() {
        let mut expected = 0.0;
        for n in 1..200 {
            expected += f64::from(n).ln();
            assert!((ln_factorial(n) - expected).abs() < 1e-12 * expected.max(1.0), "{n}");
        }
    }

    #[test]
    fn the_series_is_the_plain_sum_where_that_can_be_taken() {
        for correlation in [Correlation::Gaussian, Correlation::Exponential] {
            for g in [1e-6f64, 0.1, 1.0, 7.0, 40.0] {
                for across in [0.0, 0.5, 3.0, 12.0] {
                    let (mut weight, mut plain) = ((-g).exp(), 0.0);
                    for n in 1..400 {
                        weight *= g / f64::from(n);
                        plain += weight * correlation.spectrum_ln(f64::from(n), across).exp();
                    }
                    let found = correlation.series(g, across);
                    assert!((found - plain).abs() < 1e-11 * plain, "{correlation:?} {g} {across}");
                }
            }
        }
    }

    /// How far the series is from the rays' limit, dB, over backscatter angles up to twice the slope.
    fn worst_db(rms_height_m: f64, slope: f64) -> f64 {
        let series = rough(rms_height_m, 2f64.sqrt() * rms_height_m / slope);
        let rays = KirchhoffGo { rms_slope: slope, eps_real: 4.67, eps_imag: 5.0 };
        let apart = |step: i32| {
            let theta_rad = (2.0 * slope).atan() * f64::from(step) / 20.0;
            let direction = retro(theta_rad);
            let f = series.incoherent_per_sr(direction, direction);
            db_from_ratio(f / rays.retro_per_sr(theta_rad)).abs()
        };
        (0..=20).map(apart).fold(0.0, f64::max)
    }

    #[test]
    fn the_series_tends_to_geometric_optics() {
        // k·s = 3, 6 and 12.
        let apart = [0.477e-3, 0.955e-3, 1.91e-3].map(|s_m| worst_db(s_m, 0.2));
        assert!(apart[0] < 0.5 && apart.is_sorted_by(|a, b| a > b), "{apart:?}");
    }

    #[test]
    fn heights_take_from_the_mirror_what_the_facts_say() {
        for (s_um, loss_db) in [(5.0, 0.02), (20.0, 0.27), (50.0, 1.7), (100.0, 6.9)] {
            let found = rough(s_um * 1e-6, 1e-3).coherent_per_sr(retro(0.0), retro(0.0))
                / rough(0.0, 1e-3).coherent_per_sr(retro(0.0), retro(0.0));
            let found_db = -db_from_ratio(found);
            assert!((found_db - loss_db).abs() < 0.05, "{s_um} µm: {found_db} dB");
        }
        let oblique = (60f64.to_radians(), 50e-6);
        let tilted = (-(wavenumber_rad_per_m(300e9) * oblique.1).powi(2)).exp();
        let wide = |s_m| Kirchhoff { lobe_rad: 0.5, ..rough(s_m, 1e-3) };
        let direction = retro(oblique.0);
        let found = wide(oblique.1).coherent_per_sr(direction, direction)
            / wide(0.0).coherent_per_sr(direction, direction);
        assert!((found - tilted).abs() < 1e-12);
    }

    #[test]
    fn a_flat_surface_is_the_mirror() {
        let mirror = Fresnel { eps_real: 4.67, eps_imag: 5.0, lobe_rad: 0.02 };
        for theta_rad in [0.0, 0.01, 0.05] {
            let expected = mirror.retro_per_sr(theta_rad);
            assert_eq!(rough(0.0, 1e-3).retro_per_sr(theta_rad), expected);
            let nearly = rough(1e-9, 1e-3).retro_per_sr(theta_rad);
            assert!((nearly - expected).abs() < 1e-6 * expected);
        }
    }

    #[test]
    fn the_roughest_surface_stays_finite() {
        for correlation in [Correlation::Gaussian, Correlation::Exponential] {
            let model = Kirchhoff { correlation, frequency_hz: 1e12, ..rough(2e-3, 0.1) };
            for theta_rad in [0.0, 0.5, 1.5] {
                let f = model.retro_per_sr(theta_rad);
                assert!(f.is_finite() && f >= 0.0, "{correlation:?} {theta_rad}: {f}");
            }
        }
    }
}
