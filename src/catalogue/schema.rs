//! The JSON Schemas that come with a publication.

use crate::brdf::{Brdf, Kind};

/// Name and text of every schema.
pub(super) fn files() -> [(&'static str, String); 3] {
    [
        ("schema/material.json", material()),
        ("schema/index.json", include_str!("schema/index.json").to_owned()),
        ("schema/changes.json", include_str!("schema/changes.json").to_owned()),
    ]
}

/// The place in `material.json` where the schemas of the models go.
const MODELS: &str = "        \"the schema of each model\"";

fn material() -> String {
    let models: Vec<String> = Brdf::KINDS.iter().map(model).collect();
    include_str!("schema/material.json").replace(MODELS, &models.join(",\n"))
}

/// Columns of a line; a list that is wider has a line for each of its items.
const WIDTH: usize = 100;

/// The schema of one kind of model.
fn model(kind: &Kind) -> String {
    let mut required = vec!["\"model\"".to_owned()];
    let mut properties = vec![format!("\"model\": {{\"const\": \"{}\"}}", kind.name)];
    for key in kind.keys {
        if key.required {
            required.push(format!("\"{}\"", key.name));
        }
        properties.push(format!("\"{}\": {}", key.name, key.schema));
    }
    format!(
        "        {{\n          \"type\": \"object\",\n          \"additionalProperties\": false,\n{},\n{}\n        }}",
        list("required", "[", &required, "]"),
        list("properties", "{", &properties, "}"),
    )
}

/// A key with a list of items, in one line where it fits.
fn list(key: &str, open: &str, items: &[String], close: &str) -> String {
    let indent = " ".repeat(10);
    let line = format!("{indent}\"{key}\": {open}{}{close}", items.join(", "));
    // A comma may follow.
    if line.len() < WIDTH && !line.contains('\n') {
        return line;
    }
    let inner = format!("\n{indent}  ");
    let items: Vec<String> = items.iter().map(|item| item.replace('\n', &inner)).collect();
    format!("{indent}\"{key}\": {open}{inner}{}\n{indent}{close}", items.join(&format!(",{inner}")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_schema_of_a_material_has_every_model() {
        let schema: serde_json::Value = serde_json::from_str(&material()).unwrap();
        let models = schema["$defs"]["model"]["oneOf"].as_array().unwrap();
        let names = models.iter().map(|model| &model["properties"]["model"]["const"]);
        assert!(names.eq(Brdf::KINDS.iter().map(|kind| kind.name)), "{models:?}");
    }
}
