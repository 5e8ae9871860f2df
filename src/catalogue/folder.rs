//! The only way in which files of a publication are written: into a folder beside the target, which
//! takes the target's place when everything is there.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use tempfile::{Builder, TempDir};

use super::CatalogueError;

/// Tells a publication from somebody's own folder.
const MARK: &str = "SHA256SUMS";

/// A publication that is being written. What is dropped before it is [kept](Folder::keep) leaves no trace.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    staged: TempDir,
    sums: BTreeMap<String, String>,
}

impl Folder {
    /// Begins to write what shall stand at `target`.
    ///
    /// # Errors
    /// When `target` holds anything but an earlier publication, or nothing can be written beside it.
    pub fn new(target: &Path) -> Result<Folder, CatalogueError> {
        let io = |verb, path: &Path| {
            let path = path.to_owned();
            move |reason| CatalogueError::Io { verb, path, reason }
        };
        if is_occupied(target).map_err(io("read", target))? {
            return Err(CatalogueError::Occupied { folder: target.to_owned() });
        }
        let beside = match target.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        fs::create_dir_all(beside).map_err(io("create", beside))?;
        let mut builder = Builder::new();
        builder.prefix(".matdb-");
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(fs::Permissions::from_mode(0o777));
        }
        let staged = builder.tempdir_in(beside).map_err(io("create", beside))?;
        Ok(Folder { target: target.to_owned(), staged, sums: BTreeMap::new() })
    }

    /// What stood at the target before, if anything did.
    pub fn before(&self) -> Option<&Path> {
        self.target.join(MARK).is_file().then_some(self.target.as_path())
    }

    /// Writes a whole file; `path` is relative, its parts joined by `/`.
    ///
    /// # Errors
    /// When it cannot be written.
    pub fn write(&mut self, path: &str, bytes: &[u8]) -> Result<(), CatalogueError> {
        self.stream(path, |out| out.write_all(bytes))
    }

    /// Writes a file piece by piece.
    ///
    /// # Errors
    /// When it cannot be written, and those of `write`.
    pub fn stream(
        &mut self,
        path: &str,
        write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
    ) -> Result<(), CatalogueError> {
        let place = self.staged.path().join(path);
        let sum = write_hashed(&place, write).map_err(|reason| CatalogueError::Io {
            verb: "write",
            path: self.target.join(path),
            reason,
        })?;
        self.sums.insert(path.to_owned(), sum);
        Ok(())
    }

    /// SHA-256 of every file so far, hexadecimal, by path.
    pub fn sums(&self) -> &BTreeMap<String, String> {
        &self.sums
    }

    /// Writes the list of hashes and puts everything in its place.
    ///
    /// # Errors
    /// When the places cannot be exchanged; what was there then stays.
    pub fn keep(mut self) -> Result<(), CatalogueError> {
        let list: String = self.sums.iter().map(|(path, sum)| format!("{sum}  {path}\n")).collect();
        self.write(MARK, list.as_bytes())?;
        let Folder { target, staged, .. } = self;
        let failed = |reason| CatalogueError::Io { verb: "write", path: target.clone(), reason };
        let aside = staged.path().with_extension("before");
        let had_one = target.exists();
        if had_one {
            fs::rename(&target, &aside).map_err(failed)?;
        }
        if let Err(reason) = fs::rename(staged.path(), &target) {
            if had_one {
                // The first error is the one to report.
                let _ = fs::rename(&aside, &target);
            }
            return Err(failed(reason));
        }
        if had_one {
            fs::remove_dir_all(&aside).map_err(failed)?;
        }
        Ok(())
    }
}

fn is_occupied(target: &Path) -> io::Result<bool> {
    if !target.exists() || target.join(MARK).is_file() {
        return Ok(false);
    }
    Ok(fs::read_dir(target)?.next().is_some())
}

fn write_hashed(
    place: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<String> {
    if let Some(folder) = place.parent() {
        fs::create_dir_all(folder)?;
    }
    let mut out = Hashed { out: BufWriter::new(File::create(place)?), hash: Sha256::new() };
    write(&mut out)?;
    out.out.flush()?;
    Ok(out.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}

/// A file whose bytes are hashed on the way.
struct Hashed {
    out: BufWriter<File>,
    hash: Sha256,
}

impl Write for Hashed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hash.update(bytes.get(..written).unwrap_or(bytes));
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.out.flush()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_publication_takes_the_place_of_an_earlier_one_as_a_whole() {
        let root = tempfile::tempdir().unwrap();
        let target = root.path().join("a/site");
        let mut first = Folder::new(&target).unwrap();
        first.write("x/old.txt", b"1").unwrap();
        assert!(!target.exists());
        first.keep().unwrap();
        assert_eq!(fs::read(target.join("x/old.txt")).unwrap(), b"1");
        let mut second = Folder::new(&target).unwrap();
        second.write("new.txt", b"abc").unwrap();
        drop(Folder::new(&target).unwrap());
        second.keep().unwrap();
        assert!(!target.join("x").exists());
        let sums = fs::read_to_string(target.join(MARK)).unwrap();
        // SHA-256 of "abc", FIPS 180-2 appendix B.1.
        assert!(
            sums.starts_with("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
        );
        assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 1);
    }

    #[test]
    fn somebodys_own_folder_is_left_alone() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("thesis.txt"), "").unwrap();
        assert!(matches!(Folder::new(root.path()), Err(CatalogueError::Occupied { .. })));
    }
}
