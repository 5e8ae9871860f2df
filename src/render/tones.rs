//! The paths of a chirp as tones of its beat signal.
//!
//! The coherent parts of the rays on one smooth piece are one tone. What speckles is a tone for every part of a range cell:
//! of the scatterers that lie there, or, without them, of the rays that end there. Second-order paths, whose scatterers
//! are pairs, have draws of their own.

use num_complex::Complex;

use super::error::RenderError;
use super::path::{Arrival, Path, sum, waves as coherent_waves};
use super::speckle::{Cell, EVERYWHERE, Field, Fluctuation, Scatterers};
use crate::radar::random::Draws;
use crate::radar::{Chirp, Detection, RangeProcessor, Return};

/// The sampled beat signals of one chirp, √W, one per look.
pub type Beats = Vec<Vec<Complex<f64>>>;

/// Tones nearer than this share of a range cell are one.
const PART_OF_A_CELL: f64 = 1.0 / 16.0;

/// A receiver of beat signals.
pub(super) struct Beat {
    pub chirp: Chirp,
    pub processor: RangeProcessor,
    pub looks: u32,
}

/// What the tones of one chirp are made with.
pub(super) struct Waves<'a> {
    /// Its number.
    pub chirp: usize,
    pub speckle: &'a Fluctuation<'a>,
    pub wavelength_m: f64,
    /// Draws for amplitudes that no field has.
    pub phases: Draws,
    /// Draws for thermal noise.
    pub noise: Draws,
}

/// A tone, and its amplitude in every look, √W.
struct Tone {
    range_m: f64,
    looks: Vec<Complex<f64>>,
}

impl Beat {
    /// The beat signals of a chirp, one per look.
    ///
    /// # Errors
    /// When a path is too long for the sampling.
    pub fn signals(&self, mut waves: Waves, paths: &[Path]) -> Result<Beats, RenderError> {
        let tones = self.tones(&mut waves, paths);
        let signals = (0..self.looks as usize).map(|look| {
            let returns: Vec<Return> = tones
                .iter()
                .map(|tone| Return { range_m: tone.range_m, amplitude_sqrt_w: tone.looks[look] })
                .collect();
            let mut signal = self.processor.beat_signal(&returns, &mut waves.noise)?;
            self.processor.add_noise(&mut signal, &mut waves.noise);
            Ok(signal)
        });
        signals.collect()
    }

    /// The spectra of a chirp over range, one per look.
    ///
    /// # Errors
    /// When a path is too long for the sampling.
    pub fn spectra(&self, waves: Waves, paths: &[Path]) -> Result<Spectra, RenderError> {
        let signals = self.signals(waves, paths)?;
        Ok(Spectra {
            of_looks: signals.iter().map(|signal| self.processor.spectrum(signal)).collect(),
        })
    }

    fn tones(&self, waves: &mut Waves, paths: &[Path]) -> Vec<Tone> {
        let looks = self.looks as usize;
        match waves.speckle {
            // Checked before: a single ray, whose paths part by the sheets in front of them.
            Fluctuation::None => {
                let tones = paths.iter().map(|path| Tone {
                    range_m: path.range_m,
                    looks: vec![Complex::from(path.power_w.sqrt()); looks],
                });
                tones.collect()
            }
            Fluctuation::Independent(_) => self.drawn(waves, paths),
            Fluctuation::Field(Field::Scatterers(scatterers)) if paths.len() > 1 => {
                let (direct, second) = paths.iter().copied().partition(|path| path.surfaces == 1);
                let mut tones = self.of_scatterers(waves, scatterers, direct);
                tones.extend(self.drawn(waves, second.as_slice()));
                tones
            }
            Fluctuation::Field(field) => {
                paths.iter().map(|path| whole(waves, field, path)).collect()
            }
        }
    }

    /// Tones of paths with draws of their own.
    fn drawn(&self, waves: &mut Waves, paths: &[Path]) -> Vec<Tone> {
        let parts = self.merge_indistinct(paths);
        let levels = parts.iter().map(|part| {
            let incoherent = part.iter().map(|path| path.power_w * (1.0 - path.coherent_share));
            (sum(part).range_m, incoherent.sum::<f64>().sqrt())
        });
        let levels: Vec<(f64, f64)> = levels.collect();
        let mut tones = self.steady(paths);
        let first = tones.len();
        tones.extend(levels.iter().map(|&(range_m, _)| Tone { range_m, looks: Vec::new() }));
        for _ in 0..self.looks {
            for (tone, (_, level)) in tones[first..].iter_mut().zip(&levels) {
                tone.looks.push(*level * waves.phases.complex_gaussian());
            }
        }
        tones
    }

    /// The tones of the waves that do not speckle.
    fn steady(&self, paths: &[Path]) -> Vec<Tone> {
        let tones = coherent_waves(paths).into_iter().map(|Detection { range_m, power_w }| Tone {
            range_m,
            looks: vec![Complex::from(power_w.sqrt()); self.looks as usize],
        });
        tones.collect()
    }

