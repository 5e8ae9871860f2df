//! Promise: the same scene and seed give the same bytes in every file, on any number of threads.

use std::path::Path;

use matdb::formats::exr;
use matdb::geometry::Raster;

use crate::support::{entries, matdb, scene};

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

/// Cropped images have the pixels of whole ones, at the same places.
#[test]
fn cropped_images_are_parts_of_whole_ones() {
    let image = |more: &[&str]| {
        let files = render("2", more, &scene("calibration-plate.toml"));
        let (_, bytes) = files.iter().find(|(name, _)| name == "power.exr").unwrap();
        exr::read(bytes).unwrap()
    };
    let (whole, cropped) = (image(&[]), image(&["--crop", "auto"]));
    assert!(cropped.width <= whole.width && cropped.height < whole.height);
    let corner = |from: &Raster, to: f64, at: fn(&Raster, usize) -> f64| {
        (0..whole.width.max(whole.height))
            .find(|index| (at(from, *index) - to).abs() < 1e-9)
            .unwrap()
    };
    let column = corner(&whole, cropped.x_m(0), Raster::x_m);
    let row = corner(&whole, cropped.y_m(0), Raster::y_m);
    let part = whole.part([row..row + cropped.height, column..column + cropped.width]);
    let bits = |image: &Raster| {
        let values = image.channels.iter().flat_map(|channel| &channel.values);
        values.map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(&part), bits(&cropped));
    let [all, kept] = [&whole, &cropped].map(|image| {
        let powers = image.channel("power_dbm").unwrap();
        powers.iter().filter(|power| !power.is_nan()).count()
    });
    assert_eq!(all, kept);
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

/// A ball under few chirps with speckle.
const BALL: &str = "
seed = 3
[radar]
threshold_dbm = -95.0
[radar.speckle]
looks = 4
[radar.scan]
pattern = \"elliptical\"
chirps = 1500
[[mesh]]
name = \"ball\"
file = \"builtin:sphere\"
size_m = [0.5, 0.5, 0.5]
translation_m = [0.0, 1.25, 0.0]
[[region]]
name = \"skin\"
material = \"mannequin-paint\"
";

#[test]
fn a_diagnosis_on_one_thread_and_on_two_says_the_same() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    std::fs::write(at.join("ball.toml"), BALL).unwrap();
    std::fs::write(at.join("one-look.toml"), BALL.replace("looks = 4", "looks = 1")).unwrap();
    matdb(at).args(["render", "-q", "one-look.toml", "-o", "."]).assert().success();
    let diagnosed = |threads: &str| {
        let asked = "diagnose -q cloud.ply --scene ball.toml --effects speckle,fov-gain -o";
        matdb(at)
            .env("RAYON_NUM_THREADS", threads)
            .args(asked.split(' ').chain([threads]))
            .assert()
            .success();
        ["report.json", "residuals.csv"]
            .map(|name| std::fs::read(at.join(threads).join(name)).unwrap())
    };
    let [one, two] = ["1", "2"].map(diagnosed);
    assert!(String::from_utf8_lossy(&one[0]).contains("explained"), "something was found");
    assert!(one == two);
}
