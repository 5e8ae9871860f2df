//! From beat signal to detection, and speckle, against theory.

use matdb::radar::random::{Draws, Key, Purpose};
use matdb::radar::{Chirp, IndependentSpeckle, RangeProcessor, Receiver, Return, Window};
use num_complex::Complex;
use rayon::prelude::*;

use super::page::{Row, Section, Table, Tolerance, Tolerance::Below, Tolerance::Within};
use super::transmitter;

/// Window; half-power width in bins (Harris 1978, table I); scalloping loss in dB and noise
/// bandwidth in bins (Heinzel et al. 2002); largest errors of range (µm) and power (dB) that
/// the documentation of the detector claims for a transform of twice the length.
const WINDOWS: [(Window, f64, f64, f64, [f64; 2]); 4] = [
    (Window::Rectangular, 0.89, 3.9224, 1.0, [58.0, 0.29]),
    (Window::Hann, 1.44, 1.4236, 1.5, [9.1, 0.014]),
    (Window::Hamming, 1.30, 1.7514, 1.3628, [9.3, 0.018]),
    (Window::BlackmanHarris, 1.90, 0.8256, 2.0044, [2.2, 0.002]),
];

/// Two figures of the published widths, and the reading between bins.
const WIDTH_BINS: f64 = 0.01;

/// The published losses' last figure, and 256 samples in place of endlessly many.
const SCALLOPING_DB: f64 = 0.001;

/// Standard deviations within which a count or a mean of draws must lie.
const SIGMAS: f64 = 4.0;

const POWER_W: f64 = 1e-9;
const CHIRP: Chirp = Chirp {
    centre_frequency_hz: 300e9,
    bandwidth_hz: 27e9,
    duration_s: 100e-6,
    samples: 256,
    start_phase_rad: 0.0,
};
const QUIET: Receiver = Receiver {
    window: Window::Hann,
    zero_padding: 1,
    noise_figure_db: 20.0,
    temperature_k: 0.0,
    false_alarm_probability: None,
    gate_m: None,
    leakage: None,
    phase_noise: None,
    sweep_ripple: None,
};

/// c/2B by hand: 299 792 458/54e9 m.
const CELL_M: f64 = 5.551_712_185_185_185e-3;

pub fn around(centre: f64, half: f64) -> Tolerance {
    let step = 10f64.powi(half.log10().floor() as i32 - 1);
    let rounded = |x: f64| format!("{:.*e}", 3, (x / step).round() * step).parse().unwrap();
    Within(rounded(centre - half), rounded(centre + half))
}

fn db(ratio: f64) -> f64 {
    10.0 * ratio.log10()
}

fn beat(cells: f64) -> Vec<Complex<f64>> {
    let amplitude_sqrt_w = Complex::from(POWER_W.sqrt());
    CHIRP.beat_signal(&[Return { range_m: cells * CELL_M, amplitude_sqrt_w }]).unwrap()
}

fn processor(receiver: Receiver) -> RangeProcessor {
    RangeProcessor::new(&receiver, &CHIRP, -200.0, 1).unwrap()
}

/// Half-power width in cells, read off a padded spectrum linearly between its bins.
fn width_cells(window: Window) -> f64 {
    let profile_w =
        processor(Receiver { window, zero_padding: 16, ..QUIET }).profile_w(&beat(100.0));
    let last = (1600..).find(|&k| profile_w[k + 1] < 0.5 * POWER_W).unwrap();
    let part = (profile_w[last] - 0.5 * POWER_W) / (profile_w[last] - profile_w[last + 1]);
    2.0 * ((last - 1600) as f64 + part) / 16.0
}

/// What a return midway between two bins loses in both, dB.
fn scalloping_db(window: Window) -> f64 {
    -db(processor(Receiver { window, ..QUIET }).profile_w(&beat(100.5))[100] / POWER_W)
}

