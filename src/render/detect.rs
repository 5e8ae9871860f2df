//! Computes the range and power that the receiver reports from the paths of a chirp.
//!
//! There are three kinds of receiver. Without settings it is exact, as in the paper: powers add, and the range is the
//! mean weighted by power. With speckle, noise or phases the amplitude of an echo is that of its coherent part, plus the field
//! of `speckle/` for the rest, plus noise. With a `[radar.receiver]` every path becomes a tone of the beat signal
//! (`tones.rs`), and range and power are read from its spectrum.
//!
//! A chirp has one echo, unless its rays pass a sheet or the radar says which `returns` it reports: then
//! `returns.rs` parts them, and each has an amplitude of its own.

use std::f64::consts::TAU;
use std::ops::Range;

use num_complex::Complex;

use super::effect_scan::EffectScan;
use super::error::RenderError;
use super::observer::Observer;
use super::path::{Arrival, Path, sum};
use super::returns::{Measured, Seen, choose, separate};
use super::setup::Setup;
use super::speckle::{Cell, EVERYWHERE, Field, Fluctuation, Law};
use super::spot::Footprints;
use super::tones::{Beat, Beats, Waves};
use crate::effects::{Receiver, SaturationCurve};
use crate::frames::{Global, Pose};
use crate::radar::noise::{Addition, in_noise_w, measured_w};
use crate::radar::random::{Draws, Key, Purpose};
use crate::radar::{Detection, IndependentSpeckle, Noise, RangeProcessor, Returns, SpeckleForm};
use crate::units::watts_from_dbm;

/// A receiver prepared for a scan.
pub(super) struct Detector<'a> {
    noise_seed: u64,
    observer: u64,
    kind: Kind,
    speckle: Fluctuation<'a>,
    threshold_w: f64,
    saturation: SaturationCurve,
    returns: Returns,
    /// Distance at which echoes part, m.
    cell_m: f64,
    wavelength_m: f64,
    /// Whether the phases of echoes are reported.
    phases: bool,
}

/// The kinds of receiver.
enum Kind {
    Exact,
    Laws { law: Receiver, noise: Noise },
    Beat(Beat),
}

