//! What a data set is made of: a scene, what varies in it, and how its scans are split.
//!
//! ```toml
//! name = "concealed"
//! scene = "torso.toml"          # in the same folder, or builtin:NAME
//! scans = 1000
//! objects = ["plate"]           # meshes that are looked for
//! split = { train = 0.8, test = 0.2 }
//!
//! [[choose]]                    # one of several; none of them is in two splits
//! name = "person"
//! apart = true
//! option = [
//!     { name = "tall", set = { "mesh.body.size_m" = [0.5, 1.9, 0.3] } },
//!     { name = "short", set = { "mesh.body.size_m" = [0.5, 1.6, 0.3] } },
//! ]
//!
//! [[vary]]                      # numbers between two ends
//! keys = ["mesh.body.rotation_deg"]
//! from = [0, -20, 0]
//! to = [0, 20, 0]
//!
//! [[place]]                     # on a surface, without cutting it
//! mesh = "plate"
//! on = "body"
//! ```

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use std::path::Path;

use serde::{Deserialize, Serialize};
use toml::Value;

use crate::error::Error;
use crate::formats::FormatError;
use crate::formats::text::from_toml;
use crate::scene::file::BoxEntry;
use crate::scene::{KeyChange, SceneError};

/// A data set as its file describes it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Spec {
    /// Short name, part of the names of archives: small letters, digits and hyphens.
    pub name: String,
    /// Title.
    #[serde(default)]
    pub title: String,
    /// What it is for, in a few sentences.
    #[serde(default)]
    pub description: String,
    /// Who makes it.
    #[serde(default)]
    pub creators: Vec<String>,
    /// SPDX expression of its licence.
    #[serde(default)]
    pub licence: String,
    /// The scene in which something varies: a file in the same folder, or `builtin:NAME`.
    pub scene: String,
    /// Number of scans, 1 to 10 million.
    pub scans: u32,
    /// Seed of everything that is drawn.
    #[serde(default)]
    pub seed: u64,
    /// Scans of the same target one after the other, which differ in the noise alone.
    #[serde(default = "one")]
    pub repeats: u32,
    /// Meshes that are looked for, by name.
    #[serde(default)]
    pub objects: Vec<String>,
    /// Most scans in one shard, which is made as a whole or not at all.
    #[serde(default = "usual_shard")]
    pub scans_per_shard: u32,
    /// Whether there are images.
    #[serde(default = "yes")]
    pub images: bool,
    /// Shares of the scans, by the names of the splits; all are `train` unless stated.
    #[serde(default)]
    pub split: BTreeMap<String, f64>,
    /// Choices, in the order in which they are applied.
    #[serde(default)]
    pub choose: Vec<Choice>,
    /// Numbers that vary.
    #[serde(default)]
    pub vary: Vec<Variation>,
    /// Meshes that are put on others.
    #[serde(default)]
    pub place: Vec<Placing>,
    /// Materials whose fits are drawn.
    #[serde(default)]
    pub posterior: Vec<Posterior>,
    /// Physical effects that a part of the scans has.
    #[serde(default)]
    pub effect: Vec<EffectDraw>,
}

/// One of several ways to set keys of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Choice {
    /// Name.
    pub name: String,
    /// Whether no option is in two splits.
    #[serde(default)]
    pub apart: bool,
    /// The options.
    pub option: Vec<ChoiceOption>,
}

/// One way to set keys of the scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChoiceOption {
    /// Name, unique in its choice.
    pub name: String,
    /// Values by their keys, as `matdb render --set` takes them.
    #[serde(default)]
    pub set: BTreeMap<String, Value>,
    /// The split that it belongs to, where the options are kept apart; drawn unless stated.
    #[serde(default)]
    pub split: Option<String>,
}

/// Numbers that are drawn for keys of the scene: between two ends, about a mean, or one of several values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Variation {
    /// Keys that all get what is drawn.
    pub keys: Vec<String>,
    /// Lower end, a number or a list of numbers; of a normal law, too, which is drawn again beyond it.
    #[serde(default)]
    pub from: Option<Numbers>,
    /// Upper end.
    #[serde(default)]
    pub to: Option<Numbers>,
    /// Mean of a normal law.
    #[serde(default)]
    pub mean: Option<Numbers>,
    /// Its standard deviation.
    #[serde(default)]
    pub sd: Option<Numbers>,
    /// Values of which one is taken, each as often.
    #[serde(default)]
    pub values: Vec<Value>,
}

