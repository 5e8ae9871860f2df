//! The database of materials: a file of SQLite, and the only SQL in the crate.
//!
//! Plain [`Material`](crate::material::Material)s go in and come out, bit for bit; a revision once written never changes.
//! Every call that writes is one transaction: it happens as a whole or not at all, whenever the
//! program or the machine stops. Several programs may use a file at once.
//!
//! ```
//! use matdb::material::builtin;
//! use matdb::store::{Addition, Store};
//! # let folder = tempfile::tempdir().unwrap();
//! # let path = folder.path().join("materials.sqlite");
//! let paint = builtin::get("mannequin-paint").unwrap().unwrap();
//! let mut store = Store::open(&path).unwrap();
//! assert_eq!(store.add([&paint]).unwrap(), [Addition::New]);
//! assert_eq!(store.get(&paint.slug, None).unwrap().unwrap().material, paint);
//! ```

mod connect;
mod copy;
mod damage;
mod database;
mod edit;
mod error;
mod find;
mod latest;
mod law;
mod open;
mod own_schema;
mod pages;
mod query;
mod read;
mod record;
mod repair;
mod results;
mod row_check;
mod rows;
mod tables;
mod unreachable;
mod write;

pub use database::Store;
pub use error::StoreError;
pub use find::{Filter, Match, OutlineEntry};
pub use repair::Repair;
pub use results::{Addition, Removal, RevisionSummary, StoredRevision, Summary};
pub use row_check::{Difference, RowCheck};
pub use tables::{Cell, Column, ColumnKind, Reference, Table};
