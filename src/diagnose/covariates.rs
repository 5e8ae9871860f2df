//! What residuals may go with.

use super::looks::Observation;
use crate::effects::{Prediction, Shot};
use crate::radar::random::{Key, Purpose};

/// One number for each look, and how finely it is looked at.
pub(super) struct Covariate {
    pub name: &'static str,
    pub values: Vec<f64>,
    pub cells: usize,
}

/// Every covariate that varies.
pub(super) fn covariates(
    looks: &[Shot],
    prediction: &Prediction,
    observations: &[Observation],
) -> Vec<Covariate> {
    let [x0, y0] =
        [|look: &Shot| look.xt_m, |look: &Shot| look.yt_m].map(|pick| middle(looks, pick));
    let of_look = |name, cells, pick: &dyn Fn(&Shot) -> f64| Covariate {
        name,
        values: looks.iter().map(pick).collect(),
        cells,
    };
    let arrived = || prediction.arrived.iter().map(|arrived| arrived.as_ref());
    let ln_power = |power_w: f64| power_w.max(f64::MIN_POSITIVE).ln();
    let powers = arrived().map(|a| a.map_or(f64::MIN_POSITIVE.ln(), |a| ln_power(a.power_w)));
    let arrived_m: Vec<Option<f64>> = arrived().map(|a| a.map(|a| a.range_m)).collect();
    let mut all = vec![
        of_look("theta", 14, &|look| look.hit.theta_rad()),
        of_look("azimuth", 12, &|look| look.azimuth_rad),
        of_look("range", 16, &|look| look.hit.range_m),
        of_look("x_t", 12, &|look| look.xt_m),
        of_look("y_t", 12, &|look| look.yt_m),
        of_look("distance from centre", 12, &|look| (look.xt_m - x0).hypot(look.yt_m - y0)),
        of_look("bearing from centre", 24, &|look| (look.yt_m - y0).atan2(look.xt_m - x0)),
        of_look("distance from edge", 8, &|look| look.edge_m),
        of_look("progress", 20, &|look| look.progress),
        Covariate { name: "predicted power", values: powers.collect(), cells: 12 },
        Covariate {
            name: "range residual",
            values: range_residuals_m(observations, &arrived_m),
            cells: 8,
        },
        of_look("region", 8, &|look| f64::from(look.region)),
    ];
    all.retain(|c| c.values.iter().any(|value| Some(value) != c.values.first()));
    all
}

/// Measured less expected range, m. A look without one takes that of another look: a number of its own
/// would tell every field which looks are silent.
fn range_residuals_m(observations: &[Observation], arrived_m: &[Option<f64>]) -> Vec<f64> {
    let off = |(seen, arrived_m): (&Observation, &Option<f64>)| Some(seen.range_m? - (*arrived_m)?);
    let own: Vec<Option<f64>> = observations.iter().zip(arrived_m).map(off).collect();
    let known: Vec<f64> = own.iter().copied().flatten().collect();
    let other = |look: usize| {
        let key = Key { seed: 0, chirp: look as u64, sub_ray: 5, purpose: Purpose::Fit };
        let drawn = (key.draws().uniform() * known.len() as f64) as usize;
        known.get(drawn).or(known.last()).copied().unwrap_or(0.0)
    };
    own.iter().enumerate().map(|(look, own_m)| own_m.unwrap_or_else(|| other(look))).collect()
}

fn middle(looks: &[Shot], pick: fn(&Shot) -> f64) -> f64 {
    let ends = [f64::INFINITY, f64::NEG_INFINITY];
    let [low, high] = looks.iter().map(pick).fold(ends, |[low, high], x| [low.min(x), high.max(x)]);
    0.5 * (low + high)
}

/// Upper ends of cells of equal numbers of looks, all different.
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
