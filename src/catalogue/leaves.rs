//! Everything that a material says, one by one, each with the path to it: what comparing and citing go
//! through, so that neither forgets a field.

use serde_json::Value;

use crate::material::Material;

/// One thing that a material says.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Leaf {
    /// Names of what it is in, outermost first, and its own.
    pub path: Vec<String>,
    /// Its place in the material's list of such things, for what is in one.
    pub item: Option<usize>,
    /// Number, text or flag, SI inside.
    pub value: Value,
}

/// All that a material says, in its order; an empty list and what is left out say nothing.
pub(super) fn leaves(material: &Material) -> Vec<Leaf> {
    // A tree of plain structs has no way to fail.
    let whole = serde_json::to_value(material).unwrap_or_default();
    let mut found = Vec::new();
    collect(&whole, &mut Vec::new(), None, &mut found);
    found
}

fn collect(value: &Value, path: &mut Vec<String>, item: Option<usize>, found: &mut Vec<Leaf>) {
    let outermost = path.len() == 1;
    let mut below = |name: String, place: Option<usize>, value: &Value| {
        path.push(name);
        collect(value, path, item.or(place.filter(|_| outermost)), found);
        path.pop();
    };
    match value {
        Value::Null => {}
        Value::Object(fields) => {
            fields.iter().for_each(|(name, value)| below(name.clone(), None, value));
        }
        Value::Array(items) => {
            let mut names: Vec<String> = Vec::new();
            for (place, item) in items.iter().enumerate() {
                let name = named(item).unwrap_or_else(|| place.to_string());
                let is_taken = names.contains(&name);
                names.push(if is_taken { format!("{name}#{place}") } else { name });
            }
            for (place, (name, item)) in names.into_iter().zip(items).enumerate() {
                below(name, Some(place), paired(item).unwrap_or(item));
            }
        }
        value => found.push(Leaf { path: path.clone(), item, value: value.clone() }),
    }
}

/// What tells an item from the others of its list.
fn named(item: &Value) -> Option<String> {
    let text = |key: &str| item.get(key).and_then(Value::as_str).map(str::to_owned);
    if let (Some(key), Some(hz)) = (text("key"), item.get("frequency_hz").and_then(Value::as_f64)) {
        return Some(format!("{key} at {} GHz", crate::units::shown(hz / 1e9)));
    }
    let pair = || paired(item).and_then(|_| item.get(0)?.as_str().map(str::to_owned));
    ["key", "name", "effect"].into_iter().find_map(text).or_else(pair)
}

/// The second of a pair of texts: a name and what it stands for.
fn paired(item: &Value) -> Option<&Value> {
    match item.as_array()?.as_slice() {
        [Value::String(_), second @ Value::String(_)] => Some(second),
        _ => None,
    }
}
