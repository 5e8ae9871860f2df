//! The scene with what was found, as a file.

use std::path::{Path, PathBuf};

use crate::diagnose::Found;
use crate::effects::Level;
use crate::error::Error;
use crate::formats::EffectEntry;
use crate::radar::Pattern;
use crate::scene::{Scene, SceneFile};

/// Name of the scene with what was found, in the folder of the report.
pub(super) const AFTER: &str = "after.toml";

/// First line of a scene that `--add` wrote and may write again.
pub(super) const MARK: &str = "# Written by `matdb diagnose --add`, which may write it again.\n";

/// The scene with effects of its own and of its radar; `materials` are those of its regions.
pub(super) fn with_found(scene: &Scene, found: &[Found], materials: &[String]) -> SceneFile {
    let mut file = scene.file.clone();
    file.effect.extend(entries(found, Level::Scene));
    file.radar.effect.extend(entries(found, Level::Instrument));
    for (region, material) in std::iter::zip(&mut file.region, materials) {
        region.material.clone_from(material);
    }
    file
}

/// What was found of a level, as files write it.
pub(super) fn entries(found: &[Found], level: Level) -> impl Iterator<Item = EffectEntry> + '_ {
    found.iter().filter(move |one| one.level == level).map(|one| EffectEntry {
        name: one.name.to_owned(),
        source: None,
        parameters: one.parameters.iter().map(|(k, v)| ((*k).to_owned(), v.value)).collect(),
    })
}

/// The scene with its files as they are found from `folder` instead of from beside `scene`.
pub(super) fn moved(mut file: SceneFile, scene: &Path, folder: &Path) -> Result<SceneFile, Error> {
    let way = way(&real(folder_of(scene))?, &real(folder)?);
    let text = |path: PathBuf| {
        path.into_os_string().into_string().map_err(|path| Error::Usage {
            problem: format!("{} is not UTF-8, and a scene cannot say it", path.display()),
            way_out: "rename the folder, or write into one beside the scene with -o".to_owned(),
        })
    };
    for mesh in file.mesh.iter_mut().filter(|mesh| !mesh.file.starts_with("builtin:")) {
        mesh.file = text(way.join(&mesh.file))?;
    }
    if let Pattern::Rays(scan) | Pattern::Angles(scan) = &mut file.radar.scan {
        scan.file = text(way.join(&scan.file))?;
    }
    Ok(file)
}

/// The folder that a scene stands in.
pub(super) fn folder_of(scene: &Path) -> &Path {
    scene.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Name of the scene with what was found that `--add` puts beside the old one.
pub(super) fn name_beside(scene: &Path) -> String {
    format!("{}-after.toml", scene.file_stem().unwrap_or_default().to_string_lossy())
}

/// Refuses, for `--add`, to write over a scene beside this one that somebody else wrote.
pub(super) fn check_beside(scene: &Path) -> Result<(), Error> {
    let beside = folder_of(scene).join(name_beside(scene));
    let is_ours = || std::fs::read(&beside).is_ok_and(|text| text.starts_with(MARK.as_bytes()));
    if beside.symlink_metadata().is_ok() && !is_ours() {
        return Err(Error::Usage {
            problem: format!("{} is there and --add did not write it", beside.display()),
            way_out: "rename it, or leave --add out".to_owned(),
        });
    }
    Ok(())
}

/// A folder without links and detours, whether or not it is there yet.
fn real(folder: &Path) -> Result<PathBuf, Error> {
    let unreadable = |reason| Error::Io {
        verb: "find",
        path: folder.to_owned(),
        reason,
        way_out: "check the path",
    };
    let whole = std::path::absolute(folder).map_err(unreadable)?;
    let there = whole.ancestors().find(|path| path.exists()).unwrap_or(&whole);
    let rest = whole.strip_prefix(there).unwrap_or(Path::new(""));
    Ok(there.canonicalize().map_err(unreadable)?.join(rest))
}

/// The way to a folder from another; both are absolute.
fn way(to: &Path, from: &Path) -> PathBuf {
    let shared = std::iter::zip(to.components(), from.components()).take_while(|(a, b)| a == b);
    let shared = shared.count();
    if shared == 0 {
        return to.to_owned();
    }
    let up = from.components().skip(shared).map(|_| std::path::Component::ParentDir);
    up.chain(to.components().skip(shared)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_folder_is_found_from_another() {
        for (to, from, expected) in [
            ("/a/b", "/a/b", ""),
            ("/a/b", "/a/b/out", ".."),
            ("/a/b", "/a/c/out", "../../b"),
            ("/a/b/in", "/a/b", "in"),
            ("/a", "/b", "../a"),
        ] {
            assert_eq!(way(Path::new(to), Path::new(from)), Path::new(expected), "{to} {from}");
        }
    }

    #[test]
    fn a_scene_of_somebody_is_not_written_over() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let checked = || check_beside(&at("scene.toml")).map_err(|error| error.to_string());
        assert_eq!(checked(), Ok(()));
        std::fs::write(at("scene-after.toml"), "name = \"mine\"\n").unwrap();
        assert!(checked().unwrap_err().contains("--add did not write it"));
        std::fs::write(at("scene-after.toml"), MARK).unwrap();
        assert_eq!(checked(), Ok(()));
    }
}
