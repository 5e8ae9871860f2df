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
//! The theory asks for k·l ≥ 6, and for Gaussian correlation for a radius of curvature beyond λ (l² ≥ 2.76·s·λ) and an
//! rms slope of 0.25 at most (`conditions`); exponential correlation has no
//! curvature, and its results are a convention of the field. There is no shadowing: a metal
//! with s = 0.3 mm, l = 2 mm reflects at most what it receives up to 60°, but at 75° 1.04 (Gaussian) to
//! 1.40 (exponential) times that. Rough exponential surfaces lose up to half at normal incidence.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};
use std::f64::consts::{PI, SQRT_2, TAU};

use crate::brdf::backscatter::UNSEEN;
use crate::brdf::kind::{Key, Kind};
use crate::brdf::parameter::{Visitor, visit_quantity};
use crate::brdf::permittivity::{
    EPS_IMAG, EPS_REAL, default_frequency_hz, fresnel_reflectance, half_space_amplitudes,
    is_narrow, mirror_cosine, mirror_lobe_per_sr, narrow_mirror, permittivity, visit_lobe,
    visit_permittivity, wavenumber_rad_per_m,
};
use crate::brdf::scattering::{NarrowLobe, Scattering, ScatteringModel, Seen};
use crate::brdf::slopes::over_exponential;
use crate::brdf::validity::{Bound, Condition, ULABY, kirchhoff_conditions, length_condition};
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
        Key::number("lobe_rad").optional(),
    ],
    starts: &[(
        "kirchhoff",
        r#"{"model": "kirchhoff", "rms_height_m": 5e-5, "correlation_length_m": 5e-4, "eps_real": 3,
            "lobe_rad": 0.02}"#,
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
    /// Width of the mirror's lobe as the radar sees it, 0.001 to 0.5 rad, the beam included; absent for a smooth
    /// mirror, whose lobe is the beam's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub lobe_rad: Option<f64>,
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
        self.incoherent_seen_by(0.0, i, o)
    }

    /// The diffuse part of f, 1/sr, as a beam of a divergence, rad, sees it: the beam adds (q_z·δ)²/4 to n/l².
    fn incoherent_seen_by(
        &self,
        beam_rad: f64,
        i: Direction<Surface>,
        o: Direction<Surface>,
    ) -> f64 {
        let k_rad_per_m = wavenumber_rad_per_m(self.frequency_hz);
        let q = (i.xyz() + o.xyz()) * k_rad_per_m;
        let across = q.truncate().length() * self.correlation_length_m;
        let beam = (0.5 * q.z * beam_rad * self.correlation_length_m).powi(2);
        let spectrum_m2 = self.correlation_length_m.powi(2)
            * self.correlation.series((q.z * self.rms_height_m).powi(2), across, beam);
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
        let q_z = wavenumber_rad_per_m(self.frequency_hz) * (i.cos_theta() + o.cos_theta());
        let kept = (-(q_z * self.rms_height_m).powi(2)).exp();
        let reflectance = |cos| fresnel_reflectance(self.eps(), cos);
        kept * mirror_lobe_per_sr(i, o, self.lobe_rad, beam_rad, reflectance)
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
        let f_per_sr = self.incoherent_seen_by(beam_rad, i, o) + coherent_per_sr;
        let coherent_share = if f_per_sr > 0.0 { coherent_per_sr / f_per_sr } else { 0.0 };
        Seen { f_per_sr, specular_share: 1.0, coherent_share }
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        let q_z = 2.0 * wavenumber_rad_per_m(self.frequency_hz) * i.cos_theta();
        let kept = (-(q_z * self.rms_height_m).powi(2)).exp();
        narrow_mirror(self.lobe_rad, kept * fresnel_reflectance(self.eps(), i.cos_theta()))
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        if !is_narrow(self.lobe_rad) {
            return self.seen_by(0.0, i, o);
        }
        Seen { specular_share: 1.0, ..Seen::diffuse(self.incoherent_per_sr(i, o)) }
    }
}

