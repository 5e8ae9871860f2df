//! Why a file cannot be read or written.

use std::io;
use std::path::{Path, PathBuf};

use thiserror::Error;

/// A file or folder that cannot be read or written.
#[derive(Debug, Error)]
#[error("cannot {verb} {}: {reason}; {way_out}", path.display())]
pub struct FilesError {
    /// `read`, `write`, `create the folder`.
    pub verb: &'static str,
    /// The file or folder.
    pub path: PathBuf,
    /// What the system says.
    pub reason: io::Error,
    /// What to do.
    pub way_out: &'static str,
}

impl FilesError {
    /// The way out of a folder that cannot be written into.
    pub const OTHER_FOLDER: &str = "make room or choose another folder";

    /// That a file cannot be read; the way out is to check its path.
    pub fn unreadable(path: &Path, reason: io::Error) -> FilesError {
        FilesError { verb: "read", path: path.to_owned(), reason, way_out: "check the path" }
    }

    /// That a file or folder cannot be written; the way out is room or another folder.
    pub fn unwritable(verb: &'static str, path: &Path, reason: io::Error) -> FilesError {
        FilesError { verb, path: path.to_owned(), reason, way_out: FilesError::OTHER_FOLDER }
    }
}
