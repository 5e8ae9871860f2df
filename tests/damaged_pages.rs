//! Promise: of a damaged database a command either prints what it prints of the sound one, or ends with status 1 and one
//! sentence. Lists and searches may also call a material damaged, `near` leave it out with a notice, and `show` leave out
//! the list of revisions. `check` finds damage wherever the answer of another command changes or fails. A command that
//! only reads changes nothing. A command that writes loses nothing that could be read before, and a damaged database never
//! replaces a published site.
//!
//! The number of a case selects the kind of damage and seeds it, so that a case can be tried again:
//! `MATDB_TEST_FAULT=17`. A sample of the cases; `.ci/long faults` tries them all.
//!
//! A file of 0 or 1 bytes is not among them. The first is a database that no program has written yet.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use crate::support::database::{change, complete, lit, refitted, sound, with_effects};
use crate::support::{matdb, root, tree};
use matdb::material::{Material, Slug, Status};
use matdb::store::Store;
use rand::rngs::ChaCha8Rng;
use rand::{RngExt, SeedableRng};
use rusqlite::types::Value;
use rusqlite::{Connection, params};

const DATABASE: &str = "matdb.sqlite";
/// What lies beside the database.
const LOG: &str = "matdb.sqlite-wal";
const JOURNAL: &str = "matdb.sqlite-journal";
const FILES: [&str; 3] = [DATABASE, LOG, JOURNAL];

/// The materials of the database.
const NAMES: [&str; 6] = ["ptfe", "cotton", "lit-paint", "primer", "old-paint", "fitted-paint"];
/// Others that were there, whose pages are free.
const REMOVED_FIRST: [&str; 10] = [
    "alumina",
    "brick",
    "concrete",
    "glass",
    "human-skin",
    "ice",
    "kapton",
    "marble",
    "pvdf",
    "wood",
];
/// The one that is removed.
const REMOVED: &str = "lit-paint";
/// The one that is withdrawn.
const WITHDRAWN: &str = "primer";
/// The one that is added.
const ADDED: &str = "new-paint";

/// Cases of the campaign for each kind of damage.
const EACH: usize = 9;
/// Cases of the sample.
const SAMPLE: usize = 15;
/// Time that a command may take, s.
const MOST_S: u64 = 60;

fn write_tree(folder: &Path, files: &BTreeMap<PathBuf, Vec<u8>>) {
    for (path, bytes) in files {
        let path = folder.join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
}

/// Removes what a command has written.
fn clear(path: &Path) {
    if path.is_dir() {
        fs::remove_dir_all(path).unwrap();
    } else if path.exists() {
        fs::remove_file(path).unwrap();
    }
}

/// What a command says and writes.
#[derive(Clone, PartialEq)]
struct Answer {
    code: Option<i32>,
    stdout: Vec<u8>,
    stderr: String,
    /// The files that it has written.
    files: BTreeMap<PathBuf, Vec<u8>>,
}

impl Answer {
    fn is_done(&self) -> bool {
        self.code == Some(0)
    }

    /// Whether it says and writes the same as another.
    fn is_same(&self, other: &Answer) -> bool {
        (self.code, &self.stdout, &self.files) == (other.code, &other.stdout, &other.files)
    }

    /// Whether it is the answer of the sound database, or a list of it that calls some materials damaged.
    fn is_right(&self, sound: &Answer) -> bool {
        let lines = |answer: &Answer| -> Vec<String> {
            let text = answer.text();
            text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" ")).collect()
        };
        let (own, sound_lines) = (lines(self), lines(sound));
        let is_named = |(own, sound): (&String, &String)| {
            let name = |line: &str| line.split(' ').next().map(str::to_owned);
            own == sound || own.contains(" damaged") && name(own) == name(sound)
        };
        let is_listed =
            || own.len() == sound_lines.len() && own.iter().zip(&sound_lines).all(is_named);
        self.is_same(sound)
            || self.is_done()
                && self.files == sound.files
                && (is_listed()
                    || self.is_right_json(sound)
                    || self.is_right_but_for_history(sound)
                    || self.is_near_without_damaged(sound))
    }

    /// Whether it is the JSON of a list that calls some materials damaged, or of a revision without the list of all.
    fn is_right_json(&self, sound: &Answer) -> bool {
        let json = |answer: &Answer| serde_json::from_slice::<serde_json::Value>(&answer.stdout);
        let (Ok(own), Ok(mut sound)) = (json(self), json(sound)) else { return false };
        if let (Some(own), Some(sound)) = (own.as_array(), sound.as_array()) {
            // Ranks are comparable only within one search.
            let without_rank = |hit: &serde_json::Value| {
                let mut hit = hit.clone();
                hit.as_object_mut().and_then(|hit| hit.remove("rank"));
                hit
            };
            let is_right = |(own, sound): (&serde_json::Value, &serde_json::Value)| {
                without_rank(own) == without_rank(sound)
                    || own["damaged"] == true && own["slug"] == sound["slug"]
            };
            return own.len() == sound.len() && own.iter().zip(sound).all(is_right);
        }
        let is_without_history = own.get("history").is_some_and(serde_json::Value::is_null);
        is_without_history && {
            sound["history"] = serde_json::Value::Null;
            own == sound
        }
    }

    /// Whether it has the nearest materials without damaged ones, which a notice names, and others in their places.
    fn is_near_without_damaged(&self, sound: &Answer) -> bool {
        let end = "` is damaged and is left out";
        let notices = self.stderr.lines().filter(|line| line.contains(end));
        let named = notices.filter_map(|line| line.split('`').nth(1));
        let damaged: Vec<&str> = named.collect();
        let rows = |answer: &Answer| -> Vec<String> {
            let json = serde_json::from_slice::<serde_json::Value>(&answer.stdout);
            let listed = json.ok().and_then(|json| json["materials"].as_array().cloned());
            match listed {
                Some(materials) => materials.iter().map(ToString::to_string).collect(),
                None => answer.text().lines().skip(1).map(str::to_owned).collect(),
            }
        };
        let is_damaged = |row: &String| {
            damaged.iter().any(|name| {
                row.contains(&format!("\"slug\":\"{name}\""))
                    || row.starts_with(&format!("{name} "))
            })
        };
        let squeezed = |row: &String| row.split_whitespace().collect::<Vec<_>>().join(" ");
        let own: Vec<String> = rows(self).iter().map(squeezed).collect();
        let kept =
            |row: &&String| !is_damaged(row) && !row.contains("left out") && !row.trim().is_empty();
        !damaged.is_empty()
            && !rows(self).iter().any(is_damaged)
            && rows(sound).iter().filter(kept).all(|row| own.contains(&squeezed(row)))
    }

    /// Whether it shows a revision without the list of all, and says so.
    fn is_right_but_for_history(&self, sound: &Answer) -> bool {
        let sound = sound.text();
        let without = sound.split("\nrevisions:\n").next();
        self.stderr.contains("its revisions are not listed")
            && Some(self.text().as_str()) == without
    }

    /// What is wrong with the way it has ended, whatever the database holds.
    fn fault(&self) -> Option<String> {
        let errors = self.stderr.lines().filter(|line| line.starts_with("error: ")).count();
        match self.code {
            _ if self.stderr.contains("panicked") => Some(format!("panics: {}", self.stderr)),
            Some(0) if errors == 0 => None,
            Some(1)
                if errors == 1 && self.stderr.trim_end().lines().last().is_some_and(is_error) =>
            {
                None
            }
            code => Some(format!("ends with {code:?} and {errors} errors: {}", self.stderr)),
        }
    }

    fn text(&self) -> String {
        String::from_utf8_lossy(&self.stdout).into_owned()
    }
}

