//! The short names of materials.

use std::fmt;
use std::str::FromStr;

use serde::{Deserialize, Serialize};

/// A material's short name: 1 to 64 characters of `a–z`, `0–9` and `-`, starting with a letter or
/// digit.
///
/// ```
/// use matdb::material::Slug;
/// assert!("mannequin-paint".parse::<Slug>().is_ok());
/// assert!("../paint".parse::<Slug>().is_err());
/// ```
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct Slug(String);

impl Slug {
    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl fmt::Display for Slug {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl FromStr for Slug {
    type Err = String;
    fn from_str(text: &str) -> Result<Slug, String> {
        let has_good_characters = text.chars().all(|c| matches!(c, 'a'..='z' | '0'..='9' | '-'));
        if (1..=64).contains(&text.len()) && has_good_characters && !text.starts_with('-') {
            return Ok(Slug(text.to_owned()));
        }
        let shown: String = text.chars().take(64).flat_map(char::escape_debug).collect();
        Err(format!(
            "`{shown}` is not a material name; use 1 to 64 of the characters a–z, 0–9 and -, \
             as in mannequin-paint"
        ))
    }
}

impl TryFrom<String> for Slug {
    type Error = String;
    fn try_from(text: String) -> Result<Slug, String> {
        text.parse()
    }
}

impl From<Slug> for String {
    fn from(slug: Slug) -> String {
        slug.0
    }
}
