//! Where numbers come from: the command and the files that made a revision, and the sources of a material.

use std::path::Path;

use crate::files::{FilesError, WayOut, read_whole};
use crate::material::{Activity, Citation, Input, Material, Source, SourceKind};
use crate::scene::builtin;

/// A file that was read: its name without its folder, and the BLAKE3 hash of its bytes.
pub fn input(path: &Path, bytes: &[u8]) -> Input {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    Input { name, hash: blake3::hash(bytes).to_hex().to_string() }
}

/// A command and the files that it was given, for [`Store::record`](crate::store::Store::record).
///
/// # Errors
/// A file that cannot be read any more.
pub fn activity(command: &str, paths: &[&Path]) -> Result<Activity, FilesError> {
    let mut inputs = Vec::new();
    for path in paths {
        if let Some(text) = builtin::name(path).and_then(builtin::text) {
            inputs.push(input(path, text.as_bytes()));
            continue;
        }
        let bytes = read_whole(path).map_err(|error| FilesError {
            way_out: WayOut::Words("leave the command's files where they are while it runs"),
            ..error
        })?;
        inputs.push(input(path, &bytes));
    }
    Ok(Activity { command: command.to_owned(), inputs, origin: None })
}

/// The key of the source of this kind, title and licence (any, for `None`), which is added to the material
/// under `key`, or that with a number, where it is not there.
pub fn add_source(
    material: &mut Material,
    kind: SourceKind,
    title: &str,
    key: &str,
    licence: Option<&str>,
) -> String {
    for source in &material.sources {
        let is_licence = licence.is_none() || source.licence.as_deref() == licence;
        if source.kind == kind && source.title == title && is_licence {
            return source.key.clone();
        }
    }
    let key = free_key(key, material.sources.iter().map(|source| &source.key));
    material.sources.push(Source {
        key: key.clone(),
        kind,
        title: title.to_owned(),
        doi: None,
        url: None,
        licence: licence.map(str::to_owned),
        note: None,
        citation: Citation::default(),
        making: None,
    });
    key
}

/// `key`, or the first of `key-2`, `key-3`, … that is not among `known`.
pub(super) fn free_key<'a>(key: &str, known: impl Iterator<Item = &'a String>) -> String {
    let known: Vec<&String> = known.collect();
    let mut free = key.to_owned();
    let mut number = 2;
    while known.contains(&&free) {
        free = format!("{key}-{number}");
        number += 1;
    }
    free
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_built_in_scene_is_an_input_like_a_file() {
        let activity = activity("diagnose", &[Path::new("builtin:bench")]).unwrap();
        let text = builtin::text("bench").unwrap();
        assert_eq!(activity.inputs, [input(Path::new("builtin:bench"), text.as_bytes())]);
        let missing = super::activity("diagnose", &[Path::new("builtin:none")]).unwrap_err();
        assert!(missing.to_string().contains("builtin:none"), "{missing}");
    }
}
