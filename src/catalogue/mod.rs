//! A database as a catalogue that others can read, trust and cite: [`publish`] writes a static site
//! and, beside it, the data in open formats.
//!
//! Only what the database says goes in, and nothing of the machine or the hour: the same database and
//! the same [`About`] give the same bytes.

mod about;
mod error;
mod folder;
mod publish;
mod site;

pub use about::{About, AboutError};
pub use error::CatalogueError;
pub use folder::Folder;
pub use publish::{Published, publish};