/// A number, or several at once.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a number or a list of numbers")]
pub enum Numbers {
    /// One.
    One(f64),
    /// Several.
    Several(Vec<f64>),
}

/// A mesh that is put on the surface of another, and does not cut it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Placing {
    /// The mesh; its own z axis will point away from the surface.
    pub mesh: String,
    /// The mesh that it is put on.
    pub on: String,
    /// Meshes that go over both, such as clothes.
    #[serde(default)]
    pub under: Vec<String>,
    /// Where its middle may be: a box of the global frame. Anywhere that the radar sees unless stated.
    #[serde(default, rename = "box")]
    pub within_box: Option<BoxEntry>,
    /// Distance from the surface at its nearest point, m.
    #[serde(default)]
    pub gap_m: f64,
    /// Turn about the surface's normal: from and to, degrees. Its own y axis points upwards at 0.
    #[serde(default = "any_turn")]
    pub turn_deg: [f64; 2],
    /// Most angle between the surface's normal and the way to the radar, degrees.
    #[serde(default = "usual_tilt")]
    pub most_tilt_deg: f64,
}

/// A material whose numbers are drawn from the covariance of its fit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Posterior {
    /// The material, as the scene names it.
    pub material: String,
    /// The fit; the rendered one unless stated.
    #[serde(default)]
    pub fit: Option<String>,
    /// Factor of the standard deviations.
    #[serde(default = "unity")]
    pub inflate: f64,
}

/// A physical effect of a part of the scans.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct EffectDraw {
    /// Its name, as `matdb effects` lists it.
    pub name: String,
    /// Share of the scans that have it, 0 to 1.
    #[serde(default = "unity")]
    pub share: f64,
    /// Ends between which each parameter is drawn, from and to; those that are not named are absent.
    #[serde(default)]
    pub parameters: BTreeMap<String, [f64; 2]>,
    /// `report.json` of a diagnosis that found it, in the same folder: parameters are drawn from what it states.
    #[serde(default)]
    pub report: Option<String>,
    /// The material that has it, where it is an effect of materials.
    #[serde(default)]
    pub material: Option<String>,
}

/// Most scans of a target, which are in one shard.
const MOST_REPEATS: u32 = 10_000;
/// Largest share of a split: only ratios count.
const MOST_SHARE: f64 = 1e9;
/// Most scans of a data set.
const MOST_SCANS: u32 = 10_000_000;

fn one() -> u32 {
    1
}

fn usual_shard() -> u32 {
    25
}

fn yes() -> bool {
    true
}

fn unity() -> f64 {
    1.0
}

fn usual_tilt() -> f64 {
    45.0
}

fn any_turn() -> [f64; 2] {
    [-180.0, 180.0]
}

impl Spec {
    /// Reads and checks the text of a file at `path`.
    ///
    /// # Errors
    /// What is no specification, by its place.
    pub fn parse(text: &str, path: &Path) -> Result<Spec, Error> {
        let spec: Spec = from_toml(text).map_err(|error| format_error(path, error))?;
        spec.check().map_err(|(problem, way_out)| {
            Error::usage(format!("{}: {problem}", path.display()), way_out)
        })?;
        Ok(spec)
    }

    /// The splits with their shares of the scans, in the order of their names; `train` alone where none is stated.
    pub fn splits(&self) -> Vec<(&str, f64)> {
        if self.split.is_empty() {
            return vec![("train", 1.0)];
        }
        let all: f64 = self.split.values().sum();
        self.split.iter().map(|(name, share)| (name.as_str(), share / all)).collect()
    }

