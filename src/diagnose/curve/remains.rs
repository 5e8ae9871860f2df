//! What is left when no term is supported any more, and the numbers of those that were.

use std::collections::BTreeMap;

use super::folds::autocorrelation;
use super::model::Scored;
use super::points::Points;
use super::select::{Added, Selection, State};
use super::smooth::{Covariate, Smooth, covariates};
use super::{CurveBaseValue, CurveFound, CurveUnknown, Value, errors};
use crate::fit::normal_share;

/// Name of what nothing explains.
const UNKNOWN: &str = "unknown";
/// Lags over which errors are looked at for going together.
const LAGS: usize = 20;

/// Residuals less smooth curves over every angle, dB: what is shared by neighbours for no reason.
pub(super) fn without_smooth(points: &Points, levels_db: &[f64], scale_db: f64) -> Vec<f64> {
    let mut left_db: Vec<f64> =
        points.points.iter().zip(levels_db).map(|(point, db)| point.f_db - db).collect();
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
    let xs = || points.points.iter().map(covariate.of);
    let ends = [xs().fold(f64::INFINITY, f64::min), xs().fold(f64::NEG_INFINITY, f64::max)];
    let pairs: Vec<(f64, f64)> = points
        .points
        .iter()
        .zip(residual_db)
        .enumerate()
        .filter(|(index, (point, _))| !point.censored && used(*index))
        .map(|(_, (point, residual))| ((covariate.of)(point), *residual))
        .collect();
    Smooth::fit(&pairs, ends, scale_db)
}

/// Every structure beyond chance and beyond the least size, largest held-out gain first.
pub(super) fn unexplained(selection: &Selection, state: &State) -> Vec<CurveUnknown> {
    let covariates = covariates(selection.points.kind).iter();
    let mut found: Vec<CurveUnknown> =
        covariates.filter_map(|covariate| over(selection, state, covariate)).collect();
    found.sort_by(|a, b| b.held_out_gain.unwrap_or(0.0).total_cmp(&a.held_out_gain.unwrap_or(0.0)));
    found.extend(together(selection, state));
    found
}

/// A smooth curve over one angle, if it predicts held-out angles.
fn over(selection: &Selection, state: &State, covariate: &Covariate) -> Option<CurveUnknown> {
    let Selection { points, folds, settings } = *selection;
    let mut after: Vec<Scored> = state.held_out.clone();
    for (fold, fitted) in state.of_fold.iter().enumerate() {
        let levels_db = state.model.levels_db(&fitted.at, &points.points);
        let residual_db: Vec<f64> =
            points.points.iter().zip(&levels_db).map(|(point, db)| point.f_db - db).collect();
        let used = |index: usize| folds.fold.get(index) != Some(&fold);
        let smooth = fit(points, covariate, &residual_db, fitted.scale_db, used);
        let bend = |index: usize| {
            points.points.get(index).map_or(0.0, |point| smooth.at((covariate.of)(point)))
        };
        let train = (0..points.points.len()).filter(|&index| used(index));
        let squares: Vec<f64> = train
            .filter(|&index| !points.points[index].censored)
            .map(|index| (residual_db[index] - bend(index)).powi(2))
            .collect();
        let rms_db = (squares.iter().sum::<f64>() / squares.len().max(1) as f64).sqrt();
        let scale_db = rms_db.max(points.noise.sd_db);
        for (index, scored) in after.iter_mut().enumerate().filter(|(index, _)| !used(*index)) {
            let f_db = levels_db[index] + bend(index);
            *scored = Scored::new(&points.points[index], f_db, scale_db);
        }
    }
    let [gain, se] = selection.gain(&state.held_out, &after);
    let levels_db = state.model.levels_db(&state.fitted.at, &points.points);
    let residual_db: Vec<f64> =
        points.points.iter().zip(&levels_db).map(|(point, db)| point.f_db - db).collect();
    let smooth = fit(points, covariate, &residual_db, state.fitted.scale_db, |_| true);
    let squares: f64 =
        points.points.iter().map(|point| smooth.at((covariate.of)(point)).powi(2)).sum();
    let strength_db = (squares / points.points.len().max(1) as f64).sqrt();
    let is_found = gain > settings.standard_errors * se
        && gain > settings.least_gain / 2.0
        && strength_db >= settings.least_size_db;
    is_found.then(|| CurveUnknown {
        name: UNKNOWN,
        covariate: covariate.name,
        strength_db,
        held_out_gain: Some(gain),
        held_out_se: Some(se),
        held_out_rmse_db: Some(errors(points, &after).rmse_db),
        p_value: normal_share(-gain / se.max(f64::MIN_POSITIVE)),
    })
}

