//! Writing a set of files into one or several folders: all of them, or none.

use std::io::{self, ErrorKind, Read, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use tempfile::{Builder, NamedTempFile, TempPath};

use super::error::FilesError;
use super::path::{exchange, folder_of};

/// Begins the names of files that are being written.
const PREFIX: &str = ".matdb-";

/// Writes `files` (name, bytes) into `folder`, creating it when needed.
///
/// Every file is written under a temporary name first; when all are complete they replace what was there. On
/// an error everything is as it was before.
///
/// # Errors
/// The first file or folder that cannot be written; a database, which is not written over.
pub fn write_all<Name: AsRef<str> + Sync>(
    folder: &Path,
    files: &[(Name, Vec<u8>)],
) -> Result<(), FilesError> {
    Placement::new(&[(folder, files)]).map(Placement::keep)
}

/// A folder and the files (name, bytes) that are to stand in it.
pub type FolderFiles<'a, Name> = (&'a Path, &'a [(Name, Vec<u8>)]);

/// Files that are in their places. What they replaced comes back when this is dropped before it is
/// [kept](Placement::keep).
#[derive(Default)]
#[must_use = "files that are not kept are taken back"]
pub struct Placement {
    replaced: Vec<Replacement>,
    /// Folders that were not there, those within others first.
    created: Vec<PathBuf>,
}

impl Placement {
    /// Writes files into several folders as [`write_all`] does into one: all of them or none.
    ///
    /// # Errors
    /// The first file or folder that cannot be written; a database, which is not written over.
    pub fn new<Name: AsRef<str> + Sync>(
        folders: &[FolderFiles<Name>],
    ) -> Result<Placement, FilesError> {
        let mut placement = Placement::default();
        let mut pending = Vec::new();
        for (folder, files) in folders {
            placement.created.splice(0..0, create_folder(folder)?);
            // A disk takes several at once; of several errors the first file's is reported.
            let prepared: Vec<io::Result<NewFile>> = files
                .par_iter()
                .map(|(name, bytes)| prepare(folder, name.as_ref(), bytes))
                .collect();
            for (file, (name, _)) in std::iter::zip(prepared, *files) {
                let path = folder.join(name.as_ref());
                match file {
                    Ok(file) => pending.push((path, file)),
                    Err(reason) => return Err(FilesError::unwritable("write", &path, reason)),
                }
            }
        }
        // Bytes that a device or another program has read cannot be taken back, so it gets them last.
        pending.sort_by_key(|(_, file)| matches!(file, NewFile::Stream(..)));
        for (path, file) in pending {
            let replaced =
                file.place().map_err(|reason| FilesError::unwritable("write", &path, reason))?;
            placement.replaced.extend(replaced);
        }
        Ok(placement)
    }

    /// Leaves the files where they are.
    pub fn keep(mut self) {
        self.replaced.clear();
        self.created.clear();
    }
}

impl Drop for Placement {
    fn drop(&mut self) {
        self.replaced.drain(..).rev().for_each(Replacement::restore);
        remove_empty(&self.created);
    }
}

/// Creates a folder and its parents; the ones that were missing, deepest first.
fn create_folder(folder: &Path) -> Result<Vec<PathBuf>, FilesError> {
    let missing: Vec<PathBuf> = folder
        .ancestors()
        .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
        .map(Path::to_owned)
        .collect();
    match std::fs::create_dir_all(folder) {
        Ok(()) => Ok(missing),
        Err(reason) => {
            remove_empty(&missing);
            Err(FilesError::unwritable("create the folder", folder, reason))
        }
    }
}

/// Removes folders, deepest first; one that has something in it by now stays.
fn remove_empty(folders: &[PathBuf]) {
    for folder in folders {
        let _ = std::fs::remove_dir(folder);
    }
}

/// A file before it is in its place.
enum NewFile<'a> {
    /// A whole file next to its place.
    Whole(NamedTempFile, PathBuf),
    /// Bytes for a device or a pipe, which stays what it is.
    Stream(&'a [u8], PathBuf),
}

/// Writes a file next to its place, unless a device is there.
fn prepare<'a>(folder: &Path, name: &str, bytes: &'a [u8]) -> io::Result<NewFile<'a>> {
    let path = folder.join(name);
    if path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        return Ok(NewFile::Stream(bytes, path));
    }
    let path = follow_link(path)?;
    if is_database(&path) {
        return Err(io::Error::other("a database is there, which is not written over"));
    }
    let mut builder = Builder::new();
    builder.prefix(PREFIX);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(std::fs::Permissions::from_mode(0o666));
    }
    let mut file = builder.tempfile_in(path.parent().unwrap_or(folder))?;
    file.write_all(bytes)?;
    file.as_file().sync_data()?;
    Ok(NewFile::Whole(file, path))
}

/// The path that a file is written to: a link stays, and the file that it leads to is replaced.
fn follow_link(path: PathBuf) -> io::Result<PathBuf> {
    match path.symlink_metadata() {
        Ok(found) if found.is_symlink() => path.canonicalize(),
        _ => Ok(path),
    }
}

/// Whether SQLite keeps a database there.
fn is_database(path: &Path) -> bool {
    const MAGIC: &[u8; 16] = b"SQLite format 3\0";
    let mut head = [0; MAGIC.len()];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head == *MAGIC
}

