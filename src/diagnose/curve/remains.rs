//! What remains when no further term is supported, and the parameters of those that were added.

use std::collections::BTreeMap;

use super::folds::autocorrelation;
use super::goodness::{least_size_db, scattered, unknown};
use super::model::{Fit, Score};
use super::points::Points;
use super::report::{CurveBaseValue, CurveErrors, CurveUnknown, FoundTerm};
use super::select::{Addition, Selection, State};
use super::smooth::{Covariate, Smooth, covariates};
use crate::diagnose::report::Value;
use crate::fit::normal_share;

/// Lags over which the correlation of residuals is summed.
const LAGS: usize = 20;
/// Correlation below which the sum ends.
const LEAST_CORRELATION: f64 = 0.1;

/// Residuals less smooth curves over every angle, dB: what neighbours share without a smooth reason.
pub(super) fn without_smooth(points: &Points, levels_db: &[f64], scale_db: f64) -> Vec<f64> {
    let mut left_db = points.residuals_db(levels_db);
    for covariate in covariates(points.kind) {
        let smooth = fit(points, covariate, &left_db, scale_db, |_| true);
        for (left, point) in left_db.iter_mut().zip(&points.points) {
            *left -= smooth.at((covariate.of)(point));
        }
    }
    left_db
}

/// A smooth curve through the residuals of the detections that are used.
fn fit(
    points: &Points,
    covariate: &Covariate,
    residual_db: &[f64],
    scale_db: f64,
    used: impl Fn(usize) -> bool,
) -> Smooth {
    let mut ends = [f64::INFINITY, f64::NEG_INFINITY];
    let mut pairs = Vec::new();
    for (index, (point, residual)) in points.points.iter().zip(residual_db).enumerate() {
        let x = (covariate.of)(point);
        ends = [ends[0].min(x), ends[1].max(x)];
        if !point.censored && used(index) {
            pairs.push((x, *residual));
        }
    }
    Smooth::fit(&pairs, ends, scale_db)
}

/// Every structure beyond chance and beyond the least size, largest held-out gain first.
pub(super) fn unexplained(selection: &Selection, state: &State) -> Vec<CurveUnknown> {
    let covariates = covariates(selection.points.kind).iter();
    let mut found: Vec<CurveUnknown> =
        covariates.filter_map(|covariate| over(selection, state, covariate)).collect();
    found.sort_by(|a, b| b.held_out_gain.unwrap_or(0.0).total_cmp(&a.held_out_gain.unwrap_or(0.0)));
    found.extend(correlated(selection, state));
    found.extend(scattered(selection, state));
    found
}

/// Whether a model leaves no structure beyond a noise that is known.
pub(super) fn leaves_nothing(selection: &Selection, state: &State) -> bool {
    selection.points.has_known_noise() && unexplained(selection, state).is_empty()
}

/// A smooth curve over one angle, if it predicts held-out angles.
fn over(selection: &Selection, state: &State, covariate: &Covariate) -> Option<CurveUnknown> {
    let Selection { points, settings, .. } = *selection;
    let after = held_out_with_smooth(selection, state, covariate);
    let [gain, se] = selection.gain(&state.held_out, &after);
    // The size is that of a curve through all residuals.
    let residual_db = residuals_of(points, state, &state.fitted);
    let smooth = fit(points, covariate, &residual_db, state.fitted.scale_db, |_| true);
    let squares: f64 =
        points.points.iter().map(|point| smooth.at((covariate.of)(point)).powi(2)).sum();
    let strength_db = (squares / points.points.len().max(1) as f64).sqrt();
    let is_found = gain > settings.standard_errors * se
        && gain > settings.least_gain / 2.0
        && strength_db >= least_size_db(selection);
    is_found.then(|| CurveUnknown {
        held_out_gain: Some(gain),
        held_out_se: Some(se),
        held_out_rmse_db: Some(CurveErrors::of(points, &after).rmse_db),
        ..unknown(covariate.name, strength_db, normal_share(-gain / se.max(f64::MIN_POSITIVE)))
    })
}

