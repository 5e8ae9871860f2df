//! PLY: triangle meshes and tables of points, in and out.
//!
//! All three encodings are read. The header's grammar is the `ply-rs` crate's; the counts it claims
//! are checked against the file's length before anything is allocated, and the data are then read
//! here, straight from the bytes.
//!
//! Where writers differ, the readers are lenient: `vertex_index` or `vertex_indices`, any type of
//! number for any property, further properties and elements, CRLF line ends, comments that are not
//! UTF-8, bytes after the last element. In ascii files an entry may take several lines, and ends with
//! one. They insist on names
//! that are declared once, and on elements that have properties.

mod body;
mod header;
mod mesh;
mod parallel;
mod table;

pub use header::Scalar;
pub use mesh::{read_mesh, write_mesh};
pub use table::{Column, Table, read_table, write_table};