impl ScatteringModel for Kirchhoff {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        for (name, unit, range, slot) in [
            ("rms_height_m", "m", HEIGHT_RANGE_M, &mut self.rms_height_m),
            ("correlation_length_m", "m", LENGTH_RANGE_M, &mut self.correlation_length_m),
            ("frequency_hz", "Hz", FREQUENCY_RANGE_HZ, &mut self.frequency_hz),
        ] {
            visit_quantity(visitor, prefix, name, unit, range, slot);
        }
        visit_lobe(visitor, prefix, &mut self.lobe_rad);
        visit_permittivity(visitor, prefix, &mut self.eps_real, &mut self.eps_imag);
    }

    fn has_smooth_mirror(&self) -> bool {
        self.lobe_rad.is_none()
    }

    fn permittivity(&self) -> Option<[f64; 2]> {
        Some([self.eps_real, self.eps_imag])
    }

    /// That of its coherent part.
    fn lobe_rad(&self, beam_rad: f64) -> Option<f64> {
        Some(self.lobe_rad.unwrap_or(beam_rad).max(beam_rad))
    }

    /// At its own frequency. Exponential correlation has neither slope nor curvature, so that only its length has
    /// a limit; a flat surface is the mirror, which has none.
    fn conditions(&self, _wavelength_m: f64, _rms_height_m: Option<f64>) -> Vec<Condition> {
        let (s_m, l_m) = (self.rms_height_m, self.correlation_length_m);
        let wavelength_m = TAU / wavenumber_rad_per_m(self.frequency_hz);
        if s_m == 0.0 {
            return Vec::new();
        }
        if self.correlation == Correlation::Exponential {
            return vec![length_condition(KIND.name, wavelength_m, l_m)];
        }
        let mut conditions = kirchhoff_conditions(KIND.name, wavelength_m, s_m, l_m).to_vec();
        conditions.push(Condition {
            model: KIND.name,
            quantity: "the rms slope √2·s/l",
            unit: "1",
            value: SQRT_2 * s_m / l_m,
            bound: Bound::AtMost,
            limit: 0.25,
            source: ULABY,
        });
        conditions
    }
}

/// Terms below this share of the largest are left out.
const LEAST_TERM: f64 = 4e-18;

impl Correlation {
    /// e^{−g} Σ gⁿ/n! · W_n/l², `across` being q_t·l and `beam` (q_z·δ·l/2)².
    ///
    /// The terms rise to one maximum and fall from there. They are taken relative to the largest, whose
    /// logarithm is known, so that neither gⁿ nor n! nor e^{−g} can overflow or vanish on the way.
    fn series(self, g: f64, across: f64, beam: f64) -> f64 {
        if g <= 0.0 {
            return 0.0;
        }
        // ln of the term n of the series.
        let ln_g = g.ln();
        let term_ln = |n: u32| {
            let n_real = f64::from(n);
            n_real * ln_g - g - ln_factorial(n) + self.spectrum_ln(n_real, across, beam)
        };
        let peak = first_fall(|n| {
            let n = f64::from(n);
            // Not a number where both vanish.
            let growth = g / (n + 1.0) * self.growth(n, across, beam);
            growth.is_nan() || growth <= 1.0
        });
        let largest = term_ln(peak).exp();
        if largest == 0.0 {
            return 0.0;
        }
        // Each side of the peak up to the first term that is too small to count; gⁿ/n! follows from its neighbour's.
        let peak_real = f64::from(peak);
        let spectrum = self.spectrum_over(self.spectrum_ln(peak_real, across, beam), across, beam);
        let (mut sum, mut weight, mut n) = (1.0, 1.0, peak_real);
        loop {
            n += 1.0;
            weight *= g / n;
            let share = weight * spectrum(n);
            if share.is_nan() || share <= LEAST_TERM {
                break;
            }
            sum += share;
        }
        (weight, n) = (1.0, peak_real);
        while n > 1.0 {
            weight *= n / g;
            n -= 1.0;
            let share = weight * spectrum(n);
            if share.is_nan() || share <= LEAST_TERM {
                break;
            }
            sum += share;
        }
        largest * sum
    }

    /// W_{n+1} over W_n.
    fn growth(self, n: f64, across: f64, beam: f64) -> f64 {
        let across2 = across * across;
        match self {
            Correlation::Gaussian => {
                let [width, next] = [n + beam, n + 1.0 + beam];
                width / next * (0.25 * across2 * (1.0 / width - 1.0 / next)).exp()
            }
            Correlation::Exponential if beam < UNSEEN * (n * n + across2) => {
                let narrower = (n * n + across2) / ((n + 1.0) * (n + 1.0) + across2);
                (n + 1.0) / n * narrower * narrower.sqrt()
            }
            Correlation::Exponential => {
                seen_exponential(n + 1.0, across2, beam) / seen_exponential(n, across2, beam)
            }
        }
    }

    /// W_n over the one whose W_n/l² has this logarithm.
    fn spectrum_over(self, over_ln: f64, across: f64, beam: f64) -> impl Fn(f64) -> f64 {
        let (across2, over) = (across * across, (-over_ln).exp());
        move |n| match self {
            Correlation::Gaussian => {
                let width = n + beam;
                PI / width * (-across2 / (4.0 * width) - over_ln).exp()
            }
            Correlation::Exponential => {
                let square = n * n + across2;
                if beam < UNSEEN * square {
                    return TAU * n / (square * square.sqrt()) * over;
                }
                seen_exponential(n, across2, beam) * over
            }
        }
    }