/// Held-out scores of a model with a smooth curve over one angle, fitted without each fold as the model is.
fn held_out_with_smooth(selection: &Selection, state: &State, covariate: &Covariate) -> Vec<Score> {
    let Selection { points, folds, .. } = *selection;
    let mut after = state.held_out.clone();
    for (fold, fitted) in state.of_fold.iter().enumerate() {
        let levels_db = state.model.levels_db(&fitted.at, &points.points);
        let residual_db = points.residuals_db(&levels_db);
        let used = |index: usize| folds.fold.get(index) != Some(&fold);
        let smooth = fit(points, covariate, &residual_db, fitted.scale_db, used);
        let bend_db: Vec<f64> =
            points.points.iter().map(|point| smooth.at((covariate.of)(point))).collect();
        // The scale is what model and curve leave of the detections that they were fitted to.
        let squares: Vec<f64> = (0..points.points.len())
            .filter(|&index| used(index) && !points.points[index].censored)
            .map(|index| (residual_db[index] - bend_db[index]).powi(2))
            .collect();
        let rms_db = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        let scale_db = rms_db.max(points.noise.sd_db);
        for (index, score) in after.iter_mut().enumerate().filter(|(index, _)| !used(*index)) {
            let f_db = levels_db[index] + bend_db[index] * points.points[index].spread;
            *score = Score::new(&points.points[index], f_db, scale_db);
        }
    }
    after
}

/// The correlation of neighbours in a scan, if it exceeds chance.
fn correlated(selection: &Selection, state: &State) -> Option<CurveUnknown> {
    let Selection { points, settings, .. } = *selection;
    let residual_db = residuals_of(points, state, &state.fitted);
    let seen = points.points.iter().zip(&residual_db).filter(|(point, _)| !point.censored);
    let squares: Vec<f64> = seen.map(|(_, residual_db)| residual_db.powi(2)).collect();
    let square = squares.iter().sum::<f64>() / squares.len().max(1) as f64;
    let shared = autocorrelation(points, &residual_db, 1);
    let pairs = points.neighbours().filter(|pair| pair.iter().all(|point| !point.censored));
    let pairs = pairs.count() as f64;
    let p_value = normal_share(-shared * pairs.sqrt());
    let strength_db = (shared.max(0.0) * square).sqrt();
    let is_found = p_value <= settings.family_error && strength_db >= least_size_db(selection);
    is_found.then(|| unknown("neighbouring angles", strength_db, p_value))
}

/// Measured less predicted levels under a fit over their spreads, dB.
fn residuals_of(points: &Points, state: &State, fit: &Fit) -> Vec<f64> {
    points.residuals_db(&state.model.levels_db(&fit.at, &points.points))
}

/// The terms and the scattering model with the parameters of the last fit and their standard deviations.
pub(super) fn values(
    selection: &Selection,
    state: &State,
    added: Vec<Addition>,
) -> (Vec<FoundTerm>, Vec<CurveBaseValue>) {
    let residual_db = residuals_of(selection.points, state, &state.fitted);
    let shared: f64 = (1..=LAGS)
        .map(|lag| autocorrelation(selection.points, &residual_db, lag))
        .take_while(|correlation| *correlation > LEAST_CORRELATION)
        .sum();
    let deviations = state.model.deviations(&state.fitted, 1.0 + 2.0 * shared);
    let (law, values) = state.model.numbers(&state.fitted.at);
    let coordinates = &state.model.coordinates;
    let units = law.parameters();
    let mut parameters = Vec::new();
    for (coordinate, (&u, sd)) in
        coordinates.list.iter().zip(state.fitted.at.iter().zip(&deviations))
    {
        let unit = units.iter().find(|p| p.path == coordinate.name).map_or("1", |p| p.unit);
        let sd = sd.map(|sd| sd * coordinate.slope(u).abs());
        let value = Value { value: coordinate.value(u), sd, unit };
        parameters.push(CurveBaseValue { name: coordinate.name.clone(), value });
    }
    let mut rest = deviations.iter().skip(coordinates.len());
    let mut found = Vec::new();
    for (Addition { term, class, evidence }, values) in added.into_iter().zip(values) {
        let mut parameters = BTreeMap::new();
        for (known, value) in term.parameters().iter().zip(values) {
            let sd = rest.next().copied().flatten().map(|sd| sd * known.step);
            parameters.insert(known.name, Value { value, sd, unit: known.unit });
        }
        let (name, level) = (term.name(), term.level());
        found.push(FoundTerm { name, level, class, parameters, evidence });
    }
    (found, parameters)
}
