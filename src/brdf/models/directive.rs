//! The directive model of effective roughness, Degli-Esposti et al., IEEE Trans. Antennas Propag. 55
//! (2007) 143, doi 10.1109/TAP.2006.888422: a share S² of the incident power leaves in a lobe about
//! the mirror direction, and, in the form with two lobes, another about the way back.
//!
//! L = Λ·((1 + cos ψ_R)/2)^α_R + (1 − Λ)·((1 + cos ψ_i)/2)^α_i, f = S²·L/(F·cos θ),
//! F(θ_i) = ∫ L dω over the upper half space; ψ_R is the angle from o to the mirror direction, ψ_i
//! from o to i. As published, F·cos θ is F(θ_i)·cos θ_o, which keeps energy exactly (∫ f cos θ_o dω_o
//! = S²) but is not reciprocal. Here it is the larger of F(θ_i)·cos θ_o and F(θ_o)·cos θ_i: the same
//! wherever θ_o = θ_i, hence in backscatter and in the mirror direction; reciprocal; and never above S². What it reflects in all
//! is 0.62 to 0.96 of S², least for broad lobes at normal incidence.
//!
//! Plausible at 300 GHz, but assumed and not measured: S = 0.05–0.6; α from 1 (broad) to 200 (half power
//! at 7° from the axis); Λ = 0.5–1 where there is a lobe back. F is published for
//! whole α as a finite sum; here it is an integral and α is any number from 1.
//!
//! A lobe is near exp(−α·ψ²/4), whose facets have m² = 1/α; a beam adds δ² to it, 0.1 dB at α = 200 and
//! δ = 0.0117 rad.

use std::array::from_fn;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use std::sync::LazyLock;

use serde::{Deserialize, Serialize};

use crate::brdf::backscatter::seen_cosines;
use crate::brdf::kind::{Key, Kind};
use crate::brdf::parameter::{Visitor, visit_number};
use crate::brdf::scattering::{Scattering, ScatteringModel, Seen};
use crate::frames::{Direction, Surface};
use crate::lanes::{Wide, exp, ln, widest};

pub(super) const KIND: Kind = Kind {
    name: "directive",
    keys: &[
        Key::number("s"),
        Key::number("alpha_r"),
        Key::number("lambda"),
        Key::number("alpha_i"),
    ],
    starts: &[(
        "directive",
        r#"{"model": "directive", "s": 0.3, "alpha_r": 4, "lambda": 0.5, "alpha_i": 4}"#,
    )],
};

/// Diffuse scattering in a lobe about the mirror direction and one about the way back.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Directive {
    /// Scattered amplitude over the incident one S, 0 to 1.
    pub s: f64,
    /// Narrowness of the lobe about the mirror direction α_R, 1 to 200.
    pub alpha_r: f64,
    /// Share of that lobe Λ, 0 to 1; 1 leaves no lobe back.
    #[serde(default = "one")]
    pub lambda: f64,
    /// Narrowness of the lobe back α_i, 1 to 200.
    #[serde(default = "one")]
    pub alpha_i: f64,
}

fn one() -> f64 {
    1.0
}

const ALPHA_RANGE: (f64, f64) = (1.0, 200.0);

impl Directive {
    /// L, 1 at most, as a beam of a divergence, rad, sees it.
    fn lobes(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        let back = i.xyz().dot(o.xyz());
        let mirror = 2.0 * i.cos_theta() * o.cos_theta() - back;
        let forward = seen_lobe(mirror, self.alpha_r, beam_rad);
        self.lambda * forward + (1.0 - self.lambda) * seen_lobe(back, self.alpha_i, beam_rad)
    }

    /// F, sr.
    fn norm_sr(&self, cos_theta: f64) -> f64 {
        if self.lambda == 1.0 {
            return lobe_integrals_sr(cos_theta, [self.alpha_r])[0];
        }
        let [forward, back] = lobe_integrals_sr(cos_theta, [self.alpha_r, self.alpha_i]);
        self.lambda * forward + (1.0 - self.lambda) * back
    }
}

impl Scattering for Directive {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let (cos_i, cos_o) = (i.cos_theta(), o.cos_theta());
        let there = self.norm_sr(cos_i) * cos_o;
        let back = if cos_i == cos_o { there } else { self.norm_sr(cos_o) * cos_i };
        Seen::diffuse(self.s * self.s * self.lobes(beam_rad, i, o) / there.max(back))
    }
}

impl ScatteringModel for Directive {
    fn visit_parameters(&mut self, prefix: &str, visitor: &mut Visitor) {
        visit_number(visitor, prefix, "s", (0.0, 1.0), &mut self.s);
        visit_number(visitor, prefix, "alpha_r", ALPHA_RANGE, &mut self.alpha_r);
        visit_number(visitor, prefix, "lambda", (0.0, 1.0), &mut self.lambda);
        visit_number(visitor, prefix, "alpha_i", ALPHA_RANGE, &mut self.alpha_i);
    }

    /// At the tilt θ of the surface ψ_R is 2θ, and the lobe cos²ᵅθ, about exp(−α·θ²).
    fn lobe_rad(&self, beam_rad: f64) -> Option<f64> {
        (self.lambda > 0.0).then(|| (1.0 / self.alpha_r.sqrt()).hypot(beam_rad))
    }
}

/// The lobe of α as a beam sees it. With ψ = 2θ it is cos²ᵅθ.
fn seen_lobe(cos_psi: f64, alpha: f64, beam_rad: f64) -> f64 {
    let (cosines, share) = seen_cosines(2.0 * alpha, beam_rad);
    share * lobe(cos_psi, 0.5 * cosines)
}

