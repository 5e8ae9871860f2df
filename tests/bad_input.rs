//! Promise: bad input ends with one clear sentence that names the place and the way out, a non-zero
//! status, and nothing written or changed.

use std::fs;
use std::path::Path;

use crate::support::{entries, matdb, refused, root, scene};

const PLATE: &str = "
[[mesh]]
name = \"plate\"
file = \"builtin:plate\"
size_m = [1, 1, 0]
translation_m = [0, 1.1, 0]

[[region]]
name = \"all\"
material = \"ptfe\"
";

const TRIANGLE: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
    property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
    0 0.6 0\n1 0.6 0\n0 1.6 0\n3 0 1 2\n";

/// Renders `text` as a scene in a fresh folder with `files` beside it; the error, after checking
/// that nothing else appeared.
fn render(text: &str, files: &[(&str, &[u8])]) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), text).unwrap();
    for (name, bytes) in files {
        fs::write(folder.path().join(name), bytes).unwrap();
    }
    let before = entries(folder.path());
    let message = refused(matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]));
    assert_eq!(entries(folder.path()), before, "{message}");
    message
}

fn check(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(message.contains(part), "`{part}` is not in: {message}");
    }
}

/// Adds a folder with a changed built-in material; the error, after checking that nothing was stored.
fn add(from: &str, to: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    let text = fs::read_to_string(root().join("materials/glass/material.toml")).unwrap();
    assert!(text.contains(from));
    fs::write(folder.path().join("material.toml"), text.replacen(from, to, 1)).unwrap();
    let message = refused(matdb(folder.path()).args(["add", "--from", "material.toml"]));
    assert_eq!(entries(folder.path()), ["material.toml"], "{message}");
    message
}

#[test]
fn texts_that_nobody_reads_and_names_that_turn_a_line_round_stay_outside() {
    let long = format!("unknown = [\"{}\",", "x".repeat((64 << 10) + 1));
    check(
        &add("unknown = [", &long),
        &["unknown: the text has 65 KiB and 64 KiB are the most", "shorten"],
    );
    let turned = "name = \"\u{202e}ssalg\"";
    check(&add("name = \"Window glass\"", turned), &["name: it holds a character that turns"]);
    let folder = tempfile::tempdir().unwrap();
    let file = fs::File::create(folder.path().join("material.toml")).unwrap();
    file.set_len((64 << 20) + 1).unwrap();
    let message = refused(matdb(folder.path()).args(["add", "--from", "material.toml"]));
    check(&message, &["material.toml: it is larger than 64 MiB", "CSV"]);
}

#[test]
fn a_good_scene_renders_so_that_the_errors_below_mean_something() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), PLATE).unwrap();
    matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).assert().success();
    let mesh = PLATE.replace("builtin:plate", "mesh.ply").replace("size_m = [1, 1, 0]\n", "");
    fs::write(folder.path().join("scene.toml"), mesh).unwrap();
    fs::write(folder.path().join("mesh.ply"), TRIANGLE.replace(" 0.6 ", " -0.5 ")).unwrap();
    matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).assert().success();
}

