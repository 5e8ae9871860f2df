//! Sheets: regions that let a part of the wave through, such as cloth.
//!
//! A sheet is a stack of layers in air, with the complex amplitudes r(f) and t(f) of a plane wave. The radar sweeps f,
//! and what it reads is a windowed Fourier transform over the sweep:
//!
//! - The echo of the sheet itself is the highest peak of |Σ w·r(f)·e^{2jkx}/Σ w|² over the range x. The mean of |r|²
//!   would count the echoes of both faces together: −9.96 dB in place of −12.9 dB for 8 mm of n = 1.6.
//! - On the way through, the amplitudes are the Σ w·t(f)·e^{jk(cos θ·d + x)}/Σ w of s and p, at the x of the highest
//!   peak of their power, and the echoes of what lies behind seem x farther away each way, (√(n² − sin²θ) − cos θ)·d for
//!   a thin sheet. There and back the amplitude of s or p is squared. A ray goes straight on.
//!
//! Both are tabulated over the angle of incidence.

use glam::DVec3;
use nalgebra::Complex;

use crate::brdf::{
    Brdf, Layer, Layered, NarrowLobe, Polarisation, Scattering, Seen, albedo, mirror_cosine,
};
use crate::frames::{Direction, Surface};
use crate::radar::Radar;
use crate::radar::jones::{Field, Filter};
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
    /// Amplitudes of that echo in the polarisations s and p.
    reflected: [Complex<f64>; 2],
    /// Range of that echo behind the outer face, m.
    echo_behind_m: f64,
    /// Amplitudes that pass, one way, of the polarisations s and p. That of s is real: only their ratio counts.
    transmitted: [Complex<f64>; 2],
    /// Apparent lengthening of one way, m.
    delay_m: f64,
}

/// The sheets on a straight way: what they do to a field, and by how much they lengthen it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Passage {
    /// `None` without sheets.
    filter: Option<Filter>,
    delay_m: f64,
    /// Number of sheets.
    pub sheets: u8,
}

impl Passage {
    /// A way without sheets.
    pub const FREE: Passage = Passage { filter: None, delay_m: 0.0, sheets: 0 };

    /// This way and then another in the same direction.
    pub fn then(self, onward: Passage) -> Passage {
        let filter = match (self.filter, onward.filter) {
            (Some(first), Some(second)) => Some(first.then(second)),
            (first, second) => first.or(second),
        };
        Passage {
            filter,
            delay_m: self.delay_m + onward.delay_m,
            sheets: self.sheets.saturating_add(onward.sheets),
        }
    }

    /// The same way back.
    pub fn reversed(self) -> Passage {
        Passage { filter: self.filter.map(Filter::reversed), ..self }
    }

    /// A field at the end of the way.
    pub fn pass(self, field: Field) -> Field {
        self.filter.map_or(field, |filter| field.through(filter))
    }

    /// Share of the power of a field along a unit vector that passes.
    fn passed_along(self, field: DVec3) -> f64 {
        self.filter.map_or(1.0, |filter| Field::linear(field).through(filter).power())
    }

    /// Share of unpolarised power that passes.
    fn power_ratio(self) -> f64 {
        self.filter.map_or(1.0, Filter::power_ratio)
    }

    /// Apparent lengthening of the way, m.
    pub fn delay_m(self) -> f64 {
        self.delay_m
    }
}

/// Share of the power that passes the ways to, between and from diffuse surfaces, for an antenna that sends and receives
/// fields along unit vectors.
pub(super) fn passed_share(sent: DVec3, received: DVec3, ways: &[Passage]) -> f64 {
    let [first, between @ .., last] = ways else { return 1.0 };
    let between: f64 = between.iter().map(|way| way.power_ratio()).product();
    first.passed_along(sent) * between * last.reversed().passed_along(received)
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

    /// The way through the sheet along a unit vector, where its unit normal is this.
    pub(super) fn passage(&self, along: DVec3, normal: DVec3) -> Passage {
        let (row, next, share) = self.rows_at(along.dot(normal).abs());
        let transmitted = [0, 1].map(|polarisation| {
            let [from, to] = [row, next].map(|row| row.transmitted[polarisation]);
            from + (to - from) * share
        });
        let filter = Filter::of_sheet(along, normal, transmitted);
        let delay_m = mix(row.delay_m, next.delay_m, share);
        Passage { filter: Some(filter), delay_m, sheets: 1 }
    }

    /// Share of the power that the stack reflects, unpolarised, as the radar reads it.
    pub fn reflectance(&self, cos_theta: f64) -> f64 {
        let (row, next, share) = self.rows_at(cos_theta);
        mix(row.reflectance, next.reflectance, share)
    }

    /// Share of the power that passes one way, unpolarised, as the radar reads it.
    pub fn transmittance(&self, cos_theta: f64) -> f64 {
        let (row, next, share) = self.rows_at(cos_theta);
        mix(0.5 * power(row.transmitted), 0.5 * power(next.transmitted), share)
    }

    /// Share of the power that returns in all directions at an incidence, rad.
    pub fn albedo(&self, theta_rad: f64) -> f64 {
        let others: f64 = self.others.iter().map(|law| albedo(law, theta_rad)).sum();
        if self.is_mirror { others + self.reflectance(theta_rad.cos()) } else { others }
    }

    /// Range of the stack's own echo behind its outer face, m: 0 where the outer face returns most, or where a
    /// scattering model says what the sheet returns.
    pub(super) fn echo_behind_m(&self, cos_theta: f64) -> f64 {
        if !self.is_mirror {
            return 0.0;
        }
        self.nearest_row(cos_theta).echo_behind_m
    }

    /// The row of the table next to an angle: the peak may jump from one face to the other, and nothing lies between.
    fn nearest_row(&self, cos_theta: f64) -> &Row {
        let (row, next, share) = self.rows_at(cos_theta);
        if share < 0.5 { row } else { next }
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

/// Power of both polarisations together.
fn power([s, p]: [Complex<f64>; 2]) -> f64 {
    s.norm_sqr() + p.norm_sqr()
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

    fn facet_amplitudes(&self, i: Direction<Surface>, o: Direction<Surface>) -> [Complex<f64>; 2] {
        match self.others.first() {
            Some(law) if !self.is_mirror => law.facet_amplitudes(i, o),
            _ => self.nearest_row(mirror_cosine(i, o)).reflected,
        }
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
    /// Its amplitudes in the polarisations s and p.
    amplitudes: [Complex<f64>; 2],
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
        let [t_s, t_p] = passed.amplitudes;
        Row {
            reflectance: 0.5 * power(echo.amplitudes),
            reflected: echo.amplitudes,
            // There and back are one range.
            echo_behind_m: 0.5 * echo.at_m,
            transmitted: [t_s.norm().into(), t_p * Complex::cis(-t_s.arg())],
            delay_m: passed.at_m,
        }
    }

    /// The highest peak of the transform of two polarisations together.
    fn peak(&self, waves: &[Vec<Complex<f64>>; 2]) -> Peak {
        let power = |at_m: f64| power(self.amplitudes(waves, at_m));
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
        Peak { amplitudes: self.amplitudes(waves, at_m), at_m }
    }

    /// Σ w·a(k)·e^{jkx} of both polarisations.
    fn amplitudes(&self, waves: &[Vec<Complex<f64>>; 2], at_m: f64) -> [Complex<f64>; 2] {
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
        sums
    }
}
