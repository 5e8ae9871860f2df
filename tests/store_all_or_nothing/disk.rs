//! A disk that fails: a file system of SQLite's (a VFS, sqlite.org/vfs.html) before the ordinary one. It counts the calls
//! of a thread that is [watched](watch) and lets one of them fail, or all from one on. It also keeps what a disk
//! holds for certain at each moment, so that the power can be cut.
//!
//! After a power cut a file holds what it held when it was last synchronised, and of the later changes any: each is
//! there, or not, or the first sectors of it are. A file that was never synchronised may be missing.
//! The model of SQLite's own tests (sqlite.org/atomiccommit.html, 9.4 to 9.6).

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::ffi::{CStr, OsStr, c_char, c_int, c_void};
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use rusqlite::ffi::{self, sqlite3_file, sqlite3_filename, sqlite3_int64, sqlite3_vfs};

/// A disk writes sectors of these bytes as a whole.
const SECTOR: usize = 512;

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// The call fails, and later ones succeed.
    Once,
    /// A write stores half of its bytes and fails; later calls succeed.
    Half,
    /// This write stores half of its bytes and fails, and so do all later ones: the disk is full.
    Full,
    /// The power is cut, and all later calls fail.
    PowerCut,
    /// The same with a disk that says that it has synchronised and has not.
    LyingDisk,
}

/// Kind of a call.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Call {
    /// What changes the disk: writes, truncations, deletions, new files, and synchronisation.
    Change,
    Other,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Verdict {
    Pass,
    Half,
    Fail,
}

/// A change that may be lost.
#[derive(Clone, Debug)]
enum Change {
    Write { at: usize, bytes: Vec<u8> },
    Truncate { length: usize },
    Remove,
}

/// A file of the disk.
#[derive(Clone, Debug, Default)]
struct Held {
    /// What it holds for certain; `None` when it may be missing.
    certain: Option<Vec<u8>>,
    changes: Vec<Change>,
}

/// The disk of a watched thread.
#[derive(Debug)]
pub struct Disk {
    fault: Fault,
    /// Number of the call that fails, from 1.
    at: u64,
    /// Calls so far that the fault could have hit.
    pub calls: u64,
    files: BTreeMap<PathBuf, Held>,
}

thread_local! {
    static DISK: RefCell<Option<Disk>> = const { RefCell::new(None) };
}

/// Runs something with a fault at call `at`; the disk as it was then.
pub fn watch<T>(fault: Fault, at: u64, run: impl FnOnce() -> T) -> (T, Disk) {
    register();
    let disk = Disk { fault, at, calls: 0, files: BTreeMap::new() };
    DISK.with_borrow_mut(|watched| *watched = Some(disk));
    let result = run();
    (result, DISK.with_borrow_mut(Option::take).unwrap())
}

impl Disk {
    /// Whether the fault has happened.
    pub fn has_failed(&self) -> bool {
        self.calls >= self.at
    }

    fn verdict(&mut self, call: Call) -> Verdict {
        let counts = match self.fault {
            Fault::Once => true,
            Fault::Half | Fault::Full => call == Call::Change,
            Fault::PowerCut | Fault::LyingDisk => call == Call::Change || self.calls >= self.at,
        };
        if !counts {
            return Verdict::Pass;
        }
        self.calls += 1;
        match (self.fault, self.calls.cmp(&self.at)) {
            (_, std::cmp::Ordering::Less) => Verdict::Pass,
            (Fault::Once, std::cmp::Ordering::Equal) => Verdict::Fail,
            (Fault::Half | Fault::Full, std::cmp::Ordering::Equal) => Verdict::Half,
            (Fault::Once | Fault::Half, _) => Verdict::Pass,
            (Fault::Full | Fault::PowerCut | Fault::LyingDisk, _) => Verdict::Fail,
        }
    }

    fn held(&mut self, path: &Path) -> &mut Held {
        self.files
            .entry(path.to_owned())
            .or_insert_with(|| Held { certain: fs::read(path).ok(), changes: Vec::new() })
    }

