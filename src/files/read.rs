//! Reading a small file whole.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

use super::error::FilesError;

/// Largest file that [`read_small`] reads, bytes.
pub const LARGEST_SMALL_FILE_BYTES: u64 = 64 << 20;

/// How long a pipe may lack a writer.
const PATIENCE: Duration = Duration::from_secs(5);

/// Opens a file or a pipe for reading. To open a named pipe is to wait for its writer; where none comes within
/// [`PATIENCE`], that is an error.
///
/// # Errors
/// A file that cannot be opened, a pipe that no program writes to (`ErrorKind::TimedOut`).
fn open(path: &Path) -> io::Result<File> {
    let found = path.metadata()?;
    if found.is_file() || found.is_dir() {
        return File::open(path);
    }
    let (sender, receiver) = mpsc::channel();
    let pipe = path.to_owned();
    // Without a writer this thread waits until the program ends: no portable call takes an opening back.
    std::thread::spawn(move || sender.send(File::open(pipe)));
    receiver.recv_timeout(PATIENCE).unwrap_or_else(|_| {
        let problem = "it is a pipe, and no program writes to it";
        Err(io::Error::new(ErrorKind::TimedOut, problem))
    })
}

/// Reads a whole file of any size, or a pipe to its end.
///
/// # Errors
/// A file that cannot be read, a pipe that no program writes to.
pub fn read_whole(path: &Path) -> Result<Vec<u8>, FilesError> {
    let mut bytes = Vec::new();
    match open(path).and_then(|mut file| file.read_to_end(&mut bytes)) {
        Ok(_) => Ok(bytes),
        Err(reason) => Err(FilesError::unreadable(path, reason)),
    }
}

/// Reads a whole small file. A pipe is read as well, up to the same size: a file without an end is refused.
///
/// # Errors
/// A file that cannot be read, or is larger than [`LARGEST_SMALL_FILE_BYTES`] (`ErrorKind::FileTooLarge`); a pipe that
/// no program writes to.
pub fn read_small(path: &Path) -> Result<Vec<u8>, FilesError> {
    let mut bytes = Vec::new();
    let read =
        open(path).and_then(|file| file.take(LARGEST_SMALL_FILE_BYTES + 1).read_to_end(&mut bytes));
    let reason = match read {
        Err(reason) => reason,
        Ok(_) if bytes.len() as u64 <= LARGEST_SMALL_FILE_BYTES => return Ok(bytes),
        Ok(_) => {
            let problem = format!("it is larger than {} MiB", LARGEST_SMALL_FILE_BYTES >> 20);
            io::Error::new(ErrorKind::FileTooLarge, problem)
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
