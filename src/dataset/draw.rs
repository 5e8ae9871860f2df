//! What each scan of a data set draws: options, numbers, effects and materials. A draw depends on the seed, the target and the
//! entry of the specification, and on nothing else.

use std::collections::BTreeMap;
use std::path::Path;

use toml::Value;

use super::effect::DrawnEffect;
use super::layout::SPEC;
use super::posterior::DrawnMaterial;
use super::spec::{Choice, Numbers, Spec, Variation, format_error};
use super::split::Split;
use super::streams::{Kind, stream, within};
use crate::error::Error;
use crate::radar::random::Draws;
use crate::scene::KeyChange;

/// What a scan draws before its meshes are placed.
#[derive(Clone, Debug, Default)]
pub(super) struct Drawn {
    /// Changes of the scene, in their order.
    pub changes: Vec<KeyChange>,
    /// The option of every choice, by its name.
    pub options: BTreeMap<String, String>,
    /// Every number that was drawn, by the key that it is for.
    pub numbers: BTreeMap<String, f64>,
    /// Every text that was drawn, by the key that it is for.
    pub texts: BTreeMap<String, String>,
}

impl Drawn {
    /// The options and numbers of a scan of a split. Numbers are others in each attempt.
    ///
    /// # Errors
    /// A key that is none.
    pub fn new(spec: &Spec, split: &Split, scan: u32, attempt: usize) -> Result<Drawn, Error> {
        let target = u64::from(scan / spec.repeats);
        let mut drawn = Drawn::default();
        for (entry, choice) in spec.choose.iter().enumerate() {
            let mut draws = stream(spec.seed, target, Kind::Choice, entry);
            drawn.choose(choice, &split.options[entry], draws.uniform())?;
        }
        for (entry, variation) in spec.vary.iter().enumerate() {
            let entry = entry + (attempt << 16);
            let mut draws = stream(spec.seed, target, Kind::Variation, entry);
            drawn.vary(variation, &mut draws)?;
        }
        drawn.set("seed", whole(stream(spec.seed, target, Kind::Seed, 0)))?;
        drawn.set("noise_seed", whole(stream(spec.seed, scan.into(), Kind::Noise, 0)))?;
        Ok(drawn)
    }

    /// Takes one of some options of a choice, by their places.
    fn choose(&mut self, choice: &Choice, options: &[usize], uniform: f64) -> Result<(), Error> {
        let place = (uniform * options.len() as f64) as usize;
        let option = &choice.option[options[place.min(options.len() - 1)]];
        for (key, value) in &option.set {
            self.set(key, value.clone())?;
        }
        self.options.insert(choice.name.clone(), option.name.clone());
        Ok(())
    }

    fn vary(&mut self, variation: &Variation, draws: &mut Draws) -> Result<(), Error> {
        let Variation { keys, from, to, mean, sd, values } = variation;
        let value = if let (Some(from), Some(to), None) = (from, to, mean) {
            let ends = std::iter::zip(from.list(), to.list());
            let numbers: Vec<f64> =
                ends.map(|(from, to)| from + (to - from) * draws.uniform()).collect();
            from.value_of(&numbers)
        } else if let (Some(mean), Some(sd)) = (mean, sd) {
            let mut numbers = Vec::new();
            for (place, (&mean, &sd)) in std::iter::zip(mean.list(), sd.list()).enumerate() {
                let end = |ends: &Option<Numbers>, usual| {
                    ends.as_ref().map_or(usual, |ends| ends.list()[place])
                };
                let ends = [end(from, f64::NEG_INFINITY), end(to, f64::INFINITY)];
                numbers.push(within(mean, sd, ends, draws));
            }
            mean.value_of(&numbers)
        } else {
            let place = (draws.uniform() * values.len() as f64) as usize;
            values[place.min(values.len() - 1)].clone()
        };
        for key in keys {
            self.note(key, &value);
            self.set(key, value.clone())?;
        }
        Ok(())
    }

    fn set(&mut self, key: &str, value: impl Into<Value>) -> Result<(), Error> {
        let place = Path::new(SPEC);
        let change = KeyChange::new(key, value).map_err(|error| format_error(place, error))?;
        self.changes.push(change);
        Ok(())
    }

    /// Records a value: its numbers or its text, those of a list with their places from 0.
    fn note(&mut self, key: &str, value: &Value) {
        match value {
            Value::Float(number) => _ = self.numbers.insert(key.to_owned(), *number),
            Value::Integer(number) => _ = self.numbers.insert(key.to_owned(), *number as f64),
            Value::Array(values) => {
                for (place, value) in values.iter().enumerate() {
                    self.note(&format!("{key}.{place}"), value);
                }
            }
            other => {
                let text = other.as_str().map_or_else(|| other.to_string(), str::to_owned);
                self.texts.insert(key.to_owned(), text);
            }
        }
    }

    /// Records the effects and materials that were drawn.
    pub fn note_all(&mut self, effects: &[DrawnEffect], materials: &[DrawnMaterial]) {
        for DrawnEffect { entry, material, .. } in effects {
            // Several materials may have one effect.
            let of = material.as_ref().map_or(String::new(), |material| format!("{material}."));
            for (parameter, value) in &entry.parameters {
                self.numbers.insert(format!("effect.{}.{of}{parameter}", entry.name), *value);
            }
        }
        for DrawnMaterial { name, numbers, .. } in materials {
            for (path, value) in numbers {
                self.numbers.insert(format!("material.{name}.{path}"), *value);
            }
        }
    }
}

/// A whole number that TOML, JSON and floats of 64 bits hold.
fn whole(mut draws: Draws) -> i64 {
    (draws.uniform() * (1u64 << 53) as f64) as i64
}
