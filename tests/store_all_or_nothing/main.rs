//! A write happens as a whole or not at all: whichever step of SQLite's or call of the file system fails, at whichever
//! statement the process dies or change of the disk the power is cut, and wherever the write-ahead log is cut off, the
//! database opens again and holds what it held before or what it should hold after. A command that reads gives the
//! right answer or an error.
//!
//! A sample of the faults; `.ci/long faults` tries every statement, call and change, and steps four or five times as
//! closely.
//!
//! Faults come through SQLite's own hooks, which an automatic extension puts on every connection that the library
//! opens, and through a file system of SQLite's. The library needs no hook for them.

#![allow(unsafe_code)]

mod disk;
mod disk_faults;
#[path = "../support/mod.rs"]
mod support;
mod writes;

use std::cell::Cell;
use std::ffi::{c_char, c_int, c_uint, c_void};
use std::fs;
use std::sync::Once;

use matdb::store::Store;
use rusqlite::ffi;
use support::database::{child, given};
use writes::{WRITES, Write, by_campaign};

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

#[test]
fn any_step_may_fail() {
    // A write has some 2000 steps, making a database ten times as many and the others more still. Primes meet loops
    // unevenly.
    let every = |write: Write| match write {
        Write::Make => by_campaign(61, 307),
        Write::Migrate => by_campaign(1009, 4003),
        Write::Import => by_campaign(127, 509),
        Write::Add | Write::Revise | Write::Withdraw | Write::Remove => by_campaign(7, 29),
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
