//! Reading the files that a scene names.

use std::path::Path;

use super::builtin;
use super::error::SceneError;
use crate::files::{LARGEST_FILE_BYTES, LARGEST_SMALL_FILE_BYTES, check_size};
use crate::formats::FormatError;
use crate::formats::text::nearest;

/// Reads a scene file's text, or that of a built-in scene, `builtin:NAME`.
pub fn read_text(path: &Path) -> Result<String, SceneError> {
    if let Some(name) = builtin::name(path) {
        return builtin::text(name).map(str::to_owned).ok_or_else(|| unknown(path, name));
    }
    let size = std::fs::metadata(path).map_or(0, |found| found.len());
    check_size(size, LARGEST_SMALL_FILE_BYTES).map_err(|reason| unreadable(path, reason, ""))?;
    String::from_utf8(read(path, "")?).map_err(|error| {
        let place = format!("byte {}", error.utf8_error().valid_up_to());
        let way_out = "a scene is a text file in UTF-8; were cloud and scene swapped?";
        let error = FormatError::at(place, "the text is not UTF-8", way_out);
        SceneError::Format { file: path.to_owned(), error }
    })
}

fn unknown(path: &Path, name: &str) -> SceneError {
    let names = builtin::SCENES.map(|(name, _)| name);
    let way_out = match nearest(name, names) {
        Some(near) => format!("did you mean `builtin:{near}`?"),
        None => format!("the built-in scenes are builtin:{}", names.join(", builtin:")),
    };
    SceneError::Value {
        file: path.to_owned(),
        place: "the scene".to_owned(),
        problem: "is not built in".to_owned(),
        way_out,
    }
}

/// Reads a whole file that another one names: a pipe would never end, and a device has no size to trust. What a person
/// names may well be a pipe.
pub(crate) fn read_regular(path: &Path) -> std::io::Result<Vec<u8>> {
    let found = std::fs::metadata(path)?;
    if !found.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    check_size(found.len(), LARGEST_FILE_BYTES)?;
    std::fs::read(path)
}

pub(super) fn read(path: &Path, hint: &'static str) -> Result<Vec<u8>, SceneError> {
    read_regular(path).map_err(|reason| unreadable(path, reason, hint))
}

fn unreadable(path: &Path, reason: std::io::Error, hint: &'static str) -> SceneError {
    SceneError::Unreadable { file: path.to_owned(), reason, hint }
}
