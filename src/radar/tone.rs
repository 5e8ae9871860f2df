//! Sums of many tones, sample by sample, in vector instructions.

use num_complex::Complex;

use crate::lanes::{Wide, widest};

/// Samples that turn side by side, so that none waits for the one before.
const LANES: usize = 32;

/// A tone: its first sample, and by how much each turns over the one before, rad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Tone {
    pub first: Complex<f64>,
    pub step_rad: f64,
}

/// A sum of tones: real and imaginary parts, a block of samples after the other.
pub(super) struct Signal {
    blocks: Vec<[[f64; LANES]; 2]>,
    samples: usize,
}

impl Signal {
    /// Silence of this number of samples.
    pub fn silence(samples: usize) -> Signal {
        Signal { blocks: vec![[[0.0; LANES]; 2]; samples.div_ceil(LANES)], samples }
    }

    /// Adds a tone. Turning a phasor costs one product a sample; its error grows to 1e-12 over 4096 samples.
    pub fn add(&mut self, tone: Tone) {
        let mut first = [tone.first; LANES];
        // Each half from the one before: a turn and products.
        for half in (0..LANES.ilog2()).map(|power| 1 << power) {
            let turn = Complex::cis(half as f64 * tone.step_rad);
            let (before, after) = first.split_at_mut(half);
            after.iter_mut().zip(before).for_each(|(after, before)| *after = *before * turn);
        }
        let phasors = [first.map(|phasor| phasor.re), first.map(|phasor| phasor.im)];
        let step = Complex::cis(LANES as f64 * tone.step_rad);
        widest(Turning { blocks: &mut self.blocks, phasors, step });
    }

    /// Its samples.
    pub fn samples(&self) -> Vec<Complex<f64>> {
        let mut samples = Vec::with_capacity(LANES * self.blocks.len());
        for [re, im] in &self.blocks {
            samples.extend(re.iter().zip(im).map(|(&re, &im)| Complex::new(re, im)));
        }
        samples.truncate(self.samples);
        samples
    }
}

/// Phasors that turn through a signal.
struct Turning<'a> {
    blocks: &'a mut [[[f64; LANES]; 2]],
    phasors: [[f64; LANES]; 2],
    step: Complex<f64>,
}

impl Wide for Turning<'_> {
    type Answer = ();

    #[inline(always)]
    fn run(self) {
        let Turning { blocks, phasors: [mut re, mut im], step } = self;
        for [sum_re, sum_im] in blocks {
            for lane in 0..LANES {
                let (a, b) = (re[lane], im[lane]);
                sum_re[lane] += a;
                sum_im[lane] += b;
                re[lane] = a * step.re - b * step.im;
                im[lane] = a * step.im + b * step.re;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::at_most;

    #[test]
    fn a_tone_turns_by_its_step_at_every_width_of_instructions() {
        let tone = Tone { first: Complex::new(0.3, -1.9), step_rad: 2.345_678 };
        let other = Tone { first: Complex::new(-0.7, 0.1), step_rad: 0.012_3 };
        let samples = |bits| {
            at_most(bits, || {
                let mut signal = Signal::silence(4099);
                [tone, other].into_iter().for_each(|tone| signal.add(tone));
                signal.samples()
            })
        };
        let widest = samples(512);
        assert!(samples(128) == widest && samples(256) == widest);
        assert_eq!(widest.len(), 4099);
        for (n, sample) in widest.iter().enumerate() {
            let [a, b] = [tone, other].map(|t| t.first * Complex::cis(n as f64 * t.step_rad));
            assert!((sample - a - b).norm() < 3e-12, "{n}: {sample}");
        }
    }
}