/// Largest errors of range, µm, and power, dB, over positions between two bins.
fn bias(window: Window) -> [f64; 2] {
    let processor = processor(Receiver { window, zero_padding: 2, ..QUIET });
    let errors = (0..100).map(|step| {
        let cells = 100.0 + f64::from(step) / 100.0;
        let found = processor.detect(&beat(cells)).unwrap();
        [1e6 * (found.range_m - cells * CELL_M), db(found.power_w / POWER_W)].map(f64::abs)
    });
    errors.fold([0.0, 0.0], |[a, b], [x, y]| [f64::max(a, x), f64::max(b, y)])
}

fn draws(chirp: u64, purpose: Purpose) -> Draws {
    Key { seed: 2017, chirp, sub_ray: 0, purpose }.draws()
}

fn noise(processor: &RangeProcessor, chirp: u64) -> Vec<Complex<f64>> {
    let mut signal = vec![Complex::ZERO; CHIRP.samples];
    processor.add_noise(&mut signal, &mut draws(chirp, Purpose::Noise));
    signal
}

const NOISE_CHIRPS: usize = 2000;

/// Mean power of noise in a bin over k·290 K·20 dB·B_n/T, dB.
fn noise_db(window: Window, bandwidth_bins: f64) -> f64 {
    let processor = processor(Receiver { window, temperature_k: 290.0, ..QUIET });
    let chirp_w: Vec<f64> = (0..NOISE_CHIRPS as u64)
        .into_par_iter()
        .map(|chirp| processor.profile_w(&noise(&processor, chirp)).iter().sum())
        .collect();
    let mean_w = chirp_w.iter().sum::<f64>() / (NOISE_CHIRPS * CHIRP.samples) as f64;
    db(mean_w / (1.380_649e-23 * 290.0 * 100.0 * bandwidth_bins / CHIRP.duration_s))
}

fn false_alarm_rate(window: Window, probability: f64, chirps: u64) -> f64 {
    let false_alarm_probability = Some(probability);
    let noisy = Receiver { window, zero_padding: 2, temperature_k: 290.0, ..QUIET };
    let processor = processor(Receiver { false_alarm_probability, ..noisy });
    let alarm = |chirp: &u64| processor.detect(&noise(&processor, *chirp)).is_some();
    (0..chirps).into_par_iter().filter(alarm).count() as f64 / chirps as f64
}

fn window_rows() -> Vec<Row> {
    let mut rows = Vec::new();
    for (window, width, loss_db, ..) in WINDOWS {
        let what = format!("{window:?}: half-power width");
        let row = Row::new(what, width_cells(window), around(width, WIDTH_BINS));
        rows.push(row.digits(3).unit("× c/2B"));
        let what = format!("{window:?}: loss midway between two bins");
        let row = Row::new(what, scalloping_db(window), around(loss_db, SCALLOPING_DB));
        rows.push(row.digits(3).unit("dB"));
    }
    rows
}

fn bias_rows() -> Vec<Row> {
    let rows = WINDOWS.iter().flat_map(|&(window, _, _, _, [range_um, power_db])| {
        let [found_um, found_db] = bias(window);
        [
            Row::new(format!("{window:?}: worst error of range"), found_um, Below(range_um))
                .unit("µm"),
            Row::new(format!("{window:?}: worst error of power"), found_db, Below(power_db))
                .unit("dB"),
        ]
    });
    rows.collect()
}

fn noise_rows() -> Vec<Row> {
    // The mean is one of exponential powers weighted by w²: its deviation is below √(2/n).
    let deviation = (2.0 / (NOISE_CHIRPS * CHIRP.samples) as f64).sqrt();
    let mut rows: Vec<Row> = WINDOWS
        .iter()
        .map(|&(window, _, _, bandwidth_bins, _)| {
            let what = format!("{window:?}: mean of noise in a bin against kTF·B_n");
            let allowed = around(0.0, db(1.0 + SIGMAS * deviation));
            Row::new(what, noise_db(window, bandwidth_bins), allowed).unit("dB")
        })
        .collect();
    for (window, probability, chirps) in [
        (Window::Hann, 1e-2, 40_000),
        (Window::BlackmanHarris, 1e-2, 40_000),
        (Window::Hann, 1e-3, 40_000),
    ] {
        let what = format!("{window:?}: false alarms for {probability} asked, {chirps} chirps");
        let deviation = (probability / chirps as f64).sqrt();
        let allowed = around(probability, SIGMAS * deviation);
        rows.push(Row::new(what, false_alarm_rate(window, probability, chirps), allowed));
    }
    rows
}

