//! Kirchhoff's two limits against each other, and its series against the integral it sums.

use std::f64::consts::{PI, SQRT_2, TAU};

use matdb::brdf::{Correlation, Kirchhoff, KirchhoffGo, Scattering};
use matdb::frames::{Direction, Surface};

use super::page::{Row, Section, Table, Tolerance::Below, Tolerance::Within};
use super::quadrature::points;

/// k at 300 GHz, rad/m.
const K_RAD_PER_M: f64 = TAU * 300e9 / 299_792_458.0;

/// A mirror at every angle: ε < 0 reflects all.
const MIRROR: f64 = -5.0;

/// Series and integral are both exact but for rounding and quadrature.
const SERIES: f64 = 1e-8;

/// The first term that the rays leave out is of the order 1/g, g = (2kh·cos θ)², times a polynomial of
/// tan²θ over the mean square slope. So the difference is A/(kh)², and A is 3 dB here.
const RAYS_DB: f64 = 3.0;

/// Rounding of an exponential.
const COHERENT: f64 = 1e-12;

/// Orders differ from whole numbers by the next term of the expansion.
const ORDER_SCATTER: f64 = 0.1;

fn rough(kh: f64, correlation_length_m: f64, correlation: Correlation) -> Kirchhoff {
    Kirchhoff {
        rms_height_m: kh / K_RAD_PER_M,
        correlation_length_m,
        correlation,
        eps_real: MIRROR,
        eps_imag: 0.0,
        frequency_hz: 300e9,
        lobe_rad: Some(0.5),
    }
}

fn at(theta_rad: f64) -> Direction<Surface> {
    Direction::from_angles(theta_rad, 0.0)
}

fn incoherent_per_sr(model: &Kirchhoff, theta_rad: f64) -> f64 {
    model.incoherent_per_sr(at(theta_rad), at(theta_rad))
}

/// Bessel's J0 as the mean of cos(z·sin t).
fn bessel_j0(z: f64) -> f64 {
    const STEPS: u32 = 256;
    let cosine = |n: u32| (z * (PI * (f64::from(n) + 0.5) / f64::from(STEPS)).sin()).cos();
    (0..STEPS).map(cosine).sum::<f64>() / f64::from(STEPS)
}

/// f in backscatter from ∫(e^{−g(1−ρ)} − e^{−g})·J0(q_t·r)·2πr dr over the correlation ρ(r).
fn by_integral_per_sr(model: &Kirchhoff, theta_rad: f64) -> f64 {
    let (sin, cos) = theta_rad.sin_cos();
    let g = (2.0 * K_RAD_PER_M * cos * model.rms_height_m).powi(2);
    let length_m = model.correlation_length_m;
    let (rho, reach): (fn(f64) -> f64, f64) = match model.correlation {
        Correlation::Gaussian => (|x| (-x * x).exp(), 7.0),
        Correlation::Exponential => (|x| (-x).exp(), 40.0),
    };
    let edges: Vec<f64> = (0..=80).map(|edge| reach * f64::from(edge) / 80.0).collect();
    let integrand = |x: f64| {
        let wave = bessel_j0(2.0 * K_RAD_PER_M * sin * length_m * x);
        (-g).exp() * (g * rho(x)).exp_m1() * wave * TAU * x
    };
    let sum: f64 = points(8, &edges).into_iter().map(|(x, weight)| weight * integrand(x)).sum();
    // σ⁰ = q⁴/(4π·q_z²)·∫ with q = 2k, and f = σ⁰/(4π·cos²θ).
    let factor = (2.0 * K_RAD_PER_M / cos).powi(2) / (4.0 * PI);
    factor * sum * length_m * length_m / (4.0 * PI * cos * cos)
}

/// Worst relative difference of series and integral over kh and angles up to 30°.
fn series_error(correlation: Correlation) -> f64 {
    let mut worst: f64 = 0.0;
    for kh in [0.1, 0.5, 1.5] {
        let model = rough(kh, 1e-3, correlation);
        for theta_rad in [0.0, 10.0, 30.0].map(f64::to_radians) {
            let ratio =
                incoherent_per_sr(&model, theta_rad) / by_integral_per_sr(&model, theta_rad);
            worst = worst.max((ratio - 1.0).abs());
        }
    }
    worst
}

