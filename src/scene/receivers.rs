//! Receivers of a scene: names that can be file names, places and areas that mean something.

use std::path::Path;

use super::error::SceneError;
use super::file::{ReceiverEntry, SceneFile};

/// No antenna may be farther out than this, m.
const FARTHEST_M: f64 = 1e4;

/// Each keeps its own scan and image in memory.
const MOST_RECEIVERS: usize = 32;

/// Checks every receiver of a scene.
pub(super) fn check(file: &SceneFile, path: &Path) -> Result<(), SceneError> {
    let mut names: Vec<&str> = Vec::new();
    if file.receiver.len() > MOST_RECEIVERS {
        return Err(SceneError::Value {
            file: path.to_owned(),
            place: "the scene".to_owned(),
            problem: format!("has {} receivers", file.receiver.len()),
            way_out: format!("give at most {MOST_RECEIVERS}"),
        });
    }
    for entry in &file.receiver {
        let refuse = |problem: String, way_out: &str| SceneError::Value {
            file: path.to_owned(),
            place: format!("receiver `{}`", entry.name),
            problem,
            way_out: way_out.to_owned(),
        };
        if !is_name(&entry.name) {
            let way_out = "use 1 to 64 small letters, digits and hyphens";
            return Err(refuse("has a name that cannot be part of a file's".to_owned(), way_out));
        }
        if names.contains(&entry.name.as_str()) {
            return Err(refuse("is defined twice".to_owned(), "rename one"));
        }
        check_numbers(entry).map_err(|problem| refuse(problem, "correct it"))?;
        names.push(&entry.name);
    }
    Ok(())
}

fn is_name(name: &str) -> bool {
    (1..=64).contains(&name.len())
        && name.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-')
}

fn check_numbers(entry: &ReceiverEntry) -> Result<(), String> {
    if let Some(x_m) = entry.position_m.into_iter().find(|x| x.is_nan() || x.abs() > FARTHEST_M) {
        return Err(format!("has position_m = {x_m}, which is not within {FARTHEST_M} m"));
    }
    match entry.aperture_m2 {
        Some(area_m2) if !(1e-9..=1e6).contains(&area_m2) => {
            Err(format!("has aperture_m2 = {area_m2}, which is not from 1e-9 to 1e6"))
        }
        _ => Ok(()),
    }
}
