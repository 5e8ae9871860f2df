#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use matdb::scene::{Scene, SceneFile};

fuzz_target!(|text: &str| {
    if let Ok(file) = SceneFile::parse(text) {
        let _ = Scene::resolve(file, Path::new("scene.toml"));
    }
});
