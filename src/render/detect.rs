//! Computes the range and power that the receiver reports from the paths of a chirp.
//!
//! There are three kinds of receiver. Without settings it is exact, as in the paper: powers add, and the range is the
//! mean weighted by power. With speckle or noise, power and range are drawn from their distributions. With a
//! `[radar.receiver]` every path becomes a tone of the beat signal, and range and power are read from its spectrum.
//!
//! A chirp has one echo, unless its rays pass a sheet or the radar says which `returns` it reports: then
//! `returns.rs` parts them, and each has draws of its own.

use num_complex::Complex;

use super::effect_scan::EffectScan;
use super::error::RenderError;
use super::observer::Observer;
use super::path::{Path, sum};
use super::returns::{Seen, choose, separate};
use super::setup::Setup;
use crate::effects::{Receiver, SaturationCurve};
use crate::radar::noise::measured_w;
use crate::radar::random::{Draws, Key, Purpose};
use crate::radar::{Chirp, Detection, Noise, RangeProcessor, Return, Returns, Speckle};
use crate::units::watts_from_dbm;

/// The sampled beat signals of one chirp, √W, one per look.
pub type Beats = Vec<Vec<Complex<f64>>>;

/// A receiver prepared for a scan.
pub(super) struct Detector {
    seed: u64,
    observer: u64,
    kind: Kind,
    threshold_w: f64,
    saturation: SaturationCurve,
    returns: Returns,
    /// Distance at which echoes part, m.
    cell_m: f64,
}

/// The kinds of receiver.
enum Kind {
    Exact,
    Laws { law: Receiver, speckle: Option<Speckle>, noise: Noise },
    Beat(Beat),
}

struct Beat {
    chirp: Chirp,
    processor: RangeProcessor,
    speckle: Option<Speckle>,
    looks: u32,
}

impl Detector {
    /// Prepares the receiver that the radar of a setup declares, with the effects on it.
    ///
    /// # Errors
    /// When the settings of the receiver are inconsistent.
    pub fn new(
        setup: &Setup,
        observer: Observer,
        effects: Option<&EffectScan>,
    ) -> Result<Detector, RenderError> {
        let radar = setup.geometry.radar;
        let declared = Receiver::declared(radar);
        let law = effects.map_or(declared, EffectScan::receiver);
        let mut threshold_w = watts_from_dbm(radar.threshold_dbm);
        let kind = match (radar.receiver, radar.speckle, radar.noise) {
            (Some(receiver), speckle, _) => {
                let (chirp, looks) = (radar.chirp(), speckle.map_or(1, |s| s.looks as u32));
                let processor = RangeProcessor::new(&receiver, &chirp, radar.threshold_dbm, looks)?;
                threshold_w = processor.threshold_w();
                Kind::Beat(Beat { chirp, processor, speckle, looks })
            }
            (None, None, None) if law.looks == declared.looks && law.noise_w == 0.0 => Kind::Exact,
            (None, speckle, noise) => {
                let speckled = Speckle { looks: law.looks, ..speckle.unwrap_or_default() };
                Kind::Laws {
                    speckle: law.looks.is_finite().then_some(speckled),
                    law,
                    noise: noise.unwrap_or(Noise { range_sd_m: 0.0, ..Noise::default() }),
                }
            }
        };
        Ok(Detector {
            seed: setup.seed,
            observer: observer.number(),
            kind,
            threshold_w,
            saturation: law.saturating(),
            returns: radar.returns,
            cell_m: radar.range_cell_m(),
        })
    }

    /// Least power of a detection, W.
    pub fn threshold_w(&self) -> f64 {
        self.threshold_w
    }

    /// Mean thermal power in a range cell, W; `None` for a receiver without noise.
    pub fn noise_w(&self) -> Option<f64> {
        let noise_w = match &self.kind {
            Kind::Exact => 0.0,
            Kind::Laws { law, .. } => law.noise_w,
            Kind::Beat(beat) => beat.processor.noise_per_bin_w(),
        };
        (noise_w > 0.0).then_some(noise_w)
    }

    /// Replaces the contents of `seen` by what the receiver measures of a chirp, also below the threshold, and may sort
    /// its paths.
    pub fn observe(
        &self,
        chirp: usize,
        paths: &mut [Path],
        seen: &mut Vec<Seen>,
    ) -> Result<(), RenderError> {
        seen.clear();
        let whole = 0..paths.len();
        match &self.kind {
            Kind::Beat(beat) => {
                let profile_w = self.mean_profile_w(beat, chirp, paths)?;
                let mut peaks = match self.returns {
                    Returns::Strongest => Vec::new(),
                    Returns::First | Returns::All => beat.processor.peaks(&profile_w),
                };
                if peaks.is_empty() {
                    peaks.extend(beat.processor.peak(&profile_w));
                }
                let mean_w = paths.iter().map(|path| path.power_w).sum();
                seen.extend(peaks.into_iter().map(|peak| {
                    let detection = self.saturate(mean_w, peak);
                    Seen { detection, paths: whole.clone() }
                }));
            }
            _ if paths.is_empty() => {}
            _ if self.parts(paths) => {
                for (number, places) in (0..).zip(separate(paths, self.cell_m)) {
                    let detection = self.measure(chirp, number, sum(&paths[places.clone()]));
                    seen.push(Seen { detection, paths: places });
                }
            }
            _ => {
                let detection = self.measure_mean(chirp, sum(paths));
                seen.push(Seen { detection, paths: whole });
            }
        }
        choose(seen, self.returns, self.threshold_w);
        Ok(())
    }

