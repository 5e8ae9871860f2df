//! Promise: the same scene and seed give the same bytes in every file, on any number of threads.

mod support;

use std::path::Path;

use support::{entries, matdb, scene};

fn render(threads: &str, more: &[&str], scene: &Path) -> Vec<(String, Vec<u8>)> {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path())
        .env("RAYON_NUM_THREADS", threads)
        .args(["render", "-q", "-o", "out"])
        .args(more)
        .arg(scene)
        .assert()
        .success();
    let out = folder.path().join("out");
    entries(&out).into_iter().map(|n| (n.clone(), std::fs::read(out.join(n)).unwrap())).collect()
}

#[test]
fn one_thread_and_two_write_the_same_files() {
    for name in ["mannequin.toml", "human.toml"] {
        let (one, two) = (render("1", &[], &scene(name)), render("2", &[], &scene(name)));
        let names: Vec<&str> = one.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["cloud.ply", "power.exr", "power.png", "scan.json"]);
        assert!(one == two, "{name}");
    }
}

#[test]
fn the_tracer_changes_no_byte() {
    for name in ["mannequin.toml", "human.toml"] {
        let [bvh, pinhole] =
            ["bvh", "pinhole"].map(|t| render("2", &["--tracer", t], &scene(name)));
        assert!(bvh == pinhole && bvh == render("1", &[], &scene(name)), "{name}");
    }
}

#[test]
fn with_everything_switched_on_they_still_do() {
    let text = std::fs::read_to_string(scene("showcase.toml")).unwrap();
    let everything = &text[text.find("[radar.receiver]").unwrap()..text.find("[[mesh]]").unwrap()];
    for name in ["mannequin.toml", "human.toml"] {
        let text = std::fs::read_to_string(scene(name)).unwrap();
        let scan = "[radar.scan]\npattern = \"elliptical\"\nchirps = 1201\n\n";
        let text = text.replacen("[[mesh]]", &format!("{scan}{everything}[[mesh]]"), 1);
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join(name);
        std::fs::write(&file, text).unwrap();
        std::os::unix::fs::symlink(scene("meshes"), folder.path().join("meshes")).unwrap();
        let one = render("1", &["--beat"], &file);
        let two = render("2", &["--beat", "--tracer", "bvh"], &file);
        assert_eq!(one.len(), 13, "three files for each antenna and its beats, and the record");
        for ((name, one), (_, two)) in std::iter::zip(&one, &two) {
            assert!(one == two, "{name}");
        }
    }
}
