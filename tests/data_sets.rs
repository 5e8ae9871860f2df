//! Promise: a data set has the same bytes however it is made: at once, in parts, on one thread, after it was killed, and after
//! files were lost or damaged. `check` says what is missing, damaged, or in two splits. What cannot be is refused in one
//! sentence before the first scan, and nothing is left.
//!
//! A sample of the kills; `MATDB_TEST_MANY_FAULTS=1` makes a hundred.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::Instant;

use crate::support::{matdb, root, tree};
use serde_json::Value;

const SCENE: &str = r#"
[radar.scan]
pattern = "raster"
lines = 24
chirps_per_line = 20
width_m = 0.4
height_m = 0.5
[radar.speckle]
looks = 1
[spot]
rays = 4
[[mesh]]
name = "wall"
file = "builtin:sphere"
size_m = [0.6, 0.6, 0.3]
translation_m = [0, 1.1, -0.1]
[[mesh]]
name = "plate"
file = "builtin:cuboid"
size_m = [0.08, 0.06, 0.01]
[[region]]
name = "wall"
material = "mannequin-paint"
mesh = "wall"
[[region]]
name = "plate"
material = "aluminium"
mesh = "plate"
"#;

const SPEC: &str = r#"
name = "plates"
title = "Plates on a ball"
licence = "CC0-1.0"
scene = "scene.toml"
scans = 20
repeats = 2
scans_per_shard = 4
seed = 3
objects = ["plate"]
split = { train = 0.6, test = 0.4 }
[[choose]]
name = "object"
apart = true
option = [
    { name = "wide", set = { "mesh.plate.size_m" = [0.1, 0.05, 0.01] } },
    { name = "square", set = { "mesh.plate.size_m" = [0.07, 0.07, 0.01] } },
    { name = "thick", set = { "mesh.plate.size_m" = [0.06, 0.06, 0.03] } },
]
[[vary]]
keys = ["region.plate.material"]
values = ["aluminium", "nylon"]
[[vary]]
keys = ["mesh.wall.translation_m"]
from = [-0.05, 1.05, -0.15]
to = [0.05, 1.15, -0.05]
[[vary]]
keys = ["radar.system_loss_db"]
mean = 12.5
sd = 0.5
[[place]]
mesh = "plate"
on = "wall"
gap_m = 0.001
[[effect]]
name = "drift"
share = 0.5
parameters = { slope_db = [-2, 2] }
"#;

fn write_inputs(folder: &Path, spec: &str) {
    fs::write(folder.join("scene.toml"), SCENE).unwrap();
    fs::write(folder.join("spec.toml"), spec).unwrap();
}

/// What a command that must succeed prints.
fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = matdb(folder).args(arguments).output().unwrap();
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{arguments:?}: {errors}");
    String::from_utf8(output.stdout).unwrap()
}

/// The sentence of a command that must fail.
fn refused(folder: &Path, arguments: &[&str]) -> String {
    let output = matdb(folder).args(arguments).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{arguments:?}: {said}");
    said.lines().find_map(|line| line.strip_prefix("error: ")).unwrap_or_default().to_owned()
}

/// All files of a data set but the plan, in which times stand.
fn made(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let named = tree(folder).into_iter().map(|(path, bytes)| (path.display().to_string(), bytes));
    named.filter(|(name, _)| name != "plan.toml").collect()
}

