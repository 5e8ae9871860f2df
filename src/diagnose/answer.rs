//! From the fitted models to the tables of the report.

use std::ops::Range;

use super::clouds::parts;
use super::explanation::{Addition, Explanation};
use super::folds::Folds;
use super::report::{Base, BaseValue, BeforeAfter, CloudPart, FoundEffect, Parameters, Row, Value};
use super::residual::{FORM_OF_SCATTER, ResidualStructure};
use super::score::{AT_THE_FLOOR, DB, Errors, errors};
use super::scorer::{Scorer, State};
use super::subject::Subject;
use super::views::Views;
use crate::brdf::Brdf;
use crate::effects::{Effect, Prediction, Receiver, Shot};
use crate::frames::{Global, Pose};

/// A model as the table of residuals shows it.
#[derive(Clone, Copy)]
pub(super) struct Column<'a> {
    pub state: &'a State<'a>,
    /// Randomised quantile residuals.
    pub z: &'a [f64],
}

/// One row per shot. `unknown`: change of ln mean of every shot by a smooth field, or nothing.
pub(super) fn rows(
    subject: &Subject,
    views: &Views,
    prediction: &Prediction,
    folds: &Folds,
    [before, after]: [Column; 2],
    unknown: &[f64],
) -> Vec<Row> {
    let mut rows = Vec::with_capacity(subject.shots.len());
    for (index, (shot, seen)) in subject.shots.iter().zip(subject.observations).enumerate() {
        let arrived = prediction.arrived.get(index).copied().flatten();
        let there = views.in_first(shot);
        rows.push(Row {
            scan: shot.scan,
            chirp: shot.chirp,
            observed_w: seen.power_w,
            before_w: before.state.held_out.shots[index].expected_w,
            after_w: after.state.held_out.shots[index].expected_w,
            z_before: before.z[index],
            z_after: after.z[index],
            fold: folds.fold[index],
            theta_rad: shot.hit.theta_rad(),
            azimuth_rad: shot.azimuth_rad,
            range_m: shot.hit.range_m,
            measured_range_m: seen.range_m,
            point: seen.point,
            rank: seen.rank,
            range_residual_m: seen.range_m.zip(arrived).map(|(seen_m, a)| seen_m - a.range_m),
            xt_m: there.xt_m,
            yt_m: there.yt_m,
            edge_m: shot.edge_m,
            time_s: shot.time_s,
            region: shot.region,
            unknown_db: DB * unknown.get(index).copied().unwrap_or(0.0),
        });
    }
    rows
}

/// The base model as fitted with the effects; `sd`: standard deviations of all unknowns.
pub(super) fn base(subject: &Subject, state: &State, sd: &[f64]) -> Base {
    let Subject { receiver, declared, .. } = *subject;
    let laws = state.space.model(receiver, &state.fit.at, 0).laws;
    let mut parameters = Vec::new();
    for (known, sd) in state.space.base_values(&state.fit.at).into_iter().zip(sd) {
        let units = laws.get(known.region).map_or(Vec::new(), Brdf::parameters);
        let unit = units.iter().find(|p| p.path == known.name).map_or("1", |p| p.unit);
        let value = Value { value: known.value, sd: finite(sd * known.slope), unit };
        parameters.push(BaseValue { region: known.region, name: known.name, value });
    }
    let level_db = level_db(state, sd, 0);
    Base {
        parameters,
        level_db,
        looks: receiver.looks,
        threshold_w: declared.threshold_w,
        noise_w: receiver.noise_w,
        range_sd_m: declared.range_sd_m,
        pose: subject.pose.to_vec(),
        converged: state.fit.converged,
    }
}

/// The effects of a model with their parameters; `sd`: standard deviations of all unknowns. Where the form of the scatter is
/// not the model's, those of effects on it mean nothing and are not stated.
pub(super) fn effects(
    model: &Explanation,
    sd: &[f64],
    (subject, views): (&Subject, &Views),
    unexplained: &[ResidualStructure],
) -> Vec<FoundEffect> {
    let shots = &views.all_in_first(subject.shots);
    let has_other_form = unexplained.iter().any(|one| one.covariate == FORM_OF_SCATTER);
    let Explanation { state, added } = model;
    let mut rest = sd.iter().skip(state.space.base_len());
    let mut effects = Vec::new();
    let values = state.space.effect_values(&state.fit.at);
    for ((effect, values), added) in state.space.effects.iter().zip(values).zip(added) {
        let mut sd: Vec<f64> = rest.by_ref().take(values.len()).copied().collect();
        if has_other_form && effect.receive(&values, Receiver::LINEAR) != Receiver::LINEAR {
            sd.fill(f64::INFINITY);
        }
        let motions = motions(*effect, &values, subject);
        effects.push(FoundEffect { motions, ..found(*effect, &values, &sd, added, shots) });
    }
    effects
}

