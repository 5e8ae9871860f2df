//! How fast a large database is filled and searched, against SQLite alone.
//!
//! `cargo bench --bench store -- 100000` fills a database with that many materials, a curve of 90 rows
//! each (2000 without a number), and prints one line per measurement. Filling is compared with prepared
//! statements that insert the very same rows into the same schema, in the same run: the ratio says
//! something on any machine, the times only on one. A further argument `publish` publishes it, too, twice:
//! that takes long and much room on the disk; with `json` every line is JSON.

use std::fs;
use std::hint::black_box;
use std::path::Path;
use std::process::{Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use matdb::catalogue::{Probe, Rank};
use matdb::material::{Censor, Curve, Material, Observation, SourceKind, builtin};
use matdb::store::{Filter, Store, StoreError};
use rusqlite::types::Value;
use rusqlite::{Connection, params_from_iter};

const ROWS: usize = 90;
/// Different materials; the others repeat them under other names.
const KINDS: usize = 50;
/// Words of names, so that a search finds some and not all.
const WORDS: [&str; 10] =
    ["amber", "birch", "copper", "denim", "ebony", "felt", "granite", "hemp", "ivory", "jute"];

fn main() {
    let number = std::env::args().skip(1).find_map(|argument| argument.parse().ok());
    let number: usize = number.unwrap_or(2000);
    let folder = tempfile::tempdir().unwrap();
    let [ours, raw] = ["ours.sqlite", "raw.sqlite"].map(|name| folder.path().join(name));
    tell("materials", number as f64, "", None);
    tell("rows each", ROWS as f64, "", None);
    let filled = fill(&ours, number).as_secs_f64();
    tell("bulk import", filled, "s", None);
    tell("bulk import, each", filled * 1e6 / number as f64, "us", None);
    let alone = replay(&ours, &raw, number).as_secs_f64();
    tell("the same rows, SQLite alone", alone, "s", None);
    tell("the same rows, SQLite alone, each", alone * 1e6 / number as f64, "us", None);
    tell("bulk import over SQLite alone", filled / alone, "", Some(1.5));
    tell("size", fs::metadata(&ours).unwrap().len() as f64 / 1e6, "MB", None);
    opening(folder.path(), &ours);
    let store = Store::open_existing(&ours).unwrap().unwrap();
    look_up(&store, number);
    filters(&store);
    processes(&ours);
    if std::env::args().any(|argument| argument == "publish") {
        let site = folder.path().join("site");
        publishing(&ours, &site, "publish");
        publishing(&ours, &site, "publish again");
    }
}

/// One measurement, with what it should stay below.
fn tell(what: &str, value: f64, unit: &str, goal: Option<f64>) {
    if std::env::args().any(|argument| argument == "json") {
        let line = serde_json::json!({ "what": what, "value": value, "unit": unit, "goal": goal });
        println!("{line}");
        return;
    }
    let digits = if value < 10.0 { 2 } else { 0 };
    let goal = goal.map_or(String::new(), |goal| format!(" (goal: {goal})"));
    println!("{what}: {value:.digits$} {unit}{goal}");
}

/// The material of this number, alike but for names, classes, tags, frequency and levels.
fn material(number: usize) -> Material {
    let mut material = builtin::get("mannequin-paint").unwrap().unwrap();
    let word = WORDS[number % WORDS.len()];
    material.slug = format!("material-{number:06}").parse().unwrap();
    material.name = format!("{word} sample no{number}");
    material.class = format!("class-{}", number % 1000);
    material.tags = vec![word.to_owned(), format!("tag-{}", number % 2000)];
    if number.is_multiple_of(500) {
        material.frequency_hz = [75e9, 110e9];
    }
    vary(&mut material, number);
    let observation = |row: usize| Observation {
        theta_i_rad: (row as f64).to_radians(),
        theta_r_rad: (row as f64).to_radians(),
        delta_phi_rad: 0.0,
        sigma0: Some(1.0 / (1.0 + (row * (number % KINDS + 1)) as f64)),
        censor: Censor::None,
        threshold_sigma0: Some(1e-6),
        theta_sd_rad: Some(0.01),
        power_w: Some(1e-10),
        range_m: Some(8.0),
        chirp: Some(row as u32),
        target_m: None,
    };
    material.curves = vec![Curve {
        name: "scan".to_owned(),
        source: material.sources[0].key.clone(),
        instrument: None,
        session: None,
        illumination: Default::default(),
        observations: (0..ROWS).map(observation).collect(),
    }];
    material
}

/// Another lobe and another tail for each, so that no two scatter alike.
fn vary(material: &mut Material, number: usize) {
    let share = |period: usize| (number % period) as f64 / period as f64;
    for fit in &mut material.fits {
        fit.covariance = None;
        for (path, value) in [
            ("specular.m", 0.02 + 0.4 * share(97)),
            ("diffuse.r_s", 0.01 + 0.9 * share(89)),
            ("diffuse.alpha", 0.5 + 5.0 * share(83)),
        ] {
            fit.model.set_parameter(path, value);
        }
    }
}

fn fill(path: &Path, number: usize) -> Duration {
    let mut store = Store::open(path).unwrap();
    // To make a material is no work of the database.
    let mut made = Duration::ZERO;
    let start = Instant::now();
    let materials = (0..number).map(|number| {
        let start = Instant::now();
        let material = material(number);
        made += start.elapsed();
        Ok::<_, StoreError>(material)
    });
    store.add_each(materials, |_, _| Ok::<_, StoreError>(())).unwrap();
    start.elapsed() - made
}

/// What it takes before the first question: no file yet, and one that is there.
fn opening(folder: &Path, ours: &Path) {
    let new = |turn: usize| folder.join(format!("new-{turn}.sqlite"));
    let made = median_us(21, |turn| drop(Store::open(new(turn)).unwrap()));
    tell("open a new database and migrate", made / 1e3, "ms", Some(5.0));
    let opened = median_us(21, |_| drop(Store::open(ours).unwrap()));
    tell("open to write", opened / 1e3, "ms", Some(5.0));
    let opened = median_us(21, |_| drop(Store::open_existing(ours).unwrap()));
    tell("open to read", opened / 1e3, "ms", Some(5.0));
}

/// A table's rows of one material, and where the numbers of material and revision stand in them.
struct Rows {
    sql: String,
    rows: Vec<Vec<Value>>,
    numbers: Vec<usize>,
    slug: Option<usize>,
}

/// Inserts the rows of every material again with prepared statements alone.
fn replay(from: &Path, to: &Path, number: usize) -> Duration {
    drop(Store::open(to).unwrap());
    let from = Connection::open(from).unwrap();
    let kinds: Vec<Vec<Rows>> =
        (0..KINDS.min(number)).map(|kind| rows(&from, kind as i64 + 1)).collect();
    let mut to = Connection::open(to).unwrap();
    to.set_prepared_statement_cache_capacity(64);
    let mut prepared = Duration::ZERO;
    let start = Instant::now();
    let tx = to.transaction().unwrap();
    for place in 0..number {
        let id = Value::Integer(place as i64 + 1);
        for table in &kinds[place % kinds.len()] {
            let mut statement = tx.prepare_cached(&table.sql).unwrap();
            for row in &table.rows {
                let begin = Instant::now();
                let mut row = row.clone();
                table.numbers.iter().for_each(|&column| row[column] = id.clone());
                if let Some(column) = table.slug {
                    row[column] = Value::Text(format!("material-{place:06}"));
                }
                prepared += begin.elapsed();
                statement.execute(params_from_iter(row)).unwrap();
            }
        }
    }
    tx.commit().unwrap();
    start.elapsed() - prepared
}

/// The rows of one material in every table that has some.
fn rows(conn: &Connection, id: i64) -> Vec<Rows> {
    let tables = [
        ("material", "id"),
        ("revision", "material_id"),
        ("source", "revision_id"),
        ("instrument", "revision_id"),
        ("permittivity", "revision_id"),
        ("layer", "revision_id"),
        ("roughness", "revision_id"),
        ("curve", "revision_id"),
        ("observation", "revision_id"),
        ("curve_statistic", "revision_id"),
        ("fit", "revision_id"),
        ("fit_parameter", "revision_id"),
        ("fit_covariance", "revision_id"),
        ("entry", "material_id"),
        ("search", "rowid"),
    ];
    let mut found: Vec<Rows> =
        tables.iter().map(|(table, key)| table_rows(conn, table, key, id)).collect();
    found.extend(["entry_tag", "outline"].map(|table| by_slug(conn, table, id)));
    found.retain(|table| !table.rows.is_empty());
    found
}

fn table_rows(conn: &Connection, table: &str, key: &str, id: i64) -> Rows {
    let what = if table == "search" { "rowid, *" } else { "*" };
    read(conn, table, &format!("SELECT {what} FROM {table} WHERE {key} = ?1"), id)
}

fn by_slug(conn: &Connection, table: &str, id: i64) -> Rows {
    let of = "slug = (SELECT slug FROM material WHERE id = ?1)";
    read(conn, table, &format!("SELECT * FROM {table} WHERE {of}"), id)
}

fn read(conn: &Connection, table: &str, sql: &str, id: i64) -> Rows {
    let mut statement = conn.prepare(sql).unwrap();
    let columns: Vec<String> = statement.column_names().iter().map(|&n| n.to_owned()).collect();
    let count = columns.len();
    let rows = statement
        .query_map([id], |row| (0..count).map(|column| row.get(column)).collect())
        .unwrap()
        .map(Result::unwrap)
        .collect();
    let marks = vec!["?"; count].join(", ");
    let is_number =
        |name: &&String| matches!(name.as_str(), "material_id" | "revision_id" | "rowid" | "id");
    let place = |name: &String| columns.iter().position(|other| other == name);
    Rows {
        sql: format!("INSERT INTO {table} ({}) VALUES ({marks})", columns.join(", ")),
        rows,
        numbers: columns.iter().filter(is_number).filter_map(place).collect(),
        slug: columns.iter().position(|name| name == "slug"),
    }
}

/// Lines that a list shows.
const PAGE: u32 = 200;

/// Median time of a call, us.
fn median_us(times: usize, mut call: impl FnMut(usize)) -> f64 {
    let mut each: Vec<f64> = (0..times)
        .map(|turn| {
            let start = Instant::now();
            call(turn);
            start.elapsed().as_secs_f64() * 1e6
        })
        .collect();
    each.sort_by(f64::total_cmp);
    each[each.len() / 2]
}

fn look_up(store: &Store, number: usize) {
    let slug = |turn: usize| format!("material-{:06}", turn * 7919 % number).parse().unwrap();
    let line = median_us(2000, |turn| drop(black_box(store.summary(&slug(turn)).unwrap())));
    tell("look-up by name", line, "us", Some(20.0));
    let rendered = median_us(2000, |turn| drop(black_box(store.rendered(&slug(turn)).unwrap())));
    tell("what scenes render of a name", rendered, "us", None);
    let whole = median_us(500, |turn| drop(black_box(store.get(&slug(turn), None).unwrap())));
    tell("a whole material with its rows and hash", whole, "us", None);
}

fn filters(store: &Store) {
    let any = Filter::default;
    for (what, filter) in [
        ("class", Filter { class: Some("class-7".to_owned()), ..any() }),
        ("tag", Filter { tag: Some("tag-7".to_owned()), ..any() }),
        ("frequency", Filter { frequency_hz: Some(100e9), ..any() }),
        ("kind", Filter { kind: Some(SourceKind::Literature), ..any() }),
        (
            "kind and frequency",
            Filter { kind: Some(SourceKind::Synthetic), frequency_hz: Some(300e9), ..any() },
        ),
        (
            "class and frequency",
            Filter { class: Some("class-7".to_owned()), frequency_hz: Some(300e9), ..any() },
        ),
        ("nothing", any()),
    ] {
        let found = store.find(&filter).unwrap().len();
        let time = median_us(21, |_| drop(black_box(store.page(&filter, PAGE).unwrap())));
        let what = format!("filter by {what}, at most {PAGE} of {found}");
        tell(&what, time, "us", Some(1000.0));
    }
    let time = median_us(5, |_| drop(black_box(store.list().unwrap())));
    tell("all lines", time / 1e3, "ms", None);
    let own = store.get(&"material-000007".parse().unwrap(), None).unwrap().unwrap();
    let probe = Probe::new(&own.material.curves[0].observations).unwrap();
    for rank in [Rank::Level, Rank::Shape] {
        let time =
            median_us(5, |_| drop(black_box(probe.nearest(store, &any(), rank, 10).unwrap())));
        tell(&format!("nearest of all by {rank:?}"), time / 1e3, "ms", None);
    }
    for words in ["no77", "amber no1", "amber", "paint"] {
        let found = store.search(words, &Filter::default(), u32::MAX).unwrap().len();
        let time = median_us(21, |_| {
            drop(black_box(store.search(words, &Filter::default(), 20).unwrap()))
        });
        tell(&format!("full text `{words}`, 20 of {found}"), time, "us", Some(1000.0));
    }
}

/// Commands as a person runs them. The goal is that of listings: all materials as JSON take as long as they
/// are, and `near` reads every curve.
fn processes(path: &Path) {
    for arguments in [
        vec!["list", "--class", "class-7"],
        vec!["search", "no77"],
        vec!["list"],
        vec!["list", "--json"],
        vec!["list", "--frequency", "100"],
        vec!["list", "--kind", "literature"],
        vec!["list", "--kind", "synthetic", "--frequency", "300"],
        vec!["list", "--class", "no-such-class"],
        vec!["search", "paint"],
        vec!["search", "amber", "no1"],
        vec!["search", "mate"],
        vec!["near", "--material", "material-000007"],
        vec!["near", "--material", "material-000007", "--shape"],
        vec!["near", "--material", "material-000007", "--frequency", "300"],
        vec!["near", "--material", "material-000007", "--class", "class-7"],
    ] {
        let time = median_us(5, |_| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_matdb"));
            assert!(
                command.args(&arguments).arg("--db").arg(path).output().unwrap().status.success()
            );
        });
        let is_listing = arguments[0] != "near" && arguments != ["list", "--json"];
        let goal = is_listing.then_some(50.0);
        tell(&format!("matdb {}", arguments.join(" ")), time / 1e3, "ms", goal);
    }
}

