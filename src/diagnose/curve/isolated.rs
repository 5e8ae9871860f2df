//! Levels that lie far off by themselves, where a model explains all others.

use super::goodness::unknown;
use super::model::Fit;
use super::points::{Point, Points};
use super::remains;
use super::report::CurveUnknown;
use super::select::{Selection, State};
use crate::fit::normal_share;

/// What isolated levels are called in a report.
const ISOLATED: &str = "isolated angles";
/// Scatters by which an isolated level is off.
const FAR_OFF: f64 = 5.0;
/// Largest share of the levels that are isolated, and of a scan's levels in one peak, in which three may always be.
const MOST_ISOLATED: f64 = 0.25;
const WIDEST: f64 = 0.08;
const ALWAYS_NARROW: usize = 3;
/// Refits in the search for isolated levels.
const REFITS: usize = 8;
/// Median of the absolute value of a standard normal number.
const MEDIAN: f64 = 0.6745;

/// Levels that lie far off by themselves, where no test of what the model leaves of all others finds anything, and the fit
/// to these.
pub(super) fn isolated(selection: &Selection, state: &State) -> Option<(CurveUnknown, Fit)> {
    let Selection { points, .. } = *selection;
    let State { model, fitted, .. } = state;
    let all = &points.points;
    let mut used = vec![true; all.len()];
    let mut fit = fitted.clone();
    for _ in 0..REFITS {
        let residual_db = points.residuals_db(&model.levels_db(&fit.at, all));
        let scatter_db = robust_scatter_db(points, &residual_db, &used);
        let pairs = all.iter().zip(&residual_db);
        let next: Vec<bool> = pairs
            .map(|(point, residual)| point.censored || residual.abs() <= FAR_OFF * scatter_db)
            .collect();
        if next == used {
            break;
        }
        used = next;
        fit = model.fit(points, &used, &fit.at);
    }
    let off: Vec<usize> = (0..all.len()).filter(|&index| !used[index]).collect();
    let is_few = !off.is_empty() && off.len() as f64 <= MOST_ISOLATED * all.len() as f64;
    if !is_few || !are_isolated(all, &used) {
        return None;
    }
    let residual_db = points.residuals_db(&model.levels_db(&fit.at, all));
    let (others, folds) = (points.only(&used), selection.folds.only(&used));
    let of_others = Selection { points: &others, folds: &folds, ..*selection };
    let of_others_alone = of_others.state(model.clone(), fit.clone());
    if !remains::unexplained(&of_others, &of_others_alone).is_empty() {
        return None;
    }
    let square_db2: f64 = off.iter().map(|&index| residual_db[index].powi(2)).sum();
    let at_deg = off
        .iter()
        .map(|&index| [all[index].theta_i_rad, all[index].theta_s_rad].map(f64::to_degrees));
    let strength_db = (square_db2 / off.len() as f64).sqrt();
    let p_value = 2.0 * all.len() as f64 * normal_share(-FAR_OFF);
    let found =
        CurveUnknown { at_deg: at_deg.collect(), ..unknown(ISOLATED, strength_db, p_value) };
    Some((found, fit))
}

/// Scatter of the levels that are used by the median of their sizes, at least the noise where that is known, dB.
fn robust_scatter_db(points: &Points, residual_db: &[f64], used: &[bool]) -> f64 {
    let pairs = points.points.iter().zip(residual_db).zip(used);
    let mut sizes: Vec<f64> = pairs
        .filter(|((point, _), used)| **used && !point.censored)
        .map(|((_, residual), _)| residual.abs())
        .collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or(0.0);
    let least_db = if points.has_known_noise() { points.noise.sd_db } else { 0.0 };
    (median / MEDIAN).max(least_db)
}

/// Whether levels that are not used lie in short runs between used ones of the same scan: the end of a scan may be a lobe.
fn are_isolated(points: &[Point], used: &[bool]) -> bool {
    let both: Vec<(&Point, &bool)> = points.iter().zip(used).collect();
    both.chunk_by(|a, b| a.0.scan == b.0.scan).all(|scan| {
        let widest = ALWAYS_NARROW.max((WIDEST * scan.len() as f64) as usize);
        [scan.first(), scan.last()].into_iter().flatten().all(|(_, used)| **used)
            && scan.chunk_by(|a, b| a.1 == b.1).all(|run| *run[0].1 || run.len() <= widest)
    })
}