#[test]
fn parts_threads_and_lost_files_change_no_byte() {
    let root = tempfile::tempdir().unwrap();
    let here = root.path();
    write_inputs(here, SPEC);
    said(here, &["dataset", "run", "spec.toml", "-o", "whole"]);
    let whole = made(&here.join("whole"));
    assert_eq!(
        whole.keys().filter(|name| name.starts_with("points/")).count(),
        5,
        "{:?}",
        whole.keys()
    );

    said(here, &["dataset", "plan", "spec.toml", "-o", "parts"]);
    let one: Value =
        serde_json::from_str(&said(here, &["dataset", "shard", "parts", "1/2", "--json"])).unwrap();
    assert_eq!((&one["shards"], &one["missing"]), (&2.into(), &3.into()), "{one}");
    let problem = refused(here, &["dataset", "check", "parts"]);
    assert!(problem.contains("parts is not complete; `matdb dataset run parts`"), "{problem}");
    let mut alone = matdb(here);
    let alone = alone.env("RAYON_NUM_THREADS", "1").args(["dataset", "shard", "parts", "0/2"]);
    assert!(alone.output().unwrap().status.success());
    assert!(made(&here.join("parts")) == whole);

    let parts = here.join("parts");
    let named = |folder: &str| {
        let first = fs::read_dir(parts.join(folder)).unwrap().next().unwrap().unwrap();
        first.path()
    };
    fs::remove_file(named("images")).unwrap();
    let mut bytes = fs::read(named("points")).unwrap();
    bytes[100] ^= 1;
    fs::write(named("points"), bytes).unwrap();
    let found: Value = {
        let output = matdb(here).args(["dataset", "check", "parts", "--json"]).output().unwrap();
        serde_json::from_slice(&output.stdout).unwrap()
    };
    assert_eq!(found["complete"], false);
    assert!(!found["problems"].as_array().unwrap().is_empty(), "{found}");
    said(here, &["dataset", "run", "parts"]);
    assert!(made(&parts) == whole);
    assert!(
        said(here, &["dataset", "run", "parts"]).contains("nothing to make: parts is complete")
    );
    let found = said(here, &["dataset", "check", "parts"]);
    assert!(found.contains("5 of 5 shards, 20 scans") && found.contains("complete"), "{found}");
    let manifest = named("manifests");
    let text = fs::read_to_string(&manifest).unwrap();
    let mut record: Value = serde_json::from_str(&text).unwrap();
    record["scans"].as_array_mut().unwrap().pop();
    for changed in [record.to_string(), text.replacen(".parquet", ".parquett", 1)] {
        fs::write(&manifest, changed).unwrap();
        assert!(refused(here, &["dataset", "check", "parts"]).contains("is not complete"));
    }
    said(here, &["dataset", "run", "parts"]);
    assert!(made(&parts) == whole);
    let table = fs::read(parts.join("scans.parquet")).unwrap();
    fs::write(parts.join("scans.parquet"), &table[..table.len() / 2]).unwrap();
    assert!(refused(here, &["dataset", "check", "parts"]).contains("is not complete"));
    said(here, &["dataset", "run", "parts"]);
    assert!(made(&parts) == whole);
    // The same specification in the same folder is the same plan.
    said(here, &["dataset", "run", "spec.toml", "-o", "parts"]);
    said(here, &["dataset", "publish", "parts"]);
    let card = fs::read_to_string(parts.join("README.md")).unwrap();
    for expected in
        ["# Plates on a ball", "CC0-1.0", "| train | 12 |", "| test | 8 |", "`drift` in 50 %"]
    {
        assert!(card.contains(expected), "{expected}: {card}");
    }
}

