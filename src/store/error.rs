//! What can go wrong with a database file, in the words of its user.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use rusqlite::ErrorCode;
use thiserror::Error;

use crate::files::folder_of;
use crate::material::MaterialError;

/// Why a database could not be used. A refused write has changed nothing.
#[derive(Debug, Error)]
pub enum StoreError {
    /// Something else has this name; it was not touched.
    #[error("{} is not a matdb database; name another file", file.display())]
    Foreign {
        /// The file.
        file: PathBuf,
    },
    /// A later program has written it; it was not touched.
    #[error(
        "{} has schema {found}, but this program knows schemas up to {known}; install a newer matdb",
        file.display()
    )]
    Newer {
        /// The file.
        file: PathBuf,
        /// Its schema.
        found: usize,
        /// The latest schema that this program knows.
        known: usize,
    },
    /// Another program held it for longer than we wait.
    #[error("{} is in use by another program; try again when that has finished", file.display())]
    Busy {
        /// The file.
        file: PathBuf,
    },
    /// A write to it was cut short, and only a writer may take that back.
    #[error(
        "beside {} lies a journal of a write that was cut short; if the file is yours, `matdb add` of any \
         material takes that back, else remove the journal",
        file.display()
    )]
    Interrupted {
        /// The file.
        file: PathBuf,
    },
    /// It can be read, but not written.
    #[error("{} cannot be written; {way_out}", file.display())]
    ReadOnly {
        /// The file.
        file: PathBuf,
        /// What must be writable.
        way_out: String,
    },
    /// The file contradicts itself.
    #[error(
        "{} is damaged: {problem}; a check lists all damage, a repair mends what can be, a copy of the file brings back the rest",
        file.display()
    )]
    Corrupt {
        /// The file.
        file: PathBuf,
        /// What was noticed.
        problem: String,
    },
    /// Its pages are damaged, so that neither a check nor a repair comes to its end.
    #[error(
        "{} is damaged, and no repair mends that: {problem}; restore the file from a copy, or export what can still be read",
        file.display()
    )]
    BeyondRepair {
        /// The file.
        file: PathBuf,
        /// What was noticed.
        problem: String,
    },
    /// An object that is not of matdb keeps the schema from being brought up to date; the file is as it was.
    #[error(
        "{} cannot be brought up to date: {problem}; rename or remove {object} in another program",
        file.display()
    )]
    InTheWay {
        /// The file.
        file: PathBuf,
        /// Kind and name of the object.
        object: String,
        /// Why it is in the way.
        problem: String,
    },
    /// Somebody has added a trigger, which would run whenever the program writes; it was not touched.
    #[error(
        "{} has a trigger `{name}` that matdb has not made and that would run whenever it writes; remove it in \
         another program with DROP TRIGGER \"{name}\"",
        file.display()
    )]
    Trigger {
        /// The file.
        file: PathBuf,
        /// Name of the trigger.
        name: String,
    },
    /// The file and its log contradict each other.
    #[error(
        "{} and its log {} contradict each other: {problem}; if it is the log of another database, move it away, else \
         bring both back from a copy",
        file.display(), log.display()
    )]
    OtherLog {
        /// The file.
        file: PathBuf,
        /// Its log.
        log: PathBuf,
        /// What was noticed.
        problem: String,
    },
    /// The number of its schema is wrong.
    #[error(
        "{} says that it has schema {said}, but its {object} is of a later one; bring the file back from a copy",
        file.display()
    )]
    WrongSchema {
        /// The file.
        file: PathBuf,
        /// The number that it says.
        said: usize,
        /// Kind and name of what is of a later schema.
        object: String,
    },
    /// The file is empty or not there, but its log is.
    #[error(
        "{} is empty or not there, but its log {} is; bring the file back from a copy, or move the log away to begin anew",
        file.display(), log.display()
    )]
    Lost {
        /// The file.
        file: PathBuf,
        /// Its log.
        log: PathBuf,
    },
    /// A log holds what was written last, and cannot be read without another file next to it.
    #[error(
        "{} holds what was written last to {} and cannot be read where no file can be made next to it; copy both to a \
         folder that you may write",
        log.display(), file.display()
    )]
    Log {
        /// The file.
        file: PathBuf,
        /// Its log.
        log: PathBuf,
    },
    /// No name is free for one more copy of a damaged file.
    #[error(
        "{} was not repaired: {copies} copies of earlier repairs lie next to it; move some away",
        file.display()
    )]
    Copies {
        /// The file.
        file: PathBuf,
        /// How many there are.
        copies: u32,
    },
    /// What was written could not be read again as it was; nothing was stored.
    #[error("{problem}; nothing was stored in {}, report it with this message", file.display())]
    NotReadable {
        /// The file.
        file: PathBuf,
        /// Which material, and what came back.
        problem: String,
    },
    /// Its end is missing.
    #[error(
        "{} was cut off: it has {bytes} bytes and says that it has {said}; only a copy of the file brings back the rest",
        file.display()
    )]
    CutOff {
        /// The file.
        file: PathBuf,
        /// Its length.
        bytes: u64,
        /// The length of which it speaks.
        said: i64,
    },
    /// No room left.
    #[error("the disk has no room left for {}; free some and try again", file.display())]
    Full {
        /// The file.
        file: PathBuf,
    },
    /// The file can be neither opened nor made.
    #[error("cannot open {}: {reason}; mend that or name another file", file.display())]
    Open {
        /// The file.
        file: PathBuf,
        /// What the operating system says.
        reason: io::Error,
    },
    /// Reading or writing failed underneath.
    #[error("cannot read or write {}: {error}; if the disk or its quota is full, make room there, else check the disk", file.display())]
    Disk {
        /// The file.
        file: PathBuf,
        /// What SQLite says.
        error: rusqlite::Error,
    },
    /// The schema could not be brought up to date; the file is as it was.
    #[error("cannot bring {} up to date: {error}; report it with this message", file.display())]
    Migration {
        /// The file.
        file: PathBuf,
        /// What went wrong.
        error: rusqlite_migration::Error,
    },
    /// The material itself is not sound.
    #[error("material `{slug}`: {error}")]
    Material {
        /// Its name.
        slug: String,
        /// What is wrong.
        error: MaterialError,
    },
    /// Anything else.
    #[error("{}: {error}; if it persists, report it with this message", file.display())]
    Sqlite {
        /// The file.
        file: PathBuf,
        /// What SQLite says.
        error: rusqlite::Error,
    },
}

