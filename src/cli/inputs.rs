//! Which command made a revision of what, for `Store::record`.

use std::path::Path;

use crate::error::Error;
use crate::material::{Activity, Input};

/// A file that was read, by its name without its folder and its bytes.
pub(super) fn input(path: &Path, bytes: &[u8]) -> Input {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Input { name, hash: blake3::hash(bytes).to_hex().to_string() }
}

/// A command and the files that it was given.
pub(super) fn activity(command: &str, paths: &[&Path]) -> Result<Activity, Error> {
    let read = |path: &&Path| {
        let bytes = std::fs::read(path).map_err(|reason| Error::Io {
            verb: "read",
            path: (*path).to_owned(),
            reason,
            way_out: "leave the command's files where they are while it runs",
        })?;
        Ok(input(path, &bytes))
    };
    let inputs = paths.iter().map(read).collect::<Result<_, Error>>()?;
    Ok(Activity { command: command.to_owned(), inputs, origin: None })
}
