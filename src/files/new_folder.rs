//! A folder that is written next to its target and then exchanged for it, so that the target is replaced whole or not
//! at all; what a killed program has left is removed.

use std::ffi::OsStr;
use std::fs::{self, File, Permissions};
use std::io;
use std::path::{Path, PathBuf};

use tempfile::{Builder, TempDir};

use super::error::FilesError;
use super::path::{exchange, folder_of};

/// Ends the name of what stood at the target while something else takes its place.
const BEFORE: &str = "before";

/// What of a target folder matters to its replacement.
#[derive(Clone, Copy, Debug)]
pub struct FolderContent {
    /// Names of files and folders that move from the old folder into the new one.
    pub kept: &'static [&'static str],
    /// A file that only a complete folder has.
    pub proof: &'static str,
}

/// A folder that is being written to replace `target`. It is locked until it is dropped, so that no other program
/// removes it as left over.
#[derive(Debug)]
pub struct NewFolder {
    folder: TempDir,
    target: PathBuf,
    content: FolderContent,
    _claim: Option<File>,
}

impl NewFolder {
    /// Makes an empty folder next to `target` and removes those that no program writes any more.
    ///
    /// # Errors
    /// Nothing can be written next to the target.
    pub fn new(target: &Path, content: FolderContent) -> Result<NewFolder, FilesError> {
        NewFolder::create(target, content)
            .map_err(|reason| FilesError::unwritable("create a folder next to", target, reason))
    }

    fn create(target: &Path, content: FolderContent) -> io::Result<NewFolder> {
        let beside = folder_of(target);
        fs::create_dir_all(beside)?;
        // Others neither look at a new folder between its making and its locking, nor at two names that
        // are just being exchanged.
        let _turn = locked(beside);
        let prefix = prefix(target);
        sweep(beside, &prefix, target, content)?;
        let mut builder = Builder::new();
        builder.prefix(&prefix);
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(Permissions::from_mode(0o777));
        }
        let folder = builder.tempdir_in(beside)?;
        let claim = File::open(folder.path()).ok().filter(|claim| claim.try_lock().is_ok());
        Ok(NewFolder { folder, target: target.to_owned(), content, _claim: claim })
    }

    /// Where the files are written.
    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Replaces the target by this folder; of the old one only the [kept](FolderContent::kept) names remain.
    ///
    /// # Errors
    /// The folders cannot be exchanged; the old one then stays.
    pub fn replace_target(self) -> Result<(), FilesError> {
        self.exchange().map_err(|reason| FilesError::unwritable("write", &self.target, reason))
    }

    fn exchange(&self) -> io::Result<()> {
        let NewFolder { folder, target, content, .. } = self;
        let _turn = locked(folder_of(target));
        written(folder.path())?;
        if !target.exists() {
            fs::rename(folder.path(), target)?;
        } else if exchange(folder.path(), target).is_ok() {
            if let Err(reason) = carry(content.kept, folder.path(), target) {
                // The first error is the one to report.
                let _ = carry(content.kept, target, folder.path());
                let _ = exchange(folder.path(), target);
                return Err(reason);
            }
        } else {
            let aside = folder.path().with_extension(BEFORE);
            fs::rename(target, &aside)?;
            let placed = fs::rename(folder.path(), target)
                .and_then(|()| carry(content.kept, &aside, target));
            if let Err(reason) = placed {
                let _ = carry(content.kept, target, &aside);
                let _ = fs::rename(target, folder.path());
                let _ = fs::rename(&aside, target);
                return Err(reason);
            }
            // The target is replaced by now; the next program to write it removes what remains here.
            let _ = fs::remove_dir_all(&aside);
        }
        // The names are there whether or not the disk knows them already.
        let _ = File::open(folder_of(target)).and_then(|folder| folder.sync_all());
        Ok(())
    }
}

/// Begins the name of every new folder of a target, and of no other target in the same folder.
fn prefix(target: &Path) -> String {
    let name = target.file_name().unwrap_or_default();
    let hash = blake3::hash(name.as_encoded_bytes()).to_hex();
    format!(".matdb-{}-", hash.get(..16).unwrap_or_default())
}

/// Holds a folder until it is dropped, where the system can lock folders.
fn locked(folder: &Path) -> Option<File> {
    let folder = File::open(folder).ok()?;
    folder.lock().ok()?;
    Some(folder)
}

