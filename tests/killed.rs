//! Promise: whenever a command is killed, the database is sound and holds what it held before or what it should hold
//! after. Each file that the command names is the earlier one, the complete new one, or absent, and a published folder
//! is the earlier one or the new one as a whole. The same command then gives what it gives undisturbed.
//!
//! Some points lie at even steps of the time that the command takes undisturbed, the others at even steps after its
//! first change of a file. No command starts a process of its own, so that there is nothing more to kill. What is left
//! begins with `.matdb-`: files are ignored, folders of a publication are removed by the next one.
//!
//! A sample of the points; `.ci/long faults` kills each command as often as `POINTS` says.
//! `MATDB_TEST_KILLED='add --all'` kills the commands that begin so, each at every point.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::support::database::{change, contents, is_sound, lit, sound};
use crate::support::{curve, matdb, root, tree};
use matdb::material::Material;
use matdb::store::{Store, StoreError};

const DATABASE: &str = "matdb.sqlite";

/// Points at which each command is killed.
const POINTS: usize = 31;
/// Every so many of all points are in the sample: it meets another point of each command.
const SAMPLE: usize = 25;

/// A command that writes.
#[derive(Clone, Copy, Debug)]
struct Write {
    arguments: &'static str,
    /// Files and folders that it needs, as `NAME` or `NAME>NAME THERE`.
    needs: &'static str,
    /// Whether files of its own are there before, with other bytes.
    over: bool,
    /// Whether the same command is refused once it is done.
    is_refused_when_done: bool,
}

/// A command that writes new files, or into a database.
const fn write(arguments: &'static str, needs: &'static str) -> Write {
    Write { arguments, needs, over: false, is_refused_when_done: false }
}

/// A command that replaces files.
const fn over(arguments: &'static str, needs: &'static str) -> Write {
    Write { over: true, ..write(arguments, needs) }
}

/// A command that can be done once.
const fn once(arguments: &'static str, needs: &'static str) -> Write {
    Write { is_refused_when_done: true, ..write(arguments, needs) }
}

const WRITES: [Write; 33] = [
    write("add glass", "matdb.sqlite"),
    write("add glass ptfe", ""),
    write("add glass", "first.sqlite>matdb.sqlite"),
    write("add --from new.toml", "matdb.sqlite new.toml"),
    write(
        "add --from curve.csv --name my-curve --class paint --kind synthetic --source made --licence CC0-1.0 \
         --frequency 300",
        "matdb.sqlite curve.csv",
    ),
    write("add --all", ""),
    write("import theirs", "matdb.sqlite theirs"),
    write("import theirs/catalogue.sqlite --as-prefix roe-", "matdb.sqlite theirs"),
    once("rm primer cotton", "matdb.sqlite"),
    write("withdraw primer --reason old", "matdb.sqlite"),
    write("check --repair", "damaged.sqlite>matdb.sqlite"),
    write("publish site --about about.toml", "matdb.sqlite about.toml"),
    write("publish site --about about.toml", "matdb.sqlite about.toml theirs>site"),
    write("fit cotton --starts 1 --save", "matdb.sqlite"),
    write(
        "fit curve.csv --starts 1 --save cotton --curve spring --kind synthetic --source made -o fit.svg",
        "matdb.sqlite curve.csv",
    ),
    over("fit curve.csv --starts 1 -o fit.png", "curve.csv"),
    write(
        "diagnose cloud.ply --scene scene.toml --effects drift --no-controls --add -o report",
        "matdb.sqlite cloud.ply scene.toml",
    ),
    write(
        "diagnose cloud.ply --scene scene.toml --effects drift --no-controls -o report",
        "cloud.ply scene.toml report",
    ),
    write("diagnose --curve curve.csv --effects opposition -o report", "curve.csv"),
    write(
        "measure cloud.ply --scene scene.toml --exact-mesh --keep-pose --save mannequin-paint --kind synthetic \
         --source made --date 2026-03-14 -o measured",
        "matdb.sqlite cloud.ply scene.toml",
    ),
    write("calibrate plate.ply --scene plate.toml", "matdb.sqlite plate.ply plate.toml"),
    over("compare cloud.ply --scene scene.toml -o compared", "matdb.sqlite cloud.ply scene.toml"),
    write("render plate.toml -o out", "matdb.sqlite plate.toml"),
    over("render plate.toml -o out --all --beat --uncompressed", "matdb.sqlite plate.toml"),
    over("radar plate.toml -o radar", "plate.toml"),
    write("export cotton --as csv -o out/cotton.csv", "matdb.sqlite"),
    over("export lit-paint --as open-material -o lit.xomp", "matdb.sqlite"),
    over("plot cotton -o plot.png", "matdb.sqlite"),
    write("plot --appendix -o figures", ""),
    once("new scene --cloud cloud.ply --mesh builtin:sphere -o new-scene.toml", "cloud.ply"),
    once("new material my-paint", ""),
    over("predict cotton --angles 0:80:5 -o levels.csv", "matdb.sqlite"),
    write("predict lit-paint --angles 0:80:5 -o levels/levels.csv", "matdb.sqlite"),
];

