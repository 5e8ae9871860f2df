//! Files that an earlier diagnosis left in a folder: readers would take them for part of a later answer.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use super::scene_after::AFTER;
use crate::error::Error;
use crate::files::read_small;

/// The report for scripts, which every diagnosis writes.
const REPORT: &str = "report.json";

/// Every picture that a diagnosis of a cloud or of a curve can draw.
const PICTURES: [&str; 8] = [
    "residual-map",
    "quantile-map",
    "unknown-map",
    "residual-trends",
    "quantiles",
    "ranking",
    "error",
    "curve",
];

/// Files of an earlier diagnosis.
pub struct Earlier {
    folder: PathBuf,
    names: Vec<String>,
}

/// Checks that a diagnosis may write into a folder; `inputs` are the names of scenes and materials that it writes.
///
/// # Errors
/// It would replace what it reads, or a scene or material that no diagnosis wrote.
pub fn check_folder(folder: &Path, read: &[&Path], inputs: &[String]) -> Result<(), Error> {
    let mut written: Vec<String> = tables().collect();
    written.extend_from_slice(inputs);
    for path in read {
        let Some(real) = real_path(path) else { continue };
        for name in &written {
            if real_path(&folder.join(name)).is_some_and(|other| other == real) {
                return Err(Error::usage(
                    format!("{name} would be written over {}, which is read", path.display()),
                    "choose another folder",
                ));
            }
        }
    }
    for name in inputs {
        let path = folder.join(name);
        if is_file(&path) && !is_ours(&path) {
            return Err(Error::usage(
                format!("{} is there and no diagnosis wrote it", path.display()),
                "rename it, or choose another folder",
            ));
        }
    }
    Ok(())
}

impl Earlier {
    /// The files of a diagnosis that a folder holds now, without those that are read; none where it holds no
    /// diagnosis.
    pub fn in_folder(folder: &Path, read: &[&Path]) -> Earlier {
        let mut earlier = Earlier { folder: folder.to_owned(), names: Vec::new() };
        if is_diagnosis(&folder.join(REPORT)) {
            let read: Vec<Option<PathBuf>> = read.iter().map(|path| real_path(path)).collect();
            for name in names(folder) {
                if !read.contains(&real_path(&folder.join(&name))) {
                    earlier.names.push(name);
                }
            }
        }
        earlier
    }

    /// Removes the files that have not been written again, and returns a sentence for each that cannot be removed:
    /// the answer is valid all the same.
    pub fn remove_all_but(self, written: &[(String, Vec<u8>)]) -> Vec<String> {
        let mut notices = Vec::new();
        for name in &self.names {
            if written.iter().any(|(written, _)| written == name) {
                continue;
            }
            let path = self.folder.join(name);
            match std::fs::remove_file(&path) {
                Err(reason) if reason.kind() != ErrorKind::NotFound => notices.push(format!(
                    "{} is of an earlier diagnosis and cannot be removed: {reason}; remove it",
                    path.display()
                )),
                _ => {}
            }
        }
        notices
    }
}

/// A path without links and detours; none where nothing is there.
fn real_path(path: &Path) -> Option<PathBuf> {
    path.canonicalize().ok()
}

/// Names of all that every diagnosis can write but scenes and materials.
fn tables() -> impl Iterator<Item = String> {
    let tables = ["report.html", "view.html", REPORT, "residuals.csv"].map(str::to_owned);
    let pictures =
        PICTURES.iter().flat_map(|name| ["svg", "png"].map(|end| format!("{name}.{end}")));
    tables.into_iter().chain(pictures)
}

/// Names of the files in a folder that a diagnosis wrote.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = tables().filter(|name| is_file(&folder.join(name))).collect();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let Ok(name) = entry.file_name().into_string() else { continue };
        let is_scene = name == AFTER || name.starts_with("after-");
        let is_input = (is_scene || name.starts_with("material-")) && name.ends_with(".toml");
        // Scenes and materials may be somebody's own of the same name.
        let path = folder.join(&name);
        if is_input && is_file(&path) && is_ours(&path) {
            names.push(name);
        }
    }
    names
}