/// Removes what programs that were killed have left, and puts back what they had moved away.
fn sweep(beside: &Path, prefix: &str, target: &Path, content: FolderContent) -> io::Result<()> {
    for entry in fs::read_dir(beside)? {
        let entry = entry?;
        let is_ours = entry.file_name().to_string_lossy().starts_with(prefix);
        if !is_ours || !entry.file_type()?.is_dir() {
            continue;
        }
        let stale = entry.path();
        // Whoever still writes it holds the lock; where there are no locks nobody can tell.
        let is_left = File::open(&stale).is_ok_and(|folder| folder.try_lock().is_ok());
        if !is_left {
            continue;
        }
        let stood_there = stale.extension() == Some(OsStr::new(BEFORE));
        if stood_there && !target.exists() && stale.join(content.proof).exists() {
            fs::rename(&stale, target)?;
            continue;
        }
        carry(content.kept, &stale, target)?;
        if content.kept.iter().all(|name| stale.join(name).symlink_metadata().is_err()) {
            // Whoever has just replaced the target may be removing it, too.
            let _ = fs::remove_dir_all(&stale);
        }
    }
    Ok(())
}

/// Moves what is kept from one folder to another, unless that has its own.
fn carry(kept: &[&str], from: &Path, to: &Path) -> io::Result<()> {
    for name in kept {
        let [old, new] = [from, to].map(|folder| folder.join(name));
        let is_wanted = old.symlink_metadata().is_ok() && new.symlink_metadata().is_err();
        if is_wanted && to.is_dir() {
            fs::rename(old, new)?;
        }
    }
    Ok(())
}

/// Waits until the disk has all of a folder.
#[cfg(target_os = "linux")]
fn written(folder: &Path) -> io::Result<()> {
    Ok(rustix::fs::syncfs(File::open(folder)?)?)
}

#[cfg(not(target_os = "linux"))]
fn written(folder: &Path) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            written(&entry.path())?;
        } else {
            File::options().write(true).open(entry.path())?.sync_all()?;
        }
    }
    Ok(())
}

/// Why a folder cannot be replaced by another, if that is known without trying.
pub fn replacement_obstacle(target: &Path) -> Option<&'static str> {
    if target.file_name().is_none() {
        return Some("that is not a name that a folder could get");
    }
    if !target.exists() {
        return None;
    }
    if std::env::current_dir().is_ok_and(|here| here.starts_with(target)) {
        return Some("you are in it");
    }
    is_mount(target).then_some("another disk is mounted there")
}

#[cfg(unix)]
fn is_mount(target: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;
    let device = |path: &Path| fs::metadata(path).map(|found| found.dev()).ok();
    device(target) != device(folder_of(target))
}

#[cfg(not(unix))]
fn is_mount(_: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const CONTENT: FolderContent = FolderContent { kept: &["CNAME"], proof: "SUMS" };

    fn names(folder: &Path) -> Vec<String> {
        let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name());
        let mut names: Vec<String> = names.map(|n| n.to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn what_a_killed_program_left_goes_and_what_a_running_one_writes_stays() {
        let root = tempfile::tempdir().unwrap();
        let [site, other] = ["site", "other"].map(|name| root.path().join(name));
        let prefix = prefix(&site);
        fs::create_dir_all(root.path().join(format!("{prefix}dead/x"))).unwrap();
        let running = NewFolder::new(&site, CONTENT).unwrap();
        let of_other = NewFolder::new(&other, CONTENT).unwrap();
        drop(NewFolder::new(&site, CONTENT).unwrap());
        let mut left = names(root.path());
        left.retain(|name| *name != running.path().file_name().unwrap().to_string_lossy());
        assert_eq!(left, [of_other.path().file_name().unwrap().to_string_lossy()]);
    }

    #[test]
    fn a_folder_that_cannot_be_made_is_named_by_its_target() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("file"), "").unwrap();
        let target = root.path().join("file/site");
        let message = NewFolder::new(&target, CONTENT).unwrap_err().to_string();
        let expected = format!("cannot create a folder next to {}: ", target.display());
        assert!(message.starts_with(&expected), "{message}");
    }

    #[test]
    fn a_program_killed_between_two_names_loses_nothing() {
        let root = tempfile::tempdir().unwrap();
        let site = root.path().join("site");
        let prefix = prefix(&site);
        let before = root.path().join(format!("{prefix}dead.{BEFORE}"));
        fs::create_dir(&before).unwrap();
        fs::write(before.join(CONTENT.proof), "").unwrap();
        let new = root.path().join(format!("{prefix}dead"));
        fs::create_dir(&new).unwrap();
        fs::write(new.join("CNAME"), "example.org").unwrap();
        drop(NewFolder::new(&site, CONTENT).unwrap());
        drop(NewFolder::new(&site, CONTENT).unwrap());
        assert_eq!(names(root.path()), ["site"]);
        assert_eq!(names(&site), ["CNAME", CONTENT.proof]);
    }
}
