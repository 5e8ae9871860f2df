//! What residuals may go with.

use super::shots::Observation;
use crate::effects::{Prediction, Shot};
use crate::radar::random::{Key, Purpose};

/// One number for each shot, and how finely it is looked at.
pub(super) struct Covariate {
    pub name: &'static str,
    pub values: Vec<f64>,
    pub cells: usize,
}

/// Every covariate that varies.
pub(super) fn covariates(
    shots: &[Shot],
    prediction: &Prediction,
    observations: &[Observation],
) -> Vec<Covariate> {
    let [x0, y0] =
        [|shot: &Shot| shot.xt_m, |shot: &Shot| shot.yt_m].map(|pick| middle(shots, pick));
    let of_shot = |name, cells, pick: &dyn Fn(&Shot) -> f64| Covariate {
        name,
        values: shots.iter().map(pick).collect(),
        cells,
    };
    let arrived = || prediction.arrived.iter().map(|arrived| arrived.as_ref());
    let ln_power = |power_w: f64| power_w.max(f64::MIN_POSITIVE).ln();
    let powers = arrived().map(|a| a.map_or(f64::MIN_POSITIVE.ln(), |a| ln_power(a.power_w)));
    let arrived_m: Vec<Option<f64>> = arrived().map(|a| a.map(|a| a.range_m)).collect();
    let mut all = vec![
        of_shot("theta", 14, &|shot| shot.hit.theta_rad()),
        of_shot("azimuth", 12, &|shot| shot.azimuth_rad),
        of_shot("range", 16, &|shot| shot.hit.range_m),
        of_shot("x_t", 12, &|shot| shot.xt_m),
        of_shot("y_t", 12, &|shot| shot.yt_m),
        of_shot("distance from centre", 12, &|shot| (shot.xt_m - x0).hypot(shot.yt_m - y0)),
        of_shot("bearing from centre", 24, &|shot| (shot.yt_m - y0).atan2(shot.xt_m - x0)),
        of_shot("distance from edge", 8, &|shot| shot.edge_m),
        of_shot("progress", 20, &|shot| shot.progress),
        Covariate { name: "predicted power", values: powers.collect(), cells: 12 },
        Covariate {
            name: "range residual",
            values: range_residuals_m(observations, &arrived_m),
            cells: 8,
        },
        of_shot("region", 8, &|shot| f64::from(shot.region)),
    ];
    all.retain(|c| c.values.iter().any(|value| Some(value) != c.values.first()));
    all
}

/// Measured less expected range, m. A shot without one takes that of another shot: a number of its own
/// would tell every field which shots are silent.
fn range_residuals_m(observations: &[Observation], arrived_m: &[Option<f64>]) -> Vec<f64> {
    let off = |(seen, arrived_m): (&Observation, &Option<f64>)| Some(seen.range_m? - (*arrived_m)?);
    let own: Vec<Option<f64>> = observations.iter().zip(arrived_m).map(off).collect();
    let known: Vec<f64> = own.iter().copied().flatten().collect();
    let other = |shot: usize| {
        let key = Key { seed: 0, chirp: shot as u64, sub_ray: 5, purpose: Purpose::Fit };
        let drawn = (key.draws().uniform() * known.len() as f64) as usize;
        known.get(drawn).or(known.last()).copied().unwrap_or(0.0)
    };
    own.iter().enumerate().map(|(shot, own_m)| own_m.unwrap_or_else(|| other(shot))).collect()
}

fn middle(shots: &[Shot], pick: fn(&Shot) -> f64) -> f64 {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = shots.iter().map(pick).fold(ends, |[low, high], x| [low.min(x), high.max(x)]);
    0.5 * (low + high)
}

/// Upper ends of cells of equal numbers of shots, all different.
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