fn is_error(line: &str) -> bool {
    line.starts_with("error: ")
}

/// The folder or file into which reading commands write.
const OUT: &str = "out";
/// The folder that the database is published in.
const SITE: &str = "site";
/// A database that takes over the damaged one.
const TAKEN: &str = "taken.sqlite";

/// Runs a command in a folder; `written` is where it writes.
fn run(folder: &Path, arguments: &str, written: Option<&str>) -> Answer {
    let mut command = matdb(folder);
    command.args(arguments.split_whitespace()).timeout(Duration::from_secs(MOST_S));
    let output = command.output().unwrap();
    Answer {
        code: output.status.code(),
        stdout: untimed(&output.stdout),
        stderr: String::from_utf8_lossy(&output.stderr).into_owned(),
        files: written.map_or_else(BTreeMap::new, |written| tree(&folder.join(written))),
    }
}

/// Files of a publication but its database, and those with hashes of that: its pages may be others.
fn without_database(mut files: BTreeMap<PathBuf, Vec<u8>>) -> BTreeMap<PathBuf, Vec<u8>> {
    let others = [
        "SHA256SUMS",
        "catalogue.sqlite",
        "datapackage.json",
        "dataset.jsonld",
        "ro-crate-metadata.json",
    ];
    files.retain(|path, _| !others.iter().any(|other| path == Path::new(other)));
    files
}

/// What a command says without the time that it took.
fn untimed(stdout: &[u8]) -> Vec<u8> {
    let text = String::from_utf8_lossy(stdout);
    let lines = text.split_inclusive('\n').map(|line| match line.rsplit_once(" in ") {
        Some((before, after)) if after.ends_with(" s\n") => format!("{before}\n"),
        _ => line.to_owned(),
    });
    lines.collect::<String>().into_bytes()
}

/// Every command that reads, with `check` last.
fn reading() -> Vec<String> {
    let mut commands: Vec<String> = [
        "list",
        "list --json",
        "list --class paint --frequency 300",
        "list --tag dielectric --kind synthetic",
        "search paint",
        "search paint --json",
        "near --material cotton",
        "near --material primer --json",
        "show primer@1",
        "show primer@2 --json",
        "show old-paint@1 --json",
        "diff primer@1 primer",
        "diff lit-paint cotton --json",
        "history primer --json",
        "cite lit-paint --bibtex",
        "export cotton --as csv -o out/cotton.csv",
        "export lit-paint --as universal-brdf -o out/lit.brdf",
        "export ptfe --as mitsuba -o out/ptfe.xml",
        "export lit-paint --as open-material -o out/lit.xomp",
        "plot fitted-paint -o out/fitted.svg",
        "plot old-paint@1 -o out/old.png",
        "verify matdb.sqlite",
        "publish site --about about.toml",
    ]
    .map(str::to_owned)
    .to_vec();
    for name in NAMES {
        commands.extend([
            format!("show {name}"),
            format!("show {name} --json"),
            format!("history {name}"),
            format!("cite {name}"),
            format!("predict {name} --angles 0:60:10 -o out/levels.csv"),
            format!("render {name}.toml -o out"),
        ]);
    }
    commands.push(CHECK.to_owned());
    commands
}

const CHECK: &str = "check";

/// Where a command writes.
fn written(command: &str) -> Option<&'static str> {
    if command.contains(" out") {
        Some(OUT)
    } else if command.starts_with("publish") {
        Some(SITE)
    } else {
        None
    }
}

/// What every reading command says of the database in a folder. The site there is put back.
fn answers(folder: &Path, site: &BTreeMap<PathBuf, Vec<u8>>) -> Vec<Answer> {
    let mut answers = Vec::new();
    for command in reading() {
        let mut answer = run(folder, &command, written(&command));
        clear(&folder.join(OUT));
        let is_publication = command.starts_with("publish");
        if is_publication && answer.files != *site {
            clear(&folder.join(SITE));
            write_tree(&folder.join(SITE), site);
        }
        if is_publication && answer.is_done() {
            answer.files = without_database(answer.files);
        }
        answers.push(answer);
    }
    answers
}

/// A scene of few chirps on a plate of one material.
fn scene(material: &str) -> String {
    format!(
        "name = \"plate\"\nseed = 1\n[radar.scan]\npattern = \"raster\"\nlines = 4\nchirps_per_line = 4\n\
         width_m = 0.2\nheight_m = 0.2\n[[mesh]]\nname = \"plate\"\nfile = \"builtin:plate\"\n\
         size_m = [1, 1, 0]\ntranslation_m = [0, 1.1, 0]\n[[region]]\nname = \"all\"\n\
         material = \"{material}\"\n"
    )
}

/// A material with a model that is stated and not fitted, so that everything in it holds.
fn stated(mut material: Material) -> Material {
    material.fits[0].report = None;
    material.fits[0].estimator = "stated".to_owned();
    material.status = Status::Active;
    material.frequency_hz = [250e9, 350e9];
    material
}

/// The sound database, what commands say of it, and what damage is made of.
struct Laboratory {
    /// Files of a folder to work in, without the database.
    folder: BTreeMap<PathBuf, Vec<u8>>,
    site: BTreeMap<PathBuf, Vec<u8>>,
    database: Vec<u8>,
    /// The database before its last change, and the log of that change.
    older: Vec<u8>,
    log: Vec<u8>,
    /// The journal of the same change.
    journal: Vec<u8>,
    /// The same of another database.
    foreign: Vec<u8>,
    foreign_log: Vec<u8>,
    foreign_journal: Vec<u8>,
    answers: Vec<Answer>,
    /// Of the database before its last change.
    older_answers: Vec<Answer>,
    /// Every revision, by name and number.
    revisions: BTreeMap<(Slug, u32), Material>,
    /// The new material, as JSON shows it.
    added: serde_json::Value,
}

