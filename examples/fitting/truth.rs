//! Synthetic curves of a known truth, drawn by steps that share nothing with the fits.

use std::f64::consts::{PI, SQRT_2};

use matdb::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Scattering, Shadowing};
use matdb::material::Observation;
use matdb::measure::curve::Curve;
use matdb::radar::random::{Key, Purpose};
use matdb::radar::{Link, Radar};
use matdb::units::watts_from_dbm;

/// What is to be found again.
pub const TRUTH: [(&str, f64); 4] =
    [("diffuse.alpha", 6.0), ("specular.m", 0.07), ("S", 0.05), ("R", 0.0016)];
pub const CHIRPS: u32 = 1500;
const RANGE_M: f64 = 8.0;
const THRESHOLD_DBM: f64 = -77.0;
const WIDEST_DEG: f64 = 70.0;

/// The paper's mixture of the values in [`TRUTH`]'s order, with k = 0.1.
pub fn mixture([alpha, m, s, r]: [f64; 4]) -> Brdf {
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

pub fn truth() -> Brdf {
    mixture(TRUTH.map(|(_, value)| value))
}

/// Where every search begins.
pub fn start() -> Brdf {
    mixture([3.0, 0.1, 0.02, 0.004])
}

/// What is measured: angles uniform from 0° to 70°, two tilts of the normal, speckle, a threshold.
#[derive(Clone, Copy)]
pub struct Case {
    pub looks: f64,
    pub theta_sd_deg: f64,
}

impl Case {
    /// No two cases and seeds share a draw.
    pub fn curve(&self, seed: u64) -> Curve {
        let seed = seed + 1_000_000 * self.looks as u64 + 100_000 * self.theta_sd_deg as u64;
        let observations = (0..CHIRPS).map(|chirp| self.row(&truth(), seed, chirp)).collect();
        Curve { observations, ..Curve::default() }
    }

    fn row(&self, truth: &Brdf, seed: u64, chirp: u32) -> Observation {
        let key = Key { seed, chirp: chirp.into(), sub_ray: 0, purpose: Purpose::Speckle };
        let mut draws = key.draws();
        let theta_sd_rad = self.theta_sd_deg.to_radians();
        let theta_rad = (WIDEST_DEG * draws.uniform()).to_radians();
        let tilt = draws.complex_gaussian() * SQRT_2 * theta_sd_rad;
        let true_rad = (theta_rad + tilt.re).hypot(tilt.im).min(PI / 2.0);
        // The study's radar has an antenna of 0.196 m² at 8 m and a loss of 15 dB.
        let radar = Radar { system_loss_db: 15.0, ..Radar::default() };
        let solid_angle_sr = 0.196 / (RANGE_M * RANGE_M);
        let watts_per_sigma0 = Link::new(&radar).flux_w(1.0) * solid_angle_sr / (4.0 * PI);
        let received_w = watts_per_sigma0 * truth.sigma0(true_rad) * draws.gamma(self.looks);
        let threshold_w = watts_from_dbm(THRESHOLD_DBM);
        let power_w = received_w.max(threshold_w);
        let censored = received_w < threshold_w;
        let sigma0 = power_w / watts_per_sigma0;
        Observation {
            theta_sd_rad: Some(theta_sd_rad),
            power_w: Some(power_w),
            range_m: Some(RANGE_M),
            chirp: Some(chirp),
            ..Observation::of_level(theta_rad, sigma0, censored)
        }
    }
}