/// Whether a report there is a diagnosis's.
fn is_diagnosis(report: &Path) -> bool {
    let report = serde_json::from_slice::<serde_json::Value>(&bytes(report)).ok();
    report.is_some_and(|report| report.get("schema").is_some() && report.get("verdict").is_some())
}

/// Whether the first line of a scene or a material says who wrote it.
fn is_ours(path: &Path) -> bool {
    let text = bytes(path);
    let first = String::from_utf8_lossy(text.split(|&byte| byte == b'\n').next().unwrap_or(&[]));
    first.starts_with('#') && first.contains("`matdb diagnose")
}

/// The content of a regular file; empty where there is none, or one larger than a diagnosis writes.
fn bytes(path: &Path) -> Vec<u8> {
    match path.metadata() {
        Ok(found) if found.is_file() => read_small(path).unwrap_or_default(),
        _ => Vec::new(),
    }
}

fn is_file(path: &Path) -> bool {
    path.symlink_metadata().is_ok_and(|found| found.is_file() || found.is_symlink())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adopt::scene_after::MARK;

    fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            std::fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    fn left(folder: &Path) -> Vec<String> {
        let entries = std::fs::read_dir(folder).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    const VERDICT: &str = "{\"schema\": 2, \"verdict\": \"explained\"}";

    #[test]
    fn what_is_not_written_again_goes_and_what_others_wrote_stays() {
        let folder = folder_with(&[
            (REPORT, VERDICT),
            ("after.toml", MARK),
            ("curve.png", ""),
            ("unknown-map.svg", ""),
            ("residuals.csv", ""),
            ("quantiles.png", ""),
            ("material-paint.toml", "# A material with what `matdb diagnose` found in it.\n"),
            ("material-mine.toml", "name = \"mine\"\n"),
            ("notes.txt", ""),
        ]);
        std::fs::create_dir(folder.path().join("error.png")).unwrap();
        // Whatever is diagnosed stays.
        let earlier = Earlier::in_folder(folder.path(), &[&folder.path().join("residuals.csv")]);
        let written = [REPORT, "curve.png"].map(|name| (name.to_owned(), Vec::new()));
        let notices = earlier.remove_all_but(&written);
        assert!(notices.is_empty(), "{notices:?}");
        let stay =
            ["curve.png", "error.png", "material-mine.toml", "notes.txt", REPORT, "residuals.csv"];
        assert_eq!(left(folder.path()), stay);
    }

    #[test]
    fn nothing_that_is_read_or_somebodys_own_is_written_over() {
        let folder =
            folder_with(&[("residuals.csv", ""), ("curve.csv", ""), ("after.toml", "x = 1\n")]);
        let at = |name: &str| folder.path().join(name);
        let refused = |read: &str, inputs: &[&str]| {
            let inputs: Vec<String> = inputs.iter().map(|name| (*name).to_owned()).collect();
            check_folder(folder.path(), &[&at(read)], &inputs).map_err(|error| error.to_string())
        };
        assert_eq!(refused("curve.csv", &["material-paint.toml"]), Ok(()));
        assert!(refused("residuals.csv", &[]).unwrap_err().contains("which is read"));
        assert!(refused("curve.csv", &["after.toml"]).unwrap_err().contains("no diagnosis wrote"));
        std::fs::write(at("after.toml"), MARK).unwrap();
        assert_eq!(refused("curve.csv", &["after.toml"]), Ok(()));
        assert!(refused("after.toml", &["after.toml"]).unwrap_err().contains("which is read"));
        assert!(check_folder(&at("not-there"), &[&at("curve.csv")], &[]).is_ok());
    }

    #[test]
    fn a_folder_without_a_diagnosis_and_a_scene_of_somebody_stay_as_they_are() {
        for report in ["", "{\"schema\": 2}"] {
            let folder = folder_with(&[(REPORT, report), ("curve.png", ""), ("after.toml", MARK)]);
            Earlier::in_folder(folder.path(), &[]).remove_all_but(&[]);
            assert_eq!(left(folder.path()), ["after.toml", "curve.png", REPORT]);
        }
        let own = folder_with(&[(REPORT, VERDICT), ("after.toml", "name = \"mine\"\n")]);
        Earlier::in_folder(own.path(), &[]).remove_all_but(&[]);
        assert_eq!(left(own.path()), ["after.toml"]);
    }
}