    fn synchronise(&mut self, path: &Path) {
        if self.fault != Fault::LyingDisk {
            let held = self.held(path);
            held.certain = held.after(|_| Fate::Kept);
            held.certain.get_or_insert_default();
            held.changes.clear();
        }
    }

    /// Makes the files what a disk may hold after the cut; the seed chooses among what it may.
    pub fn leave_after_cut(&self, seed: u64) {
        let mut state = seed;
        let mut fate = |sectors: usize| match random(&mut state) % 4 {
            0 if sectors > 1 => Fate::Torn(1 + (random(&mut state) as usize) % (sectors - 1)),
            0 | 1 => Fate::Lost,
            _ => Fate::Kept,
        };
        for (path, held) in &self.files {
            match held.after(&mut fate) {
                Some(bytes) => fs::write(path, bytes).unwrap(),
                None => drop(fs::remove_file(path)),
            }
            // The index of a log is shared memory.
            let mut index = path.as_os_str().to_owned();
            index.push("-shm");
            let _ = fs::remove_file(index);
        }
    }
}

/// What becomes of a change.
enum Fate {
    Kept,
    Lost,
    /// So many sectors of it are written.
    Torn(usize),
}

impl Held {
    fn after(&self, mut fate: impl FnMut(usize) -> Fate) -> Option<Vec<u8>> {
        let mut file = self.certain.clone();
        if file.is_none() && !self.changes.is_empty() && matches!(fate(1), Fate::Lost) {
            return None;
        }
        for change in &self.changes {
            let sectors = match change {
                Change::Write { bytes, .. } => bytes.len().div_ceil(SECTOR),
                Change::Truncate { .. } | Change::Remove => 1,
            };
            let fate = fate(sectors);
            match (change, fate) {
                // The name stays with the old file, and later changes are those of another one.
                (Change::Remove, Fate::Lost) => break,
                (Change::Remove, _) => file = None,
                (_, Fate::Lost) => {}
                (Change::Truncate { length }, _) => file.get_or_insert_default().resize(*length, 0),
                (Change::Write { at, bytes }, fate) => {
                    let most =
                        if let Fate::Torn(sectors) = fate { sectors * SECTOR } else { usize::MAX };
                    write_at(file.get_or_insert_default(), *at, &bytes[..bytes.len().min(most)]);
                }
            }
        }
        file
    }
}

fn write_at(file: &mut Vec<u8>, at: usize, bytes: &[u8]) {
    let end = at + bytes.len();
    file.resize(file.len().max(end), 0);
    file[at..end].copy_from_slice(bytes);
}

