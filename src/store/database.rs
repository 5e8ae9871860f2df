//! The handle of an open database.

use std::path::PathBuf;

use rusqlite::Connection;

use crate::material::Activity;

/// An open database.
#[derive(Debug)]
pub struct Store {
    pub(super) conn: Connection,
    /// The name under which it was opened.
    pub(super) path: PathBuf,
    /// What is recorded with every revision that is added.
    pub(super) activity: Option<Activity>,
}
