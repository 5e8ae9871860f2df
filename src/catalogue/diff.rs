//! What differs between two materials or revisions: every field, and curves by their levels.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use super::leaves::{Leaf, leaves};
use super::units::ENDINGS;
use crate::brdf::{Scattering, ThroughBeam};
use crate::formats::words::{listed, round_significant, significant};
use crate::material::{Curve, Material, Observation};
use crate::radar::Footprint;
use crate::units::{db_from_ratio, dbm_from_watts, shown};

/// What differs.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Diff {
    /// Fields, without the points of curves.
    pub fields: Vec<Field>,
    /// Curves that are not the same.
    pub curves: Vec<CurveChange>,
    /// Levels of the rendered models at every degree of the common range; none where either has none there.
    pub rendered: Option<Levels>,
    /// What a person should know of the levels.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notices: Vec<String>,
}

/// A field that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Field {
    /// Where it is: names from the outermost inwards, with a dot between.
    pub path: String,
    /// The value before, SI; none where there was none.
    pub before: Option<Value>,
    /// The value after, SI; none where there is none.
    pub after: Option<Value>,
    /// UCUM code of `before` and `after` where they are numbers with one.
    pub unit: Option<String>,
}

/// A curve that is not the same.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CurveChange {
    /// Its name.
    pub curve: String,
    /// Number of points before and after; none where it is not there.
    pub points: [Option<usize>; 2],
    /// Levels after against before at common angles of detections.
    pub levels: Option<Levels>,
    /// Detection limits after against before, where they differ at common angles.
    pub limits: Option<Levels>,
}

/// How levels differ, after less before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Levels {
    /// Number of common angles.
    pub angles: usize,
    /// Mean difference, dB.
    pub mean_db: f64,
    /// Root mean square difference, dB.
    pub rms_db: f64,
    /// Largest difference, dB, 0 or more.
    pub largest_db: f64,
}

impl Diff {
    /// Of two materials.
    pub fn new(before: &Material, after: &Material) -> Diff {
        Diff {
            fields: fields(before, after),
            curves: curves(before, after),
            rendered: rendered(before, after),
            notices: footprints(before, after),
        }
    }

    /// Whether nothing differs.
    pub fn is_empty(&self) -> bool {
        self.fields.is_empty() && self.curves.is_empty()
    }

    /// What differs, in a line.
    pub fn line(&self) -> String {
        const MOST: usize = 3;
        let mut said: Vec<String> = Vec::new();
        for change in &self.curves {
            said.push(format!("curve {} {}", change.curve, change.words()));
        }
        let mut parts: Vec<String> = self.fields.iter().map(|field| part(&field.place())).collect();
        parts.dedup();
        let (changed, gone): (Vec<String>, Vec<String>) =
            parts.into_iter().partition(|part| self.still_has(part));
        // What is lost matters most.
        said.splice(0..0, gone.iter().map(|part| format!("without {part}")));
        said.extend(changed);
        let more = said.len().saturating_sub(MOST);
        said.truncate(MOST);
        match more {
            _ if said.is_empty() => "nothing".to_owned(),
            0 => said.join(", "),
            _ => format!("{} and {more} more", said.join(", ")),
        }
    }

    /// Whether the material after has anything in a part that differs.
    fn still_has(&self, part: &str) -> bool {
        let mut fields = self.fields.iter().filter(|field| self::part(&field.place()) == part);
        part == STATUS || fields.any(|field| field.after.is_some())
    }
}

impl CurveChange {
    /// The change in a few words.
    fn words(&self) -> String {
        match (self.points, self.levels, self.limits) {
            ([None, _], ..) => "new".to_owned(),
            ([_, None], ..) => "gone".to_owned(),
            (_, Some(levels), None) => format!("{:.1} dB rms", levels.rms_db),
            (_, levels, Some(limits)) if levels.is_none_or(|l| l.largest_db == 0.0) => {
                format!("limits {:.1} dB rms", limits.rms_db)
            }
            (_, Some(levels), _) => format!("{:.1} dB rms, other limits", levels.rms_db),
            (_, None, _) => "other points".to_owned(),
        }
    }
}

/// The part that is not stored while an entry is active.
const STATUS: &str = "status";

/// The part of a material that a path belongs to: its first two names, without numbers of a list.
fn part(path: &str) -> String {
    let pieces = path.split('.').take(if path.starts_with(STATUS) { 1 } else { 2 });
    let names: Vec<&str> = pieces.filter(|piece| piece.parse::<usize>().is_err()).collect();
    names.join(" ")
}

impl Field {
    /// Where it is, for people: without the unit in the name, which stands after the values.
    pub fn place(&self) -> String {
        let Some((end, _)) = ENDINGS.iter().find(|(_, unit)| self.unit.as_deref() == Some(unit))
        else {
            return self.path.clone();
        };
        let names = self.path.split('.').map(|name| name.strip_suffix(end).unwrap_or(name));
        names.collect::<Vec<_>>().join(".")
    }