#[test]
fn mistakes_in_the_scene_file() {
    for (from, to, parts) in [
        ("size_m", "siez_m", &["scene.toml", "line 5", "did you mean `size_m`?"][..]),
        ("[[mesh]]", "[radar]\nthreshhold_dbm = -70\n[[mesh]]", &["did you mean `threshold_dbm`?"]),
        (
            "[[mesh]]",
            "[radar]\nspot_diameter_m = 0\n[[mesh]]",
            &["radar.spot_diameter_m = 0", "1e-5"],
        ),
        (
            "[[mesh]]",
            "[radar]\npreset = \"upm\"\n[[mesh]]",
            &["no radar preset `upm`", "upm-300ghz"],
        ),
        ("[[mesh]]", "[image]\npixel_m = -1.0\n[[mesh]]", &["image.pixel_m", "0.004"]),
        ("[[mesh]]", "[spot]\nrays = 0\n[[mesh]]", &["spot.rays", "1 to 10 000"]),
        (
            "[[mesh]]",
            "[radar.optics]\nellipse_height_m = 0.6\n[[mesh]]",
            &["radar.optics.ellipse_height_m = 0.6"],
        ),
        (
            "[[mesh]]",
            "[radar.scan]\npattern = \"rays\"\nfile = \"r.csv\"\n[[mesh]]",
            &["cannot read the scan r.csv"],
        ),
        ("[[mesh]]", "[radar.scan]\npattern = \"spirl\"\n[[mesh]]", &["did you mean `spiral`?"]),
        (
            "\"ptfe\"",
            "\"aluminum\"",
            &["region `all`", "no material `aluminum`", "did you mean `aluminium`?"],
        ),
        ("\"ptfe\"", "\"granite\"", &["no material `granite`", "matdb add --from"]),
        ("\"ptfe\"", "\"ptfe@x\"", &["`ptfe@x`", "ptfe@1"]),
        ("builtin:plate", "builtin:plat", &["mesh `plate`", "did you mean `builtin:plate`?"]),
        ("builtin:plate", "plate.step", &["plate.step", ".ply, .obj or .stl"]),
        ("builtin:plate", "plate.ply", &["cannot read", "plate.ply", "beside the scene file"]),
        ("[1, 1, 0]", "[1, -1, 0]", &["size_m", "three lengths"]),
        (
            "[0, 1.1, 0]",
            "[3, 1.1, 0]",
            &["no chirp of the scan hits the target", "x 2.500 to 3.500", "translation_m"],
        ),
        ("[0, 1.1, 0]", "[0, nan, 0]", &["translation_m", "finite"]),
        (
            "name = \"all\"",
            "name = \"all\"\nmesh = \"plat\"",
            &["region `all`", "did you mean `plate`?"],
        ),
        (
            "name = \"all\"",
            "name = \"all\"\nbox = { min_m = [5, 5, 5], max_m = [6, 6, 6] }",
            &["region `all` selects no facet"],
        ),
        ("[[region]]", "[[regoin]]", &["did you mean `region`?"]),
    ] {
        assert!(PLATE.contains(from));
        let message = render(&PLATE.replacen(from, to, 1), &[]);
        check(&message, parts);
        let names_another_file = message.contains("cannot read");
        check(&message, &["scene.toml"][..usize::from(!names_another_file)]);
    }
    check(&render("", &[]), &["has no mesh", "[[mesh]]"]);
    check(&render("radar = 3", &[]), &["scene.toml", "line 1"]);
}

#[test]
fn a_scene_that_is_not_there_or_not_text() {
    let folder = tempfile::tempdir().unwrap();
    let run = |name: &str| refused(matdb(folder.path()).args(["render", name, "-o", "out"]));
    check(&run("none.toml"), &["cannot read none.toml"]);
    fs::write(folder.path().join("bytes.toml"), [0xff, 0xfe]).unwrap();
    check(&run("bytes.toml"), &["bytes.toml: byte 0", "UTF-8"]);
    fs::create_dir(folder.path().join("folder.toml")).unwrap();
    check(&run("folder.toml"), &["cannot read folder.toml"]);
    assert!(!folder.path().join("out").exists());
}