impl StoreError {
    /// That a file can be read, but not written.
    pub(super) fn read_only(path: &Path) -> StoreError {
        StoreError::ReadOnly { file: path.to_owned(), way_out: way_to_write(path) }
    }

    /// Sorts SQLite's errors by what the user can do about them.
    pub(super) fn new(path: &Path, error: rusqlite::Error) -> StoreError {
        use rusqlite::Error::*;
        let file = path.to_owned();
        // The rest of a long problem is SQL, which tells the user nothing.
        let corrupt = |problem: String| {
            let problem = problem.lines().next().unwrap_or_default().to_owned();
            StoreError::Corrupt { file: file.clone(), problem }
        };
        let failure = match &error {
            SqlInputError { msg, .. } => return corrupt(msg.clone()),
            error if is_damage(error) => return corrupt(error.to_string()),
            SqliteFailure(failure, _) => failure,
            ToSqlConversionFailure(reason) => {
                return StoreError::NotReadable { problem: reason.to_string(), file: file.clone() };
            }
            _ => return StoreError::Sqlite { file, error },
        };
        match failure.code {
            ErrorCode::NotADatabase => StoreError::Foreign { file },
            ErrorCode::DatabaseBusy | ErrorCode::DatabaseLocked => StoreError::Busy { file },
            ErrorCode::ReadOnly => StoreError::read_only(path),
            ErrorCode::DiskFull => StoreError::Full { file },
            ErrorCode::CannotOpen => StoreError::Open { file, reason: obstacle(path) },
            ErrorCode::SystemIoFailure => StoreError::Disk { file, error },
            _ => StoreError::Sqlite { file, error },
        }
    }
}

/// Whether an error comes from damage in the file.
pub(super) fn is_damage(error: &rusqlite::Error) -> bool {
    use rusqlite::Error::*;
    match error {
        // A damaged row may claim to be huge, a damaged schema may no longer suit our SQL, and what a valid material
        // violates is not a constraint of ours.
        SqliteFailure(failure, _) => matches!(
            failure.code,
            ErrorCode::DatabaseCorrupt
                | ErrorCode::OutOfMemory
                | ErrorCode::Unknown
                | ErrorCode::ConstraintViolation
        ),
        SqlInputError { .. }
        | FromSqlConversionFailure(..)
        | InvalidColumnType(..)
        | Utf8Error(..)
        | IntegralValueOutOfRange(..) => true,
        _ => false,
    }
}

/// Why a step failed, without the file: in our own words where those of SQLite would say nothing to a user.
pub(super) fn reason(error: &rusqlite::Error) -> String {
    use rusqlite::Error::{FromSqlConversionFailure, SqliteFailure};
    match error {
        SqliteFailure(failure, said) => match (failure.code, said.as_deref()) {
            (ErrorCode::DatabaseCorrupt, None | Some("database disk image is malformed")) => {
                "pages of the file are damaged".to_owned()
            }
            (ErrorCode::ConstraintViolation, _) => {
                "what would be written contradicts other rows of the file".to_owned()
            }
            (_, Some(said)) => said.to_owned(),
            _ => error.to_string(),
        },
        FromSqlConversionFailure(_, _, problem) => problem.to_string(),
        _ => error.to_string(),
    }
}

/// Names the file in an error of SQLite.
pub(super) trait InFile<T> {
    /// The result, with an error that says what the user can do about the file.
    fn in_file(self, path: &Path) -> Result<T, StoreError>;
}

impl<T> InFile<T> for rusqlite::Result<T> {
    fn in_file(self, path: &Path) -> Result<T, StoreError> {
        self.map_err(|error| StoreError::new(path, error))
    }
}

/// What must be writable for a database to be: SQLite does not say which of its files is not.
fn way_to_write(path: &Path) -> String {
    let beside = ["-wal", "-shm"].map(|ending| {
        let mut name = path.as_os_str().to_owned();
        name.push(ending);
        PathBuf::from(name)
    });
    let there = beside.iter().filter(|file| file.symlink_metadata().is_ok());
    let there: Vec<String> = there.map(|file| file.display().to_string()).collect();
    match there.join(" and ") {
        none if none.is_empty() => "make it and its directory writable".to_owned(),
        files => format!(
            "make it, its directory, and {files} writable, or, if the -wal is empty and no program uses \
             the database, remove what lies beside it"
        ),
    }
}

/// Why a file cannot be opened. SQLite does not say, and to try it ourselves would drop the locks
/// that other connections of this process hold, so this only looks.
fn obstacle(path: &Path) -> io::Error {
    match (fs::metadata(path), fs::metadata(folder_of(path))) {
        (_, Err(reason)) => reason,
        (Err(reason), _) if reason.kind() != io::ErrorKind::NotFound => reason,
        (_, Ok(found)) if !found.is_dir() => io::ErrorKind::NotADirectory.into(),
        _ => io::ErrorKind::PermissionDenied.into(),
    }
}
