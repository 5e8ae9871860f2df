//! Effects as entries of files.

use thiserror::Error;

use super::effect::{Effect, EffectParameter, Level};
use super::library::{find, library, rank};
use crate::formats::EffectEntry;
use crate::formats::text::nearest;
use crate::units::shown;

/// Effects with the values of their parameters.
pub type EffectList = Vec<(&'static dyn Effect, Vec<f64>)>;

/// Why an entry is refused.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum EffectError {
    /// No such effect.
    #[error("there is no effect `{name}`; {way_out}")]
    Unknown {
        /// The name in the file.
        name: String,
        /// The nearest name, or all of them.
        way_out: String,
    },
    /// The effect has no such parameter.
    #[error("effect `{effect}` has no parameter `{parameter}`; {way_out}")]
    Parameter {
        /// The effect.
        effect: &'static str,
        /// The name in the file.
        parameter: String,
        /// The nearest name, or all of them.
        way_out: String,
    },
    /// A value is out of range.
    #[error(
        "effect `{effect}`: {parameter} = {} is out of range; give a value from {} to {}",
        shown(*value), shown(*min), shown(*max)
    )]
    OutOfRange {
        /// The effect.
        effect: &'static str,
        /// Its parameter.
        parameter: &'static str,
        /// Its value.
        value: f64,
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// An effect is given twice.
    #[error("effect `{effect}` is given twice; give it once, with all its parameters")]
    Twice {
        /// The effect.
        effect: &'static str,
    },
    /// The effect is of another level than the place where it is written.
    #[error("effect `{effect}` does not belong here; {}", level.place())]
    Misplaced {
        /// The effect.
        effect: &'static str,
        /// Its level.
        level: Level,
    },
}

impl Level {
    /// Where effects of this level are written, for a person.
    fn place(self) -> &'static str {
        match self {
            Level::Instrument => "it is the radar's: write it as [[radar.effect]] of a scene",
            Level::Material => "it is a material's: write it as [[effect]] of a material.toml",
            Level::Scene => "it is the scene's: write it as [[effect]] of a scene",
        }
    }
}

/// The effects of entries, in the order in which they act. Parameters that are not given have
/// their [absent](EffectParameter::absent) values.
///
/// # Errors
/// When an effect or parameter is unknown, a value is out of range, or an effect is given twice or is of another level.
///
/// ```
/// use matdb::effects::{Level, resolve};
/// use matdb::formats::EffectEntry;
/// let parameters = [("slope_db".to_owned(), 2.0)].into();
/// let drift = EffectEntry { name: "drift".to_owned(), source: None, parameters };
/// let found = resolve(&[drift.clone()], Level::Instrument).unwrap();
/// assert_eq!(found[0].1[..4], [2.0, 0.0, 0.0, 1.0]);
/// assert!(resolve(&[drift], Level::Scene).is_err());
/// ```
pub fn resolve(entries: &[EffectEntry], level: Level) -> Result<EffectList, EffectError> {
    let mut chosen: EffectList = Vec::new();
    for entry in entries {
        let effect = find(&entry.name).ok_or_else(|| unknown(&entry.name))?;
        let name = effect.name();
        if effect.level() != level {
            return Err(EffectError::Misplaced { effect: name, level: effect.level() });
        }
        if chosen.iter().any(|(known, _)| known.name() == name) {
            return Err(EffectError::Twice { effect: name });
        }
        chosen.push((effect, values(effect, entry)?));
    }
    chosen.sort_by_key(|(effect, _)| rank(effect.name()));
    Ok(chosen)
}