impl Laboratory {
    fn new() -> Laboratory {
        let folder = tempfile::tempdir().unwrap();
        let at = folder.path();
        let path = at.join(DATABASE);
        // Pages of a removed material stay free.
        matdb(at).args(["add", "ptfe", "cotton"]).args(REMOVED_FIRST).assert().success();
        let mut store = Store::open(&path).unwrap();
        let old = stated(complete("old-paint"));
        let fitted = refitted(with_effects("fitted-paint"));
        store.add([&stated(lit("lit-paint")), &sound("primer"), &old, &fitted]).unwrap();
        store.add([&change(sound("primer"))]).unwrap();
        drop(store);
        matdb(at).arg("rm").args(REMOVED_FIRST).assert().success();
        let [older, database, log, journal] = last_change(&path, |store| {
            let withdrawn =
                Material { status: Status::Withdrawn { reason: "It is old.".to_owned() }, ..old };
            store.add([&withdrawn]).unwrap();
        });
        let foreign_path = at.join("foreign.sqlite");
        matdb(at).args(["--db", "foreign.sqlite", "add", "glass", "steel"]).assert().success();
        let [_, foreign, foreign_log, foreign_journal] = last_change(&foreign_path, |store| {
            store.add([&sound("foreign-paint")]).unwrap();
        });
        fs::remove_file(foreign_path).unwrap();

        fs::write(at.join("about.toml"), "title = 'Paints'\nlicence = 'CC-BY-4.0'\n").unwrap();
        for name in NAMES {
            fs::write(at.join(format!("{name}.toml")), scene(name)).unwrap();
        }
        let new = fs::read_to_string(root().join("materials/glass/material.toml")).unwrap();
        let new = new.replace("slug = \"glass\"", &format!("slug = \"{ADDED}\""));
        fs::write(at.join("new.toml"), new).unwrap();
        let publish = "publish site --about about.toml";
        for _ in 0..2 {
            fs::write(&path, &database).unwrap();
            let answer = run(at, publish, None);
            assert!(answer.is_done(), "{}", answer.stderr);
        }
        let site = tree(&at.join(SITE));
        fs::write(&path, &older).unwrap();
        let older_answers = answers(at, &site);
        fs::write(&path, &database).unwrap();
        let answers = answers(at, &site);
        for (command, answer) in reading().iter().zip(&answers) {
            assert!(answer.is_done(), "{command}: {}", answer.stderr);
        }
        let store = Store::open_existing(&path).unwrap().unwrap();
        let mut revisions = BTreeMap::new();
        for summary in store.list().unwrap() {
            for number in 1..=summary.revision {
                let stored = store.get(&summary.slug, Some(number)).unwrap().unwrap();
                revisions.insert((summary.slug.clone(), number), stored.material);
            }
        }
        drop(store);
        assert_eq!(revisions.len(), NAMES.len() + 2);
        assert!(Image::new(&database).free().len() > 3);
        let added = run(at, "add --from new.toml", None);
        assert!(added.is_done(), "{}", added.stderr);
        let added = shown(&run(at, "show new-paint --json", None));
        let mut files = tree(at);
        files.retain(|path, _| {
            !path.to_string_lossy().starts_with(DATABASE) && !path.starts_with(SITE)
        });
        Laboratory {
            folder: files,
            site,
            database,
            older,
            log,
            journal,
            foreign,
            foreign_log,
            foreign_journal,
            answers,
            older_answers,
            revisions,
            added,
        }
    }

    /// A folder with these files of a database, and all that commands need.
    fn folder(&self, files: &Files) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        write_tree(folder.path(), &self.folder);
        for (name, bytes) in files {
            fs::write(folder.path().join(name), bytes).unwrap();
        }
        folder
    }
}

/// The material that `show --json` shows.
fn shown(answer: &Answer) -> serde_json::Value {
    let value: serde_json::Value = serde_json::from_slice(&answer.stdout).unwrap_or_default();
    value["material"].clone()
}

/// Changes a database; its bytes before and after, and log and journal of the change.
fn last_change(path: &Path, change: impl FnOnce(&mut Store)) -> [Vec<u8>; 4] {
    let beside = |ending: &str| PathBuf::from(format!("{}{ending}", path.display()));
    let before = fs::read(path).unwrap();
    let mut store = Store::open(path).unwrap();
    // Another connection keeps the log from being written back.
    let keeper = Connection::open(path).unwrap();
    let _: i64 = keeper.query_row("SELECT count(*) FROM material", [], |row| row.get(0)).unwrap();
    change(&mut store);
    let log = fs::read(beside("-wal")).unwrap();
    drop((store, keeper));
    let after = fs::read(path).unwrap();

    // The same pages through a journal, which is copied before the change ends.
    fs::write(path, &before).unwrap();
    let conn = Connection::open(path).unwrap();
    conn.pragma_update(None, "journal_mode", "delete").unwrap();
    conn.pragma_update(None, "cache_size", 1).unwrap();
    conn.execute_batch("BEGIN; UPDATE revision SET program_version = '9.9.9'; UPDATE source SET title = title || '!'")
        .unwrap();
    let journal = fs::read(beside("-journal")).unwrap();
    conn.execute_batch("ROLLBACK").unwrap();
    drop(conn);
    fs::write(path, &after).unwrap();
    [before, after, log, journal]
}

/// The files of a database by their names.
type Files = BTreeMap<&'static str, Vec<u8>>;

/// A database file as pages.
struct Image {
    bytes: Vec<u8>,
    size: usize,
}

impl Image {
    fn new(bytes: &[u8]) -> Image {
        let size = usize::from(u16::from_be_bytes([bytes[16], bytes[17]]));
        Image { bytes: bytes.to_vec(), size: if size == 1 { 65536 } else { size } }
    }

    fn pages(&self) -> usize {
        self.bytes.len() / self.size
    }

    /// Where a page lies; the first has the number 0 here.
    fn span(&self, page: usize) -> Range<usize> {
        page * self.size..(page + 1) * self.size
    }

    fn page(&self, page: usize) -> &[u8] {
        &self.bytes[self.span(page)]
    }

    fn number(&self, at: usize) -> usize {
        u32::from_be_bytes(self.bytes[at..at + 4].try_into().unwrap()) as usize
    }

    /// Pages that hold nothing: sqlite.org/fileformat.html, "The Freelist".
    fn free(&self) -> Vec<usize> {
        let mut free = Vec::new();
        let mut trunk = self.number(32);
        while trunk > 0 {
            let at = (trunk - 1) * self.size;
            free.push(trunk - 1);
            free.extend((0..self.number(at + 4)).map(|leaf| self.number(at + 8 + 4 * leaf) - 1));
            trunk = self.number(at);
        }
        free
    }

    /// Where the header of a page of a tree begins; none for other pages.
    fn header(&self, page: usize) -> Option<usize> {
        let at = self.span(page).start + if page == 0 { 100 } else { 0 };
        [2, 5, 10, 13].contains(&self.bytes[at]).then_some(at)
    }

    /// Pages of trees, and where their headers begin.
    fn trees(&self) -> Vec<(usize, usize)> {
        let free: BTreeSet<usize> = self.free().into_iter().collect();
        let pages = (0..self.pages()).filter(|page| !free.contains(page));
        pages.filter_map(|page| Some((page, self.header(page)?))).collect()
    }