#[test]
fn hostile_meshes() {
    let scene =
        |file: &str| PLATE.replace("builtin:plate", file).replace("size_m = [1, 1, 0]\n", "");
    let ply = |from: &str, to: &str| TRIANGLE.replacen(from, to, 1);
    for (text, parts) in [
        (ply("vertex 3", "vertex 1000000000000"), &["mesh.ply"][..]),
        (ply("face 1", "face 4000000000"), &["mesh.ply"]),
        (ply("3 0 1 2", "3 0 1"), &["mesh.ply"]),
        (ply("3 0 1 2", "3 0 1 9"), &["mesh.ply: face 0", "vertex 9"]),
        (ply("3 0 1 2", "3 0 1 -2"), &["mesh.ply", "-2"]),
        (ply("0 0.6 0", "nan 0.6 0"), &["mesh.ply", "vertex 0", "not finite"]),
        (ply("0 0.6 0", "0 inf 0"), &["mesh.ply", "vertex 0", "not finite"]),
        (ply("1 0.6 0", "0 0.6 0"), &["mesh.ply", "none of the 1 facets has an area"]),
        (ply("3 0 1 2\n", "").replace("face 1", "face 0"), &["mesh.ply", "no facets"]),
        (ply("ply", "plx"), &["mesh.ply"]),
        (String::new(), &["mesh.ply"]),
    ] {
        check(&render(&scene("mesh.ply"), &[("mesh.ply", text.as_bytes())]), parts);
    }
    check(&render(&scene("mesh.obj"), &[("mesh.obj", b"v 0 0 0\nf 1 2 3\n")]), &["mesh.obj"]);
    let mut stl = vec![0; 84];
    stl[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    check(&render(&scene("mesh.stl"), &[("mesh.stl", &stl)]), &["mesh.stl"]);
}

#[test]
fn degenerate_facets_are_counted_and_skipped() {
    let folder = tempfile::tempdir().unwrap();
    let scene = PLATE.replace("builtin:plate", "mesh.ply").replace("size_m = [1, 1, 0]\n", "");
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    let mesh = TRIANGLE.replace(" 0.6 ", " -0.5 ").replace("face 1", "face 2") + "3 0 0 1\n";
    fs::write(folder.path().join("mesh.ply"), mesh).unwrap();
    let run = matdb(folder.path()).args(["render", "scene.toml", "-o", "out"]).output().unwrap();
    assert!(run.status.success());
    check(
        &String::from_utf8_lossy(&run.stderr),
        &["facets of mesh `plate` without an area, skipped: 1"],
    );
}

#[test]
fn an_output_folder_that_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "mine").unwrap();
    let run = |out: &str| {
        refused(matdb(folder.path()).arg("render").arg(scene("human.toml")).args(["-o", out]))
    };
    check(&run("file"), &["file", "-o"]);
    check(&run("file/out"), &["file/out", "-o"]);
    check(&run("/proc/matdb"), &["/proc/matdb", "-o"]);
    assert_eq!(entries(folder.path()), ["file"]);
    assert_eq!(fs::read(folder.path().join("file")).unwrap(), b"mine");
}

/// A limit on the size of files stands in for a full disk: writing fails in the same place.
#[cfg(unix)]
fn on_a_full_disk(folder: &Path, blocks: u32, arguments: &str) -> std::process::Output {
    let program = assert_cmd::cargo::cargo_bin("matdb");
    let script =
        format!("trap '' XFSZ; ulimit -f {blocks}; exec '{}' {arguments}", program.display());
    let mut shell = std::process::Command::new("bash");
    shell.current_dir(folder).env_remove("MATDB").args(["-c", &script]).output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_nothing_half_written() {
    let folder = tempfile::tempdir().unwrap();
    let arguments = format!("render '{}' -o out", scene("human.toml").display());
    let run = on_a_full_disk(folder.path(), 16, &arguments);
    let message = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(1), "{message}");
    check(&message, &["cannot write", "out/", "make room"]);
    assert!(entries(folder.path()).is_empty());
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_database_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path()).args(["add", "ptfe", "-q"]).assert().success();
    let run = on_a_full_disk(folder.path(), 1, "add --all");
    let message = String::from_utf8_lossy(&run.stderr).into_owned();
    assert_eq!(run.status.code(), Some(1), "{message}");
    check(&message, &["matdb.sqlite", "if the disk or its quota is full, make room there"]);
    let listed = matdb(folder.path()).args(["list", "--json"]).output().unwrap();
    let listed: serde_json::Value = serde_json::from_slice(&listed.stdout).unwrap();
    assert_eq!(listed.as_array().unwrap().len(), 1);
}

/// Runs the program on a named pipe `pipe.csv`.
#[cfg(unix)]
fn on_a_pipe(folder: &Path, writer: &str, arguments: &str) -> std::process::Output {
    let program = assert_cmd::cargo::cargo_bin("matdb");
    let script = format!("mkfifo pipe.csv; {writer}; exec '{}' {arguments}", program.display());
    let mut shell = std::process::Command::new("bash");
    shell.current_dir(folder).env_remove("MATDB").args(["-c", &script]).output().unwrap()
}

