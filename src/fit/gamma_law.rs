//! The law of a speckled power of mean 1 and L looks, Gamma(L, 1/L), and the probability that it stays below a limit.
//!
//! ln P(L, x), P the regularised lower incomplete gamma function, keeps its digits in the far tail:
//! below x = L + 1 the series ln P = L·ln x − x − ln Γ(L) + ln Σ, above it ln(1 − Q) with Q by
//! Lentz's continued fraction (Numerical Recipes, 3rd ed., §6.2; DLMF 8.7.1 and 8.9.2).

use std::sync::{Arc, Mutex, PoisonError};

use statrs::function::gamma::{digamma, ln_gamma};

use super::table::lagrange;

/// Terms that suffice for L up to 1e4.
const TERMS: usize = 2000;

/// ln P(a, x) for a > 0; −∞ for x ≤ 0.
pub(crate) fn ln_lower_gamma(a: f64, x: f64) -> f64 {
    if x <= 0.0 {
        return f64::NEG_INFINITY;
    }
    let ln_front = a * x.ln() - x - ln_gamma(a);
    if x < a + 1.0 {
        let (mut term, mut sum) = (1.0 / a, 1.0 / a);
        for n in 1..TERMS {
            term *= x / (a + n as f64);
            sum += term;
            if term < sum * f64::EPSILON {
                break;
            }
        }
        return ln_front + sum.ln();
    }
    (-(ln_front.exp() * upper_fraction(a, x)).min(1.0)).ln_1p()
}

/// ln Q(a, x), Q = 1 − P, for a > 0; 0 for x ≤ 0.
fn ln_upper_gamma(a: f64, x: f64) -> f64 {
    if x < a + 1.0 {
        return (-ln_lower_gamma(a, x).exp()).ln_1p();
    }
    a * x.ln() - x - ln_gamma(a) + upper_fraction(a, x).ln()
}

/// Keeps a divisor away from 0.
fn guarded(z: f64) -> f64 {
    if z.abs() < f64::MIN_POSITIVE { f64::MIN_POSITIVE } else { z }
}

/// Γ(a, x)·eˣ/xᵃ by Lentz's continued fraction.
fn upper_fraction(a: f64, x: f64) -> f64 {
    let mut b = x + 1.0 - a;
    let mut c = 1.0 / f64::MIN_POSITIVE;
    let mut d = 1.0 / b;
    let mut value = d;
    for n in 1..TERMS {
        let n = n as f64;
        let an = -n * (n - a);
        b += 2.0;
        d = 1.0 / guarded(an * d + b);
        c = guarded(b + an / c);
        value *= d * c;
        if (d * c - 1.0).abs() < f64::EPSILON {
            break;
        }
    }
    value
}

/// A log probability and its derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct LnProbability {
    /// ln p.
    pub value: f64,
    /// d ln p/d ln μ, μ the mean power.
    pub by_ln_mean: f64,
    /// d ln p/d ln L.
    pub by_ln_looks: f64,
    /// −d² ln p/d(ln μ)² for a detection, the squared slope for a limit; never negative.
    pub bend: f64,
}

/// The law for one number of looks, ready for many chirps.
#[derive(Clone, Debug)]
pub(crate) struct GammaLaw {
    looks: f64,
    ln_constant: f64,
    constant_slope: f64,
    /// √L, at least 1: how much narrower than that of one look the law is in ln power.
    narrowness: f64,
    /// Its tabulated tail; none where each limit is computed by itself.
    below: Option<Arc<[LnProbability]>>,
}

/// The tails of the latest laws by the bits of their looks: a search asks for the same ones over and over.
static TAILS: Mutex<Vec<(u64, Arc<[LnProbability]>)>> = Mutex::new(Vec::new());
/// How many tails are kept.
const MOST_TAILS: usize = 16;

/// ln(limit/mean) of the first knot of the tabulated tail, the step, both times the narrowness, and
/// how many knots there are.
const FIRST: f64 = -14.0;
const STEP: f64 = 1.0 / 32.0;
const KNOTS: usize = 608;
/// ln(limit/mean) times the narrowness from which the power stays below the limit but for a share of 10⁻¹⁵ or less.
const SURE: f64 = 8.0;
/// Step in ln L for the derivative by L.
const LOOKS_STEP: f64 = 1e-4;

impl GammaLaw {
    /// The law of L looks, L > 0, for this number of limits: a table of the tail costs as much as hundreds of them.
    pub fn for_limits(looks: f64, limits: usize) -> GammaLaw {
        GammaLaw::with_tail(looks, |narrowness| {
            (limits > KNOTS / 2).then(|| tail(looks, narrowness))
        })
    }

    /// The law of L looks, L > 0.
    pub fn new(looks: f64) -> GammaLaw {
        GammaLaw::with_tail(looks, |narrowness| Some(tail(looks, narrowness)))
    }

