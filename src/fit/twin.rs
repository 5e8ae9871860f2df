//! Synthetic curves of a known truth, drawn by steps that share nothing with the fits.
//!
//! A measured angle uniform over the scan, a true normal tilted away from it in two directions, a
//! Gamma factor of speckle, a threshold in power at 8 m: (measured tilt) + (error) is the truth, as for a
//! mesh that smooths a rough surface.

use crate::brdf::{BlinnPhong, Brdf, CookTorrance, Distribution, Mixture, Scattering, Shadowing};
use crate::material::Observation;
use crate::measure::curve::Curve;
use crate::radar::random::{Key, Purpose};
use crate::radar::{Link, Radar};
use crate::units::watts_from_dbm;

const RANGE_M: f64 = 8.0;

/// The paper's mixture from the four parameters that backscatter determines, with k = 0.1.
pub(crate) fn mixture(m: f64, alpha: f64, s: f64, r: f64) -> Brdf {
    let specular = CookTorrance {
        f_lambda: s / 0.9,
        m,
        m_across: None,
        distribution: Distribution::Beckmann,
        shadowing: Shadowing::Separable,
    };
    let diffuse = Brdf::BlinnPhong(BlinnPhong { r_s: r / 0.1, alpha });
    let specular = Box::new(Brdf::CookTorrance(specular));
    Brdf::Mixture(Mixture { k: 0.1, diffuse: Box::new(diffuse), specular })
}

/// A true model and how it is measured.
#[derive(Clone, Debug)]
pub(super) struct Twin {
    pub model: Brdf,
    pub rows: usize,
    pub looks: f64,
    pub theta_sd_deg: f64,
    pub threshold_dbm: f64,
    pub theta_deg: [f64; 2],
}

impl Default for Twin {
    fn default() -> Self {
        Twin {
            model: mixture(0.07, 6.0, 0.05, 0.0016),
            rows: 1500,
            looks: 1.0,
            theta_sd_deg: 2.0,
            threshold_dbm: -77.0,
            theta_deg: [0.0, 70.0],
        }
    }
}

impl Twin {
    /// A curve of this truth.
    pub fn curve(&self, seed: u64) -> Curve {
        let observations = (0..self.rows as u32).map(|chirp| self.row(seed, chirp)).collect();
        Curve { observations, ..Curve::default() }
    }

    /// The same of which only the detections were recorded, each with its threshold.
    pub fn only_detected(&self, seed: u64) -> Curve {
        let threshold_w = watts_from_dbm(self.threshold_dbm);
        let mut curve = self.curve(seed);
        curve.illumination.only_detected = true;
        curve.observations.retain(|row| !row.is_censored());
        for row in &mut curve.observations {
            let ratio = row.sigma0.zip(row.power_w).map(|(sigma0, power_w)| sigma0 / power_w);
            row.threshold_sigma0 = ratio.map(|ratio| ratio * threshold_w);
        }
        curve
    }

    fn row(&self, seed: u64, chirp: u32) -> Observation {
        let key = Key { seed, chirp: u64::from(chirp), sub_ray: 0, purpose: Purpose::Speckle };
        let mut draws = key.draws();
        let [from, to] = self.theta_deg;
        let theta_rad = (from + (to - from) * draws.uniform()).to_radians();
        let theta_sd_rad = self.theta_sd_deg.to_radians();
        let tilt = draws.complex_gaussian() * std::f64::consts::SQRT_2 * theta_sd_rad;
        let truth_rad = (theta_rad + tilt.re).hypot(tilt.im).min(1.57);
        // An antenna of 0.196 m² at 8 m and a loss of 15 dB.
        let radar = Radar { system_loss_db: 15.0, ..Radar::default() };
        let solid_angle_sr = 0.196 / (RANGE_M * RANGE_M);
        let ratio = Link::new(&radar).flux_w(1.0) * solid_angle_sr / (4.0 * std::f64::consts::PI);
        let received_w = ratio * self.model.sigma0(truth_rad) * draws.gamma(self.looks);
        let threshold_w = watts_from_dbm(self.threshold_dbm);
        let power_w = received_w.max(threshold_w);
        let censored = received_w < threshold_w;
        let sigma0 = power_w / ratio;
        Observation {
            theta_sd_rad: Some(theta_sd_rad),
            power_w: Some(power_w),
            range_m: Some(RANGE_M),
            chirp: Some(chirp),
            ..Observation::of_level(theta_rad, sigma0, censored)
        }
    }
}