const FACTORS: usize = 40_000;

fn factors(speckle: IndependentSpeckle) -> Vec<f64> {
    let mut draws = draws(speckle.looks as u64, Purpose::Speckle);
    (0..FACTORS).map(|_| speckle.intensity_factor(&mut draws)).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn deviation(values: &[f64]) -> f64 {
    let centre = mean(values);
    (values.iter().map(|x| (x - centre).powi(2)).sum::<f64>() / values.len() as f64).sqrt()
}

/// L; the mean offset and standard deviation of developed speckle, dB: 10/ln 10 times ψ(L) − ln L and √ψ′(L).
const SPECKLE_DB: [(f64, f64, f64); 4] =
    [(1.0, -2.507, 5.570), (2.0, -1.174, 3.488), (4.0, -0.568, 2.313), (8.0, -0.278, 1.585)];

fn speckle_rows() -> Vec<Row> {
    let root = (FACTORS as f64).sqrt();
    let mut rows = Vec::new();
    for (looks, offset_db, deviation_db) in SPECKLE_DB {
        let factors = factors(IndependentSpeckle { looks, coherent_ratio: 0.0 });
        let contrast = deviation(&factors) / mean(&factors);
        // The deviation of an exponential's contrast is 1/√n, that of calmer laws is less.
        let allowed = around(1.0 / looks.sqrt(), SIGMAS / root);
        rows.push(Row::new(format!("L = {looks}: contrast"), contrast, allowed).digits(3));
        let levels_db: Vec<f64> = factors.iter().map(|&factor| db(factor)).collect();
        let allowed = around(offset_db, SIGMAS * deviation_db / root);
        let what = format!("L = {looks}: mean of the decibels");
        rows.push(Row::new(what, mean(&levels_db), allowed).digits(3).unit("dB"));
        // The decibels are skewed, which widens the law of their deviation less than twice.
        let allowed = around(deviation_db, 2.0 * SIGMAS * deviation_db / root);
        let what = format!("L = {looks}: standard deviation of the decibels");
        rows.push(Row::new(what, deviation(&levels_db), allowed).digits(3).unit("dB"));
    }
    let calm = factors(IndependentSpeckle { looks: 1.0, coherent_ratio: 4.0 });
    // √(1 + 2K)/(1 + K) with K = 4.
    let what = "L = 1, coherent part four times the diffuse: contrast";
    rows.push(Row::new(what, deviation(&calm) / mean(&calm), around(0.6, SIGMAS / root)).digits(3));
    rows
}

pub fn section() -> Section {
    let table = |text: &str, rows| Table { text: text.to_owned(), rows };
    let mut tables = vec![
        table(
            "Resolution: the half-power width of a return (27 GHz, c/2B = 5.55 mm, 256 samples) against Harris 1978 \
             (doi:10.1109/PROC.1978.10837, two figures), and the loss of a return midway between two bins of the unpadded \
             spectrum against Heinzel, Rüdiger and Schilling 2002 (four figures; 256 samples are not endlessly many).",
            window_rows(),
        ),
        table(
            "Bias: a return without noise at 100 positions between two bins, with a transform of twice the length and a \
             parabola through three bins. The tolerances are what the detector's documentation claims.",
            bias_rows(),
        ),
        table(
            "Noise: F = 20 dB and 290 K, B_n from Heinzel et al.; counts and means of seeded draws within four standard \
             deviations. False alarms are counted over the whole unambiguous range.",
            noise_rows(),
        ),
        table(
            "Speckle: 40 000 seeded draws against 1/√L, 10/ln 10·(ψ(L) − ln L) and 10/ln 10·√ψ′(L) (Goodman 2007), within \
             four standard deviations.",
            speckle_rows(),
        ),
    ];
    tables.extend(transmitter::tables());
    let not_covered = vec![
        "Faults of a chirp other than leakage, phase noise that falls by 20 dB per decade, and a ripple of the sweep.",
    ];
    Section { title: "The chirp chain", tables, not_covered }
}
