//! What an earlier diagnosis left in a folder: it would pass for part of a later answer.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::adopt::AFTER;
use crate::cli::console::Console;
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
pub(super) struct Earlier {
    folder: PathBuf,
    names: Vec<String>,
}

/// Refuses a folder in which a diagnosis would write over what it reads, or over somebody's own scene or material;
/// `inputs` are the names of these that it writes.
pub(super) fn check(folder: &Path, read: &[&Path], inputs: &[String]) -> Result<(), Error> {
    let real = |path: &Path| path.canonicalize().ok();
    let written = || tables().chain(inputs.iter().cloned());
    for path in read.iter().filter(|path| real(path).is_some()) {
        if let Some(name) = written().find(|name| real(&folder.join(name)) == real(path)) {
            return Err(Error::Usage {
                problem: format!("{name} would be written over {}, which is read", path.display()),
                way_out: "choose another folder with -o".to_owned(),
            });
        }
    }
    for path in inputs.iter().map(|name| folder.join(name)) {
        if is_file(&path) && !is_ours(&path) {
            return Err(Error::Usage {
                problem: format!("{} is there and no diagnosis wrote it", path.display()),
                way_out: "rename it, or choose another folder with -o".to_owned(),
            });
        }
    }
    Ok(())
}

impl Earlier {
    /// What stands in a folder now beside these, which are read; nothing where no diagnosis has been
    /// written to.
    pub fn in_folder(folder: &Path, read: &[&Path]) -> Earlier {
        let names = if is_diagnosis(&folder.join(REPORT)) { names(folder) } else { Vec::new() };
        let real = |path: &Path| path.canonicalize().ok();
        let read: Vec<Option<PathBuf>> = read.iter().map(|path| real(path)).collect();
        let is_read = |name: &String| read.contains(&real(&folder.join(name)));
        let names = names.into_iter().filter(|name| !is_read(name)).collect();
        Earlier { folder: folder.to_owned(), names }
    }

    /// Takes away what is not among the files that have been written since, and tells what it cannot: the
    /// answer is there all the same.
    pub fn remove_all_but<Name: AsRef<str>>(self, written: &[(Name, Vec<u8>)], console: &Console) {
        let is_new = |name: &str| written.iter().any(|(written, _)| written.as_ref() == name);
        for name in self.names.iter().filter(|name| !is_new(name)) {
            let path = self.folder.join(name);
            match std::fs::remove_file(&path) {
                Err(reason) if reason.kind() != ErrorKind::NotFound => console.notice(&format!(
                    "{} is of an earlier diagnosis and cannot be removed: {reason}; remove it",
                    path.display()
                )),
                _ => {}
            }
        }
    }
}

/// Names of all that every diagnosis can write but scenes and materials.
fn tables() -> impl Iterator<Item = String> {
    let tables = ["report.html", REPORT, "residuals.csv"].map(str::to_owned);
    let pictures =
        PICTURES.iter().flat_map(|name| ["svg", "png"].map(|end| format!("{name}.{end}")));
    tables.into_iter().chain(pictures)
}

/// Names of all that a diagnosis can write into a folder, so far as they stand there.
fn names(folder: &Path) -> Vec<String> {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let files = files.filter_map(|entry| entry.file_name().into_string().ok());
    // Scenes and materials may be somebody's own of the same name.
    let is_input =
        |name: &String| name == AFTER || (name.starts_with("material-") && name.ends_with(".toml"));
    let inputs = files.filter(is_input).filter(|name| is_ours(&folder.join(name)));
    tables().chain(inputs).filter(|name| is_file(&folder.join(name))).collect()
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

/// What stands in a file; nothing where it is none, or none that a diagnosis wrote.
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
    use crate::adopt::MARK;

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

    const QUIET: Console = Console { json: false, quiet: true, verbose: false };

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
        earlier.remove_all_but(&[(REPORT, Vec::new()), ("curve.png", Vec::new())], &QUIET);
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
            check(folder.path(), &[&at(read)], &inputs).map_err(|error| error.to_string())
        };
        assert_eq!(refused("curve.csv", &["material-paint.toml"]), Ok(()));
        assert!(refused("residuals.csv", &[]).unwrap_err().contains("which is read"));
        assert!(refused("curve.csv", &["after.toml"]).unwrap_err().contains("no diagnosis wrote"));
        std::fs::write(at("after.toml"), MARK).unwrap();
        assert_eq!(refused("curve.csv", &["after.toml"]), Ok(()));
        assert!(refused("after.toml", &["after.toml"]).unwrap_err().contains("which is read"));
        assert!(check(&at("not-there"), &[&at("curve.csv")], &[]).is_ok());
    }

    #[test]
    fn a_folder_without_a_diagnosis_and_a_scene_of_somebody_stay_as_they_are() {
        for report in ["", "{\"schema\": 2}"] {
            let folder = folder_with(&[(REPORT, report), ("curve.png", ""), ("after.toml", MARK)]);
            Earlier::in_folder(folder.path(), &[]).remove_all_but::<&str>(&[], &QUIET);
            assert_eq!(left(folder.path()), ["after.toml", "curve.png", REPORT]);
        }
        let own = folder_with(&[(REPORT, VERDICT), ("after.toml", "name = \"mine\"\n")]);
        Earlier::in_folder(own.path(), &[]).remove_all_but::<&str>(&[], &QUIET);
        assert_eq!(left(own.path()), ["after.toml"]);
    }
}