impl<'a> Detector<'a> {
    /// Prepares the receiver that the radar of a setup declares, with the effects on it and its speckle.
    ///
    /// # Errors
    /// When the settings of the receiver are inconsistent, or the field of the speckle cannot be made.
    pub fn new(
        setup: &'a Setup<'a>,
        observer: Observer,
        effects: Option<&EffectScan>,
        footprints: &Footprints,
    ) -> Result<Detector<'a>, RenderError> {
        let law = effects.map(EffectScan::receiver);
        let rays = footprints.rays_per_chirp;
        Detector::with(setup, observer, law, setup.speckle_form(rays), |looks| {
            Field::new(setup, observer, footprints, looks)
        })
    }

    /// As [`new`](Self::new), for a target in a pose whose rays nobody traced: its speckle is that of the law.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn of_pose(
        setup: &'a Setup<'a>,
        target: Pose<Global, Global>,
    ) -> Result<Detector<'a>, RenderError> {
        let form = setup.speckle_form(1);
        Detector::with(setup, Observer::Radar, None, form, |looks| match form {
            SpeckleForm::Scatterers => Err(RenderError::BatchScatterers),
            _ => Ok(Field::Law(Law::new(setup, Observer::Radar, 1, target, looks)?)),
        })
    }

    fn with(
        setup: &Setup,
        observer: Observer,
        law: Option<Receiver>,
        form: SpeckleForm,
        field: impl FnOnce(usize) -> Result<Field<'a>, RenderError>,
    ) -> Result<Detector<'a>, RenderError> {
        let radar = setup.geometry.radar;
        let declared = Receiver::declared(radar);
        let law = law.unwrap_or(declared);
        let mut threshold_w = watts_from_dbm(radar.threshold_dbm);
        let is_plain = law.looks.is_infinite() && law.noise_w == 0.0 && radar.noise.is_none();
        let kind = match (radar.receiver, radar.noise) {
            (Some(receiver), _) => {
                let (chirp, looks) = (radar.chirp(), radar.speckle.map_or(1, |s| s.looks as u32));
                let processor = RangeProcessor::new(&receiver, &chirp, radar.threshold_dbm, looks)?;
                threshold_w = processor.threshold_w();
                Kind::Beat(Beat { chirp, processor, looks })
            }
            (None, None) if is_plain => Kind::Exact,
            (None, noise) => Kind::Laws {
                law,
                noise: noise.unwrap_or(Noise { range_sd_m: 0.0, ..Noise::default() }),
            },
        };
        let speckle = if law.looks.is_infinite() {
            Fluctuation::None
        } else if form == SpeckleForm::Independent || law.looks != declared.looks {
            // An effect may leave a part of a look, which is no number of fields.
            Fluctuation::Independent(law.looks)
        } else {
            Fluctuation::Field(field(law.looks as usize)?)
        };
        Ok(Detector {
            noise_seed: setup.noise_seed.unwrap_or(setup.seed),
            observer: observer.number(),
            kind,
            speckle,
            threshold_w,
            saturation: law.saturating(),
            returns: radar.returns,
            cell_m: radar.range_cell_m(),
            wavelength_m: radar.wavelength_m(),
            phases: radar.phases,
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
    ///
    /// # Errors
    /// When a path is too long for the receiver's sampling.
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
                let spectra = beat.spectra(self.waves(chirp), paths)?;
                let profile_w = spectra.mean_profile_w();
                let mut peaks = match self.returns {
                    Returns::Strongest => Vec::new(),
                    Returns::First | Returns::All => beat.processor.peaks(&profile_w),
                };
                if peaks.is_empty() {
                    peaks.extend(beat.processor.peak(&profile_w));
                }
                let mean_w = paths.iter().map(|path| path.power_w).sum();
                seen.extend(peaks.into_iter().map(|peak| {
                    let phase_rad = self.phases.then(|| spectra.phase_rad(&beat.processor, peak));
                    let measured = Measured { detection: self.saturate(mean_w, peak), phase_rad };
                    Seen { measured, paths: whole.clone() }
                }));
            }
            _ if paths.is_empty() => {}
            _ if self.parts(paths) => {
                let places = separate(paths, self.cell_m);
                let gates = gates(paths, &places);
                for (number, (places, gate_m)) in (0..).zip(places.into_iter().zip(gates)) {
                    let measured =
                        self.measure_paths(chirp, number, &paths[places.clone()], gate_m);
                    seen.push(Seen { measured, paths: places });
                }
            }
            _ => {
                let measured = self.measure_paths(chirp, 0, paths, EVERYWHERE);
                seen.push(Seen { measured, paths: whole });
            }
        }
        choose(seen, self.returns, self.threshold_w);
        Ok(())
    }

    /// Whether the echoes of these paths part in range: those of rays that pass a sheet do.
    fn parts(&self, paths: &[Path]) -> bool {
        self.returns != Returns::Strongest || paths.iter().any(|path| path.sheets > 0)
    }

    /// What a receiver without beat signals measures of some paths of a chirp, between two ranges, m.
    fn measure_paths(
        &self,
        chirp: usize,
        number: u64,
        paths: &[Path],
        gate_m: [f64; 2],
    ) -> Measured {
        let arrival = Arrival::of(paths, self.wavelength_m);
        let strongest = paths.iter().reduce(|a, b| if b.power_w > a.power_w { b } else { a });
        let cell = Cell {
            sheets: strongest.map_or(0, |path| path.sheets),
            range_m: arrival.mean.range_m,
            delay_m: strongest.map_or(0.0, |path| path.delay_m),
            gate_m,
        };
        self.measure(chirp, number, &arrival, &cell)
    }

    /// The range and power that a receiver without beat signals measures of a whole chirp.
    pub fn measure_whole(&self, chirp: usize, arrival: &Arrival) -> Detection {
        let cell =
            Cell { sheets: 0, range_m: arrival.mean.range_m, delay_m: 0.0, gate_m: EVERYWHERE };
        self.measure(chirp, 0, arrival, &cell).detection
    }

    /// As [`measure_whole`](Self::measure_whole), for one of several echoes of a chirp, by its number.
    fn measure(&self, chirp: usize, number: u64, arrival: &Arrival, cell: &Cell) -> Measured {
        let mean = arrival.mean;
        let phase = |amplitude: Complex<f64>| {
            self.phases.then(|| self.beat_phase_rad(mean.range_m, amplitude))
        };
        let Kind::Laws { law, noise } = &self.kind else {
            let detection = self.saturate(mean.power_w, mean);
            return Measured { detection, phase_rad: phase(arrival.steady()) };
        };
        if mean.power_w == 0.0 {
            // Without an echo there is no range to measure.
            return Measured { detection: mean, phase_rad: None };
        }
        let (linear_w, amplitude) = match &self.speckle {
            Fluctuation::Field(field) => {
                let mut looks = Vec::new();
                field.amplitudes(chirp, cell, &mut looks);
                let mut draws = self.draws(chirp, number, Purpose::Noise);
                self.in_noise(arrival, looks, law.noise_w, noise.added, &mut draws)
            }
            Fluctuation::None => {
                let mut draws = self.draws(chirp, number, Purpose::Speckle);
                let amplitude = arrival.steady();
                let noisy = if law.noise_w > 0.0 {
                    amplitude + draws.complex_gaussian() * law.noise_w.sqrt()
                } else {
                    amplitude
                };
                (noisy.norm_sqr(), noisy)
            }
            Fluctuation::Independent(looks) => {
                let mut draws = self.draws(chirp, number, Purpose::Speckle);
                let coherent_w = arrival.coherent.norm_sqr();
                let power_w = coherent_w + arrival.incoherent_w;
                let power_w = measured_w(
                    power_w,
                    law.noise_w,
                    noise.added,
                    Some(IndependentSpeckle {
                        looks: *looks,
                        coherent_ratio: (coherent_w / arrival.incoherent_w).min(MOST_COHERENT),
                    }),
                    &mut draws,
                );
                (power_w, Complex::from(power_w.sqrt()))
            }
        };
        let power_w = self.saturation.passed_w(mean.power_w + law.noise_w, linear_w);
        // A first draw takes as long as all else of an echo.
        let error_m = if noise.range_sd_m > 0.0 {
            noise.range_sd_m * self.draws(chirp, number, Purpose::Range).gaussian()
        } else {
            0.0
        };
        let detection = Detection { range_m: mean.range_m + error_m, power_w };
        Measured { detection, phase_rad: phase(amplitude) }
    }

    /// Power, W, over the looks of an echo in noise, and the amplitude of the last look, √W.
    fn in_noise(
        &self,
        arrival: &Arrival,
        looks: Vec<Complex<f64>>,
        noise_w: f64,
        added: Addition,
        draws: &mut Draws,
    ) -> (f64, Complex<f64>) {
        let (count, level) = (looks.len() as f64, arrival.incoherent_w.sqrt());
        let (mut power_w, mut amplitude) = (0.0, Complex::ZERO);
        for look in looks {
            amplitude = arrival.coherent + level * look;
            if added == Addition::BeforeLooks && noise_w > 0.0 {
                amplitude += draws.complex_gaussian() * noise_w.sqrt();
            }
            power_w += amplitude.norm_sqr() / count;
        }
        if added == Addition::AfterLooks && noise_w > 0.0 {
            power_w = in_noise_w(power_w, noise_w, draws);
        }
        (power_w, amplitude)
    }

    /// Phase of the beat of an amplitude that counts its own from an echo at a range, rad, −π to π.
    fn beat_phase_rad(&self, range_m: f64, amplitude: Complex<f64>) -> f64 {
        let turns = (2.0 * range_m / self.wavelength_m).fract();
        (amplitude * Complex::cis(TAU * turns)).arg()
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
    ///
    /// # Errors
    /// When a path is too long for the receiver's sampling.
    pub fn beats(&self, chirp: usize, paths: &[Path]) -> Result<Beats, RenderError> {
        match &self.kind {
            Kind::Beat(beat) => beat.signals(self.waves(chirp), paths),
            _ => Ok(Vec::new()),
        }
    }

    /// What the tones of a chirp are made with.
    fn waves(&self, chirp: usize) -> Waves<'_> {
        Waves {
            chirp,
            speckle: &self.speckle,
            wavelength_m: self.wavelength_m,
            phases: self.draws(chirp, 0, Purpose::SurfacePhase),
            noise: self.draws(chirp, 0, Purpose::Noise),
        }
    }

    /// Draws for one echo of a chirp, by its number.
    fn draws(&self, chirp: usize, number: u64, purpose: Purpose) -> Draws {
        // Observers are far fewer.
        const ECHOES_FROM_BIT: u32 = 32;
        let sub_ray = self.observer | number << ECHOES_FROM_BIT;
        Key { seed: self.noise_seed, chirp: chirp as u64, sub_ray, purpose }.draws()
    }
}

/// Ratio of a coherent to a diffuse part beyond which nothing speckles.
const MOST_COHERENT: f64 = 1e9;

/// The ranges, m, between which each echo lies: up to the middle between neighbours behind the same sheets.
fn gates(paths: &[Path], places: &[Range<usize>]) -> Vec<[f64; 2]> {
    let echoes = places.iter().map(|places| {
        let paths = &paths[places.clone()];
        (paths.first().map_or(0, |path| path.sheets), sum(paths).range_m)
    });
    let echoes: Vec<(u8, f64)> = echoes.collect();
    let gates = echoes.iter().map(|(sheets, range_m)| {
        let mut gate_m = EVERYWHERE;
        for (_, other_m) in echoes.iter().filter(|(other, _)| other == sheets) {
            let middle_m = 0.5 * (range_m + other_m);
            if other_m < range_m {
                gate_m[0] = gate_m[0].max(middle_m);
            } else if other_m > range_m {
                gate_m[1] = gate_m[1].min(middle_m);
            }
        }
        gate_m
    });
    gates.collect()
}
