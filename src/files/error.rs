//! Why a file cannot be read or written.

use std::fmt;
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
    pub way_out: WayOut,
}

/// What to do about a file or folder that cannot be read or written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WayOut {
    /// Make room, or choose another folder for what is written.
    OtherFolder,
    /// Anything else, in words.
    Words(&'static str),
}

impl FilesError {
    /// That a file cannot be read; the way out is to check its path.
    pub fn unreadable(path: &Path, reason: io::Error) -> FilesError {
        let way_out = WayOut::Words("check the path");
        FilesError { verb: "read", path: path.to_owned(), reason, way_out }
    }

    /// That a file or folder cannot be written; the way out is room or another folder.
    pub fn unwritable(verb: &'static str, path: &Path, reason: io::Error) -> FilesError {
        FilesError { verb, path: path.to_owned(), reason, way_out: WayOut::OtherFolder }
    }
}

impl fmt::Display for WayOut {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            WayOut::OtherFolder => "make room or choose another folder",
            WayOut::Words(words) => words,
        })
    }
}