fn found(
    effect: &dyn Effect,
    values: &[f64],
    sd: &[f64],
    added: &Addition,
    shots: &[Shot],
) -> FoundEffect {
    let place = effect.place(values);
    let mut numbers = std::collections::BTreeMap::new();
    for (number, ((known, &value), sd)) in
        effect.parameters().iter().zip(values).zip(sd).enumerate()
    {
        let sd = finite((sd * known.step).hypot(effect.form_error(number, values)));
        numbers.insert(known.name, Value { value, sd, unit: known.unit });
    }
    FoundEffect {
        name: effect.name(),
        level: effect.level(),
        scans: effect.scans().to_vec(),
        class: added.class.clone(),
        parameters: Parameters::new(effect, numbers, place, shots),
        place,
        motions: Vec::new(),
        evidence: added.evidence.clone(),
    }
}

/// How an effect moves the target from where the scene has it, as its scan first meets the target and as it last does.
fn motions(effect: &dyn Effect, values: &[f64], subject: &Subject) -> Vec<Pose<Global, Global>> {
    let scan = effect.scans().first().copied().unwrap_or(0);
    let stage = &subject.stages[usize::from(scan)];
    let mut own = subject.shots.iter().filter(|shot| shot.scan == scan);
    let ends = [own.next(), own.next_back()].into_iter().flatten();
    let mut motions: Vec<_> = ends.filter_map(|shot| effect.motion(values, stage, shot)).collect();
    motions.dedup();
    motions
}

/// A standard deviation; none where the data do not determine the number.
fn finite(sd: f64) -> Option<f64> {
    sd.is_finite().then_some(sd)
}

/// Level of the radar of a scan over its settings, dB; `sd`: standard deviations of all unknowns.
fn level_db(state: &State, sd: &[f64], scan: usize) -> Option<Value> {
    let index = state.space.level_index(scan)?;
    let sd = sd.get(index).and_then(|sd| finite(DB * sd));
    Some(Value { value: DB * state.fit.at[index], sd, unit: "dB" })
}

/// What each cloud has in a joint diagnosis, without its name; empty for one cloud. `sd`: standard deviations of all
/// unknowns of the model with the effects.
pub(super) fn clouds(scorer: &Scorer, base: &State, model: &State, sd: &[f64]) -> Vec<CloudPart> {
    let parts = parts(scorer.problem.shots);
    if parts.len() < 2 {
        return Vec::new();
    }
    let part = |(scan, range): (u16, Range<usize>)| {
        let folds = &scorer.folds.part(range.clone());
        let seen = scorer.problem.observations[range.clone()].iter();
        CloudPart {
            name: format!("cloud {}", scan + 1),
            chirps: range.len(),
            detected: seen.filter(|seen| seen.power_w.is_some()).count(),
            level_db: level_db(model, sd, usize::from(scan)),
            before: errors(&base.held_out.shots[range.clone()], folds),
            after: errors(&model.held_out.shots[range], folds),
        }
    };
    parts.into_iter().map(part).collect()
}

/// Errors without and with the effects.
pub(super) fn before_after(
    scorer: &Scorer,
    [before, after]: [Errors; 2],
    with_unknown: Option<Errors>,
) -> BeforeAfter {
    let noise_floor_db = after.noise_floor_db;
    let excess = before.rmse_db.powi(2) - noise_floor_db.powi(2);
    let removed = before.rmse_db.powi(2) - after.rmse_db.powi(2);
    let is_above = before.rmse_db > AT_THE_FLOOR * noise_floor_db;
    let explained_share = is_above.then_some(removed / excess);
    let Folds { folds, blocks, .. } = *scorer.folds;
    BeforeAfter {
        before,
        after,
        with_unknown,
        noise_floor_db,
        explained_share,
        folds,
        blocks,
        held_out: true,
    }
}
