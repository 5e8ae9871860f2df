//! What differs between two materials or revisions: every field, and curves by their levels.

use std::collections::BTreeMap;

use serde::Serialize;
use serde_json::Value;

use super::leaves::{Leaf, leaves};
use super::units::ENDINGS;
use crate::brdf::Scattering;
use crate::formats::words::{round_significant, significant};
use crate::material::{Curve, Material, Observation};
use crate::units::{db_from_ratio, dbm_from_watts, shown};

/// What differs.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Diff {
    /// Fields, curves' points left out.
    pub fields: Vec<Field>,
    /// Curves that are not the same.
    pub curves: Vec<CurveChange>,
    /// What scenes render, every degree of the common range; none where either renders nothing there.
    pub rendered: Option<Levels>,
}

/// A field that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Field {
    /// Where it is: names from the outermost inwards, with a dot between.
    pub path: String,
    /// What stood there, SI; none where it was not.
    pub before: Option<Value>,
    /// What stands there.
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
            let what = match change.points {
                [None, _] => "new".to_owned(),
                [_, None] => "gone".to_owned(),
                _ => match (change.levels, change.limits) {
                    (Some(levels), None) => format!("{:.1} dB rms", levels.rms_db),
                    (_, Some(limits)) if change.levels.is_none_or(|l| l.largest_db == 0.0) => {
                        format!("limits {:.1} dB rms", limits.rms_db)
                    }
                    (Some(levels), _) => format!("{:.1} dB rms, other limits", levels.rms_db),
                    (None, _) => "other points".to_owned(),
                },
            };
            said.push(format!("curve {} {what}", change.curve));
        }
        let mut parts: Vec<String> = self.fields.iter().map(|field| part(&field.place())).collect();
        parts.dedup();
        let stays = |part: &String| {
            let mut own = self.fields.iter().filter(|field| self::part(&field.place()) == *part);
            part == STATUS || own.any(|field| field.after.is_some())
        };
        let (changed, gone): (Vec<String>, Vec<String>) = parts.into_iter().partition(stays);
        // What is lost matters most.
        said.splice(0..0, gone.iter().map(|part| format!("without {part}")));
        said.extend(changed);
        let more = said.len().saturating_sub(MOST);
        said.truncate(MOST);
        match (said.is_empty(), more) {
            (true, _) => "nothing".to_owned(),
            (_, 0) => said.join(", "),
            _ => format!("{} and {more} more", said.join(", ")),
        }
    }
}

/// What goes without saying while an entry is active.
const STATUS: &str = "status";

/// The first two names of a path, places in a list left out: what of a material it belongs to.
fn part(path: &str) -> String {
    let is_name = |piece: &&str| piece.parse::<usize>().is_err();
    let pieces = if path.starts_with(STATUS) { 1 } else { 2 };
    path.split('.').take(pieces).filter(is_name).collect::<Vec<_>>().join(" ")
}

impl Field {
    /// Where it is, for people: without the unit in the name, which the values come with.
    pub fn place(&self) -> String {
        let end = ENDINGS.iter().find(|(_, unit)| self.unit.as_deref() == Some(unit));
        let short = |name| end.and_then(|(end, _)| str::strip_suffix(name, end)).unwrap_or(name);
        self.path.split('.').map(short).collect::<Vec<_>>().join(".")
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
                (Some(rad), "rad") => format!("{}°", shown(rounded(rad.to_degrees()))),
                (Some(hz), "Hz") => format!("{} GHz", shown(rounded(hz / 1e9))),
                (Some(m), "m") => format!("{} mm", shown(rounded(m * 1e3))),
                (Some(0.0), "W") => "none".to_owned(),
                (Some(w), "W") => format!("{} dBm", shown(rounded(dbm_from_watts(w)))),
                (Some(k), "K") => format!("{} °C", shown(rounded(k - 273.15))),
                (Some(number), "" | "1") => self.digits(number),
                (Some(number), unit) => format!("{} {unit}", self.digits(number)),
                (None, _) => value.to_string(),
            },
        }
    }

    /// Six significant digits, or all where those are the same before and after.
    fn digits(&self, number: f64) -> String {
        let [before, after] = [&self.before, &self.after]
            .map(|value| Some(round_significant(value.as_ref()?.as_f64()?, 6)));
        if before == after { shown(number) } else { significant(number, 6) }
    }
}

/// Without what a change of unit leaves in the last digits.
fn rounded(value: f64) -> f64 {
    round_significant(value, 10)
}

