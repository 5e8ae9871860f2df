//! Whether a model leaves more than the noise, and levels that lie far off by themselves.

use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor};

use super::model::{Fit, Model};
use super::points::{Point, Points};
use super::report::CurveUnknown;
use super::select::Selection;
use crate::fit::normal_share;

/// Name of structure of unknown origin.
const UNKNOWN: &str = "unknown";
/// Least structure beside a known noise, in standard deviations of that noise: as much as the noise itself.
const LEAST_OF_NOISE: f64 = 1.0;
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

/// Least size that counts, dB: what is small beside a noise that is known may still be beyond it.
pub(super) fn least_size_db(selection: &Selection) -> f64 {
    let Selection { points, settings, .. } = *selection;
    let noise_db = if points.has_known_noise() { points.noise.sd_db } else { f64::INFINITY };
    settings.least_size_db.min(LEAST_OF_NOISE * noise_db)
}

/// Probability by chance of a residual as large as that of the levels that are used; none where the noise is unknown.
pub(super) fn goodness(points: &Points, model: &Model, fit: &Fit, used: &[bool]) -> Option<f64> {
    let (square_db2, spare) = scatter_db2(points, model, fit, used);
    let ratio = square_db2 / points.noise.sd_db.powi(2);
    let freedom = points.noise.freedom;
    if !points.has_known_noise() {
        return None;
    }
    let chance = if freedom.is_finite() {
        FisherSnedecor::new(spare, freedom).ok().map(|f| f.sf(ratio))
    } else {
        ChiSquared::new(spare).ok().map(|chi| chi.sf(spare * ratio))
    };
    Some(chance.unwrap_or(1.0))
}

/// Mean square residual of the detections that are used, per degree of freedom, dB², and that number.
fn scatter_db2(points: &Points, model: &Model, fit: &Fit, used: &[bool]) -> (f64, f64) {
    let residual_db = points.residuals_db(&model.levels_db(&fit.at, &points.points));
    let mut squares = Vec::new();
    for ((point, residual), _) in
        points.points.iter().zip(&residual_db).zip(used).filter(|(_, used)| **used)
    {
        if !point.censored {
            squares.push(residual * residual);
        }
    }
    let spare = squares.len().saturating_sub(model.unknowns()).max(1) as f64;
    (squares.iter().sum::<f64>() / spare, spare)
}

/// More scatter than the noise has.
pub(super) fn scattered(
    selection: &Selection,
    model: &Model,
    fit: &Fit,
    used: &[bool],
) -> Option<CurveUnknown> {
    let Selection { points, settings, .. } = *selection;
    let p_value = goodness(points, model, fit, used)?;
    let (square_db2, _) = scatter_db2(points, model, fit, used);
    let strength_db = (square_db2 - points.noise.sd_db.powi(2)).max(0.0).sqrt();
    let is_found = p_value <= settings.family_error && strength_db >= least_size_db(selection);
    is_found.then(|| unknown("scatter", strength_db, p_value))
}

/// Structure without a curve through it.
pub(super) fn unknown(covariate: &'static str, strength_db: f64, p_value: f64) -> CurveUnknown {
    CurveUnknown {
        name: UNKNOWN,
        covariate,
        at_deg: Vec::new(),
        strength_db,
        held_out_gain: None,
        held_out_se: None,
        held_out_rmse_db: None,
        p_value,
    }
}

/// Levels that lie far off by themselves, where the model explains all others.
pub(super) fn isolated(selection: &Selection, model: &Model, start: &Fit) -> Option<CurveUnknown> {
    let Selection { points, .. } = *selection;
    let all = &points.points;
    let mut used = vec![true; all.len()];
    let mut fit = start.clone();
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
    if !is_few || !are_isolated(all, &used) || scattered(selection, model, &fit, &used).is_some() {
        return None;
    }
    let residual_db = points.residuals_db(&model.levels_db(&fit.at, all));
    let square_db2: f64 = off.iter().map(|&index| residual_db[index].powi(2)).sum();
    let at_deg = off
        .iter()
        .map(|&index| [all[index].theta_i_rad, all[index].theta_s_rad].map(f64::to_degrees));
    let strength_db = (square_db2 / off.len() as f64).sqrt();
    let p_value = 2.0 * all.len() as f64 * normal_share(-FAR_OFF);
    Some(CurveUnknown {
        at_deg: at_deg.collect(),
        ..unknown("isolated angles", strength_db, p_value)
    })
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