    /// Tones of the single paths of a spot: its waves, and the scatterers behind each number of sheets.
    fn of_scatterers(
        &self,
        waves: &Waves,
        scatterers: &Scatterers,
        mut paths: Vec<Path>,
    ) -> Vec<Tone> {
        let mut tones = self.steady(&paths);
        paths.sort_by_key(|path| path.sheets);
        for layer in paths.chunk_by(|a, b| a.sheets == b.sheets) {
            let arrival = Arrival::of(layer, waves.wavelength_m);
            let delay_m = layer.iter().map(|path| path.delay_m).sum::<f64>() / layer.len() as f64;
            let (sheets, range_m) = (layer[0].sheets, arrival.mean.range_m);
            let cell = Cell { sheets, range_m, delay_m, gate_m: EVERYWHERE };
            tones.extend(self.parts(waves, scatterers, &cell, arrival.incoherent_w));
        }
        tones
    }

    /// The tones of scatterers that return `power_w` together.
    fn parts(
        &self,
        waves: &Waves,
        scatterers: &Scatterers,
        cell: &Cell,
        power_w: f64,
    ) -> Vec<Tone> {
        let part_m = PART_OF_A_CELL * self.chirp.range_resolution_m();
        let mut parts: Vec<(i64, Tone)> = Vec::new();
        let mut power = 0.0;
        scatterers.visit(waves.chirp, cell, |wave| {
            let range_m = wave.range_m + cell.delay_m;
            let number = (range_m / part_m).floor() as i64;
            power += wave.amplitude.norm_sqr();
            let place = parts.iter().position(|(part, _)| *part == number);
            let place = place.unwrap_or_else(|| {
                let middle_m = (number as f64 + 0.5) * part_m;
                let looks = vec![Complex::ZERO; self.looks as usize];
                parts.push((number, Tone { range_m: middle_m, looks }));
                parts.len() - 1
            });
            let looks = parts[place].1.looks.iter_mut().zip(wave.phasors);
            looks.for_each(|(sum, phasor)| *sum += wave.amplitude * phasor);
        });
        if power == 0.0 {
            let mut looks = Vec::new();
            scatterers.amplitudes(waves.chirp, cell, &mut looks);
            looks.iter_mut().for_each(|look| *look *= power_w.sqrt());
            return vec![Tone { range_m: cell.range_m, looks }];
        }
        let level = (power_w / power).sqrt();
        parts.sort_by_key(|(number, _)| *number);
        let tones = parts.into_iter().map(|(_, tone)| {
            // Phases count from the cell's range, and the tone brings the phase of its own.
            let back_rad =
                2.0 * std::f64::consts::TAU / waves.wavelength_m * (cell.range_m - tone.range_m);
            let turn = level * Complex::cis(back_rad);
            let looks = tone.looks.into_iter().map(|look| look * turn).collect();
            Tone { range_m: tone.range_m, looks }
        });
        tones.collect()
    }

    /// Parts the paths by range, those within a sixteenth of a range cell together.
    fn merge_indistinct(&self, paths: &[Path]) -> Vec<Vec<Path>> {
        let part_m = PART_OF_A_CELL * self.chirp.range_resolution_m();
        let part = |path: &Path| (path.range_m / part_m) as u64;
        let mut sorted = paths.to_vec();
        sorted.sort_by(|a, b| a.range_m.total_cmp(&b.range_m));
        sorted.chunk_by(|a, b| part(a) == part(b)).map(<[Path]>::to_vec).collect()
    }
}

/// The tone of a single ray, which stands for its whole spot.
fn whole(waves: &Waves, field: &Field, path: &Path) -> Tone {
    let arrival = Arrival::of(std::slice::from_ref(path), waves.wavelength_m);
    let Path { range_m, sheets, delay_m, .. } = *path;
    let mut looks = Vec::new();
    field.amplitudes(
        waves.chirp,
        &Cell { sheets, range_m, delay_m, gate_m: EVERYWHERE },
        &mut looks,
    );
    let level = arrival.incoherent_w.sqrt();
    looks.iter_mut().for_each(|look| *look = arrival.coherent + level * *look);
    Tone { range_m, looks }
}

/// The spectra of one chirp, one per look.
pub(super) struct Spectra {
    of_looks: Vec<Vec<Complex<f64>>>,
}

impl Spectra {
    /// The power spectrum over range, W, averaged over the looks.
    pub fn mean_profile_w(&self) -> Vec<f64> {
        let bins = self.of_looks.first().map_or(0, Vec::len);
        let count = self.of_looks.len() as f64;
        let mean_w =
            |bin: usize| self.of_looks.iter().map(|look| look[bin].norm_sqr()).sum::<f64>() / count;
        (0..bins).map(mean_w).collect()
    }

    /// Phase of the beat at a peak in the middle of the sweep, rad, −π to π, in the first look.
    pub fn phase_rad(&self, processor: &RangeProcessor, peak: Detection) -> f64 {
        self.of_looks.first().map_or(0.0, |look| processor.phase_rad(look, peak.range_m))
    }
}
