//! Loops that are compiled once per width of vector instructions, and run at the widest that the processor has.

/// A computation of plain loops over arrays of fixed length, which the compiler turns into vector instructions.
///
/// It must not fuse products with sums (FMA), so that every width gives the same bits.
pub(super) trait Wide {
    /// The result.
    type Answer;

    /// Computes the result. Implementations must be `#[inline(always)]`, or they are compiled for one width only.
    fn run(self) -> Self::Answer;
}

/// Runs a computation with the widest instructions that the processor has.
#[inline]
pub(super) fn widest<W: Wide>(work: W) -> W::Answer {
    #[cfg(target_arch = "x86_64")]
    {
        if at_most_bits() >= 512 && is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has avx512f, the only feature that the function requires.
            return unsafe { x86::of_512_bits(work) };
        }
        if at_most_bits() >= 256 && is_x86_feature_detected!("avx2") {
            // SAFETY: the processor has avx2, the only feature that the function requires.
            return unsafe { x86::of_256_bits(work) };
        }
    }
    work.run()
}

/// The widest instructions that may be used, in bits. Tests lower it to compare the widths.
#[cfg(all(test, target_arch = "x86_64"))]
static AT_MOST_BITS: std::sync::atomic::AtomicU32 = std::sync::atomic::AtomicU32::new(512);

#[cfg(target_arch = "x86_64")]
fn at_most_bits() -> u32 {
    #[cfg(test)]
    return AT_MOST_BITS.load(std::sync::atomic::Ordering::Relaxed);
    #[cfg(not(test))]
    512
}

/// The smaller number, or `b` if `a` is NaN. It is a single instruction, unlike `f32::min`.
#[inline(always)]
pub(super) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger number, or `b` if `a` is NaN. It is a single instruction, unlike `f32::max`.
#[inline(always)]
pub(super) fn most(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::Wide;

    #[target_feature(enable = "avx512f")]
    pub fn of_512_bits<W: Wide>(work: W) -> W::Answer {
        work.run()
    }

    #[target_feature(enable = "avx2")]
    pub fn of_256_bits<W: Wide>(work: W) -> W::Answer {
        work.run()
    }
}

#[cfg(target_arch = "x86_64")]
#[cfg(test)]
mod tests {
    use std::sync::atomic::Ordering;

    use super::*;
    use crate::frames::{Point, Ray};
    use crate::scene::mannequin;
    use crate::trace::{Bvh, Tracer};

    #[test]
    fn every_width_gives_the_same_bits() {
        let body = mannequin::mannequin();
        let origin = Point::new(0.0, 1.1, 8.0);
        let towards = |k: u32| {
            let [x, y] = [k % 120, k / 120].map(|i| 2.2 * (f64::from(i) + 0.3) / 120.0 - 1.1);
            Ray { origin, direction: origin.towards(Point::new(x, y + 1.1, 0.0)).unwrap() }
        };
        let rays: Vec<_> = (0..120 * 120).map(towards).collect();
        let hits = |bits: u32| {
            AT_MOST_BITS.store(bits, Ordering::Relaxed);
            let bvh = Bvh::new(&body);
            let found = [Tracer::Pinhole, Tracer::Bvh].map(|by| by.closest(&bvh, &rays).unwrap());
            AT_MOST_BITS.store(512, Ordering::Relaxed);
            found
        };
        let [plain, of_256, of_512] = [128, 256, 512].map(hits);
        assert!(plain[0].iter().flatten().count() > 1_000);
        assert!(plain == of_256 && plain == of_512);
    }
}