/// A ball under few chirps, whose radar drifts as no model says where `drifts`.
fn ball(drifts: bool) -> String {
    let drift = "[[radar.effect]]\nname = \"drift\"\nslope_db = 5.0\n";
    format!(
        "seed = 3\n[radar]\nthreshold_dbm = -95.0\n[radar.speckle]\nlooks = 4\nform = \"independent\"\n\
         [radar.noise]\nlevel_dbm = -110\nrange_sd_m = 0.002\n[radar.scan]\npattern = \"elliptical\"\n\
         chirps = 800\n{}[[mesh]]\nname = \"sphere\"\nfile = \"builtin:sphere\"\nsize_m = [0.5, 0.5, 0.5]\n\
         translation_m = [0.0, 1.25, 0.0]\n[[region]]\nname = \"skin\"\nmaterial = \"mannequin-paint\"\n",
        if drifts { drift } else { "" }
    )
}

/// A plate of steel before a few chirps with a receiver that samples the beat.
const PLATE: &str = "[radar.scan]\npattern = \"raster\"\nlines = 30\nchirps_per_line = 30\nwidth_m = 0.4\n\
    height_m = 0.4\n[radar.receiver]\n[[mesh]]\nname = \"plate\"\nfile = \"builtin:plate\"\n\
    size_m = [0.6, 0.6, 0]\ntranslation_m = [0, 1.1, 0]\n[[region]]\nname = \"all\"\nmaterial = \"steel\"\n";

/// A folder with all that the commands need.
fn base() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let run = |arguments: &str| {
        matdb(at).args(arguments.split_whitespace()).assert().success();
    };
    let lit = {
        let mut material = lit("lit-paint");
        material.fits[0].report = None;
        material.fits[0].estimator = "stated".to_owned();
        material
    };
    run("add cotton mannequin-paint");
    let mut store = Store::open(at.join(DATABASE)).unwrap();
    store.add([&sound("primer"), &lit]).unwrap();
    store.add([&change(sound("primer"))]).unwrap();
    drop(store);
    fs::copy(root().join("tests/fixtures/schema-0001.sqlite"), at.join("first.sqlite")).unwrap();
    fs::copy(at.join(DATABASE), at.join("damaged.sqlite")).unwrap();
    let conn = rusqlite::Connection::open(at.join("damaged.sqlite")).unwrap();
    conn.execute_batch(
        "PRAGMA foreign_keys = off; DROP INDEX entry_class; DELETE FROM entry_tag; DELETE FROM curve_statistic;
         UPDATE unit SET ucum = 'furlong' WHERE ucum = 'm'",
    )
    .unwrap();
    drop(conn);
    let new = fs::read_to_string(root().join("materials/glass/material.toml")).unwrap();
    fs::write(at.join("new.toml"), new.replace("slug = \"glass\"", "slug = \"new-paint\""))
        .unwrap();
    fs::write(at.join("curve.csv"), curve()).unwrap();
    fs::write(at.join("about.toml"), "title = 'Paints'\nlicence = 'CC-BY-4.0'\n").unwrap();
    let mut store = Store::open(at.join("theirs.sqlite")).unwrap();
    store.add([&sound("other"), &change(sound("primer"))]).unwrap();
    drop(store);
    run("--db theirs.sqlite publish theirs --about about.toml");
    fs::write(at.join("scene.toml"), ball(false)).unwrap();
    fs::write(at.join("drifting.toml"), ball(true)).unwrap();
    fs::write(at.join("plate.toml"), PLATE).unwrap();
    for (scene, cloud) in [("drifting.toml", "cloud.ply"), ("plate.toml", "plate.ply")] {
        run(&format!("render {scene} -o rendered"));
        fs::rename(at.join("rendered/cloud.ply"), at.join(cloud)).unwrap();
    }
    run("diagnose cloud.ply --scene scene.toml --effects fov-gain --no-controls -o report");
    folder
}

fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        fs::create_dir_all(to).unwrap();
        for entry in fs::read_dir(from).unwrap() {
            let entry = entry.unwrap();
            copy(&entry.path(), &to.join(entry.file_name()));
        }
    } else {
        fs::copy(from, to).unwrap();
    }
}

/// What lies in a folder.
#[derive(Clone, PartialEq)]
struct State {
    /// The files, without the database and what is left over.
    files: BTreeMap<PathBuf, Vec<u8>>,
    /// Every revision of the database.
    materials: Vec<Material>,
}

/// Whether a path is of a file or folder that was being written.
fn is_left_over(path: &Path) -> bool {
    path.components().any(|part| part.as_os_str().to_string_lossy().starts_with(".matdb-"))
}

fn is_of_database(path: &Path) -> bool {
    path.to_string_lossy().starts_with(DATABASE)
}

impl State {
    fn of(folder: &Path) -> State {
        let mut files = tree(folder);
        files.retain(|path, _| !is_of_database(path) && !is_left_over(path));
        State { files, materials: contents(&folder.join(DATABASE)) }
    }

    /// The files below a folder.
    fn below(&self, folder: &str) -> BTreeMap<&PathBuf, &Vec<u8>> {
        self.files.iter().filter(|(path, _)| path.starts_with(folder)).collect()
    }
}

/// A command with the folder before it, and what it makes of that undisturbed.
struct Undisturbed {
    write: Write,
    folder: tempfile::TempDir,
    before: State,
    after: State,
    duration: Duration,
    /// Until its first change of a file.
    first_change: Duration,
}

impl Undisturbed {
    fn new(write: Write, base: &Path) -> Undisturbed {
        let folder = tempfile::tempdir().unwrap();
        for need in write.needs.split_whitespace() {
            let (from, to) = need.split_once('>').unwrap_or((need, need));
            copy(&base.join(from), &folder.path().join(to));
        }
        let before = State::of(folder.path());
        let (after, duration, first_change) = finished(folder.path(), write.arguments, 1);
        let mut undisturbed = Undisturbed { write, folder, before, after, duration, first_change };
        if write.over {
            let Undisturbed { folder, before, after, .. } = &mut undisturbed;
            for path in after.files.keys().filter(|path| !before.files.contains_key(*path)) {
                let path = folder.path().join(path);
                fs::create_dir_all(path.parent().unwrap()).unwrap();
                fs::write(path, "earlier\n").unwrap();
            }
            *before = State::of(folder.path());
        }
        undisturbed
    }

    /// Waits for a point of the command's time.
    fn wait_for(&self, point: usize, start: Instant, at: &Path, before: &BTreeMap<PathBuf, u64>) {
        let share = point as f64 / (POINTS - 1) as f64;
        match point {
            0 => {}
            // A little longer than undisturbed.
            _ if point.is_multiple_of(2) => sleep(self.duration.mul_f64(1.1 * share)),
            _ => {
                let most = self.duration.mul_f64(2.0) + Duration::from_millis(100);
                while names(at) == *before && start.elapsed() < most {
                    std::hint::spin_loop();
                }
                let rest = self.duration.saturating_sub(self.first_change);
                sleep(rest.mul_f64(share * share));
            }
        }
    }