    /// The problem of a specification that cannot be, and the way out.
    fn check(&self) -> Result<(), (String, &'static str)> {
        check_name("name", &self.name)?;
        if !(1..=MOST_SCANS).contains(&self.scans) {
            return Err((format!("scans = {}", self.scans), "give 1 to 10 000 000"));
        }
        if self.scans_per_shard == 0 || self.scans_per_shard > 10_000 {
            let problem = format!("scans_per_shard = {}", self.scans_per_shard);
            return Err((problem, "give 1 to 10 000; a shard is kept in memory until it is whole"));
        }
        if self.repeats > MOST_REPEATS {
            let problem = format!("repeats = {}", self.repeats);
            return Err((problem, "give 10 000 at most: those of a target are in one shard"));
        }
        if self.repeats == 0 || !self.scans.is_multiple_of(self.repeats) {
            let problem = format!("repeats = {} of {} scans", self.repeats, self.scans);
            return Err((problem, "give a number that divides the scans"));
        }
        self.check_splits()?;
        self.check_choices()?;
        self.check_keys()?;
        for variation in &self.vary {
            variation.check().map_err(|(problem, way_out)| {
                (format!("[[vary]] of {}: {problem}", variation.keys.join(", ")), way_out)
            })?;
        }
        self.place.iter().try_for_each(Placing::check)?;
        let mut drawn = BTreeSet::new();
        for Posterior { material, inflate, .. } in &self.posterior {
            if !drawn.insert(material) {
                let problem = format!("two [[posterior]] are of `{material}`");
                return Err((problem, "leave one out"));
            }
            if !(*inflate >= 0.0 && *inflate <= 100.0) {
                let problem = format!("[[posterior]] of `{material}`: inflate = {inflate}");
                return Err((problem, "give 0 to 100; 1 is the fit's own covariance"));
            }
        }
        let mut drawn = BTreeSet::new();
        for effect in &self.effect {
            effect.check()?;
            if !drawn.insert((&effect.name, &effect.material)) {
                let problem = format!("two [[effect]] are `{}`", effect.name);
                return Err((problem, "leave one out"));
            }
        }
        Ok(())
    }

    fn check_splits(&self) -> Result<(), (String, &'static str)> {
        for (name, share) in &self.split {
            check_name("split", name)?;
            if !(*share > 0.0 && *share <= MOST_SHARE) {
                let problem = format!("split `{name}` has a share of {share}");
                return Err((problem, "give shares above 0, such as 0.8 and 0.2"));
            }
        }
        if self.split.len() > 1 && !self.choose.iter().any(|choice| choice.apart) {
            let problem = "the splits leak: they all show the same persons and objects".to_owned();
            return Err((
                problem,
                "give a [[choose]] whose options are kept apart with apart = true, or one split",
            ));
        }
        Ok(())
    }

    /// Refuses keys that are drawn twice: one of the draws would be recorded and have no effect.
    fn check_keys(&self) -> Result<(), (String, &'static str)> {
        let of_scans = ["seed", "noise_seed"].map(|key| (key.to_owned(), "every scan".to_owned()));
        let of_places = self.place.iter().flat_map(|Placing { mesh, .. }| {
            ["rotation_deg", "translation_m"].map(|key| {
                let mesh_key = format!("mesh.{}.{key}", Value::from(mesh.as_str()));
                (mesh_key, format!("[[place]] of `{mesh}`"))
            })
        });
        let of_choices = self.choose.iter().flat_map(|choice| {
            let keys = choice.option.iter().flat_map(|option| option.set.keys());
            // Options of one choice may spell a key in several ways.
            let keys: BTreeMap<Vec<String>, &String> =
                keys.map(|key| (path_of(key), key)).collect();
            let entry = format!("[[choose]] `{}`", choice.name);
            keys.into_values().map(move |key| (key.clone(), entry.clone()))
        });
        let of_numbers = self.vary.iter().flat_map(|variation| {
            variation.keys.iter().map(|key| (key.clone(), "[[vary]]".to_owned()))
        });
        let mut by: BTreeMap<Vec<String>, String> = BTreeMap::new();
        for (key, entry) in
            of_scans.into_iter().chain(of_places).chain(of_choices).chain(of_numbers)
        {
            if let Some(other) = by.insert(path_of(&key), entry.clone()) {
                let key = key.trim();
                let problem = format!("`{key}` is drawn twice, by {other} and by {entry}");
                return Err((problem, "leave it out of one of them"));
            }
        }
        Ok(())
    }