/// Publishes as a person does, and watches the memory.
fn publishing(path: &Path, site: &Path, what: &str) {
    let start = Instant::now();
    let mut command = Command::new(env!("CARGO_BIN_EXE_matdb"));
    let command = command.arg("publish").arg(site).arg("--db").arg(path);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    let status = format!("/proc/{}/status", child.id());
    let mut peak_mib = None;
    let ended = loop {
        peak_mib = fs::read_to_string(&status).ok().and_then(|text| high_mib(&text)).or(peak_mib);
        match child.try_wait().unwrap() {
            Some(ended) => break ended,
            None => thread::sleep(Duration::from_millis(20)),
        }
    };
    assert!(ended.success());
    let (files, bytes) = size(site);
    tell(what, start.elapsed().as_secs_f64(), "s", None);
    if let Some(peak_mib) = peak_mib {
        tell(&format!("{what}, memory"), peak_mib, "MiB", Some(500.0));
    }
    tell(&format!("{what}, files"), files as f64, "", None);
    tell(&format!("{what}, size"), bytes as f64 / 1e6, "MB", None);
}

/// The most memory that a process ever had, as Linux tells it.
fn high_mib(status: &str) -> Option<f64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.split_whitespace().next()?.parse().ok().map(|kib: f64| kib / 1024.0)
}

/// Number of files below a folder, and their bytes.
fn size(folder: &Path) -> (usize, u64) {
    fs::read_dir(folder)
        .unwrap()
        .map(|entry| match entry.unwrap() {
            entry if entry.file_type().unwrap().is_dir() => size(&entry.path()),
            entry => (1, entry.metadata().unwrap().len()),
        })
        .fold((0, 0), |(files, bytes), (more, longer)| (files + more, bytes + longer))
}