    fn with_tail(looks: f64, tail: impl FnOnce(f64) -> Option<Arc<[LnProbability]>>) -> GammaLaw {
        let narrowness = looks.sqrt().max(1.0);
        GammaLaw {
            looks,
            narrowness,
            ln_constant: looks * looks.ln() - ln_gamma(looks),
            constant_slope: looks * (looks.ln() + 1.0 - digamma(looks)),
            below: tail(narrowness),
        }
    }

    /// The looks.
    pub fn looks(&self) -> f64 {
        self.looks
    }

    /// ln density of a detected power, per unit of ln power.
    pub fn detected(&self, ln_power: f64, ln_mean: f64) -> LnProbability {
        let ln_ratio = ln_power - ln_mean;
        let ratio = ln_ratio.exp();
        LnProbability {
            value: self.ln_constant + self.looks * (ln_ratio - ratio),
            by_ln_mean: self.looks * (ratio - 1.0),
            by_ln_looks: self.constant_slope + self.looks * (ln_ratio - ratio),
            bend: self.looks * ratio,
        }
    }

    /// ln probability that the power stays below a limit.
    pub fn below(&self, ln_limit: f64, ln_mean: f64) -> LnProbability {
        let ln_ratio = ln_limit - ln_mean;
        if ln_ratio * self.narrowness > SURE {
            return LnProbability::default();
        }
        let x = (ln_ratio * self.narrowness - FIRST) / STEP;
        let inside = (1.0..(KNOTS - 3) as f64).contains(&x);
        let Some(tail) = self.below.as_ref().filter(|_| inside) else {
            return below(self.looks, ln_ratio.clamp(-700.0, 700.0));
        };
        let cell = x as usize;
        let (weights, _) = lagrange(x - cell as f64);
        let mut sum = LnProbability::default();
        for (knot, weight) in tail.iter().skip(cell - 1).zip(weights) {
            sum.value += weight * knot.value;
            sum.by_ln_mean += weight * knot.by_ln_mean;
            sum.by_ln_looks += weight * knot.by_ln_looks;
        }
        sum.bend = sum.by_ln_mean.powi(2);
        sum
    }

    /// ln probability that the power is at or above a limit.
    pub fn above(&self, ln_limit: f64, ln_mean: f64) -> LnProbability {
        /// Where nearly all powers stay below, their complement is computed by itself.
        const MOST: f64 = 0.9;
        let below = self.below(ln_limit, ln_mean);
        let share = below.value.exp();
        if share > MOST {
            return above(self.looks, (ln_limit - ln_mean).clamp(-700.0, 700.0));
        }
        let odds = share / (1.0 - share);
        let by_ln_mean = -odds * below.by_ln_mean;
        LnProbability {
            value: (-share).ln_1p(),
            by_ln_mean,
            by_ln_looks: -odds * below.by_ln_looks,
            bend: by_ln_mean.powi(2),
        }
    }
}

/// ln of the probability of a power at or above the limit, and its derivatives; `ln_ratio` is ln(limit/mean).
fn above(looks: f64, ln_ratio: f64) -> LnProbability {
    let x = looks * ln_ratio.exp();
    let value = ln_upper_gamma(looks, x);
    // d Q/d ln x = −xᴸe⁻ˣ/Γ(L).
    let ln_density = looks * x.ln() - x - ln_gamma(looks);
    let by_ln_mean = (ln_density - value).exp();
    let more = looks * LOOKS_STEP.exp();
    let by_ln_looks = (ln_upper_gamma(more, more * ln_ratio.exp()) - value) / LOOKS_STEP;
    LnProbability { value, by_ln_mean, by_ln_looks, bend: by_ln_mean.powi(2) }
}

/// The tabulated tail of the law of some looks.
fn tail(looks: f64, narrowness: f64) -> Arc<[LnProbability]> {
    let find = |tails: &[(u64, Arc<[LnProbability]>)]| {
        let kept = tails.iter().find(|(bits, _)| *bits == looks.to_bits());
        kept.map(|(_, tail)| tail.clone())
    };
    if let Some(kept) = find(&TAILS.lock().unwrap_or_else(PoisonError::into_inner)) {
        return kept;
    }
    let ln_ratios = (0..KNOTS).map(|knot| (FIRST + STEP * knot as f64) / narrowness);
    let made: Arc<[LnProbability]> = ln_ratios.map(|ln_ratio| below(looks, ln_ratio)).collect();
    let mut tails = TAILS.lock().unwrap_or_else(PoisonError::into_inner);
    if tails.len() >= MOST_TAILS {
        tails.remove(0);
    }
    tails.push((looks.to_bits(), made.clone()));
    made
}

