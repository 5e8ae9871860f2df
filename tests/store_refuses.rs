//! What is not a sound, writable database of ours is refused with one clear sentence that names the
//! file, and what is not ours is left as it was, byte for byte.

#![allow(unsafe_code)]

use std::ffi::{c_char, c_int};
use std::fs::{self, Permissions};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::process::CommandExt;
use std::path::{Path, PathBuf};
use std::process::Command;

use crate::support::database::{bytes, changed, child, contents, given, is_sound, sample};
use matdb::store::{Store, StoreError};
use rusqlite::{Connection, ffi};

/// A folder with a database that holds one material.
fn database() -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("materials.sqlite");
    Store::open(&path).unwrap().add([&sample("subject")]).unwrap();
    (folder, path)
}

/// Checks that an error is one sentence in lower case that names the file.
fn sentence(error: &StoreError, path: &Path) -> String {
    let message = error.to_string();
    assert!(message.contains(path.to_str().unwrap()), "{message}");
    assert!(!message.contains('\n') && !message.ends_with('.'), "{message}");
    message
}

/// Checks that neither way of opening accepts a file or leaves a trace, and gives the messages.
fn refused_untouched(path: &Path) -> Vec<String> {
    let folder = path.parent().unwrap();
    let before = bytes(folder);
    let errors = [Store::open(path).unwrap_err(), Store::open_existing(path).unwrap_err()];
    assert_eq!(bytes(folder), before, "{}", path.display());
    errors.iter().map(|error| sentence(error, path)).collect()
}

#[test]
fn what_is_not_there_is_not_made_by_reading() {
    let folder = tempfile::tempdir().unwrap();
    for path in [folder.path().join("new.sqlite"), folder.path().join("no/such/folder.sqlite")] {
        assert!(Store::open_existing(&path).unwrap().is_none());
    }
    assert!(bytes(folder.path()).is_empty());
}

#[test]
fn an_empty_file_is_a_database_yet_to_be() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("empty.sqlite");
    fs::write(&path, "").unwrap();
    assert!(Store::open_existing(&path).unwrap().is_none());
    assert_eq!(fs::metadata(&path).unwrap().len(), 0);
    Store::open(&path).unwrap().add([&sample("subject")]).unwrap();
    assert_eq!(contents(&path), [sample("subject")]);
}

#[test]
fn reading_leaves_no_trace() {
    let (folder, path) = database();
    let before = bytes(folder.path());
    assert_eq!(contents(&path), [sample("subject")]);
    assert_eq!(bytes(folder.path()), before);
    let mut reader = Store::open_existing(&path).unwrap().unwrap();
    let error = reader.add([&changed("subject")]).unwrap_err();
    assert!(matches!(error, StoreError::ReadOnly { .. }), "{error}");
}

#[test]
fn other_programs_files_are_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let make = |name: &str, sql: &str| {
        let path = folder.path().join(name);
        Connection::open(&path).unwrap().execute_batch(sql).unwrap();
        path
    };
    let table = "CREATE TABLE t (x); INSERT INTO t VALUES (1);";
    let text = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::write(&path, text).unwrap();
        path
    };
    for path in [
        make("plain", table),
        make("logged", &format!("PRAGMA journal_mode = wal; {table}")),
        make("named", &format!("PRAGMA application_id = 7; {table}")),
        make("named-empty", "PRAGMA application_id = 7"),
        make("migrated-empty", "PRAGMA user_version = 1"),
        make("ours-without-schema", "PRAGMA application_id = 0x6d617464"),
        text("a.txt", "a"),
        text("b.txt", &"slug = \"paint\"\n".repeat(1000)),
        text("c.txt", "SQLite format 3\0 is what such files begin with"),
        folder.path().to_owned(),
        "/dev/null".into(),
    ] {
        for message in refused_untouched(&path) {
            assert!(message.contains("is not a matdb database"), "{message}");
        }
    }
}

#[test]
fn a_newer_schema_is_left_alone() {
    let (_folder, path) = database();
    Connection::open(&path).unwrap().pragma_update(None, "user_version", 4711).unwrap();
    for message in refused_untouched(&path) {
        assert!(message.contains("has schema 4711"), "{message}");
    }
}

/// Opens a damaged file and uses it: what it gives must be right or refused as damaged.
fn right_or_damaged(path: &Path, case: &str) -> bool {
    let use_it = || -> Result<(), StoreError> {
        let Some(store) = Store::open_existing(path)? else { return Ok(()) };
        for summary in store.list()? {
            if let Some(stored) = store.get(&summary.slug, None)? {
                assert_eq!(stored.material, sample("subject"), "{case}");
            }
        }
        drop(store);
        Store::open(path)?.remove([&"subject".parse().unwrap()]).map(drop)
    };
    let Err(error) = use_it() else { return false };
    let message = sentence(&error, path);
    let known = matches!(
        error,
        StoreError::Corrupt { .. } | StoreError::CutOff { .. } | StoreError::Foreign { .. }
    );
    assert!(known, "{case}: {message}");
    true
}