    /// Where the pointers to the cells of a page lie.
    fn pointers(&self, header: usize) -> Range<usize> {
        let length = if self.bytes[header] > 8 { 8 } else { 12 };
        let cells =
            usize::from(u16::from_be_bytes([self.bytes[header + 3], self.bytes[header + 4]]));
        header + length..header + length + 2 * cells
    }

    /// Where the cells of a page lie.
    fn cells(&self, page: usize, header: usize) -> Range<usize> {
        let begin =
            usize::from(u16::from_be_bytes([self.bytes[header + 5], self.bytes[header + 6]]));
        self.span(page).start + begin..self.span(page).end
    }

    /// The places of some bytes.
    fn find(&self, wanted: &[u8]) -> Vec<usize> {
        let windows = self.bytes.windows(wanted.len()).enumerate();
        windows.filter(|(_, window)| *window == wanted).map(|(at, _)| at).collect()
    }
}

/// A way to damage a database.
type Damage = fn(&Laboratory, &mut ChaCha8Rng) -> Files;

/// One of these.
fn pick<'a, T>(rng: &mut ChaCha8Rng, from: &'a [T]) -> &'a T {
    &from[rng.random_range(0..from.len())]
}

/// A place within a range that has one.
fn place(rng: &mut ChaCha8Rng, span: Range<usize>) -> usize {
    if span.is_empty() { span.start } else { rng.random_range(span) }
}

/// The database alone, changed.
fn alone(lab: &Laboratory, change: impl FnOnce(&mut Image)) -> Files {
    let mut image = Image::new(&lab.database);
    change(&mut image);
    [(DATABASE, image.bytes)].into()
}

fn flip(image: &mut Image, rng: &mut ChaCha8Rng, at: usize) {
    image.bytes[at] ^= 1 << rng.random_range(0..8);
}

/// Damage of bytes and pages.
const OF_PAGES: [(&str, Damage); 27] = [
    ("a bit of a tree's header", |lab, rng| {
        alone(lab, |image| {
            let (_, header) = *pick(rng, &image.trees());
            let at = header + rng.random_range(0..8);
            flip(image, rng, at);
        })
    }),
    ("a pointer to a cell", |lab, rng| {
        alone(lab, |image| {
            let (_, header) = *pick(rng, &image.trees());
            let at = place(rng, image.pointers(header));
            image.bytes[at] = rng.random();
        })
    }),
    ("a bit of a cell", |lab, rng| {
        alone(lab, |image| {
            let (page, header) = *pick(rng, &image.trees());
            let at = place(rng, image.cells(page, header));
            flip(image, rng, at);
        })
    }),
    ("bytes of cells", |lab, rng| {
        alone(lab, |image| {
            for _ in 0..rng.random_range(2..20) {
                let (page, header) = *pick(rng, &image.trees());
                let at = place(rng, image.cells(page, header));
                image.bytes[at] = rng.random();
            }
        })
    }),
    ("the first bytes of a cell", |lab, rng| {
        alone(lab, |image| {
            let (page, header) = *pick(rng, &image.trees());
            let at = place(rng, image.pointers(header)) & !1;
            let cell = usize::from(u16::from_be_bytes([image.bytes[at], image.bytes[at + 1]]));
            let at = image.span(page).start + cell % image.size;
            image.bytes[(at + rng.random_range(0..4)).min(lab.database.len() - 1)] = rng.random();
        })
    }),
    ("free pages", |lab, rng| {
        alone(lab, |image| {
            for _ in 0..20 {
                let page = *pick(rng, &image.free());
                let at = place(rng, image.span(page));
                image.bytes[at] = rng.random();
            }
        })
    }),
    ("a bit anywhere", |lab, rng| {
        alone(lab, |image| {
            let at = rng.random_range(0..image.bytes.len());
            flip(image, rng, at);
        })
    }),
    ("fifty bits anywhere", |lab, rng| {
        alone(lab, |image| {
            for _ in 0..50 {
                let at = rng.random_range(100..image.bytes.len());
                flip(image, rng, at);
            }
        })
    }),
    ("a page of zeros", |lab, rng| {
        alone(lab, |image| {
            let span = image.span(rng.random_range(0..image.pages()));
            image.bytes[span].fill(0);
        })
    }),
    ("a page of noise", |lab, rng| {
        alone(lab, |image| {
            let span = image.span(rng.random_range(1..image.pages()));
            rng.fill(&mut image.bytes[span]);
        })
    }),
    ("half a page of zeros", |lab, rng| {
        alone(lab, |image| {
            let span = image.span(rng.random_range(1..image.pages()));
            image.bytes[span.start + image.size / 2..span.end].fill(0);
        })
    }),
    ("two pages exchanged", |lab, rng| {
        alone(lab, |image| {
            let trees = image.trees();
            let [a, b] = [pick(rng, &trees[1..]).0, pick(rng, &trees[1..]).0];
            let [of_a, of_b] = [a, b].map(|page| image.page(page).to_vec());
            let [a, b] = [a, b].map(|page| image.span(page));
            image.bytes[a].copy_from_slice(&of_b);
            image.bytes[b].copy_from_slice(&of_a);
        })
    }),
    ("a page as it was before", |lab, rng| {
        alone(lab, |image| {
            let older = Image::new(&lab.older);
            let both = 0..image.pages().min(older.pages());
            let changed: Vec<usize> =
                both.filter(|&page| image.page(page) != older.page(page)).collect();
            let page = *pick(rng, &changed);
            let span = image.span(page);
            image.bytes[span].copy_from_slice(older.page(page));
        })
    }),
    ("some pages as they were before", |lab, rng| {
        alone(lab, |image| {
            let older = Image::new(&lab.older);
            for page in 0..image.pages().min(older.pages()) {
                if rng.random_bool(0.5) {
                    let span = image.span(page);
                    image.bytes[span].copy_from_slice(older.page(page));
                }
            }
        })
    }),
    ("a page of another database", |lab, rng| {
        alone(lab, |image| {
            let other = Image::new(&lab.foreign);
            let page = rng.random_range(0..image.pages().min(other.pages()));
            let span = image.span(page);
            image.bytes[span].copy_from_slice(other.page(page));
        })
    }),
    ("an end at a page", |lab, rng| {
        alone(lab, |image| {
            let pages = rng.random_range(1..image.pages());
            image.bytes.truncate(pages * image.size);
        })
    }),
    ("an end within a page", |lab, rng| {
        alone(lab, |image| {
            let at = rng.random_range(2..image.bytes.len());
            image.bytes.truncate(at);
        })
    }),
    ("an end within the header", |lab, rng| {
        alone(lab, |image| image.bytes.truncate(rng.random_range(2..200)))
    }),
    ("another page size", |lab, rng| {
        alone(lab, |image| {
            let size: u16 = *pick(rng, &[512, 1024, 2048, 8192, 16384, 1, 0, 3000]);
            image.bytes[16..18].copy_from_slice(&size.to_be_bytes());
        })
    }),
    ("another number of pages", |lab, rng| {
        alone(lab, |image| {
            let pages = image.pages() as u32;
            let said = *pick(rng, &[0, 1, pages / 2, pages - 1, pages + 1, 2 * pages, u32::MAX]);
            image.bytes[28..32].copy_from_slice(&said.to_be_bytes());
        })
    }),
    ("another list of free pages", |lab, rng| {
        alone(lab, |image| {
            let at = if rng.random_bool(0.5) {
                32 + rng.random_range(0..8)
            } else {
                image.span(image.free()[0]).start + rng.random_range(0..16)
            };
            flip(image, rng, at);
        })
    }),
    ("another encoding of texts", |lab, rng| {
        alone(lab, |image| {
            let encoding: u32 = *pick(rng, &[0, 2, 3, 4]);
            image.bytes[56..60].copy_from_slice(&encoding.to_be_bytes());
        })
    }),
    ("another version or owner", |lab, rng| {
        alone(lab, |image| {
            let at = *pick(rng, &[60, 68]);
            let value = *pick(rng, &[0_u32, 1, 5, 10, 13, 15, 99, u32::MAX]);
            image.bytes[at..at + 4].copy_from_slice(&value.to_be_bytes());
        })
    }),
    ("a byte of the header", |lab, rng| {
        alone(lab, |image| {
            let at = rng.random_range(0..100);
            image.bytes[at] = rng.random();
        })
    }),
    ("a byte of the statements of the schema", |lab, rng| {
        alone(lab, |image| {
            let places = image.find(b"CREATE ");
            let at = *pick(rng, &places) + rng.random_range(0..200);
            image.bytes[at] = *pick(rng, b"abcdez ,()'1_");
        })
    }),
    ("a number on a page", |lab, rng| {
        let columns = columns(lab, "REAL");
        let (table, column) = pick(rng, &columns);
        let values =
            lab.values(&format!("SELECT {column} FROM {table} WHERE {column} IS NOT NULL"));
        alone(lab, |image| {
            let Some(Value::Real(value)) = values.get(rng.random_range(0..values.len().max(1)))
            else {
                return;
            };
            let value = *value;
            let number =
                *pick(rng, &[f64::NAN, f64::INFINITY, -value, value * 1.01, 1e300, 5e-324]);
            if let Some(at) = image.find(&value.to_be_bytes()).first() {
                image.bytes[*at..*at + 8].copy_from_slice(&number.to_be_bytes());
            }
        })
    }),
    ("a letter on a page", |lab, rng| {
        let columns = columns(lab, "TEXT");
        let (table, column) = pick(rng, &columns);
        let values =
            lab.values(&format!("SELECT {column} FROM {table} WHERE length({column}) > 3"));
        alone(lab, |image| {
            let Some(Value::Text(text)) = values.get(rng.random_range(0..values.len().max(1)))
            else {
                return;
            };
            let places = image.find(text.as_bytes());
            if !places.is_empty() {
                let at = *pick(rng, &places) + rng.random_range(0..text.len());
                image.bytes[at] = *pick(rng, b"aeiou159-\"\0\xff");
            }
        })
    }),
];

