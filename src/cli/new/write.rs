//! Files that are not there yet.

use std::path::Path;

use crate::error::Error;
use crate::files::write_all;

/// Writes files into a folder, unless one of them is there.
pub(super) fn write_new(folder: &Path, files: &[(String, Vec<u8>)]) -> Result<(), Error> {
    let there = files.iter().map(|(name, _)| folder.join(name)).find(|path| path.exists());
    match there {
        None => Ok(write_all(folder, files)?),
        Some(path) => Err(Error::usage(
            format!("{} exists already", path.display()),
            "name another with -o, or remove it",
        )),
    }
}
