//! Writing the files of a publication: into a folder next to the target, which replaces the target when everything is
//! written.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use sha2::{Digest, Sha256};
use tempfile::TempDir;

use super::error::CatalogueError;
use super::layout::{ABOUT, CONTENT, INDEX, KEPT, SUMS};
use super::listing::files;
use crate::files::{FilesError, NewFolder, replacement_obstacle};

/// A file of a publication.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Checksum {
    /// SHA-256, hexadecimal.
    pub sha256: String,
    /// Its length.
    pub bytes: u64,
}

/// A publication that is being written. What is dropped before it is [kept](Folder::keep_if) leaves no trace.
#[derive(Debug)]
pub struct Folder {
    target: PathBuf,
    place: Place,
    sums: BTreeMap<String, Checksum>,
}

/// Where files go before they are in their place.
#[derive(Debug)]
enum Place {
    /// Into a folder that replaces the target.
    Target(NewFolder),
    /// Nowhere: only their hashes are wanted; what must be written by its path is removed again.
    Hashed(TempDir),
}

impl Place {
    fn path(&self) -> &Path {
        match self {
            Place::Target(folder) => folder.path(),
            Place::Hashed(folder) => folder.path(),
        }
    }
}

/// The publication in whose folder a target lies.
fn publication_around(target: &Path) -> Option<PathBuf> {
    let absolute = std::path::absolute(target).ok()?;
    let mut around = absolute.ancestors().skip(1);
    let publication =
        around.find(|folder| [SUMS, ABOUT].iter().all(|file| folder.join(file).is_file()));
    publication.map(Path::to_owned)
}

impl Folder {
    /// Begins to write what shall stand at `target`.
    ///
    /// # Errors
    /// When `target` holds anything but an earlier publication or lies in one, or nothing can be written beside it.
    pub fn new(target: &Path) -> Result<Folder, CatalogueError> {
        // A link stays, and what it leads to is replaced.
        let resolved = match target.symlink_metadata() {
            Ok(_) => {
                fs::canonicalize(target).map_err(|reason| FilesError::unreadable(target, reason))?
            }
            Err(_) => target.to_owned(),
        };
        let stranger =
            stranger(&resolved).map_err(|reason| FilesError::unreadable(target, reason))?;
        if let Some(stranger) = stranger {
            return Err(CatalogueError::Occupied { folder: target.to_owned(), stranger });
        }
        if let Some(problem) = replacement_obstacle(&resolved) {
            return Err(CatalogueError::Fixed { folder: target.to_owned(), problem });
        }
        if let Some(publication) = publication_around(&resolved) {
            return Err(CatalogueError::Within { folder: target.to_owned(), publication });
        }
        let place = Place::Target(NewFolder::new(&resolved, CONTENT)?);
        Ok(Folder { target: resolved, place, sums: BTreeMap::new() })
    }

    /// What would be written over `published`, as hashes only; those of `sums` are known.
    ///
    /// # Errors
    /// When there is no room for temporary files.
    pub(super) fn hashed(
        published: &Path,
        sums: BTreeMap<String, Checksum>,
    ) -> Result<Folder, CatalogueError> {
        let folder = tempfile::tempdir()
            .map_err(|reason| FilesError::unwritable("write", &std::env::temp_dir(), reason))?;
        let place = Place::Hashed(folder);
        Ok(Folder { target: published.to_owned(), place, sums })
    }

    /// What stood at the target before, if anything did.
    pub fn before(&self) -> Option<&Path> {
        self.target.join(SUMS).is_file().then_some(self.target.as_path())
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
        let sum = match &self.place {
            Place::Target(folder) => write_hashed(&folder.path().join(path), write),
            Place::Hashed(_) => hash(BufWriter::new(io::sink()), write),
        };
        let sum = sum.map_err(|reason| self.unwritable(path, reason))?;
        self.sums.insert(path.to_owned(), sum);
        Ok(())
    }

    /// Lets `make` write a file by its path, for writers that take nothing else. The file keeps this
    /// path, which is returned, until everything is put in place, and must not change any more.
    ///
    /// # Errors
    /// When it cannot be written, and those of `make`.
    pub fn place<E: From<CatalogueError>>(
        &mut self,
        path: &str,
        make: impl FnOnce(&Path) -> Result<(), E>,
    ) -> Result<PathBuf, E> {
        let place = self.place.path().join(path);
        if let Some(folder) = place.parent() {
            fs::create_dir_all(folder).map_err(|reason| self.unwritable(path, reason))?;
        }
        make(&place)?;
        let mut sum = File::open(&place).and_then(hashed);
        if matches!(self.place, Place::Hashed(_)) {
            sum = sum.and_then(|sum| fs::remove_file(&place).map(|()| sum));
        }
        self.sums.insert(path.to_owned(), sum.map_err(|reason| self.unwritable(path, reason))?);
        Ok(place)
    }

