//! Faults of the transmitter in the range spectrum, against closed forms.

use std::f64::consts::{PI, TAU};

use matdb::radar::random::{Draws, Key, Purpose};
use matdb::radar::{
    Chirp, Leakage, PhaseNoise, RangeProcessor, Receiver, Return, SweepRipple, Window,
};
use num_complex::Complex;
use rayon::prelude::*;

use super::page::{Row, Table, Tolerance::Below};

const CHIRP: Chirp = Chirp {
    centre_frequency_hz: 300e9,
    bandwidth_hz: 27e9,
    duration_s: 100e-6,
    samples: 1024,
    start_phase_rad: 0.0,
};

/// c/2B by hand: 299 792 458/54e9 m.
const CELL_M: f64 = 5.551_712_185_185_185e-3;

/// Power of an echo, W.
const POWER_W: f64 = 1e-6;

/// What the documentation of the detector claims for a Hann window and a transform of twice the length, µm and dB.
const DETECTOR: [f64; 2] = [9.1, 0.014];

/// β is taken as 2π·Δf·τ; the sine that stands there falls short by (π·m·τ/T)²/6, 1.3e-4 of it.
const RIPPLE_DB: f64 = 0.003;

/// Sweeps over which a pedestal is averaged.
const SWEEPS: u64 = 2000;

/// Bins on either side of an offset over which it is averaged, too.
const NEAR: usize = 10;

/// Standard errors that a mean may be off by.
const SIGMAS: f64 = 4.0;

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

fn draws(sweep: u64) -> Draws {
    Key { seed: 2017, chirp: sweep, sub_ray: 0, purpose: Purpose::Noise }.draws()
}

fn quiet(window: Window, zero_padding: usize) -> Receiver {
    Receiver { window, zero_padding, temperature_k: 0.0, ..Receiver::default() }
}

fn processor(receiver: &Receiver) -> RangeProcessor {
    RangeProcessor::new(receiver, &CHIRP, -200.0, 1).unwrap()
}

/// An echo in a bin of the unpadded spectrum, and its delay, s.
fn echo(bin: usize) -> (Return, f64) {
    let range_m = bin as f64 * CELL_M;
    let amplitude_sqrt_w = Complex::from(POWER_W.sqrt());
    (Return { range_m, amplitude_sqrt_w }, bin as f64 / CHIRP.bandwidth_hz)
}

/// Largest errors of range, µm, and power, dB, of a leak at 100 positions between two bins.
fn leaks() -> Vec<Row> {
    let mut most = [0.0; 2];
    for step in 0..100 {
        let range_m = (20.0 + f64::from(step) / 100.0) * CELL_M;
        let leakage = Some(Leakage { power_dbm: -40.0, range_m });
        let processor = processor(&Receiver { leakage, ..quiet(Window::Hann, 2) });
        let found = processor.detect(&processor.beat_signal(&[], &mut draws(0)).unwrap()).unwrap();
        let errors = [1e6 * (found.range_m - range_m), db(found.power_w / 1e-7)];
        most = [0, 1].map(|which| f64::max(most[which], errors[which].abs()));
    }
    let row = |(what, found, allowed, unit): (&str, f64, f64, &'static str)| {
        Row::new(format!("leakage: worst error of {what}"), found, Below(allowed)).unit(unit)
    };
    [("range", most[0], DETECTOR[0], "µm"), ("power", most[1], DETECTOR[1], "dB")].map(row).into()
}

/// Bessel's J_n by its power series, for small x.
fn bessel(order: u32, x: f64) -> f64 {
    let mut term = (1..=order).map(|n| 0.5 * x / f64::from(n)).product::<f64>();
    let mut sum = term;
    for k in 1..40 {
        let k = f64::from(k);
        term *= -0.25 * x * x / (k * (k + f64::from(order)));
        sum += term;
    }
    sum
}

