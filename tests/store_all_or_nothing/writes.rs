//! What the tests of this program write, and what a database then holds.

use std::fs;
use std::path::{Path, PathBuf};

use matdb::adopt::Withdrawal;
use matdb::catalogue::Import;
use matdb::material::{Activity, Material, Status};
use matdb::report::CATALOGUE_VIEW;
use matdb::setup::Database;
use matdb::store::{Store, StoreError};

use crate::support::database::{change, contents, is_sound, sound, with_effects};
use crate::support::root;

fn changed(slug: &str) -> Material {
    change(with_effects(slug))
}

/// An error of any call.
pub type Failure = Box<dyn std::error::Error>;

/// A call that writes.
#[derive(Clone, Copy, Debug)]
pub enum Write {
    /// Opening a file that is not there.
    Make,
    /// Opening a file of the first schema.
    Migrate,
    /// Adding a material that is not there.
    Add,
    /// Adding a revision.
    Revise,
    /// Withdrawing a material.
    Withdraw,
    /// Removing a material with two revisions.
    Remove,
    /// Taking a material with two revisions, and one more, over from another database.
    Import,
}

pub const WRITES: [Write; 7] = [
    Write::Make,
    Write::Migrate,
    Write::Add,
    Write::Revise,
    Write::Withdraw,
    Write::Remove,
    Write::Import,
];

/// Why the material is withdrawn.
const REASON: &str = "the trihedral was dented";

/// A file of the first schema.
fn first_schema() -> PathBuf {
    root().join("tests/fixtures/schema-0001.sqlite")
}

/// The database beside another from which materials are taken over.
fn theirs(ours: &Path) -> PathBuf {
    ours.with_file_name("theirs.sqlite")
}

/// Names and sizes of the files of a database's folder, bytes.
fn sizes(path: &Path) -> Vec<(std::ffi::OsString, u64)> {
    let entries = fs::read_dir(path.parent().unwrap()).unwrap().map(Result::unwrap);
    entries.map(|entry| (entry.file_name(), entry.metadata().unwrap().len())).collect()
}

impl Write {
    /// Makes the database as it is before.
    pub fn prepare(self, path: &Path) {
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
        if let Write::Revise | Write::Withdraw | Write::Remove = self {
            store.add([&with_effects("subject")]).unwrap();
        }
        if let Write::Remove = self {
            store.add([&changed("subject")]).unwrap();
        }
    }

    /// Writes; `arm` is called when all that only reads is done.
    pub fn run(self, path: &Path, arm: impl Fn()) -> Result<(), Failure> {
        if let Write::Import = self {
            let by = Activity { command: "import".to_owned(), inputs: vec![], origin: None };
            let import = Import::open(&theirs(path), CATALOGUE_VIEW)?;
            let mut ours = Store::open(path)?;
            let plan = import.plan(Some(&ours), None)?;
            arm();
            return Ok(import.take(&mut ours, &plan, &by)?);
        }
        arm();
        if let Write::Withdraw = self {
            let (name, reason) = ("subject".to_owned(), REASON.to_owned());
            let withdrawal = Withdrawal { name, reason, superseded_by: None };
            withdrawal.store(&Database::new(Some(path)))?;
            return Ok(());
        }
        let mut store = Store::open(path)?;
        match self {
            Write::Make | Write::Migrate | Write::Withdraw | Write::Import => {}
            Write::Add => drop(store.add([&with_effects("subject")])?),
            Write::Revise => drop(store.add([&changed("subject")])?),
            Write::Remove => drop(store.remove([&"subject".parse().unwrap()])?),
        }
        Ok(())
    }

    pub fn before_and_after(self) -> [Vec<Material>; 2] {
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
            Write::Withdraw => {
                let status = Status::Withdrawn { reason: REASON.to_owned() };
                let withdrawn = Material { status, ..first.clone() };
                [vec![bystander.clone(), first.clone()], vec![bystander, first, withdrawn]]
            }
            Write::Remove => [vec![bystander, first, second], alone],
        }
    }

    /// Whether the database is sound and holds the state after; fails when it holds neither.
    pub fn is_done(self, path: &Path, when: &str) -> bool {
        // A reader leaves an interrupted write as it is, and says so.
        let seen = match Store::open_existing(path) {
            Ok(_) => Some(contents(path)),
            Err(StoreError::Interrupted { .. }) => None,
            Err(error) => panic!("{self:?} {when}: {error}, beside {:?}", sizes(path)),
        };
        // What a read-only look leaves alone, the next writer must be able to take over.
        drop(Store::open(path).unwrap_or_else(|error| panic!("{self:?} {when}: {error}")));
        assert!(is_sound(path), "{self:?} {when}");
        let held = contents(path);
        assert!(seen.is_none_or(|seen| seen == held), "{self:?} {when}");
        let [before, after] = self.before_and_after();
        assert!(held == before || held == after, "{self:?} {when}: neither before nor after");
        held == after
    }
}

/// One number for the campaign, or the other for its sample.
pub fn by_campaign(campaign: usize, sample: usize) -> usize {
    if std::env::var_os("MATDB_TEST_MANY_FAULTS").is_some() { campaign } else { sample }
}
