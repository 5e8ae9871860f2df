//! Sheets: regions that let a part of the wave through, such as cloth.
//!
//! A sheet is a stack of layers in air, with the complex amplitudes r(f) and t(f) of a plane wave. The radar sweeps f,
//! and what it reads is a windowed Fourier transform over the sweep:
//!
//! - The echo of the sheet itself is the highest peak of |Σ w·r(f)·e^{2jkx}/Σ w|² over the range x. The mean of |r|²
//!   would count the echoes of both faces together: −9.96 dB in place of −12.9 dB for 8 mm of n = 1.6.
//! - On the way through, the power is T, the highest peak of |Σ w·t(f)·e^{jk(cos θ·d + x)}/Σ w|², and the echoes of what
//!   lies behind seem x farther away each way, (√(n² − sin²θ) − cos θ)·d for a thin sheet. There and back the power is
//!   T². A ray goes straight on.
//!
//! Both are tabulated over the angle of incidence.

use nalgebra::Complex;

use crate::brdf::{Brdf, Layer, Layered, NarrowLobe, Polarisation, Scattering, Seen};
use crate::frames::{Direction, Surface};
use crate::radar::Radar;
use crate::units::SPEED_OF_LIGHT_M_PER_S;

/// Steps of the table from normal to grazing incidence: a quarter of a degree each.
const STEPS: usize = 360;

/// The surface of a region that lets a part of the wave through.
#[derive(Clone, Debug)]
pub struct Sheet {
    stack: Layered,
    /// Whether the sheet returns what the stack reflects.
    is_mirror: bool,
    /// Scattering models of what else it returns.
    others: Vec<Brdf>,
    rows: Vec<Row>,
}

/// A sheet at one angle of incidence.
#[derive(Clone, Copy, Debug, Default)]
struct Row {
    /// Power of its own echo, unpolarised.
    reflectance: f64,
    /// Range of that echo behind the outer face, m.
    echo_behind_m: f64,
    /// Power that passes, one way, of the polarisations s and p.
    transmittance: [f64; 2],
    /// Apparent lengthening of one way, m.
    delay_m: f64,
}

/// The sheets on a way: the share of the power that passes all of them, and by how much they lengthen it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Passage {
    /// Share of the power of the polarisations s and p.
    transmittance: [f64; 2],
    delay_m: f64,
    /// Number of sheets.
    pub sheets: u8,
}

impl Passage {
    /// A way without sheets.
    pub const FREE: Passage = Passage { transmittance: [1.0; 2], delay_m: 0.0, sheets: 0 };

    /// This way and then another, which meets its sheets in the same plane of incidence.
    pub fn then(self, onward: Passage) -> Passage {
        let [s, p] = self.transmittance;
        let [onward_s, onward_p] = onward.transmittance;
        Passage {
            transmittance: [s * onward_s, p * onward_p],
            delay_m: self.delay_m + onward.delay_m,
            sheets: self.sheets.saturating_add(onward.sheets),
        }
    }

    /// Share of unpolarised power that passes.
    pub fn power_ratio(self) -> f64 {
        let [s, p] = self.transmittance;
        0.5 * (s + p)
    }

    /// Apparent lengthening of the way, m.
    pub fn delay_m(self) -> f64 {
        self.delay_m
    }
}

impl Sheet {
    /// The sheet that a scattering model describes by itself: layers with air behind them, or a sum with such layers as
    /// a part. `None` for any other model, and without thickness.
    pub fn of_law(law: &Brdf, radar: &Radar) -> Option<Sheet> {
        let (stack, others) = match law {
            Brdf::Layered(stack) => (stack, Vec::new()),
            Brdf::Sum(sum) => {
                let mut others = sum.parts.clone();
                let place = others.iter().position(|part| in_air(part).is_some())?;
                others.remove(place);
                (in_air(&sum.parts[place])?, others)
            }
            _ => return None,
        };
        let is_sheet = stack.is_in_air() && stack.thickness_m() > 0.0;
        is_sheet.then(|| Sheet::new(stack.clone(), true, others, radar))
    }

    /// A homogeneous sheet of a thickness, m, and a permittivity, ε′ and ε″. What a smooth surface of `law` reflects is
    /// replaced by what the sheet does; any other model says by itself what the sheet returns.
    pub fn of_thickness(
        law: &Brdf,
        thickness_m: f64,
        permittivity: [f64; 2],
        radar: &Radar,
    ) -> Sheet {
        let mut stack = Layered::sheet(thickness_m, permittivity);
        match law {
            Brdf::Fresnel(smooth) => {
                stack.lobe_rad = smooth.lobe_rad;
                Sheet::new(stack, true, Vec::new(), radar)
            }
            law => Sheet::new(stack, false, vec![law.clone()], radar),
        }
    }

