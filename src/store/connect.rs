//! Opens a database file: recognises files of other programs without changing them, and migrates older schemas.

use std::fs;
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant, SystemTime};

use rusqlite::backup::{Backup, StepResult};
use rusqlite::config::DbConfig;
use rusqlite::functions::FunctionFlags;
use rusqlite::{Connection, ErrorCode, OpenFlags, Transaction, TransactionBehavior};
use rusqlite_migration::{M, Migrations};

use super::error::{InFile, StoreError, is_damage, reason};
use super::find::outline;
use super::latest::{LATEST, LATEST_SCHEMA};
use super::pages::{check_pages, stated_bytes, torn_revisions};
use super::rows::rows;
use super::tables::schema;
use super::{record, write};
use crate::files::folder_of;

/// "matd" in the file's header.
const APPLICATION_ID: i64 = 0x6d61_7464;

/// Every migration, oldest first. Append only: users have files of every schema.
/// `fill` computes what older programs did not store. It runs at the latest schema, the only one that this program
/// reads and writes.
fn schemas(fill: Backlog) -> [M<'static>; LATEST] {
    [
        M::up(include_str!("../../migrations/0001_materials.sql")),
        M::up(include_str!("../../migrations/0002_fits.sql")),
        M::up(include_str!("../../migrations/0003_effects.sql")),
        M::up(include_str!("../../migrations/0004_catalogue.sql")),
        M::up(include_str!("../../migrations/0005_search.sql")),
        M::up(include_str!("../../migrations/0006_outline.sql")),
        M::up(include_str!("../../migrations/0007_attribution.sql")),
        M::up(include_str!("../../migrations/0008_origin_author.sql")),
        M::up(include_str!("../../migrations/0009_held_out.sql")),
        M::up(include_str!("../../migrations/0010_four_letters.sql")),
        M::up(include_str!("../../migrations/0011_one_value.sql")),
        M::up(include_str!("../../migrations/0012_beam_of_a_curve.sql")),
        M::up(include_str!("../../migrations/0013_levels_of_a_curve.sql")),
        M::up(include_str!("../../migrations/0014_identified.sql")),
        M::up_with_hook(
            include_str!("../../migrations/0015_record.sql"),
            move |tx: &Transaction| Ok(fill.run(tx)?),
        ),
        M::up(include_str!("../../migrations/0016_as_typed.sql")),
    ]
}

/// What a file of an older schema lacks and this program computes.
#[derive(Clone)]
struct Backlog {
    /// The schema of the file.
    schema: usize,
    /// Revisions with rows on damaged pages, which are not read.
    torn: Vec<i64>,
}

impl Backlog {
    /// First schema whose fits keep each value once.
    const ONE_VALUE: usize = 11;
    /// First schema whose outlines end where a curve's points do.
    const OUTLINES: usize = 7;

    fn run(&self, tx: &Transaction) -> rusqlite::Result<()> {
        if self.schema < Backlog::ONE_VALUE {
            write::bring_fits_to_one_value(tx, &self.torn)?;
        }
        if self.schema < Backlog::OUTLINES {
            outline::fill(tx, &self.torn)?;
        }
        write::fill_statistics(tx, &self.torn)?;
        record::fill(tx, &self.torn)
    }
}

/// Tables that migrations make and remove.
const PASSING: [&str; 2] = ["kept", "kept_parameter"];

/// Makes a backup copy the whole database in one step.
const ALL_PAGES: i32 = -1;

/// How long to wait while another program writes.
const PATIENCE: Duration = Duration::from_secs(5);

/// Opens a database for reading and writing; makes it when there is none.
pub(super) fn writable(path: &Path) -> Result<Connection, StoreError> {
    retry_while_busy(|| open_writable(path))
}

/// Opens a database for reading; `None` when there is none, or none with tables.
pub(super) fn readable(path: &Path) -> Result<Option<Connection>, StoreError> {
    retry_while_busy(|| open_readable(path))
}

/// Opens a file that no program writes, such as a published database. Ignores logs and journals next to it, so that
/// they cannot make SQLite write or remove anything.
pub(super) fn frozen(path: &Path) -> Result<Option<Connection>, StoreError> {
    if size_bytes(path)? == 0 {
        return Ok(None);
    }
    let conn = open_immutable(path).in_file(path)?;
    conn.pragma_update(None, "query_only", true).in_file(path)?;
    at_latest_schema(path, conn)
}