#[cfg(unix)]
#[test]
fn a_pipe_that_no_program_writes_to_is_refused_and_any_other_is_read() {
    let curve = "{ echo theta_deg,sigma0_db; for t in {1..40}; do echo $t,-$t; done; }";
    let scene = scene("human.toml").display().to_string();
    let refused = [
        "fit pipe.csv".to_owned(),
        "near --curve pipe.csv".to_owned(),
        "add --from pipe.csv --name own --class paint --kind synthetic --source us".to_owned(),
        format!("measure pipe.csv --scene '{scene}' -o out"),
        "publish site --about pipe.csv".to_owned(),
    ];
    std::thread::scope(|threads| {
        for arguments in &refused {
            threads.spawn(move || {
                let folder = tempfile::tempdir().unwrap();
                matdb(folder.path()).args(["add", "ptfe", "-q"]).assert().success();
                let run = on_a_pipe(folder.path(), "true", arguments);
                let message = String::from_utf8_lossy(&run.stderr).into_owned();
                assert_eq!(run.status.code(), Some(1), "{message}");
                check(&message, &["pipe.csv: it is a pipe, and no program writes to it; "]);
                assert_eq!(message.lines().count(), 1, "{message}");
                assert_eq!(entries(folder.path()), ["matdb.sqlite", "pipe.csv"]);
            });
        }
    });
    for (writer, path) in [
        (format!("{curve} > pipe.csv &"), "pipe.csv".to_owned()),
        (format!("{{ sleep 1; {curve} > pipe.csv; }} &"), "pipe.csv".to_owned()),
        ("true;".to_owned(), format!("<({curve})")),
    ] {
        let folder = tempfile::tempdir().unwrap();
        let run =
            on_a_pipe(folder.path(), &format!("{writer} true"), &format!("near --curve {path}"));
        assert!(run.status.success(), "{writer}: {}", String::from_utf8_lossy(&run.stderr));
    }
}

#[test]
fn messages_about_flags_name_them() {
    let folder = tempfile::tempdir().unwrap();
    matdb(folder.path()).args(["add", "ptfe", "-q"]).assert().success();
    for (arguments, parts) in [
        (&["withdraw", "ptfe", "--reason", " "][..], ["--reason is empty; ", "in a sentence"]),
        (
            &["withdraw", "ptfe", "--reason", "x", "--superseded-by", "ptfe"],
            ["--superseded-by names the material that is withdrawn; ", "name another one"],
        ),
        (&["near", "--material", "ptfe"], ["`ptfe` has no curve; ", "(--curve FILE)"]),
    ] {
        check(&refused(matdb(folder.path()).args(arguments)), &parts);
    }
    for arguments in ["list --limit -3", "near --material ptfe --limit -3", "fit ptfe --seed -3"] {
        let run = matdb(folder.path()).args(arguments.split(' ')).output().unwrap();
        let message = String::from_utf8(run.stderr).unwrap();
        assert!(!run.status.success(), "{arguments}");
        check(&message, &["error: invalid value '-3' for '--"]);
    }
    assert_eq!(entries(folder.path()), ["matdb.sqlite"]);
}

#[test]
fn materials_that_are_not_there() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| refused(matdb(folder.path()).args(arguments));
    check(&run(&["add", "manequin-paint"]), &["did you mean `mannequin-paint`?"]);
    check(&run(&["add", "ptfe", "granite"]), &["no material `granite`"]);
    check(&run(&["show", "granite"]), &["no material `granite`"]);
    check(&run(&["rm", "ptfe"]), &["matdb.sqlite holds no material `ptfe`"]);
    check(&run(&["add", "ptfe@1"]), &["bare name"]);
    check(&run(&["add", "--from", "none.toml"]), &["cannot read none.toml"]);
    check(&run(&["add", "--from", "."]), &["holds no material.toml"]);
    for (angles, says) in [("0:80", "names no angles"), ("0:90:5", "90°"), ("x", "not a number")] {
        let predict = ["predict", "ptfe", "--angles", angles];
        let output = matdb(folder.path()).args(predict).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && said.contains(says), "{said}");
    }
    let plot = |rest: &[&str]| run(&[&["plot", "ptfe"], rest].concat());
    check(&plot(&["-o", "x.pdf"]), &["x.pdf", ".svg or .png"]);
    check(&plot(&["-o", "x.png", "--sweep", "m=1"]), &["no parameter `m`", "specular.m"]);
    check(&plot(&["-o", "x.png", "--sweep", "specular.m"]), &["names no values"]);
    check(&plot(&["-o", "x.png", "--sweep", "specular.m=x"]), &["`x` is not a number"]);
    check(&plot(&["-o", "x.png", "--sweep", "specular.m=5"]), &["specular.m = 5", "0.001 to 2"]);
    assert!(entries(folder.path()).is_empty(), "nothing was created");
}