    /// Whether the echoes of these paths part in range: those of rays that pass a sheet do.
    fn parts(&self, paths: &[Path]) -> bool {
        self.returns != Returns::Strongest || paths.iter().any(|path| path.sheets > 0)
    }

    /// The range and power that a receiver without beat signals measures of a chirp with this mean.
    pub fn measure_mean(&self, chirp: usize, mean: Detection) -> Detection {
        self.measure(chirp, 0, mean)
    }

    /// As [`measure_mean`](Self::measure_mean), for one of several echoes of a chirp, by its number.
    fn measure(&self, chirp: usize, number: u64, mean: Detection) -> Detection {
        let Kind::Laws { law, speckle, noise } = &self.kind else {
            return self.saturate(mean.power_w, mean);
        };
        let Detection { range_m, power_w } = mean;
        if power_w == 0.0 {
            // Without an echo there is no range to measure.
            return mean;
        }
        let mut draws = self.draws_of(chirp, number, Purpose::Speckle);
        let linear_w = measured_w(power_w, law.noise_w, noise.added, *speckle, &mut draws);
        let power_w = self.saturation.passed_w(power_w + law.noise_w, linear_w);
        let error_m = noise.range_sd_m * self.draws_of(chirp, number, Purpose::Range).gaussian();
        Detection { range_m: range_m + error_m, power_w }
    }

    /// The output of a receiver that saturates, for a linear power with the mean `mean_w`.
    fn saturate(&self, mean_w: f64, linear: Detection) -> Detection {
        // Noise alone has no mean echo, and the power takes its place.
        let mean_w = if mean_w > 0.0 { mean_w } else { linear.power_w };
        Detection { power_w: self.saturation.passed_w(mean_w, linear.power_w), ..linear }
    }

    /// Largest distance of a detection from the range of the path that caused it, m; `None` for a receiver that does
    /// not separate ranges.
    pub fn reach_m(&self) -> Option<f64> {
        match &self.kind {
            Kind::Beat(beat) => Some(beat.processor.resolution_m()),
            _ => None,
        }
    }

    /// The beat signals of a chirp, one per look; empty without a `[radar.receiver]`.
    pub fn beats(&self, chirp: usize, paths: &[Path]) -> Result<Beats, RenderError> {
        match &self.kind {
            Kind::Beat(beat) => self.signals(beat, chirp, paths).collect(),
            _ => Ok(Vec::new()),
        }
    }

    fn signals(
        &self,
        beat: &Beat,
        chirp: usize,
        paths: &[Path],
    ) -> impl Iterator<Item = Result<Vec<Complex<f64>>, RenderError>> {
        let mut phases = self.draws(chirp, Purpose::SurfacePhase);
        let mut noise = self.draws(chirp, Purpose::Noise);
        let tones = beat.merge_indistinct(paths);
        (0..beat.looks).map(move |_| {
            let returns: Vec<Return> =
                tones.iter().map(|&sum| beat.echo(sum, &mut phases)).collect();
            let mut signal = beat.processor.beat_signal(&returns, &mut noise)?;
            beat.processor.add_noise(&mut signal, &mut noise);
            Ok(signal)
        })
    }

    /// The power spectrum over range, W, averaged over the looks.
    fn mean_profile_w(
        &self,
        beat: &Beat,
        chirp: usize,
        paths: &[Path],
    ) -> Result<Vec<f64>, RenderError> {
        let mut mean_w: Vec<f64> = Vec::new();
        for signal in self.signals(beat, chirp, paths) {
            let profile_w = beat.processor.profile_w(&signal?);
            mean_w.resize(profile_w.len(), 0.0);
            let shares = profile_w.into_iter().map(|power_w| power_w / f64::from(beat.looks));
            mean_w.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share);
        }
        Ok(mean_w)
    }

    fn draws(&self, chirp: usize, purpose: Purpose) -> Draws {
        self.draws_of(chirp, 0, purpose)
    }

    /// Draws for one echo of a chirp, by its number.
    fn draws_of(&self, chirp: usize, number: u64, purpose: Purpose) -> Draws {
        // Observers are far fewer.
        const ECHOES_FROM_BIT: u32 = 32;
        let sub_ray = self.observer | number << ECHOES_FROM_BIT;
        Key { seed: self.seed, chirp: chirp as u64, sub_ray, purpose }.draws()
    }
}

impl Beat {
    /// Merges paths that lie within a sixteenth of a range cell. Their Gaussian phasors add up to one Gaussian phasor
    /// with the total power. Other phasors occur only for a single path.
    fn merge_indistinct(&self, paths: &[Path]) -> Vec<Detection> {
        const PART_OF_A_CELL: f64 = 1.0 / 16.0;
        let part_m = PART_OF_A_CELL * self.chirp.range_resolution_m();
        let part = |path: &Path| (path.range_m / part_m) as u64;
        let mut sorted = paths.to_vec();
        sorted.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
        sorted.chunk_by(|a, b| part(a) == part(b)).map(sum).collect()
    }

    fn echo(&self, sum: Detection, phases: &mut Draws) -> Return {
        let phasor = self.speckle.map_or(Complex::ONE, |speckle| speckle.phasor(phases));
        Return { range_m: sum.range_m, amplitude_sqrt_w: phasor * sum.power_w.sqrt() }
    }
}
