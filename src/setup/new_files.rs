//! Files that are not there yet.

use std::fs;
use std::path::Path;

use crate::error::Error;
use crate::files::write_all;

/// Writes files into a folder, unless one of them is there. What a killed run has left of them is completed.
///
/// # Errors
/// The file that is there with another content, or that cannot be written.
pub fn write_new(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Error> {
    let is_begun = files.iter().any(|(name, _)| !folder.join(name).exists());
    let is_ours =
        |path: &Path, bytes: &[u8]| is_begun && fs::read(path).is_ok_and(|there| there == bytes);
    let there = files
        .iter()
        .map(|(name, bytes)| (folder.join(name), bytes))
        .find(|(path, bytes)| path.exists() && !is_ours(path, bytes))
        .map(|(path, _)| path);
    match there {
        None => Ok(write_all(folder, files)?),
        Some(path) => Err(Error::usage(
            format!("{} exists already", path.display()),
            "name another, or remove it",
        )),
    }
}