#[test]
fn a_bad_material_file_changes_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let good = fs::read_to_string(root().join("materials/ptfe/material.toml")).unwrap();
    for (from, to, parts) in [
        ("class =", "colour =", &["material.toml: line 3", "unknown key `colour`"][..]),
        ("m = 0.05", "m = 5", &["specular.m = 5", "0.001 to 2"]),
        ("\"modelled\"", "\"guess\"", &["unknown value `guess`", "measured"]),
        ("render = \"stated\"", "render = \"best\"", &["render refers to a fit or curve `best`"]),
    ] {
        assert!(good.contains(from), "{from}");
        fs::write(folder.path().join("material.toml"), good.replacen(from, to, 1)).unwrap();
        check(
            &refused(matdb(folder.path()).args(["add", "--from", "material.toml", "glass"])),
            parts,
        );
        assert_eq!(entries(folder.path()), ["material.toml"]);
    }
}

#[test]
fn databases_that_cannot_be_used() {
    let folder = tempfile::tempdir().unwrap();
    let db = folder.path().join("matdb.sqlite");
    let run = |arguments: &[&str]| refused(matdb(folder.path()).args(arguments));
    fs::write(&db, "this is a letter, not a database, and it is long enough to look at").unwrap();
    for arguments in [&["list"][..], &["add", "ptfe"], &["show", "ptfe"], &["rm", "ptfe"]] {
        check(&run(arguments), &["matdb.sqlite"]);
        assert!(fs::read_to_string(&db).unwrap().starts_with("this is a letter"));
    }
    check(&run(&["add", "ptfe", "--db", "no/such/folder/x.sqlite"]), &["no/such/folder"]);
    check(&run(&["add", "ptfe", "--db", "."]), &["."]);
    for arguments in [&["list"][..], &["show", "ptfe"], &["rm", "ptfe"]] {
        let message = refused(matdb(folder.path()).args(arguments).args(["--db", "typo.sqlite"]));
        check(&message, &["there is no database typo.sqlite", "--db"]);
    }
    assert_eq!(entries(folder.path()), ["matdb.sqlite"]);
}

