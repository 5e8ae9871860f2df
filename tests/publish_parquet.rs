//! Promise: a Parquet table of a publication holds, cell for cell, what the CSV beside it holds.
//!
//! Also read by hand with pyarrow 26.0.1, which is no relation of the writer.

use std::fs::{self, File};

use crate::support::database::{refitted, sample, with_effects};
use crate::support::matdb;
use matdb::store::Store;
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;

fn text(field: &Field) -> String {
    match field {
        Field::Null => String::new(),
        Field::Long(number) => number.to_string(),
        Field::Double(number) => format!("{number:?}"),
        Field::Str(text) => text.clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn every_table_says_what_its_csv_says() {
    let folder = tempfile::tempdir().unwrap();
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    store.add([&sample("paint"), &refitted(with_effects("primer"))]).unwrap();
    drop(store);
    matdb(folder.path()).args(["publish", "site", "-q"]).assert().success();
    let tables = folder.path().join("site/tables");
    let mut rows_seen = 0;
    for entry in fs::read_dir(&tables).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|ending| ending != "parquet") {
            continue;
        }
        let mut csv = csv::Reader::from_path(path.with_extension("csv")).unwrap();
        let header: Vec<String> = csv.headers().unwrap().iter().map(str::to_owned).collect();
        let expected: Vec<Vec<String>> =
            csv.records().map(|row| row.unwrap().iter().map(str::to_owned).collect()).collect();
        let reader = SerializedFileReader::new(File::open(&path).unwrap()).unwrap();
        let mut found = Vec::new();
        for row in reader.get_row_iter(None).unwrap() {
            let row = row.unwrap();
            let names: Vec<&String> = row.get_column_iter().map(|(name, _)| name).collect();
            assert_eq!(names, header.iter().collect::<Vec<_>>());
            found.push(row.get_column_iter().map(|(_, field)| text(field)).collect::<Vec<_>>());
        }
        assert_eq!(found, expected, "{}", path.display());
        rows_seen += found.len();
    }
    assert!(rows_seen > 20, "{rows_seen}");
    let package = fs::read_to_string(folder.path().join("site/datapackage.json")).unwrap();
    assert!(package.contains("tables/observation.parquet"));
}

#[test]
fn an_exported_curve_is_the_stored_one_to_the_bit() {
    let folder = tempfile::tempdir().unwrap();
    let material = sample("paint");
    let curve = &material.curves[0];
    let mut store = Store::open(folder.path().join("matdb.sqlite")).unwrap();
    store.add([&material]).unwrap();
    drop(store);
    let export = ["export", "paint", "--as", "parquet", "--curve", &curve.name, "-o", "p.parquet"];
    matdb(folder.path()).args(export).assert().success();
    let file = File::open(folder.path().join("p.parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let row = |row: parquet::record::Row| -> Vec<(String, String)> {
        row.get_column_iter().map(|(name, field)| (name.clone(), text(field))).collect()
    };
    let found: Vec<_> = reader.get_row_iter(None).unwrap().map(|one| row(one.unwrap())).collect();
    assert_eq!(found.len(), curve.observations.len());
    let number = |value: Option<f64>| value.map_or(String::new(), |value| format!("{value:?}"));
    for (found, stored) in found.iter().zip(&curve.observations) {
        for (name, value) in [
            ("theta_i_rad", number(Some(stored.theta_i_rad))),
            ("sigma0", number(stored.sigma0)),
            ("censor", stored.censor.as_str().to_owned()),
            ("threshold_sigma0", number(stored.threshold_sigma0)),
            ("theta_sd_rad", number(stored.theta_sd_rad)),
        ] {
            assert!(found.contains(&(name.to_owned(), value.clone())), "{name} {value}: {found:?}");
        }
    }
}
