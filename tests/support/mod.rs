//! What tests share.
#![allow(dead_code)] // Each of the two test programs uses some of it.

pub mod browser;
pub mod database;
pub mod json_schema;
pub mod meshes;
pub mod server;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use assert_cmd::Command;
use matdb::brdf::Scattering;
use matdb::geometry::Mesh;
use matdb::radar::{Chirps, Radar};
use matdb::render::{Bounce, Echo, Observer, Setup, Surface, shade, trace};
use matdb::trace::{Bvh, ScanGeometry};

/// The crate's folder.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// A built-in scene file.
pub fn scene(name: &str) -> PathBuf {
    root().join("scenes").join(name)
}

/// The program, working in `folder` with a database of its own.
pub fn matdb(folder: &Path) -> Command {
    let mut command = Command::cargo_bin("matdb").unwrap();
    command.current_dir(folder).env_remove("MATDB");
    command
}

/// What the paper's radar sees of a mesh of one material.
pub fn echoes(
    radar: &Radar,
    chirps: &Chirps,
    mesh: &Mesh,
    scattering: &dyn Scattering,
) -> Vec<Echo> {
    echoes_at(radar, chirps, mesh, scattering, 1, None, Observer::Radar)
}

/// The same with any number of rays per chirp, second-order paths, and any antenna.
pub fn echoes_at(
    radar: &Radar,
    chirps: &Chirps,
    mesh: &Mesh,
    scattering: &dyn Scattering,
    rays: usize,
    bounce: Option<Bounce>,
    observer: Observer,
) -> Vec<Echo> {
    let (bvh, regions) = (Bvh::new(mesh), vec![0; mesh.facets.len()]);
    let geometry = ScanGeometry::new(radar, chirps, &bvh, &regions);
    let footprints = trace(&geometry, rays, &|_| {}).unwrap();
    let surfaces = [Surface::new(scattering)];
    let setup = Setup { bounce, ..Setup::new(geometry, &surfaces) };
    shade(&setup, &footprints, observer, &|_| {}).unwrap().echoes
}

/// Standard error of a run that must fail with status 1.
pub fn refused(command: &mut Command) -> String {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.starts_with("error: ") && text.lines().count() == 1, "one sentence: {text}");
    assert!(output.stdout.is_empty());
    text
}

/// The same of a refusal that has lines to fill in below its sentence.
pub fn refused_with_lines(command: &mut Command) -> (String, String) {
    let output = command.output().unwrap();
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{text}");
    assert!(text.starts_with("error: ") && output.stdout.is_empty(), "{text}");
    let (sentence, lines) = text.split_once("\n\n").unwrap_or_else(|| panic!("no lines: {text}"));
    assert_eq!(sentence.lines().count(), 1, "one sentence: {sentence}");
    (sentence.to_owned(), lines.to_owned())
}

/// Names of everything in a folder, sorted.
pub fn entries(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

/// A binary little-endian PLY cloud, read without the library: column name → values.
pub fn read_cloud(path: &Path) -> BTreeMap<String, Vec<f64>> {
    let bytes = std::fs::read(path).unwrap();
    let end = b"end_header\n";
    let body = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
    let header = std::str::from_utf8(&bytes[..body]).unwrap();
    let mut rows = 0;
    let mut columns: Vec<(String, String)> = Vec::new();
    for line in header.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        match words.as_slice() {
            ["element", "vertex", count] => rows = count.parse().unwrap(),
            ["property", kind, name] => columns.push((name.to_string(), kind.to_string())),
            _ => {}
        }
    }
    let mut at = body;
    let mut take = |kind: &str| {
        let width = match kind {
            "double" => 8,
            "float" | "uint" | "int" => 4,
            "ushort" => 2,
            "uchar" => 1,
            other => panic!("unexpected type {other}"),
        };
        let field = &bytes[at..at + width];
        at += width;
        match kind {
            "double" => f64::from_le_bytes(field.try_into().unwrap()),
            "float" => f32::from_le_bytes(field.try_into().unwrap()).into(),
            "uint" => u32::from_le_bytes(field.try_into().unwrap()).into(),
            "int" => i32::from_le_bytes(field.try_into().unwrap()).into(),
            "uchar" => field[0].into(),
            _ => u16::from_le_bytes(field.try_into().unwrap()).into(),
        }
    };
    let mut cloud: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for _ in 0..rows {
        for (name, kind) in &columns {
            cloud.entry(name.clone()).or_default().push(take(kind));
        }
    }
    assert_eq!(at, bytes.len(), "the body ends where the header says");
    cloud
}

/// Writes a publication's list of hashes anew, as somebody would who wants a change to go unseen.
pub fn list_hashes(site: &Path) {
    use sha2::{Digest, Sha256};
    let mut lines = Vec::new();
    let mut folders = vec![site.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
                continue;
            }
            let name = path.strip_prefix(site).unwrap().to_str().unwrap();
            let hash = Sha256::digest(std::fs::read(&path).unwrap());
            let hash: String = hash.iter().map(|byte| format!("{byte:02x}")).collect();
            if name != "SHA256SUMS" {
                lines.push(format!("{hash}  {name}\n"));
            }
        }
    }
    std::fs::write(site.join("SHA256SUMS"), lines.concat()).unwrap();
}

/// Every file below a folder, by its path.
pub fn tree(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(at) = folders.pop() {
        for entry in std::fs::read_dir(&at).into_iter().flatten() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else {
                let bytes = std::fs::read(&path).unwrap();
                found.insert(path.strip_prefix(folder).unwrap().to_owned(), bytes);
            }
        }
    }
    found
}

/// Two lobes at 61 angles, without noise.
pub fn curve() -> String {
    let mut text = "theta_deg,sigma0_db\n".to_owned();
    for step in 0..=60 {
        let theta_rad = f64::from(step).to_radians();
        let brdf = 5.0 * (-(theta_rad.tan() / 0.05).powi(2)).exp() + 0.01 * theta_rad.cos().powi(3);
        let sigma0 = 4.0 * std::f64::consts::PI * brdf * theta_rad.cos().powi(2);
        text += &format!("{step},{:.4}\n", 10.0 * sigma0.log10());
    }
    text
}