    fn unwritable(&self, path: &str, reason: io::Error) -> CatalogueError {
        FilesError::unwritable("write", &self.target.join(path), reason).into()
    }

    /// Hash and length of every file so far, by path.
    pub fn sums(&self) -> &BTreeMap<String, Checksum> {
        &self.sums
    }

    /// Writes the list of hashes and, if `check` finds nothing wrong in the folder, puts everything in its place.
    ///
    /// # Errors
    /// Those of `check`, and when the places cannot be exchanged; what was there then stays.
    pub fn keep_if(
        mut self,
        check: impl FnOnce(&Path) -> Result<(), CatalogueError>,
    ) -> Result<(), CatalogueError> {
        let list: String =
            self.sums.iter().map(|(path, sum)| format!("{}  {path}\n", sum.sha256)).collect();
        self.write(SUMS, list.as_bytes())?;
        check(self.place.path())?;
        match self.place {
            Place::Target(folder) => Ok(folder.replace_target()?),
            Place::Hashed(_) => Ok(()),
        }
    }
}

/// A file in a folder that belongs to no publication, so that the folder must not be replaced.
fn stranger(target: &Path) -> io::Result<Option<String>> {
    if !target.exists() {
        return Ok(None);
    }
    let sums = match fs::read_to_string(target.join(SUMS)) {
        Err(reason) if reason.kind() == io::ErrorKind::NotFound => String::new(),
        sums => sums?,
    };
    let listed: BTreeSet<&str> = sums.lines().filter_map(|line| line.get(66..)).collect();
    if !listed.contains(INDEX) {
        for entry in fs::read_dir(target)? {
            let name = entry?.file_name().to_string_lossy().into_owned();
            if !KEPT.contains(&name.as_str()) {
                return Ok(Some(name));
            }
        }
        return Ok(None);
    }
    let mut paths = files(target)?.into_iter().map(|(path, _)| path);
    Ok(paths.find(|path| path != SUMS && !listed.contains(path.as_str())))
}

/// Hash and length of the rest of a file.
pub(super) fn hashed(mut file: impl Read) -> io::Result<Checksum> {
    let mut sink = HashingWriter { out: io::sink(), hash: Sha256::new(), bytes: 0 };
    io::copy(&mut file, &mut sink)?;
    Ok(sink.sum())
}

fn write_hashed(
    place: &Path,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<Checksum> {
    if let Some(folder) = place.parent() {
        fs::create_dir_all(folder)?;
    }
    hash(BufWriter::new(File::create(place)?), write)
}

fn hash(
    out: impl Write,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<Checksum> {
    let mut out = HashingWriter { out, hash: Sha256::new(), bytes: 0 };
    write(&mut out)?;
    out.flush()?;
    Ok(out.sum())
}

/// A writer that also hashes what it writes.
struct HashingWriter<W> {
    out: W,
    hash: Sha256,
    bytes: u64,
}

impl<W> HashingWriter<W> {
    fn sum(self) -> Checksum {
        let sha256 = self.hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        Checksum { sha256, bytes: self.bytes }
    }
}

impl<W: Write> Write for HashingWriter<W> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.out.write(bytes)?;
        self.hash.update(bytes.get(..written).unwrap_or(bytes));
        self.bytes += written as u64;
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
        first.write(INDEX, b"{}").unwrap();
        assert!(!target.exists());
        first.keep_if(|_| Ok(())).unwrap();
        assert_eq!(fs::read(target.join("x/old.txt")).unwrap(), b"1");
        let mut second = Folder::new(&target).unwrap();
        second.write("new.txt", b"abc").unwrap();
        drop(Folder::new(&target).unwrap());
        second.keep_if(|_| Ok(())).unwrap();
        assert!(!target.join("x").exists());
        let sums = fs::read_to_string(target.join(SUMS)).unwrap();
        // SHA-256 of "abc", FIPS 180-2 appendix B.1.
        assert!(
            sums.starts_with("ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad")
        );
        assert_eq!(fs::read_dir(root.path().join("a")).unwrap().count(), 1);
    }

    #[test]
    fn somebodys_own_folder_is_left_alone() {
        let root = tempfile::tempdir().unwrap();
        let occupied = |target: &Path| match Folder::new(target) {
            Err(CatalogueError::Occupied { stranger, .. }) => stranger,
            other => panic!("{other:?}"),
        };
        fs::write(root.path().join("thesis.txt"), "").unwrap();
        assert_eq!(occupied(root.path()), "thesis.txt");
        // Others hash their files, too.
        let mine = root.path().join("mine");
        let sums = |path: &str| fs::write(mine.join(SUMS), format!("{:064}  {path}\n", 0)).unwrap();
        fs::create_dir(&mine).unwrap();
        sums("a.iso");
        assert_eq!(occupied(&mine), SUMS);
        sums(INDEX);
        assert!(Folder::new(&mine).is_ok());
        fs::write(mine.join("note.txt"), "").unwrap();
        assert_eq!(occupied(&mine), "note.txt");
    }
}
