//! A write happens as a whole or not at all: whichever step of SQLite's fails, at whichever
//! statement the process dies, and wherever the write-ahead log is cut off, the database opens
//! again and holds what it held before or what it should hold after.
//!
//! A sample of the faults; `.ci/long faults` tries every statement, and steps four or five times as closely, in minutes.
//!
//! Faults come through SQLite's own hooks, which an automatic extension puts on every connection
//! that the library opens; the library needs no hook for it.

#![allow(unsafe_code)]

mod support;

use std::cell::Cell;
use std::ffi::{c_char, c_int, c_uint, c_void};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Once;

use matdb::catalogue::{CatalogueError, Import};
use matdb::material::{Activity, Material};
use matdb::store::Store;
use rusqlite::ffi;
use support::database::{change, child, contents, given, is_sound, sound, with_effects};
use support::root;

fn changed(slug: &str) -> Material {
    change(with_effects(slug))
}

/// A call that writes.
#[derive(Clone, Copy, Debug)]
enum Write {
    /// Opening a file that is not there.
    Make,
    /// Opening a file of the first schema.
    Migrate,
    /// Adding a material that is not there.
    Add,
    /// Adding a revision.
    Revise,
    /// Removing a material with two revisions.
    Remove,
    /// Taking a material with two revisions, and one more, over from another database.
    Import,
}

const WRITES: [Write; 6] =
    [Write::Make, Write::Migrate, Write::Add, Write::Revise, Write::Remove, Write::Import];

/// A file of the first schema.
fn first_schema() -> PathBuf {
    root().join("tests/fixtures/schema-0001.sqlite")
}

/// The database beside another from which materials are taken over.
fn theirs(ours: &Path) -> PathBuf {
    ours.with_file_name("theirs.sqlite")
}

impl Write {
    /// Makes the database as it is before.
    fn prepare(self, path: &Path) {
        match self {
            Write::Make => return,
            Write::Migrate => {
                fs::copy(first_schema(), path).unwrap();
                return;
            }
            Write::Import => {
                let mut theirs = Store::open(theirs(path)).unwrap();
                theirs.add([&sound("other"), &sound("subject")]).unwrap();
                theirs.add([&change(sound("subject"))]).unwrap();
            }
            _ => {}
        }
        let mut store = Store::open(path).unwrap();
        store.add([&with_effects("bystander")]).unwrap();
        if let Write::Revise | Write::Remove = self {
            store.add([&with_effects("subject")]).unwrap();
        }
        if let Write::Remove = self {
            store.add([&changed("subject")]).unwrap();
        }
    }

    /// Writes; `arm` is called when all that only reads is done.
    fn run(self, path: &Path, arm: impl Fn()) -> Result<(), CatalogueError> {
        if let Write::Import = self {
            let by = Activity { command: "import".to_owned(), inputs: vec![], origin: None };
            let import = Import::open(&theirs(path))?;
            let mut ours = Store::open(path)?;
            let plan = import.plan(Some(&ours), None)?;
            arm();
            return import.take(&mut ours, &plan, &by);
        }
        arm();
        let mut store = Store::open(path)?;
        match self {
            Write::Make | Write::Migrate | Write::Import => {}
            Write::Add => drop(store.add([&with_effects("subject")])?),
            Write::Revise => drop(store.add([&changed("subject")])?),
            Write::Remove => drop(store.remove([&"subject".parse().unwrap()])?),
        }
        Ok(())
    }

    fn before_and_after(self) -> [Vec<Material>; 2] {
        let (bystander, first, second) =
            (with_effects("bystander"), with_effects("subject"), changed("subject"));
        let alone = vec![bystander.clone()];
        match self {
            Write::Make => [vec![], vec![]],
            Write::Migrate => {
                // A copy: readers at the same time may leave a log, and one would stay beside the fixture.
                let folder = tempfile::tempdir().unwrap();
                let copy = folder.path().join("copy.sqlite");
                fs::copy(first_schema(), &copy).unwrap();
                [contents(&copy), contents(&copy)]
            }
            Write::Import => {
                let [other, first] = ["other", "subject"].map(sound);
                [alone, vec![bystander, other, first.clone(), change(first)]]
            }
            Write::Add => [alone, vec![bystander, first]],
            Write::Revise => {
                [vec![bystander.clone(), first.clone()], vec![bystander, first, second]]
            }
            Write::Remove => [vec![bystander, first, second], alone],
        }
    }

    /// Whether the database is sound and holds the state after; fails when it holds neither.
    fn is_done(self, path: &Path, when: &str) -> bool {
        let held = contents(path);
        // What a read-only look leaves alone, the next writer must be able to take over.
        drop(Store::open(path).unwrap());
        assert!(is_sound(path), "{self:?} {when}");
        assert_eq!(contents(path), held, "{self:?} {when}");
        let [before, after] = self.before_and_after();
        assert!(held == before || held == after, "{self:?} {when}: neither before nor after");
        held == after
    }
}

thread_local! {
    /// Steps of SQLite until one fails; negative when none shall.
    static STEPS_LEFT: Cell<i64> = const { Cell::new(-1) };
    /// Statements until the process dies.
    static STATEMENTS_LEFT: Cell<i64> = const { Cell::new(-1) };
}

fn is_due(counter: &'static std::thread::LocalKey<Cell<i64>>) -> bool {
    counter.set(counter.get().max(0) - 1);
    counter.get() == 0
}

extern "C" fn on_step(_: *mut c_void) -> c_int {
    c_int::from(is_due(&STEPS_LEFT))
}

