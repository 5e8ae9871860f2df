//! Bytes to plain data and back. Nothing here knows a radar, a scene or a material.
//!
//! Every reader takes the bytes of a whole file and is total: any input gives a value or a
//! [`FormatError`] that says where and how to mend it. No reader allocates more than a small
//! multiple of the bytes it was given, whatever a header claims.

pub mod base64;
pub mod columns;
pub mod csv;
pub mod effect;
mod error;
pub mod exr;
pub mod figure;
pub mod glb;
pub mod grey_png;
mod guard;
pub mod html;
mod light;
mod line;
mod mesh_format;
pub mod npy;
pub mod obj;
pub mod ply;
pub mod points;
pub mod stl;
pub mod text;
pub mod words;
pub mod xml;

pub use columns::ColumnNames;
pub use effect::EffectEntry;
pub use error::FormatError;
pub use mesh_format::MeshFormat;
pub use points::{PointFormat, PointTable};
