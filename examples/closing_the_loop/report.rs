//! What a diagnosis said: the parts of `report.json` that are scored.

use std::collections::BTreeMap;

use serde::Deserialize;

/// A fitted number.
#[derive(Clone, Debug, Deserialize)]
pub struct Number {
    #[serde(deserialize_with = "scalar")]
    pub value: Option<f64>,
    #[serde(default, deserialize_with = "scalar")]
    pub sd: Option<f64>,
}

/// An effect that was named.
#[derive(Clone, Debug, Deserialize)]
pub struct FoundEffect {
    pub name: String,
    /// Effects that predict the data as well.
    #[serde(default)]
    pub class: Vec<String>,
    #[serde(default)]
    pub parameters: BTreeMap<String, Number>,
}

/// An effect that was tried.
#[derive(Clone, Debug, Deserialize)]
pub struct Candidate {
    pub round: usize,
    pub name: String,
    pub gain: Option<f64>,
    #[serde(default)]
    pub sampled: bool,
    pub placebo_gain: Option<f64>,
    pub held_out: Option<[f64; 2]>,
    #[serde(default)]
    pub size_db: f64,
}

/// Errors over held-out chirps.
#[derive(Clone, Debug, Deserialize)]
pub struct Errors {
    pub rmse_db: f64,
    pub coverage_90: Option<f64>,
}

/// Errors without and with the effects.
#[derive(Clone, Debug, Deserialize)]
pub struct BeforeAfter {
    pub before: Errors,
    pub after: Errors,
    pub noise_floor_db: f64,
    pub explained_share: Option<f64>,
}

/// What a diagnosis said.
#[derive(Clone, Debug, Deserialize)]
pub struct Report {
    pub verdict: String,
    #[serde(default)]
    pub effects: Vec<FoundEffect>,
    #[serde(default)]
    pub ranking: Vec<Candidate>,
    pub error: Option<BeforeAfter>,
    /// Why it could not tell.
    pub reason: Option<String>,
}

/// How a case went.
#[derive(Clone, Debug)]
pub struct Run {
    pub seconds: f64,
    /// How many ran at a time.
    pub jobs: usize,
    /// Which build of the program.
    pub program: String,
    /// The report, or what the program said instead.
    pub report: Result<Report, String>,
}

/// Column of what gives no answer.
pub const NO_ANSWER: &str = "no answer";
/// Column of a diagnosis that names nothing.
pub const NONE: &str = "none";

impl Run {
    pub fn verdict(&self) -> &str {
        self.report.as_ref().map_or("failed", |report| &report.verdict)
    }

    pub fn found(&self) -> &[FoundEffect] {
        self.report.as_ref().map_or(&[], |report| &report.effects)
    }

    pub fn error(&self) -> Option<&BeforeAfter> {
        self.report.as_ref().ok()?.error.as_ref()
    }

    pub fn has(&self, name: &str) -> bool {
        self.found().iter().any(|found| found.name == name)
    }

    /// Whether it is named, or in the class of what is.
    pub fn has_in_class(&self, name: &str) -> bool {
        self.has(name) || self.found().iter().any(|found| found.class.iter().any(|n| n == name))
    }

    /// Name of the first effect, or why there is none.
    pub fn first(&self) -> &str {
        match (self.found().first(), self.verdict()) {
            (Some(found), _) => &found.name,
            (None, "cannot-tell" | "failed") => NO_ANSWER,
            (None, _) => NONE,
        }
    }

    /// Whether it is the first name, or in that one's class.
    pub fn first_or_class(&self, name: &str) -> bool {
        let in_class = |found: &FoundEffect| found.class.iter().any(|other| other == name);
        self.first() == name || self.found().first().is_some_and(in_class)
    }

    /// An effect as it was tried in a round, from 1.
    pub fn tried(&self, round: usize, name: &str) -> Option<&Candidate> {
        let tried = &self.report.as_ref().ok()?.ranking;
        tried.iter().find(|candidate| candidate.round == round && candidate.name == name)
    }

    /// Everything that was said, in few words.
    pub fn said(&self) -> String {
        let name = |found: &FoundEffect| {
            if found.class.is_empty() {
                found.name.clone()
            } else {
                format!("{} (or {})", found.name, found.class.join(", "))
            }
        };
        let names: Vec<String> = self.found().iter().map(name).collect();
        if names.is_empty() {
            self.verdict().to_owned()
        } else {
            format!("{}: {}", self.verdict(), names.join(" + "))
        }
    }
}

/// A number; none where there are three of them, as for a place.
fn scalar<'de, D: serde::Deserializer<'de>>(from: D) -> Result<Option<f64>, D::Error> {
    Ok(serde_json::Value::deserialize(from)?.as_f64())
}