/// Whether neighbours in a scan err to the same side.
fn together(selection: &Selection, state: &State) -> Option<CurveUnknown> {
    let Selection { points, settings, .. } = *selection;
    let residual_db = residual_db(selection, state);
    let seen: Vec<usize> =
        (0..residual_db.len()).filter(|&index| !points.points[index].censored).collect();
    let square = seen.iter().map(|&index| residual_db[index].powi(2)).sum::<f64>()
        / seen.len().max(1) as f64;
    let shared = autocorrelation(points, &residual_db, 1);
    let p_value = normal_share(-shared * (seen.len() as f64).sqrt());
    let strength_db = (shared.max(0.0) * square).sqrt();
    let is_found = p_value <= settings.family_error && strength_db >= settings.least_size_db;
    is_found.then_some(CurveUnknown {
        name: UNKNOWN,
        covariate: "neighbouring angles",
        strength_db,
        held_out_gain: None,
        held_out_se: None,
        held_out_rmse_db: None,
        p_value,
    })
}

fn residual_db(selection: &Selection, state: &State) -> Vec<f64> {
    let points = &selection.points.points;
    let levels_db = state.model.levels_db(&state.fitted.at, points);
    points.iter().zip(levels_db).map(|(point, db)| point.f_db - db).collect()
}

/// Terms and law with the numbers of the last fit and their standard deviations.
pub(super) fn values(
    selection: &Selection,
    state: &State,
    added: Vec<Added>,
) -> (Vec<CurveFound>, Vec<CurveBaseValue>) {
    let residual_db = residual_db(selection, state);
    let shared: f64 = (1..=LAGS)
        .map(|lag| autocorrelation(selection.points, &residual_db, lag))
        .take_while(|correlation| *correlation > 0.1)
        .sum();
    let deviations = state.model.deviations(&state.fitted, 1.0 + 2.0 * shared);
    let coordinates = &state.model.coordinates;
    let (law, values) = state.model.numbers(&state.fitted.at);
    let units = law.parameters();
    let unit = |name: &str| units.iter().find(|p| p.path == name).map_or("1", |p| p.unit);
    let at = state.fitted.at.iter();
    let parameters = coordinates
        .list
        .iter()
        .zip(at.zip(&deviations))
        .map(|(coordinate, (&u, sd))| CurveBaseValue {
            name: coordinate.name.clone(),
            value: Value {
                value: coordinate.value(u),
                sd: sd.map(|sd| sd * coordinate.slope(u).abs()),
                unit: unit(&coordinate.name),
            },
        })
        .collect();
    let mut rest = deviations.iter().skip(coordinates.len());
    let mut found = Vec::new();
    for (added, values) in added.into_iter().zip(values) {
        let number = |(knob, value): (&crate::effects::EffectParameter, f64)| {
            let sd = rest.next().copied().flatten().map(|sd| sd * knob.step);
            (knob.name, Value { value, sd, unit: knob.unit })
        };
        let parameters: BTreeMap<_, _> =
            added.term.parameters().iter().zip(values).map(number).collect();
        found.push(CurveFound {
            name: added.term.name(),
            level: added.term.level(),
            class: added.class,
            parameters,
            evidence: added.evidence,
        });
    }
    (found, parameters)
}