    /// The value before, for people; `—` where there is none.
    pub fn before(&self) -> String {
        self.words(self.before.as_ref())
    }

    /// The value after.
    pub fn after(&self) -> String {
        self.words(self.after.as_ref())
    }

    fn words(&self, value: Option<&Value>) -> String {
        let own = self.unit.as_deref().unwrap_or_default();
        match value {
            None => "—".to_owned(),
            Some(Value::String(text)) => text.clone(),
            Some(value) => match (value.as_f64(), own) {
                (Some(rad), "rad") => format!("{}°", shown(ten_digits(rad.to_degrees()))),
                (Some(hz), "Hz") => format!("{} GHz", shown(ten_digits(hz / 1e9))),
                (Some(m), "m") => format!("{} mm", shown(ten_digits(m * 1e3))),
                (Some(0.0), "W") => "none".to_owned(),
                (Some(w), "W") => format!("{} dBm", shown(ten_digits(dbm_from_watts(w)))),
                (Some(k), "K") => format!("{} °C", shown(ten_digits(k - 273.15))),
                (Some(number), "" | "1") => self.number(number),
                (Some(number), unit) => format!("{} {unit}", self.number(number)),
                (None, _) => value.to_string(),
            },
        }
    }

    /// Six significant digits, or all where those are the same before and after.
    fn number(&self, number: f64) -> String {
        let [before, after] = [&self.before, &self.after]
            .map(|value| Some(round_significant(value.as_ref()?.as_f64()?, 6)));
        if before == after { shown(number) } else { significant(number, 6) }
    }
}

/// Without what a change of unit leaves in the last digits.
fn ten_digits(value: f64) -> f64 {
    round_significant(value, 10)
}

fn fields(before: &Material, after: &Material) -> Vec<Field> {
    let (old, new) = (stated(before), stated(after));
    let [old_by, new_by] = [&old, &new]
        .map(|list| list.iter().map(|(path, value)| (path, value)).collect::<BTreeMap<_, _>>());
    let gone = old.iter().filter(|(path, _)| !new_by.contains_key(path));
    let units: BTreeMap<String, String> = units(before).chain(units(after)).collect();
    let changed = new.iter().filter(|(path, value)| old_by.get(path) != Some(&value));
    let fields = changed.chain(gone).map(|(path, _)| Field {
        unit: unit(path, &units),
        path: path.clone(),
        before: old_by.get(path).map(|value| (*value).clone()),
        after: new_by.get(path).map(|value| (*value).clone()),
    });
    fields.collect()
}

/// All that a material states, by path, without the points of curves.
fn stated(material: &Material) -> Vec<(String, Value)> {
    let leaves = leaves(material).into_iter().filter(|leaf| !is_of_a_point(leaf));
    leaves.map(|leaf| (leaf.path.join("."), leaf.value)).collect()
}

fn is_of_a_point(leaf: &Leaf) -> bool {
    match leaf.path.as_slice() {
        [list, _, what, ..] => list == "curves" && what == "observations",
        _ => false,
    }
}

/// Units of the models' parameters, by their paths in the material.
fn units(material: &Material) -> impl Iterator<Item = (String, String)> {
    material.fits.iter().flat_map(|fit| {
        let parameters = fit.model.parameters().into_iter();
        parameters.map(|p| (format!("fits.{}.model.{}", fit.name, p.path), p.unit.to_owned()))
    })
}

/// The unit of a number: that of the model's parameter, or the one that its name ends in.
fn unit(path: &str, units: &BTreeMap<String, String>) -> Option<String> {
    if let Some(unit) = units.get(path) {
        return Some(unit.clone());
    }
    // The ends of a range have numbers as names; the range itself has the unit in its name.
    let name = path.rsplit('.').find(|name| name.parse::<usize>().is_err())?;
    ENDINGS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| (*unit).to_owned())
}

fn curves(before: &Material, after: &Material) -> Vec<CurveChange> {
    let mut names: Vec<&String> =
        before.curves.iter().chain(&after.curves).map(|c| &c.name).collect();
    names.sort();
    names.dedup();
    let mut changes = Vec::new();
    for name in names {
        let [old, new] =
            [before, after].map(|material| material.curves.iter().find(|c| c.name == *name));
        changes.extend(curve_change(name, old, new));
    }
    changes
}