/// An empty database of the latest schema in memory.
pub(super) fn in_memory() -> Result<Connection, StoreError> {
    let path = Path::new(":memory:");
    let mut conn = Connection::open_in_memory().in_file(path)?;
    configure(&conn).in_file(path)?;
    migrate(path, &mut conn)?;
    Ok(conn)
}

/// Retries while another program is busy. SQLite itself does not wait where two programs could wait for each other,
/// for example when both turn on the log of a new file.
fn retry_while_busy<T>(open: impl Fn() -> Result<T, StoreError>) -> Result<T, StoreError> {
    let start = Instant::now();
    loop {
        match open() {
            Err(StoreError::Busy { .. }) if start.elapsed() < PATIENCE => {
                std::thread::sleep(Duration::from_millis(5));
            }
            result => return result,
        }
    }
}

fn open_writable(path: &Path) -> Result<Connection, StoreError> {
    // A file of another program is never opened for writing.
    if size_bytes(path)? == 0 {
        check_not_lost(path)?;
    } else {
        match open_unchanged(path) {
            // An interrupted write of matdb. SQLite rolls it back when it opens the file.
            Err(StoreError::Interrupted { .. }) if !names_another_file(path) => {
                check_admissible(path, &open_immutable(path).in_file(path)?)?;
            }
            conn => check_admissible(path, &conn?)?,
        }
    }
    let flags = OpenFlags::SQLITE_OPEN_READ_WRITE | OpenFlags::SQLITE_OPEN_CREATE;
    let mut conn = connect(path, flags).in_file(path)?;
    if conn.is_readonly("main").in_file(path)? {
        return Err(StoreError::read_only(path));
    }
    // A new file begins with a rollback journal. Were its removal lost when the power fails, a later reader would undo
    // with it what the log has brought since (sqlite.org/pragma.html, "EXTRA").
    conn.pragma_update(None, "synchronous", "extra").in_file(path)?;
    conn.pragma_update(None, "journal_mode", "wal").in_file(path)?;
    // Two writers that both begin with reading would block each other.
    conn.set_transaction_behavior(TransactionBehavior::Immediate);
    migrate(path, &mut conn)?;
    Ok(conn)
}

fn open_readable(path: &Path) -> Result<Option<Connection>, StoreError> {
    if size_bytes(path)? == 0 {
        return check_not_lost(path).map(|()| None);
    }
    at_latest_schema(path, open_unchanged(path)?)
}

/// The connection itself, or for an older schema one to a migrated copy in memory. `None` without tables.
fn at_latest_schema(path: &Path, conn: Connection) -> Result<Option<Connection>, StoreError> {
    match schema_of(path, &conn)? {
        0 => Ok(None),
        schema if schema < LATEST => migrated_copy(path, &conn).map(Some),
        _ => Ok(Some(conn)),
    }
}

/// Refuses a file of another program, of a newer schema, or with unknown triggers: those would run whenever matdb
/// writes.
fn check_admissible(path: &Path, conn: &Connection) -> Result<(), StoreError> {
    schema_of(path, conn)?;
    let strangers = unknown_triggers(conn).in_file(path)?;
    match strangers.into_iter().next() {
        None => Ok(()),
        Some(name) => Err(StoreError::Trigger { file: path.to_owned(), name }),
    }
}

/// Names of triggers that are not in the schema of matdb.
fn unknown_triggers(conn: &Connection) -> rusqlite::Result<Vec<String>> {
    let sql = "SELECT name, sql FROM sqlite_schema WHERE type = 'trigger'";
    let triggers: Vec<(String, String)> =
        rows(conn, sql, [], |row| Ok((row.get(0)?, row.get(1)?)))?;
    let strangers =
        triggers.into_iter().filter(|(_, sql)| !LATEST_SCHEMA.contains(&format!("{sql};\n")));
    Ok(strangers.map(|(name, _)| name).collect())
}

/// A copy in memory of an older database, migrated there. A reader must not change the file, and may lack the
/// permission.
fn migrated_copy(path: &Path, old: &Connection) -> Result<Connection, StoreError> {
    check_admissible(path, old)?;
    let mut copy = in_memory_copy(path, old)?;
    migrate(path, &mut copy)?;
    copy.pragma_update(None, "query_only", true).in_file(path)?;
    Ok(copy)
}