    /// Kills the command at a point; everything that is wrong then, a line each, and what is left over.
    fn kill(&self, point: usize) -> (Vec<String>, Outcome) {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        copy(self.folder.path(), at);
        let before = names(at);
        let start = Instant::now();
        let mut child = start_in(at, self.write.arguments);
        self.wait_for(point, start, at, &before);
        child.kill().unwrap();
        let is_killed = child.wait().unwrap().code().is_none();
        let killed_after = start.elapsed();
        let (mut wrong, mut outcome) = self.verify(at);
        outcome.is_killed = is_killed;
        wrong.extend(self.run_again(at, outcome.is_done));
        for path in tree(at).into_keys().filter(|path| is_left_over(path)) {
            outcome.left_for_good.insert(shape(&path));
        }
        let when = format!(
            "`{}` ({}) killed at point {point}, {} of {} ms",
            self.write.arguments,
            self.write.needs,
            killed_after.as_millis(),
            self.duration.as_millis()
        );
        (wrong.into_iter().map(|what| format!("{when}: {what}")).collect(), outcome)
    }

    /// What is wrong with a folder in which the command was killed.
    fn verify(&self, at: &Path) -> (Vec<String>, Outcome) {
        let (mut wrong, mut outcome) = (Vec::new(), Outcome::default());
        let left = Left::new(at, self);
        wrong.extend(left.wrong);
        outcome.is_interrupted = left.is_interrupted;
        outcome.is_done =
            self.before.materials != self.after.materials && left.materials == self.after.materials;
        let Undisturbed { before, after, .. } = self;
        let found = tree(at);
        for path in found.keys().filter(|path| is_left_over(path)) {
            outcome.left.insert(shape(path));
        }
        for (path, bytes) in &found {
            if is_of_database(path) || is_left_over(path) {
                continue;
            }
            let known = [&before.files, &after.files].map(|files| files.get(path));
            if !known.contains(&Some(bytes)) {
                wrong.push(format!("{} is neither the earlier nor the new one", path.display()));
            }
        }
        for (path, bytes) in &before.files {
            if !found.contains_key(path) {
                let is_output = after.files.get(path) != Some(bytes);
                outcome.absent.extend(is_output.then(|| shape(path)));
                if !is_output {
                    wrong.push(format!("{} is gone", path.display()));
                }
            }
        }
        if self.write.arguments.starts_with("publish") {
            let now = State { files: found, materials: Vec::new() };
            let site = now.below("site");
            if site != before.below("site") && site != after.below("site") {
                wrong.push("the site is neither the earlier nor the new one".to_owned());
            }
            if at.join("site").exists()
                && !matdb(at).args(["verify", "site"]).output().unwrap().status.success()
            {
                wrong.push("the site does not verify".to_owned());
            }
        }
        (wrong, outcome)
    }

    /// What is wrong with the same command, run again.
    fn run_again(&self, at: &Path, is_done: bool) -> Vec<String> {
        let Undisturbed { write, after, folder, .. } = self;
        let mut files = tree(at);
        files.retain(|path, _| !is_of_database(path) && !is_left_over(path));
        let has_all = files == after.files;
        let output = matdb(at).args(write.arguments.split_whitespace()).output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr);
        if write.is_refused_when_done && has_all && (is_done || after.materials.is_empty()) {
            let is_refused = output.status.code() == Some(1) && said.starts_with("error: ");
            let what = format!("it was done, and is not refused again: {said}");
            return (!is_refused).then_some(what).into_iter().collect();
        }
        if !output.status.success() {
            return vec![format!("the same command fails: {said}")];
        }
        let now = State::of(at);
        // What was done already is done a second time.
        if now == *after || is_done && now == finished(folder.path(), write.arguments, 2).0 {
            return Vec::new();
        }
        vec![format!("the same command gives other files: {}", differing(&now, after))]
    }
}