#[test]
fn repeats_differ_in_noise_alone_and_splits_share_no_object() {
    let root = tempfile::tempdir().unwrap();
    let here = root.path();
    write_inputs(here, SPEC);
    said(here, &["dataset", "run", "spec.toml", "-o", "ds"]);
    let mut rows: Vec<Value> = Vec::new();
    for (name, bytes) in made(&here.join("ds")) {
        if name.starts_with("manifests/") {
            let manifest: Value = serde_json::from_slice(&bytes).unwrap();
            rows.extend(manifest["scans"].as_array().unwrap().clone());
        }
    }
    assert_eq!(rows.len(), 20);
    let mut splits: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for row in &rows {
        let (object, split) = (row["options"]["object"].to_string(), row["split"].to_string());
        splits.entry(object).or_default().push(split);
    }
    for (object, mut splits) in splits {
        splits.dedup();
        assert_eq!(splits.len(), 1, "{object}");
    }
    for pair in rows.chunks(2) {
        assert_eq!(pair[0]["target"], pair[1]["target"]);
        for same in ["shapes", "seed", "options", "numbers"] {
            assert_eq!(pair[0][same], pair[1][same], "{same}");
        }
        assert_ne!(pair[0]["noise_seed"], pair[1]["noise_seed"]);
    }
    let shapes: std::collections::BTreeSet<String> =
        rows.iter().map(|row| row["shapes"].to_string()).collect();
    assert_eq!(shapes.len(), 10);
    let with_drift =
        rows.iter().filter(|row| !row["numbers"]["effect.drift.slope_db"].is_null()).count();
    assert!((2..20).contains(&with_drift), "{with_drift}");

    // What the scans themselves say is checked, and not what the plan meant.
    let manifest = here.join("ds/manifests/test-00000-of-00002.json");
    let text = fs::read_to_string(&manifest).unwrap();
    let of_train =
        rows.iter().find(|row| row["split"] == "train").unwrap()["options"]["object"].clone();
    let own = serde_json::from_str::<Value>(&text).unwrap()["scans"][0]["options"].to_string();
    let other = own.replace(own.split('"').nth(3).unwrap(), of_train.as_str().unwrap());
    let changed = text.replacen(&own, &other, 1);
    assert_ne!(changed, text);
    fs::write(&manifest, &changed).unwrap();
    let problem = refused(here, &["dataset", "check", "ds"]);
    assert!(problem.contains("is not complete"), "{problem}");
    fs::write(&manifest, sealed(&changed)).unwrap();
    let output = matdb(here).args(["dataset", "check", "ds"]).output().unwrap();
    let found = String::from_utf8_lossy(&output.stdout).into_owned();
    let leak = format!("option `{}` of `object` is in test and train", of_train.as_str().unwrap());
    assert!(found.contains(&leak), "{found}");
}

/// A manifest with the seal that belongs to it.
fn sealed(manifest: &str) -> String {
    let (all, _) = manifest.split_once("\"seal\":\"").unwrap();
    let seal = |seal: &str| format!("{all}\"seal\":\"{seal}\"}}");
    seal(blake3::hash(seal("").as_bytes()).to_hex().as_str())
}

/// A wall that most of the scans do not meet where it is drawn first.
#[test]
fn a_scan_that_no_ray_hits_is_drawn_again() {
    let root = tempfile::tempdir().unwrap();
    let here = root.path();
    let wall = SCENE.split("[[mesh]]\nname = \"plate\"").next().unwrap();
    let scene = format!("{wall}[[region]]\nname = \"wall\"\nmaterial = \"mannequin-paint\"\n");
    fs::write(here.join("scene.toml"), scene).unwrap();
    let spec = "name = \"walls\"\nscene = \"scene.toml\"\nscans = 8\nseed = 5\n[[vary]]\n\
                keys = [\"mesh.wall.translation_m\"]\nfrom = [-1.5, 1.1, -0.1]\nto = [1.5, 1.1, -0.1]\n";
    fs::write(here.join("spec.toml"), spec).unwrap();
    said(here, &["dataset", "run", "spec.toml", "-o", "ds"]);
    let manifest = fs::read(here.join("ds/manifests/train-00000-of-00001.json")).unwrap();
    let manifest: Value = serde_json::from_slice(&manifest).unwrap();
    let scans = manifest["scans"].as_array().unwrap();
    assert_eq!(scans.len(), 8);
    for scan in scans {
        assert!(scan["hits"].as_u64().unwrap() > 0);
        let x_m = scan["numbers"]["mesh.wall.translation_m.0"].as_f64().unwrap();
        assert!(x_m.abs() < 0.6, "{x_m}");
    }
    // Where nothing else can be drawn the scan is named.
    fs::write(here.join("spec.toml"), spec.replace("from = [-1.5", "from = [1.4")).unwrap();
    let problem = refused(here, &["dataset", "run", "spec.toml", "-o", "other"]);
    assert!(problem.starts_with("scan train-00000"), "{problem}");
}