/// Worst difference of waves and rays up to 30°, dB.
fn rays_error_db(kh: f64, rms_slope: f64) -> f64 {
    let length_m = SQRT_2 * kh / K_RAD_PER_M / rms_slope;
    let waves = rough(kh, length_m, Correlation::Gaussian);
    let rays = KirchhoffGo { rms_slope, eps_real: MIRROR, eps_imag: 0.0 };
    let error_db = |deg: i32| {
        let theta_rad = f64::from(deg).to_radians();
        10.0 * (incoherent_per_sr(&waves, theta_rad) / rays.retro_per_sr(theta_rad)).log10().abs()
    };
    (0..=30).map(error_db).fold(0.0, f64::max)
}

fn rays_rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for rms_slope in [0.2, 0.4] {
        let heights = [1.5, 3.0, 6.0, 12.0];
        let errors_db = heights.map(|kh| rays_error_db(kh, rms_slope));
        for (kh, error_db) in std::iter::zip(heights, errors_db) {
            let what = format!("slope {rms_slope}, kh = {kh}: worst difference up to 30°");
            let allowed_db = (RAYS_DB / (kh * kh) * 1e4).round() / 1e4;
            rows.push(Row::new(what, error_db, Below(allowed_db)).unit("dB"));
        }
        let what = format!("slope {rms_slope}: order in 1/kh, from 6 to 12");
        let order = (errors_db[2] / errors_db[3]).log2();
        rows.push(Row::new(what, order, Within(2.0 - ORDER_SCATTER, 2.0 + ORDER_SCATTER)));
    }
    rows
}

/// Worst relative difference of the coherent part from exp(−(2kh·cos θ)²).
fn coherent_error() -> f64 {
    let mut worst: f64 = 0.0;
    let flat = rough(0.0, 1e-3, Correlation::Gaussian);
    for kh in [0.1f64, 0.5, 1.0, 2.0] {
        let model = rough(kh, 1e-3, Correlation::Gaussian);
        for theta_rad in [0.0f64, 20.0, 40.0, 60.0].map(f64::to_radians) {
            let direction = at(theta_rad);
            let kept = model.coherent_per_sr(direction, direction)
                / flat.coherent_per_sr(direction, direction);
            let expected = (-(2.0 * kh * theta_rad.cos()).powi(2)).exp();
            worst = worst.max((kept / expected - 1.0).abs());
        }
    }
    worst
}

/// Order of the diffuse part in h, for a hundredth of a radian.
fn incoherent_order(correlation: Correlation) -> f64 {
    let level = |kh| incoherent_per_sr(&rough(kh, 1e-3, correlation), 0.3);
    (level(0.02) / level(0.01)).log2()
}

pub fn section() -> Section {
    let laws = [Correlation::Gaussian, Correlation::Exponential];
    let series = laws.map(|law| {
        let what = format!("{law:?} correlation: worst relative difference");
        Row::new(what, series_error(law), Below(SERIES))
    });
    let mut smooth = vec![Row::new(
        "coherent part against exp(−(2kh·cos θ)²), kh = 0.1 to 2, up to 60°: worst relative difference",
        coherent_error(),
        Below(COHERENT),
    )];
    smooth.extend(laws.map(|law| {
        let what =
            format!("{law:?} correlation: order of the diffuse part in h, kh = 0.01 to 0.02");
        let near = Within(2.0 - ORDER_SCATTER, 2.0 + ORDER_SCATTER);
        Row::new(what, incoherent_order(law), near).digits(3)
    }));
    let table = |text: &str, rows| Table { text: text.to_owned(), rows };
    let tables = vec![
        table(
            "The series of `kirchhoff` against the integral over the correlation that it sums, in backscatter at 0°, 10° \
             and 30°, kh = 0.1, 0.5 and 1.5, l = 1 mm. Both are exact except for rounding and quadrature.",
            series.into(),
        ),
        table(
            "Rough: `kirchhoff` with Gaussian correlation against `kirchhoff-go` with the rms slope √2·h/l. The geometric limit omits a term of the order 1/(2kh)², so the difference in dB falls as A/(kh)²; A \
             = 3 dB is tolerated.",
            rays_rows(),
        ),
        table(
            "Smooth: the specular part keeps exp(−(2kh·cos θ)²) of its power, and the diffuse part grows as h².",
            smooth,
        ),
    ];
    let not_covered = vec![
        "Kirchhoff's theory itself against an exact solution of a rough surface, and shadowing and second bounces on it.",
    ];
    Section { title: "Kirchhoff's limits", tables, not_covered }
}