/// What a command makes of a copy of a folder when it runs so many times, how long the last time takes, and when it
/// first changes a file then.
fn finished(folder: &Path, arguments: &str, times: usize) -> (State, Duration, Duration) {
    let at = tempfile::tempdir().unwrap();
    copy(folder, at.path());
    for _ in 1..times {
        assert!(start_in(at.path(), arguments).wait().unwrap().success());
    }
    let before = names(at.path());
    let start = Instant::now();
    let mut child = start_in(at.path(), arguments);
    let mut first_change = None;
    while child.try_wait().unwrap().is_none() {
        if first_change.is_none() && names(at.path()) != before {
            first_change = Some(start.elapsed());
        }
        sleep(Duration::from_micros(200));
    }
    let duration = start.elapsed();
    let status = child.wait().unwrap();
    assert!(status.success(), "{arguments}: {status}");
    (State::of(at.path()), duration, first_change.unwrap_or(duration))
}

/// A database as a command has left it.
struct Left {
    materials: Vec<Material>,
    /// Whether only a writer can take back what was cut short.
    is_interrupted: bool,
    /// What is wrong with it.
    wrong: Vec<String>,
}

impl Left {
    fn new(at: &Path, undisturbed: &Undisturbed) -> Left {
        let mut left = Left { materials: Vec::new(), is_interrupted: false, wrong: Vec::new() };
        if !at.join(DATABASE).exists() {
            if !undisturbed.before.materials.is_empty() {
                left.wrong.push("the database is gone".to_owned());
            }
            return left;
        }
        // A copy, as whoever opens it for writing takes over the log.
        let scratch = tempfile::tempdir().unwrap();
        let copied = scratch.path().join(DATABASE);
        for ending in ["", "-wal", "-journal"] {
            let name = format!("{DATABASE}{ending}");
            if at.join(&name).exists() {
                fs::copy(at.join(&name), scratch.path().join(name)).unwrap();
            }
        }
        left.is_interrupted =
            matches!(Store::open_existing(&copied), Err(StoreError::Interrupted { .. }));
        if left.is_interrupted {
            drop(Store::open(&copied).unwrap());
        }
        match std::panic::catch_unwind(|| contents(&copied)) {
            Err(_) => left.wrong.push("the database cannot be read".to_owned()),
            Ok(held) => left.materials = held,
        }
        let Undisturbed { before, after, .. } = undisturbed;
        if left.materials != before.materials && left.materials != after.materials {
            left.wrong.push(
                "the database holds neither what it held before nor what it should".to_owned(),
            );
        }
        if undisturbed.write.arguments != "check --repair"
            && let Ok(Some(store)) = Store::open_existing(&copied)
        {
            left.wrong.extend(store.damage().unwrap());
        }
        if !is_sound(&copied) {
            left.wrong.push("the database is not sound".to_owned());
        }
        left
    }
}

/// What a kill has met.
#[derive(Debug, Default)]
struct Outcome {
    /// Whether the command had not ended by itself.
    is_killed: bool,
    /// Whether the database holds what it should hold after.
    is_done: bool,
    /// Whether only a writer can take back what was cut short.
    is_interrupted: bool,
    /// What is left over.
    left: BTreeSet<String>,
    /// The same after the next run.
    left_for_good: BTreeSet<String>,
    /// Files that were there before and are to be replaced.
    absent: BTreeSet<String>,
}

/// A path without what is random in it.
fn shape(path: &Path) -> String {
    let mut parts = path.components().map(|part| part.as_os_str().to_string_lossy().into_owned());
    let mut shape = Vec::new();
    for part in &mut parts {
        let is_random = part.starts_with(".matdb-");
        shape.push(if is_random { part[..part.len() - 6].to_owned() + "*" } else { part });
        if is_random && path.components().count() > shape.len() {
            shape.push("…".to_owned());
            break;
        }
    }
    shape.join("/")
}

/// The paths at which two states differ.
fn differing(one: &State, other: &State) -> String {
    let paths: BTreeSet<&PathBuf> = one.files.keys().chain(other.files.keys()).collect();
    let differs = |path: &&&PathBuf| one.files.get(**path) != other.files.get(**path);
    let mut names: Vec<String> =
        paths.iter().filter(differs).map(|path| path.display().to_string()).collect();
    if one.materials != other.materials {
        names.push(DATABASE.to_owned());
    }
    names.join(", ")
}

