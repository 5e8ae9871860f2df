//! The check of a whole database, after a repair where one is wanted.

use std::collections::HashMap;
use std::path::PathBuf;

use serde::Serialize;

use crate::brdf::{BeyondBeam, Excess, VIEWING_RAD};
use crate::catalogue::{CheckCount, Problem, Refit, StoreCheck};
use crate::error::Error;
use crate::material::{Lobes, builtin};
use crate::setup::Database;
use crate::store::{Filter, OutlineEntry, Repair, Store, StoreError};

/// How a database is checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DatabaseCheck {
    /// Whether what can be repaired is repaired first.
    pub repair: bool,
}

/// How far a check has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CheckProgress {
    /// The check begins.
    Begin {
        /// Number of revisions to be checked.
        revisions: usize,
    },
    /// One more revision was checked.
    Revision,
}

/// What was checked, and what is wrong.
#[derive(Clone, Debug, Serialize)]
pub struct CheckReport {
    /// Number of revisions.
    pub revisions: usize,
    /// Number of their curves.
    pub curves: usize,
    /// Number of fits that were made again.
    pub fits: usize,
    /// Materials of which scenes render lobes of the surface alone.
    pub surface_lobes: usize,
    /// What a person should not overlook, and is not wrong with the database.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub notices: Vec<String>,
    /// What was repaired, a sentence each.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub repaired: Vec<String>,
    /// A copy of the database as it was before the repair.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub copy: Option<PathBuf>,
    /// What is wrong, and what could not be repaired.
    pub findings: Vec<Problem>,
}

impl DatabaseCheck {
    /// Checks every revision of the database, and makes every fit again.
    ///
    /// # Errors
    /// A database that is not there, cannot be opened or cannot be written by a repair, or whose pages are damaged beyond
    /// repair. What else is wrong in it is a finding.
    pub fn run(
        self,
        database: &Database,
        progress: &mut dyn FnMut(CheckProgress),
    ) -> Result<CheckReport, Error> {
        self.check(database, progress).map_err(|error| match error {
            // Damage that ends a repair or a check is not a reason to try them again.
            Error::Store(StoreError::Corrupt { file, problem }) => {
                Error::Store(StoreError::BeyondRepair { file, problem })
            }
            error => error,
        })
    }

    fn check(
        self,
        database: &Database,
        progress: &mut dyn FnMut(CheckProgress),
    ) -> Result<CheckReport, Error> {
        let mut repair = Repair::default();
        if self.repair && database.read()?.is_some() {
            repair = database.write()?.repair(&builtin::all()?)?;
        }
        let Some(store) = database.read()? else {
            return Err(Error::NoDatabase { path: database.path().to_owned() });
        };
        let file = database.path().display().to_string();
        let revisions = store.revision_count().unwrap_or_default();
        progress(CheckProgress::Begin { revisions });
        let mut findings = Vec::new();
        for problem in repair.failed {
            findings.push(Problem { place: file.clone(), problem });
        }
        let CheckCount { revisions, curves, fits, .. } = StoreCheck {
            name: &file,
            refit: Refit::All,
            report: &mut |found| findings.push(found),
            advance: &mut || progress(CheckProgress::Revision),
        }
        .run(&store);
        // What is damaged is a finding already; a disk that fails only now is not.
        let mut unread = |error: StoreError| {
            if findings.is_empty() {
                findings.push(Problem { place: file.clone(), problem: error.to_string() });
            }
        };
        let outlines = store.outlines(&Filter::default()).unwrap_or_else(|error| {
            unread(error);
            Vec::new()
        });
        let mut notices = too_much(&store, &outlines, &mut unread);
        notices.extend(store.lost_revisions().unwrap_or_else(|error| {
            unread(error);
            Vec::new()
        }));
        let is_of_surface = |line: &&OutlineEntry| line.lobes == Lobes::Surface;
        Ok(CheckReport {
            revisions,
            curves,
            fits,
            surface_lobes: outlines.iter().filter(is_of_surface).count(),
            notices,
            repaired: repair.mended,
            copy: repair.copy,
            findings,
        })
    }
}

/// What tells rendered laws apart: the hash of the model, and the bits of its range of angles.
type RenderedLaw = (Option<[u8; 16]>, [u64; 2]);

/// What is too much of a law.
#[derive(Clone, Copy, Default)]
struct TooMuch {
    excess: Option<Excess>,
    /// Through the beam of the default radar.
    beyond: Option<BeyondBeam>,
}

/// Materials of which scenes render a law that reflects more than it receives, or more than a mirror through the
/// default radar's beam, a sentence each. `unread` gets the errors.
fn too_much(
    store: &Store,
    outlines: &[OutlineEntry],
    unread: &mut dyn FnMut(StoreError),
) -> Vec<String> {
    let mut known: HashMap<RenderedLaw, TooMuch> = HashMap::new();
    let mut notices = Vec::new();
    for OutlineEntry { slug, model_hash, theta_rad, .. } in outlines {
        let of_law = known.entry((*model_hash, theta_rad.map(f64::to_bits))).or_insert_with(|| {
            let rendered = slug.parse().ok().and_then(|wanted| {
                store.rendered(&wanted).unwrap_or_else(|error| {
                    unread(error);
                    None
                })
            });
            rendered.map_or_else(TooMuch::default, |(law, theta_rad)| TooMuch {
                excess: Excess::of(&law, theta_rad),
                beyond: BeyondBeam::of(&law, VIEWING_RAD),
            })
        });
        let words = of_law.excess.map(|excess| excess.words()).into_iter();
        let words = words.chain(of_law.beyond.map(|beyond| beyond.words(VIEWING_RAD)));
        notices.extend(words.map(|words| format!("the law of `{slug}` {words}")));
    }
    notices
}
