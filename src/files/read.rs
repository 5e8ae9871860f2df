//! Reading a small file whole.

use std::fs::File;
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::sync::mpsc;
use std::time::Duration;

use super::error::FilesError;

/// Largest file that [`read_small`] reads, bytes.
pub const LARGEST_SMALL_FILE_BYTES: u64 = 64 << 20;

/// Largest file that [`read_whole`] reads, and most of a pipe or device, which may have no end, bytes.
pub(crate) const LARGEST_FILE_BYTES: u64 = 16 << 30;
const MOST_OF_A_PIPE_BYTES: u64 = 1 << 30;

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

/// Reads a whole file of up to 16 GiB, or a pipe of up to 1 GiB to its end.
///
/// # Errors
/// A file that cannot be read, or is larger (`ErrorKind::FileTooLarge`); a pipe that no program writes to.
pub fn read_whole(path: &Path) -> Result<Vec<u8>, FilesError> {
    read_up_to(path, MOST_OF_A_PIPE_BYTES)
}

fn read_up_to(path: &Path, most_of_a_pipe: u64) -> Result<Vec<u8>, FilesError> {
    let whole = open(path).and_then(|file| {
        let found = file.metadata()?;
        let most = if found.is_file() { LARGEST_FILE_BYTES } else { most_of_a_pipe };
        if found.is_file() {
            check_size(found.len(), most)?;
        }
        let mut bytes = Vec::new();
        bytes.try_reserve_exact(found.len() as usize).map_err(io::Error::other)?;
        file.take(most + 1).read_to_end(&mut bytes)?;
        check_size(bytes.len() as u64, most)?;
        Ok(bytes)
    });
    whole.map_err(|reason| FilesError::unreadable(path, reason))
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
    let read = read.and_then(|_| check_size(bytes.len() as u64, LARGEST_SMALL_FILE_BYTES));
    read.map(|()| bytes).map_err(|reason| FilesError::unreadable(path, reason))
}

/// Refuses a size beyond the most, `ErrorKind::FileTooLarge`.
pub(crate) fn check_size(bytes: u64, most: u64) -> io::Result<()> {
    if bytes <= most {
        return Ok(());
    }
    let problem = match most >> 30 {
        0 => format!("it is larger than {} MiB", most >> 20),
        gib => format!("it is larger than {gib} GiB"),
    };
    Err(io::Error::new(ErrorKind::FileTooLarge, problem))
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
        File::options().write(true).open(&path).unwrap().set_len(LARGEST_FILE_BYTES + 1).unwrap();
        let refused = read_whole(&path).unwrap_err();
        assert!(refused.to_string().contains("it is larger than 16 GiB"), "{refused}");
        if cfg!(unix) {
            let endless = read_up_to(Path::new("/dev/zero"), 3 << 20).unwrap_err();
            assert!(endless.to_string().contains("it is larger than 3 MiB"), "{endless}");
        }
        let missing = read_small(&folder.path().join("missing")).unwrap_err();
        assert!(missing.to_string().ends_with("; check the path"), "{missing}");
    }
}
