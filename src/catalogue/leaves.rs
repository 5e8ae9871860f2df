//! Every value that a material states, each with its path. Comparing and citing go through this list, so that
//! neither forgets a field.

use serde_json::Value;

use crate::material::Material;

/// One value that a material states.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Leaf {
    /// Names from the outermost inwards, its own last.
    pub path: Vec<String>,
    /// Its place in the material's list that it is in; none outside of lists.
    pub item: Option<usize>,
    /// Number, text or flag, SI inside.
    pub value: Value,
}

/// All values that a material states, in its order. Empty lists and absent fields give none.
pub(super) fn leaves(material: &Material) -> Vec<Leaf> {
    // A tree of plain structs has no way to fail.
    let whole = serde_json::to_value(material).unwrap_or_default();
    let mut collector = Collector { path: Vec::new(), found: Vec::new() };
    collector.collect(&whole, None);
    collector.found
}

/// A walk through a tree of values.
struct Collector {
    /// Names from the outermost inwards.
    path: Vec<String>,
    found: Vec<Leaf>,
}

impl Collector {
    /// Collects what is in `value`, of which `item` is the place in one of the material's lists.
    fn collect(&mut self, value: &Value, item: Option<usize>) {
        match value {
            Value::Null => {}
            Value::Object(fields) => {
                for (name, value) in fields {
                    self.collect_below(name.clone(), value, item);
                }
            }
            Value::Array(values) => {
                let is_outermost = self.path.len() == 1;
                let mut names: Vec<String> = Vec::new();
                for (place, value) in values.iter().enumerate() {
                    let name = named(value).unwrap_or_else(|| place.to_string());
                    let is_taken = names.contains(&name);
                    names.push(if is_taken { format!("{name}#{place}") } else { name });
                }
                for (place, (name, value)) in names.into_iter().zip(values).enumerate() {
                    let item = item.or(is_outermost.then_some(place));
                    self.collect_below(name, paired(value).unwrap_or(value), item);
                }
            }
            value => {
                self.found.push(Leaf { path: self.path.clone(), item, value: value.clone() });
            }
        }
    }

    fn collect_below(&mut self, name: String, value: &Value, item: Option<usize>) {
        self.path.push(name);
        self.collect(value, item);
        self.path.pop();
    }
}

/// The name of an item, which tells it from the others of its list.
fn named(item: &Value) -> Option<String> {
    if let (Some(key), Some(hz)) =
        (text(item, "key"), item.get("frequency_hz").and_then(Value::as_f64))
    {
        return Some(format!("{key} at {} GHz", crate::units::shown(hz / 1e9)));
    }
    let name = ["key", "name", "effect"].into_iter().find_map(|key| text(item, key));
    name.or_else(|| paired(item).and_then(|_| item.get(0)?.as_str().map(str::to_owned)))
}

fn text(item: &Value, key: &str) -> Option<String> {
    item.get(key).and_then(Value::as_str).map(str::to_owned)
}

/// The second of a pair of texts: a name and what it stands for.
fn paired(item: &Value) -> Option<&Value> {
    match item.as_array()?.as_slice() {
        [Value::String(_), second @ Value::String(_)] => Some(second),
        _ => None,
    }
}
