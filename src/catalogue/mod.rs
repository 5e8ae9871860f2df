//! A database as a catalogue that others can read, trust and cite: [`publish_with`] writes a static site
//! and, beside it, the data in open formats.
//!
//! Only what the database says goes in, and nothing of the machine or the hour: the same database and
//! the same [`About`] give the same bytes.

mod about;
mod api;
mod bibtex;
mod check_store;
mod contents;
mod diff;
mod error;
pub mod exchange;
mod folder;
mod import;
mod layout;
mod leaves;
mod licence;
mod listing;
mod near;
mod nearest;
mod problem;
mod publish;
mod publish_notices;
mod read;
mod rebuild;
mod records;
mod references;
mod schema;
mod site;
mod spectrum;
mod tables;
mod units;
mod verify;
mod view;

pub use about::{About, AboutError};
pub use check_store::{CheckCount, Refit, StoreCheck};
pub use diff::{CurveChange, Diff, Field, Levels};
pub use error::CatalogueError;
pub use folder::{Checksum, Folder};
pub use import::{Import, ImportSummary, MaterialPlan, Outcome};
pub use near::{Distance, Probe, Rank};
pub use nearest::Nearest;
pub use problem::Problem;
pub use publish::{PublishSummary, publish_with};
pub use references::{Citable, Credit, Reference, references};
pub use spectrum::{Spectrum, spectra};
pub use verify::{Verification, verify_with};
pub use view::CatalogueView;