    fn new(stack: Layered, is_mirror: bool, others: Vec<Brdf>, radar: &Radar) -> Sheet {
        let sweep = Sweep::new(radar, &stack);
        let row = |step: usize| {
            sweep.row(&stack, (step as f64 / STEPS as f64 * 90f64.to_radians()).cos())
        };
        let rows = (0..=STEPS).map(row).collect();
        Sheet { stack, is_mirror, others, rows }
    }

    /// The layers.
    pub fn stack(&self) -> &Layered {
        &self.stack
    }

    /// The way through the sheet at an angle of incidence.
    pub(super) fn passage(&self, cos_theta: f64) -> Passage {
        let (row, next, share) = self.rows_at(cos_theta);
        let [s, p] = [0, 1].map(|polarisation| {
            mix(row.transmittance[polarisation], next.transmittance[polarisation], share)
        });
        let delay_m = mix(row.delay_m, next.delay_m, share);
        Passage { transmittance: [s, p], delay_m, sheets: 1 }
    }

    /// Share of the power that the stack reflects, unpolarised, as the radar reads it.
    pub fn reflectance(&self, cos_theta: f64) -> f64 {
        let (row, next, share) = self.rows_at(cos_theta);
        mix(row.reflectance, next.reflectance, share)
    }

    /// Range of the stack's own echo behind its outer face, m: 0 where the outer face returns most, or where a
    /// scattering model says what the sheet returns.
    pub(super) fn echo_behind_m(&self, cos_theta: f64) -> f64 {
        if !self.is_mirror {
            return 0.0;
        }
        // The peak may jump from one face to the other: there is nothing in between.
        let (row, next, share) = self.rows_at(cos_theta);
        if share < 0.5 { row.echo_behind_m } else { next.echo_behind_m }
    }

    /// The rows of the table around an angle, and the share of the second.
    fn rows_at(&self, cos_theta: f64) -> (&Row, &Row, f64) {
        let steps = cos_theta.clamp(0.0, 1.0).acos() / 90f64.to_radians() * STEPS as f64;
        let step = (steps as usize).min(STEPS - 1);
        (&self.rows[step], &self.rows[step + 1], steps - step as f64)
    }
}

/// Thickness times |n|, m; what is denser than n = 10 lets nothing through.
fn optical_m(layer: &Layer) -> f64 {
    let index = layer.eps_real.hypot(layer.eps_imag).sqrt();
    layer.thickness_m * index.clamp(1.0, 10.0)
}

fn in_air(law: &Brdf) -> Option<&Layered> {
    match law {
        Brdf::Layered(stack) if stack.is_in_air() => Some(stack),
        _ => None,
    }
}

fn mix(a: f64, b: f64, share: f64) -> f64 {
    a + share * (b - a)
}

impl Scattering for Sheet {
    fn f_per_sr(&self, i: Direction<Surface>, o: Direction<Surface>) -> f64 {
        self.seen_by(0.0, i, o).f_per_sr
    }

    fn seen_by(&self, beam_rad: f64, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let mut all = Seen::default();
        if i.cos_theta() <= 0.0 || o.cos_theta() <= 0.0 {
            return all;
        }
        if self.is_mirror {
            all = self.stack.seen_with(beam_rad, i, o, |cos| self.reflectance(cos));
        }
        for law in &self.others {
            all = all.and(law.seen_by(beam_rad, i, o));
        }
        all
    }

    fn narrow_lobes(&self, i: Direction<Surface>) -> Vec<NarrowLobe> {
        let mut lobes = Vec::new();
        if self.is_mirror {
            lobes.extend(self.stack.narrow_lobes_with(self.reflectance(i.cos_theta())));
        }
        lobes.extend(self.others.iter().flat_map(|law| law.narrow_lobes(i)));
        lobes
    }

    fn apart_from_narrow_lobes(&self, i: Direction<Surface>, o: Direction<Surface>) -> Seen {
        let mut all = Seen::default();
        if self.is_mirror && !self.stack.is_narrow() && i.cos_theta() > 0.0 && o.cos_theta() > 0.0 {
            all = self.stack.seen_with(0.0, i, o, |cos| self.reflectance(cos));
        }
        for law in &self.others {
            all = all.and(law.apart_from_narrow_lobes(i, o));
        }
        all
    }
}

/// The frequencies of a radar's sweep, and the weights of its window, which add up to 1.
struct Sweep {
    wavenumbers_rad_per_m: Vec<f64>,
    weights: Vec<f64>,
    /// Distance between the places where peaks are looked for, m of one way.
    step_m: f64,
    /// The farthest of them.
    reach_m: f64,
    thickness_m: f64,
}