/// The entry of an effect with these values, with all parameters by name.
///
/// ```
/// use matdb::effects::{Level, entry, find, resolve};
/// let gain = find("fov-gain").unwrap();
/// let written = entry(gain, &[2.0, 0.0, 0.5, 0.0, 0.0, 0.0]);
/// assert_eq!(resolve(&[written], Level::Instrument).unwrap()[0].1[..3], [2.0, 0.0, 0.5]);
/// ```
pub fn entry(effect: &dyn Effect, values: &[f64]) -> EffectEntry {
    let values = std::iter::zip(effect.parameters(), values);
    let parameters = values.map(|(parameter, value)| (parameter.name.to_owned(), *value)).collect();
    EffectEntry { name: effect.name().to_owned(), source: None, parameters }
}

/// The value of every parameter of an effect: that of the entry, or the absent value.
fn values(effect: &dyn Effect, entry: &EffectEntry) -> Result<Vec<f64>, EffectError> {
    let known: Vec<&str> = effect.parameters().iter().map(|parameter| parameter.name).collect();
    if let Some(name) = entry.parameters.keys().find(|name| !known.contains(&name.as_str())) {
        return Err(EffectError::Parameter {
            effect: effect.name(),
            parameter: name.clone(),
            way_out: suggestion(name, &known, "its parameters are"),
        });
    }
    let mut values = Vec::with_capacity(known.len());
    for &EffectParameter { name: parameter, min, max, absent, .. } in effect.parameters() {
        let value = entry.parameters.get(parameter).copied().unwrap_or(absent);
        if !(min..=max).contains(&value) {
            let effect = effect.name();
            return Err(EffectError::OutOfRange { effect, parameter, value, min, max });
        }
        values.push(value);
    }
    Ok(values)
}

fn unknown(name: &str) -> EffectError {
    let way_out = suggestion(name, &library().map(|effect| effect.name()), "the effects are");
    EffectError::Unknown { name: name.to_owned(), way_out }
}

fn suggestion(wanted: &str, known: &[&str], all: &str) -> String {
    match nearest(wanted, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`?"),
        None => format!("{all} {}", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(name: &str, parameters: &[(&str, f64)]) -> EffectEntry {
        let number = |(name, value): &(&str, f64)| ((*name).to_owned(), *value);
        EffectEntry {
            name: name.to_owned(),
            source: None,
            parameters: parameters.iter().map(number).collect(),
        }
    }

    #[test]
    fn every_effect_comes_back_from_what_is_written_of_it() {
        for effect in library() {
            let values: Vec<f64> =
                effect.parameters().iter().map(|k| k.min + 0.3 * (k.max - k.min)).collect();
            let found = resolve(&[entry(effect, &values)], effect.level()).unwrap();
            assert_eq!((found[0].0.name(), &found[0].1), (effect.name(), &values));
        }
    }

    #[test]
    fn they_act_in_the_order_of_the_library_however_they_are_written() {
        let entries = ["compression", "drift", "fov-gain"].map(|name| written(name, &[]));
        let found = resolve(&entries, Level::Instrument).unwrap();
        let names: Vec<&str> = found.iter().map(|(effect, _)| effect.name()).collect();
        assert_eq!(names, ["fov-gain", "drift", "compression"]);
    }

    #[test]
    fn what_means_nothing_is_refused_with_the_way_out() {
        for (entries, expected) in [
            (vec![written("foreign-pach", &[])], "did you mean `foreign-patch`?"),
            (vec![written("magic", &[])], "the effects are pose, motion,"),
            (vec![written("pose", &[("rotation_x", 1.0)])], "did you mean `rotation_x_deg`?"),
            (vec![written("pose", &[("spin", 1.0)])], "its parameters are translation_x_m,"),
            (vec![written("foreign-patch", &[("level_db", 99.0)])], "from -30 to 30"),
            (vec![written("foreign-patch", &[("level_db", f64::NAN)])], "level_db = NaN"),
            (vec![written("pose", &[]), written("pose", &[])], "`pose` is given twice"),
            (vec![written("drift", &[])], "write it as [[radar.effect]]"),
            (vec![written("subsurface", &[])], "[[effect]] of a material.toml"),
        ] {
            let message = resolve(&entries, Level::Scene).err().unwrap().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
