//! Which command made a revision of what, for `Store::record`.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use crate::error::Error;
use crate::material::{Activity, Input};

/// Largest file that is read at once and is no cloud or mesh, bytes.
pub(super) const LARGEST_FILE_BYTES: u64 = 64 << 20;

/// Reads a whole file, but nothing that has no end.
pub(super) fn read_small(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LARGEST_FILE_BYTES + 1).read_to_end(&mut bytes)?;
    match bytes.len() as u64 > LARGEST_FILE_BYTES {
        false => Ok(bytes),
        true => {
            let problem = format!("it is larger than {} MiB", LARGEST_FILE_BYTES >> 20);
            Err(std::io::Error::new(ErrorKind::FileTooLarge, problem))
        }
    }
}

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