/// Damage by what lies beside a database.
const OF_LOGS: [(&str, Damage); 8] = [
    ("a torn log", |lab, rng| {
        let log = lab.log[..rng.random_range(0..lab.log.len())].to_vec();
        [(DATABASE, lab.older.clone()), (LOG, log)].into()
    }),
    ("a log with a wrong byte", |lab, rng| {
        let mut log = lab.log.clone();
        let at = rng.random_range(0..log.len());
        log[at] ^= 1 << rng.random_range(0..8);
        [(DATABASE, lab.older.clone()), (LOG, log)].into()
    }),
    ("a log that is half written back", |lab, rng| {
        let (older, mut image) = (Image::new(&lab.older), Image::new(&lab.database));
        for page in 0..older.pages().min(image.pages()) {
            if rng.random_bool(0.5) {
                let span = image.span(page);
                image.bytes[span].copy_from_slice(older.page(page));
            }
        }
        [(DATABASE, image.bytes), (LOG, lab.log.clone())].into()
    }),
    ("the log of another database", |lab, _| {
        [(DATABASE, lab.database.clone()), (LOG, lab.foreign_log.clone())].into()
    }),
    ("the journal of another database", |lab, _| {
        [(DATABASE, lab.database.clone()), (JOURNAL, lab.foreign_journal.clone())].into()
    }),
    ("a torn journal", |lab, rng| {
        let journal = lab.journal[..rng.random_range(0..lab.journal.len())].to_vec();
        [(DATABASE, lab.database.clone()), (JOURNAL, journal)].into()
    }),
    ("a journal of noise", |lab, rng| {
        let mut journal = lab.journal.clone();
        let keep = *pick(rng, &[0, 8, 28, 512]);
        rng.fill(&mut journal[keep..]);
        [(DATABASE, lab.database.clone()), (JOURNAL, journal)].into()
    }),
    ("a log of noise", |lab, rng| {
        let mut log = lab.log.clone();
        let keep = *pick(rng, &[0, 4, 32, 56]);
        rng.fill(&mut log[keep..]);
        [(DATABASE, lab.database.clone()), (LOG, log)].into()
    }),
];