#[test]
fn instruments_that_cannot_work() {
    let receiver = "[radar.receiver]\n";
    let with = |more: &str| PLATE.replacen("[[mesh]]", &format!("{more}\n[[mesh]]"), 1);
    let left = "[[receiver]]\nname = \"left\"\nposition_m = [-2, 1.1, 7]\n";
    for (more, parts) in [
        (
            format!("{receiver}[radar.chirp]\nsamples = 1024\n"),
            &["unambiguous", "radar.chirp.samples = 14"][..],
        ),
        (format!("{receiver}[spot]\nrays = 4\n"), &["[radar.speckle]", "looks"]),
        (format!("{receiver}[bounce]\n"), &["[radar.speckle]", "[bounce]"]),
        (
            "[radar.speckle]\nform = \"law\"\ncoherent_ratio = 2\n".to_owned(),
            &["coherent_ratio is not a key with a form", "follows from the material"],
        ),
        (
            "[radar.beam]\nfocus_m = 10000\n[radar.speckle]\nform = \"scatterers\"\n".to_owned(),
            &["squares of their waist", "1.3e8", "radar.beam.focus_m", "independent"],
        ),
        (
            format!("{receiver}[radar.speckle]\nform = \"law\"\n[spot]\nrays = 4\n"),
            &["radar.speckle.form = \"law\"", "set form = \"scatterers\"", "spot.rays = 1"],
        ),
        (
            "[radar]\nphases = true\n[radar.speckle]\nlooks = 4\n".to_owned(),
            &["radar.phases = true", "radar.speckle.looks = 4 has no phase"],
        ),
        (
            "[radar.speckle]\nform = \"law\"\nlooks = 2.5\n".to_owned(),
            &["radar.speckle.looks = 2.5", "a whole number from 1 to 256", "independent"],
        ),
        (
            format!("{receiver}[radar.speckle]\nlooks = 2.5\n"),
            &["radar.speckle.looks = 2.5", "whole"],
        ),
        (format!("{receiver}[radar.noise]\n"), &["[radar.noise]", "remove"]),
        (
            "[radar.noise]\nlevel_dbm = -90\ngate_cells = 9\n".to_owned(),
            &["level_dbm", "gate_cells", "remove one"],
        ),
        (
            format!("{receiver}[radar.receiver.leakage]\npower_dbm = -30\nrange_m = 30\n"),
            &["receiver.leakage.range_m = 30", "22.7"],
        ),
        (
            format!("{receiver}[radar.receiver.phase_noise]\nlevel_dbc_per_hz = -80\n"),
            &["line 3", "missing field `offset_hz`"],
        ),
        (format!("{receiver}gate_m = [9, 7]\n"), &["receiver.gate_m[1] = 7", "from 9"]),
        (format!("{receiver}[radar.chirp]\nduration_s = 1.0\n"), &["chirp.duration_s = 1"]),
        ("[bounce]\nrays = 0\n".to_owned(), &["bounce.rays", "1 to 10 000"]),
        ("[bounce]\noutside_spot_db = 3\n".to_owned(), &["outside_spot_db", "-200 to 0"]),
        (format!("{left}{left}"), &["receiver `left`", "twice"]),
        (left.replace("left", "../left"), &["receiver `../left`", "small letters"]),
        (left.replace("-2", "inf"), &["position_m"]),
        (left.replace("[[receiver]]", "[receiver]"), &["[[receiver]]", "[radar.receiver]"]),
        (format!("{receiver}gate_m = [100, 200]\n"), &["receiver.gate_m[1] = 200", "22.7"]),
        ("[spot]\nrays = 1000\n[bounce]\nrays = 1000\n".to_owned(), &["bounce.rays", "100 000"]),
        (
            (0..33).map(|n| left.replace("left", &format!("r{n}"))).collect(),
            &["33 receivers", "at most 32"],
        ),
        (
            left.replace("[-2, 1.1, 7]", "[0, 1.1, 0]").replace("left", "in"),
            &["the receiver", "inside the target", "position_m"],
        ),
        (
            format!(
                "[[mesh]]\nname = \"case\"\nfile = \"builtin:cuboid\"\nsize_m = [1, 1, 1]\n\
                     translation_m = [0, 1.1, 8]\n{left}"
            ),
            &["the radar at", "inside the target", "reflector_centre_m"],
        ),
    ] {
        // A solid, so that it has an inside.
        let scene = with(&more)
            .replace("builtin:plate", "builtin:cuboid")
            .replace("size_m = [1, 1, 0]", "size_m = [1, 1, 0.1]");
        check(&render(&scene, &[]), parts);
    }
    for grain in ["[0, 0, 0]", "[nan, 0, 0]"] {
        check(
            &render(&format!("{PLATE}grain = {grain}\n"), &[]),
            &["region `all`", "grain", "[0, 1, 0]"],
        );
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("scene.toml"), PLATE).unwrap();
    let arguments = ["render", "--beat", "scene.toml", "-o", "out"];
    check(&refused(matdb(folder.path()).args(arguments)), &["--beat", "[radar.receiver]"]);
}

