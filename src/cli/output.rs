//! Writing a set of files into a folder: all of them, or none.

use std::io::{Read, Write};
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use tempfile::{Builder, NamedTempFile, TempPath};

use crate::error::Error;

/// Writes `files` (name, bytes) into `folder`, creating it when needed.
///
/// Every file is written under a temporary name first; when all are complete they take the places
/// of what was there. On an error everything is as it was before.
pub(super) fn write_all<Name: AsRef<str> + Sync>(
    folder: &Path,
    files: &[(Name, Vec<u8>)],
) -> Result<(), Error> {
    Written::new(&[(folder, files)]).map(Written::keep)
}

/// A folder and the files (name, bytes) that are to stand in it.
pub(super) type Folder<'a, Name> = (&'a Path, &'a [(Name, Vec<u8>)]);

/// Files that have taken their places; what was there comes back when this is dropped before it is
/// [kept](Written::keep).
#[derive(Default)]
#[must_use = "what is not kept is taken back"]
pub(super) struct Written {
    placed: Vec<Placed>,
    /// Folders that were not there, those within others first.
    created: Vec<PathBuf>,
}

impl Written {
    /// Writes files into several folders as [`write_all`] does into one: all of them or none.
    pub fn new<Name: AsRef<str> + Sync>(folders: &[Folder<Name>]) -> Result<Written, Error> {
        let mut written = Written::default();
        let mut staged = Vec::new();
        for (folder, files) in folders {
            written.created.splice(0..0, create_folder(folder)?);
            staged.push((*folder, stage(folder, files)?));
        }
        // What a device or another program has taken does not come back, so it gets it last.
        let mut staged: Vec<_> = staged
            .into_iter()
            .flat_map(|(folder, files)| files.into_iter().map(move |file| (folder, file)))
            .collect();
        staged.sort_by_key(|(_, (_, file))| matches!(file, Staged::Through(..)));
        for (folder, (name, file)) in staged {
            let placed = place(file).map_err(|reason| failed(folder, name, reason))?;
            written.placed.extend(placed);
        }
        Ok(written)
    }

    /// Leaves the files where they are.
    pub fn keep(mut self) {
        self.placed.clear();
        self.created.clear();
    }
}

impl Drop for Written {
    fn drop(&mut self) {
        self.placed.drain(..).rev().for_each(take_back);
        // Deepest first; a folder that has something in it by now stays.
        self.created.iter().for_each(|path| drop(std::fs::remove_dir(path)));
    }
}

/// Creates a folder and its parents; the ones that were missing, deepest first.
fn create_folder(folder: &Path) -> Result<Vec<PathBuf>, Error> {
    let missing: Vec<PathBuf> = folder
        .ancestors()
        .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
        .map(Path::to_owned)
        .collect();
    std::fs::create_dir_all(folder).map_err(|reason| {
        missing.iter().for_each(|path| drop(std::fs::remove_dir(path)));
        Error::Io {
            verb: "create the folder",
            path: folder.to_owned(),
            reason,
            way_out: "choose another with -o",
        }
    })?;
    Ok(missing)
}

/// A file that waits for its place.
enum Staged<'a> {
    /// A whole file beside its place.
    Whole(NamedTempFile, PathBuf),
    /// Bytes for a device or a pipe, which stays what it is.
    Through(&'a [u8], PathBuf),
}

/// Whether SQLite keeps a database there.
fn is_database(path: &Path) -> bool {
    const MAGIC: &[u8; 16] = b"SQLite format 3\0";
    let mut head = [0; MAGIC.len()];
    let read = std::fs::File::open(path).and_then(|mut file| file.read_exact(&mut head));
    read.is_ok() && head == *MAGIC
}

/// Where a file goes: a link stays, and what it leads to is replaced.
fn target(path: PathBuf) -> std::io::Result<PathBuf> {
    match path.symlink_metadata() {
        Ok(found) if found.is_symlink() => path.canonicalize(),
        _ => Ok(path),
    }
}

fn stage<'a, Name: AsRef<str> + Sync>(
    folder: &Path,
    files: &'a [(Name, Vec<u8>)],
) -> Result<Vec<(&'a str, Staged<'a>)>, Error> {
    let write = |(name, bytes): &'a (Name, Vec<u8>)| {
        let path = folder.join(name.as_ref());
        if path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir()) {
            return Ok((name.as_ref(), Staged::Through(bytes, path)));
        }
        let path = target(path)?;
        if is_database(&path) {
            return Err(std::io::Error::other("a database is there, which is not written over"));
        }
        let beside = path.parent().unwrap_or(folder);
        let mut builder = Builder::new();
        builder.prefix(".matdb-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666));
        }
        let mut file = builder.tempfile_in(beside)?;
        file.write_all(bytes)?;
        file.as_file().sync_data()?;
        Ok((name.as_ref(), Staged::Whole(file, path)))
    };
    // A disk takes several at once; of several errors the first file's is told.
    let staged: Vec<_> = files.par_iter().map(write).collect();
    let at = |(result, (name, _)): (std::io::Result<_>, &(Name, _))| {
        result.map_err(|reason| failed(folder, name.as_ref(), reason))
    };
    staged.into_iter().zip(files).map(at).collect()
}

/// A file that has taken its place, and what was there before.
struct Placed {
    path: PathBuf,
    before: Option<TempPath>,
}

/// Puts a file in its place; what was there is kept under a temporary name.
fn place(file: Staged) -> std::io::Result<Option<Placed>> {
    let (file, path) = match file {
        Staged::Whole(file, path) => (file, path),
        Staged::Through(bytes, path) => {
            std::fs::File::options().write(true).open(path)?.write_all(bytes)?;
            return Ok(None);
        }
    };
    let folder = path.parent().unwrap_or(Path::new("."));
    let before = match path.symlink_metadata() {
        Ok(found) if found.is_dir() => return Err(std::io::ErrorKind::IsADirectory.into()),
        Ok(_) => {
            let kept = Builder::new().prefix(".matdb-").tempfile_in(folder)?.into_temp_path();
            std::fs::rename(&path, &kept)?;
            Some(kept)
        }
        Err(_) => None,
    };
    match file.persist(&path) {
        Ok(_) => Ok(Some(Placed { path, before })),
        Err(error) => {
            take_back(Placed { path, before });
            Err(error.error)
        }
    }
}

fn take_back(Placed { path, before }: Placed) {
    // The error that led here is the one to report; a second one could only hide it.
    match before {
        Some(kept) => drop(kept.persist(&path)),
        None => drop(std::fs::remove_file(&path)),
    }
}

fn failed(folder: &Path, name: &str, reason: std::io::Error) -> Error {
    Error::Io {
        verb: "write",
        path: folder.join(name),
        reason,
        way_out: "make room or choose another folder with -o",
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
        drop(Written::new(&[(&new, &files), (&old, &files)]).unwrap());
        assert_eq!(entries(root.path()), ["old"]);
        assert_eq!(std::fs::read(old.join("one")).unwrap(), b"old");
        let nowhere = old.join("one/sub");
        assert!(Written::new(&[(&new, &files), (&nowhere, &files)]).is_err());
        assert_eq!(entries(root.path()), ["old"]);
        Written::new(&[(&new, &files), (&old, &files)]).unwrap().keep();
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
        drop(Written::new(&[(root.path(), &[("link", b"more".to_vec())])]).unwrap());
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
