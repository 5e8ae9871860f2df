//! Promise: a program that was built without a feature says so where somebody asks for it, with the way out. With the usual
//! features it publishes tables as Parquet.
//!
//! Its path is `MATDB_BARE_PROGRAM`; without it there is nothing to test.

use std::path::Path;

use assert_cmd::Command;

use crate::support::{refused, root};

#[test]
fn a_feature_that_is_not_there_is_refused_with_the_way_to_it() {
    let Some(program) = std::env::var_os("MATDB_BARE_PROGRAM") else {
        eprintln!("skipped: MATDB_BARE_PROGRAM is no program without features");
        return;
    };
    let program = root().join(Path::new(&program));
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let matdb = |arguments: &[&str]| {
        let mut command = Command::new(&program);
        command.current_dir(at).args(arguments);
        command
    };
    let scene = root().join("scenes/bench.toml").display().to_string();
    let message = refused(&mut matdb(&["render", &scene, "--tracer", "gpu", "-o", "out"]));
    assert!(message.contains("without the tracer `gpu`"), "{message}");
    assert!(message.contains("--features gpu"), "{message}");
    assert!(!at.join("out").exists());
    matdb(&["add", "mannequin-paint", "cotton"]).assert().success();
    matdb(&["export", "cotton", "--as", "parquet", "-o", "x.parquet"]).assert().success();
    matdb(&["publish", "site"]).assert().success();
    matdb(&["verify", "site"]).assert().success();
    assert!(at.join("site/tables/material.parquet").exists());
}