    fn check_choices(&self) -> Result<(), (String, &'static str)> {
        let mut names = BTreeSet::new();
        for choice in &self.choose {
            let Choice { name, apart, option } = choice;
            check_name("choose", name)?;
            if !names.insert(name) {
                return Err((format!("two [[choose]] are called `{name}`"), "rename one"));
            }
            if option.is_empty() {
                let problem = format!("[[choose]] `{name}` has no option");
                return Err((problem, "give one or more, as option = [{ name = …, set = { … } }]"));
            }
            let mut options: BTreeMap<&str, &ChoiceOption> = BTreeMap::new();
            for one in option {
                if options.insert(&one.name, one).is_some() {
                    let problem = format!("[[choose]] `{name}` has two options `{}`", one.name);
                    return Err((problem, "rename one"));
                }
                if let Some(split) = &one.split {
                    let is_split = self.splits().iter().any(|(known, _)| known == split);
                    if !apart || !is_split {
                        let problem = format!(
                            "option `{}` of [[choose]] `{name}` has split = \"{split}\"",
                            one.name
                        );
                        return Err((problem, "name one of the splits, and set apart = true"));
                    }
                }
            }
            if *apart && option.len() < self.splits().len() {
                let problem = format!(
                    "the splits leak: [[choose]] `{name}` has {} options for {} splits",
                    option.len(),
                    self.splits().len()
                );
                return Err((problem, "give an option or more for each split, or fewer splits"));
            }
            let given: BTreeSet<&str> =
                option.iter().filter_map(|one| one.split.as_deref()).collect();
            let free = option.iter().filter(|one| one.split.is_none()).count();
            if *apart && free < self.splits().len() - given.len() {
                let problem =
                    format!("[[choose]] `{name}` leaves a split without any of its options");
                return Err((
                    problem,
                    "give each split an option, or more options without a split",
                ));
            }
            let sets = option.iter().map(|one| {
                let set = one.set.iter().map(|(key, value)| (key.trim(), alike(value)));
                set.collect::<Vec<_>>()
            });
            if *apart && sets.collect::<BTreeSet<_>>().len() < option.len() {
                let problem =
                    format!("the splits leak: two options of [[choose]] `{name}` set the same");
                return Err((problem, "leave one out"));
            }
        }
        Ok(())
    }
}

impl Variation {
    fn check(&self) -> Result<(), (String, &'static str)> {
        const WAYS: &str =
            "give from and to, mean and sd (between from and to, if they are there), or values";
        if self.keys.is_empty() {
            return Err((
                "has no keys".to_owned(),
                "give keys = [\"radar.system_loss_db\"] or the like",
            ));
        }
        match (&self.from, &self.to, &self.mean, &self.sd, &self.values[..]) {
            (Some(from), Some(to), None, None, []) => {
                let (from, to) = (from.list(), to.list());
                let is_range = from.len() == to.len()
                    && from.iter().chain(to).all(|end| end.is_finite())
                    && from.iter().zip(to).all(|(from, to)| from <= to);
                if is_range {
                    return Ok(());
                }
                let problem = format!("{from:?} to {to:?} is no range");
                Err((problem, "give as many numbers in both, the smaller ones in from"))
            }
            (from, to, Some(mean), Some(sd), []) => {
                let (mean, sd) = (mean.list(), sd.list());
                let ends = [from, to].map(|ends| ends.as_ref().map(Numbers::list));
                let are_in_order = match ends {
                    [Some(from), Some(to)] => from.iter().zip(to).all(|(from, to)| from <= to),
                    _ => true,
                };
                let mut given = ends.into_iter().flatten();
                let is_law = mean.len() == sd.len()
                    && are_in_order
                    && given.all(|ends| {
                        ends.len() == mean.len() && !ends.iter().any(|end| end.is_nan())
                    })
                    && mean.iter().chain(sd).all(|number| number.is_finite())
                    && sd.iter().all(|sd| *sd >= 0.0);
                if is_law {
                    return Ok(());
                }
                let problem = format!("mean {mean:?} and sd {sd:?} are no normal law");
                Err((
                    problem,
                    "give as many numbers in both and in from and to, sd 0 or more, the smaller ends in from",
                ))
            }
            (None, None, None, None, [first, others @ ..]) => {
                let Some(other) = others.iter().find(|other| !is_of_one_kind(first, other)) else {
                    return Ok(());
                };
                let problem = format!("values has {first} and {other}, of two kinds");
                Err((problem, "give numbers alone, texts alone, or lists of one form"))
            }
            _ => Err(("says not one way to draw".to_owned(), WAYS)),
        }
    }
}

impl Numbers {
    /// The numbers.
    pub fn list(&self) -> &[f64] {
        match self {
            Numbers::One(number) => std::slice::from_ref(number),
            Numbers::Several(numbers) => numbers,
        }
    }

    /// The value of a key that has other numbers in the same form.
    pub fn value_of(&self, numbers: &[f64]) -> Value {
        match (self, numbers) {
            (Numbers::One(_), [number, ..]) => Value::Float(*number),
            _ => Value::Array(numbers.iter().copied().map(Value::Float).collect()),
        }
    }
}