#[test]
fn speckle_as_0_1_0_had_it_renders_and_says_what_changed() {
    let render = |table: &str| {
        let folder = tempfile::tempdir().unwrap();
        let scan = "[radar.scan]\npattern = \"raster\"\nlines = 20\nchirps_per_line = 20\n";
        let scene = PLATE.replacen("[[mesh]]", &format!("{scan}{table}\n[[mesh]]"), 1);
        fs::write(folder.path().join("scene.toml"), scene).unwrap();
        let arguments = ["render", "scene.toml", "-o", "out"];
        let output = matdb(folder.path()).args(arguments).output().unwrap();
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{said}");
        let cloud = fs::read(folder.path().join("out/cloud.ply")).unwrap();
        (said, cloud, fs::read_to_string(folder.path().join("out/scan.json")).unwrap())
    };
    for (keys, words) in [
        ("looks = 2.5", "radar.speckle.looks = 2.5 is drawn anew for every chirp, as in 0.1.0"),
        ("looks = 1000", "radar.speckle.looks = 1000 is drawn anew for every chirp, as in 0.1.0"),
        ("coherent_ratio = 3", "radar.speckle.coherent_ratio = 3 is ignored"),
    ] {
        let (said, cloud, record) = render(&format!("[radar.speckle]\n{keys}\n"));
        assert_eq!(said.matches(words).count(), 1, "{said}");
        assert!(record.contains("\"form\": \"independent\""), "{record}");
        let looks = keys.strip_prefix("coherent_ratio = 3").map_or(keys, |_| "looks = 1");
        let stated = format!("[radar.speckle]\n{looks}\nform = \"independent\"\n");
        let (said, as_stated, _) = render(&stated);
        assert!(!said.contains("0.1.0"), "{said}");
        assert!(cloud == as_stated, "{keys}: the form is as if it were stated");
    }
}

#[test]
fn a_tracer_that_does_not_take_the_rays() {
    let folder = tempfile::tempdir().unwrap();
    let scan = "[radar.scan]\npattern = \"rays\"\nfile = \"r.csv\"\n[[mesh]]";
    fs::write(folder.path().join("scene.toml"), PLATE.replacen("[[mesh]]", scan, 1)).unwrap();
    let rays = "chirp,time_s,ox_m,oy_m,oz_m,dx,dy,dz\n0,0,0,1.1,8,0,0,-1\n1,1,0.1,1.1,8,0,0,-1\n";
    fs::write(folder.path().join("r.csv"), rays).unwrap();
    let render = ["render", "scene.toml", "-o", "out"];
    let with = |more: &[&str]| {
        let mut command = matdb(folder.path());
        command.args(render).args(more);
        command
    };
    check(&refused(&mut with(&["--tracer", "pinhole"])), &["pinhole", "ray 1", "`bvh`"]);
    assert!(!folder.path().join("out").exists());
    with(&["--tracer", "bvh"]).assert().success();
    with(&[]).assert().success();
    fs::remove_dir_all(folder.path().join("out")).unwrap();
    // A ray without a direction is none of any tracer's.
    fs::write(folder.path().join("r.csv"), rays.replace("0.1,1.1,8,0,0,-1", "0,1.1,8,0,0,0"))
        .unwrap();
    for more in [&[][..], &["--tracer", "brute"]] {
        check(&refused(&mut with(more)), &["r.csv", "line 3", "no length", "unit vector"]);
    }
    assert!(!folder.path().join("out").exists());
}

#[test]
#[cfg(target_os = "linux")]
fn an_error_that_cannot_be_printed_is_a_status() {
    let full = || fs::File::options().write(true).open("/dev/full").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let program = env!("CARGO_BIN_EXE_matdb");
        let mut command = std::process::Command::new(program);
        command.current_dir(folder.path()).args(arguments).stderr(full());
        command.stdout(std::process::Stdio::null()).status().unwrap().code()
    };
    assert_eq!(run(&["show", "nothing"]), Some(1));
    assert_eq!(run(&["-v", "add", "glass"]), Some(0));
}

#[test]
fn a_material_has_a_limit_of_tags_and_a_permittivity_one_of_its_size() {
    let tags = (0..1001).map(|n| format!("\"t{n}\"")).collect::<Vec<_>>().join(", ");
    let message = add("tags = [", &format!("tags = [{tags}, "));
    check(&message, &["tags", "and 1000 are the most", "keep those by which"]);
    let message = add("tags = [", "tags = [\"a\\u0000b\", ");
    check(&message, &["tags: the text holds a NUL character", "remove it"]);
    let message = add("\nreal = ", "\nreal = 1e31 # ");
    check(&message, &["permittivity", "it is beyond 1e30", "relative to that of vacuum"]);
}