/// A copy of a database in memory.
fn in_memory_copy(path: &Path, original: &Connection) -> Result<Connection, StoreError> {
    let mut copy = Connection::open_in_memory().in_file(path)?;
    let step = Backup::new(original, &mut copy).and_then(|backup| backup.step(ALL_PAGES));
    if !matches!(step.in_file(path)?, StepResult::Done) {
        return Err(StoreError::Busy { file: path.to_owned() });
    }
    configure(&copy).in_file(path)?;
    Ok(copy)
}

/// Copies a database as it was before the transaction of a writer, page by page, damaged pages too, to a new file. That
/// has its name once it is whole.
pub(super) fn back_up(path: &Path, copy: &Path) -> Result<(), StoreError> {
    let not_made = |reason| StoreError::Open { file: copy.to_owned(), reason };
    let part = tempfile::Builder::new()
        .prefix(".matdb-")
        .tempfile_in(folder_of(copy))
        .map_err(not_made)?
        .into_temp_path();
    let original = connect(path, OpenFlags::SQLITE_OPEN_READ_WRITE).in_file(path)?;
    let mut to = connect(&part, OpenFlags::SQLITE_OPEN_READ_WRITE).in_file(copy)?;
    let step = Backup::new(&original, &mut to).and_then(|backup| backup.step(ALL_PAGES));
    if !matches!(step.in_file(copy)?, StepResult::Done) {
        return Err(StoreError::Busy { file: path.to_owned() });
    }
    drop(to);
    let permissions =
        fs::metadata(path).and_then(|found| fs::set_permissions(&part, found.permissions()));
    permissions.map_err(not_made)?;
    part.persist_noclobber(copy).map_err(|error| not_made(error.error))
}

/// Size of the file; 0 when there is none.
fn size_bytes(path: &Path) -> Result<u64, StoreError> {
    let file = path.to_owned();
    match fs::metadata(path) {
        // SQLite treats a file of one byte as empty and would overwrite it.
        Ok(found) if found.is_file() && found.len() != 1 => Ok(found.len()),
        Ok(_) => Err(StoreError::Foreign { file }),
        Err(reason) if reason.kind() == io::ErrorKind::NotFound => Ok(0),
        Err(reason) => Err(StoreError::Open { file, reason }),
    }
}

/// Refuses an empty or lost file that has a log: SQLite would take the pages of the log for a database.
fn check_not_lost(path: &Path) -> Result<(), StoreError> {
    let log = beside(path, "-wal");
    let has_log = log.symlink_metadata().is_ok_and(|found| found.len() > 0);
    // Another program may have made the database meanwhile, and its log.
    if has_log && size_bytes(path)? == 0 {
        return Err(StoreError::Lost { file: path.to_owned(), log });
    }
    Ok(())
}

/// Opens an existing file of any program so that nothing in it can change.
fn open_unchanged(path: &Path) -> Result<Connection, StoreError> {
    let [log_exists, journal_exists] =
        ["-wal", "-journal"].map(|ending| beside(path, ending).symlink_metadata().is_ok());
    // A read-only connection leaves an empty log behind; a writable one removes it. But a writable one also writes an
    // existing log into the database and follows a journal, which may name any file for removal.
    let flags = if log_exists || journal_exists {
        OpenFlags::SQLITE_OPEN_READ_ONLY
    } else {
        OpenFlags::SQLITE_OPEN_READ_WRITE
    };
    let conn = connect(path, flags).in_file(path)?;
    if !log_exists && !journal_exists && conn.is_readonly("main").in_file(path)? {
        return open_unwritable(path);
    }
    conn.pragma_update(None, "query_only", true).in_file(path)?;
    match conn.query_row("SELECT count(*) FROM sqlite_schema", [], |_| Ok(())) {
        // Where no log can be created, no program writes: the file may be read as one that never changes.
        Err(error) if is_interrupted(&error) => {
            Err(StoreError::Interrupted { file: path.to_owned() })
        }
        Err(error) if !log_exists && !journal_exists && needs_log(&error) => {
            open_immutable(path).in_file(path)
        }
        Err(error) if log_exists && needs_log(&error) => {
            Err(StoreError::Log { file: path.to_owned(), log: beside(path, "-wal") })
        }
        result => {
            // It may be the log of another database, and its pages replace those of this one.
            let result = result.and_then(|()| if log_exists { check_pages(&conn) } else { Ok(()) });
            match result {
                Err(error) if is_damage(&error) => {
                    drop(conn);
                    return Err(damaged_at_once(path, error)?);
                }
                result => result.in_file(path)?,
            }
            check_length(path, &conn)?;
            Ok(conn)
        }
    }
}

