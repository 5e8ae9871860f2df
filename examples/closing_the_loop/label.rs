//! The truth of a case, in either of the two spellings that labels come in.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use serde_json::{Map, Value};

use super::Failure;

/// What a diagnosis should say.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Expected {
    /// That nothing is missing.
    Complete,
    /// The names of the effects.
    Named,
    /// That something is missing that has no name.
    Unknown,
}

/// How much an effect changes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Strength {
    Weak,
    Moderate,
    Strong,
}

impl Strength {
    pub const ALL: [Strength; 3] = [Strength::Weak, Strength::Moderate, Strength::Strong];

    pub fn name(self) -> &'static str {
        match self {
            Strength::Weak => "weak",
            Strength::Moderate => "moderate",
            Strength::Strong => "strong",
        }
    }

    fn read(name: &Value) -> Option<Strength> {
        Strength::ALL.into_iter().find(|strength| name.as_str() == Some(strength.name()))
    }
}

/// An effect that was put in.
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    pub name: String,
    pub parameters: Map<String, Value>,
}

/// The truth of a case.
#[derive(Clone, Debug, PartialEq)]
pub struct Label {
    pub case: String,
    pub seed: u64,
    pub geometry: String,
    pub effects: Vec<Truth>,
    /// As reached, where the label says that; else as wanted.
    pub strength: Option<Strength>,
    /// As wanted, where less was reached.
    pub wanted: Option<Strength>,
    pub expected: Expected,
    pub rms_db: Option<f64>,
    /// Thermal noise that the scene declares, dBm.
    pub declared_dbm: Option<f64>,
}

impl Label {
    /// None of what is no label.
    pub fn read(file_name: &str, json: &Value) -> Option<Label> {
        let text = |value: &Value| value.as_str().map(str::to_owned);
        let expected = match json["expected_verdict"].as_str()? {
            "no-missing-effect" | "complete" => Expected::Complete,
            "explained" | "named" => Expected::Named,
            "unexplained" | "unknown" => Expected::Unknown,
            _ => return None,
        };
        let wanted = Strength::read(&json["class"]);
        let strength = Strength::read(&json["class_by_rms"]).or(wanted);
        let declared = &json["declared"];
        Some(Label {
            case: text(&json["case"]).unwrap_or_else(|| file_name.to_owned()),
            seed: json["seed"].as_u64().unwrap_or_default(),
            geometry: text(&declared["geometry"]).or(text(&json["geometry"])).unwrap_or_default(),
            effects: json["effects"].as_array()?.iter().map(|one| truth(one, json)).collect(),
            strength,
            wanted: wanted.filter(|_| wanted != strength),
            expected,
            rms_db: json["rms_db"].as_f64(),
            declared_dbm: declared["level_dbm"].as_f64().or(json["noise_dbm"].as_f64()),
        })
    }

    pub fn names(&self) -> Vec<&str> {
        self.effects.iter().map(|effect| effect.name.as_str()).collect()
    }

    pub fn has(&self, name: &str) -> bool {
        self.effects.iter().any(|effect| effect.name == name)
    }

    /// The only effect, if it is one of the library.
    pub fn single(&self) -> Option<&str> {
        match (self.expected, self.effects.as_slice()) {
            (Expected::Named, [one]) => Some(&one.name),
            _ => None,
        }
    }

    pub fn is_pair(&self) -> bool {
        self.expected == Expected::Named && self.effects.len() > 1
    }
}

/// An effect as an object, or as a name with its parameters elsewhere.
fn truth(effect: &Value, label: &Value) -> Truth {
    let name = effect.as_str().or(effect["name"].as_str()).unwrap_or_default();
    let all = label["parameters"].as_object();
    let own = effect["parameters"].as_object().or(all.and_then(|all| all.get(name)?.as_object()));
    let only = all.and_then(|all| all.iter().next());
    match (own, only) {
        (None, Some((kind, of_kind))) if name == "unknown" => Truth {
            name: kind.clone(),
            parameters: of_kind.as_object().cloned().unwrap_or_default(),
        },
        _ => Truth { name: name.to_owned(), parameters: own.cloned().unwrap_or_default() },
    }
}

/// All labels of a set of cases, by case.
pub fn labels(cases: &Path) -> Result<BTreeMap<String, Label>, Failure> {
    let folder = cases.join("labels");
    let mut labels = BTreeMap::new();
    let entries =
        fs::read_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for entry in entries {
        let path = entry?.path();
        if path.extension().is_none_or(|extension| extension != "json") {
            continue;
        }
        let json = serde_json::from_str(&fs::read_to_string(&path)?)
            .map_err(|error| format!("{}: {error}", path.display()))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy();
        if let Some(label) = Label::read(&name, &json) {
            labels.insert(label.case.clone(), label);
        }
    }
    Ok(labels)
}
