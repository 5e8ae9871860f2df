//! Whether a fitted law explains the rows, by randomised quantile residuals.
//!
//! A detected row has u = F(y | fit), a censored one u uniform on (0, F(T | fit)), and z = Φ⁻¹(u) is
//! standard normal if the law is right (Dunn & Smyth 1996, DOI 10.1080/10618600.1996.10474708). Least
//! squares has no law of its own: there z is the residual over the residuals' own deviation.

use statrs::function::erf::erfc;
use statrs::function::erf::erfc_inv;

use crate::material::Goodness;
use crate::radar::random::{Key, Purpose};

/// Probabilities u of rows from the ln of what lies below each; censored rows are drawn.
pub(super) fn shares(ln_below: &[f64], censored: &[bool], seed: u64) -> Vec<f64> {
    let share = |(index, (&ln_below, &censored)): (usize, (&f64, &bool))| {
        let key = Key { seed, chirp: index as u64, sub_ray: 0, purpose: Purpose::Fit };
        let part = if censored { key.draws().uniform() } else { 1.0 };
        part * ln_below.exp()
    };
    ln_below.iter().zip(censored).enumerate().map(share).collect()
}

/// Φ(z): the probability of a normal number below z.
pub(crate) fn normal_share(z: f64) -> f64 {
    0.5 * erfc(-z / std::f64::consts::SQRT_2)
}

/// Sums up residuals in dB and probabilities u; `speckle_db` is the standard deviation that speckle alone leaves.
pub(super) fn goodness_of(
    residuals_db: &[f64],
    mut shares: Vec<f64>,
    speckle_db: Option<f64>,
) -> Goodness {
    const SQRT_2: f64 = std::f64::consts::SQRT_2;
    // z = Φ⁻¹(u), away from the infinite ends.
    let z: Vec<f64> =
        shares.iter().map(|u| -SQRT_2 * erfc_inv(2.0 * u.clamp(1e-15, 1.0 - 1e-15))).collect();
    let z_mean = mean(z.iter().copied());
    // Kolmogorov's distance of u from a uniform law.
    shares.sort_by(f64::total_cmp);
    let count = shares.len() as f64;
    let mut ks_distance = 0.0f64;
    for (i, u) in shares.iter().enumerate() {
        ks_distance = ks_distance.max(u - i as f64 / count).max((i as f64 + 1.0) / count - u);
    }
    Goodness {
        rms_db: mean(residuals_db.iter().map(|r| r * r)).sqrt(),
        mean_db: mean(residuals_db.iter().copied()),
        speckle_db,
        z_mean,
        z_variance: mean(z.iter().map(|z| (z - z_mean).powi(2))),
        ks_distance,
        rows: u32::try_from(shares.len()).unwrap_or(u32::MAX),
    }
}

fn mean(values: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = values.len().max(1) as f64;
    values.sum::<f64>() / count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_uniform_law_is_found_uniform() {
        let ln_below: Vec<f64> = (0..2000).map(|i| ((f64::from(i) + 0.5) / 2000.0).ln()).collect();
        let shares = shares(&ln_below, &[false; 2000], 1);
        let goodness = goodness_of(&[1.0, -1.0], shares, None);
        assert!(goodness.z_mean.abs() < 1e-6 && (goodness.z_variance - 1.0).abs() < 5e-3);
        assert!(goodness.ks_distance < 1e-3 && goodness.rms_db == 1.0 && goodness.mean_db == 0.0);
    }

    #[test]
    fn censored_rows_are_spread_below_their_limit() {
        // Half of the rows stayed below their limit, which half of all do.
        let censored: Vec<bool> = (0..4000).map(|i| i % 2 == 0).collect();
        let u = |i: usize| if censored[i] { 0.5 } else { 0.5 + i as f64 / 8000.0 };
        let ln_below: Vec<f64> = (0..4000).map(|i| u(i).ln()).collect();
        let goodness = goodness_of(&[], shares(&ln_below, &censored, 7), None);
        assert!(goodness.ks_distance < 1.95 / 4000f64.sqrt(), "{goodness:?}");
    }

    #[test]
    fn the_normal_share_has_its_known_values() {
        for (z, share) in [(0.0, 0.5), (1.959_964, 0.975), (-1.0, 0.158_655)] {
            assert!((normal_share(z) - share).abs() < 1e-6);
        }
    }
}