/// Damage through SQL, as another program would make it that keeps no rule.
const OF_ROWS: [(&str, Damage); 10] = [
    ("a value that was changed", |lab, rng| {
        lab.tampered(rng, |row, rng| match row.kind.as_str() {
            "TEXT" => format!("{} || 'x'", row.column),
            "BLOB" => "randomblob(16)".to_owned(),
            _ => format!("{} {}", row.column, pick(rng, &["* 2", "+ 1", "* -1", "/ 3"])),
        })
    }),
    ("a value that was removed", |lab, rng| lab.tampered(rng, |_, _| "NULL".to_owned())),
    ("a row that was removed", |lab, rng| {
        let row = lab.row(rng);
        lab.changed(&format!("DELETE FROM {} WHERE {}", row.table, row.condition))
    }),
    ("a row that is there twice", |lab, rng| lab.doubled(rng)),
    ("a key that leads nowhere", |lab, rng| {
        let keys = [
            "UPDATE curve SET source = 'nowhere' WHERE rowid_of",
            "UPDATE fit SET source = 'nowhere' WHERE rowid_of",
            "UPDATE fit SET curve = 'nowhere' WHERE rowid_of",
            "UPDATE observation SET curve = 'nowhere' WHERE rowid_of",
            "UPDATE revision SET material_id = 99 WHERE id = (SELECT max(id) FROM revision)",
            "UPDATE revision SET render = 'nowhere' WHERE id = (SELECT min(id) FROM revision)",
            "UPDATE entry SET material_id = 99 WHERE slug = 'cotton'",
            "DELETE FROM material WHERE slug = 'cotton'",
            "DELETE FROM revision WHERE id = (SELECT max(id) FROM revision)",
        ];
        let revision = format!("revision_id = {}", pick(rng, &lab.revision_ids()));
        lab.changed(&pick(rng, &keys).replace("rowid_of", &revision))
    }),
    ("a text in a column of numbers", |lab, rng| {
        lab.tampered(rng, |row, rng| {
            if row.kind == "TEXT" {
                "42".to_owned()
            } else {
                (*pick(rng, &["'many'", "'1.5'", "''", "'nan'"])).to_owned()
            }
        })
    }),
    ("a number without end", |lab, rng| {
        lab.tampered(rng, |_, rng| {
            (*pick(rng, &["9e999", "-9e999", "9e307", "-1", "9223372036854775807", "0"])).to_owned()
        })
    }),
    ("bytes that are not a text", |lab, rng| {
        lab.tampered(rng, |_, rng| {
            (*pick(
                rng,
                &[
                    "x'00ff00'",
                    "CAST(x'ff61' AS TEXT)",
                    "x''",
                    "char(0, 27, 8238)",
                    "zeroblob(100000)",
                ],
            ))
            .to_owned()
        })
    }),
    ("revisions out of order", |lab, rng| {
        let changes = [
            "UPDATE material SET current_revision = 1",
            "UPDATE material SET current_revision = 3 WHERE slug = 'primer'",
            "UPDATE revision SET number = number + 10",
            "UPDATE revision SET number = number + 10; UPDATE revision SET number = 13 - number WHERE material_id IN
             (SELECT id FROM material WHERE slug = 'primer'); UPDATE revision SET number = number - 10 WHERE number > 10",
            "UPDATE revision SET content_hash = (SELECT content_hash FROM revision ORDER BY id LIMIT 1)",
            "UPDATE revision SET added_at = '2001-01-01T00:00:00Z'",
            "UPDATE revision SET program_version = '9.9.9'",
            "UPDATE material SET slug = 'steel' WHERE slug = 'cotton'",
            "UPDATE material SET id = id + 100",
            "UPDATE activity SET command = 'import'",
            "UPDATE material SET slug = CASE slug WHEN 'cotton' THEN 'ptfe-' ELSE slug END",
        ];
        let change = *pick(rng, &changes);
        lab.changed(change)
    }),
    ("another schema", |lab, rng| {
        let changes = [
            "DROP VIEW entry_made; CREATE VIEW entry_made AS SELECT 1",
            "DROP VIEW v_curves",
            "DROP INDEX entry_class",
            "DROP INDEX entry_tag_tag",
            "DROP TRIGGER search_removed",
            "DROP TABLE outline",
            "DROP TABLE entry_tag",
            "DROP TABLE fit_lobes",
            "DROP TABLE search",
            "DELETE FROM search",
            "DELETE FROM search_data WHERE id > 10",
            "UPDATE entry SET name = 'Another name', class = 'metal', curves = 7 WHERE slug = 'cotton'",
            "UPDATE outline SET levels = (SELECT levels FROM outline WHERE slug = 'cotton')",
            "DELETE FROM entry WHERE slug = 'cotton'",
            "UPDATE unit SET ucum = 'furlong' WHERE ucum = 'm'",
            "ALTER TABLE curve RENAME COLUMN instrument TO device",
        ];
        let change = *pick(rng, &changes);
        lab.changed(change)
    }),
];

/// One value of a database.
struct Row {
    table: String,
    /// Tells the row from others of its table.
    condition: String,
    column: String,
    kind: String,
}

/// Tables and columns of one kind.
fn columns(lab: &Laboratory, kind: &str) -> Vec<(String, String)> {
    let sql = format!(
        "SELECT t.name, c.name FROM pragma_table_list AS t JOIN pragma_table_info(t.name) AS c
         WHERE t.schema = 'main' AND t.type = 'table' AND t.name NOT LIKE 'sqlite%' AND c.type = '{kind}'"
    );
    let file = lab.file();
    let conn = Connection::open(file.path().join(DATABASE)).unwrap();
    let mut statement = conn.prepare(&sql).unwrap();
    let found = statement.query_map([], |row| Ok((row.get(0)?, row.get(1)?))).unwrap();
    found.map(Result::unwrap).collect()
}

impl Laboratory {
    /// A folder with the sound database.
    fn file(&self) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join(DATABASE), &self.database).unwrap();
        folder
    }

    fn values(&self, sql: &str) -> Vec<Value> {
        let file = self.file();
        let conn = Connection::open(file.path().join(DATABASE)).unwrap();
        let mut statement = conn.prepare(sql).unwrap();
        let found = statement.query_map([], |row| row.get(0)).unwrap();
        found.map(Result::unwrap).collect()
    }

    fn revision_ids(&self) -> Vec<i64> {
        let ids = self.values("SELECT id FROM revision");
        ids.into_iter().map(|id| if let Value::Integer(id) = id { id } else { 0 }).collect()
    }

    /// The database after statements that keep no rule.
    fn changed(&self, sql: &str) -> Files {
        let file = self.file();
        let path = file.path().join(DATABASE);
        loosely(&path, |conn| {
            // What the statements cannot do is no damage: the case is then of a sound database.
            if let Err(error) = conn.execute_batch(sql) {
                assert!(!error.to_string().contains("syntax"), "{sql}: {error}");
            }
        });
        [(DATABASE, fs::read(path).unwrap())].into()
    }

    /// One value of a table that has rows.
    fn row(&self, rng: &mut ChaCha8Rng) -> Row {
        let file = self.file();
        let conn = Connection::open(file.path().join(DATABASE)).unwrap();
        let strings = |sql: &str, of: &str| -> Vec<[String; 2]> {
            let mut statement = conn.prepare(sql).unwrap();
            let found =
                statement.query_map(params![of], |row| Ok([row.get(0)?, row.get(1)?])).unwrap();
            found.map(Result::unwrap).collect()
        };
        let tables =
            "SELECT name, '' FROM pragma_table_list WHERE schema = 'main' AND type = 'table'
                      AND name NOT LIKE 'sqlite%' AND ?1 = ''";
        let tables = strings(tables, "");
        loop {
            let [table, _] = pick(rng, &tables);
            let count = format!("SELECT count(*) FROM {table}");
            let count: usize =
                conn.query_row(&count, [], |row| row.get::<_, u32>(0)).unwrap() as usize;
            if count == 0 {
                continue;
            }
            let [column, kind] =
                pick(rng, &strings("SELECT name, type FROM pragma_table_info(?1)", table)).clone();
            let key = strings("SELECT name, '' FROM pragma_table_info(?1) WHERE pk > 0", table);
            let key: Vec<String> = key.into_iter().map(|[name, _]| name).collect();
            let key = key.join(", ");
            let nth = rng.random_range(0..count);
            let condition = format!("({key}) = (SELECT {key} FROM {table} LIMIT 1 OFFSET {nth})");
            return Row { table: table.clone(), condition, column, kind };
        }
    }

    /// The database with another value in some row.
    fn tampered(
        &self,
        rng: &mut ChaCha8Rng,
        value: impl Fn(&Row, &mut ChaCha8Rng) -> String,
    ) -> Files {
        let row = self.row(rng);
        let value = value(&row, rng);
        let Row { table, condition, column, .. } = row;
        self.changed(&format!("UPDATE {table} SET {column} = {value} WHERE {condition}"))
    }

    /// The database with a row that is there twice, under another position.
    fn doubled(&self, rng: &mut ChaCha8Rng) -> Files {
        let row = self.row(rng);
        let Row { table, condition, .. } = row;
        let file = self.file();
        let conn = Connection::open(file.path().join(DATABASE)).unwrap();
        let mut statement = conn.prepare("SELECT name FROM pragma_table_info(?1)").unwrap();
        let names: Vec<String> =
            statement.query_map([&table], |row| row.get(0)).unwrap().map(Result::unwrap).collect();
        // A key has to be new, or nothing is inserted.
        let values: Vec<String> = names
            .iter()
            .map(|name| match name.as_str() {
                "position" | "id" | "number" => format!("{name} + 50"),
                "key" | "name" | "slug" | "tag" | "path" | "content_hash" => {
                    format!("substr({name}, 2) || 'x'")
                }
                _ => name.clone(),
            })
            .collect();
        let (names, values) = (names.join(", "), values.join(", "));
        self.changed(&format!(
            "INSERT OR IGNORE INTO {table} ({names}) SELECT {values} FROM {table} WHERE {condition}"
        ))
    }
}

