//! A physical effect as files write it: its name, and numbers by their names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One effect of a scene, a radar or a material. [`effects`](crate::effects::resolve) knows the names and
/// the parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectEntry {
    /// Its name.
    pub name: String,
    /// Key of the source of its numbers, in a material; none where the author of the file states them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Its parameters, each in the unit that ends its name; one that is left out has the value at which the effect
    /// does nothing.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}