/// The error for a file whose pages cannot be read: its end is missing, or its log contradicts it.
fn damaged_at_once(path: &Path, error: rusqlite::Error) -> Result<StoreError, StoreError> {
    let (file, log) = (path.to_owned(), beside(path, "-wal"));
    if log.symlink_metadata().is_ok_and(|found| found.len() > 0) {
        return Ok(StoreError::OtherLog { file, log, problem: reason(&error) });
    }
    let bytes = size_bytes(path)?;
    Ok(match said_bytes(path) {
        Some(said) if u64::try_from(said).is_ok_and(|said| said > bytes) => {
            StoreError::CutOff { file, bytes, said }
        }
        _ => StoreError::new(path, error),
    })
}

/// The length that the header of a file states (sqlite.org/fileformat.html, "The Database Header"). Reading the file
/// past SQLite ends the locks that this process has on it.
fn said_bytes(path: &Path) -> Option<i64> {
    let mut header = [0; 32];
    fs::File::open(path).ok()?.read_exact(&mut header).ok()?;
    let page = u16::from_be_bytes([header[16], header[17]]);
    let page_bytes = if page == 1 { 65536 } else { i64::from(page) };
    let pages = u32::from_be_bytes([header[28], header[29], header[30], header[31]]);
    Some(page_bytes * i64::from(pages))
}

/// Opens a file that this user may not write and that has no log. A log created for reading would stay, with this user
/// as its owner, and could stop others from writing.
fn open_unwritable(path: &Path) -> Result<Connection, StoreError> {
    let nobody_writes = fs::metadata(path).is_ok_and(|found| found.permissions().readonly());
    let before = state(path)?;
    let conn = open_immutable(path).in_file(path)?;
    conn.pragma_update(None, "query_only", true).in_file(path)?;
    // No program writes, or no log can be created: as in `open_unchanged`.
    if nobody_writes || !may_add_to(folder_of(path)) {
        check_length(path, &conn)?;
        return Ok(conn);
    }
    // Another user may write meanwhile: read a copy of one moment.
    let copy = check_length(path, &conn).and_then(|()| in_memory_copy(path, &conn));
    if before != state(path)? {
        return Err(StoreError::Busy { file: path.to_owned() });
    }
    let copy = copy?;
    copy.pragma_update(None, "query_only", true).in_file(path)?;
    Ok(copy)
}

/// Size and time of a file, and whether it has a log: a writer changes at least one of them.
fn state(path: &Path) -> Result<(u64, Option<SystemTime>, bool), StoreError> {
    let found =
        fs::metadata(path).map_err(|reason| StoreError::Open { file: path.to_owned(), reason })?;
    let has_log = beside(path, "-wal").symlink_metadata().is_ok();
    Ok((found.len(), found.modified().ok(), has_log))
}

/// Whether this user may create files in a folder. On systems where this is unknown: yes.
#[cfg(target_os = "linux")]
fn may_add_to(folder: &Path) -> bool {
    rustix::fs::access(folder, rustix::fs::Access::WRITE_OK).is_ok()
}

#[cfg(not(target_os = "linux"))]
fn may_add_to(_: &Path) -> bool {
    true
}

/// Refuses a truncated file. SQLite notices only when it reads a missing page, and fills half a page with zeros.
fn check_length(path: &Path, conn: &Connection) -> Result<(), StoreError> {
    let said = stated_bytes(conn).in_file(path)?;
    // New pages may still be in the log alone. The log is looked at first: if there is none, the file has them.
    let has_log = beside(path, "-wal").symlink_metadata().is_ok_and(|found| found.len() > 0);
    let bytes = size_bytes(path)?;
    if has_log || u64::try_from(said).is_ok_and(|said| said <= bytes) {
        return Ok(());
    }
    Err(StoreError::CutOff { file: path.to_owned(), bytes, said })
}

/// A path that SQLite reads as a path: a bare `file:a.sqlite` would be a URI, and `:memory:` would not be a file.
pub(super) fn literal_path(path: &Path) -> PathBuf {
    Path::new(".").join(path)
}