/// Lets statements write what types, conditions and references forbid; the schema is as before afterwards.
fn loosely(path: &Path, change: impl FnOnce(&Connection)) {
    let open = || {
        let conn = Connection::open(path).unwrap();
        conn.execute_batch(
            "PRAGMA foreign_keys = off; PRAGMA ignore_check_constraints = on; PRAGMA writable_schema = on",
        )
        .unwrap();
        conn
    };
    let conn = open();
    let strict = "SELECT name, sql FROM sqlite_schema WHERE type = 'table' AND sql LIKE '%STRICT%'";
    let statements: Vec<(String, String)> = conn
        .prepare(strict)
        .unwrap()
        .query_map([], |row| Ok((row.get(0)?, row.get(1)?)))
        .unwrap()
        .map(Result::unwrap)
        .collect();
    let set = "UPDATE sqlite_schema SET sql = ?2 WHERE name = ?1 AND type = 'table' AND sql = ?3";
    let loose = |sql: &str| {
        let sql = sql.replace("STRICT, WITHOUT", "WITHOUT").replace("NOT NULL", "");
        sql.strip_suffix(" STRICT").unwrap_or(&sql).to_owned()
    };
    for (name, sql) in &statements {
        conn.execute(set, params![name, loose(sql), sql]).unwrap();
    }
    drop(conn);
    let conn = open();
    change(&conn);
    drop(conn);
    let conn = open();
    for (name, sql) in &statements {
        conn.execute(set, params![name, sql, loose(sql)]).unwrap();
    }
}

/// The kind of damage of a case, and its damage.
fn damage(lab: &Laboratory, case: usize) -> (&'static str, Files) {
    let kinds = OF_PAGES.len() + OF_LOGS.len() + OF_ROWS.len();
    let all = OF_PAGES.iter().chain(&OF_LOGS).chain(&OF_ROWS);
    let (name, damage) = all.clone().nth(case % kinds).unwrap();
    (name, damage(lab, &mut ChaCha8Rng::seed_from_u64(case as u64)))
}

/// Everything that is wrong with what commands do with one damaged database, a line each.
fn judge(lab: &Laboratory, case: usize) -> Vec<String> {
    let (kind, files) = damage(lab, case);
    let folder = lab.folder(&files);
    write_tree(&folder.path().join(SITE), &lab.site);
    let got = answers(folder.path(), &lab.site);
    let mut problems = Vec::new();
    for (name, bytes) in FILES.iter().filter_map(|name| Some((name, files.get(name)?))) {
        if fs::read(folder.path().join(name)).ok().as_ref() != Some(bytes) {
            problems.push(format!("{name} was changed by a command that reads"));
        }
    }
    // A log may hold the last change whole or not: then everything is as it was before that change.
    let alternatives = [&lab.answers, &lab.older_answers];
    let alternatives = &alternatives[..if kind.contains("log") { 2 } else { 1 }];
    // Pages of the earlier state that agree with each other are a sound database of that state.
    let earlier = kind.contains("before").then_some(&lab.older_answers[..]);
    let judged =
        alternatives.iter().map(|expected| (wrong(lab, expected, earlier, &got), *expected));
    let (wrong, expected) = judged.min_by_key(|(wrong, _)| wrong.len()).unwrap();
    problems.extend(wrong);
    problems.extend(wrong_revisions(lab, folder.path()));
    for command in WRITING {
        problems.extend(wrong_writing(lab, &files, command, expected, &got));
    }
    let name = |problem: String| format!("case {case}, {kind}: {problem}");
    problems.into_iter().map(name).collect()
}

/// What is wrong with answers, by those of a sound database, or of an `earlier` one.
fn wrong(
    lab: &Laboratory,
    expected: &[Answer],
    earlier: Option<&[Answer]>,
    got: &[Answer],
) -> Vec<String> {
    let commands = reading();
    let mut wrong = Vec::new();
    let mut other = Vec::new();
    for (place, ((command, expected), got)) in commands.iter().zip(expected).zip(got).enumerate() {
        if earlier.is_some_and(|earlier| got.is_right(&earlier[place])) {
            continue;
        }
        wrong.extend(got.fault().map(|fault| format!("`{command}` {fault}")));
        let is_publication = command.starts_with("publish");
        if got.is_done() && !got.is_right(expected) {
            wrong.push(format!("`{command}` says something else: {}", difference(expected, got)));
        }
        let kept = if is_publication { &lab.site } else { &BTreeMap::new() };
        if !got.is_done() && got.files != *kept {
            let files: Vec<&PathBuf> = got.files.keys().collect();
            wrong.push(format!("`{command}` fails and leaves {files:?}"));
        }
        // This one reads a file without its log, as that of somebody else.
        let is_alone = command.starts_with("verify");
        if command != CHECK && !is_alone && !got.is_same(expected) {
            other.push(command.as_str());
        }
    }
    let is_found = got.last().is_some_and(|check| !check.is_done());
    if !other.is_empty() && !is_found {
        wrong.push(format!(
            "`check` finds nothing, and other answers come from {}",
            other.join(", ")
        ));
    }
    wrong
}