#[test]
fn damage_is_noticed_and_named() {
    let (folder, path) = database();
    let whole = fs::read(&path).unwrap();
    let hurt = folder.path().join("hurt.sqlite");
    let mut noticed = 0;
    // A prime, so that the places fall everywhere in pages.
    for place in (0..whole.len()).step_by(389) {
        for (length, mask) in [(1, 0x10), (64, 0xff)] {
            let mut damaged = whole.clone();
            damaged[place..].iter_mut().take(length).for_each(|byte| *byte ^= mask);
            fs::write(&hurt, damaged).unwrap();
            let case = format!("{length} bytes at {place}");
            noticed += usize::from(right_or_damaged(&hurt, &case));
        }
    }
    assert!(noticed > 20, "only {noticed} noticed");
    for length in (1..whole.len()).step_by(1021) {
        fs::write(&hurt, &whole[..length]).unwrap();
        assert!(right_or_damaged(&hurt, &format!("cut to {length} bytes")));
    }
}

#[test]
fn a_value_changed_behind_our_back_is_noticed() {
    let (_folder, path) = database();
    let sql = "UPDATE fit_parameter SET value = value / 2 WHERE position = 0";
    Connection::open(&path).unwrap().execute_batch(sql).unwrap();
    let store = Store::open(&path).unwrap();
    let error = store.get(&"subject".parse().unwrap(), None).unwrap_err();
    assert!(sentence(&error, &path).contains("revision 1 of `subject` is not what was stored"));
}

#[test]
fn a_locked_database_is_said_to_be_in_use() {
    let (_folder, path) = database();
    let other = Connection::open(&path).unwrap();
    other.execute_batch("BEGIN IMMEDIATE").unwrap();
    let error = Store::open(&path).unwrap().add([&changed("subject")]).unwrap_err();
    assert!(sentence(&error, &path).contains("in use by another program"));
    // Who only reads does not wait for who writes.
    assert_eq!(contents(&path), [sample("subject")]);
    other.execute_batch("COMMIT").unwrap();
    Store::open(&path).unwrap().add([&changed("subject")]).unwrap();
    assert_eq!(contents(&path), [sample("subject"), changed("subject")]);
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("file"), "").unwrap();
    for (name, reason) in [("none/x.sqlite", "No such file"), ("file/x.sqlite", "Not a directory")]
    {
        let path = folder.path().join(name);
        let message = sentence(&Store::open(&path).unwrap_err(), &path);
        assert!(message.contains(reason), "{message}");
    }
}

/// The child as a user without rights; as ourselves when we have none to give up.
fn powerless(test: &str, path: &Path) -> Command {
    /// By custom the user `nobody`.
    const NOBODY: u32 = 65534;
    let mut command = child(test, path);
    if fs::metadata("/proc/self").is_ok_and(|own| own.uid() == 0) {
        command.uid(NOBODY).gid(NOBODY);
    }
    command
}

#[test]
fn what_may_not_be_written_is_still_read() {
    let (folder, path) = database();
    let allow =
        |path: &Path, mode| fs::set_permissions(path, Permissions::from_mode(mode)).unwrap();
    allow(&path, 0o444);
    allow(folder.path(), 0o555);
    let before = bytes(folder.path());
    match powerless("reader_without_rights", &path).output() {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        }
        Err(error) => eprintln!("skipped: no process without rights can be started: {error}"),
    }
    assert_eq!(bytes(folder.path()), before);
    // Nor is anything left where something could be: the owner could not write it.
    allow(folder.path(), 0o777);
    for mode in [0o444, 0o644] {
        allow(&path, mode);
        match powerless("reader_beside_a_file_of_others", &path).output() {
            Ok(output) => {
                assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
            }
            Err(error) => eprintln!("skipped: no process without rights can be started: {error}"),
        }
        assert_eq!(bytes(folder.path()), before, "{mode:o}");
    }
    allow(&path, 0o644);
    Store::open(&path).unwrap().add([&changed("subject")]).unwrap();
    // While somebody writes, what is read is of the last moment that was finished.
    let writer = Store::open(&path).unwrap();
    match powerless("reader_beside_a_writer", &path).output() {
        Ok(output) => {
            assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
        }
        Err(error) => eprintln!("skipped: no process without rights can be started: {error}"),
    }
    drop(writer);
}

/// Not a test by itself: a process that `what_may_not_be_written_is_still_read` starts.
#[test]
fn reader_beside_a_file_of_others() {
    let Some(path) = given() else { return };
    assert_eq!(contents(&path), [sample("subject")]);
    let error = Store::open(&path).unwrap_err();
    assert!(matches!(error, StoreError::ReadOnly { .. }), "{error}");
}

/// Not a test by itself: a process that `what_may_not_be_written_is_still_read` starts.
#[test]
fn reader_beside_a_writer() {
    let Some(path) = given() else { return };
    assert_eq!(contents(&path), [sample("subject"), changed("subject")]);
    // What lies beside it is not ours, and is named.
    let said = Store::open(&path).unwrap_err().to_string();
    assert!(
        said.contains("materials.sqlite-wal and ") && said.contains("materials.sqlite-shm"),
        "{said}"
    );
}

