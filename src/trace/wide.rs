//! Loops that are compiled once for each width of vector instructions.

/// Plain loops over arrays of fixed length, which become vector instructions.
///
/// No product is fused with a sum, so that every width gives the same bits.
pub(super) trait Wide {
    /// What they compute.
    type Answer;

    /// Computes it; to be marked `#[inline(always)]`, or it is not compiled anew.
    fn run(self) -> Self::Answer;
}

/// Runs loops with the widest instructions that the processor has.
#[inline]
pub(super) fn widest<W: Wide>(work: W) -> W::Answer {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") {
            // SAFETY: the processor has just been asked for the only feature that it needs.
            return unsafe { x86::of_512_bits(work) };
        }
        if is_x86_feature_detected!("avx2") {
            // SAFETY: as above.
            return unsafe { x86::of_256_bits(work) };
        }
    }
    work.run()
}

/// The lesser; the second where the first is no number. Other than the standard library's it is one instruction.
#[inline(always)]
pub(super) fn least(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater; the second where the first is no number.
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
