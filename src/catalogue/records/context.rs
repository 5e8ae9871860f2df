//! The catalogue as a whole, as every record describes it.

use crate::catalogue::about::About;

/// The input of every record.
pub(super) struct Context<'a> {
    pub about: &'a About,
    /// When the newest entry was added: UTC, ISO 8601.
    pub date: Option<&'a str>,
    pub materials: usize,
}

impl<'a> Context<'a> {
    /// The date without the time.
    pub fn day(&self) -> Option<&'a str> {
        self.date?.get(..10)
    }
    /// The author of a catalogue that names none.
    pub fn anonymous_author(&self) -> String {
        format!("Contributors to {}", self.about.title)
    }
}
