//! Promise: the same scene and seed give the same bytes in every file, on any number of threads.

mod support;

use support::{entries, matdb, scene};

fn render(threads: &str, name: &str) -> Vec<(String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path())
        .env("RAYON_NUM_THREADS", threads)
        .args(["render", "-q", "-o", "out"])
        .arg(scene(name))
        .assert()
        .success();
    let out = folder.path().join("out");
    entries(&out).into_iter().map(|n| (n.clone(), std::fs::read(out.join(n)).unwrap())).collect()
}

#[test]
fn one_thread_and_two_write_the_same_files() {
    for name in ["mannequin.toml", "human.toml"] {
        let (one, two) = (render("1", name), render("2", name));
        let names: Vec<&str> = one.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["cloud.ply", "power.exr", "power.png", "scan.json"]);
        assert!(one == two, "{name}");
    }
}
