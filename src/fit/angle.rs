//! Distribution of the true angle of incidence, given a measured one and the errors of the normal's two tilts.
//!
//! With independent tilt errors of standard deviation s in both directions and a measured angle θ,
//! the true tilt is (θ + a, b), a and b normal, and the true angle t = √((θ + a)² + b²) follows Rice's
//! law, p(t) = t/s²·exp(−(t² + θ²)/2s²)·I₀(tθ/s²): one integral instead of two. Near normal
//! incidence this is far from a bell around θ: at θ = 0 the mean of t is 1.25·s.
//!
//! The nodes must resolve Rice's law and what it is multiplied by. On the flank of a specular lobe
//! ln σ⁰ falls by 70 nepers per rad (m = 0.07), and L looks of speckle scatter by about 1/√L nepers: for
//! 8 looks the likelihood of a power is a bell of 0.3° over the angle, however large s is. Away from the
//! lobe σ⁰ is smooth.

/// Nodes are a third of s apart, but near normal incidence no more than this, rad: 0.3°.
const APART_RAD: f64 = 5.236e-3;
/// Away from normal incidence this share of the smallest angle is added.
const APART_SHARE: f64 = 1.0 / 40.0;
/// Most nodes for each chirp; errors of up to 3.6° need no more.
const MOST_NODES: usize = 96;
/// Nodes reach this many s to either side of the measured angle.
const REACH: f64 = 4.0;

/// True angles, rad, and their weights, which sum to 1; the measured angle alone where it is exact.
pub(super) fn true_angles(theta_rad: f64, sd_rad: f64) -> Vec<(f64, f64)> {
    let low = (theta_rad - REACH * sd_rad).max(0.0);
    nodes(theta_rad, sd_rad, (sd_rad / 3.0).min(APART_RAD + APART_SHARE * low))
}

/// The same for a likelihood that only ranks laws: one standard deviation apart.
pub(super) fn coarse_angles(theta_rad: f64, sd_rad: f64) -> Vec<(f64, f64)> {
    nodes(theta_rad, sd_rad, sd_rad)
}

fn nodes(theta_rad: f64, sd_rad: f64, apart_rad: f64) -> Vec<(f64, f64)> {
    if sd_rad <= 0.0 {
        return vec![(theta_rad, 1.0)];
    }
    let low = (theta_rad - REACH * sd_rad).max(0.0);
    let reach = theta_rad + REACH * sd_rad - low;
    let count = ((reach / apart_rad).ceil() as usize).clamp(1, MOST_NODES);
    let width = reach / count as f64;
    let mut nodes = Vec::with_capacity(count);
    for index in 0..count {
        let t = low + (index as f64 + 0.5) * width;
        nodes.push((t, rice(t / sd_rad, theta_rad / sd_rad)));
    }
    let sum: f64 = nodes.iter().map(|(_, weight)| weight).sum();
    nodes.into_iter().map(|(t, weight)| (t, weight / sum)).collect()
}

/// Rice's density of t for a measured angle, both in standard deviations.
fn rice(t: f64, theta: f64) -> f64 {
    t * (-0.5 * (t - theta).powi(2)).exp() * bessel_i0_scaled(t * theta)
}

/// e⁻ˣ·I₀(x) for x ≥ 0 to 2e-7 (Abramowitz and Stegun 9.8.1 and 9.8.2).
fn bessel_i0_scaled(x: f64) -> f64 {
    const SMALL: [f64; 7] =
        [1.0, 3.515_622_9, 3.089_942_4, 1.206_749_2, 0.265_973_2, 0.036_076_8, 0.004_581_3];
    const LARGE: [f64; 9] = [
        0.398_942_28,
        0.013_285_92,
        0.002_253_19,
        -0.001_575_65,
        0.009_162_81,
        -0.020_577_06,
        0.026_355_37,
        -0.016_476_33,
        0.003_923_77,
    ];
    if x < 3.75 {
        return (-x).exp() * polynomial(&SMALL, (x / 3.75).powi(2));
    }
    polynomial(&LARGE, 3.75 / x) / x.sqrt()
}

/// Σ term_n·yⁿ by Horner's scheme.
fn polynomial(terms: &[f64], y: f64) -> f64 {
    terms.iter().rev().fold(0.0, |sum, term| sum * y + term)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::radar::random::{Key, Purpose};

    /// Mean of a lobe over the two tilts, by brute force.
    fn drawn(theta: f64, sd: f64, lobe: impl Fn(f64) -> f64) -> f64 {
        const COUNT: usize = 200_000;
        let mut draws = Key { seed: 3, chirp: 0, sub_ray: 0, purpose: Purpose::Fit }.draws();
        let mut one = || {
            let tilt = draws.complex_gaussian() * std::f64::consts::SQRT_2 * sd;
            lobe((theta + tilt.re).hypot(tilt.im))
        };
        (0..COUNT).map(|_| one()).sum::<f64>() / COUNT as f64
    }

    #[test]
    fn a_lobe_averages_as_over_the_two_tilts() {
        let lobe = |t: f64| (-(t / 0.05).powi(2)).exp();
        for (theta, sd) in [(0.0, 0.02), (0.01, 0.035), (0.05, 0.02), (0.1, 0.035)] {
            let quadrature: f64 =
                true_angles(theta, sd).iter().map(|(t, weight)| weight * lobe(*t)).sum();
            // Gaussian times Gaussian, in closed form: w = 1/(1 + 2s²/m²), w·exp(−wθ²/m²).
            let w = 1.0 / (1.0 + 2.0 * (sd / 0.05f64).powi(2));
            let exact = w * (-w * (theta / 0.05f64).powi(2)).exp();
            assert!((quadrature / exact - 1.0).abs() < 5e-3, "{theta} {sd}: {quadrature} {exact}");
            // 200 000 draws of a number from 0 to 1.
            assert!((drawn(theta, sd, lobe) - exact).abs() < 5.0 * 0.5 / 200_000f64.sqrt());
        }
    }

    #[test]
    fn the_narrow_bell_that_many_looks_make_is_resolved() {
        const BELL_RAD: f64 = 5e-3;
        let (theta, sd) = (0.1, 3f64.to_radians());
        for centre in [0.07, 0.0712, 0.0725, 0.0737, 0.12] {
            let bell = |t: f64| (-0.5 * ((t - centre) / BELL_RAD).powi(2)).exp();
            let found: f64 = true_angles(theta, sd).iter().map(|(t, w)| w * bell(*t)).sum();
            let dense = (0..40_000).map(|i| (f64::from(i) + 0.5) * 1e-5);
            let exact: f64 = dense.map(|t| rice(t / sd, theta / sd) / sd * bell(t) * 1e-5).sum();
            // The bell is about as wide as the nodes are apart.
            assert!((found / exact - 1.0).abs() < 1e-3, "{centre}: {found} {exact}");
        }
    }

    #[test]
    fn at_normal_incidence_the_angle_is_rayleighs() {
        let mean: f64 = true_angles(0.0, 0.02).iter().map(|(t, weight)| t * weight).sum();
        // Nodes a third of s apart, where the density begins with a kink.
        assert!((mean / 0.02 / (std::f64::consts::PI / 2.0).sqrt() - 1.0).abs() < 5e-3, "{mean}");
    }

    #[test]
    fn an_exact_angle_is_one_node() {
        assert_eq!(true_angles(0.3, 0.0), [(0.3, 1.0)]);
    }
}