#[test]
fn what_cannot_be_is_refused_before_the_first_scan() {
    let root = tempfile::tempdir().unwrap();
    let here = root.path();
    let posterior = "[[posterior]]\nmaterial = \"aluminium\"\n";
    let turned = "[[choose]]\nname = \"order\"\noption = [{ name = \"turned\", set = { region = [\
                  { name = \"plate\", material = \"aluminium\", mesh = \"plate\" }, \
                  { name = \"wall\", material = \"mannequin-paint\", mesh = \"wall\" }] } }]\n";
    let cases = [
        (
            SPEC.replace("from = [-0.05, 1.05, -0.15]", "from = [0.06, 1.05, -0.15]"),
            "is no range; give as many numbers in both",
        ),
        (SPEC.replace("scans = 20", "scans = 0"), "scans = 0; give 1 to 10 000 000"),
        (
            SPEC.replace("repeats = 2", "repeats = 3"),
            "repeats = 3 of 20 scans; give a number that divides the scans",
        ),
        (
            SPEC.replace("apart = true", ""),
            "the splits leak: they all show the same persons and objects",
        ),
        (
            SPEC.replace("[0.06, 0.06, 0.03]", "[0.07, 0.07, 0.01]"),
            "the splits leak: two options of [[choose]] `object` set the same",
        ),
        (
            SPEC.replace("test = 0.4", "test = 0.2, b = 0.1, c = 0.1"),
            "the splits leak: [[choose]] `object` has 3 options for 4 splits",
        ),
        (SPEC.replace("mesh.plate.size_m", "mesh.plat.size_m"), "there is no mesh `plat`"),
        (
            SPEC.replace("radar.system_loss_db", "radar.system_loss_dbs"),
            "unknown key `system_loss_dbs`",
        ),
        (SPEC.replace("\"nylon\"]", "\"nylonn\"]"), "no material `nylonn`"),
        (
            SPEC.replace("objects = [\"plate\"]", "objects = [\"gun\"]"),
            "objects: the scene has no mesh `gun`; there are: wall, plate",
        ),
        (
            SPEC.replace("on = \"wall\"", "on = \"body\""),
            "the scene has no mesh `body`; there are: wall, plate",
        ),
        (
            SPEC.replace(
                "gap_m = 0.001",
                "gap_m = 0.001\nbox = { min_m = [5, 5, 5], max_m = [6, 6, 6] }",
            ),
            "none is one for `plate`",
        ),
        (
            SPEC.replace("slope_db = [-2, 2]", "slope_dbs = [-2, 2]"),
            "[[effect]] `drift`: it has no parameter `slope_dbs`",
        ),
        (
            SPEC.replace("slope_db = [-2, 2]", "slope_db = [-2, 200]"),
            "slope_db from -2 to 200 is out of range; give values from -20 to 20",
        ),
        (
            SPEC.replace("name = \"drift\"", "name = \"drifts\""),
            "[[effect]] `drifts`: there is no such effect",
        ),
        (format!("{SPEC}{posterior}"), "[[posterior]] of `aluminium`: the fit"),
        (format!("{SPEC}{posterior}fit = \"best\"\n"), "there is no fit `best`"),
        (SPEC.replace("seed = 3", "sed = 3"), "did you mean `seed`"),
        (
            SPEC.replace("keys = [\"radar.system_loss_db\"]", "keys = [\"mesh.plate.size_m\"]"),
            "`mesh.plate.size_m` is drawn twice, by [[choose]] `object` and by [[vary]]",
        ),
        (
            SPEC.replace(
                "keys = [\"radar.system_loss_db\"]",
                "keys = [\"mesh.plate.translation_m\"]",
            ),
            "is drawn twice, by [[place]] of `plate` and by [[vary]]",
        ),
        (
            SPEC.replace("mean = 12.5", "mean = [12.5, 1]").replace("sd = 0.5", "sd = [0.5, 1]"),
            "radar.system_loss_db=[",
        ),
        (SPEC.replace("test = 0.4", "test = 0.01"), "split `test`: gets none of 20 scans"),
        (
            SPEC.replace("sd = 0.5", "sd = 0.5\nfrom = 14\nto = 13"),
            "are no normal law; give as many",
        ),
        (
            SPEC.replace(" set = {", " split = \"train\", set = {"),
            "[[choose]] `object` leaves a split without any of its options",
        ),
        (
            format!("{SPEC}{turned}"),
            "the scene: has other meshes or regions than the specification's",
        ),
        (
            format!("{SPEC}{posterior}{posterior}"),
            "two [[posterior]] are of `aluminium`; leave one out",
        ),
        (
            format!("{SPEC}[[vary]]\nkeys = [\"radar.threshold_dbm\"]\nvalues = [-80, \"-70\"]\n"),
            "values has -80 and \"-70\", of two kinds; give numbers alone",
        ),
        (
            format!("{SPEC}[[place]]\nmesh = \"plate\"\non = \"wall\"\n"),
            "by [[place]] of `plate` and by [[place]] of `plate`",
        ),
        (
            SPEC.replace("\"radar.system_loss_db\"", "' mesh.\"plate\". size_m '"),
            "is drawn twice, by [[choose]] `object` and by [[vary]]",
        ),
        (
            SPEC.replace("[0.06, 0.06, 0.03]", "[0.070, 7e-2, 0.01]"),
            "the splits leak: two options of [[choose]] `object` set the same",
        ),
        (
            SPEC.replace("scans = 20", "scans = 20000").replace("repeats = 2", "repeats = 20000"),
            "repeats = 20000; give 10 000 at most",
        ),
        (
            SPEC.replace("train = 0.6", "train = 1e308"),
            "; give shares above 0, such as 0.8 and 0.2",
        ),
        (
            format!("{SPEC}[[effect]]\nname = \"drift\"\nparameters = {{ slope_db = [0, 1] }}\n"),
            "two [[effect]] are `drift`; leave one out",
        ),
        // The plate stands outside the field of view.
        (
            SPEC.split("[[place]]")
                .next()
                .unwrap()
                .replace(
                    "keys = [\"mesh.wall.translation_m\"]",
                    "keys = [\"mesh.plate.translation_m\"]",
                )
                .replace("[-0.05, 1.05, -0.15]", "[3, 1, 0]")
                .replace("[0.05, 1.15, -0.05]", "[3, 1, 0]"),
            "scans hits the object `plate`",
        ),
    ];
    for (spec, expected) in cases {
        write_inputs(here, &spec);
        let problem = refused(here, &["dataset", "run", "spec.toml", "-o", "ds"]);
        assert!(problem.contains(expected), "{expected}: {problem}");
        assert!(!here.join("ds").exists(), "{expected}");
    }
    // Options may spell a key in several ways.
    let thick = "set = { \"mesh.plate.size_m\" = [0.06";
    write_inputs(here, &SPEC.replace(thick, "set = { ' mesh.\"plate\".size_m' = [0.06"));
    said(here, &["dataset", "plan", "spec.toml", "-o", "spelled"]);
    write_inputs(here, SPEC);
    // What a plan that was killed may have left.
    fs::create_dir_all(here.join("ds/inputs")).unwrap();
    fs::write(here.join("ds/inputs/scene.toml"), "half").unwrap();
    fs::write(here.join("ds/spec.toml"), "half").unwrap();
    said(here, &["dataset", "plan", "spec.toml", "-o", "ds"]);
    let before = tree(&here.join("ds"));
    for (arguments, expected) in [
        (
            &["dataset", "shard", "ds", "5/5"][..],
            "there is no part 5/5; give K/N with K from 0 to N - 1",
        ),
        (&["dataset", "run", "spec.toml"], "there is no folder for its data set; give one: -o DIR"),
        (&["dataset", "run", "."], "has no plan of a data set"),
        (&["dataset", "publish", "ds"], "is not complete: shard test-00000-of-00002 is missing"),
        (
            &["dataset", "plan", "spec.toml", "-o", "."],
            "has other files in it; give a new or an empty folder",
        ),
    ] {
        let problem = refused(here, arguments);
        assert!(problem.contains(expected), "{expected}: {problem}");
    }
    write_inputs(here, &SPEC.replace("seed = 3", "seed = 4"));
    let problem = refused(here, &["dataset", "run", "spec.toml", "-o", "ds"]);
    assert!(problem.contains("ds has another plan: `specification` differs"), "{problem}");
    assert!(tree(&here.join("ds")) == before);
    let plan = here.join("ds/plan.toml");
    let text = fs::read_to_string(&plan).unwrap();
    fs::write(&plan, text.replace("program = \"matdb ", "program = \"matdb 9")).unwrap();
    assert!(refused(here, &["dataset", "run", "ds"]).contains("was planned by matdb 9"));
    for (from, to) in [
        ("first_scan = \"", "first_scan = \"0"),
        ("shards = ", "shards = 1"),
        ("\"wall\"", "\"hall\""),
    ] {
        fs::write(&plan, text.replacen(from, to, 1)).unwrap();
        let problem = refused(here, &["dataset", "check", "ds"]);
        assert!(problem.contains("plan.toml is not what it was when"), "{problem}");
    }
    fs::write(&plan, of_another_machine(&text)).unwrap();
    assert!(
        refused(here, &["dataset", "run", "ds"]).contains("the first scan has other bytes here")
    );
    let needed = "bytes_per_scan = ";
    let huge = text.split(needed).next().unwrap().to_owned()
        + needed
        + "900000000000000\n"
        + text.split(needed).nth(1).unwrap().split_once('\n').unwrap().1;
    fs::write(&plan, huge).unwrap();
    assert!(refused(here, &["dataset", "run", "ds"]).contains("and the disk of ds has"));
    fs::write(&plan, &text).unwrap();
    fs::write(here.join("ds/inputs/scene.toml"), SCENE.replace("0.01", "0.02")).unwrap();
    assert!(
        refused(here, &["dataset", "run", "ds"])
            .contains("is not what it was when the data set was planned")
    );
}