/// ((1 + cos ψ)/2)^α.
fn lobe(cos_psi: f64, alpha: f64) -> f64 {
    ((1.0 + cos_psi) / 2.0).clamp(0.0, 1.0).powf(alpha)
}

/// Steps of Simpson's rule; F is then good to 1e-4 up to α = 20 and θ = 86°, to 5e-3 up to α = 200.
const STEPS: usize = 64;

/// The steps of Simpson's rule over t from −π/2 to π/2, without both ends, where cos t is zero.
struct Steps {
    sin: [f64; STEPS - 1],
    tan: [f64; STEPS - 1],
    /// The rule's weight times cos t.
    weight: [f64; STEPS - 1],
}

static STEP: LazyLock<Steps> = LazyLock::new(|| {
    let width = PI / STEPS as f64;
    let t_rad = |index: usize| (index + 1) as f64 * width - FRAC_PI_2;
    Steps {
        sin: from_fn(|index| t_rad(index).sin()),
        tan: from_fn(|index| t_rad(index).tan()),
        weight: from_fn(|index| {
            let simpson = if index % 2 == 1 { 2.0 / 3.0 } else { 4.0 / 3.0 };
            simpson * width * t_rad(index).cos()
        }),
    }
});

/// ∫ ((1 + cos ψ)/2)^α dω over the upper half space for each α, ψ from an axis at θ to the normal.
///
/// Cones nearer to the axis than the horizon count whole and in closed form. Of the others, with
/// cos ψ = sin θ·sin t, the part π + 2·atan(cos θ·tan t) of the turn lies above the horizon.
fn lobe_integrals_sr<const N: usize>(cos_theta: f64, alphas: [f64; N]) -> [f64; N] {
    let sin_theta = (1.0 - cos_theta * cos_theta).max(0.0).sqrt();
    let mut above = [0.0; STEPS - 1];
    // The turns at t and −t add up to 2π; at t = 0, in the middle, it is π.
    for index in 0..STEPS / 2 {
        let half = 2.0 * (cos_theta * STEP.tan[index]).atan();
        above[index] = STEP.weight[index] * (PI + half);
        above[STEPS - 2 - index] = STEP.weight[index] * (PI - half);
    }
    let cut = widest(Cut { sin_theta, above: &above, alphas });
    from_fn(|lobe| {
        let power = alphas[lobe] + 1.0;
        let whole = 2.0 * TAU / power * (1.0 - ((1.0 + sin_theta) / 2.0).max(0.0).powf(power));
        whole + sin_theta * cut[lobe]
    })
}

/// The sum of Simpson's rule over cones that the horizon cuts, for each α.
struct Cut<'a, const N: usize> {
    sin_theta: f64,
    /// Weight of each step times its turn above the horizon.
    above: &'a [f64; STEPS - 1],
    alphas: [f64; N],
}

impl<const N: usize> Wide for Cut<'_, N> {
    type Answer = [f64; N];

    #[inline(always)]
    fn run(self) -> [f64; N] {
        let mut terms = [[0.0; STEPS - 1]; N];
        let steps = STEP.sin.iter().zip(self.above).enumerate();
        for (index, (sin, above)) in steps {
            let ln_half = ln(0.5 * (1.0 + self.sin_theta * sin));
            for (lobe, alpha) in self.alphas.iter().enumerate() {
                terms[lobe][index] = above * exp(alpha * ln_half);
            }
        }
        terms.map(|terms| terms.iter().sum())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn binomial(n: i32, k: i32) -> f64 {
        (1..=k).map(|j| f64::from(n - k + j) / f64::from(j)).product()
    }

    /// The paper's finite sum for whole α.
    fn published_sr(cos_theta: f64, alpha: i32) -> f64 {
        let sin_theta = (1.0 - cos_theta * cos_theta).sqrt();
        let odd = |j: i32| {
            let term = |w: i32| binomial(2 * w, w) * (sin_theta / 2.0).powi(2 * w);
            cos_theta * (0..=(j - 1) / 2).map(term).sum::<f64>()
        };
        let part = |j: i32| {
            let reduced = if j % 2 == 0 { 1.0 } else { odd(j) };
            binomial(alpha, j) * TAU / f64::from(j + 1) * reduced
        };
        (0..=alpha).map(part).sum::<f64>() / 2f64.powi(alpha)
    }

    #[test]
    fn the_integral_is_the_published_sum_for_whole_exponents() {
        for (alpha, tolerance) in [(1, 1e-4), (2, 1e-4), (5, 1e-4), (20, 1e-4), (50, 1e-3)] {
            for theta_rad in [0.0f64, 0.2, 0.7, 1.2, 1.5] {
                let expected = published_sr(theta_rad.cos(), alpha);
                let [found] = lobe_integrals_sr(theta_rad.cos(), [f64::from(alpha)]);
                let error = found / expected - 1.0;
                assert!(error.abs() < tolerance, "α = {alpha}, θ = {theta_rad}: {error:e}");
            }
        }
    }

    #[test]
    fn backscatter_is_the_published_form() {
        let model = Directive { s: 0.4, alpha_r: 4.0, lambda: 0.7, alpha_i: 6.0 };
        for theta_rad in [0.0f64, 0.5, 1.2] {
            // The mirror direction lies 2θ from the way back: (1 + cos 2θ)/2 = cos²θ.
            let cos = theta_rad.cos();
            let norm_sr = 0.7 * published_sr(cos, 4) + 0.3 * published_sr(cos, 6);
            let expected = 0.16 * (0.7 * cos.powi(8) + 0.3) / (norm_sr * cos);
            assert!((model.retro_per_sr(theta_rad) / expected - 1.0).abs() < 1e-4);
        }
    }
}