/// The first lines that differ.
fn difference(expected: &Answer, got: &Answer) -> String {
    let squeezed = |answer: &Answer| {
        let text = answer.text();
        let lines = text.lines().map(|line| line.split_whitespace().collect::<Vec<_>>().join(" "));
        lines.collect::<Vec<_>>().join("\n")
    };
    let (before, after) = (squeezed(expected), squeezed(got));
    let mut text = String::new();
    if let Some((old, new)) = before.lines().zip(after.lines()).find(|(old, new)| {
        // What a list calls damaged is no difference.
        old != new && !new.contains(" damaged")
    }) {
        write!(text, "`{}`, not `{}`", new.trim(), old.trim()).unwrap();
    } else if before != after {
        write!(text, "{} lines, not {}", after.lines().count(), before.lines().count()).unwrap();
    }
    for path in expected.files.keys().chain(got.files.keys()).collect::<BTreeSet<_>>() {
        if expected.files.get(path) != got.files.get(path) {
            write!(text, " {} differs", path.display()).unwrap();
        }
    }
    text.chars().take(300).collect()
}

/// Revisions that the library reads as something else.
fn wrong_revisions(lab: &Laboratory, folder: &Path) -> Vec<String> {
    let Ok(Some(store)) = Store::open_existing(folder.join(DATABASE)) else { return Vec::new() };
    let mut wrong = Vec::new();
    for ((slug, number), material) in &lab.revisions {
        if let Ok(Some(stored)) = store.get(slug, Some(*number))
            && stored.material != *material
        {
            wrong.push(format!("`Store::get` of {slug}@{number} gives something else"));
        }
    }
    wrong
}

/// Every command that writes.
const WRITING: [&str; 5] = [
    "add --from new.toml",
    "rm lit-paint",
    "withdraw primer --reason old",
    "check --repair",
    "--db taken.sqlite import matdb.sqlite",
];

/// What a command that writes does wrong.
fn wrong_writing(
    lab: &Laboratory,
    files: &Files,
    command: &str,
    expected: &[Answer],
    got: &[Answer],
) -> Vec<String> {
    let folder = lab.folder(files);
    let at = folder.path();
    let answer = run(at, command, None);
    let mut wrong: Vec<String> = answer.fault().into_iter().collect();
    let show = |name: &str| run(at, &format!("show {name} --json"), None);
    let subject = match command {
        _ if command.starts_with("rm") => REMOVED,
        _ if command.starts_with("withdraw") => WITHDRAWN,
        _ => "",
    };
    for name in NAMES.iter().filter(|name| **name != subject) {
        let shown = format!("show {name} --json");
        let place = reading().iter().position(|command| *command == shown).unwrap();
        let is_intact = got[place].is_done() && got[place].is_same(&expected[place]);
        let after = show(name);
        if is_intact && !after.is_same(&expected[place]) {
            wrong.push(format!(
                "`{name}` was intact and now: {}{}",
                after.stderr,
                difference(&expected[place], &after)
            ));
        }
    }
    if answer.is_done() {
        match command {
            _ if command.starts_with("add") && shown(&show(ADDED)) != lab.added => {
                wrong.push(format!("is done, and `{ADDED}` is not what was added"));
            }
            _ if command.starts_with("rm") && show(REMOVED).is_done() => {
                wrong.push(format!("is done, and `{REMOVED}` is still there"));
            }
            _ if command.starts_with("withdraw")
                && shown(&show(WITHDRAWN))["status"]["is"] != "withdrawn" =>
            {
                wrong.push(format!("is done, and `{WITHDRAWN}` is not withdrawn"));
            }
            "check --repair" => wrong.extend(wrong_repair(lab, at, &answer, expected)),
            _ if command.contains("import") => wrong.extend(wrong_import(lab, at)),
            _ => {}
        }
    }
    wrong.into_iter().map(|what| format!("`{command}`: {what}")).collect()
}

/// What is wrong after a repair that has found everything well.
fn wrong_repair(lab: &Laboratory, at: &Path, repair: &Answer, expected: &[Answer]) -> Vec<String> {
    write_tree(&at.join(SITE), &lab.site);
    let said = repair.text();
    let mut wrong = Vec::new();
    for ((command, expected), got) in reading().iter().zip(expected).zip(&answers(at, &lab.site)) {
        let is_named = NAMES.iter().any(|name| command.contains(name) && is_repaired(&said, name));
        let is_list = !NAMES.iter().any(|name| command.contains(name));
        let is_changed =
            ["has lost its revision", "than was stored"].iter().any(|words| said.contains(words));
        let is_said = is_named || is_changed && is_list;
        if !is_said && !got.is_same(expected) {
            wrong.push(format!(
                "is done, and `{command}` then says something else: {}{}",
                got.stderr,
                difference(expected, got)
            ));
        }
    }
    wrong
}

/// Whether a repair has said that the revisions of a material are not all as they were.
fn is_repaired(said: &str, name: &str) -> bool {
    let of_record = format!("`{name}@");
    said.contains(&format!("`{name}` "))
        || said.lines().any(|line| line.contains(&of_record) && line.contains("than was stored"))
}

/// What is wrong with a database that has taken over the damaged one.
fn wrong_import(lab: &Laboratory, at: &Path) -> Vec<String> {
    let mut wrong = Vec::new();
    let store = Store::open_existing(at.join(TAKEN)).unwrap().unwrap();
    for ((slug, number), material) in &lab.revisions {
        let stored = store.get(slug, Some(*number)).unwrap().map(|stored| stored.material);
        if stored.as_ref() != Some(material) {
            wrong.push(format!("is done, and {slug}@{number} is something else"));
        }
    }
    wrong
}

/// The cases to try.
fn cases() -> Vec<usize> {
    let kinds = OF_PAGES.len() + OF_LOGS.len() + OF_ROWS.len();
    if let Some(case) = std::env::var_os("MATDB_TEST_FAULT") {
        let cases = case.to_str().unwrap().split(',').map(|case| case.parse().unwrap());
        return cases.collect();
    }
    if std::env::var_os("MATDB_TEST_MANY_FAULTS").is_some() {
        return (0..kinds * EACH).collect();
    }
    // A step that shares no factor with the number of kinds meets another kind each time.
    (0..SAMPLE).map(|n| n * 28).collect()
}

#[test]
fn a_damaged_database_gives_right_answers_or_one_sentence() {
    let lab = Laboratory::new();
    let cases = cases();
    let (next, problems) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..2 {
            scope.spawn(|| {
                while let Some(case) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let judged = std::panic::catch_unwind(|| judge(&lab, *case));
                    let found =
                        judged.unwrap_or_else(|_| vec![format!("case {case}: the library panics")]);
                    // A campaign takes minutes: each problem is seen as soon as it is found.
                    found.iter().for_each(|problem| println!("{problem}"));
                    problems.lock().unwrap().extend(found);
                }
            });
        }
    });
    let mut problems = problems.into_inner().unwrap();
    problems.sort();
    assert!(problems.is_empty(), "{} problems:\n{}", problems.len(), problems.join("\n"));
}
