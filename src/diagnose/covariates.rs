//! Quantities that residuals may depend on.

use super::observation::Observation;
use crate::effects::{Prediction, Shot};
use crate::radar::random::{Key, Purpose};

/// One number for each shot, and the number of cells it is divided into.
pub(super) struct Covariate {
    pub name: &'static str,
    pub values: Vec<f64>,
    pub cells: usize,
}

impl Covariate {
    /// A covariate of the shots alone.
    fn of_shots(
        name: &'static str,
        cells: usize,
        shots: &[Shot],
        of: impl Fn(&Shot) -> f64,
    ) -> Covariate {
        Covariate { name, values: shots.iter().map(of).collect(), cells }
    }
}

/// Every covariate that varies.
pub(super) fn covariates(
    shots: &[Shot],
    prediction: &Prediction,
    observations: &[Observation],
) -> Vec<Covariate> {
    let (x0_m, y0_m) = (middle(shots, |shot| shot.xt_m), middle(shots, |shot| shot.yt_m));
    let mut all = vec![
        Covariate::of_shots("theta", 14, shots, |shot| shot.hit.theta_rad()),
        Covariate::of_shots("azimuth", 12, shots, |shot| shot.azimuth_rad),
        Covariate::of_shots("range", 16, shots, |shot| shot.hit.range_m),
        Covariate::of_shots("x_t", 12, shots, |shot| shot.xt_m),
        Covariate::of_shots("y_t", 12, shots, |shot| shot.yt_m),
        Covariate::of_shots("distance from centre", 12, shots, |shot| {
            (shot.xt_m - x0_m).hypot(shot.yt_m - y0_m)
        }),
        Covariate::of_shots("bearing from centre", 24, shots, |shot| {
            (shot.yt_m - y0_m).atan2(shot.xt_m - x0_m)
        }),
        Covariate::of_shots("distance from edge", 8, shots, |shot| shot.edge_m),
        Covariate::of_shots("progress", 20, shots, |shot| shot.progress),
        Covariate { name: "predicted power", values: ln_powers(prediction), cells: 12 },
        Covariate {
            name: "range residual",
            values: range_residuals_m(observations, prediction),
            cells: 8,
        },
        Covariate::of_shots("region", 8, shots, |shot| f64::from(shot.region)),
        Covariate::of_shots("cloud", 8, shots, |shot| f64::from(shot.scan)),
    ];
    all.retain(|c| c.values.iter().any(|value| Some(value) != c.values.first()));
    all
}

/// ln of every predicted power.
fn ln_powers(prediction: &Prediction) -> Vec<f64> {
    let arrived = prediction.arrived.iter();
    let powers_w = arrived.map(|arrived| arrived.as_ref().map_or(0.0, |a| a.power_w));
    powers_w.map(|power_w| power_w.max(f64::MIN_POSITIVE).ln()).collect()
}

/// Measured less expected range, m. A shot without one takes that of a random other shot: a number of its own
/// would show every field which shots are silent.
fn range_residuals_m(observations: &[Observation], prediction: &Prediction) -> Vec<f64> {
    let own: Vec<Option<f64>> = observations
        .iter()
        .zip(&prediction.arrived)
        .map(|(seen, arrived)| Some(seen.range_m? - arrived.as_ref()?.range_m))
        .collect();
    let known: Vec<f64> = own.iter().copied().flatten().collect();
    let mut all = Vec::with_capacity(own.len());
    for (shot, own_m) in own.into_iter().enumerate() {
        all.push(own_m.unwrap_or_else(|| {
            let key = Key { seed: 0, chirp: shot as u64, sub_ray: 5, purpose: Purpose::Fit };
            let drawn = (key.draws().uniform() * known.len() as f64) as usize;
            known.get(drawn).or(known.last()).copied().unwrap_or(0.0)
        }));
    }
    all
}

/// Middle between the least and the largest value.
fn middle(shots: &[Shot], of: fn(&Shot) -> f64) -> f64 {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = shots.iter().map(of).fold(ends, |[low, high], x| [low.min(x), high.max(x)]);
    0.5 * (low + high)
}

/// Ends of cells of equal numbers of shots, without repeats.
pub(super) fn quantiles(values: &[f64], cells: usize) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let mut ends: Vec<f64> = (0..=cells)
        .filter_map(|k| sorted.get(k * sorted.len().saturating_sub(1) / cells.max(1)))
        .copied()
        .collect();
    ends.dedup();
    ends
}