impl NewFile<'_> {
    /// Puts the file in its place; what was there is kept under a temporary name.
    fn place(self) -> io::Result<Option<Replacement>> {
        let (file, path) = match self {
            NewFile::Whole(file, path) => (file, path),
            NewFile::Stream(bytes, path) => {
                std::fs::File::options().write(true).open(path)?.write_all(bytes)?;
                return Ok(None);
            }
        };
        let before = match path.symlink_metadata() {
            Ok(found) if found.is_dir() => return Err(ErrorKind::IsADirectory.into()),
            // In one step where the system can: a program that dies meanwhile leaves one of the two files there.
            Ok(_) if exchange(file.path(), &path).is_ok() => {
                return Ok(Some(Replacement { path, before: Some(file.into_temp_path()) }));
            }
            Ok(_) => {
                let before =
                    Builder::new().prefix(PREFIX).tempfile_in(folder_of(&path))?.into_temp_path();
                std::fs::rename(&path, &before)?;
                Some(before)
            }
            Err(_) => None,
        };
        let placed = file.persist(&path);
        let replaced = Replacement { path, before };
        match placed {
            Ok(_) => Ok(Some(replaced)),
            Err(error) => {
                replaced.restore();
                Err(error.error)
            }
        }
    }
}

/// The place of a file that was written, and what was there before.
struct Replacement {
    path: PathBuf,
    before: Option<TempPath>,
}

impl Replacement {
    fn restore(self) {
        // The error that led here is the one to report; a second one could only hide it.
        match self.before {
            Some(before) => drop(before.persist(&self.path)),
            None => drop(std::fs::remove_file(&self.path)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let names = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name());
        let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn all_files_arrive_and_no_temporary_stays() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("a/b");
        write_all(&folder, &[("one", b"1".to_vec()), ("two", b"2".to_vec())]).unwrap();
        assert_eq!(entries(&folder), ["one", "two"]);
        write_all(&folder, &[("one", b"3".to_vec())]).unwrap();
        assert_eq!(std::fs::read(folder.join("one")).unwrap(), b"3");
    }

    #[test]
    fn a_failure_leaves_what_was_there() {
        let root = tempfile::tempdir().unwrap();
        std::fs::write(root.path().join("one"), "old").unwrap();
        std::fs::create_dir(root.path().join("two")).unwrap();
        let files = ["none", "one", "two"].map(|name| (name, b"new".to_vec()));
        assert!(write_all(root.path(), &files).is_err());
        assert_eq!(entries(root.path()), ["one", "two"]);
        assert_eq!(std::fs::read(root.path().join("one")).unwrap(), b"old");
    }

    #[test]
    fn several_folders_are_written_or_none_and_what_is_not_kept_is_taken_back() {
        let root = tempfile::tempdir().unwrap();
        let [new, old] = ["new/sub", "old"].map(|name| root.path().join(name));
        std::fs::create_dir(&old).unwrap();
        std::fs::write(old.join("one"), "old").unwrap();
        let files = [("one", b"new".to_vec())];
        drop(Placement::new(&[(&new, &files), (&old, &files)]).unwrap());
        assert_eq!(entries(root.path()), ["old"]);
        assert_eq!(std::fs::read(old.join("one")).unwrap(), b"old");
        let nowhere = old.join("one/sub");
        assert!(Placement::new(&[(&new, &files), (&nowhere, &files)]).is_err());
        assert_eq!(entries(root.path()), ["old"]);
        Placement::new(&[(&new, &files), (&old, &files)]).unwrap().keep();
        assert_eq!(std::fs::read(new.join("one")).unwrap(), b"new");
        assert_eq!(entries(&old), ["one"]);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_devices_stay_what_they_are() {
        let root = tempfile::tempdir().unwrap();
        let at = |name: &str| root.path().join(name);
        std::fs::create_dir(at("far")).unwrap();
        std::fs::write(at("far/real"), "old").unwrap();
        std::os::unix::fs::symlink("far/real", at("link")).unwrap();
        std::os::unix::fs::symlink("nowhere", at("dangling")).unwrap();
        std::os::unix::fs::symlink("/dev/null", at("null")).unwrap();
        write_all(root.path(), &[("link", b"new".to_vec()), ("null", b"x".to_vec())]).unwrap();
        assert_eq!(std::fs::read(at("far/real")).unwrap(), b"new");
        for link in ["link", "null", "dangling"] {
            assert!(at(link).symlink_metadata().unwrap().is_symlink(), "{link}");
        }
        assert!(write_all(root.path(), &[("dangling", b"x".to_vec())]).is_err());
        assert_eq!(entries(root.path()), ["dangling", "far", "link", "null"]);
        drop(Placement::new(&[(root.path(), &[("link", b"more".to_vec())])]).unwrap());
        assert_eq!(std::fs::read(at("far/real")).unwrap(), b"new");
    }

    #[test]
    fn a_folder_that_cannot_be_made_leaves_no_parents() {
        let root = tempfile::tempdir().unwrap();
        std::fs::write(root.path().join("file"), "x").unwrap();
        assert!(write_all::<&str>(&root.path().join("file/sub"), &[]).is_err());
        assert_eq!(entries(root.path()), ["file"]);
    }
}