/// Not a test by itself: the process that `what_may_not_be_written_is_still_read` starts.
#[test]
fn reader_without_rights() {
    let Some(path) = given() else { return };
    assert_eq!(contents(&path), [sample("subject")]);
    let error = Store::open(&path).unwrap_err();
    assert!(matches!(error, StoreError::ReadOnly { .. }), "{error}");
    let new = path.with_file_name("new.sqlite");
    let error = Store::open(&new).unwrap_err();
    assert!(sentence(&error, &new).contains("permission denied"), "{error}");
}

#[test]
fn a_file_that_may_not_grow_is_left_as_it_was() {
    let (folder, path) = database();
    let mut refused = 0;
    for blocks in 0.. {
        let now = folder.path().join(format!("{blocks}.sqlite"));
        fs::copy(&path, &now).unwrap();
        let inner = child("store_refuses::writer_without_room", &now);
        let output = Command::new("sh")
            .args(["-c", "trap '' XFSZ; ulimit -f $0; exec \"$@\"", &blocks.to_string()])
            .arg(inner.get_program())
            .args(inner.get_args())
            .env("MATDB_TEST_FILE", &now)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{blocks} blocks: {said}");
        assert!(is_sound(&now));
        if said.contains("all is written") {
            assert_eq!(contents(&now), [sample("subject"), changed("subject")]);
            break;
        }
        assert_eq!(contents(&now), [sample("subject")], "{blocks} blocks");
        refused += 1;
    }
    assert!(refused > 10, "only {refused} limits were met");
}

/// Not a test by itself: the process that `a_file_that_may_not_grow_is_left_as_it_was` starts.
#[test]
fn writer_without_room() {
    let Some(path) = given() else { return };
    match Store::open(&path).and_then(|mut store| store.add([&changed("subject")])) {
        Ok(_) => println!("all is written"),
        Err(error @ StoreError::Disk { .. }) => println!("{}", sentence(&error, &path)),
        Err(error) => panic!("{error}"),
    }
}

/// Pages that a database may have in `crowded_process`.
const PAGES: &str = "PRAGMA max_page_count = 40";

unsafe extern "C" fn limit_pages(
    db: *mut ffi::sqlite3,
    _: *mut *mut c_char,
    _: *const ffi::sqlite3_api_routines,
) -> c_int {
    // SAFETY: SQLite hands over the connection it is opening; the handle made of it does not own it.
    let limited = unsafe { Connection::from_handle(db) }
        .and_then(|conn| conn.query_row(PAGES, [], |_| Ok(())));
    c_int::from(limited.is_err())
}

#[test]
fn a_full_disk_is_named_and_nothing_is_changed() {
    let (_folder, path) = database();
    let output = child("store_refuses::crowded_process", &path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    assert!(is_sound(&path));
}

/// Not a test by itself: the process that `a_full_disk_is_named_and_nothing_is_changed` starts, as
/// an automatic extension holds for a whole process.
#[test]
fn crowded_process() {
    let Some(path) = given() else { return };
    // SAFETY: `limit_pages` neither opens nor closes a connection.
    unsafe { rusqlite::auto_extension::register_auto_extension(limit_pages).unwrap() };
    let mut store = Store::open(&path).unwrap();
    let (error, before) = (0..)
        .find_map(|number| {
            let before = contents(&path);
            store.add([&sample(&format!("more-{number}"))]).err().map(|error| (error, before))
        })
        .unwrap();
    assert!(sentence(&error, &path).contains("no room left"), "{error}");
    assert_eq!(contents(&path), before);
}

#[test]
fn a_write_that_was_cut_short_is_taken_back_by_who_writes_and_left_alone_by_who_reads() {
    let folder = tempfile::tempdir().unwrap();
    let [path, cut] = ["a.sqlite", "cut.sqlite"].map(|name| folder.path().join(name));
    Store::open(&path).unwrap().add([&sample("paint")]).unwrap();
    Store::open_existing(&path).unwrap().unwrap().copy_to(&cut).unwrap();
    let journal = |path: &Path| path.with_extension("sqlite-journal");
    // Its head alone: cut short before the first page was changed.
    let whole = fs::read(&cut).unwrap();
    let page = u32::from(u16::from_be_bytes([whole[16], whole[17]]));
    let mut head = vec![0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];
    for number in [0, 0, whole.len() as u32 / page, 512, page] {
        head.extend(number.to_be_bytes());
    }
    head.resize(512, 0);
    fs::write(journal(&cut), head).unwrap();
    let before = [fs::read(&cut).unwrap(), fs::read(journal(&cut)).unwrap()];
    let error = Store::open_existing(&cut).unwrap_err();
    assert!(matches!(error, StoreError::Interrupted { .. }), "{error}");
    assert_eq!(before, [fs::read(&cut).unwrap(), fs::read(journal(&cut)).unwrap()]);
    drop(Store::open(&cut).unwrap());
    assert!(!journal(&cut).exists());
    let read = Store::open_existing(&cut).unwrap().unwrap();
    assert_eq!(
        read.get(&"paint".parse().unwrap(), None).unwrap().unwrap().material,
        sample("paint")
    );
}
