//! The latest schema.

/// Its number.
pub(super) const LATEST: usize = 16;

/// The latest schema in one step, equal to all migrations of an empty file. One step is faster, since SQLite parses
/// every table again after each change. `cargo test --lib store::connect -- --ignored` writes it.
pub(super) const LATEST_SCHEMA: &str = include_str!("schema.sql");
