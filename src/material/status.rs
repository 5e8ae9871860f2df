//! Whether an entry may still be used.

use serde::{Deserialize, Serialize};

use super::error::{MaterialError, value};
use super::slug::Slug;

/// Whether an entry may still be used, and why not.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "is", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Status {
    /// It may.
    #[default]
    Active,
    /// A better one has taken its place.
    Superseded {
        /// The better one.
        by: Slug,
        /// Why it is better.
        reason: String,
    },
    /// It was wrong, or may not be passed on.
    Withdrawn {
        /// Why.
        reason: String,
    },
}

impl Status {
    /// The word that files and the database use.
    pub fn as_str(&self) -> &'static str {
        match self {
            Status::Active => "active",
            Status::Superseded { .. } => "superseded",
            Status::Withdrawn { .. } => "withdrawn",
        }
    }

    /// Why it is no longer active.
    pub fn reason(&self) -> Option<&str> {
        match self {
            Status::Active => None,
            Status::Superseded { reason, .. } | Status::Withdrawn { reason } => Some(reason),
        }
    }

    /// What has taken its place.
    pub fn superseded_by(&self) -> Option<&Slug> {
        match self {
            Status::Superseded { by, .. } => Some(by),
            _ => None,
        }
    }

    /// What to say of an entry that is not to be used: `withdrawn: the reason`; none while it is active.
    pub fn sentence(&self) -> Option<String> {
        let by = self.superseded_by().map_or(String::new(), |by| format!("; use {by}"));
        Some(format!("{}: {}{by}", self.as_str(), self.reason()?))
    }

    /// Whether nothing is to be said.
    pub fn is_active(&self) -> bool {
        *self == Status::Active
    }

    pub(super) fn validate(&self, own: &Slug) -> Result<(), MaterialError> {
        if self.reason().is_some_and(|reason| reason.trim().is_empty()) {
            return Err(value("status", "gives no reason", "say why in `reason`"));
        }
        if self.superseded_by() == Some(own) {
            let problem = "the material is superseded by itself";
            return Err(value("status", problem, "name another material in `by`"));
        }
        Ok(())
    }
}