fn connect(path: &Path, flags: OpenFlags) -> rusqlite::Result<Connection> {
    connect_by_name(&literal_path(path), flags)
}

/// Opens a database by a name in SQLite's sense, which may be a URI.
fn connect_by_name(name: &Path, flags: OpenFlags) -> rusqlite::Result<Connection> {
    let conn = Connection::open_with_flags(name, flags | OpenFlags::SQLITE_OPEN_NO_MUTEX)?;
    conn.busy_timeout(PATIENCE)?;
    configure(&conn)?;
    Ok(conn)
}

/// Sets the options and functions that every connection needs.
fn configure(conn: &Connection) -> rusqlite::Result<()> {
    conn.pragma_update(None, "foreign_keys", true)?;
    // Protects from hostile files: no functions with side effects, no cell beyond its page, no direct writes to the
    // schema (sqlite.org/security.html).
    conn.pragma_update(None, "trusted_schema", false)?;
    conn.pragma_update(None, "cell_size_check", true)?;
    conn.set_db_config(DbConfig::SQLITE_DBCONFIG_DEFENSIVE, true)?;
    // Enough for every statement that writes a material. A smaller cache would parse most of them again for each
    // material.
    conn.set_prepared_statement_cache_capacity(64);
    // The views in decibels call it, and the bundled SQLite does not have it.
    let flags = FunctionFlags::SQLITE_UTF8
        | FunctionFlags::SQLITE_DETERMINISTIC
        | FunctionFlags::SQLITE_INNOCUOUS;
    conn.create_scalar_function("log10", 1, flags, |context| {
        context.get::<Option<f64>>(0).map(|x| x.map(f64::log10))
    })
}

fn open_immutable(path: &Path) -> rusqlite::Result<Connection> {
    let escaped: String = path.as_os_str().as_encoded_bytes().iter().map(escape).collect();
    let flags = OpenFlags::SQLITE_OPEN_READ_ONLY | OpenFlags::SQLITE_OPEN_URI;
    connect_by_name(Path::new(&format!("file:{escaped}?immutable=1")), flags)
}

fn escape(byte: &u8) -> String {
    match byte {
        b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'/' | b'.' | b'-' | b'_' => {
            char::from(*byte).to_string()
        }
        _ => format!("%{byte:02x}"),
    }
}

fn needs_log(error: &rusqlite::Error) -> bool {
    matches!(error.sqlite_error_code(), Some(ErrorCode::CannotOpen | ErrorCode::ReadOnly))
}

/// Whether the error says that a journal next to the file must be rolled back.
fn is_interrupted(error: &rusqlite::Error) -> bool {
    let code = error.sqlite_error().map(|failure| failure.extended_code);
    code == Some(rusqlite::ffi::SQLITE_READONLY_ROLLBACK)
}

/// Whether the journal of a database ends with the name of another journal, which SQLite would remove
/// (sqlite.org/fileformat.html, "The Rollback Journal"). Journals of matdb never do. True for a journal that cannot be
/// read.
fn names_another_file(path: &Path) -> bool {
    const MAGIC: [u8; 8] = [0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];
    journal_end(path).map_or(true, |end| end == MAGIC)
}

/// The last eight bytes of the journal of a database.
fn journal_end(path: &Path) -> io::Result<[u8; 8]> {
    let mut journal = fs::File::open(beside(path, "-journal"))?;
    let mut end = [0; 8];
    journal.seek(io::SeekFrom::End(-8))?;
    journal.read_exact(&mut end)?;
    Ok(end)
}

fn beside(path: &Path, ending: &str) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(ending);
    name.into()
}

/// Number of a database's schema, 0 when it is empty.
fn schema_of(path: &Path, conn: &Connection) -> Result<usize, StoreError> {
    let header = "SELECT application_id, user_version, (SELECT count(*) FROM sqlite_schema)
                  FROM pragma_application_id, pragma_user_version";
    let (application_id, schema, tables): (i64, i64, i64) = conn
        .query_row(header, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?)))
        .in_file(path)?;
    let (file, known) = (path.to_owned(), LATEST);
    match (application_id, usize::try_from(schema), tables) {
        (0, Ok(0), 0) => Ok(0),
        (APPLICATION_ID, Ok(schema), _) if schema > known => {
            Err(StoreError::Newer { file, found: schema, known })
        }
        (APPLICATION_ID, Ok(schema), _) if schema > 0 => Ok(schema),
        _ => Err(StoreError::Foreign { file }),
    }
}

