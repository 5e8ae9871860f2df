//! A physical effect as files write it: its name, and numbers by their names.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

/// One effect of a scene, a radar or a material. What names and numbers there are is known to
/// [`effects`](crate::effects::resolve).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct EffectEntry {
    /// Its name.
    pub name: String,
    /// Key of the source of its numbers, in a material; none where whoever wrote it states them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Its numbers, each in the unit that ends its name; those left out are as if it were absent.
    #[serde(flatten)]
    pub parameters: BTreeMap<String, f64>,
}