impl Placing {
    fn check(&self) -> Result<(), (String, &'static str)> {
        let Placing { mesh, on, gap_m, turn_deg: [from, to], most_tilt_deg, .. } = self;
        if mesh == on || self.under.contains(mesh) {
            return Err((
                format!("[[place]] of `{mesh}`: on `{on}` or under itself"),
                "name other meshes",
            ));
        }
        if !(0.0..=1.0).contains(gap_m) {
            return Err((format!("[[place]] of `{mesh}`: gap_m = {gap_m}"), "give 0 to 1"));
        }
        if !(from <= to && from.is_finite() && to.is_finite()) {
            return Err((
                format!("[[place]] of `{mesh}`: turn_deg = [{from}, {to}]"),
                "give the smaller one first",
            ));
        }
        if !(*most_tilt_deg > 0.0 && *most_tilt_deg < 90.0) {
            return Err((
                format!("[[place]] of `{mesh}`: most_tilt_deg = {most_tilt_deg}"),
                "give more than 0 and less than 90",
            ));
        }
        Ok(())
    }
}

impl EffectDraw {
    fn check(&self) -> Result<(), (String, &'static str)> {
        let name = &self.name;
        if !(0.0..=1.0).contains(&self.share) {
            return Err((format!("[[effect]] `{name}`: share = {}", self.share), "give 0 to 1"));
        }
        if self.parameters.is_empty() == self.report.is_none() {
            let problem = format!("[[effect]] `{name}`: has parameters and a report, or neither");
            return Err((
                problem,
                "give parameters = { level_db = [-1, 1] } or the like, or the report of a diagnosis",
            ));
        }
        for (parameter, [from, to]) in &self.parameters {
            if !(from <= to && from.is_finite() && to.is_finite()) {
                let problem =
                    format!("[[effect]] `{name}`: {parameter} from {from} to {to} is no range");
                return Err((problem, "give the smaller one first"));
            }
        }
        Ok(())
    }
}

/// The names of a key, whatever its spelling. What is no key is refused where the scene is read.
fn path_of(key: &str) -> Vec<String> {
    KeyChange::new(key, 0).map_or_else(|_| vec![key.to_owned()], |key| key.path())
}

/// A value as it is compared with others: a whole number is that of a float.
pub(super) fn alike(value: &Value) -> String {
    match value {
        Value::Integer(number) => (*number as f64).to_string(),
        Value::Float(number) => number.to_string(),
        Value::Array(values) => {
            let values: Vec<String> = values.iter().map(alike).collect();
            format!("[{}]", values.join(", "))
        }
        other => other.to_string(),
    }
}

/// Whether two values go into the same columns of a table: numbers, texts, or as many of each in the same order.
fn is_of_one_kind(a: &Value, b: &Value) -> bool {
    match (a, b) {
        (Value::Array(a), Value::Array(b)) => {
            a.len() == b.len() && a.iter().zip(b).all(|(a, b)| is_of_one_kind(a, b))
        }
        (Value::Array(_), _) | (_, Value::Array(_)) => false,
        _ => is_number(a) == is_number(b),
    }
}

fn is_number(value: &Value) -> bool {
    matches!(value, Value::Integer(_) | Value::Float(_))
}

/// A refusal with its place.
pub(super) fn refused(
    place: impl Display,
    problem: impl Display,
    way_out: impl Into<String>,
) -> Error {
    Error::usage(format!("{place}: {problem}"), way_out)
}

/// An error with a place in front of it.
pub(super) fn at(place: impl Display, error: &dyn Display) -> Error {
    let said = error.to_string();
    let (problem, way_out) = said.rsplit_once("; ").unwrap_or((&said, "mend the specification"));
    refused(place, problem, way_out)
}

/// The error of a file whose text cannot be taken.
pub(super) fn format_error(path: &Path, error: FormatError) -> Error {
    SceneError::Format { file: path.to_owned(), error }.into()
}

/// A name that becomes a part of names of files.
fn check_name(key: &str, name: &str) -> Result<(), (String, &'static str)> {
    let is_name = !name.is_empty()
        && name.len() <= 64
        && name.bytes().all(|b| b.is_ascii_lowercase() || b.is_ascii_digit() || b == b'-');
    if is_name {
        return Ok(());
    }
    let problem = format!("{key} = {name:?} is no name");
    Err((problem, "take small letters, digits and hyphens, 64 at most"))
}
