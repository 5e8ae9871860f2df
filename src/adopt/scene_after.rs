//! The scene file that declares what a diagnosis found.

use std::path::{Path, PathBuf};

use crate::diagnose::FoundEffect;
use crate::effects::{Level, Setting, find};
use crate::error::Error;
use crate::files::{FilesError, folder_of};
use crate::formats::EffectEntry;
use crate::radar::Pattern;
use crate::scene::{Scene, SceneFile};

/// Name of the scene file with what was found, in the folder of the report.
pub const AFTER: &str = "after.toml";

/// Name of the scene file of another scene than the first with what was found, in the folder of the report; `number` is
/// that of its cloud, from 0.
pub fn after_of(number: usize) -> String {
    format!("after-{}.toml", number + 1)
}

/// First line of a scene that a diagnosis wrote when it stored what it found, and may write again.
pub const MARK: &str = "# Written by `matdb diagnose --add`, which may write it again.\n";

/// The scene file with the effects of the scene and of the radar that were found, and the radar at the level that was
/// found, dB over its settings; `materials` are the names that its regions get. It has no `[[receiver]]` where an effect is
/// of the radar's own echoes alone.
pub fn scene_with_found(
    scene: &Scene,
    found: &[FoundEffect],
    level_db: Option<f64>,
    materials: &[String],
) -> SceneFile {
    let mut file = scene.file.clone();
    if let Some(level_db) = level_db {
        // Two decimals are finer than any level is known.
        let loss_db = file.radar.system_loss_db - level_db;
        file.radar.system_loss_db = ((100.0 * loss_db).round() / 100.0).clamp(-200.0, 200.0);
    }
    if !of_own_echoes(found).is_empty() {
        file.receiver.clear();
    }
    file.effect.extend(entries(found, Level::Scene));
    file.radar.effect.extend(entries(found, Level::Instrument));
    for (region, material) in std::iter::zip(&mut file.region, materials) {
        region.material.clone_from(material);
    }
    file
}

/// Names of the effects that were found and of which nothing says what they do at another antenna than the radar's.
pub(super) fn of_own_echoes(found: &[FoundEffect]) -> Vec<&'static str> {
    let is_own = |name| {
        find(name).is_some_and(|effect| effect.about().is_excluded_by(Setting::OtherAntenna))
    };
    found.iter().map(|one| one.name).filter(|name| is_own(name)).collect()
}

/// The effects of a level that were found, as entries of a file; without those of a program's own, which no file can declare.
pub(super) fn entries(
    found: &[FoundEffect],
    level: Level,
) -> impl Iterator<Item = EffectEntry> + '_ {
    let known = found.iter().filter(move |one| one.level == level && find(one.name).is_some());
    known.map(|one| EffectEntry {
        name: one.name.to_owned(),
        source: None,
        parameters: one.parameters.iter().map(|(k, v)| ((*k).to_owned(), v.value)).collect(),
    })
}

/// The scene file with the paths of its meshes and of its scan made relative to `folder`, where they were
/// relative to the folder of `scene`.
///
/// # Errors
/// A folder that cannot be found; a path that is not UTF-8.
pub fn relocate_files(
    mut file: SceneFile,
    scene: &Path,
    folder: &Path,
) -> Result<SceneFile, Error> {
    let way = way(&real(folder_of(scene))?, &real(folder)?);
    for mesh in file.mesh.iter_mut().filter(|mesh| mesh.is_in_a_file()) {
        mesh.file = utf8(way.join(&mesh.file))?;
    }
    if let Pattern::Rays(scan) | Pattern::Angles(scan) = &mut file.radar.scan {
        scan.file = utf8(way.join(&scan.file))?;
    }
    Ok(file)
}

/// The bytes of a scene file with the paths of its meshes and of its scan as seen from `folder`, where they were as seen from
/// `from`; with the comment that it begins with.
///
/// # Errors
/// Bytes that are no scene, and as [`relocate_files`].
pub fn moved_scene(bytes: &[u8], from: &Path, folder: &Path) -> Result<Vec<u8>, Error> {
    let text = String::from_utf8_lossy(bytes);
    let head: String =
        text.split_inclusive('\n').take_while(|line| line.starts_with('#')).collect();
    let file = relocate_files(SceneFile::parse(&text)?, &from.join(AFTER), folder)?;
    Ok((head + &file.write(&text)?).into_bytes())
}

/// A path as a scene file can hold it.
fn utf8(path: PathBuf) -> Result<String, Error> {
    path.into_os_string().into_string().map_err(|path| {
        Error::usage(
            format!("{} is not UTF-8, and a scene cannot say it", path.display()),
            "rename the folder, or write into one beside the scene",
        )
    })
}

/// Name of the scene file with what was found and stored, next to `scene`.
pub fn name_beside(scene: &Path) -> String {
    format!("{}-after.toml", scene.file_stem().unwrap_or_default().to_string_lossy())
}

/// Checks that the scene file with what was found may be written next to `scene`.
///
/// # Errors
/// A file of that name that no diagnosis wrote.
pub fn check_beside(scene: &Path) -> Result<(), Error> {
    let beside = folder_of(scene).join(name_beside(scene));
    let is_there = beside.symlink_metadata().is_ok();
    if is_there && !std::fs::read(&beside).is_ok_and(|text| text.starts_with(MARK.as_bytes())) {
        return Err(Error::usage(
            format!("{} is there and no diagnosis wrote it", beside.display()),
            "rename it, or do not store what is found",
        ));
    }
    Ok(())
}

/// A folder without links and detours, whether or not it is there yet.
fn real(folder: &Path) -> Result<PathBuf, Error> {
    // The working directory has an empty name.
    let real = std::path::absolute(Path::new(".").join(folder)).and_then(|whole| {
        let there = whole.ancestors().find(|path| path.exists()).unwrap_or(&whole);
        let rest = whole.strip_prefix(there).unwrap_or(Path::new(""));
        Ok(there.canonicalize()?.join(rest))
    });
    Ok(real
        .map_err(|reason| FilesError { verb: "find", ..FilesError::unreadable(folder, reason) })?)
}

/// The relative path to a folder from another one; both are absolute.
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
        assert!(checked().unwrap_err().contains("no diagnosis wrote it"));
        std::fs::write(at("scene-after.toml"), MARK).unwrap();
        assert_eq!(checked(), Ok(()));
    }
}
