//! Whether a fitted model explains the rows, by randomised quantile residuals.
//!
//! A detected row has u = F(y | fit), a censored one u uniform on (0, F(T | fit)), and z = Φ⁻¹(u) is
//! standard normal if the law is right (Dunn & Smyth 1996, DOI 10.1080/10618600.1996.10474708). Least
//! squares has no law of its own: there z is the residual over the residuals' own deviation.

use nalgebra::DVector;
use statrs::function::erf::{erfc, erfc_inv};

use super::coordinates::Coordinates;
use super::likelihood::Likelihood;
use super::settings::{Fit, Method};
use super::table::Aspects;
use crate::material::{Aspect, Goodness, Observation};
use crate::radar::random::{Key, Purpose};
use crate::radar::speckle::standard_deviation_db;
use crate::units::db_from_ratio;

/// Detected σ⁰ over the model, dB.
pub(super) fn residuals_db(
    fit: &Fit,
    coordinates: &Coordinates,
    at: &DVector<f64>,
    rows: &[Observation],
) -> Vec<f64> {
    let aspects: Vec<Aspect> = rows.iter().map(Observation::aspect).collect();
    let (angles, places) = Aspects::of(&aspects);
    let table = coordinates.table(at, &angles);
    let noise_w = fit.noise_w.unwrap_or(0.0);
    let detected = rows.iter().zip(&places).filter(|(row, _)| !row.is_censored());
    detected
        .filter_map(|(row, place)| {
            let sigma0 = row.sigma0?;
            let noise = noise_w * sigma0 / row.power_w.unwrap_or(sigma0);
            let model = table.at(place).exp() + noise;
            Some(db_from_ratio(sigma0) - db_from_ratio(model))
        })
        .collect()
}

pub(super) fn goodness(
    fit: &Fit,
    coordinates: &Coordinates,
    at: &DVector<f64>,
    rows: &[Observation],
) -> Goodness {
    let residuals_db = residuals_db(fit, coordinates, at, rows);
    if fit.method == Method::Censored {
        let noise_w = fit.noise_w.unwrap_or(0.0);
        let below = Likelihood::new(coordinates, rows, noise_w).ln_below(at);
        let censored: Vec<bool> = rows.iter().map(Observation::is_censored).collect();
        let speckle_db = standard_deviation_db(coordinates.looks(at));
        let shares = shares(&below, &censored, fit.seed);
        let z: Vec<f64> = shares.iter().map(|share| z_of(*share)).collect();
        return goodness_of(&residuals_db, shares, &z, Some(speckle_db));
    }
    let squares: f64 = residuals_db.iter().map(|r| r * r).sum();
    let rms_db = (squares / residuals_db.len().max(1) as f64).sqrt().max(f64::MIN_POSITIVE);
    let z: Vec<f64> = residuals_db.iter().map(|residual_db| residual_db / rms_db).collect();
    let shares = z.iter().map(|z| normal_share(*z)).collect();
    goodness_of(&residuals_db, shares, &z, None)
}

/// Probabilities u of rows from ln of the probability below each; those of censored rows are drawn.
fn shares(ln_below: &[f64], censored: &[bool], seed: u64) -> Vec<f64> {
    let mut shares = Vec::with_capacity(ln_below.len());
    for (index, (ln_below, &is_censored)) in ln_below.iter().zip(censored).enumerate() {
        let key = Key { seed, chirp: index as u64, sub_ray: 0, purpose: Purpose::Fit };
        let part = if is_censored { key.draws().uniform() } else { 1.0 };
        shares.push(part * ln_below.exp());
    }
    shares
}

/// Φ(z): the probability of a normal number below z.
pub(crate) fn normal_share(z: f64) -> f64 {
    0.5 * erfc(-z / std::f64::consts::SQRT_2)
}

/// Correlation of the residuals z of detections with those of their neighbours by angle, which a right law leaves
/// uncorrelated; 0 for fewer than three.
pub(super) fn correlation_of_neighbours(
    fit: &Fit,
    coordinates: &Coordinates,
    at: &DVector<f64>,
    rows: &[Observation],
) -> f64 {
    let below = Likelihood::new(coordinates, rows, fit.noise_w.unwrap_or(0.0)).ln_below(at);
    let rows = rows.iter().zip(below).filter(|(row, _)| !row.is_censored());
    let mut residuals: Vec<(Aspect, f64)> =
        rows.map(|(row, ln_below)| (row.aspect(), z_of(ln_below.exp()))).collect();
    residuals.sort_by(|(a, _), (b, _)| a.in_order(b));
    let z_mean = mean(residuals.iter().map(|(_, z)| *z));
    let squares: f64 = residuals.iter().map(|(_, z)| (z - z_mean).powi(2)).sum();
    let pairs = residuals.windows(2).map(|pair| (pair[0].1 - z_mean) * (pair[1].1 - z_mean));
    let products: f64 = pairs.sum();
    if residuals.len() < 3 || squares == 0.0 { 0.0 } else { products / squares }
}

/// Φ⁻¹(u), away from the infinite ends.
fn z_of(share: f64) -> f64 {
    -std::f64::consts::SQRT_2 * erfc_inv(2.0 * share.clamp(1e-15, 1.0 - 1e-15))
}

/// Sums up residuals in dB, probabilities u and their normal numbers; `speckle_db` is the standard deviation that speckle alone
/// leaves.
fn goodness_of(
    residuals_db: &[f64],
    mut shares: Vec<f64>,
    z: &[f64],
    speckle_db: Option<f64>,
) -> Goodness {
    let z_mean = mean(z.iter().copied());
    // Kolmogorov's distance of u from a uniform law.
    shares.sort_unstable_by(f64::total_cmp);
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
        let z: Vec<f64> = shares.iter().map(|share| z_of(*share)).collect();
        let goodness = goodness_of(&[1.0, -1.0], shares, &z, None);
        assert!(goodness.z_mean.abs() < 1e-6 && (goodness.z_variance - 1.0).abs() < 5e-3);
        assert!(goodness.ks_distance < 1e-3 && goodness.rms_db == 1.0 && goodness.mean_db == 0.0);
    }

    #[test]
    fn censored_rows_are_spread_below_their_limit() {
        // Half of the rows stayed below their limit, which half of all do.
        let censored: Vec<bool> = (0..4000).map(|i| i % 2 == 0).collect();
        let u = |i: usize| if censored[i] { 0.5 } else { 0.5 + i as f64 / 8000.0 };
        let ln_below: Vec<f64> = (0..4000).map(|i| u(i).ln()).collect();
        let goodness = goodness_of(&[], shares(&ln_below, &censored, 7), &[], None);
        assert!(goodness.ks_distance < 1.95 / 4000f64.sqrt(), "{goodness:?}");
    }

    #[test]
    fn the_normal_share_has_its_known_values() {
        for (z, share) in [(0.0, 0.5), (1.959_964, 0.975), (-1.0, 0.158_655)] {
            assert!((normal_share(z) - share).abs() < 1e-6);
        }
    }
}
