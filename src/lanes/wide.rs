//! Loops that are compiled once per width of vector instructions, and run at the widest that the processor has.

#![allow(unsafe_code)]

/// A computation of plain loops over arrays of fixed length, which the compiler turns into vector instructions.
///
/// It must not fuse products with sums (FMA), so that every width gives the same bits.
pub(crate) trait Wide {
    /// The result.
    type Answer;

    /// Computes the result. Implementations must be `#[inline(always)]`, or they are compiled for one width only.
    fn run(self) -> Self::Answer;
}

/// Runs a computation with the widest instructions that the processor has.
#[inline]
pub(crate) fn widest<W: Wide>(work: W) -> W::Answer {
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

/// The result of some work with instructions of at most this width, in bits. Such works wait for each other.
#[cfg(test)]
pub(crate) fn at_most<R>(bits: u32, work: impl FnOnce() -> R) -> R {
    static ONE_AT_A_TIME: std::sync::Mutex<()> = std::sync::Mutex::new(());
    let _guard = ONE_AT_A_TIME.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    set_at_most(bits);
    let found = work();
    set_at_most(512);
    found
}

#[cfg(test)]
fn set_at_most(_bits: u32) {
    #[cfg(target_arch = "x86_64")]
    AT_MOST_BITS.store(_bits, std::sync::atomic::Ordering::Relaxed);
}

/// The smaller number, or `b` if `a` is NaN. It is a single instruction, unlike `f32::min`.
#[inline(always)]
pub(crate) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The larger number, or `b` if `a` is NaN. It is a single instruction, unlike `f32::max`.
#[inline(always)]
pub(crate) fn most(a: f32, b: f32) -> f32 {
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
