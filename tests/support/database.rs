//! Materials and files for the tests of the store.

use std::fs;
use std::path::Path;
use std::process::Command;

use matdb::material::{Censor, Covariance, Curve, Instrument, Material, Observation, builtin};
use matdb::store::Store;

/// A small material with a row in every table.
pub fn sample(slug: &str) -> Material {
    let mut material = builtin::get("mannequin-paint").unwrap().unwrap();
    material.slug = slug.parse().unwrap();
    let source = material.sources[0].key.clone();
    material.instruments = vec![Instrument {
        key: "bench".to_owned(),
        name: "Bench".to_owned(),
        centre_frequency_hz: 300e9,
        bandwidth_hz: Some(20e9),
        polarisation: Some("VV".to_owned()),
        note: None,
    }];
    let observations = vec![
        observation(0.0, Some(2.5), Censor::None),
        observation(0.5, Some(0.1), Censor::None),
        observation(1.0, None, Censor::Left),
    ];
    let instrument = Some("bench".to_owned());
    material.curves = vec![Curve { name: "scan".to_owned(), source, instrument, observations }];
    let path = material.fits[0].model.parameters()[0].path.clone();
    material.fits[0].covariance =
        Some(Covariance { parameters: vec![path], matrix: vec![vec![0.01]] });
    material
}

/// A backscatter point with a detection limit.
pub fn observation(theta_rad: f64, sigma0: Option<f64>, censor: Censor) -> Observation {
    Observation {
        theta_i_rad: theta_rad,
        theta_r_rad: theta_rad,
        delta_phi_rad: 0.0,
        sigma0,
        censor,
        threshold_sigma0: Some(1e-3),
    }
}

/// The sample after somebody has changed it.
pub fn changed(slug: &str) -> Material {
    let mut material = sample(slug);
    material.curves[0].observations[1].sigma0 = Some(0.2);
    material
}

/// Every revision of every material in a database, in order; empty when there is none.
pub fn contents(path: &Path) -> Vec<Material> {
    let Some(store) = Store::open_existing(path).unwrap() else { return Vec::new() };
    let revisions = store.list().unwrap().into_iter().flat_map(|summary| {
        let store = &store;
        (1..=summary.revision).map(move |number| store.get(&summary.slug, Some(number)))
    });
    revisions.map(|stored| stored.unwrap().unwrap().material).collect()
}

/// A database's own check of its pages, indexes and references.
pub fn is_sound(path: &Path) -> bool {
    let conn = rusqlite::Connection::open(path).unwrap();
    let said: String = conn.query_row("PRAGMA integrity_check", [], |row| row.get(0)).unwrap();
    let mut dangling = conn.prepare("PRAGMA foreign_key_check").unwrap();
    said == "ok" && !dangling.exists([]).unwrap()
}

/// This test program again, to run one test on a file in a process of its own.
pub fn child(test: &str, path: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", test, "--nocapture"]).env("MATDB_TEST_FILE", path);
    command
}

/// The file that a child process was given; `None` in the parent.
pub fn given() -> Option<std::path::PathBuf> {
    std::env::var_os("MATDB_TEST_FILE").map(Into::into)
}

/// Names and bytes of the files in a folder.
pub fn bytes(folder: &Path) -> Vec<(std::ffi::OsString, Vec<u8>)> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
    let mut files: Vec<_> = entries
        .filter(|entry| entry.path().is_file())
        .map(|entry| (entry.file_name(), fs::read(entry.path()).unwrap()))
        .collect();
    files.sort();
    files
}