fn start_in(folder: &Path, arguments: &str) -> std::process::Child {
    Command::new(assert_cmd::cargo::cargo_bin("matdb"))
        .args(arguments.split_whitespace())
        .current_dir(folder)
        .env_remove("MATDB")
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Names in a folder and in the folders within, and lengths of the files of a database: of its log, whoever reads makes
/// an empty one.
fn names(folder: &Path) -> BTreeMap<PathBuf, u64> {
    let mut names = BTreeMap::new();
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let (path, name) = (entry.path(), entry.file_name());
        if path.is_dir() {
            let within = fs::read_dir(&path).into_iter().flatten().flatten();
            names.extend(within.map(|entry| (entry.path(), 0)));
        }
        let is_of_database = is_of_database(Path::new(&name));
        let bytes = entry.metadata().map_or(0, |found| found.len());
        let is_counted =
            !name.to_string_lossy().ends_with("-shm") && (!is_of_database || bytes > 0);
        if is_counted {
            names.insert(name.into(), if is_of_database { bytes } else { 0 });
        }
    }
    names
}

/// Numbers of commands and of points to kill them at.
fn points() -> Vec<(usize, usize)> {
    let wanted = std::env::var("MATDB_TEST_KILLED").ok();
    let all = std::env::var_os("MATDB_TEST_MANY_FAULTS").is_some() || wanted.is_some();
    let is_wanted = |&(command, _): &(usize, usize)| {
        wanted.as_ref().is_none_or(|wanted| WRITES[command].arguments.starts_with(wanted))
    };
    let pairs =
        (0..WRITES.len()).flat_map(|command| (0..POINTS).map(move |point| (command, point)));
    pairs.filter(is_wanted).step_by(if all { 1 } else { SAMPLE }).collect()
}

#[test]
fn whenever_a_command_is_killed_there_is_what_was_or_what_should_be() {
    let base = base();
    let points = points();
    let commands: BTreeSet<usize> = points.iter().map(|(command, _)| *command).collect();
    let commands: Vec<usize> = commands.into_iter().collect();
    let (next, found) = (AtomicUsize::new(0), Mutex::new((Vec::new(), BTreeMap::new())));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(command) = commands.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let undisturbed = Undisturbed::new(WRITES[*command], base.path());
                    for (_, point) in points.iter().filter(|(of, _)| of == command) {
                        let (wrong, outcome) = undisturbed.kill(*point);
                        let mut found = found.lock().unwrap();
                        found.0.extend(wrong);
                        found.1.insert((*command, *point), outcome);
                    }
                }
            });
        }
    });
    let (mut wrong, outcomes) = found.into_inner().unwrap();
    let killed = outcomes.values().filter(|outcome| outcome.is_killed).count();
    for (number, write) in WRITES.iter().enumerate() {
        let of =
            || outcomes.iter().filter(move |((command, _), _)| *command == number).map(|(_, o)| o);
        if of().next().is_none() {
            continue;
        }
        let all = |of_one: fn(&Outcome) -> &BTreeSet<String>| -> BTreeSet<&String> {
            of().flat_map(of_one).collect()
        };
        println!(
            "{} killed {} of {}, {} done, {} interrupted; left {:?}, for good {:?}, absent {:?}",
            write.arguments,
            of().filter(|outcome| outcome.is_killed).count(),
            of().count(),
            of().filter(|outcome| outcome.is_done).count(),
            of().filter(|outcome| outcome.is_interrupted).count(),
            all(|outcome| &outcome.left),
            all(|outcome| &outcome.left_for_good),
            all(|outcome| &outcome.absent),
        );
    }
    wrong.sort();
    assert!(wrong.is_empty(), "{} problems:\n{}", wrong.len(), wrong.join("\n"));
    assert!(2 * killed > outcomes.len(), "only {killed} of {} were killed", outcomes.len());
}
