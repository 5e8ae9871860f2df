//! Promise: a program that was built without a feature says so where somebody asks for it, with the way out. And it publishes.
#![cfg(not(any(feature = "gpu", feature = "parquet")))]

mod support;

use std::fs;
use std::path::Path;

use support::{matdb, refused, root};

#[test]
fn a_feature_that_is_not_there_is_refused_with_the_way_to_it() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let scene = root().join("scenes/bench.toml").display().to_string();
    let message = refused(matdb(at).args(["render", &scene, "--tracer", "gpu", "-o", "out"]));
    assert!(message.contains("without the tracer `gpu`"), "{message}");
    assert!(message.contains("--features gpu"), "{message}");
    matdb(at).args(["add", "mannequin-paint", "cotton"]).assert().success();
    let export = ["export", "cotton", "--as", "parquet", "-o", "x.parquet"];
    let message = refused(matdb(at).args(export));
    assert!(message.contains("--features parquet"), "{message}");
    let left: Vec<_> = fs::read_dir(at).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(!Path::new("out").exists() && !left.iter().any(|name| name == "out"), "{left:?}");
    matdb(at).args(["publish", "site"]).assert().success();
    matdb(at).args(["verify", "site"]).assert().success();
    assert!(!at.join("site/tables/material.parquet").exists());
}