fn migrate(path: &Path, conn: &mut Connection) -> Result<(), StoreError> {
    if schema_of(path, conn)? == 0 {
        make(path, conn)?;
    }
    let schema = schema_of(path, conn)?;
    if schema == LATEST {
        return Ok(());
    }
    match obstacle(path, conn)? {
        // Another program may have migrated the file meanwhile.
        Some(_) if schema_of(path, conn)? == LATEST => return Ok(()),
        Some(obstacle) => return Err(obstacle),
        None => {}
    }
    let torn = torn_revisions(conn).in_file(path)?;
    let backlog = Backlog { schema, torn };
    // Some migrations make SQLite check every row of a table and every reference. Wrong rows must not close the file.
    conn.pragma_update(None, "ignore_check_constraints", true).in_file(path)?;
    conn.pragma_update(None, "foreign_keys", false).in_file(path)?;
    let outcome = Migrations::new(schemas(backlog).into()).to_latest(conn);
    conn.pragma_update(None, "foreign_keys", true).in_file(path)?;
    conn.pragma_update(None, "ignore_check_constraints", false).in_file(path)?;
    // Another program may have migrated the file while this one waited.
    if schema_of(path, conn)? == LATEST {
        return Ok(());
    }
    outcome.map_err(|error| match error {
        rusqlite_migration::Error::RusqliteError { err, .. } => StoreError::new(path, err),
        error => StoreError::Migration { file: path.to_owned(), error },
    })
}

/// The error for a file of an older schema with a table, index or view of somebody else that has a name of the latest
/// schema, or refers to a table that is not one any more.
fn obstacle(path: &Path, conn: &Connection) -> Result<Option<StoreError>, StoreError> {
    let error = |object: &str, problem| {
        let (file, object) = (path.to_owned(), object.to_owned());
        Some(StoreError::InTheWay { file, object, problem })
    };
    let mut old = Connection::open_in_memory().in_file(path)?;
    configure(&old).in_file(path)?;
    let file = path.to_owned();
    let migrations = Migrations::new(schemas(Backlog { schema: LATEST, torn: Vec::new() }).into());
    let made = migrations.to_version(&mut old, schema_of(path, conn)?);
    made.map_err(|error| StoreError::Migration { file, error })?;
    let latest = in_memory()?;
    let ours = schema(&latest).in_file(path)?;
    let (old, latest) = (names(&old).in_file(path)?, names(&latest).in_file(path)?);
    let has = |objects: &[[String; 2]], wanted: &str| {
        objects.iter().any(|[_, name]| name.eq_ignore_ascii_case(wanted))
    };
    let is_of_later = |object: &&[Option<String>; 4]| {
        ours.contains(object) && !has(&old, object[1].as_deref().unwrap_or_default())
    };
    let there = schema(conn).in_file(path)?;
    if let Some([Some(kind), Some(name), ..]) = there.iter().find(is_of_later) {
        return Ok(Some(StoreError::WrongSchema {
            file: path.to_owned(),
            said: schema_of(path, conn)?,
            object: format!("{kind} `{name}`"),
        }));
    }
    for [kind, name] in names(conn).in_file(path)?.iter().filter(|[_, name]| !has(&old, name)) {
        let object = format!("the {kind} `{name}`");
        if has(&latest, name) || PASSING.contains(&name.as_str()) {
            let problem = format!("matdb needs the name of {object}, which it has not made");
            return Ok(error(&object, problem));
        }
        let sql = "SELECT \"table\" FROM pragma_foreign_key_list(?1)";
        let parents: Vec<String> = rows(conn, sql, [name], |row| row.get(0)).in_file(path)?;
        for parent in parents {
            let is_table = latest.iter().any(|[kind, name]| *name == parent && kind == "table");
            if has(&old, &parent) && !is_table {
                let problem = format!("{object}, which matdb has not made, refers to `{parent}`");
                return Ok(error(&object, problem));
            }
        }
    }
    Ok(None)
}

/// Kind and name of every object of a schema.
fn names(conn: &Connection) -> rusqlite::Result<Vec<[String; 2]>> {
    let sql = "SELECT type, name FROM sqlite_schema ORDER BY rowid";
    rows(conn, sql, [], |row| Ok([row.get(0)?, row.get(1)?]))
}