/// Sentences on curves that were not reduced with one form of the footprint before and after, each kind once.
fn footprints(before: &Material, after: &Material) -> Vec<String> {
    let (mut other, mut one_sided) = (Vec::new(), Vec::new());
    for curve in &after.curves {
        let Some(old) = before.curves.iter().find(|old| old.name == curve.name) else { continue };
        match (old.illumination.footprint, curve.illumination.footprint) {
            (Some(old), Some(new)) if old != new => other.push(curve.name.clone()),
            (Some(_), None) | (None, Some(_)) => one_sided.push(curve.name.clone()),
            _ => {}
        }
    }
    [
        (other, "another footprint before and after: levels before are converted to that after"),
        (one_sided, "a stated footprint on one side only: levels are compared as they are"),
    ]
    .into_iter()
    .filter(|(names, _)| !names.is_empty())
    .map(|(names, what)| format!("{} has {what}", listed(&names)))
    .collect()
}

/// How a curve differs; none where its points and the form of its footprint are the same.
fn curve_change(name: &str, old: Option<&Curve>, new: Option<&Curve>) -> Option<CurveChange> {
    let is_same = |old: &Curve, new: &Curve| {
        let [old_form, new_form] = [old, new].map(|curve| curve.illumination.footprint);
        old.observations == new.observations
            && (old_form == new_form || old_form.is_none() || new_form.is_none())
    };
    if old.zip(new).is_some_and(|(old, new)| is_same(old, new)) {
        return None;
    }
    let limits = changed(old, new, |point| point.threshold_sigma0);
    Some(CurveChange {
        curve: name.to_owned(),
        points: [old, new].map(|curve| curve.map(|curve| curve.observations.len())),
        levels: changed(old, new, |point| point.sigma0),
        limits: limits.filter(|limits| limits.largest_db > 0.0),
    })
}

/// By how much `of` differs at the angles that two curves have in common.
fn changed(
    old: Option<&Curve>,
    new: Option<&Curve>,
    of: fn(&Observation) -> Option<f64>,
) -> Option<Levels> {
    let (old, new) = (old?, new?);
    let footprint = new.illumination.footprint;
    let (old, new) = (by_angle(old, footprint, of), by_angle(new, footprint, of));
    let pairs = old.into_iter().filter_map(|(angle, level)| Some(new.get(&angle)? - level));
    levels(&pairs.collect::<Vec<_>>())
}

/// Mean of `of` over the backscatter at each angle, averaged in linear power, dB, as a form of the footprint makes it.
/// The key is the angle in nrad, which rounding does not change.
fn by_angle(
    curve: &Curve,
    footprint: Option<Footprint>,
    of: fn(&Observation) -> Option<f64>,
) -> BTreeMap<u64, f64> {
    const PER_RAD: f64 = 1e9;
    let mut sums: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    for point in curve.observations.iter().filter(|o| o.is_retro()) {
        if let Some(sigma0) = of(point) {
            let sigma0 = sigma0 * curve.illumination.factor_to(footprint, point.theta_i_rad.cos());
            let sum = sums.entry((point.theta_i_rad * PER_RAD).round() as u64).or_default();
            *sum = (sum.0 + sigma0, sum.1 + 1.0);
        }
    }
    sums.into_iter().map(|(angle, (sum, n))| (angle, db_from_ratio(sum / n))).collect()
}

fn rendered(before: &Material, after: &Material) -> Option<Levels> {
    let (old, new) = (before.scattering().ok()?, after.scattering().ok()?);
    let low_rad = before.theta_rad[0].max(after.theta_rad[0]);
    let high_rad = before.theta_rad[1].min(after.theta_rad[1]);
    let degrees = low_rad.to_degrees().ceil() as u32..=high_rad.to_degrees().floor() as u32;
    let [lit, after_lit] = [before, after].map(|material| {
        material.rendered_curve().map(|curve| curve.illumination).unwrap_or_default()
    });
    let factor_db = |deg: u32| {
        let cos_theta = f64::from(deg).to_radians().cos();
        db_from_ratio(lit.factor_to(after_lit.footprint, cos_theta))
    };
    // Lobes of the surface alone are narrower than those that its curve shows.
    let [beam_rad, after_beam_rad] = [before, after].map(Material::rendered_beam_rad);
    let [old, new] =
        [ThroughBeam { law: &old, beam_rad }, ThroughBeam { law: &new, beam_rad: after_beam_rad }];
    let differences = degrees.map(|deg| level_db(&new, deg) - level_db(&old, deg) - factor_db(deg));
    levels(&differences.filter(|difference| difference.is_finite()).collect::<Vec<_>>())
}

fn level_db(model: &ThroughBeam, deg: u32) -> f64 {
    db_from_ratio(model.sigma0(f64::from(deg).to_radians()))
}

fn levels(differences_db: &[f64]) -> Option<Levels> {
    let n = differences_db.len() as f64;
    let squares: f64 = differences_db.iter().map(|d| d * d).sum();
    (n > 0.0).then(|| Levels {
        angles: differences_db.len(),
        mean_db: differences_db.iter().sum::<f64>() / n,
        rms_db: (squares / n).sqrt(),
        largest_db: differences_db.iter().fold(0.0, |most: f64, d| most.max(d.abs())),
    })
}