extern "C" fn on_statement(_: c_uint, _: *mut c_void, _: *mut c_void, _: *mut c_void) -> c_int {
    if is_due(&STATEMENTS_LEFT) {
        std::process::abort();
    }
    0
}

unsafe extern "C" fn hook(
    db: *mut ffi::sqlite3,
    _: *mut *mut c_char,
    _: *const ffi::sqlite3_api_routines,
) -> c_int {
    let none = std::ptr::null_mut();
    // SAFETY: SQLite hands over the connection it is opening; the hooks live as long as the process.
    unsafe {
        ffi::sqlite3_progress_handler(db, 1, Some(on_step), none);
        ffi::sqlite3_trace_v2(db, ffi::SQLITE_TRACE_STMT as c_uint, Some(on_statement), none)
    }
}

/// Puts the hooks on every connection opened from now on.
fn hook_connections() {
    static ONCE: Once = Once::new();
    // SAFETY: `hook` neither opens nor closes a connection.
    ONCE.call_once(|| unsafe { rusqlite::auto_extension::register_auto_extension(hook).unwrap() });
}

/// One number for the campaign, or the other for its sample.
fn by_campaign(campaign: usize, sample: usize) -> usize {
    if std::env::var_os("MATDB_TEST_MANY_FAULTS").is_some() { campaign } else { sample }
}

#[test]
fn any_step_may_fail() {
    // A write has some 2000 steps, making a database ten times as many and the others more still. Primes meet loops
    // unevenly.
    let every = |write: Write| match write {
        Write::Make => by_campaign(61, 307),
        Write::Migrate => by_campaign(1009, 4003),
        Write::Import => by_campaign(127, 509),
        Write::Add | Write::Revise | Write::Remove => by_campaign(7, 29),
    };
    hook_connections();
    for write in WRITES {
        let folder = tempfile::tempdir().unwrap();
        let before = folder.path().join("before.sqlite");
        write.prepare(&before);
        let mut refused = 0;
        for step in (1..).step_by(every(write)) {
            let path = folder.path().join("now.sqlite");
            let _ = fs::copy(&before, &path);
            let result = write.run(&path, || STEPS_LEFT.set(step));
            let fired = STEPS_LEFT.replace(-1) < 1;
            if result.is_ok() {
                // Before anybody else brings it up to date.
                let store = Store::open_frozen(&path).unwrap().unwrap();
                assert!(!store.is_of_older_schema(), "{write:?} step {step}: claims to be done");
            }
            let done = write.is_done(&path, &format!("step {step}"));
            assert!(done || result.is_err(), "{write:?} step {step}: claims to be done");
            fs::remove_file(&path).unwrap();
            if !fired {
                result.unwrap();
                break;
            }
            refused += 1;
        }
        let least = match write {
            Write::Migrate | Write::Import => by_campaign(20, 5),
            _ => by_campaign(100, 25),
        };
        assert!(refused > least, "{write:?}: only {refused} steps");
    }
}

#[test]
fn the_process_may_die_at_any_statement() {
    for (index, write) in WRITES.into_iter().enumerate() {
        let folder = tempfile::tempdir().unwrap();
        let before = folder.path().join("before.sqlite");
        write.prepare(&before);
        let mut killed = 0;
        for statement in (1..).step_by(by_campaign(1, 5)) {
            let path = folder.path().join(format!("{statement}.sqlite"));
            let _ = fs::copy(&before, &path);
            let output = child("dying_process", &path)
                .env("MATDB_TEST_WRITE", index.to_string())
                .env("MATDB_TEST_STATEMENT", statement.to_string())
                .output()
                .unwrap();
            let done = write.is_done(&path, &format!("statement {statement}"));
            if output.status.success() {
                assert!(done);
                break;
            }
            killed += 1;
        }
        assert!(killed > by_campaign(10, 2), "{write:?}: only {killed} statements");
    }
}

/// Not a test by itself: the process that `the_process_may_die_at_any_statement` starts.
#[test]
fn dying_process() {
    let Some(path) = given() else { return };
    let number = |name| std::env::var(name).unwrap().parse::<i64>().unwrap();
    hook_connections();
    let arm = || STATEMENTS_LEFT.set(number("MATDB_TEST_STATEMENT"));
    WRITES[number("MATDB_TEST_WRITE") as usize].run(&path, arm).unwrap();
}

#[test]
fn the_log_may_end_anywhere() {
    /// Bytes between cuts: no divisor of a log's frame, so that cuts fall everywhere in it.
    const STEP_BYTES: usize = 1021;
    for write in [Write::Add, Write::Revise, Write::Remove] {
        let folder = tempfile::tempdir().unwrap();
        let (path, log) = (folder.path().join("a.sqlite"), folder.path().join("a.sqlite-wal"));
        write.prepare(&path);
        // A second connection keeps the log from being cleared away when the first is closed.
        let keeper = Store::open(&path).unwrap();
        write.run(&path, || {}).unwrap();
        let (database, whole) = (fs::read(&path).unwrap(), fs::read(&log).unwrap());
        drop(keeper);
        let mut done = Vec::new();
        for length in (0..=whole.len()).step_by(STEP_BYTES).chain([whole.len()]) {
            let cut = folder.path().join(format!("{length}.sqlite"));
            fs::write(&cut, &database).unwrap();
            fs::write(cut.with_extension("sqlite-wal"), &whole[..length]).unwrap();
            done.push(write.is_done(&cut, &format!("log of {length} bytes")));
        }
        assert!(!done[0] && done[done.len() - 1] && done.is_sorted(), "{write:?}: {done:?}");
    }
}
