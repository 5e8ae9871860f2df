//! Bias and coverage of every fit on synthetic curves of a known truth, as a Markdown table.
//!
//!     cargo run --release --example fitting -- 200
//!
//! The truth is the paper's mixture with m = 0.07, α = 6, S = 0.05, R = 0.0016; 1500 chirps at angles
//! from 0° to 70°, each tilted by the angle error in two directions, speckled by L looks and cut at
//! −77 dBm at 8 m. Everything is synthetic. Coverage is the share of seeds whose 95 % interval holds
//! the truth, in percent; an interval that was not given counts as a miss.

use std::f64::consts::{PI, SQRT_2};
use std::time::Instant;

use matdb::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Scattering, Shadowing};
use matdb::fit::{Fit, FitResult, Method};
use matdb::measure::curve::{Curve, Row};
use matdb::radar::random::{Key, Purpose};
use matdb::radar::{Link, Radar};
use matdb::units::{db_from_ratio, watts_from_dbm};

const TRUTH: [(&str, f64); 4] =
    [("specular.m", 0.07), ("diffuse.alpha", 6.0), ("S", 0.05), ("R", 0.0016)];
const CHIRPS: u32 = 1500;
const RANGE_M: f64 = 8.0;
const THRESHOLD_DBM: f64 = -77.0;

fn mixture([m, alpha, s, r]: [f64; 4]) -> Brdf {
    let specular = CookTorrance {
        f_lambda: s / 0.9,
        m,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    };
    let diffuse = Box::new(Brdf::BlinnPhong(BlinnPhong { r_s: r / 0.1, alpha }));
    Brdf::Mixture(Mixture { k: 0.1, diffuse, specular: Box::new(Brdf::CookTorrance(specular)) })
}

fn curve(truth: &Brdf, looks: f64, theta_sd_deg: f64, seed: u64) -> Curve {
    let watts_per_sigma0 = Link::new(&Radar::default()).power_w(RANGE_M, 1.0, 1.0) / (4.0 * PI);
    let threshold_w = watts_from_dbm(THRESHOLD_DBM);
    let theta_sd_rad = theta_sd_deg.to_radians();
    let row = |chirp: u32| {
        let key = Key { seed, chirp: chirp.into(), sub_ray: 0, purpose: Purpose::Speckle };
        let mut draws = key.draws();
        let theta_rad = (70.0 * draws.uniform()).to_radians();
        let tilt = draws.complex_gaussian() * SQRT_2 * theta_sd_rad;
        let truth_rad = (theta_rad + tilt.re).hypot(tilt.im).min(PI / 2.0);
        let received_w = watts_per_sigma0 * truth.sigma0(truth_rad) * draws.gamma(looks);
        let power_w = received_w.max(threshold_w);
        let censored = received_w < threshold_w;
        let sigma0 = power_w / watts_per_sigma0;
        Row { theta_rad, theta_sd_rad, power_w, sigma0, range_m: RANGE_M, chirp, censored }
    };
    Curve { rows: (0..CHIRPS).map(row).collect() }
}

fn methods(theta_sd_deg: f64, looks: f64) -> [(&'static str, Fit); 4] {
    let fit = |method| Fit { method, ..Fit::default() };
    let level_sd_db = matdb::radar::speckle::standard_deviation_db(looks);
    let tls = Method::Tls { theta_sd_rad: theta_sd_deg.to_radians(), level_sd_db };
    let by_hand = vec![("diffuse.alpha".to_owned(), 6.0)];
    [
        ("piecewise MSE", fit(Method::Mse { split_rad: 6f64.to_radians() })),
        ("TLS", fit(tls)),
        ("TLS, true α by hand", Fit { fixed: by_hand, ..fit(tls) }),
        ("censored", fit(Method::Censored)),
    ]
}

/// Sums over the seeds of one method in one case.
#[derive(Default)]
struct Tally {
    alpha: f64,
    at_55_db: f64,
    covered: [u32; 4],
    looks: Option<f64>,
    unconverged: u32,
    seconds: f64,
}

impl Tally {
    fn add(&mut self, found: &FitResult, truth: &Brdf) {
        let at_55 = 55f64.to_radians();
        self.at_55_db += db_from_ratio(found.model.sigma0(at_55) / truth.sigma0(at_55));
        self.alpha += found.estimate("diffuse.alpha").map_or(6.0, |e| e.value);
        self.looks = found.looks.map(|looks| self.looks.unwrap_or(0.0) + looks);
        self.unconverged += u32::from(!found.converged);
        for (count, (name, value)) in self.covered.iter_mut().zip(TRUTH) {
            let interval = found.estimate(name).and_then(|e| e.interval_95);
            *count += u32::from(interval.is_some_and(|[a, b]| a <= value && value <= b));
        }
    }

    fn print(&self, looks: f64, theta_sd_deg: f64, method: &str, seeds: u64) {
        let n = seeds as f64;
        let mean_looks = self.looks.map_or("".to_owned(), |looks| format!("{:.2}", looks / n));
        let [m, alpha, s, r] = self.covered.map(|count| 100.0 * f64::from(count) / n);
        println!(
            "| {looks} | {theta_sd_deg} | {method} | {:+.2} | {:+.2} | {m:.0} | {alpha:.0} | {s:.0} | \
             {r:.0} | {mean_looks} | {} | {:.0} |",
            self.alpha / n - 6.0,
            self.at_55_db / n,
            self.unconverged,
            1e3 * self.seconds / n
        );
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let seeds: u64 = std::env::args().nth(1).map_or(Ok(20), |text| text.parse())?;
    let truth = mixture(TRUTH.map(|(_, value)| value));
    let start = mixture([0.1, 3.0, 0.02, 0.004]);
    println!("{seeds} seeds, {CHIRPS} chirps each, synthetic\n");
    println!(
        "| L | angle error, ° | method | bias of α | bias at 55°, dB | covers m | α | S | R | mean L | \
         not converged | ms |"
    );
    println!("|{}", "--:|".repeat(12));
    for looks in [1.0, 2.0, 4.0, 8.0] {
        for theta_sd_deg in [0.0, 1.0, 3.0] {
            for (name, fit) in methods(theta_sd_deg, looks) {
                let mut tally = Tally::default();
                for seed in 0..seeds {
                    let curve = curve(&truth, looks, theta_sd_deg, seed);
                    let began = Instant::now();
                    let found = fit.run(&start, &curve)?;
                    tally.seconds += began.elapsed().as_secs_f64();
                    tally.add(&found, &truth);
                }
                tally.print(looks, theta_sd_deg, name, seeds);
            }
        }
    }
    Ok(())
}