/// Creates the tables of the latest schema in an empty file, unless another program has done so.
fn make(path: &Path, conn: &mut Connection) -> Result<(), StoreError> {
    let tx = conn.transaction_with_behavior(TransactionBehavior::Immediate).in_file(path)?;
    if schema_of(path, &tx)? == 0 {
        tx.execute_batch(LATEST_SCHEMA).in_file(path)?;
        tx.pragma_update(None, "application_id", APPLICATION_ID).in_file(path)?;
        tx.pragma_update(None, "user_version", LATEST as i64).in_file(path)?;
    }
    tx.commit().in_file(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An empty database that went through all schemas.
    fn migrated() -> Connection {
        let mut conn = Connection::open_in_memory().unwrap();
        configure(&conn).unwrap();
        let backlog = Backlog { schema: 0, torn: Vec::new() };
        Migrations::new(schemas(backlog).into()).to_latest(&mut conn).unwrap();
        conn
    }

    /// Statements that make a database anew, each as SQLite keeps it, and the rows of `unit`.
    fn statements(conn: &Connection) -> Vec<String> {
        let sql = "SELECT sql FROM sqlite_schema WHERE sql IS NOT NULL AND name NOT IN
                       (SELECT name FROM pragma_table_list WHERE type = 'shadow') ORDER BY rowid";
        let units =
            "SELECT format('INSERT INTO unit VALUES (%Q, %Q, %Q)', column_name, ucum, meaning)
                     FROM unit ORDER BY column_name";
        let of = |sql: &str| -> Vec<String> {
            let mut statement = conn.prepare(sql).unwrap();
            let texts = statement.query_map([], |row| row.get(0)).unwrap();
            texts.map(Result::unwrap).collect()
        };
        [of(sql), of(units)].concat()
    }

    #[test]
    fn a_new_file_is_what_all_schemas_make_of_an_empty_one() {
        assert_eq!(statements(&in_memory().unwrap()), statements(&migrated()));
        let number = |name| -> i64 {
            in_memory().unwrap().pragma_query_value(None, name, |row| row.get(0)).unwrap()
        };
        assert_eq!(["application_id", "user_version"].map(number), [APPLICATION_ID, LATEST as i64]);
    }

    #[test]
    #[ignore = "writes src/store/schema.sql; run it when a schema is added"]
    fn write_the_latest_schema() {
        let head = "-- The latest schema in one piece, written by a test: see `latest.rs`. Change\n\
                    -- migrations/ instead.\n\n";
        let text = statements(&migrated()).join(";\n\n") + ";\n";
        fs::write(
            concat!(env!("CARGO_MANIFEST_DIR"), "/src/store/schema.sql"),
            head.to_owned() + &text,
        )
        .unwrap();
    }

    #[test]
    fn the_schemas_make_a_database_that_is_known_as_ours() {
        assert_eq!(
            schema_of(Path::new(":memory:"), &Connection::open_in_memory().unwrap()).unwrap(),
            0
        );
        assert_eq!(schema_of(Path::new(":memory:"), &migrated()).unwrap(), LATEST);
    }

    #[test]
    fn the_views_in_decibels_work_without_another_sqlite() {
        let conn = in_memory().unwrap();
        let sql = "SELECT log10(100), log10(NULL), (SELECT count(sigma0_db) FROM v_curves)";
        let row: (f64, Option<f64>, u32) =
            conn.query_row(sql, [], |row| Ok((row.get(0)?, row.get(1)?, row.get(2)?))).unwrap();
        assert_eq!(row, (2.0, None, 0));
    }

    #[test]
    fn every_schema_says_why_and_is_listed() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/migrations");
        let mut names: Vec<_> = fs::read_dir(folder).unwrap().map(|f| f.unwrap().path()).collect();
        names.sort();
        assert_eq!(names.len(), LATEST);
        for (number, name) in (1..).zip(names) {
            let stem = name.file_stem().unwrap().to_str().unwrap();
            assert!(stem.starts_with(&format!("{number:04}_")), "{stem}");
            assert!(fs::read_to_string(&name).unwrap().starts_with("-- Why: "), "{stem}");
        }
    }

    #[test]
    fn a_file_name_may_hold_anything() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("50 % of #1?mode=memory&ü.sqlite");
        drop(writable(&path).unwrap());
        assert_eq!(schema_of(&path, &open_immutable(&path).unwrap()).unwrap(), LATEST);
    }
}