    /// ln(W_n/l²).
    fn spectrum_ln(self, n: f64, across: f64, beam: f64) -> f64 {
        let across2 = across * across;
        match self {
            Correlation::Gaussian => (PI / (n + beam)).ln() - across2 / (4.0 * (n + beam)),
            Correlation::Exponential if beam < UNSEEN * (n * n + across2) => {
                (TAU * n).ln() - 1.5 * (n * n + across2).ln()
            }
            Correlation::Exponential => seen_exponential(n, across2, beam).ln(),
        }
    }
}

/// W_n/l² of exp(−n·r/l) as a beam sees it: a mixture of Gaussians exp(−v·r²/l²) of v = n²/4t, each with the weight
/// e^{−t}/√(πt), to which the beam adds its own.
fn seen_exponential(n: f64, across2: f64, beam: f64) -> f64 {
    let gaussian = |t: f64| {
        let width = n * n / (4.0 * t) + beam;
        (PI / t).sqrt() / width * (-across2 / (4.0 * width)).exp()
    };
    over_exponential(gaussian)
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
            lobe_rad: Some(0.02),
        }
    }

    fn retro(theta_rad: f64) -> Direction<Surface> {
        Direction::from_angles(theta_rad, 0.0)
    }

    #[test]
    fn the_growth_of_the_spectra_is_that_of_their_logarithms() {
        for correlation in [Correlation::Gaussian, Correlation::Exponential] {
            for across in [0.0, 3.0, 40.0] {
                for beam in [0.0, 1e-6, 2.0, 300.0] {
                    for n in [1.0, 2.0, 17.0, 400.0] {
                        let ln = |n| correlation.spectrum_ln(n, across, beam);
                        let (found, expected) =
                            (correlation.growth(n, across, beam), (ln(n + 1.0) - ln(n)).exp());
                        let error = (found / expected - 1.0).abs();
                        assert!(error < 1e-6, "{correlation:?} {across} {beam} {n}: {error}");
                        let over = correlation.spectrum_over(ln(n), across, beam);
                        let error = (over(n + 1.0) / expected - 1.0).abs();
                        assert!(error < 1e-6, "{correlation:?} {across} {beam} {n}: {error}");
                    }
                }
            }
        }
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
                        plain += weight * correlation.spectrum_ln(f64::from(n), across, 0.0).exp();
                    }
                    let found = correlation.series(g, across, 0.0);
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
        let wide = |s_m| Kirchhoff { lobe_rad: Some(0.5), ..rough(s_m, 1e-3) };
        let direction = retro(oblique.0);
        let found = wide(oblique.1).coherent_per_sr(direction, direction)
            / wide(0.0).coherent_per_sr(direction, direction);
        assert!((found - tilted).abs() < 1e-12);
    }

    #[test]
    fn a_flat_surface_is_the_mirror() {
        let mirror = Fresnel { eps_real: 4.67, eps_imag: 5.0, lobe_rad: Some(0.02) };
        for theta_rad in [0.0, 0.01, 0.05] {
            let expected = mirror.retro_per_sr(theta_rad);
            assert_eq!(rough(0.0, 1e-3).retro_per_sr(theta_rad), expected);
            let nearly = rough(1e-9, 1e-3).retro_per_sr(theta_rad);
            assert!((nearly - expected).abs() < 1e-6 * expected);
        }
    }

    #[test]
    fn its_conditions_are_those_of_kirchhoff_s_approximation() {
        // k = 6.2875 rad/mm and λ = 0.9993 mm: k·l = 3.144, l²/(s·λ) = 5.003, slope 0.1414.
        let found = rough(50e-6, 0.5e-3).conditions(1.0, None);
        let values = [3.144, 5.003, 0.1414];
        assert_eq!(found.len(), values.len());
        for (condition, value) in std::iter::zip(&found, values) {
            assert!((condition.value / value - 1.0).abs() < 5e-3, "{condition:?}");
        }
        assert_eq!([0, 1, 2].map(|number| found[number].is_met()), [false, true, true]);
        // k·l = 12.6, l²/(s·λ) = 6.67, slope 0.424.
        let steep = rough(0.6e-3, 2e-3).conditions(1.0, None);
        assert_eq!([0, 1, 2].map(|number| steep[number].is_met()), [true, true, false]);
        let exponential = Kirchhoff { correlation: Correlation::Exponential, ..rough(50e-6, 1e-3) };
        let found = exponential.conditions(1.0, None);
        assert!(found.len() == 1 && found[0].is_met(), "{found:?}");
        assert!(rough(0.0, 1e-5).conditions(1.0, None).is_empty());
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
