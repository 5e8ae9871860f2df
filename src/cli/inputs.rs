//! Reading files that a person names.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

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