/// A plan whose first scan has other bytes.
fn of_another_machine(plan: &str) -> String {
    let mut plan: toml::Table = plan.parse().unwrap();
    let mut id = blake3::Hasher::new();
    id.update(plan["program"].as_str().unwrap().as_bytes());
    id.update(b"other bytes");
    for input in plan["input"].as_array().unwrap() {
        id.update(input["blake3"].as_str().unwrap().as_bytes());
    }
    plan.insert("first_scan".to_owned(), "other bytes".into());
    plan.insert("id".to_owned(), id.finalize().to_hex().to_string().into());
    plan.to_string()
}

#[test]
fn killed_anywhere_it_goes_on_to_the_same_bytes() {
    let root = tempfile::tempdir().unwrap();
    let here = root.path();
    write_inputs(here, SPEC);
    said(here, &["dataset", "plan", "spec.toml", "-o", "whole"]);
    let begun = Instant::now();
    said(here, &["dataset", "run", "whole"]);
    let lasts = begun.elapsed();
    let whole = made(&here.join("whole"));
    let points = if std::env::var_os("MATDB_TEST_MANY_FAULTS").is_some() { 100 } else { 3 };
    said(here, &["dataset", "plan", "spec.toml", "-o", "killed"]);
    let killed = here.join("killed");
    let mut interrupted = 0;
    for point in 1..=points {
        for folder in ["points", "images", "manifests"] {
            let _ = fs::remove_dir_all(killed.join(folder));
        }
        let _ = fs::remove_file(killed.join("scans.parquet"));
        let mut program = Command::new(program())
            .args(["-q", "dataset", "run", "killed"])
            .current_dir(here)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        sleep(lasts.mul_f64(f64::from(point) / f64::from(points + 1)));
        interrupted += u32::from(program.kill().is_ok() && !program.wait().unwrap().success());
        // Whatever is there under its name is whole.
        for (name, bytes) in made(&killed) {
            if !name.contains(".matdb-") {
                assert!(whole[&name] == bytes, "{name} at {point} of {points}");
            }
        }
        said(here, &["dataset", "run", "killed"]);
        let mut files = made(&killed);
        files.retain(|name, _| !name.contains(".matdb-"));
        assert!(files == whole, "{point} of {points}");
    }
    assert!(2 * interrupted > points, "{interrupted} of {points} met it at work");
}

/// The program that the tests run.
fn program() -> std::path::PathBuf {
    let command = matdb(root());
    command.get_program().into()
}
