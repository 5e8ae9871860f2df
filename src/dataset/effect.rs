//! Physical effects that a part of the scans has.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::Value;

use super::spec::{EffectDraw, Spec, refused};
use super::streams::{Kind, stream, within};
use crate::effects::{Level, find};
use crate::error::Error;
use crate::files::read_small;
use crate::formats::EffectEntry;

/// An effect as a scan has it.
#[derive(Clone, Debug)]
pub(super) struct DrawnEffect {
    /// Its name and its numbers.
    pub entry: EffectEntry,
    /// What has it.
    pub level: Level,
    /// The material that has it, where it is one of materials.
    pub material: Option<String>,
}

/// How a number of an effect is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Law {
    Uniform([f64; 2]),
    Normal { mean: f64, sd: f64 },
}

/// An effect and how its numbers are drawn.
#[derive(Clone, Debug)]
pub(super) struct EffectLaw {
    share: f64,
    level: Level,
    name: String,
    material: Option<String>,
    /// Each with its range.
    numbers: Vec<(String, Law, [f64; 2])>,
}

impl EffectLaw {
    /// Checks an entry against the effects that there are; `copies` has the file of its report.
    ///
    /// # Errors
    /// An effect or a parameter that there is not, a range beyond that of the parameter, and a report that did not find it.
    pub fn new(draw: &EffectDraw, copies: &BTreeMap<String, PathBuf>) -> Result<EffectLaw, Error> {
        let place = format!("[[effect]] `{}`", draw.name);
        let Some(effect) = find(&draw.name) else {
            return Err(refused(&place, "there is no such effect", "`matdb effects` lists them"));
        };
        let level = effect.level();
        if (level == Level::Material) != draw.material.is_some() {
            let way_out = match level {
                Level::Material => "give the material that has it, as material = \"NAME\"",
                _ => "leave material out: it is no effect of a material",
            };
            return Err(refused(
                &place,
                format!("it is an effect of the {}", level.as_str()),
                way_out,
            ));
        }
        let laws = match &draw.report {
            Some(report) => stated(report, copies.get(report), &draw.name)?,
            None => draw
                .parameters
                .iter()
                .map(|(name, ends)| (name.clone(), Law::Uniform(*ends)))
                .collect(),
        };
        let mut numbers = Vec::new();
        for (name, law) in laws {
            let known = effect.parameters().iter().find(|known| known.name == name);
            let Some(known) = known else {
                let names: Vec<&str> = effect.parameters().iter().map(|known| known.name).collect();
                let problem = format!("it has no parameter `{name}`");
                return Err(refused(&place, problem, format!("there are: {}", names.join(", "))));
            };
            if let Law::Uniform([from, to]) = law
                && !(known.min <= from && to <= known.max)
            {
                let problem = format!("{name} from {from} to {to} is out of range");
                return Err(refused(
                    &place,
                    problem,
                    format!("give values from {} to {}", known.min, known.max),
                ));
            }
            if let Law::Normal { mean, .. } = law
                && !(known.min..=known.max).contains(&mean)
            {
                let problem = format!("the report states {name} = {mean}, which is out of range");
                let way_out = format!("give values from {} to {}", known.min, known.max);
                return Err(refused(&place, problem, way_out));
            }
            numbers.push((name, law, [known.min, known.max]));
        }
        let (share, material) = (draw.share, draw.material.clone());
        Ok(EffectLaw { share, level, name: draw.name.clone(), material, numbers })
    }

    /// The effect as a target has it; none where it has not.
    pub fn draw(&self, spec: &Spec, target: u64, entry: usize) -> Option<DrawnEffect> {
        let mut draws = stream(spec.seed, target, Kind::Effect, entry);
        if draws.uniform() >= self.share {
            return None;
        }
        let mut parameters = BTreeMap::new();
        for (name, law, [min, max]) in &self.numbers {
            let value = match *law {
                Law::Uniform([from, to]) => from + (to - from) * draws.uniform(),
                Law::Normal { mean, sd } => within(mean, sd, [*min, *max], &mut draws),
            };
            parameters.insert(name.clone(), value);
        }
        let entry = EffectEntry { name: self.name.clone(), source: None, parameters };
        Some(DrawnEffect { entry, level: self.level, material: self.material.clone() })
    }
}

/// The numbers that a diagnosis states of an effect, by their names.
fn stated(report: &str, copy: Option<&PathBuf>, name: &str) -> Result<Vec<(String, Law)>, Error> {
    let text = read_small(copy.map_or(Path::new(report), PathBuf::as_path))?;
    let record: Value = serde_json::from_slice(&text).map_err(|error| {
        refused(report, format!("is no JSON ({error})"), "name the report.json of a diagnosis")
    })?;
    let found = record["effects"].as_array().into_iter().flatten();
    let Some(effect) = found.into_iter().find(|effect| effect["name"] == name) else {
        let problem = format!("has not found the effect `{name}`");
        return Err(refused(report, problem, "name one that it found, or give parameters"));
    };
    let numbers = effect["parameters"].as_object().into_iter().flatten();
    let mut laws = Vec::new();
    for (parameter, number) in numbers {
        let Some(mean) = number["value"].as_f64() else { continue };
        let Some(sd) = number["sd"].as_f64() else {
            let problem = format!("states no standard deviation of {parameter} of `{name}`");
            return Err(refused(report, problem, "give parameters with their ends in its place"));
        };
        if !(sd.is_finite() && sd >= 0.0 && mean.is_finite()) {
            let problem = format!("states {parameter} = {mean} ± {sd} of `{name}`");
            return Err(refused(report, problem, "give parameters with their ends in its place"));
        }
        laws.push((parameter.clone(), Law::Normal { mean, sd }));
    }
    if laws.is_empty() {
        return Err(refused(report, "states no numbers of it", "give parameters"));
    }
    Ok(laws)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What is said of a report that states this slope of a drift, and its standard deviation.
    fn said(value: f64, sd: f64) -> Option<String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("report.json");
        let number = serde_json::json!({ "value": value, "sd": sd });
        let effect = serde_json::json!({ "name": "drift", "parameters": { "slope_db": number } });
        std::fs::write(&path, serde_json::json!({ "effects": [effect] }).to_string()).unwrap();
        let draw = EffectDraw {
            name: "drift".to_owned(),
            share: 1.0,
            parameters: BTreeMap::new(),
            report: Some("report.json".to_owned()),
            material: None,
        };
        let law = EffectLaw::new(&draw, &BTreeMap::from([("report.json".to_owned(), path)]));
        law.err().map(|error| error.to_string())
    }

    #[test]
    fn a_report_must_state_numbers_that_can_be() {
        assert_eq!(said(1.5, 0.2), None);
        assert_eq!(said(1.5, 0.0), None);
        assert!(said(1.5, -0.2).unwrap().contains("states slope_db = 1.5 ± -0.2 of `drift`"));
        assert!(said(200.0, 0.2).unwrap().contains("slope_db = 200, which is out of range"));
    }
}