/// The highest peak of a transform over the sweep.
struct Peak {
    /// Its power in the polarisations s and p.
    powers: [f64; 2],
    /// Its place, m of one way.
    at_m: f64,
}

impl Sweep {
    /// With enough frequencies that no echo from within the stack is taken for one of another place.
    fn new(radar: &Radar, stack: &Layered) -> Sweep {
        const FEWEST: usize = 64;
        const MOST: usize = 4096;
        let chirp = radar.chirp();
        let bin_m = 2.0 * chirp.range_resolution_m();
        let reach_m = bin_m + 2.0 * stack.layers.iter().map(optical_m).sum::<f64>();
        let count = (FEWEST + (8.0 * reach_m / bin_m) as usize).min(MOST);
        let frequency_hz = |number: usize| {
            chirp.centre_frequency_hz + chirp.bandwidth_hz * (number as f64 / count as f64 - 0.5)
        };
        let samples = radar.window().samples(count);
        let sum: f64 = samples.iter().sum();
        let turn = std::f64::consts::TAU / SPEED_OF_LIGHT_M_PER_S;
        Sweep {
            wavenumbers_rad_per_m: (0..count).map(|number| turn * frequency_hz(number)).collect(),
            weights: samples.into_iter().map(|weight| weight / sum).collect(),
            step_m: bin_m / 16.0,
            reach_m,
            thickness_m: stack.thickness_m(),
        }
    }

    /// The table's row at an angle of incidence.
    fn row(&self, stack: &Layered, cos_theta: f64) -> Row {
        let turn = 1.0 / std::f64::consts::TAU * SPEED_OF_LIGHT_M_PER_S;
        let amplitudes = Polarisation::BOTH.map(|polarisation| {
            let at = |k: &f64| stack.amplitudes(polarisation, cos_theta, turn * k);
            self.wavenumbers_rad_per_m.iter().map(at).collect::<Vec<_>>()
        });
        let reflected = [0, 1].map(|polarisation| {
            amplitudes[polarisation].iter().map(|of| of.reflected).collect::<Vec<_>>()
        });
        let air_m = cos_theta * self.thickness_m;
        let transmitted = [0, 1].map(|polarisation| {
            let waves = amplitudes[polarisation].iter().zip(&self.wavenumbers_rad_per_m);
            let beyond_air = waves.map(|(of, k)| of.transmitted * Complex::cis(k * air_m));
            beyond_air.collect::<Vec<_>>()
        });
        let (echo, passed) = (self.peak(&reflected), self.peak(&transmitted));
        Row {
            reflectance: 0.5 * (echo.powers[0] + echo.powers[1]),
            // There and back are one range.
            echo_behind_m: 0.5 * echo.at_m,
            transmittance: passed.powers,
            delay_m: passed.at_m,
        }
    }

    /// The highest peak of the transform of two polarisations together.
    fn peak(&self, waves: &[Vec<Complex<f64>>; 2]) -> Peak {
        let power = |at_m: f64| self.powers(waves, at_m).into_iter().sum::<f64>();
        let places =
            (-16..=(self.reach_m / self.step_m) as i32).map(|n| f64::from(n) * self.step_m);
        let highest = |a: (f64, f64), b: (f64, f64)| if b.1 > a.1 { b } else { a };
        let (mut at_m, _) =
            places.map(|at_m| (at_m, power(at_m))).fold((0.0, f64::NEG_INFINITY), highest);
        // Parabolas through three places that draw together around the top.
        let mut step_m = self.step_m;
        for _ in 0..3 {
            let [before, top, after] = [-1.0, 0.0, 1.0].map(|side| power(at_m + side * step_m));
            let bend = before - 2.0 * top + after;
            let shift = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
            at_m += shift.clamp(-1.0, 1.0) * step_m;
            step_m /= 8.0;
        }
        Peak { powers: self.powers(waves, at_m), at_m }
    }

    /// |Σ w·a(k)·e^{jkx}|² of both polarisations.
    fn powers(&self, waves: &[Vec<Complex<f64>>; 2], at_m: f64) -> [f64; 2] {
        let mut sums = [Complex::from(0.0); 2];
        let [s, p] = waves;
        let (first, second) = (self.wavenumbers_rad_per_m[0], self.wavenumbers_rad_per_m[1]);
        let (mut turned, turn) =
            (Complex::cis(first * at_m), Complex::cis((second - first) * at_m));
        for ((weight, s), p) in self.weights.iter().zip(s).zip(p) {
            let weighted = turned * *weight;
            sums[0] += weighted * s;
            sums[1] += weighted * p;
            turned *= turn;
        }
        sums.map(|sum| sum.norm_sqr())
    }
}
