//! From where a search ended to the result of a fit.

use super::coordinates::{Coordinate, Coordinates};
use super::goodness::goodness;
use super::interval::DEVIATE_95;
use super::judge::judge;
use super::result::FitResult;
use super::search::SearchResult;
use super::settings::{Fit, Method};
use crate::brdf::Brdf;
use crate::material::{Estimate, Observation};
use crate::measure::curve::Curve;

/// The result of a fit to `curve` whose search found this.
pub(super) fn summarise(
    fit: &Fit,
    coordinates: Coordinates,
    found: &SearchResult,
    curve: &Curve,
) -> FitResult {
    let at = found.best.at.clone();
    let model = coordinates.model(&at);
    let law = fit.method == Method::Censored;
    let mut result = FitResult {
        gauge_k: coordinates.gauge().map(|_| chosen_k(&model)),
        estimates: estimates(&coordinates, found),
        covariance: covariance(&coordinates, found),
        singular_values: found.uncertainty.singular_values.clone(),
        looks: law.then(|| coordinates.looks(&at)),
        noise_w: fit.noise_w.filter(|_| law).unwrap_or(0.0),
        objective: -found.best.local.value,
        goodness: goodness(fit, &coordinates, &at, &curve.observations),
        held_out: None,
        converged: found.best.converged(),
        stop: found.best.stop,
        iterations: found.best.iterations,
        agreeing_starts: found.agreeing,
        verdict: Vec::new(),
        data_hash: data_hash(&curve.observations),
        version: env!("CARGO_PKG_VERSION"),
        fit: fit.clone(),
        covariance_searched: found.uncertainty.covariance.clone(),
        model,
        coordinates,
        at,
    };
    result.verdict = judge(&result, found, curve);
    result
}

fn chosen_k(model: &Brdf) -> f64 {
    let parameters = model.parameters();
    parameters.iter().find(|p| p.path == "k").map_or(f64::NAN, |p| p.value)
}

fn estimates(coordinates: &Coordinates, found: &SearchResult) -> Vec<Estimate> {
    let searched = coordinates.list.iter().zip(found.best.at.iter()).enumerate();
    searched.map(|(index, (coordinate, u))| estimate(found, index, coordinate, *u)).collect()
}

/// One number with its deviation and interval, from the scale of the search to that of the parameter.
fn estimate(found: &SearchResult, index: usize, coordinate: &Coordinate, u: f64) -> Estimate {
    let known = found.best.converged() && found.uncertainty.is_identified(index);
    let deviation = found.uncertainty.deviation(index);
    let interval = match found.profiles.get(index) {
        Some(profile) => profile.map(|ends| ends.map(|end| coordinate.value(end.at))),
        None => Some([-DEVIATE_95, DEVIATE_95].map(|z| coordinate.value(u + z * deviation))),
    };
    Estimate {
        name: coordinate.name.clone(),
        value: coordinate.value(u),
        sd: known.then(|| deviation * coordinate.slope(u)),
        interval_95: interval.filter(|_| known),
    }
}

/// Covariance of the numbers. Directions that the data do not determine and numbers at a bound add nothing. A number
/// without a deviation keeps its row: what is hard to tell apart varies together, and a band needs both.
fn covariance(coordinates: &Coordinates, found: &SearchResult) -> Vec<Vec<f64>> {
    let at = &found.best.at;
    let mut scales = vec![0.0; at.len()];
    for (index, coordinate) in coordinates.list.iter().enumerate() {
        if !found.uncertainty.bounded[index] {
            scales[index] = coordinate.slope(at[index]);
        }
    }
    let mut covariance = vec![vec![0.0; at.len()]; at.len()];
    for (row, entries) in covariance.iter_mut().enumerate() {
        for (column, entry) in entries.iter_mut().enumerate() {
            let searched = found.uncertainty.covariance[(row, column)];
            *entry = searched * scales[row] * scales[column];
        }
    }
    covariance
}

/// Hash of the rows as numbers, with what they leave out.
fn data_hash(rows: &[Observation]) -> String {
    let mut bytes = Vec::with_capacity(rows.len() * 48);
    for (row, index) in rows.iter().zip(0u32..) {
        let sigma0 = row.level_sigma0().unwrap_or(f64::NAN);
        for number in [
            row.theta_i_rad,
            row.theta_sd_rad.unwrap_or(0.0),
            row.power_w.unwrap_or(sigma0),
            sigma0,
            row.range_m.unwrap_or(0.0),
        ] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(row.chirp.unwrap_or(index).to_le_bytes());
        bytes.push(u8::from(row.is_censored()));
        // Only where it is not backscatter, so that hashes of before stay.
        for angle_rad in [row.theta_r_rad, row.delta_phi_rad].iter().filter(|_| !row.is_retro()) {
            bytes.extend(angle_rad.to_le_bytes());
        }
        // Only where a detection would not be there below it, so that hashes of before stay.
        if let Some(limit) = row.threshold_sigma0.filter(|_| !row.is_censored()) {
            bytes.extend(limit.to_le_bytes());
        }
    }
    blake3::hash(&bytes).to_hex().to_string()
}