/// ln of the probability of a power below the limit, and its derivatives; `ln_ratio` is ln(limit/mean).
fn below(looks: f64, ln_ratio: f64) -> LnProbability {
    let x = looks * ln_ratio.exp();
    let value = ln_lower_gamma(looks, x);
    // d P/d ln x = xᴸe⁻ˣ/Γ(L).
    let ln_density = looks * x.ln() - x - ln_gamma(looks);
    let [more, less] = [LOOKS_STEP, -LOOKS_STEP].map(|step| {
        let looks = looks * step.exp();
        ln_lower_gamma(looks, looks * ln_ratio.exp())
    });
    let by_ln_mean = -(ln_density - value).exp();
    LnProbability {
        value,
        by_ln_mean,
        bend: by_ln_mean.powi(2),
        by_ln_looks: (more - less) / (2.0 * LOOKS_STEP),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_looks_have_their_closed_forms() {
        for x in [1e-12, 1e-3, 0.5, 1.0, 2.5, 10.0, 30.0, 600.0f64] {
            let one = (-(-x).exp_m1()).ln();
            assert!((ln_lower_gamma(1.0, x) - one).abs() < 1e-12 * (1.0 + one.abs()), "{x}");
        }
        for x in [0.5, 2.0, 5.0, 20.0f64] {
            let two = (1.0 - (1.0 + x) * (-x).exp()).ln();
            assert!((ln_lower_gamma(2.0, x) - two).abs() < 1e-11, "{x}");
        }
        assert_eq!(ln_lower_gamma(1.0, 0.0), f64::NEG_INFINITY);
    }

    #[test]
    fn a_power_is_above_a_limit_or_below_it() {
        for looks in [0.5, 1.0, 4.0, 50.0f64] {
            let law = GammaLaw::new(looks);
            for ln_limit in [-6.0, -1.0, -0.1, 0.3, 1.5, 4.0f64] {
                let (above, below) = (law.above(ln_limit, 0.0), law.below(ln_limit, 0.0));
                let sum = above.value.exp() + below.value.exp();
                assert!((sum - 1.0).abs() < 1e-7, "{looks} {ln_limit}: {sum}");
                if looks == 1.0 {
                    assert!((above.value / -ln_limit.exp() - 1.0).abs() < 1e-6, "{ln_limit}");
                    assert!((above.by_ln_mean / ln_limit.exp() - 1.0).abs() < 1e-5, "{ln_limit}");
                }
                const STEP: f64 = 1e-4;
                let [more, less] = [STEP, -STEP].map(|step| law.above(ln_limit, step).value);
                let slope = (more - less) / (2.0 * STEP);
                assert!(
                    (above.by_ln_mean - slope).abs() < 1e-3 * (1e-3 + slope.abs()),
                    "{looks} {ln_limit}"
                );
                let [more, less] = [STEP, -STEP]
                    .map(|step| GammaLaw::new(looks * step.exp()).above(ln_limit, 0.0).value);
                let slope = (more - less) / (2.0 * STEP);
                assert!(
                    (above.by_ln_looks - slope).abs() < 1e-2 * (1e-2 + slope.abs()),
                    "{looks} {ln_limit}"
                );
            }
        }
    }

    #[test]
    fn the_far_tail_is_a_power_and_does_not_underflow() {
        for looks in [0.3, 1.0, 8.0, 200.0f64] {
            let x = 1e-200f64;
            let expected = looks * x.ln() - ln_gamma(looks + 1.0);
            let found = ln_lower_gamma(looks, x);
            assert!((found / expected - 1.0).abs() < 1e-12, "{looks}: {found}");
        }
    }

    #[test]
    fn the_table_and_every_derivative_agree_with_differences() {
        for looks in [0.5, 1.0, 4.0, 30.0, 1000.0] {
            let law = GammaLaw::new(looks);
            let anew = GammaLaw::for_limits(looks, 1);
            let up = GammaLaw::new(looks * 1e-4f64.exp());
            let down = GammaLaw::new(looks * (-1e-4f64).exp());
            for ln_ratio in [-9.3, -2.0, -0.11, 0.0, 0.02, 0.7, 2.0] {
                let exact = ln_lower_gamma(looks, looks * f64::exp(ln_ratio));
                let found = law.below(ln_ratio, 0.0);
                let off = (anew.below(ln_ratio, 0.0).value - exact).abs();
                assert!(off <= 1e-9 * (1.0 + exact.abs()), "{looks} {ln_ratio}: {off}");
                assert!(
                    (found.value - exact).abs() < 1e-6 * (1.0 + exact.abs()),
                    "{looks} {ln_ratio}"
                );
                for pick in [GammaLaw::below, GammaLaw::detected] {
                    let here = pick(&law, ln_ratio, 0.0);
                    let by_mean = (pick(&law, ln_ratio, 1e-4).value
                        - pick(&law, ln_ratio, -1e-4).value)
                        / 2e-4;
                    let by_looks =
                        (pick(&up, ln_ratio, 0.0).value - pick(&down, ln_ratio, 0.0).value) / 2e-4;
                    let bound = |x: f64| 1e-4 * (1.0 + x.abs());
                    assert!(
                        (here.by_ln_mean - by_mean).abs() < bound(by_mean),
                        "{looks} {ln_ratio}"
                    );
                    assert!(
                        (here.by_ln_looks - by_looks).abs() < bound(by_looks),
                        "{looks} {ln_ratio}"
                    );
                }
            }
        }
    }
}