/// SplitMix64 (Steele, Lea and Flood 2014, doi:10.1145/2660193.2660195).
fn random(state: &mut u64) -> u64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mixed = (*state ^ (*state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    mixed ^ (mixed >> 31)
}

/// What becomes of a call; without a disk that is watched it passes.
fn verdict(call: Call) -> Verdict {
    DISK.with_borrow_mut(|disk| disk.as_mut().map_or(Verdict::Pass, |disk| disk.verdict(call)))
}

/// Keeps what a call has changed.
fn note(path: Option<&PathBuf>, note: impl FnOnce(&mut Disk, &Path)) {
    DISK.with_borrow_mut(|disk| {
        if let (Some(disk), Some(path)) = (disk, path) {
            note(disk, path);
        }
    });
}

/// A file of ours. SQLite allots the bytes of the ordinary one behind it.
#[repr(C)]
struct File {
    base: sqlite3_file,
    /// `None` for a temporary file.
    path: Option<PathBuf>,
}

/// Pointers of the ordinary file system; it lives as long as the process.
struct Ordinary(*mut sqlite3_vfs);
// SAFETY: SQLite's own file systems may be used from all threads.
unsafe impl Send for Ordinary {}
// SAFETY: as above.
unsafe impl Sync for Ordinary {}

static ORDINARY: OnceLock<Ordinary> = OnceLock::new();

fn ordinary() -> *mut sqlite3_vfs {
    ORDINARY.get().unwrap().0
}

/// Makes the disk the file system of all connections that are opened from now on.
fn register() {
    ORDINARY.get_or_init(|| {
        // SAFETY: SQLite's ordinary file system is there once it is initialised, and never goes away. The copy is
        // never freed.
        unsafe {
            assert_eq!(ffi::sqlite3_initialize(), ffi::SQLITE_OK);
            let ordinary = ffi::sqlite3_vfs_find(std::ptr::null());
            let mut failing = *ordinary;
            failing.zName = c"failing".as_ptr();
            failing.pNext = std::ptr::null_mut();
            failing.szOsFile += size_of::<File>() as c_int;
            failing.xOpen = Some(open);
            failing.xDelete = Some(delete);
            failing.xAccess = Some(access);
            failing.xFullPathname = Some(full_path_name);
            let failing = Box::leak(Box::new(failing));
            assert_eq!(ffi::sqlite3_vfs_register(failing, 1), ffi::SQLITE_OK);
            Ordinary(ordinary)
        }
    });
}

/// The ordinary file behind ours.
///
/// # Safety
/// `file` must be one that SQLite allotted for this file system.
unsafe fn behind(file: *mut sqlite3_file) -> *mut sqlite3_file {
    // SAFETY: `szOsFile` made room for both, and `File` is aligned as pointers are.
    unsafe { file.cast::<File>().add(1).cast() }
}

/// # Safety
/// As for [`behind`]; the file must be open.
unsafe fn path_of<'a>(file: *mut sqlite3_file) -> Option<&'a PathBuf> {
    // SAFETY: `open` has written the file.
    unsafe { (*file.cast::<File>()).path.as_ref() }
}

/// Calls a method of the ordinary file.
macro_rules! ordinary_file {
    ($method:ident, $file:expr $(, $argument:expr)*) => {{
        // SAFETY: the file is open, and the arguments are SQLite's own.
        unsafe {
            let behind = behind($file);
            (*(*behind).pMethods).$method.unwrap()(behind $(, $argument)*)
        }
    }};
}

unsafe extern "C" fn open(
    _: *mut sqlite3_vfs,
    name: sqlite3_filename,
    file: *mut sqlite3_file,
    flags: c_int,
    out: *mut c_int,
) -> c_int {
    // SAFETY: SQLite gives a name that ends with a zero byte, or none, and room for both files.
    unsafe {
        let path = (!name.is_null())
            .then(|| PathBuf::from(OsStr::from_bytes(CStr::from_ptr(name).to_bytes())));
        file.cast::<File>()
            .write(File { base: sqlite3_file { pMethods: std::ptr::null() }, path: None });
        let makes =
            flags & ffi::SQLITE_OPEN_CREATE != 0 && path.as_ref().is_some_and(|p| !p.exists());
        if verdict(if makes { Call::Change } else { Call::Other }) != Verdict::Pass {
            return ffi::SQLITE_CANTOPEN;
        }
        note(path.as_ref(), |disk, path| {
            disk.held(path);
        });
        let status = (*ordinary()).xOpen.unwrap()(ordinary(), name, behind(file), flags, out);
        if status == ffi::SQLITE_OK {
            (*file.cast::<File>()).path = path;
            (*file).pMethods = &METHODS;
        }
        status
    }
}

unsafe extern "C" fn delete(_: *mut sqlite3_vfs, name: *const c_char, sync: c_int) -> c_int {
    // SAFETY: SQLite gives a name that ends with a zero byte.
    let path = unsafe { PathBuf::from(OsStr::from_bytes(CStr::from_ptr(name).to_bytes())) };
    if verdict(Call::Change) != Verdict::Pass {
        return ffi::SQLITE_IOERR_DELETE;
    }
    note(Some(&path), |disk, path| {
        disk.held(path).changes.push(Change::Remove);
        if sync != 0 && disk.fault != Fault::LyingDisk {
            *disk.held(path) = Held::default();
        }
    });
    // SAFETY: as above.
    unsafe { (*ordinary()).xDelete.unwrap()(ordinary(), name, sync) }
}

unsafe extern "C" fn access(
    _: *mut sqlite3_vfs,
    name: *const c_char,
    flags: c_int,
    out: *mut c_int,
) -> c_int {
    match verdict(Call::Other) {
        // SAFETY: the arguments are SQLite's own.
        Verdict::Pass => unsafe { (*ordinary()).xAccess.unwrap()(ordinary(), name, flags, out) },
        _ => ffi::SQLITE_IOERR_ACCESS,
    }
}

unsafe extern "C" fn full_path_name(
    _: *mut sqlite3_vfs,
    name: *const c_char,
    most: c_int,
    out: *mut c_char,
) -> c_int {
    // SAFETY: the arguments are SQLite's own.
    unsafe { (*ordinary()).xFullPathname.unwrap()(ordinary(), name, most, out) }
}

unsafe extern "C" fn close(file: *mut sqlite3_file) -> c_int {
    let status = ordinary_file!(xClose, file);
    // SAFETY: `open` has written the path, and SQLite uses the file no more.
    unsafe { std::ptr::drop_in_place(&raw mut (*file.cast::<File>()).path) };
    status
}

unsafe extern "C" fn read(
    file: *mut sqlite3_file,
    into: *mut c_void,
    length: c_int,
    at: sqlite3_int64,
) -> c_int {
    match verdict(Call::Other) {
        Verdict::Pass => ordinary_file!(xRead, file, into, length, at),
        _ => ffi::SQLITE_IOERR_READ,
    }
}

unsafe extern "C" fn write(
    file: *mut sqlite3_file,
    from: *const c_void,
    length: c_int,
    at: sqlite3_int64,
) -> c_int {
    let verdict = verdict(Call::Change);
    let stored = match verdict {
        Verdict::Pass => length,
        Verdict::Half => length / 2,
        Verdict::Fail => 0,
    };
    // SAFETY: SQLite gives `length` bytes.
    let bytes = unsafe { std::slice::from_raw_parts(from.cast::<u8>(), length as usize) };
    // A write at which the power is cut may be there, or a part of it.
    let is_cut = DISK.with_borrow(|disk| {
        disk.as_ref().is_some_and(|disk| {
            matches!(disk.fault, Fault::PowerCut | Fault::LyingDisk) && disk.calls == disk.at
        })
    });
    let noted = if is_cut { length } else { stored } as usize;
    // SAFETY: the file is open.
    note(unsafe { path_of(file) }, |disk, path| {
        let change = Change::Write { at: at as usize, bytes: bytes[..noted].to_vec() };
        disk.held(path).changes.push(change);
    });
    let status =
        if stored == 0 { ffi::SQLITE_OK } else { ordinary_file!(xWrite, file, from, stored, at) };
    let is_full = DISK.with_borrow(|disk| disk.as_ref().is_some_and(|d| d.fault == Fault::Full));
    match verdict {
        Verdict::Pass => status,
        _ if is_full => ffi::SQLITE_FULL,
        _ => ffi::SQLITE_IOERR_WRITE,
    }
}

unsafe extern "C" fn truncate(file: *mut sqlite3_file, length: sqlite3_int64) -> c_int {
    if verdict(Call::Change) != Verdict::Pass {
        return ffi::SQLITE_IOERR_TRUNCATE;
    }
    // SAFETY: the file is open.
    note(unsafe { path_of(file) }, |disk, path| {
        disk.held(path).changes.push(Change::Truncate { length: length as usize });
    });
    ordinary_file!(xTruncate, file, length)
}

unsafe extern "C" fn sync(file: *mut sqlite3_file, flags: c_int) -> c_int {
    if verdict(Call::Change) != Verdict::Pass {
        return ffi::SQLITE_IOERR_FSYNC;
    }
    // SAFETY: the file is open.
    note(unsafe { path_of(file) }, Disk::synchronise);
    // The disk of these tests is the one in memory: the ordinary one need not wait for its own.
    let _ = flags;
    ffi::SQLITE_OK
}

unsafe extern "C" fn file_size(file: *mut sqlite3_file, out: *mut sqlite3_int64) -> c_int {
    match verdict(Call::Other) {
        Verdict::Pass => ordinary_file!(xFileSize, file, out),
        _ => ffi::SQLITE_IOERR_FSTAT,
    }
}

unsafe extern "C" fn lock(file: *mut sqlite3_file, level: c_int) -> c_int {
    match verdict(Call::Other) {
        Verdict::Pass => ordinary_file!(xLock, file, level),
        _ => ffi::SQLITE_IOERR_LOCK,
    }
}

unsafe extern "C" fn unlock(file: *mut sqlite3_file, level: c_int) -> c_int {
    ordinary_file!(xUnlock, file, level)
}

unsafe extern "C" fn check_reserved_lock(file: *mut sqlite3_file, out: *mut c_int) -> c_int {
    match verdict(Call::Other) {
        Verdict::Pass => ordinary_file!(xCheckReservedLock, file, out),
        _ => ffi::SQLITE_IOERR_CHECKRESERVEDLOCK,
    }
}

unsafe extern "C" fn file_control(
    file: *mut sqlite3_file,
    what: c_int,
    argument: *mut c_void,
) -> c_int {
    ordinary_file!(xFileControl, file, what, argument)
}

unsafe extern "C" fn sector_size(file: *mut sqlite3_file) -> c_int {
    ordinary_file!(xSectorSize, file)
}

unsafe extern "C" fn device_characteristics(file: *mut sqlite3_file) -> c_int {
    ordinary_file!(xDeviceCharacteristics, file)
}

unsafe extern "C" fn shared_map(
    file: *mut sqlite3_file,
    page: c_int,
    size: c_int,
    extend: c_int,
    out: *mut *mut c_void,
) -> c_int {
    match verdict(Call::Other) {
        Verdict::Pass => ordinary_file!(xShmMap, file, page, size, extend, out),
        _ => ffi::SQLITE_IOERR_SHMMAP,
    }
}

unsafe extern "C" fn shared_lock(
    file: *mut sqlite3_file,
    at: c_int,
    n: c_int,
    flags: c_int,
) -> c_int {
    let is_unlock = flags & ffi::SQLITE_SHM_UNLOCK != 0;
    if !is_unlock && verdict(Call::Other) != Verdict::Pass {
        return ffi::SQLITE_IOERR_SHMLOCK;
    }
    ordinary_file!(xShmLock, file, at, n, flags)
}

unsafe extern "C" fn shared_barrier(file: *mut sqlite3_file) {
    ordinary_file!(xShmBarrier, file);
}

unsafe extern "C" fn shared_unmap(file: *mut sqlite3_file, remove: c_int) -> c_int {
    ordinary_file!(xShmUnmap, file, remove)
}

/// Without those of version 3: no page is read past `read`.
static METHODS: ffi::sqlite3_io_methods = ffi::sqlite3_io_methods {
    iVersion: 2,
    xClose: Some(close),
    xRead: Some(read),
    xWrite: Some(write),
    xTruncate: Some(truncate),
    xSync: Some(sync),
    xFileSize: Some(file_size),
    xLock: Some(lock),
    xUnlock: Some(unlock),
    xCheckReservedLock: Some(check_reserved_lock),
    xFileControl: Some(file_control),
    xSectorSize: Some(sector_size),
    xDeviceCharacteristics: Some(device_characteristics),
    xShmMap: Some(shared_map),
    xShmLock: Some(shared_lock),
    xShmBarrier: Some(shared_barrier),
    xShmUnmap: Some(shared_unmap),
    xFetch: None,
    xUnfetch: None,
};