fn fields(before: &Material, after: &Material) -> Vec<Field> {
    let is_point = |leaf: &Leaf| matches!(leaf.path.as_slice(), [list, _, what, ..] if list == "curves" && what == "observations");
    let own = |material: &Material| -> Vec<(String, Value)> {
        let leaves = leaves(material).into_iter().filter(|leaf| !is_point(leaf));
        leaves.map(|leaf| (leaf.path.join("."), leaf.value)).collect()
    };
    let (old, new) = (own(before), own(after));
    let [old_by, new_by] = [&old, &new]
        .map(|list| list.iter().map(|(path, value)| (path, value)).collect::<BTreeMap<_, _>>());
    let gone = old.iter().filter(|(path, _)| !new_by.contains_key(path));
    let units: BTreeMap<String, String> = units(before).chain(units(after)).collect();
    let field = |path: &String| Field {
        unit: unit(path, &units),
        path: path.clone(),
        before: old_by.get(path).map(|value| (*value).clone()),
        after: new_by.get(path).map(|value| (*value).clone()),
    };
    let changed = new.iter().filter(|(path, value)| old_by.get(path) != Some(&value));
    changed.chain(gone).map(|(path, _)| field(path)).collect()
}

/// Units of the models' parameters, by their paths in the material.
fn units(material: &Material) -> impl Iterator<Item = (String, String)> {
    material.fits.iter().flat_map(|fit| {
        let path = |path: &str| format!("fits.{}.model.{path}", fit.name);
        fit.model.parameters().into_iter().map(move |p| (path(&p.path), p.unit.to_owned()))
    })
}

fn unit(path: &str, units: &BTreeMap<String, String>) -> Option<String> {
    let by_name = || {
        // Of a range it is the list that has the unit in its name.
        let name = path.rsplit('.').find(|name| name.parse::<usize>().is_err())?;
        ENDINGS.iter().find(|(end, _)| name.ends_with(end)).map(|(_, unit)| (*unit).to_owned())
    };
    units.get(path).cloned().or_else(by_name)
}

fn curves(before: &Material, after: &Material) -> Vec<CurveChange> {
    let find = |of: &Material, name: &str| of.curves.iter().find(|c| c.name == name).cloned();
    let mut names: Vec<&String> =
        before.curves.iter().chain(&after.curves).map(|c| &c.name).collect();
    names.sort();
    names.dedup();
    let change = |name: &String| {
        let [old, new] = [find(before, name), find(after, name)];
        let points = |curve: &Option<Curve>| curve.as_ref().map(|c| c.observations.len());
        let is_same = match (&old, &new) {
            (Some(old), Some(new)) => old.observations == new.observations,
            _ => false,
        };
        let changed = |of: fn(&Observation) -> Option<f64>| {
            let (old, new) = (by_angle(old.as_ref()?, of), by_angle(new.as_ref()?, of));
            let pairs = old.into_iter().filter_map(|(angle, level)| Some(new.get(&angle)? - level));
            levels(&pairs.collect::<Vec<_>>())
        };
        let levels = changed(|point| point.sigma0);
        let limits = changed(|point| point.threshold_sigma0).filter(|l| l.largest_db > 0.0);
        let points = [points(&old), points(&new)];
        (!is_same).then(|| CurveChange { curve: name.clone(), points, levels, limits })
    };
    names.into_iter().filter_map(change).collect()
}

/// Mean in linear power of what `of` says of each angle's backscatter, dB; by the angle in units that
/// rounding does not reach.
fn by_angle(curve: &Curve, of: fn(&Observation) -> Option<f64>) -> BTreeMap<u64, f64> {
    const PER_RAD: f64 = 1e9;
    let mut sums: BTreeMap<u64, (f64, f64)> = BTreeMap::new();
    for point in curve.observations.iter().filter(|o| o.is_retro()) {
        if let Some(sigma0) = of(point) {
            let sum = sums.entry((point.theta_i_rad * PER_RAD).round() as u64).or_default();
            *sum = (sum.0 + sigma0, sum.1 + 1.0);
        }
    }
    sums.into_iter().map(|(angle, (sum, n))| (angle, db_from_ratio(sum / n))).collect()
}

fn rendered(before: &Material, after: &Material) -> Option<Levels> {
    let (old, new) = (before.scattering().ok()?, after.scattering().ok()?);
    let range = |end: fn(f64, f64) -> f64, place: usize| {
        end(before.theta_rad[place], after.theta_rad[place]).to_degrees()
    };
    let (low, high) = (range(f64::max, 0).ceil() as u32, range(f64::min, 1).floor() as u32);
    let level =
        |model: &dyn Scattering, deg: u32| db_from_ratio(model.sigma0(f64::from(deg).to_radians()));
    let differences = (low..=high).map(|deg| level(&new, deg) - level(&old, deg));
    levels(&differences.filter(|difference| difference.is_finite()).collect::<Vec<_>>())
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