/// Paired echoes of a rippled sweep against J_n²(2π·Δf·τ).
fn ripples() -> Vec<Row> {
    const BIN: usize = 600;
    const CYCLES: usize = 40;
    let (echo, delay_s) = echo(BIN);
    let mut rows = Vec::new();
    for mhz in [0.1, 2.0, 10.0] {
        let frequency_error_hz = 1e6 * mhz;
        let sweep_ripple = Some(SweepRipple { frequency_error_hz, cycles: CYCLES as f64 });
        let processor = processor(&Receiver { sweep_ripple, ..quiet(Window::Rectangular, 1) });
        let profile_w =
            processor.profile_w(&processor.beat_signal(&[echo], &mut draws(0)).unwrap());
        let beta = TAU * frequency_error_hz * delay_s;
        for (bin, order) in [(BIN, 0), (BIN + CYCLES, 1), (BIN - CYCLES, 1)] {
            let error_db = db(profile_w[bin] / POWER_W / bessel(order, beta).powi(2)).abs();
            let what = format!(
                "Δf = {mhz} MHz, {} cells from the echo: level in a rippled sweep",
                bin as i64 - BIN as i64
            );
            rows.push(Row::new(what, error_db, Below(RIPPLE_DB)).unit("dB"));
        }
    }
    rows
}

/// The pedestal of phase noise against 4·sin²(π·f·τ)·L(f)·B_n/T.
fn pedestals() -> Vec<Row> {
    const BIN: usize = 500;
    let noise = PhaseNoise { level_dbc_per_hz: -85.0, offset_hz: 1e5 };
    let processor = processor(&Receiver { phase_noise: Some(noise), ..quiet(Window::Hann, 1) });
    let (echo, delay_s) = echo(BIN);
    let profile_w = |sweep: u64| {
        processor.profile_w(&processor.beat_signal(&[echo], &mut draws(sweep)).unwrap())
    };
    let profiles_w: Vec<Vec<f64>> = (0..SWEEPS).into_par_iter().map(profile_w).collect();
    let density_per_hz = |offset_hz: f64| 10f64.powf(-8.5) * (1e5 / offset_hz).powi(2);
    let mut rows = Vec::new();
    for away in [40, 150, 400] {
        let offsets = away - NEAR..=away + NEAR;
        let count = (2 * NEAR + 1) as f64;
        let expected: f64 = offsets
            .clone()
            .map(|cells| {
                let offset_hz = cells as f64 / CHIRP.duration_s;
                let range = 4.0 * (PI * offset_hz * delay_s).sin().powi(2);
                range * density_per_hz(offset_hz) * 1.5 / CHIRP.duration_s
            })
            .sum();
        let found_w: f64 =
            profiles_w.iter().flat_map(|w| offsets.clone().map(|cells| w[BIN + cells])).sum();
        // Neighbouring bins of a Hann window share 4/9 of their power's variance, the next ones 1/36.
        let independent = count * SWEEPS as f64 / (1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0));
        let allowed_db = db(1.0 + SIGMAS / independent.sqrt());
        let error_db = db(found_w / SWEEPS as f64 / POWER_W / expected).abs();
        let what = format!("{away} cells from the echo: pedestal of phase noise");
        let allowed = Below((1e3 * allowed_db).ceil() / 1e3);
        rows.push(Row::new(what, error_db, allowed).unit("dB"));
    }
    rows
}

pub fn tables() -> Vec<Table> {
    let text = "Faults of the transmitter, 1024 samples. Leakage is an echo at its range, within the errors of the detector. A ripple of Δf \
                and 40 cycles in the sweep gives an echo at 3.33 m a pair of others, 40 cells before and behind, of J₁²(β) of its power, and \
                leaves it J₀²(β), β = 2π·Δf·τ; that is 1.3e-4 more than the exact β, hence 0.003 dB. Phase noise of −85 dBc/Hz at 100 kHz leaves \
                4·sin²(π·f·τ)·L(f)·B_n/T in a bin at the offset f, B_n = 1.5 bins. The tolerance is four standard errors \
                of 2000 sweeps and 21 bins.";
    let mut rows = leaks();
    rows.extend(ripples());
    rows.extend(pedestals());
    vec![Table { text: text.to_owned(), rows }]
}
