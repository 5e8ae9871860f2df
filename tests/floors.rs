//! Promise: the order of the `pub mod` lines in `lib.rs` is the architecture. A module uses only
//! modules declared above it, so that every arrow points down.

use std::fs;
use std::path::{Path, PathBuf};

fn source() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Modules in the order of `lib.rs`.
fn floors() -> Vec<String> {
    let lib = fs::read_to_string(source().join("lib.rs")).unwrap();
    lib.lines()
        .filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';'))
        .map(str::to_owned)
        .collect()
}

fn rust_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            rust_files(&path, files);
        } else if path.extension().is_some_and(|e| e == "rs") {
            files.push(path);
        }
    }
}

/// Modules that a line of code reaches by `crate::`, also inside braces.
fn reached(code: &str) -> Vec<String> {
    let word = |text: &str| -> String {
        text.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()
    };
    code.split("crate::")
        .skip(1)
        .flat_map(|rest| match rest.strip_prefix('{') {
            Some(list) => {
                let list = list.split(';').next().unwrap_or("");
                list.split(',').map(|item| word(item.trim())).collect()
            }
            None => vec![word(rest)],
        })
        .collect()
}

/// The code of a file without comments and without its tests, which may look anywhere.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("#[cfg(test)]\nmod tests").next().unwrap_or("").to_owned();
    text.lines().filter(|line| !line.trim_start().starts_with("//")).collect::<Vec<_>>().join("\n")
}

fn upward_arrows(floors: &[String], floor: usize, code: &str) -> Vec<String> {
    reached(code)
        .into_iter()
        .filter(|module| floors.iter().position(|f| f == module).is_some_and(|f| f > floor))
        .collect()
}

#[test]
fn every_arrow_points_down() {
    let floors = floors();
    assert!(floors.len() > 5, "lib.rs lists its modules as `pub mod name;` lines");
    for (number, floor) in floors.iter().enumerate() {
        let mut files = Vec::new();
        match source().join(floor) {
            folder if folder.is_dir() => rust_files(&folder, &mut files),
            _ => files.push(source().join(format!("{floor}.rs"))),
        }
        for file in files {
            let up = upward_arrows(&floors, number, &code(&file));
            assert!(up.is_empty(), "{} reaches up to {up:?}", file.display());
        }
    }
}

#[test]
fn every_module_stands_in_the_order() {
    let floors = floors();
    for entry in fs::read_dir(source()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        if name != "lib" && name != "main" {
            assert!(floors.contains(&name), "{name} is not among the floors of lib.rs");
        }
    }
}

#[test]
fn an_upward_arrow_is_seen() {
    let floors = ["units", "radar", "render"].map(str::to_owned);
    assert_eq!(upward_arrows(&floors, 1, "use crate::render::Scan;"), ["render"]);
    assert_eq!(upward_arrows(&floors, 0, "use crate::{units::x, radar};"), ["radar"]);
    assert!(upward_arrows(&floors, 2, "use crate::radar::Link;").is_empty());
}

#[test]
fn no_path_climbs_two_modules() {
    // `super::super` could reach a floor without naming it.
    let mut files = Vec::new();
    rust_files(&source(), &mut files);
    for file in files {
        assert!(!code(&file).contains("super::super"), "{}", file.display());
    }
}

#[test]
fn sql_stays_in_the_store() {
    let mut files = Vec::new();
    rust_files(&source(), &mut files);
    for file in files.iter().filter(|f| !f.starts_with(source().join("store"))) {
        assert!(!code(file).contains("rusqlite"), "{} speaks SQL", file.display());
    }
}
