//! The diagnosis of a cloud with what was asked, and what can be done next.

use std::path::Path;

use serde::Serialize;

use crate::diagnose::Report;
use crate::report::choice::UntriedEffect;
use crate::scene::Scene;

/// A diagnosis of a cloud and what a reader needs besides it.
#[derive(Clone, Copy)]
pub struct CloudAnswer<'a> {
    /// What was found.
    pub report: &'a Report,
    /// The scene that was measured.
    pub scene: &'a Scene,
    /// The scene's file.
    pub scene_path: &'a Path,
    /// The cloud's file.
    pub cloud_path: &'a Path,
    /// Sentences on materials that are withdrawn or extrapolated, and on the scene.
    pub notices: &'a [String],
    /// Effects that were left out.
    pub not_tried: &'a [UntriedEffect],
    /// Seed of everything random.
    pub seed: u64,
}

/// How to go on: commands that a person can type, with paths as a shell takes them.
#[derive(Clone, Debug, Default, Serialize)]
pub struct NextSteps {
    /// The program with the database that it works on.
    pub program: String,
    /// The command that made the diagnosis.
    pub command: String,
    /// The scene with what was found, in the folder of the report.
    pub scene_after: String,
    /// The scene that `--add` writes next to the old one.
    pub scene_beside: String,
    /// Whether the page stands without the other files.
    pub is_alone: bool,
    /// Whether what was found was stored.
    pub is_stored: bool,
    /// Materials that were stored, with their revisions.
    pub stored: Vec<String>,
    /// Files of materials that were not stored.
    pub material_files: Vec<String>,
}
