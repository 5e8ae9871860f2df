//! exp and ln without a branch or a call, so that a loop over them becomes vector instructions.
//!
//! exp is within 3·10⁻¹⁶ of the exact value, relative to it, and ln within 4·10⁻¹⁶, relative to the larger of it and 1: tests
//! compare them with the library's over their whole range.

use std::f64::consts::LN_2;

use super::wide::{Wide, widest};

/// 1.5·2⁵²: added to a number below 2⁵¹ it rounds that to a whole number, which its lowest bits then hold.
const ROUNDING: f64 = 6_755_399_441_055_744.0;
/// ln 2 in two parts, the first with so few digits that its product with a whole number below 2¹¹ is exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;
/// Exponents at which exp still is a normal number. Below, it is 0; above, it stays at the last.
const LEAST: f64 = -708.0;
const MOST: f64 = 709.0;

/// 1/n! from n = 2 up to 13: on |r| ≤ ln 2/2 the next term is below 2·10⁻¹⁸.
const INVERSE_FACTORIALS: [f64; 12] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

/// A polynomial of twelve coefficients, the constant one first, in pairs of pairs: a processor computes these side by
/// side (Estrin's scheme).
#[inline(always)]
fn polynomial(x: f64, c: &[f64; 12]) -> f64 {
    let (x2, x4) = (x * x, (x * x) * (x * x));
    let four = |n: usize| (c[n] + c[n + 1] * x) + (c[n + 2] + c[n + 3] * x) * x2;
    four(0) + (four(4) + four(8) * x4) * x4
}

/// eˣ; 0 below x = −708, and e⁷⁰⁹ above 709. NaN stays NaN.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    let within = if x < LEAST { LEAST } else { x };
    let within = if within > MOST { MOST } else { within };
    let rounded = within * std::f64::consts::LOG2_E + ROUNDING;
    let whole = rounded - ROUNDING;
    let r = (within - whole * LN_2_HIGH) - whole * LN_2_LOW;
    let mantissa = 1.0 + (r + r * r * polynomial(r, &INVERSE_FACTORIALS));
    // 2 to the whole number, from the bits of an exponent.
    let power = f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52);
    let value = mantissa * power;
    if x < LEAST { 0.0 } else { value }
}

/// 1/(2n + 1) from n = 1 up to 12: for |s| ≤ 0.172 the next term is below 10⁻²⁰.
const INVERSE_ODD: [f64; 12] = [
    1.0 / 3.0,
    1.0 / 5.0,
    1.0 / 7.0,
    1.0 / 9.0,
    1.0 / 11.0,
    1.0 / 13.0,
    1.0 / 15.0,
    1.0 / 17.0,
    1.0 / 19.0,
    1.0 / 21.0,
    1.0 / 23.0,
    1.0 / 25.0,
];
/// The bits of √½, and of a mantissa.
const ROOT_HALF: u64 = 0x3FE6_A09E_667F_3BCD;
const MANTISSA: u64 = 0x000F_FFFF_FFFF_FFFF;
/// 2⁵², and its bits, which hold a whole number below 2⁵² in their lowest.
const WHOLE: f64 = 4_503_599_627_370_496.0;
const WHOLE_BITS: u64 = 0x4330_0000_0000_0000;

/// ln x of a normal positive number; −∞ for 0 and denormal numbers, NaN below, ∞ for ∞.
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    // x = 2ᵉ·m with m from √½ to √2.
    let shifted = x.to_bits().wrapping_sub(ROOT_HALF).wrapping_add(1023 << 52);
    let exponent = f64::from_bits((shifted >> 52) | WHOLE_BITS) - (WHOLE + 1023.0);
    let m = f64::from_bits((shifted & MANTISSA).wrapping_add(ROOT_HALF));
    let f = m - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    // ln m = 2·artanh s = f − s·(f − 2·z·Σ), which is exact in its first term.
    let ln_m = f - s * (f - 2.0 * z * polynomial(z, &INVERSE_ODD));
    let value = exponent * LN_2_HIGH + (ln_m + exponent * LN_2_LOW);
    let value = if x < f64::MIN_POSITIVE { f64::NEG_INFINITY } else { value };
    let value = if x == f64::INFINITY { x } else { value };
    if x >= 0.0 { value } else { f64::NAN }
}

/// Replaces every number by its [`exp`].
pub(crate) fn exp_all(x: &mut [f64]) {
    widest(Each(x, exp));
}

/// Replaces every number by its [`ln`].
pub(crate) fn ln_all(x: &mut [f64]) {
    widest(Each(x, ln));
}

/// A function of every number.
struct Each<'a, F>(&'a mut [f64], F);

impl<F: Fn(f64) -> f64> Wide for Each<'_, F> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        let Each(x, function) = self;
        for x in x {
            *x = function(*x);
        }
    }
}

const _: () = assert!(LN_2_HIGH + LN_2_LOW == LN_2);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::at_most;

    #[test]
    fn exp_is_that_of_the_library() {
        let mut worst = 0.0f64;
        for step in -1_416_000..=1_418_000 {
            let x = f64::from(step) * 0.000_5 + 1e-7;
            if (LEAST..=MOST).contains(&x) {
                worst = worst.max((exp(x) / x.exp() - 1.0).abs());
            }
        }
        assert!(worst <= 3e-16, "{worst:e}");
        assert_eq!([0.0, -709.0, f64::NEG_INFINITY].map(exp), [1.0, 0.0, 0.0]);
        assert_eq!([710.0, f64::INFINITY].map(exp), [exp(MOST); 2]);
        assert!(exp(f64::NAN).is_nan());
    }

    #[test]
    fn all_at_once_are_the_same_bits() {
        let x: Vec<f64> = (0..1003).map(|k| 1.5 * f64::from(k - 500)).collect();
        for (all, one) in [(exp_all as fn(&mut [f64]), exp as fn(f64) -> f64), (ln_all, ln)] {
            let expected: Vec<u64> = x.iter().map(|x| one(*x).to_bits()).collect();
            for bits in [128, 256, 512] {
                let mut found = x.clone();
                at_most(bits, || all(&mut found));
                // The sign and payload of a NaN are nobody's.
                let same = found.iter().zip(&expected).all(|(found, expected)| {
                    found.to_bits() == *expected
                        || found.is_nan() && f64::from_bits(*expected).is_nan()
                });
                assert!(same, "{bits}");
            }
        }
    }

    #[test]
    fn ln_is_that_of_the_library() {
        let mut worst = 0.0f64;
        for exponent in -1022..=1023 {
            for step in 0..997 {
                let mantissa = 1.0 + f64::from(step) / 997.0;
                let x = mantissa * f64::powi(2.0, exponent);
                worst = worst.max((ln(x) - x.ln()).abs() / x.ln().abs().max(1.0));
            }
        }
        // Near 1 the value itself is small, and as exact.
        for step in -100_000..100_000 {
            let x = 1.0 + f64::from(step) * 1e-6;
            worst = worst.max((ln(x) - x.ln()).abs() / x.ln().abs().max(f64::MIN_POSITIVE));
        }
        assert!(worst <= 4e-16, "{worst:e}");
        assert_eq!([1.0, 0.0, -0.0, f64::INFINITY].map(ln)[0], 0.0);
        assert_eq!([0.0, 1e-310].map(ln), [f64::NEG_INFINITY; 2]);
        assert_eq!(ln(f64::INFINITY), f64::INFINITY);
        assert!([-1.0, f64::NEG_INFINITY, f64::NAN].into_iter().all(|x| ln(x).is_nan()));
    }
}
