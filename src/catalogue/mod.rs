//! A database as a catalogue that others can read, trust and cite: [`publish`] writes a static site
//! and, beside it, the data in open formats.
//!
//! Only what the database says goes in, and nothing of the machine or the hour: the same database and
//! the same [`About`] give the same bytes.

mod about;
mod api;
mod bibtex;
mod diff;
mod error;
pub mod exchange;
mod folder;
mod import;
mod layout;
mod leaves;
mod near;
mod nearest;
mod publish;
mod records;
mod references;
mod schema;
mod site;
mod stage;
mod tables;
mod units;
mod verify;

pub use about::{About, AboutError};
pub use diff::{CurveChange, Diff, Field, Levels};
pub use error::CatalogueError;
pub use folder::{Folder, Sum};
pub use import::{Import, Imported, Outcome, Taken};
pub use near::{Distance, Probe, Rank};
pub use nearest::Nearest;
pub use publish::{Published, named_licences, publish};
pub use references::{Citable, Credit, Reference, references};
pub use tables::HAS_PARQUET;
pub use verify::{
    Checked, OTHER_UNITS, Problem, Verified, check_store, derived, verify, without_report,
};
