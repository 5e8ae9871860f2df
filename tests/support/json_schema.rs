//! A checker for the few words of JSON Schema that our schemas use; it refuses schemas with others.

use serde_json::{Map, Value};

/// Everything in `value` that a schema forbids, with its place.
pub fn problems(schema: &Value, value: &Value) -> Vec<String> {
    let mut found = Vec::new();
    check(schema, schema, value, "", &mut found);
    found
}

fn check(root: &Value, schema: &Value, value: &Value, place: &str, found: &mut Vec<String>) {
    let schema = schema.as_object().unwrap();
    let mut wrong = |what: String| found.push(format!("{place}: {what}"));
    for (word, wanted) in schema {
        match word.as_str() {
            "$schema" | "$defs" | "title" | "description" | "properties" | "items" | "$ref" => {}
            "type" => {
                let kinds = match wanted {
                    Value::Array(kinds) => kinds.clone(),
                    kind => vec![kind.clone()],
                };
                if !kinds.iter().any(|kind| is_kind(kind.as_str().unwrap(), value)) {
                    wrong(format!("is no {wanted}"));
                }
            }
            "const" if value != wanted => wrong(format!("is not {wanted}")),
            "enum" if !wanted.as_array().unwrap().contains(value) => {
                wrong(format!("is none of {wanted}"));
            }
            "minimum" if value.as_f64() < wanted.as_f64() => wrong("is too small".to_owned()),
            "minItems" | "maxItems" => {
                let is_least = word == "minItems";
                let (length, limit) = (value.as_array().map(Vec::len), wanted.as_u64().unwrap());
                if length
                    .is_some_and(|n| if is_least { n < limit as usize } else { n > limit as usize })
                {
                    wrong("has another length".to_owned());
                }
            }
            "required" => {
                for key in wanted.as_array().unwrap() {
                    if value.as_object().is_some_and(|m| !m.contains_key(key.as_str().unwrap())) {
                        wrong(format!("lacks {key}"));
                    }
                }
            }
            "oneOf" => {
                let fits = |one: &&Value| {
                    let mut inner = Vec::new();
                    check(root, one, value, place, &mut inner);
                    inner.is_empty()
                };
                let count = wanted.as_array().unwrap().iter().filter(fits).count();
                if count != 1 {
                    wrong(format!("is {count} of the alternatives"));
                }
            }
            // Patterns are left to a checker with regular expressions.
            "const" | "enum" | "minimum" | "pattern" | "additionalProperties" => {}
            other => panic!("the schema uses `{other}`, which this checker does not know"),
        }
    }
    if let Some(name) = schema.get("$ref") {
        let name = name.as_str().unwrap().strip_prefix('#').unwrap();
        check(root, root.pointer(name).unwrap(), value, place, found);
    }
    if let Some(object) = value.as_object() {
        members(root, schema, object, place, found);
    }
    if let (Some(items), Some(list)) = (schema.get("items"), value.as_array()) {
        for (number, item) in list.iter().enumerate() {
            check(root, items, item, &format!("{place}/{number}"), found);
        }
    }
}

fn members(
    root: &Value,
    schema: &Map<String, Value>,
    object: &Map<String, Value>,
    place: &str,
    found: &mut Vec<String>,
) {
    for (key, member) in object {
        let place = format!("{place}/{key}");
        match (
            schema.get("properties").and_then(|p| p.get(key)),
            schema.get("additionalProperties"),
        ) {
            (Some(own), _) => check(root, own, member, &place, found),
            (None, Some(Value::Bool(false))) => found.push(format!("{place}: means nothing")),
            (None, Some(own)) => check(root, own, member, &place, found),
            (None, None) => {}
        }
    }
}

fn is_kind(kind: &str, value: &Value) -> bool {
    match kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "number" => value.is_number(),
        "integer" => value.is_u64() || value.is_i64(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        other => panic!("{other}"),
    }
}
