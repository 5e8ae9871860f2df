//! Reading a small file whole.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;

use super::error::FilesError;

/// Largest file that [`read_small`] reads, bytes.
pub const LARGEST_SMALL_FILE_BYTES: u64 = 64 << 20;

/// Reads a whole file. A pipe is read as well, up to the same size: a file without an end is refused.
///
/// # Errors
/// A file that cannot be read, or is larger than [`LARGEST_SMALL_FILE_BYTES`] (`ErrorKind::FileTooLarge`).
pub fn read_small(path: &Path) -> Result<Vec<u8>, FilesError> {
    let mut bytes = Vec::new();
    let read = File::open(path)
        .and_then(|file| file.take(LARGEST_SMALL_FILE_BYTES + 1).read_to_end(&mut bytes));
    let reason = match read {
        Err(reason) => reason,
        Ok(_) if bytes.len() as u64 <= LARGEST_SMALL_FILE_BYTES => return Ok(bytes),
        Ok(_) => {
            let problem = format!("it is larger than {} MiB", LARGEST_SMALL_FILE_BYTES >> 20);
            std::io::Error::new(ErrorKind::FileTooLarge, problem)
        }
    };
    Err(FilesError::unreadable(path, reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_a_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        std::fs::write(&path, "text").unwrap();
        assert_eq!(read_small(&path).unwrap(), b"text");
        File::options()
            .write(true)
            .open(&path)
            .unwrap()
            .set_len(LARGEST_SMALL_FILE_BYTES + 1)
            .unwrap();
        assert_eq!(read_small(&path).unwrap_err().reason.kind(), ErrorKind::FileTooLarge);
        let missing = read_small(&folder.path().join("missing")).unwrap_err();
        assert!(missing.to_string().ends_with("; check the path"), "{missing}");
    }
}
